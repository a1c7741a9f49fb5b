#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::raytrace {

/// A half-line in the city's ENU frame. `direction` is unit length.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
  double max_range_m = std::numeric_limits<double>::infinity();
};

/// Throws InputError if `point` is not finite, or more than 10,000 km from the origin of its frame:
/// single-precision rays cannot resolve a city there. @param what names the point in the message
void check_position(const Eigen::Vector3d& point, std::string_view what);

/// Movable objects: 0 is the static city, add_instance() returns 1, 2, ...
using InstanceId = std::uint32_t;

/// The first surface on a ray.
struct Hit {
  double range_m = 0;
  Eigen::Vector3d normal{0, 0, 1};  ///< unit, of the triangle's front side, ENU
  bool front = true;                ///< the ray hit the front side
  InstanceId instance = 0;
  std::uint32_t triangle = 0;  ///< index into that instance's mesh
};

/// Reason why no signal can be simulated at a point.
enum class Containment : std::uint8_t {
  Free,
  InsideBuilding,
  UnderTerrain,
  Unknown  ///< the point is not known; never returned by a scene
};

/// A movable mesh with its pose at the last commit.
struct PosedInstance {
  InstanceId id = 0;
  const city::Mesh* mesh = nullptr;  ///< in its own frame; valid until the next commit()
  Eigen::Isometry3d enu_from_instance = Eigen::Isometry3d::Identity();
  Eigen::AlignedBox3d bounds;  ///< of the mesh, in its own frame
};

/// Rays through a static city and movable instances. All const members are thread-safe; the non-const ones
/// must not run concurrently with them. Ranges are within 1e-6 relative + 0.1 mm of exact for coordinates
/// within 10 km of the city's centre. Embree finds the triangle in floats about that centre (watertight
/// "robust" mode; hits within surface_offset_m() of an outer edge are uncertain); the range to its plane is
/// then computed in doubles. No ray passes between triangles that share an edge; of rays aimed exactly at a
/// vertex, about 1 in 5,000 does. Rays must be finite with a unit direction (asserted).
class RayScene {
 public:
  /// Builds the static part once. An empty mesh is an open field: every ray is free. Throws InputError as
  /// city::check_mesh does.
  explicit RayScene(const city::Mesh& city);
  /// The same without a copy of the mesh, which must not change.
  explicit RayScene(std::shared_ptr<const city::Mesh> city);
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  /// A movable mesh, given in its own frame; hidden until its first set_pose(). The mesh is copied. Ids are
  /// not reused. Throws InputError as city::check_mesh does, or for a mesh without triangles.
  InstanceId add_instance(const city::Mesh& mesh);
  /// Throws InputError for a non-finite or non-rigid pose, or an unknown or removed instance (named).
  void set_pose(InstanceId instance, const Eigen::Isometry3d& enu_from_instance);
  /// Instances are visible unless hidden here. Throws InputError for an unknown or removed instance.
  void set_visible(InstanceId instance, bool visible);
  /// Throws InputError for an unknown or removed instance.
  void remove_instance(InstanceId instance);
  /// Makes changes since the last commit visible to queries; does not rebuild the city.
  void commit();
  /// The static part.
  [[nodiscard]] const city::Mesh& city() const;
  /// The visible instances since the last commit, by id.
  [[nodiscard]] const std::vector<PosedInstance>& posed_instances() const;

  /// First hit farther than `min_range_m`, or nothing within ray.max_range_m. Back sides count too.
  [[nodiscard]] std::optional<Hit> cast(const Ray& ray, double min_range_m = 0) const;
  /// Whether there is a surface between min_range_m and ray.max_range_m.
  [[nodiscard]] bool occluded(const Ray& ray, double min_range_m = 0) const;
  /// result[i] = occluded(rays[i], min_range_m); spans of one length. Fastest for coherent rays.
  void occluded(std::span<const Ray> rays, std::span<bool> result, double min_range_m = 0) const;
  /// occluded(ray) by the static city alone, and by the movable instances alone.
  [[nodiscard]] bool occluded_by_city(const Ray& ray) const;
  [[nodiscard]] bool occluded_by_instances(const Ray& ray) const;

  /// Free, inside a building, or below the terrain, for the static city. InputError if not finite.
  /// Inside a building: a roof is above the point, and on most of seven horizontal rays, walls hit from
  /// behind outnumber those hit from the front (or the reverse, if a building is inside out). Because every
  /// wall on the ray counts, the test tolerates walls shared by two buildings, overlapping parts, missing
  /// floors and single missing walls; the roof condition keeps streets, courtyards and doubtful walls from
  /// being classified as inside. Under the terrain: a terrain sheet is more than 1 mm above the point, and no
  /// sheet below it is hit from above.
  [[nodiscard]] Containment containment(const Eigen::Vector3d& point) const;

  /// Height (ENU z) of the terrain under or above (x, y), of the highest of several sheets; empty: none.
  [[nodiscard]] std::optional<double> terrain_height(double x, double y) const;

  /// Height of a point above the ground [m], which is the terrain under or above it. The ground of a city
  /// without any terrain is at its lowest point within some 100 m, else at its lowest point, of an empty city
  /// at 0. 0 beyond the edge of a terrain.
  [[nodiscard]] double height_above_ground(const Eigen::Vector3d& point) const;

  /// Distance [m] by which a point on a surface must be lifted along its normal so that no ray from or to the
  /// point hits that surface: 0.5 mm plus 4e-7 of the distances from the city's centre involved (six
  /// roundings to float of the point and of the farthest vertex).
  [[nodiscard]] double surface_offset_m(const Eigen::Vector3d& point) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The rule by which a point under a roof counts as inside a building, for every tracer:
// RayScene::containment() casts the rays; heat maps count them for all cells at once.

/// Surfaces closer than this above a point do not cover it [m].
inline constexpr double kSkin_m = 1e-3;

inline constexpr int kLevelRays = 7;
/// From north, clockwise [rad]; odd values, so that no ray is parallel to the walls of a street grid.
/// @param i in [0, kLevelRays)
[[nodiscard]] constexpr double level_ray_azimuth_rad(int i) {
  return 0.2137 + i * (2 * geodesy::kPi / kLevelRays);
}

/// Whether most of the rays leave a building, or most enter one (it is inside out).
/// @param leaves walls that each ray hits from behind minus those that it hits from the front
[[nodiscard]] inline bool is_inside(const std::array<int, kLevelRays>& leaves) {
  const auto inside = std::count_if(leaves.begin(), leaves.end(), [](int walls) { return walls > 0; });
  const auto inside_out = std::count_if(leaves.begin(), leaves.end(), [](int walls) { return walls < 0; });
  return std::max(inside, inside_out) > kLevelRays / 2;
}

}  // namespace canyon::raytrace
