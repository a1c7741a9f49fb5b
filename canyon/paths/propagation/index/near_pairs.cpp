#include "canyon/paths/propagation/index/near_pairs.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/paths/propagation/index/clear_rays.hpp"

namespace canyon::propagation {

using Eigen::Vector3d;

void NearPairs::hold(const FacetSet& set, const BeamIndex& beams, const Vector3d& antenna,
                     std::span<const Vector3d> directions, double reach_m) {
  set_ = &set;
  beams_ = &beams;
  reach_m_ = reach_m;
  if (!stay_.begins(antenna, directions)) return;
  bins_.build(stay_.directions());
  beams.gather(antenna, reach_m + StationaryWindow::kAntennas.reach_m(), blocks_);
  entries_.clear();
  matches_.clear();
}

NearPairs::Matches NearPairs::back_facets(std::uint32_t facet) {
  const auto at = std::lower_bound(entries_.begin(), entries_.end(), facet,
                                   [](const Entry& entry, std::uint32_t of) { return entry.facet < of; });
  if (at != entries_.end() && at->facet == facet)
    return {true, std::span(matches_).subspan(at->begin, at->end - at->begin)};
  const Facet& mirror = set_->facets()[facet];
  const double height = mirror.normal.dot(stay_.centre()) - mirror.offset;
  if (height < 1.1 * StationaryWindow::kAntennas.extent_m(mirror.normal)) return {};
  const Beam beam = make_beam(mirror, stay_.centre() - 2 * height * mirror.normal, height, reach_m_,
                              StationaryWindow::kAntennas);
  beams_->find(beam, blocks_, bins_, nullptr, found_, StationaryWindow::kSpread);
  Entry entry{facet, static_cast<std::uint32_t>(matches_.size()), 0};
  matches_.insert(matches_.end(), found_.begin(), found_.end());
  entry.end = static_cast<std::uint32_t>(matches_.size());
  entries_.insert(at, entry);
  return {true, found_};
}

namespace {

/// Cosine, along an edge, of the direction to a point `along_m` from the foot of a line.
double cosine_of(double along_m, double distance_m) {
  const double range = std::hypot(along_m, distance_m);
  return range > 0 ? along_m / range : 0;
}

}  // namespace

void NearBends::hold(const EdgeSet& set, const Vector3d& antenna, std::span<const Vector3d> directions,
                     double reach_m, double clearance_m) {
  if (!stay_.begins(antenna, directions)) return;
  see(set, reach_m, clearance_m);
  if (found_.size() < directions.size()) found_.resize(directions.size());
  for (FoundPairs& found : found_) found.max_excess_m = -1;
}

/// The excess E of a path around an infinite edge is leg |e - s|^2 / 2, e the direction of the leg to it. It
/// is stationary: a motion of the antenna changes it by (s - e) . dA, a motion of the satellite by leg (e -
/// s) . ds. So its root changes by at most |dA| / sqrt(2 leg) and sqrt(leg / 2) |ds|.
void NearBends::see(const EdgeSet& set, double reach_m, double clearance_m) {
  const double radius = StationaryWindow::kAntennas.reach_m();
  set.gather(stay_.centre(), reach_m + radius, clearance_m - radius, near_);
  root_m_.assign(near_.low.size(), 0);
  for (std::size_t k = 0; k < near_.edge.size(); ++k) {
    const Edge& edge = set.edges()[near_.edge[k]];
    const Vector3d to_start = edge.start - stay_.centre();
    const double start = to_start.dot(edge.direction);
    const double distance_m = (to_start - start * edge.direction).norm();
    const double nearest = distance_m - radius, farthest = distance_m + radius;
    const double low = start - radius, high = start + edge.length_m + radius;
    const bool certain = nearest > 0.1;
    const double least =
        certain ? cosine_of(low, low > 0 ? farthest : nearest) - StationaryWindow::kSpread - 1e-6 : -2;
    const double maximum =
        certain ? cosine_of(high, high > 0 ? nearest : farthest) + StationaryWindow::kSpread + 1e-6 : 2;
    near_.low[k] = static_cast<float>(least);
    near_.high[k] = static_cast<float>(maximum);
    root_m_[k] =
        static_cast<float>(certain ? radius / std::sqrt(2 * nearest) +
                                         1.1 * StationaryWindow::kSpread * std::sqrt(reach_m / 2) + 1e-3
                                   : 1e6);
  }
}

std::span<const std::uint32_t> NearBends::of(std::uint32_t satellite, double max_excess_m) {
  FoundPairs& found = found_[satellite];
  if (found.max_excess_m == max_excess_m) return found.edges;
  found.max_excess_m = max_excess_m;
  found.edges.clear();
  static thread_local std::vector<float> excess_m;
  static thread_local std::vector<std::uint8_t> marks;
  excess_m.resize(root_m_.size());
  const double root = std::sqrt(max_excess_m);
  for (std::size_t k = 0; k < root_m_.size(); ++k)
    excess_m[k] = near_.rounded_up((root + root_m_[k]) * (root + root_m_[k]));
  mark_diffracting(near_, stay_.directions()[satellite], excess_m, StationaryWindow::kSpread, marks);
  for_each_mark(marks.data(), marks.size(), [&](std::size_t k) { found.edges.push_back(near_.edge[k]); });
  return found.edges;
}

}  // namespace canyon::propagation
