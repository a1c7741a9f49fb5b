#include "canyon/propagation/propagator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <tuple>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/propagation/facets.hpp"
#include "canyon/propagation/per_instance.hpp"
#include "canyon/propagation/second_order.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using raytrace::Ray;

/// Below this cosine of incidence the reflection point runs away along the plane.
constexpr double kMinCosine = 1e-6;
/// Reflections of one satellite are one where their planes are less than this and 1 deg apart: walls that two
/// buildings share are not drawn at quite the same place. Points along the planes then differ by this over
/// the cosine of incidence.
constexpr double kSamePlace = 2e-3;
const double kSameNormal = std::cos(geodesy::radians(1));

/// A reflection by the geometry of one facet, before anything that may stand in the way.
struct Candidate {
  std::uint32_t satellite = 0;
  double lift_m = 0;  ///< along the normal, so that rays do not meet the facet itself
  double cosine = 1;  ///< of incidence
  Vector3d normal;
  Path path;
};

/// What one trace() needs for a while; kept by each thread so that nothing is allocated once it has grown.
struct Scratch {
  FacingFacets facing;
  std::vector<std::uint8_t> marks;
  std::vector<Candidate> candidates;
  std::vector<Ray> rays;
  std::vector<std::uint32_t> ray_of;  ///< candidate of each ray
  Flags direct, blocked;
  std::vector<PlacedFacets> placed;
  SecondOrderSearch second_order;
};

Scratch& scratch() {
  static thread_local Scratch scratch;
  return scratch;
}

void check(bool good, const char* field, const char* bound, double value) {
  if (!good)
    throw InputError(fmt::format("propagation.{} is {}", field, value), fmt::format("give {}", bound));
}

}  // namespace

void PropagationOptions::validate() const {
  check(model == Model::Specular || model == Model::Mirror, "model", "specular or mirror",
        static_cast<double>(model));
  check(reflection_order >= 0 && reflection_order <= 2, "reflection_order", "0, 1 or 2", reflection_order);
  check(max_range_m > 0 && max_range_m <= 100'000, "max_range_m", "a number above 0 and up to 100,000",
        max_range_m);
  check(max_incidence_rad > 0 && max_incidence_rad <= geodesy::kPi / 2, "max_incidence_rad",
        "an angle above 0 and up to pi/2", max_incidence_rad);
}

double mirror_excess_m(double range_m, double elevation_rad) {
  return range_m * (1 + std::sin(geodesy::kPi / 2 - 2 * elevation_rad));
}

namespace {

Path mirror_path(const Vector3d& antenna, const Vector3d& direction, double range_m) {
  Path path;
  path.kind = PathKind::Reflected;
  path.order = 1;
  path.arrival = mirror_direction(direction);
  path.excess_m = mirror_excess_m(range_m, std::asin(std::clamp(direction.z(), -1.0, 1.0)));
  path.point = antenna + range_m * path.arrival;
  return path;
}

}  // namespace

SatellitePaths mirror_paths(const Vector3d& antenna, const Vector3d& direction, bool direct_blocked,
                            std::optional<double> mirror_range_m) {
  SatellitePaths paths;
  if (!direct_blocked) {
    Path direct;
    direct.arrival = direction;
    paths.visibility = Visibility::LOS;
    paths.paths.push_back(direct);
  } else if (mirror_range_m) {
    paths.visibility = Visibility::NLOS;
    paths.paths.push_back(mirror_path(antenna, direction, *mirror_range_m));
  }
  return paths;
}

/// The facets of a mesh and, where the second order is asked for, what its search needs.
struct PreparedFacets {
  FacetSet facets;
  BeamIndex beams;
  Occluders occluders;

  PreparedFacets(const city::Mesh& mesh, const PropagationOptions& options)
      : facets(mesh, options.ground_reflection) {
    if (options.reflection_order < 2) return;
    beams = BeamIndex(facets);
    occluders = Occluders(facets);
  }
};

struct Propagator::Impl {
  const raytrace::RayScene* scene;
  PropagationOptions options;
  PreparedFacets city;

  PerInstance<PreparedFacets> instances;

  Impl(const city::Mesh& mesh, const raytrace::RayScene& from, PropagationOptions o)
      : scene(&from), options(o), city(reflects(o) ? mesh : city::Mesh{}, o) {}

  static bool reflects(const PropagationOptions& o) {
    return o.model == Model::Specular && o.reflection_order > 0;
  }

  const PreparedFacets& facets_of(const raytrace::PlacedInstance& placed) const {
    return instances.of(placed, [this](const city::Mesh& mesh) {
      return std::make_unique<const PreparedFacets>(mesh, options);
    });
  }

  void find_reflections(const FacetSet& set, raytrace::InstanceId instance, const Isometry3d* enu_from_set,
                        const Vector3d& antenna, std::span<const Vector3d> directions, Scratch& s) const;
  static void drop_doubles(std::vector<Candidate>& candidates);
  void keep_clear(const Vector3d& antenna, std::span<const Vector3d> directions, Scratch& s) const;
  void add_second_order(const Vector3d& antenna, std::span<const Vector3d> directions, Scratch& s,
                        std::span<SatellitePaths> result) const;
  void trace_mirror(const Vector3d& antenna, std::span<const Vector3d> directions,
                    std::span<const bool> blocked, std::span<SatellitePaths> result) const;
};

/// Appends what the image construction gives for every facet of one set. `enu_from_set` is null for the city.
void Propagator::Impl::find_reflections(const FacetSet& set, raytrace::InstanceId instance,
                                        const Isometry3d* enu_from_set, const Vector3d& antenna,
                                        std::span<const Vector3d> directions, Scratch& s) const {
  const Vector3d here = enu_from_set != nullptr ? enu_from_set->inverse() * antenna : antenna;
  const double min_cosine = std::max(kMinCosine, std::cos(options.max_incidence_rad));
  const double lift = scene->surface_offset_m(antenna);
  set.gather(here, options.max_range_m, 2 * lift, s.facing);
  if (s.facing.facet.empty()) return;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Vector3d towards = enu_from_set != nullptr
                                 ? Vector3d(enu_from_set->linear().transpose() * directions[i])
                                 : directions[i];
    mark_reflecting(s.facing, towards, min_cosine, options.max_range_m, s.marks);
    for (std::size_t word = 0; word < s.marks.size(); word += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, s.marks.data() + word, 8);
      if (eight == 0) continue;
      for (std::size_t k = word; k < word + 8; ++k) {
        if (s.marks[k] == 0) continue;
        // The same again in doubles, with the facet's true outline.
        const Facet& facet = set.facets()[s.facing.facet[k]];
        const double cosine = facet.normal.dot(towards);
        if (cosine < min_cosine) continue;
        const double height = facet.normal.dot(here) - facet.offset;
        const double leg = height / cosine;
        if (leg > options.max_range_m) continue;
        const Vector3d point = here - 2 * height * facet.normal + leg * towards;
        const auto triangle = set.triangle_at(facet, point);
        if (!triangle) continue;

        Candidate& c = s.candidates.emplace_back();
        c.satellite = static_cast<std::uint32_t>(i);
        c.cosine = cosine;
        c.normal = enu_from_set != nullptr ? Vector3d(enu_from_set->linear() * facet.normal) : facet.normal;
        c.path.kind = PathKind::Reflected;
        c.path.order = 1;
        c.path.excess_m = 2 * height * cosine;
        c.path.point = enu_from_set != nullptr ? Vector3d(*enu_from_set * point) : point;
        c.path.arrival = directions[i] - 2 * cosine * c.normal;
        c.path.incidence_rad = std::acos(std::min(1.0, cosine));
        c.path.triangle = *triangle;
        c.path.instance = instance;
        c.lift_m = scene->surface_offset_m(c.path.point) + facet.deviation;
      }
    }
  }
}

/// Sorts by satellite and excess path, and keeps one of several reflections at the same place of the same
/// plane: walls that two buildings share, facets that meet where the signal is reflected.
void Propagator::Impl::drop_doubles(std::vector<Candidate>& candidates) {
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(a.satellite, a.path.excess_m, a.path.instance, a.path.triangle) <
           std::tie(b.satellite, b.path.excess_m, b.path.instance, b.path.triangle);
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    bool seen = false;
    for (std::size_t k = kept; k-- > 0 && !seen;) {
      const Candidate& other = candidates[k];
      if (other.satellite != candidates[i].satellite ||
          candidates[i].path.excess_m - other.path.excess_m > 2 * kSamePlace) {
        break;
      }
      const Vector3d apart = candidates[i].path.point - other.path.point;
      const double along = kSamePlace / std::min(other.cosine, candidates[i].cosine);
      seen = apart.squaredNorm() < along * along && std::abs(apart.dot(other.normal)) < kSamePlace &&
             other.normal.dot(candidates[i].normal) > kSameNormal;
    }
    if (seen) continue;
    if (kept != i) candidates[kept] = candidates[i];
    ++kept;
  }
  candidates.resize(kept);
}

/// Keeps the candidates whose two legs are clear. Points are lifted off their facet, so that the facet does
/// not hide itself; anything else nearer than that is not seen.
void Propagator::Impl::keep_clear(const Vector3d& antenna, std::span<const Vector3d> directions,
                                  Scratch& s) const {
  const auto keep = [&s](std::span<const bool> blocked) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < s.candidates.size(); ++i) {
      if (blocked[i]) continue;
      if (kept != i) s.candidates[kept] = s.candidates[i];
      ++kept;
    }
    s.candidates.resize(kept);
  };
  s.rays.clear();
  for (const Candidate& c : s.candidates) {
    const Vector3d leg = c.path.point + c.lift_m * c.normal - antenna;
    const double range = leg.norm();
    s.rays.push_back({antenna, leg / range, range});
  }
  std::span<bool> blocked = s.blocked.resize(s.rays.size());
  scene->occluded(s.rays, blocked, scene->surface_offset_m(antenna));
  keep(blocked);

  s.rays.clear();
  for (const Candidate& c : s.candidates) {
    s.rays.push_back({c.path.point + c.lift_m * c.normal, directions[c.satellite]});
  }
  blocked = s.blocked.resize(s.rays.size());
  scene->occluded(s.rays, blocked);
  keep(blocked);
}

/// Adds the paths by two facets and puts all of a satellite's in order.
void Propagator::Impl::add_second_order(const Vector3d& antenna, std::span<const Vector3d> directions,
                                        Scratch& s, std::span<SatellitePaths> result) const {
  const auto place = [&s](const PreparedFacets& of, raytrace::InstanceId id, const Isometry3d* pose) {
    s.placed.push_back({&of.facets, &of.beams, &of.occluders, id, pose});
  };
  s.placed.clear();
  place(city, 0, nullptr);
  for (const raytrace::PlacedInstance& placed : scene->placed_instances()) {
    place(facets_of(placed), placed.id, &placed.enu_from_instance);
  }
  const SecondOrderLimits limits{options.max_range_m,
                                 std::max(kMinCosine, std::cos(options.max_incidence_rad)),
                                 2 * scene->surface_offset_m(antenna)};
  for (const auto& found : s.second_order.trace(*scene, s.placed, antenna, directions, limits)) {
    result[found.satellite].paths.push_back(found.path);
  }
  // Both orders are sorted; of equal lengths the lower order comes first.
  for (SatellitePaths& satellite : result) {
    std::sort(satellite.paths.begin(), satellite.paths.end(), [](const Path& a, const Path& b) {
      return std::tie(a.excess_m, a.order, a.instance, a.triangle, a.far_instance, a.far_triangle) <
             std::tie(b.excess_m, b.order, b.instance, b.triangle, b.far_instance, b.far_triangle);
    });
  }
}

/// The paper's algorithm 2 for satellites whose line of sight is blocked.
void Propagator::Impl::trace_mirror(const Vector3d& antenna, std::span<const Vector3d> directions,
                                    std::span<const bool> blocked, std::span<SatellitePaths> result) const {
  const double min_range = scene->surface_offset_m(antenna);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (!blocked[i]) continue;
    const Vector3d mirrored = mirror_direction(directions[i]);
    const auto hit = scene->cast({antenna, mirrored, options.max_range_m}, min_range);
    if (!hit) continue;
    Path path = mirror_path(antenna, directions[i], hit->range_m);
    path.incidence_rad = std::acos(std::min(1.0, std::abs(mirrored.dot(hit->normal))));
    path.triangle = hit->triangle;
    path.instance = hit->instance;
    result[i].paths.push_back(path);
  }
}

Propagator::Propagator(const city::Mesh& city, const raytrace::RayScene& scene, PropagationOptions options) {
  options.validate();
  impl_ = std::make_unique<Impl>(city, scene, options);
}
Propagator::~Propagator() = default;
Propagator::Propagator(Propagator&&) noexcept = default;
Propagator& Propagator::operator=(Propagator&&) noexcept = default;

const PropagationOptions& Propagator::options() const {
  return impl_->options;
}

void Propagator::trace(const Vector3d& antenna, std::span<const Vector3d> directions,
                       std::span<SatellitePaths> result) const {
  assert(directions.size() == result.size());
  if (!antenna.allFinite()) {
    throw InputError(
        fmt::format("the antenna's place ({}, {}, {}) is not finite", antenna.x(), antenna.y(), antenna.z()),
        "check the trajectory");
  }
  const Impl& impl = *impl_;
  Scratch& s = scratch();

  s.rays.clear();
  for (const Vector3d& direction : directions) {
    assert(std::abs(direction.squaredNorm() - 1) < 1e-6);
    s.rays.push_back({antenna, direction});
  }
  const std::span<bool> blocked = s.direct.resize(directions.size());
  impl.scene->occluded(s.rays, blocked, impl.scene->surface_offset_m(antenna));
  for (std::size_t i = 0; i < directions.size(); ++i) {
    result[i].paths.clear();
    if (blocked[i]) continue;
    Path& direct = result[i].paths.emplace_back();
    direct.arrival = directions[i];
  }

  if (impl.options.model == Model::Mirror) {
    impl.trace_mirror(antenna, directions, blocked, result);
  } else if (impl.options.reflection_order > 0) {
    s.candidates.clear();
    impl.find_reflections(impl.city.facets, 0, nullptr, antenna, directions, s);
    for (const raytrace::PlacedInstance& placed : impl.scene->placed_instances()) {
      impl.find_reflections(impl.facets_of(placed).facets, placed.id, &placed.enu_from_instance, antenna,
                            directions, s);
    }
    Impl::drop_doubles(s.candidates);
    impl.keep_clear(antenna, directions, s);
    for (const Candidate& c : s.candidates) result[c.satellite].paths.push_back(c.path);
    if (impl.options.reflection_order > 1) impl.add_second_order(antenna, directions, s, result);
  }

  for (std::size_t i = 0; i < directions.size(); ++i) {
    SatellitePaths& satellite = result[i];
    if (blocked[i]) {
      satellite.visibility = satellite.paths.empty() ? Visibility::Blocked : Visibility::NLOS;
    } else {
      satellite.visibility = satellite.paths.size() > 1 ? Visibility::LOSMultipath : Visibility::LOS;
    }
  }
}

}  // namespace canyon::propagation
