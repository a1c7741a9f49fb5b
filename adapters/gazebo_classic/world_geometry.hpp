#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <gazebo/physics/PhysicsTypes.hh>
#include <memory>
#include <string>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::adapters::gazebo_classic {

/// Where Gazebo's world lies on the Earth: its origin, and its x axis turned counter-clockwise from east.
struct WorldFrame {
  geodesy::LocalFrame enu;
  double heading_rad = 0;

  /// Rotation about the vertical; world and ENU share their origin.
  [[nodiscard]] Eigen::Matrix3d enu_from_world() const {
    return Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
};

/// The geometry of a Gazebo world as a scene of the engine: static models once, moving ones as instances that
/// follow. One per world, kind of geometry and frame, shared by its receivers. For the simulation's thread
/// only.
class WorldGeometry {
 public:
  struct Options {
    bool visual = false;  ///< visual instead of collision geometry
    WorldFrame frame;
  };
  /// The geometry that others in this world use already, or a new one. It holds the world weakly.
  [[nodiscard]] static std::shared_ptr<WorldGeometry> of(const gazebo::physics::WorldPtr& world,
                                                         const Options& options);
  ~WorldGeometry();

  /// Brings the scene up to date with the world as it stands: poses of moving models, models that appeared,
  /// vanished or changed shape. `left_out` (null: none), a topmost model, stays invisible until the next
  /// call. Cheap where nothing changed: several receivers call it in one step.
  void update(const gazebo::physics::ModelPtr& left_out);

  /// Replaced when the static part is built anew; see generation().
  [[nodiscard]] const std::shared_ptr<simulation::CityScene>& scene() const;
  [[nodiscard]] std::uint64_t generation() const;

  /// What there is to say since the last call, one line each: shapes left out, meshes not found.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  explicit WorldGeometry(const gazebo::physics::WorldPtr& world, const Options& options);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::adapters::gazebo_classic
