#include "canyon/paths/propagation/first_order.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;

/// Facets are gathered for antennas within this distance of a point, if successive antennas are so close.
constexpr double kNearby_m = 8;

}  // namespace

std::span<const FirstOrderSearch::FoundPaths> FirstOrderSearch::trace(
    const raytrace::RayScene& scene, std::span<const PosedFacets> sets, const Vector3d& antenna,
    std::span<const Vector3d> directions, const ReflectionLimits& limits, CachedFacets* kept) {
  found_.clear();
  for (const PosedFacets& set : sets) find(scene, set, antenna, directions, limits, kept);
  sort_and_drop_doubles();
  keep_clear(scene, antenna, directions);
  return found_;
}

/// The facets of a set near an antenna in its frame.
const NearFacets& FirstOrderSearch::gather(const PosedFacets& set, const Vector3d& here, double reach_m,
                                           CachedFacets* kept) {
  if (kept != nullptr && set.pose.is_own()) {
    // An antenna that hardly moved is expected to continue like that.
    const bool again = (here - kept->antenna).norm() < kNearby_m / 4;
    kept->antenna = here;
    if ((here - kept->facets.centre).norm() <= kept->facets.radius_m) return kept->facets;
    if (again) {
      set.facets->gather(here, kNearby_m, reach_m, kept->facets);
      return kept->facets;
    }
  }
  set.facets->gather(here, 0, reach_m, near_);
  return near_;
}

/// Appends the image construction's paths for every facet of one set.
void FirstOrderSearch::find(const raytrace::RayScene& scene, const PosedFacets& set, const Vector3d& antenna,
                            std::span<const Vector3d> directions, const ReflectionLimits& limits,
                            CachedFacets* kept) {
  const SetPose& pose = set.pose;
  const Vector3d here = pose.moved_back(antenna);
  FacingFacets& facing = pose.is_own() ? facing_of_city_ : facing_of_instance_;
  const NearFacets& near = gather(set, here, limits.reach_m, kept);
  facing.fill(near, here, limits.clearance_m);
  if (facing.facet.empty()) return;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Vector3d towards = pose.rotated_to_local(directions[i]);
    mark_reflecting(facing, towards, limits.min_cosine, limits.reach_m, marks_);
    for_each_mark(marks_.data(), marks_.size(), [&](std::size_t k) {
      // Again in doubles, with the facet's true outline.
      const Facet& facet = set.facets->facets()[facing.facet[k]];
      const double cosine = facet.normal.dot(towards);
      if (cosine < limits.min_cosine) return;
      const double height = facet.normal.dot(here) - facet.offset;
      if (height <= limits.clearance_m + 2 * facet.deviation) return;
      const double leg = height / cosine;
      if (leg > limits.reach_m) return;
      const Vector3d point = here - 2 * height * facet.normal + leg * towards;
      const auto triangle = set.facets->triangle_at(facet, point);
      if (!triangle) return;

      FoundPaths& f = found_.emplace_back();
      f.satellite = static_cast<std::uint32_t>(i);
      f.cosine = cosine;
      f.normal = pose.rotated(facet.normal);
      f.path.kind = PathKind::Reflected;
      f.path.order = 1;
      f.path.excess_m = 2 * height * cosine;
      f.path.point = pose.moved(point);
      f.path.arrival = directions[i] - 2 * cosine * f.normal;
      f.path.incidence_count = 1;
      f.path.incidences[0].incidence_rad = std::acos(std::min(1.0, cosine));
      f.path.triangle = *triangle;
      f.path.instance = set.instance;
      f.path.reflector = reflector_id(PathKind::Reflected, {set.instance, facing.facet[k]});
      f.lift_m = scene.surface_offset_m(f.path.point) + facet.deviation;
    });
  }
}

/// Sorts by satellite and excess path, and removes duplicate reflections at the same point of the same plane:
/// common walls of two buildings, facets that meet at the reflection point.
void FirstOrderSearch::sort_and_drop_doubles() {
  std::sort(found_.begin(), found_.end(), [](const FoundPaths& a, const FoundPaths& b) {
    return std::tie(a.satellite, a.path.excess_m, a.path.instance, a.path.triangle) <
           std::tie(b.satellite, b.path.excess_m, b.path.instance, b.path.triangle);
  });
  drop_doubles(found_, 2 * kCoincidentPoint, [](const FoundPaths& a, const FoundPaths& b) {
    const Vector3d apart = b.path.point - a.path.point;
    const double along = kCoincidentPoint / std::min(a.cosine, b.cosine);
    return apart.squaredNorm() < along * along && std::abs(apart.dot(a.normal)) < kCoincidentPoint &&
           a.normal.dot(b.normal) > kSameNormal;
  });
}

/// Keeps paths with two clear legs. Points are lifted off their facet, so that the facet does not hide
/// itself; other surfaces nearer than that are ignored.
void FirstOrderSearch::keep_clear(const raytrace::RayScene& scene, const Vector3d& antenna,
                                  std::span<const Vector3d> directions) {
  const auto point = [](const FoundPaths& f) -> Vector3d { return f.path.point + f.lift_m * f.normal; };
  clear_rays_.keep(scene, found_, scene.surface_offset_m(antenna), [&](const FoundPaths& f) {
    const Vector3d leg = point(f) - antenna;
    const double range = leg.norm();
    return raytrace::Ray{antenna, leg / range, range};
  });
  clear_rays_.keep(scene, found_, 0, [&](const FoundPaths& f) {
    return raytrace::Ray{point(f), directions[f.satellite]};
  });
}

}  // namespace canyon::propagation
