#include "canyon/city/raytrace/ray_scene.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#ifdef CANYON_OWN_RAYS
#include "canyon/city/raytrace/builtin_triangles.hpp"
#else
#include "canyon/city/raytrace/embree_triangles.hpp"
#endif

namespace canyon::raytrace {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

[[maybe_unused]] bool is_ray(const Ray& ray) {
  return ray.origin.allFinite() && std::abs(ray.direction.squaredNorm() - 1) < 1e-6 && !(ray.max_range_m < 0);
}

/// A mesh with its vertices for exact ranges.
struct BuiltMesh {
  std::shared_ptr<const city::Mesh> mesh;
  Eigen::AlignedBox3d bounds;
  Vector3d centre = Vector3d::Zero();
  double radius = 0;  ///< of the vertices about the centre
  Triangles triangles;

  BuiltMesh() = default;
  BuiltMesh(const Tracing& tracing, std::shared_ptr<const city::Mesh> of, const std::string& name,
            bool requested_for_all)
      : mesh(std::move(of)) {
    city::check_mesh(*mesh, name);
    for (const Vector3d& v : mesh->vertices) bounds.extend(v);
    if (!bounds.isEmpty()) {
      centre = bounds.center();
      radius = 0.5 * bounds.diagonal().norm();
    }
    triangles = Triangles(tracing, *mesh, centre, requested_for_all);
  }

  [[nodiscard]] const Vector3d& vertex(std::uint32_t triangle, int corner) const {
    return mesh->vertices[mesh->triangles[triangle][static_cast<std::size_t>(corner)]];
  }
  /// Length: twice the area.
  [[nodiscard]] Vector3d area_normal(std::uint32_t triangle) const {
    const Vector3d& a = vertex(triangle, 0);
    return (vertex(triangle, 1) - a).cross(vertex(triangle, 2) - a);
  }
};

/// Queries see changes to it only after commit().
struct Instance {
  BuiltMesh built;
  Isometry3d pose = Isometry3d::Identity();
  bool posed = false;
  bool visible = true;
  bool removed = false;
};

/// A visible instance in the form needed by rays. Embree's own instances would need a tree over all of them,
/// built at each commit: 0.3 ms for a hundred, while hosts move and hide objects many times a second. Testing
/// the sphere of each costs a ray about 1 ns.
struct InstanceBounds {
  Vector3d centre;  ///< of its bounds, ENU
  double radius = 0;
  Eigen::Matrix3d instance_from_enu;
  const BuiltMesh* built = nullptr;

  /// Whether the ray enters the sphere between its ends. The sphere is larger than the mesh, so rounding to
  /// floats cannot change the result.
  [[nodiscard]] bool near(const Ray& ray, double min_range_m, double max_range_m) const {
    const Vector3d to_centre = centre - ray.origin;
    const double along = to_centre.dot(ray.direction);
    return to_centre.squaredNorm() - along * along <= radius * radius && along + radius >= min_range_m &&
           along - radius <= max_range_m;
  }
};

}  // namespace

/// Lowest vertices of a mesh, by squares.
class LowestPoints {
 public:
  explicit LowestPoints(const city::Mesh& mesh) {
    for (const Vector3d& vertex : mesh.vertices) {
      const auto low = [&vertex](double& z) { z = std::min(z, vertex.z()); };
      low(max_area_);
      low(squares_.try_emplace(square_of(vertex.x(), vertex.y()), vertex.z()).first->second);
    }
    if (mesh.vertices.empty()) max_area_ = 0;
  }

  /// In the square of (x, y) and its eight neighbours; of all squares if these have none.
  [[nodiscard]] double near(double x, double y) const {
    double lowest = std::numeric_limits<double>::infinity();
    for (const double east_m : {-kSide_m, 0.0, kSide_m}) {
      for (const double north_m : {-kSide_m, 0.0, kSide_m}) {
        const auto square = squares_.find(square_of(x + east_m, y + north_m));
        if (square != squares_.end()) lowest = std::min(lowest, square->second);
      }
    }
    return std::isfinite(lowest) ? lowest : max_area_;
  }

 private:
  using Square = std::pair<double, double>;
  static constexpr double kSide_m = 75;
  static Square square_of(double x, double y) { return {std::floor(x / kSide_m), std::floor(y / kSide_m)}; }

  std::map<Square, double> squares_;
  double max_area_ = std::numeric_limits<double>::infinity();
};

struct RayScene::Impl {
  Tracing tracing;
  BuiltMesh city;
  std::vector<city::Surface> surfaces;               ///< one per triangle of the city
  std::vector<InstanceBounds> movers;                ///< of `posed`, in its order
  std::vector<std::unique_ptr<Instance>> instances;  ///< [id - 1]; null once removed
  std::vector<PosedInstance> posed;
  double movers_radius = 0;            ///< of the visible instances about the city's centre
  std::optional<LowestPoints> ground;  ///< of a city without terrain

  explicit Impl(std::shared_ptr<const city::Mesh> mesh) {
    city = BuiltMesh(tracing, std::move(mesh), "city", true);
    surfaces.resize(city.mesh->triangles.size());
    for (const city::Object& object : city.mesh->objects)
      std::fill_n(surfaces.begin() + object.first_triangle, object.triangle_count, object.surface);
    if (std::find(surfaces.begin(), surfaces.end(), city::Surface::Terrain) == surfaces.end())
      ground.emplace(*city.mesh);
  }

  Instance& instance(InstanceId id) {
    if (id == 0 || id > instances.size() || !instances[id - 1] || instances[id - 1]->removed) {
      throw InputError(fmt::format("there is no movable instance {}", id),
                       "use an id that add_instance() returned and that was not removed");
    }
    return *instances[id - 1];
  }

  [[nodiscard]] Probe probe(const Ray& ray, double min_range_m) const {
    assert(is_ray(ray));
    return {ray.origin - city.centre, ray.direction, min_range_m, ray.max_range_m};
  }
  /// In the mover's frame, with equal ranges. Centres are subtracted in doubles, to keep floats small.
  static Probe probe(const Ray& ray, double min_range_m, double max_range_m, const InstanceBounds& mover) {
    return {mover.instance_from_enu * (ray.origin - mover.centre), mover.instance_from_enu * ray.direction,
            min_range_m, max_range_m};
  }

  [[nodiscard]] bool occluded_by_movers(const Ray& ray, double min_range_m) const {
    return std::any_of(movers.begin(), movers.end(), [&](const InstanceBounds& mover) {
      if (!mover.near(ray, min_range_m, ray.max_range_m)) return false;
      Probe one = probe(ray, min_range_m, ray.max_range_m, mover);
      return mover.built->triangles.occluded(one);
    });
  }

  /// Range from the ray's origin to the triangle's plane in doubles; `fallback` if the ray is too nearly
  /// parallel to the plane.
  static double exact_range(const Ray& ray, const Vector3d& corner, const Vector3d& unit_normal,
                            double fallback) {
    const double approach = ray.direction.dot(unit_normal);
    if (std::abs(approach) < 1e-4) return fallback;
    return (corner - ray.origin).dot(unit_normal) / approach;
  }

  using Crossing = Triangles::TriangleHit;
  /// Every triangle of the city on the ray, each once, in no particular order.
  void crossings(const Ray& ray, std::vector<Crossing>& found) const {
    found.clear();
    if (city.mesh->triangles.empty()) return;
    city.triangles.all(probe(ray, 0), found);
    // Embree may return a triangle that it has split more than once.
    std::sort(found.begin(), found.end(),
              [](const Crossing& a, const Crossing& b) { return a.triangle < b.triangle; });
    found.erase(std::unique(found.begin(), found.end(),
                            [](const Crossing& a, const Crossing& b) { return a.triangle == b.triangle; }),
                found.end());
    for (Crossing& c : found) {
      c.range =
          exact_range(ray, city.vertex(c.triangle, 0), city.area_normal(c.triangle).normalized(), c.range);
    }
  }
};

RayScene::RayScene(const city::Mesh& city) : RayScene(std::make_shared<const city::Mesh>(city)) {}
RayScene::RayScene(std::shared_ptr<const city::Mesh> city) : impl_(std::make_unique<Impl>(std::move(city))) {}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

InstanceId RayScene::add_instance(const city::Mesh& mesh) {
  const auto id = static_cast<InstanceId>(impl_->instances.size() + 1);
  const std::string name = fmt::format("movable instance {}", id);
  if (mesh.triangles.empty()) throw InputError(name + " has no triangles", "give it a mesh");
  auto instance = std::make_unique<Instance>();
  instance->built = BuiltMesh(impl_->tracing, std::make_shared<const city::Mesh>(mesh), name, false);
  impl_->instances.push_back(std::move(instance));
  return id;
}

void RayScene::set_pose(InstanceId id, const Isometry3d& enu_from_instance) {
  Instance& instance = impl_->instance(id);
  const Eigen::Matrix3d rotation = enu_from_instance.linear();
  if (!enu_from_instance.matrix().allFinite())
    throw InputError(fmt::format("the pose of movable instance {} is not finite", id), "check what moves it");
  if (!(rotation * rotation.transpose()).isIdentity(1e-6) || rotation.determinant() < 0) {
    throw InputError(fmt::format("the pose of movable instance {} is not a rotation and a translation", id),
                     "normalise its quaternion");
  }
  instance.pose = enu_from_instance;
  instance.posed = true;
}

void RayScene::set_visible(InstanceId id, bool visible) {
  impl_->instance(id).visible = visible;
}

void RayScene::remove_instance(InstanceId id) {
  impl_->instance(id).removed = true;
}

void RayScene::commit() {
  impl_->posed.clear();
  impl_->movers.clear();
  impl_->movers_radius = 0;
  for (std::size_t i = 0; i < impl_->instances.size(); ++i) {
    Instance* instance = impl_->instances[i].get();
    if (instance == nullptr) continue;
    if (instance->removed) {
      impl_->instances[i].reset();
      continue;
    }
    if (!instance->posed || !instance->visible) continue;
    const BuiltMesh& built = instance->built;
    const Vector3d centre = instance->pose * built.centre;
    // A millionth plus a millimetre larger than the mesh, for rounding to floats.
    impl_->movers.push_back(
        {centre, built.radius * (1 + 1e-6) + 1e-3, instance->pose.linear().transpose(), &built});
    impl_->posed.push_back({static_cast<InstanceId>(i + 1), built.mesh.get(), instance->pose, built.bounds});
    impl_->movers_radius =
        std::max(impl_->movers_radius, (centre - impl_->city.centre).norm() + built.radius);
  }
}

const city::Mesh& RayScene::city() const {
  return *impl_->city.mesh;
}

const std::vector<PosedInstance>& RayScene::posed_instances() const {
  return impl_->posed;
}

std::optional<Hit> RayScene::cast(const Ray& ray, double min_range_m) const {
  std::optional<Triangles::TriangleHit> found = impl_->city.triangles.first(impl_->probe(ray, min_range_m));
  std::optional<std::size_t> mover_hit;
  for (std::size_t i = 0; i < impl_->movers.size(); ++i) {
    const InstanceBounds& mover = impl_->movers[i];
    const double reach_m = found ? found->range : ray.max_range_m;
    if (!mover.near(ray, min_range_m, reach_m)) continue;
    const auto nearer = mover.built->triangles.first(Impl::probe(ray, min_range_m, reach_m, mover));
    if (!nearer || (found && !(nearer->range < found->range))) continue;
    mover_hit = i;
    found = nearer;
  }
  if (!found) return std::nullopt;

  Hit hit;
  hit.triangle = found->triangle;
  Vector3d corner;
  if (mover_hit) {
    const BuiltMesh& built = *impl_->movers[*mover_hit].built;
    const PosedInstance& posed = impl_->posed[*mover_hit];
    hit.instance = posed.id;
    hit.normal = (posed.enu_from_instance.linear() * built.area_normal(hit.triangle)).normalized();
    corner = posed.enu_from_instance * built.vertex(hit.triangle, 0);
  } else {
    hit.normal = impl_->city.area_normal(hit.triangle).normalized();
    corner = impl_->city.vertex(hit.triangle, 0);
  }
  hit.front = ray.direction.dot(hit.normal) < 0;
  hit.range_m = std::max(min_range_m, Impl::exact_range(ray, corner, hit.normal, found->range));
  return hit;
}

bool RayScene::occluded(const Ray& ray, double min_range_m) const {
  Probe probe = impl_->probe(ray, min_range_m);
  return impl_->city.triangles.occluded(probe) || impl_->occluded_by_movers(ray, min_range_m);
}

// Casts rays one at a time: satellites are spread over the sky, and for such rays packets (rtcOccluded8: 0.59
// of a bare loop's rate, see ray_scene_bench.cpp) are slower than Embree's single-ray traversal, which tests
// one ray against the children of a wide node. Rays are converted in groups, because Embree loads four floats
// at once and would wait for recent stores of single floats.
void RayScene::occluded(std::span<const Ray> rays, std::span<bool> result, double min_range_m) const {
  assert(rays.size() == result.size());
  std::array<Probe, 16> probes;
  for (std::size_t i = 0; i < rays.size(); i += probes.size()) {
    const std::size_t count = std::min(probes.size(), rays.size() - i);
    for (std::size_t k = 0; k < count; ++k) probes[k] = impl_->probe(rays[i + k], min_range_m);
    for (std::size_t k = 0; k < count; ++k) result[i + k] = impl_->city.triangles.occluded(probes[k]);
    for (std::size_t k = 0; k < count; ++k)
      result[i + k] = result[i + k] || impl_->occluded_by_movers(rays[i + k], min_range_m);
  }
}

bool RayScene::occluded_by_city(const Ray& ray) const {
  Probe probe = impl_->probe(ray, 0);
  return impl_->city.triangles.occluded(probe);
}

bool RayScene::occluded_by_instances(const Ray& ray) const {
  return impl_->occluded_by_movers(ray, 0);
}

double RayScene::surface_offset_m(const Vector3d& point) const {
  const double reach = std::max(impl_->city.radius, impl_->movers_radius);
  return 0.5e-3 + 4e-7 * (reach + (point - impl_->city.centre).norm());
}

void check_position(const Vector3d& point, std::string_view what) {
  if (point.norm() <= 1e7) return;  // false for NaN
  throw InputError(fmt::format("{} ({:g}, {:g}, {:g}) is not finite, or more than 10000 km away", what,
                               point.x(), point.y(), point.z()),
                   "points are metres east, north and up in the city's frame; check the antenna's pose");
}

Containment RayScene::containment(const Vector3d& point) const {
  check_position(point, "the point");
  std::vector<Impl::Crossing> found;

  // Straight up: terrain and roofs.
  impl_->crossings({point, Vector3d::UnitZ()}, found);
  bool terrain_above = false, roof_above = false;
  for (const Impl::Crossing& c : found) {
    if (c.range < kSkin_m) continue;
    terrain_above |= impl_->surfaces[c.triangle] == city::Surface::Terrain;
    roof_above |= impl_->surfaces[c.triangle] == city::Surface::Building;
  }
  if (terrain_above) {
    impl_->crossings({point, -Vector3d::UnitZ()}, found);
    double nearest = std::numeric_limits<double>::infinity();
    bool is_on_terrain = false;
    for (const Impl::Crossing& c : found) {
      if (impl_->surfaces[c.triangle] != city::Surface::Terrain || c.range >= nearest) continue;
      nearest = c.range;
      is_on_terrain = impl_->city.area_normal(c.triangle).z() > 0;
    }
    if (!is_on_terrain) return Containment::UnderTerrain;
  }
  if (!roof_above) return Containment::Free;

  std::array<int, kLevelRays> leaves{};
  for (int i = 0; i < kLevelRays; ++i) {
    const double azimuth = level_ray_azimuth_rad(i);
    const Vector3d direction(std::sin(azimuth), std::cos(azimuth), 0);
    impl_->crossings({point, direction}, found);
    for (const Impl::Crossing& c : found) {
      if (impl_->surfaces[c.triangle] != city::Surface::Building) continue;
      leaves[static_cast<std::size_t>(i)] += impl_->city.area_normal(c.triangle).dot(direction) > 0 ? 1 : -1;
    }
  }
  return is_inside(leaves) ? Containment::InsideBuilding : Containment::Free;
}

std::optional<double> RayScene::terrain_height(double x, double y) const {
  const double top = impl_->city.centre.z() + impl_->city.radius + 1;
  const Vector3d origin(x, y, top);
  if (!origin.allFinite()) return std::nullopt;
  std::vector<Impl::Crossing> found;
  impl_->crossings({origin, -Vector3d::UnitZ()}, found);
  std::optional<double> height;
  for (const Impl::Crossing& c : found) {
    if (impl_->surfaces[c.triangle] != city::Surface::Terrain) continue;
    height = std::max(height.value_or(-1e300), top - c.range);
  }
  return height;
}

double RayScene::height_above_ground(const Vector3d& point) const {
  if (impl_->ground) return point.z() - impl_->ground->near(point.x(), point.y());
  const std::optional<double> ground_m = terrain_height(point.x(), point.y());
  return ground_m ? point.z() - *ground_m : 0;
}

}  // namespace canyon::raytrace
