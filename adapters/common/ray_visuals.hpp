#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "canyon/outputs/drawing/palette.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"

// A receiver in a host's world, drawn as plain shapes.

namespace canyon::adapters {

/// A cylinder or a sphere in the host's world frame, lengths in metres.
struct VisualShape {
  enum class Kind { Cylinder, Sphere };

  std::string name;  ///< unique among the shapes of a receiver, constant from update to update
  Kind kind = Kind::Sphere;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< a cylinder's: unit
  double length = 0;                                ///< a cylinder's: > 0
  double radius = 0;                                ///< > 0
  drawing::Colour colour;                           ///< alpha 1 is opaque
  bool lit = false;  ///< shaded by the scene's lights; otherwise the colour is unshaded

  /// Positions that differ by at most 1e-6 m count as equal.
  friend bool operator==(const VisualShape& a, const VisualShape& b);
};
[[nodiscard]] bool same_look(const VisualShape& a, const VisualShape& b);  ///< except position and size

struct VisualSettings {
  bool show_rays = false;     ///< to each satellite: ray_shapes()
  bool show_bubble = false;   ///< around the antenna: bubble_shapes()
  double bubble_scale = 1;    ///< metres of radius for a metre of error; > 0
  double ray_length_m = 100;  ///< length of rays without a hit; > 0
};

/// Maximum number of drawn paths of one satellite: the shortest.
inline constexpr std::size_t kMaxRenderedPaths = 3;
/// Horizontal error [m] at the end of the bubble's colour scale.
inline constexpr double kBubbleWorst_m = 20;
/// Minimum and maximum radius of a bubble [m], and its radius without a fix.
inline constexpr double kBubbleSmallest_m = 1, kBubbleLargest_m = 30, kBubbleNoFix_m = 2;

/// Rays of the satellites above the receiver's elevation mask, in the colours of visibilities in all of
/// Canyon's pictures (drawing::colour_of), named by satellite ("G05.direct", "G05.path0.point"):
///  - LOS: a line from the antenna towards the satellite, with a ball at its end
///  - LOS+multipath: the same, and thinner lines through the reflection points
///  - NLOS: lines antenna - reflection point or edge - towards the satellite, with a ball at that point;
///  scattered paths are thin and faint, without a ball
///  - blocked: a thin faint line towards the satellite, which ends at the hit if the report has ranges
/// Empty if the report has no epoch. `ray_length_m` > 0: length of lines without a hit; radii are
/// proportional.
[[nodiscard]] std::vector<VisualShape> ray_shapes(const live::ReceiverReport& report, double ray_length_m);

/// The paper's translucent bubble around the antenna: its radius is `scale` (> 0) times the horizontal error,
/// clamped to kBubbleSmallest_m and kBubbleLargest_m; its colour is drawing::viridis (as in Canyon's picture
/// of a drive), from dark without error to yellow at kBubbleWorst_m and above. Without a fix it is grey, with
/// radius kBubbleNoFix_m. Empty if the report has no epoch.
[[nodiscard]] std::vector<VisualShape> bubble_shapes(const live::ReceiverReport& report, double scale);

/// All requested shapes: rays, then the bubble.
[[nodiscard]] std::vector<VisualShape> visual_shapes(const live::ReceiverReport& report,
                                                     const VisualSettings& settings);

/// The look of a shape, in a Gazebo Material message: shapes that are not lit are emissive.
template <typename Material>
void set_material(Material& material, const VisualShape& shape) {
  const auto set = [&shape](auto* to, double strength) {
    to->set_r(static_cast<float>(strength * shape.colour.r));
    to->set_g(static_cast<float>(strength * shape.colour.g));
    to->set_b(static_cast<float>(strength * shape.colour.b));
    to->set_a(static_cast<float>(shape.colour.a));
  };
  set(material.mutable_ambient(), shape.lit ? 0.7 : 0);
  set(material.mutable_diffuse(), shape.lit ? 0.7 : 0);
  set(material.mutable_specular(), 0);
  set(material.mutable_emissive(), shape.lit ? 0.3 : 1);
  material.set_lighting(true);
}

/// Stores the shapes sent to clients, and finds the new ones.
class VisualLedger {
 public:
  struct Change {
    std::string name;
    std::uint32_t id = 0;
    bool visible = true;  ///< false: only `name` and `id` count
    bool whole = true;    ///< false: already sent with this colour; only position and size are new
    VisualShape shape;
  };

  /// `next_id` returns a number unique in the world for each new shape.
  explicit VisualLedger(std::function<std::uint32_t()> next_id) : next_id_(std::move(next_id)) {}

  /// Replaces the visible shapes. Returns those to send: new, changed or visible again
  /// (`everything`: all of them, whole), and those that are no longer there.
  [[nodiscard]] std::vector<Change> update(const std::vector<VisualShape>& shapes, bool everything);
  /// Returns all shapes ever sent, including hidden ones, and resets to nothing sent.
  [[nodiscard]] std::vector<std::string> clear();

 private:
  struct Entry {
    std::uint32_t id = 0;
    bool visible = false;
    VisualShape shape;
  };
  std::function<std::uint32_t()> next_id_;
  std::map<std::string, Entry> entries_;
};

/// Time of the machine's steady clock.
[[nodiscard]] inline double steady_now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Allows one call in every interval of a clock read by the caller.
class RateLimit {
 public:
  explicit RateLimit(double interval_s) : interval_s_(interval_s) {}
  /// `now_s` of any steady clock.
  [[nodiscard]] bool due(double now_s) {
    if (armed_ && now_s - last_s_ < interval_s_) return false;
    armed_ = true;
    last_s_ = now_s;
    return true;
  }
  /// Allows the next call.
  void reset() { armed_ = false; }

 private:
  double interval_s_;
  double last_s_ = 0;
  bool armed_ = false;
};

}  // namespace canyon::adapters
