#include "canyon/propagation/index/near_pairs.hpp"

#include <algorithm>

namespace canyon::propagation {

using Eigen::Vector3d;

void NearPairs::hold(const FacetSet& set, const BeamIndex& beams, const Vector3d& antenna,
                     std::span<const Vector3d> directions, double reach_m) {
  set_ = &set;
  beams_ = &beams;
  reach_m_ = reach_m;
  if (!stay_.begins(antenna, directions)) return;
  bins_.build(stay_.directions());
  beams.gather(antenna, reach_m + Stay::kAntennas.reach_m(), blocks_);
  entries_.clear();
  matches_.clear();
}

NearPairs::Matches NearPairs::behind(std::uint32_t facet) {
  const auto at = std::lower_bound(entries_.begin(), entries_.end(), facet,
                                   [](const Entry& entry, std::uint32_t of) { return entry.facet < of; });
  if (at != entries_.end() && at->facet == facet)
    return {true, std::span(matches_).subspan(at->begin, at->end - at->begin)};
  const Facet& mirror = set_->facets()[facet];
  const double height = mirror.normal.dot(stay_.centre()) - mirror.offset;
  if (height < 1.1 * Stay::kAntennas.extent_m(mirror.normal)) return {};
  const Beam beam =
      make_beam(mirror, stay_.centre() - 2 * height * mirror.normal, height, reach_m_, Stay::kAntennas);
  beams_->find(beam, blocks_, bins_, nullptr, found_, Stay::kSpread);
  Entry entry{facet, static_cast<std::uint32_t>(matches_.size()), 0};
  matches_.insert(matches_.end(), found_.begin(), found_.end());
  entry.end = static_cast<std::uint32_t>(matches_.size());
  entries_.insert(at, entry);
  return {true, found_};
}

}  // namespace canyon::propagation
