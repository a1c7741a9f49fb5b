#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/facades.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::live {

/// The position and heading of a world, as configured in its host.
struct HostOrigin {
  geodesy::Geodetic origin;
  double heading_rad = 0;  ///< direction of the world's x axis, counter-clockwise from east

  /// The world's own axes.
  [[nodiscard]] geodesy::LocalFrame frame() const { return geodesy::LocalFrame(origin, heading_rad); }
  friend bool operator==(const HostOrigin& a, const HostOrigin& b);
};

using simulation::WorldFrame;

/// Combines a value with a hash.
inline void mix(std::uint64_t& sum, std::uint64_t value) {
  sum ^= value + 0x9E3779B97F4A7C15ULL + (sum << 6) + (sum >> 2);
}

/// A host's world, as read by WorldScene. Ids are the host's, unique in the world during the lifetime of the
/// object. Called in the simulation's thread only.
class HostWorld {
 public:
  using Id = std::uint64_t;
  virtual ~HostWorld() = default;
  /// Whether the world advanced or was changed since the last call. If not, no other function is called.
  [[nodiscard]] virtual bool has_advanced() = 0;
  /// Whether static models may have moved since the last call; if not, their poses are not checked.
  [[nodiscard]] virtual bool statics_may_have_moved() { return true; }
  /// Adds the topmost models, in the world's order.
  virtual void models(std::vector<Id>& ids) = 0;
  [[nodiscard]] virtual std::string name(Id model) = 0;
  [[nodiscard]] virtual bool is_static(Id model) = 0;
  /// A number that changes with the scales and the number of links of a model and the models in it; cheap
  /// enough for every step.
  [[nodiscard]] virtual std::uint64_t structure(Id model) = 0;
  /// A number that changes with a model's shapes; more expensive.
  [[nodiscard]] virtual std::uint64_t shapes(Id model) = 0;
  /// Adds the links of a model and of the models in it.
  virtual void links(Id model, std::vector<Id>& ids) = 0;
  /// The pose in the world's frame, as the host has it, finite or not; empty if the link no longer exists.
  [[nodiscard]] virtual std::optional<simulation::RigidPose> pose(Id link) = 0;
  /// The shapes of a link in its own frame [m], front sides outwards; `notes` name omitted shapes.
  [[nodiscard]] virtual city::Mesh mesh(Id link, std::vector<std::string>& notes) = 0;
};

/// The geometry of a host's world as a scene of the engine: static models once, moving ones as instances with
/// their poses. One per world, kind of geometry and frame, shared by its receivers. For one thread at a time;
/// calls that read the world are for the simulation's thread.
class WorldScene {
 public:
  struct Options {
    std::string name;     ///< the world's, for messages
    bool visual = false;  ///< visual instead of collision geometry, for messages and to distinguish scenes
    WorldFrame frame;
    city::FacadeOptions facades = {};  ///< of static models, as of a city that is read from a file
    std::uint64_t seed = 1;            ///< of the random facades
    friend bool operator==(const Options& a, const Options& b);
  };
  explicit WorldScene(std::unique_ptr<HostWorld> world, Options options);
  /// The scene that others in this world (identified by any address) already use with these options, or a new
  /// one from make().
  [[nodiscard]] static std::shared_ptr<WorldScene> of(
      const void* world, const Options& options, const std::function<std::unique_ptr<HostWorld>()>& make);
  ~WorldScene();

  /// Reads the present world: poses of moving models, models that appeared, vanished or changed shape. Cheap
  /// if nothing changed: several receivers call it in one step.
  void follow();
  /// Applies the changes that follow() found, without reading the world. `left_out` (empty: none), a
  /// topmost model, stays invisible until the next call.
  void show(std::optional<HostWorld::Id> left_out);
  void update(std::optional<HostWorld::Id> left_out) {
    follow();
    show(left_out);
  }

  [[nodiscard]] HostWorld& world();
  /// Replaced when the static part is rebuilt; see generation().
  [[nodiscard]] const std::shared_ptr<simulation::CityScene>& scene() const;
  [[nodiscard]] std::uint64_t generation() const;

  /// Notes since the last call, one line each: shapes left out, meshes not found.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::live
