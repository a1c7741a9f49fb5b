#include "canyon/propagation/first_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

#include "canyon/propagation/reflector_id.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Facets are gathered for antennas within this of a place, where one follows the other so nearby.
constexpr double kNearby_m = 8;

}  // namespace

std::span<const FirstOrderSearch::Found> FirstOrderSearch::trace(const raytrace::RayScene& scene,
                                                                 std::span<const PlacedFacets> sets,
                                                                 const Vector3d& antenna,
                                                                 std::span<const Vector3d> directions,
                                                                 const FirstOrderLimits& limits) {
  found_.clear();
  for (const PlacedFacets& set : sets) find(scene, set, antenna, directions, limits);
  drop_doubles();
  keep_clear(scene, antenna, directions);
  return found_;
}

/// Appends what the image construction gives for every facet of one set.
void FirstOrderSearch::find(const raytrace::RayScene& scene, const PlacedFacets& set, const Vector3d& antenna,
                            std::span<const Vector3d> directions, const FirstOrderLimits& limits) {
  const Isometry3d* pose = set.enu_from_set;
  const Vector3d here = pose != nullptr ? pose->inverse() * antenna : antenna;
  FacingFacets& facing = pose != nullptr ? facing_of_instance_ : facing_of_city_;
  NearFacets& near = pose != nullptr ? near_in_instance_ : near_in_city_;
  if (near.set != set.facets->number() || near.reach_m != limits.reach_m ||
      (here - near.centre).norm() > near.radius_m) {
    // Where the antenna has hardly moved, it will go on like that.
    const bool again = pose == nullptr && (here - last_antenna_).norm() < kNearby_m / 4;
    set.facets->gather(here, again ? kNearby_m : 0, limits.reach_m, near);
  }
  if (pose == nullptr) last_antenna_ = here;
  facing.fill(near, here, limits.clearance_m);
  if (facing.facet.empty()) return;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Vector3d towards =
        pose != nullptr ? Vector3d(pose->linear().transpose() * directions[i]) : directions[i];
    mark_reflecting(facing, towards, limits.min_cosine, limits.reach_m, marks_);
    for (std::size_t word = 0; word < marks_.size(); word += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, marks_.data() + word, 8);
      if (eight == 0) continue;
      for (std::size_t k = word; k < word + 8; ++k) {
        if (marks_[k] == 0) continue;
        // The same again in doubles, with the facet's true outline.
        const Facet& facet = set.facets->facets()[facing.facet[k]];
        const double cosine = facet.normal.dot(towards);
        if (cosine < limits.min_cosine) continue;
        const double height = facet.normal.dot(here) - facet.offset;
        if (height <= limits.clearance_m + 2 * facet.deviation) continue;
        const double leg = height / cosine;
        if (leg > limits.reach_m) continue;
        const Vector3d point = here - 2 * height * facet.normal + leg * towards;
        const auto triangle = set.facets->triangle_at(facet, point);
        if (!triangle) continue;

        Found& f = found_.emplace_back();
        f.satellite = static_cast<std::uint32_t>(i);
        f.cosine = cosine;
        f.normal = pose != nullptr ? Vector3d(pose->linear() * facet.normal) : facet.normal;
        f.path.kind = PathKind::Reflected;
        f.path.order = 1;
        f.path.excess_m = 2 * height * cosine;
        f.path.point = pose != nullptr ? Vector3d(*pose * point) : point;
        f.path.arrival = directions[i] - 2 * cosine * f.normal;
        f.path.incidence_count = 1;
        f.path.incidences[0].incidence_rad = std::acos(std::min(1.0, cosine));
        f.path.triangle = *triangle;
        f.path.instance = set.instance;
        f.path.reflector = reflector_id(PathKind::Reflected, {set.instance, facing.facet[k]});
        f.lift_m = scene.surface_offset_m(f.path.point) + facet.deviation;
      }
    }
  }
}

/// Sorts by satellite and excess path, and keeps one of several reflections at the same place of the same
/// plane: walls that two buildings share, facets that meet where the signal is reflected.
void FirstOrderSearch::drop_doubles() {
  std::sort(found_.begin(), found_.end(), [](const Found& a, const Found& b) {
    return std::tie(a.satellite, a.path.excess_m, a.path.instance, a.path.triangle) <
           std::tie(b.satellite, b.path.excess_m, b.path.instance, b.path.triangle);
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found_.size(); ++i) {
    bool seen = false;
    for (std::size_t k = kept; k-- > 0 && !seen;) {
      Found& other = found_[k];
      if (other.satellite != found_[i].satellite ||
          found_[i].path.excess_m - other.path.excess_m > 2 * kSamePlace) {
        break;
      }
      const Vector3d apart = found_[i].path.point - other.path.point;
      const double along = kSamePlace / std::min(other.cosine, found_[i].cosine);
      seen = apart.squaredNorm() < along * along && std::abs(apart.dot(other.normal)) < kSamePlace &&
             other.normal.dot(found_[i].normal) > kSameNormal;
      // Which of the two comes first may be a matter of rounding; the reflector's name must not be.
      if (seen) other.path.reflector = std::min(other.path.reflector, found_[i].path.reflector);
    }
    if (seen) continue;
    if (kept != i) found_[kept] = found_[i];
    ++kept;
  }
  found_.resize(kept);
}

/// Keeps what has two clear legs. Points are lifted off their facet, so that the facet does not hide itself;
/// anything else nearer than that is not seen.
void FirstOrderSearch::keep_clear(const raytrace::RayScene& scene, const Vector3d& antenna,
                                  std::span<const Vector3d> directions) {
  const auto point = [](const Found& f) -> Vector3d { return f.path.point + f.lift_m * f.normal; };
  clear_rays_.keep(scene, found_, scene.surface_offset_m(antenna), [&](const Found& f) {
    const Vector3d leg = point(f) - antenna;
    const double range = leg.norm();
    return raytrace::Ray{antenna, leg / range, range};
  });
  clear_rays_.keep(scene, found_, 0, [&](const Found& f) {
    return raytrace::Ray{point(f), directions[f.satellite]};
  });
}

}  // namespace canyon::propagation
