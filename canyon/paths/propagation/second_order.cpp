#include "canyon/paths/propagation/second_order.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace canyon::propagation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Number of facets whose hidden regions are used. More of them hide little more: in Tsim Sha Tsui 686 facets
/// face an antenna in the street; 8 leave 372 in view, 16 leave 323, 48 leave 226 (means over the drive).
constexpr std::size_t kOccluders = 48;
/// Outlines are tested only for points within this of the facet's bounds.
constexpr double kBoundsSlack = 1e-3;

bool within_bounds(const Facet& facet, const Vector3d& point) {
  for (int axis = 0; axis < 3; ++axis)  // most points fail at the first one
    if (point[axis] < facet.min[axis] - kBoundsSlack || point[axis] > facet.max[axis] + kBoundsSlack)
      return false;
  return true;
}

/// Whether a sphere intersects the cone of the beam: it is across cos - along sin from the cone's side.
bool meets(const Beam& beam, const Vector3d& centre, double radius) {
  const Vector3d d = centre - beam.apex;
  const double along = d.dot(beam.axis), room = radius + along * beam.sine, squared = d.squaredNorm();
  if (room < 0 || d.dot(beam.window) + radius < beam.window_m) return false;
  if (squared > (radius + beam.reach_m) * (radius + beam.reach_m)) return false;
  return (squared - along * along) * beam.cosine * beam.cosine <= room * room + 1e-9 * squared;
}

}  // namespace

/// A facet next to the antenna, with the image of the antenna in it. In ENU except `facet`.
struct SecondOrderSearch::MirrorFacet {
  const PosedFacets* set;
  std::size_t set_index;
  const Facet* facet;
  Vector3d normal;
  double height;
  Vector3d antenna;
  Beam beam;
};

std::span<const SecondOrderSearch::FoundPaths> SecondOrderSearch::trace(
    const raytrace::RayScene& scene, std::span<const PosedFacets> sets, const Vector3d& antenna,
    std::span<const Vector3d> directions, const ReflectionLimits& limits, const FacingFacets& facing_of_city,
    NearPairs* pairs) {
  found_.clear();
  near_pairs_ = pairs;
  facing_of_city_ = &facing_of_city;
  prepare(scene, sets, antenna, directions, limits);
  for (std::size_t i = 0; i < sets.size(); ++i) find_pairs(scene, sets, i, antenna, directions, limits);
  keep_clear(scene, antenna, directions);
  sort_and_drop_doubles(antenna);
  return found_;
}

void SecondOrderSearch::prepare(const raytrace::RayScene& scene, std::span<const PosedFacets> sets,
                                const Vector3d& antenna, std::span<const Vector3d> directions,
                                const ReflectionLimits& limits) {
  bins_.build(directions);
  if (near_pairs_ != nullptr)
    near_pairs_->hold(*sets[0].facets, *sets[0].beams, antenna, directions, limits.reach_m);
  hidden_regions_.clear();
  if (around_.size() < sets.size()) around_.resize(sets.size());
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const PosedFacets& set = sets[i];
    NearbySet& around = around_[i];
    around.centre = set.pose.moved(set.beams->centre());
    const double radius = set.beams->radius(), distance = (around.centre - antenna).norm();
    around.in_reach = radius > 0 && distance <= limits.reach_m + radius;
    around.hidden = false;
    if (!around.in_reach) continue;
    set.beams->gather(set.pose.moved_back(antenna), limits.reach_m, around.blocks);
    if (i == 0) {
      // Rays may pass just inside an outer edge: four times the lift of points off surfaces.
      set.occluders->hidden_regions(*set.facets, *facing_of_city_, antenna, kOccluders,
                                    4 * scene.surface_offset_m(antenna), occluders_, hidden_regions_);
    } else {
      around.hidden = is_hidden(around.centre - antenna, radius, hidden_regions_);
    }
  }
}

/// Appends the paths of all pairs whose facet next to the antenna is of one set.
void SecondOrderSearch::find_pairs(const raytrace::RayScene& scene, std::span<const PosedFacets> sets,
                                   std::size_t near_set, const Vector3d& antenna,
                                   std::span<const Vector3d> directions, const ReflectionLimits& limits) {
  const PosedFacets& set = sets[near_set];
  if (!around_[near_set].in_reach || around_[near_set].hidden) return;
  const Vector3d here = set.pose.moved_back(antenna);
  if (near_set == 0) {
    mark_hidden(*facing_of_city_, hidden_regions_, hidden_);
  } else {
    set.facets->gather(here, 0, limits.reach_m, near_);
    facing_.fill(near_, here, limits.clearance_m);
    hidden_.assign(facing_.facet.size(), 0);  // hidden regions are in the frame of the city
  }
  const FacingFacets& facing = near_set == 0 ? *facing_of_city_ : facing_;
  for (std::size_t k = 0; k < facing.facet.size(); ++k) {
    if (hidden_[k] != 0) continue;
    MirrorFacet near{&set, near_set, &set.facets->facets()[facing.facet[k]], {}, 0, antenna, {}};
    const Facet& facet = *near.facet;
    near.height = facet.normal.dot(here) - facet.offset;
    if (near.height <= limits.clearance_m + 2 * facet.deviation) continue;
    const Vector3d apex = here - 2 * near.height * facet.normal;
    near.normal = set.pose.rotated(facet.normal);
    std::size_t first_set = 0;
    if (near_set == 0 && near_pairs_ != nullptr) {
      near.beam.apex = apex;
      const NearPairs::Matches after = near_pairs_->back_facets(facing.facet[k]);
      if (after.held) {
        reflect(scene, near, set, after.matches, directions, limits);
        if (++first_set == sets.size()) continue;
      }
    }
    near.beam = make_beam(facet, apex, near.height, limits.reach_m);
    near.beam.apex = set.pose.moved(near.beam.apex);
    near.beam.axis = set.pose.rotated(near.beam.axis);
    near.beam.window = near.normal;
    for (Vector3d& side : near.beam.side) side = set.pose.rotated(side);
    if (near_set != 0) near.beam.low_z = -1, near.beam.high_z = 1;
    for (std::size_t i = first_set; i < sets.size(); ++i)
      if (around_[i].in_reach) find_far(scene, near, sets, i, directions, limits);
  }
}

/// Appends the paths of one facet next to the antenna and all facets of one set next to the satellites.
void SecondOrderSearch::find_far(const raytrace::RayScene& scene, const MirrorFacet& near,
                                 std::span<const PosedFacets> sets, std::size_t far_set,
                                 std::span<const Vector3d> directions, const ReflectionLimits& limits) {
  const PosedFacets& set = sets[far_set];
  NearbySet& around = around_[far_set];
  const SetPose& pose = set.pose;
  if (!pose.is_own() && !meets(near.beam, around.centre, set.beams->radius() + 1e-3)) return;
  Beam beam = near.beam;
  beam.apex = pose.moved_back(beam.apex);
  beam.axis = pose.rotated_to_local(beam.axis);
  beam.window = pose.rotated_to_local(beam.window);
  for (Vector3d& side : beam.side) side = pose.rotated_to_local(side);
  set.beams->find(beam, around.blocks, bins_, pose.get(), matches_);
  reflect(scene, near, set, matches_, directions, limits);
}

/// Appends the paths of one facet next to the antenna and facets of one set in directions that may fit.
void SecondOrderSearch::reflect(const raytrace::RayScene& scene, const MirrorFacet& near,
                                const PosedFacets& set, std::span<const BeamIndex::Match> matches,
                                std::span<const Vector3d> directions, const ReflectionLimits& limits) {
  const SetPose& pose = set.pose;
  const Vector3d apex = pose.moved_back(near.beam.apex);
  constexpr std::size_t kAhead = 6;  // facets are scattered in memory: prefetch distance
  const Facet* const facets = set.facets->facets().data();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (i + kAhead < matches.size()) __builtin_prefetch(&facets[matches[i + kAhead].facet]);
    const BeamIndex::Match& match = matches[i];
    const Facet& facet = facets[match.facet];
    const double height = facet.normal.dot(apex) - facet.offset;
    if (height <= 0) continue;
    for (std::uint64_t bits = match.directions; bits != 0; bits &= bits - 1) {
      const auto satellite = static_cast<std::size_t>(DirectionBins::kGroup) * match.group +
                             static_cast<std::size_t>(__builtin_ctzll(bits));
      const Vector3d& s = directions[satellite];
      const Vector3d towards = pose.rotated_to_local(s);
      // First the test that most pairs fail.
      const double far_cosine = facet.normal.dot(towards);
      if (far_cosine < limits.min_cosine) continue;
      const double total = height / far_cosine;
      if (total > limits.reach_m) continue;
      const Vector3d between = towards - 2 * far_cosine * facet.normal;  // the class comment's s'
      const Vector3d far_there = apex + total * between;
      if (!within_bounds(facet, far_there)) continue;
      const Vector3d onward = pose.rotated(between);
      const double cosine = near.normal.dot(onward);
      if (cosine < limits.min_cosine) continue;
      const double leg = near.height / cosine;
      // The heights of the points over the other facet's plane.
      if ((total - leg) * far_cosine <= limits.clearance_m + 2 * facet.deviation) continue;
      if ((total - leg) * cosine <= limits.clearance_m + 2 * near.facet->deviation) continue;
      const Vector3d point = near.beam.apex + leg * onward;
      const Vector3d there = near.set->pose.moved_back(point);
      if (!within_bounds(*near.facet, there)) continue;
      const auto triangle = near.set->facets->triangle_at(*near.facet, there);
      if (!triangle) continue;
      const auto far_triangle = set.facets->triangle_at(facet, far_there);
      if (!far_triangle) continue;

      FoundPaths& f = found_.emplace_back();
      f.satellite = static_cast<std::uint32_t>(satellite);
      f.cosine = cosine;
      f.far_cosine = far_cosine;
      f.normal = near.normal;
      f.far_normal = pose.rotated(facet.normal);
      f.path.kind = PathKind::Reflected;
      f.path.order = 2;
      f.path.excess_m = 2 * near.height * near.normal.dot(s) + 2 * height * far_cosine;
      f.path.point = point;
      f.path.arrival = onward - 2 * cosine * near.normal;
      f.path.incidence_count = 2;
      f.path.incidences[0].incidence_rad = std::acos(std::min(1.0, far_cosine));
      f.path.incidences[1].incidence_rad = std::acos(std::min(1.0, cosine));
      f.path.triangle = *triangle;
      f.path.instance = near.set->instance;
      f.path.leg_m = leg;
      f.path.far_point = pose.moved(far_there);
      f.path.far_triangle = *far_triangle;
      f.path.far_instance = set.instance;
      const auto near_facet = static_cast<std::uint32_t>(near.facet - near.set->facets->facets().data());
      f.path.reflector =
          reflector_id(PathKind::Reflected, {set.instance, match.facet, near.set->instance, near_facet});
      f.lift_m = scene.surface_offset_m(f.path.point) + near.facet->deviation;
      f.far_lift_m = scene.surface_offset_m(f.path.far_point) + facet.deviation;
    }
  }
}

/// Keeps the paths whose three legs are clear. Points are lifted off their own facets.
void SecondOrderSearch::keep_clear(const raytrace::RayScene& scene, const Vector3d& antenna,
                                   std::span<const Vector3d> directions) {
  const auto between = [](const Vector3d& from, const Vector3d& to) {
    const double range = (to - from).norm();
    return raytrace::Ray{from, (to - from) / range, range};
  };
  const auto near = [](const FoundPaths& f) -> Vector3d { return f.path.point + f.lift_m * f.normal; };
  const auto far = [](const FoundPaths& f) -> Vector3d {
    return f.path.far_point + f.far_lift_m * f.far_normal;
  };
  clear_rays_.keep(scene, found_, scene.surface_offset_m(antenna),
                   [&](const FoundPaths& f) { return between(antenna, near(f)); });
  clear_rays_.keep(scene, found_, 0, [&](const FoundPaths& f) { return between(near(f), far(f)); });
  clear_rays_.keep(scene, found_, 0, [&](const FoundPaths& f) {
    return raytrace::Ray{far(f), directions[f.satellite]};
  });
}

/// Sorts by satellite and excess path, and removes duplicate paths by the same points of the same planes.
void SecondOrderSearch::sort_and_drop_doubles(const Vector3d& antenna) {
  const auto key = [](const FoundPaths& f) {
    return std::tie(f.satellite, f.path.excess_m, f.path.instance, f.path.triangle, f.path.far_instance,
                    f.path.far_triangle);
  };
  std::sort(found_.begin(), found_.end(),
            [&](const FoundPaths& a, const FoundPaths& b) { return key(a) < key(b); });
  // Largest distance between the points of one path by two pairs of planes that differ by kCoincidentPoint
  // and by small angles turn_B and turn_A: the image in B moves by 2 kCoincidentPoint and 2 turn_B leg, s'
  // rotates by 2 turn_A, and each motion of the ray moves the point in its plane by 1 / cos(incidence) of it.
  const auto same = [&](const FoundPaths& a, const FoundPaths& b) {
    const double rotation = (a.normal - b.normal).norm(), far_rotation = (a.far_normal - b.far_normal).norm();
    if (a.normal.dot(b.normal) <= kSameNormal || a.far_normal.dot(b.far_normal) <= kSameNormal) return false;
    const double leg = (a.path.point - antenna).norm();
    const double total = leg + (a.path.far_point - a.path.point).norm();
    const auto close = [](const Vector3d& apart, const Vector3d& normal, double along) {
      return apart.squaredNorm() < along * along && std::abs(apart.dot(normal)) < kCoincidentPoint;
    };
    const double cosine = std::min(a.cosine, b.cosine), far_cosine = std::min(a.far_cosine, b.far_cosine);
    return close(a.path.point - b.path.point, a.normal,
                 (kCoincidentPoint + 2 * far_rotation * leg) / cosine) &&
           close(a.path.far_point - b.path.far_point, a.far_normal,
                 (3 * kCoincidentPoint + 2 * rotation * leg + 2 * far_rotation * total) / far_cosine);
  };
  drop_doubles(found_, 4 * kCoincidentPoint, same);
}

}  // namespace canyon::propagation
