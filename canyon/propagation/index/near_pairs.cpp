#include "canyon/propagation/index/near_pairs.hpp"

#include <algorithm>
#include <cmath>

namespace canyon::propagation {

using Eigen::Vector3d;

namespace {

/// Whether a place is in `share` of NearPairs::kAntennas about another.
bool is_near(const Vector3d& place, const Vector3d& other, double share) {
  const Vector3d apart = place - other;
  return apart.head<2>().norm() <= share * NearPairs::kAntennas.radius_m &&
         std::abs(apart.z()) <= share * NearPairs::kAntennas.half_height_m;
}

}  // namespace

bool NearPairs::holds(const FacetSet& set, const Vector3d& antenna, std::span<const Vector3d> directions,
                      double reach_m) const {
  if (number_ != set.number() || reach_m_ != reach_m || directions_.size() != directions.size() ||
      !is_near(antenna, centre_, 1)) {
    return false;
  }
  return std::equal(
      directions.begin(), directions.end(), directions_.begin(),
      [](const Vector3d& a, const Vector3d& b) { return (a - b).squaredNorm() < kSpread * kSpread; });
}

bool NearPairs::hold(const FacetSet& set, const BeamIndex& beams, const Vector3d& antenna,
                     std::span<const Vector3d> directions, double reach_m) {
  // A search about a cylinder costs about as much as two about its middle.
  const bool again = is_near(antenna, last_, 0.5);
  last_ = antenna;
  set_ = &set;
  beams_ = &beams;
  if (holds(set, antenna, directions, reach_m)) return true;
  if (!again) return false;
  number_ = set.number();
  reach_m_ = reach_m;
  centre_ = antenna;
  directions_.assign(directions.begin(), directions.end());
  bins_.build(directions_);
  beams.gather(antenna, reach_m + kAntennas.radius_m + kAntennas.half_height_m, blocks_);
  entries_.clear();
  matches_.clear();
  return true;
}

NearPairs::Matches NearPairs::behind(std::uint32_t facet) {
  const auto at = std::lower_bound(entries_.begin(), entries_.end(), facet,
                                   [](const Entry& entry, std::uint32_t of) { return entry.facet < of; });
  if (at != entries_.end() && at->facet == facet)
    return {true, std::span(matches_).subspan(at->begin, at->end - at->begin)};
  const Facet& mirror = set_->facets()[facet];
  const double height = mirror.normal.dot(centre_) - mirror.offset;
  if (height < 1.1 * kAntennas.extent_m(mirror.normal)) return {};
  const Beam beam = make_beam(mirror, centre_ - 2 * height * mirror.normal, height, reach_m_, kAntennas);
  beams_->find(beam, blocks_, bins_, nullptr, found_, kSpread);
  Entry entry{facet, static_cast<std::uint32_t>(matches_.size()), 0};
  matches_.insert(matches_.end(), found_.begin(), found_.end());
  entry.end = static_cast<std::uint32_t>(matches_.size());
  entries_.insert(at, entry);
  return {true, found_};
}

}  // namespace canyon::propagation
