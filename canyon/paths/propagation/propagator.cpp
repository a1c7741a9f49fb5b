#include "canyon/paths/propagation/propagator.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/first_order.hpp"
#include "canyon/paths/propagation/index/antenna_cache.hpp"
#include "canyon/paths/propagation/index/foliage_volumes.hpp"
#include "canyon/paths/propagation/index/per_instance.hpp"
#include "canyon/paths/propagation/second_order.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;
using raytrace::Ray;

/// Below this cosine of incidence the reflection point moves towards infinity along the plane.
constexpr double kMinCosine = 1e-6;
/// Largest angle [rad] between directions of one satellite at nearby points and times: Earth rotates by 7e-4
/// in 10 s, and the motion of satellites changes it by as little.
constexpr double kSameSatellite = 2e-3;

/// Properties of the triangle that reflects or diffracts a path.
struct SurfaceAttributes {
  city::Material material = city::Material::Unknown;
  city::Surface surface = city::Surface::Building;
};

std::vector<SurfaceAttributes> skins_of(const city::Mesh& mesh) {
  std::vector<SurfaceAttributes> skins(mesh.triangles.size());
  for (const city::Object& object : mesh.objects)
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t)
      skins[t] = {mesh.materials[t], object.surface};
  return skins;
}

/// For the mirror model, which needs no facets: a number for each triangle. Triangles of one object in nearly
/// one plane (half a degree, a decimetre) mostly have the same number.
std::vector<std::uint32_t> planes_of(const city::Mesh& mesh) {
  std::map<std::tuple<std::size_t, long, long, long, long>, std::uint32_t> numbers;
  std::vector<std::uint32_t> planes(mesh.triangles.size());
  for (std::size_t o = 0; o < mesh.objects.size(); ++o) {
    const city::Object& object = mesh.objects[o];
    if (object.triangle_count == 0) continue;
    const Vector3d origin = mesh.vertices[mesh.triangles[object.first_triangle][0]];
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      const auto& corner = mesh.triangles[t];
      const Vector3d a = mesh.vertices[corner[0]];
      const Vector3d n =
          (mesh.vertices[corner[1]] - a).cross(mesh.vertices[corner[2]] - a).stableNormalized();
      const auto rounded = [](double value, double step) { return std::lround(value / step); };
      const auto key = std::make_tuple(o, rounded(n.x(), 0.01), rounded(n.y(), 0.01), rounded(n.z(), 0.01),
                                       rounded(n.dot(a - origin), 0.1));
      planes[t] = numbers.emplace(key, static_cast<std::uint32_t>(numbers.size())).first->second;
    }
  }
  return planes;
}

/// Structures that are built once per mesh, those that the options need.
struct Prepared {
  std::vector<SurfaceAttributes> skins;
  std::vector<std::uint32_t> planes;
  FacetSet facets;
  BeamIndex beams;
  Occluders occluders;
  FoliageVolumes foliage;

  Prepared(const city::Mesh& mesh, const PropagationOptions& options) : skins(skins_of(mesh)) {
    if (options.model == Model::Mirror) {
      planes = planes_of(mesh);
      return;
    }
    if (options.reflection_order > 0) facets = FacetSet(mesh, options.ground_reflection);
    if (options.reflection_order > 1) {
      beams = BeamIndex(facets);
      occluders = Occluders(facets);
    }
    if (options.through_foliage) foliage = FoliageVolumes(mesh);
  }
};

/// A prepared mesh at its pose.
struct PosedSet {
  const Prepared* prepared;
  raytrace::InstanceId instance;
  SetPose pose;
};

/// Memory of one trace(); kept by each thread, so that nothing is allocated once it has grown.
struct PropagationScratch {
  std::vector<Ray> rays;
  Flags blocked, wanted;
  std::vector<double> foliage_m;
  std::vector<RangeInterval> inside;
  std::vector<PosedSet> sets;
  std::vector<PosedFacets> posed;
  FirstOrderSearch first_order;
  SecondOrderSearch second_order;
  std::vector<std::vector<DiffractedPath>> diffracted;
  std::vector<std::vector<DiffusePath>> diffuse;
  std::vector<SatellitePaths> paths;

  [[nodiscard]] const Prepared& prepared(raytrace::InstanceId instance) const {
    const auto found =
        std::lower_bound(sets.begin(), sets.end(), instance,
                         [](const PosedSet& set, raytrace::InstanceId id) { return set.instance < id; });
    assert(found != sets.end() && found->instance == instance);
    return *found->prepared;
  }
};

PropagationScratch& propagation_scratch() {
  static thread_local PropagationScratch scratch;
  return scratch;
}

/// One list for each of `count` satellites. Never shrinks, so that the lists keep their capacity.
template <typename List>
std::span<List> lists(std::vector<List>& of, std::size_t count) {
  if (of.size() < count) of.resize(count);
  return std::span(of).first(count);
}

double elevation_rad(const Vector3d& direction) {
  return std::asin(std::clamp(direction.z(), -1.0, 1.0));
}

void take(std::span<const SatellitePaths> found, std::span<SatellitePaths> result) {
  for (std::size_t i = 0; i < result.size(); ++i) result[i].take(found[i].paths);
}

/// A path from `found`: the common fields of DiffractedPath and DiffusePath.
template <typename FoundItem>
Path& append(SatellitePaths& paths, PathKind kind, const FoundItem& found) {
  Path& path = paths.paths.emplace_back();
  path.kind = kind;
  path.excess_m = found.excess_m;
  path.point = found.point;
  path.arrival = found.arrival;
  path.instance = found.instance;
  path.arrival_elevation_rad = elevation_rad(found.arrival);
  return path;
}

void append_scattered(SatellitePaths& paths, const DiffusePath& scattered) {
  Path& path = append(paths, PathKind::Diffuse, scattered);
  path.triangle = scattered.triangle;
  path.scattered_power = scattered.power;
  path.reflector = reflector_id(PathKind::Diffuse, {scattered.instance, scattered.bin});
}

Path direct_path(const Vector3d& direction, double foliage_depth_m = 0) {
  Path path;
  path.arrival = direction;
  path.arrival_elevation_rad = elevation_rad(direction);
  path.foliage_depth_m = foliage_depth_m;
  return path;
}

}  // namespace

double mirror_excess_m(double range_m, double elevation_rad) {
  return range_m * (1 + std::sin(geodesy::kPi / 2 - 2 * elevation_rad));
}

namespace {

/// The path over a wall of concrete that faces the arrival, as a default.
Path mirror_path(const Vector3d& antenna, const Vector3d& direction, double range_m) {
  Path path;
  path.kind = PathKind::Reflected;
  path.order = 1;
  path.arrival = mirror_direction(direction);
  // Never negative but for rounding, at the zenith.
  path.excess_m = std::max(0.0, mirror_excess_m(range_m, elevation_rad(direction)));
  path.point = antenna + range_m * path.arrival;
  path.reflector = reflector_id(PathKind::Reflected, {});
  path.arrival_elevation_rad = elevation_rad(path.arrival);
  path.incidence_count = 1;
  path.incidences[0].incidence_rad = std::abs(path.arrival_elevation_rad);
  path.incidences[0].material = city::Material::Concrete;
  return path;
}

}  // namespace

SatellitePaths mirror_paths(const Vector3d& antenna, const Vector3d& direction, bool direct_blocked,
                            std::optional<double> mirror_range_m) {
  SatellitePaths paths;
  if (!direct_blocked) {
    paths.visibility = Visibility::LOS;
    paths.paths.push_back(direct_path(direction));
  } else if (mirror_range_m) {
    paths.visibility = Visibility::NLOS;
    paths.paths.push_back(mirror_path(antenna, direction, *mirror_range_m));
  }
  return paths;
}

struct Propagator::Impl {
  const raytrace::RayScene* scene;
  PropagationOptions options;
  /// Fraction of a smooth wall's amplitude that continues in the mirror direction of a scattering wall.
  double specular_factor;
  // Before `city`: the temporary memory of edges is large.
  std::optional<EdgeDiffraction> diffraction;
  std::optional<DiffuseScattering> diffuse;
  Prepared city;
  /// Reflectors near an antenna.
  struct NearbyReflectors {
    FirstOrderSearch::CachedFacets facets;
    NearPairs pairs;
  };
  AntennaCache<NearbyReflectors> cache;

  PerInstance<Prepared> instances;

  Impl(const city::Mesh& mesh, const raytrace::RayScene& from, const PropagationOptions& o,
       std::uint64_t seed)
      : scene(&from),
        options(o),
        specular_factor(o.diffuse ? std::sqrt(1 - o.scattering.scattering_coefficient *
                                                      o.scattering.scattering_coefficient)
                                  : 1),
        diffraction(o.model == Model::Specular && o.diffraction
                        ? std::optional<EdgeDiffraction>(std::in_place, mesh, from, o.edges)
                        : std::nullopt),
        diffuse(o.model == Model::Specular && o.diffuse
                    ? std::optional<DiffuseScattering>(std::in_place, mesh, from, o.scattering, seed)
                    : std::nullopt),
        city(mesh, o) {}

  /// Lists the city and the instances at their poses, by id.
  void update_instances(PropagationScratch& s) const {
    s.sets.clear();
    s.sets.push_back({&city, 0, nullptr});
    for (const raytrace::PosedInstance& posed : scene->posed_instances()) {
      const Prepared& prepared = instances.of(
          posed, [this](const city::Mesh& mesh) { return std::make_unique<const Prepared>(mesh, options); });
      s.sets.push_back({&prepared, posed.id, &posed.enu_from_instance});
    }
  }

  /// Depth of vegetation on the direct ray; empty if another surface blocks it.
  [[nodiscard]] std::optional<double> foliage_depth(const Vector3d& antenna, const Vector3d& direction,
                                                    PropagationScratch& s) const {
    const double step = scene->surface_offset_m(antenna);
    double from = step;
    while (const auto hit = scene->cast({antenna, direction}, from)) {
      if (s.prepared(hit->instance).skins[hit->triangle].surface != city::Surface::Foliage)
        return std::nullopt;
      // The next hit may be at the same range, but a ray cannot continue from there a second time.
      from = hit->range_m > from ? hit->range_m
                                 : from + std::max(step, scene->surface_offset_m(antenna + from * direction));
    }
    s.inside.clear();
    for (const PosedSet& set : s.sets) {
      if (set.prepared->foliage.empty()) continue;
      set.prepared->foliage.append_inside(set.pose.moved_back(antenna), set.pose.rotated_to_local(direction),
                                          s.inside);
    }
    return covered_length_m(s.inside);
  }

  /// Unblocks the satellites that only vegetation hides, and stores its depth.
  void look_through_foliage(const Vector3d& antenna, std::span<const Vector3d> directions,
                            std::span<bool> blocked, PropagationScratch& s) const {
    const bool any = std::any_of(s.sets.begin(), s.sets.end(),
                                 [](const PosedSet& set) { return !set.prepared->foliage.empty(); });
    if (!any) return;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      if (!blocked[i]) continue;
      if (const auto depth = foliage_depth(antenna, directions[i], s)) {
        blocked[i] = false;
        s.foliage_m[i] = *depth;
      }
    }
  }

  void add_material(const PropagationScratch& s, raytrace::InstanceId instance, std::uint32_t triangle,
                    Incidence& incidence) const {
    const SurfaceAttributes& skin = s.prepared(instance).skins[triangle];
    incidence.material = skin.material;
    // The ground does not scatter (DiffuseScattering).
    if (skin.surface != city::Surface::Terrain) incidence.specular_factor = specular_factor;
  }

  /// Fills `result` with the direct paths; returns the satellites without one.
  std::span<bool> find_obstructed(const Vector3d& antenna, std::span<const Vector3d> directions,
                                  PropagationScratch& s, std::span<SatellitePaths> result) const {
    raytrace::check_position(antenna, "the antenna's position");
    s.rays.clear();
    for (const Vector3d& direction : directions) {
      assert(std::abs(direction.squaredNorm() - 1) < 1e-6);
      s.rays.push_back({antenna, direction});
    }
    const std::span<bool> blocked = s.blocked.resize(directions.size());
    scene->occluded(s.rays, blocked, scene->surface_offset_m(antenna));
    s.foliage_m.assign(directions.size(), 0);
    update_instances(s);
    if (options.model == Model::Specular && options.through_foliage)
      look_through_foliage(antenna, directions, blocked, s);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      result[i].paths.clear();
      if (!blocked[i]) result[i].paths.push_back(direct_path(directions[i], s.foliage_m[i]));
    }
    return blocked;
  }

  /// The ground and, without scattering, all surfaces and edges are ideal.
  void add_glint(Path& path) const {
    const bool ground =
        path.incidence_count > 0 &&
        path.incidences[static_cast<std::size_t>(path.incidence_count) - 1].specular_factor == 1;
    if (diffuse && !ground) path.scattering_offset = diffuse->scattering_offset(path);
  }

  void add_reflections(const Vector3d& antenna, std::span<const Vector3d> directions, int order,
                       PropagationScratch& s, std::span<SatellitePaths> result, TracedPoint* traced) const {
    s.posed.clear();
    for (const PosedSet& set : s.sets) {
      const Prepared& of = *set.prepared;
      s.posed.push_back({&of.facets, &of.beams, &of.occluders, set.instance, set.pose});
    }
    const ReflectionLimits limits{options.max_range_m,
                                  std::max(kMinCosine, std::cos(options.max_incidence_rad)),
                                  2 * scene->surface_offset_m(antenna)};
    const auto lease = cache.about(antenna);
    NearbyReflectors* about = lease.get();
    for (const auto& found : s.first_order.trace(*scene, s.posed, antenna, directions, limits,
                                                 about != nullptr ? &about->facets : nullptr)) {
      Path& path = result[found.satellite].paths.emplace_back(found.path);
      path.arrival_elevation_rad = elevation_rad(path.arrival);
      add_material(s, path.instance, path.triangle, path.incidences[0]);
      add_glint(path);
    }
    if (order < 2) return;
    for (const auto& found :
         s.second_order.trace(*scene, s.posed, antenna, directions, limits, s.first_order.facing_of_city(),
                              about != nullptr ? &about->pairs : nullptr)) {
      Path& path = result[found.satellite].paths.emplace_back(found.path);
      path.arrival_elevation_rad = elevation_rad(path.arrival);
      add_material(s, path.far_instance, path.far_triangle, path.incidences[0]);
      add_material(s, path.instance, path.triangle, path.incidences[1]);
      path.incidences[1].plane_rotation_rad =
          plane_rotation_rad((path.point - path.far_point).normalized(), found.far_normal, found.normal);
      add_glint(path);
      if (traced != nullptr) traced->far.push_back({found.satellite, path, found.normal, found.far_normal});
    }
  }

  void add_diffraction(const Vector3d& antenna, std::span<const Vector3d> directions,
                       std::span<const bool> blocked, PropagationScratch& s,
                       const std::span<const KnownEdge>* only, std::span<SatellitePaths> result,
                       TracedPoint* traced) const {
    const auto found = lists(s.diffracted, directions.size());
    if (only != nullptr)
      diffraction->retrace(antenna, directions, blocked, *only, found);
    else
      diffraction->trace(antenna, directions, blocked, found);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      for (const DiffractedPath& around : found[i]) {
        Path& path = append(result[i], PathKind::Diffracted, around);
        path.reflector = reflector_id(PathKind::Diffracted, {around.instance, around.edge});
        path.edge_nu = around.nu;
        if (blocked[i]) path.edge_radius_m = options.edges.edge_radius_m;
        path.edge_bending_rad = around.bending_rad;
        path.edge_leg_m = around.leg_m;
        add_glint(path);
        if (traced != nullptr && around.instance == 0)
          traced->edges.push_back({static_cast<std::uint32_t>(i), around.edge});
      }
    }
  }

  void add_diffuse(const Vector3d& antenna, std::span<const Vector3d> directions, PropagationScratch& s,
                   std::span<SatellitePaths> result, TracedPoint* traced) const {
    const auto found = lists(s.diffuse, directions.size());
    const std::span<bool> wanted = s.wanted.resize(directions.size());
    std::fill(wanted.begin(), wanted.end(), true);
    diffuse->trace(antenna, directions, wanted, found);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      for (const DiffusePath& scattered : found[i]) {
        append_scattered(result[i], scattered);
        if (traced != nullptr) traced->scattered.push_back({static_cast<std::uint32_t>(i), scattered});
      }
    }
  }

  /// The paper's algorithm 2 for satellites whose line of sight is blocked.
  void trace_mirror(const Vector3d& antenna, std::span<const Vector3d> directions,
                    std::span<const bool> blocked, PropagationScratch& s,
                    std::span<SatellitePaths> result) const {
    const double min_range = scene->surface_offset_m(antenna);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      if (!blocked[i]) continue;
      const Vector3d mirrored = mirror_direction(directions[i]);
      const auto hit = scene->cast({antenna, mirrored, options.max_range_m}, min_range);
      if (!hit) continue;
      const Prepared& of = s.prepared(hit->instance);
      Path path = mirror_path(antenna, directions[i], hit->range_m);
      path.incidences[0].incidence_rad = std::acos(std::min(1.0, std::abs(mirrored.dot(hit->normal))));
      path.triangle = hit->triangle;
      path.instance = hit->instance;
      path.reflector = reflector_id(PathKind::Reflected, {hit->instance, of.planes[hit->triangle]});
      path.incidences[0].material = of.skins[hit->triangle].material;
      result[i].paths.push_back(path);
    }
  }

  /// In this thread's memory, unordered.
  [[nodiscard]] std::span<SatellitePaths> trace_first_order(const Vector3d& antenna,
                                                            std::span<const Vector3d> directions,
                                                            std::span<const KnownEdge> edges) const {
    assert(options.model == Model::Specular);
    PropagationScratch& s = propagation_scratch();
    const std::span<SatellitePaths> found = lists(s.paths, directions.size());
    const std::span<bool> blocked = find_obstructed(antenna, directions, s, found);
    if (options.reflection_order > 0) add_reflections(antenna, directions, 1, s, found, nullptr);
    if (diffraction) add_diffraction(antenna, directions, blocked, s, &edges, found, nullptr);
    return found;
  }

  /// The instances, by id, that may affect paths to the antenna.
  [[nodiscard]] std::vector<raytrace::PosedInstance> instances_about(const Vector3d& antenna) const {
    const double reach_m =
        std::max({options.max_range_m, options.edges.max_range_m, options.scattering.max_range_m});
    std::vector<raytrace::PosedInstance> result = scene->posed_instances();
    std::erase_if(result, [&](const raytrace::PosedInstance& each) {
      const double far_m = (each.enu_from_instance * each.bounds.center() - antenna).norm();
      return far_m - each.bounds.diagonal().norm() / 2 > reach_m;
    });
    return result;
  }
};

std::optional<Path> FarPath::seen_from(const Vector3d& antenna, const Vector3d& direction,
                                       const Vector3d& from_antenna, const Vector3d& from_direction) const {
  Path seen = path;
  const Vector3d step = antenna - from_antenna;
  const double rotated_m =
      (direction - from_direction).dot(from_antenna - antenna_image(path, from_antenna, from_direction));
  seen.excess_m = std::max(0.0, path.excess_m + rotated_m + (direction - path.arrival).dot(step));
  // The ray moves by `step`, and its mirror image by the step's image.
  seen.leg_m = path.leg_m - normal.dot(step) / normal.dot(path.arrival);
  if (!(seen.leg_m > 0)) return std::nullopt;
  seen.point = antenna + seen.leg_m * path.arrival;
  const Vector3d onward = (path.far_point - path.point).normalized();
  const Vector3d image_step = step - 2 * normal.dot(step) * normal;
  seen.far_point = path.far_point + image_step - far_normal.dot(image_step) / far_normal.dot(onward) * onward;
  return seen;
}

std::optional<DiffusePath> FarScatter::seen_from(const Vector3d& antenna, const Vector3d& direction,
                                                 const Vector3d& from_antenna,
                                                 const Vector3d& from_direction) const {
  const Vector3d step = path.point - antenna, old_step = path.point - from_antenna;
  const double leg_m = step.norm(), old_leg_m = old_step.norm();
  if (!(leg_m > 0)) return std::nullopt;
  DiffusePath seen = path;
  const double rotated_m = (direction - from_direction).dot(old_leg_m * from_direction - old_step);
  seen.excess_m =
      std::max(0.0, path.excess_m + rotated_m + direction.dot(antenna - from_antenna) + leg_m - old_leg_m);
  seen.arrival = step / leg_m;
  return seen;
}

Propagator::Propagator(const city::Mesh& city, const raytrace::RayScene& scene, PropagationOptions options,
                       std::uint64_t seed) {
  options.validate();
  impl_ = std::make_unique<Impl>(city, scene, options, seed);
}

const PropagationOptions& Propagator::options() const {
  return impl_->options;
}

void Propagator::trace(const Vector3d& antenna, std::span<const Vector3d> directions,
                       std::span<SatellitePaths> result, TracedPoint* traced) const {
  assert(directions.size() == result.size());
  const Impl& impl = *impl_;
  const int order = impl.options.reflection_order;
  PropagationScratch& s = propagation_scratch();
  const std::span<SatellitePaths> found = lists(s.paths, directions.size());
  if (traced != nullptr)
    *traced = {antenna, {directions.begin(), directions.end()}, {}, {}, {}, impl.instances_about(antenna)};
  const std::span<bool> blocked = impl.find_obstructed(antenna, directions, s, found);
  if (impl.options.model != Model::Specular) {
    impl.trace_mirror(antenna, directions, blocked, s, found);
  } else {
    if (order > 0) impl.add_reflections(antenna, directions, order, s, found, traced);
    if (impl.diffraction) impl.add_diffraction(antenna, directions, blocked, s, nullptr, found, traced);
    if (impl.diffuse) impl.add_diffuse(antenna, directions, s, found, traced);
  }
  if (traced != nullptr) traced->scattered.shrink_to_fit();
  take(found, result);
}

void Propagator::trace_first_order(const Vector3d& antenna, std::span<const Vector3d> directions,
                                   std::span<const KnownEdge> edges, std::span<SatellitePaths> result) const {
  take(impl_->trace_first_order(antenna, directions, edges), result);
}

bool Propagator::retrace(const Vector3d& antenna, std::span<const Vector3d> directions,
                         const TracedPoint& traced, std::span<SatellitePaths> result) const {
  if (directions.size() != traced.directions.size()) return false;
  for (std::size_t i = 0; i < directions.size(); ++i)
    if ((directions[i] - traced.directions[i]).squaredNorm() > kSameSatellite * kSameSatellite) return false;
  const auto is_stationary = [](const raytrace::PosedInstance& a, const raytrace::PosedInstance& b) {
    constexpr double kMoved_m = 0.01, kRotated = 2e-3;
    const Eigen::Isometry3d &from = a.enu_from_instance, &to = b.enu_from_instance;
    return a.id == b.id && (from.translation() - to.translation()).norm() < kMoved_m &&
           (from.linear() - to.linear()).norm() < kRotated && a.bounds.isApprox(b.bounds);
  };
  const std::vector<raytrace::PosedInstance> now = impl_->instances_about(traced.antenna);
  if (!std::equal(now.begin(), now.end(), traced.instances.begin(), traced.instances.end(), is_stationary))
    return false;
  const std::span<SatellitePaths> found = impl_->trace_first_order(antenna, directions, traced.edges);
  for (const FarPath& far : traced.far) {
    const auto path =
        far.seen_from(antenna, directions[far.satellite], traced.antenna, traced.directions[far.satellite]);
    if (path) found[far.satellite].paths.push_back(*path);
  }
  for (const FarScatter& far : traced.scattered) {
    const auto path =
        far.seen_from(antenna, directions[far.satellite], traced.antenna, traced.directions[far.satellite]);
    if (path) append_scattered(found[far.satellite], *path);
  }
  take(found, result);
  return true;
}

bool Propagator::has_far_paths() const {
  return impl_->options.model == Model::Specular && (impl_->options.reflection_order > 1 || impl_->diffuse);
}

}  // namespace canyon::propagation
