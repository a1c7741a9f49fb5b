#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "canyon/city/city.hpp"

namespace canyon::raytrace {

/// A half-line in the city's ENU frame. `direction` is unit length.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
  double max_range_m = std::numeric_limits<double>::infinity();
};

/// Movable things: 0 is the static city, add_instance() gives 1, 2, ...
using InstanceId = std::uint32_t;

/// What a ray met first.
struct Hit {
  double range_m = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, of the triangle's front side, ENU
  bool front = true;           ///< the ray came from the front side
  InstanceId instance = 0;
  std::uint32_t triangle = 0;  ///< index into that instance's mesh
};

/// Why no signal can be simulated at a place.
enum class Placement : std::uint8_t { Free, InsideBuilding, UnderTerrain };

/// Rays through a static city and movable instances. All const members are thread-safe; the non-const ones
/// must not run beside them. Ranges are within 1e-6 relative + 0.1 mm of exact for coordinates within
/// 10 km of the city's centre (Embree works in floats about that centre, watertight "robust" mode).
class RayScene {
 public:
  /// Builds the static part once. An empty mesh is an open field: every ray is free.
  explicit RayScene(const city::Mesh& city);
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  /// A movable mesh, given in its own frame; hidden until its first set_pose().
  InstanceId add_instance(const city::Mesh& mesh);
  /// Throws InputError for a non-finite pose (names the instance).
  void set_pose(InstanceId instance, const Eigen::Isometry3d& enu_from_instance);
  void set_visible(InstanceId instance, bool visible);
  void remove_instance(InstanceId instance);
  /// Makes changes since the last commit visible to queries; the city is not rebuilt.
  void commit();

  /// First hit farther than `min_range_m`, or nothing within ray.max_range_m. Hits from behind count too.
  [[nodiscard]] std::optional<Hit> cast(const Ray& ray, double min_range_m = 0) const;
  /// Whether anything lies between min_range_m and ray.max_range_m.
  [[nodiscard]] bool occluded(const Ray& ray, double min_range_m = 0) const;
  /// result[i] = occluded(rays[i]); spans of one length. Fastest for coherent rays.
  void occluded(std::span<const Ray> rays, std::span<bool> result) const;

  /// Free, inside a closed building, or below the terrain. Judged by which sides of the surfaces rays from the
  /// point meet first.
  [[nodiscard]] Placement placement(const Eigen::Vector3d& point) const;

  /// Height (ENU z) of the terrain under or above (x, y); empty where there is none.
  [[nodiscard]] std::optional<double> terrain_height(double x, double y) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::raytrace
