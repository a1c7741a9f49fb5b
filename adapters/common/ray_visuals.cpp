#include "adapters/common/ray_visuals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::adapters {

namespace {

using Eigen::Vector3d;
using propagation::Visibility;

// Radii are proportional to a ray's length, so that distant rays stay visible.
constexpr double kLineRadius = 8e-4, kThinLineRadius = 4e-4, kReflectionRadius = 4e-3,
                 kSatelliteRadius = 2.4e-2;
constexpr double kLineAlpha = 0.9, kThinLineAlpha = 0.45, kFaintLineAlpha = 0.25, kBubbleAlpha = 0.4;

bool has_position(const live::ReceiverReport& report) {
  return report.antenna_world_m.allFinite() && report.link_attitude_world.coeffs().allFinite();
}

class RayDrawing {
 public:
  RayDrawing(const live::ReceiverReport& report, double ray_length)
      : antenna_(report.antenna_world_m),
        cosine_(std::cos(report.world_yaw_from_enu_rad)),
        sine_(std::sin(report.world_yaw_from_enu_rad)),
        length_(ray_length) {}

  /// @param visibility for the receiver: paths too weak for it are not drawn
  /// @param range of the direct ray [m], infinite if unknown
  void add(const propagation::SatelliteView& view, Visibility visibility, double range) {
    satellite_ = to_string(view.line.id);
    const drawing::Colour colour = drawing::colour_of(visibility);
    const Vector3d towards =
        world(geodesy::enu_from_azimuth_elevation(view.line.azimuth_rad, view.line.elevation_rad));
    if (visibility == Visibility::LOS || visibility == Visibility::LOSMultipath) {
      const Vector3d end = antenna_ + length_ * towards;
      line("direct", antenna_, end, kLineRadius, colour.with_alpha(kLineAlpha));
      ball("satellite", end, kSatelliteRadius, colour);
    } else if (visibility == Visibility::Blocked) {
      line("direct", antenna_, antenna_ + std::min(range, length_) * towards, kThinLineRadius,
           colour.with_alpha(kThinLineAlpha));
      return;
    }
    const bool tracked = visibility == Visibility::NLOS;  // the reflected signal, not the direct one
    std::size_t sampled = 0;
    for (const propagation::Path& path : view.paths.paths) {
      if (path.kind == propagation::PathKind::Direct) continue;
      // A diffracted wave at the edge of a clear path is almost parallel to the path.
      if (path.kind == propagation::PathKind::Diffracted && !tracked) continue;
      if (sampled == kMaxRenderedPaths) break;
      const std::string name = "path" + std::to_string(sampled++);
      const Vector3d point = world(path.point);
      if (path.kind == propagation::PathKind::Diffuse) {
        // One of many paths: faint, without its own mark.
        line(name + ".in", antenna_, point, kThinLineRadius, colour.with_alpha(kFaintLineAlpha));
        line(name + ".out", point, point + length_ * towards, kThinLineRadius,
             colour.with_alpha(kFaintLineAlpha));
        continue;
      }
      const double radius = tracked ? kLineRadius : kThinLineRadius;
      line(name + ".in", antenna_, point, radius, colour.with_alpha(kLineAlpha));
      ball(name + ".point", point, kReflectionRadius, colour);
      Vector3d last = point;  // the reflection next to the satellite
      if (path.order == 2) {
        last = world(path.far_point);
        line(name + ".between", point, last, radius, colour.with_alpha(kLineAlpha));
        ball(name + ".far_point", last, kReflectionRadius, colour);
      }
      line(name + ".out", last, last + length_ * towards, radius,
           colour.with_alpha(tracked ? kLineAlpha : kThinLineAlpha));
    }
  }

  [[nodiscard]] std::vector<VisualShape> take() { return std::move(shapes_); }

 private:
  /// World and ENU differ by a rotation about the vertical and have the same origin.
  [[nodiscard]] Vector3d world(const Vector3d& enu) const {
    return {cosine_ * enu.x() - sine_ * enu.y(), sine_ * enu.x() + cosine_ * enu.y(), enu.z()};
  }
  void line(const std::string& name, const Vector3d& from, const Vector3d& to, double radius,
            drawing::Colour colour) {
    const double length = (to - from).norm();
    if (!std::isfinite(length) || length <= 0) return;  // an antenna touching a wall
    VisualShape shape;
    shape.name = satellite_ + "." + name;
    shape.kind = VisualShape::Kind::Cylinder;
    shape.centre = (from + to) / 2;
    shape.axis = (to - from) / length;
    shape.length = length;
    shape.radius = radius * length_;
    shape.colour = colour;
    shapes_.push_back(std::move(shape));
  }
  void ball(const std::string& name, const Vector3d& centre, double radius, drawing::Colour colour) {
    if (!centre.allFinite()) return;
    VisualShape shape;
    shape.name = satellite_ + "." + name;
    shape.centre = centre;
    shape.radius = radius * length_;
    shape.colour = colour;
    shapes_.push_back(std::move(shape));
  }

  Vector3d antenna_;
  double cosine_, sine_;
  double length_;
  std::string satellite_;
  std::vector<VisualShape> shapes_;
};

}  // namespace

bool operator==(const VisualShape& a, const VisualShape& b) {
  const auto same = [](const Vector3d& u, const Vector3d& v) {
    return (u - v).cwiseAbs().maxCoeff() <= 1e-6;
  };
  return same_look(a, b) && same(a.centre, b.centre) && same(a.axis, b.axis) && a.length == b.length &&
         a.radius == b.radius;
}

bool same_look(const VisualShape& a, const VisualShape& b) {
  return a.name == b.name && a.kind == b.kind && a.lit == b.lit && a.colour.r == b.colour.r &&
         a.colour.g == b.colour.g && a.colour.b == b.colour.b && a.colour.a == b.colour.a;
}

std::vector<VisualShape> ray_shapes(const live::ReceiverReport& report, double ray_length_m) {
  if (report.step == nullptr || !has_position(report)) return {};
  const auto& views = report.step->arrival.views;
  std::map<gnss::SatelliteId, Visibility> above_mask;
  for (const receiver::SatelliteObservation& s : report.step->epoch.observed.satellites)
    if (s.above_mask) above_mask[s.id] = s.visibility;
  // Direct and mirror ray of each satellite, alternating.
  const bool has_ranges = report.scan_ranges_m.size() == 2 * views.size();
  RayDrawing drawing(report, ray_length_m);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto found = above_mask.find(views[i].line.id);
    if (found == above_mask.end()) continue;
    drawing.add(views[i], found->second,
                has_ranges ? report.scan_ranges_m[2 * i] : std::numeric_limits<double>::infinity());
  }
  return drawing.take();
}

std::vector<VisualShape> bubble_shapes(const live::ReceiverReport& report, double scale) {
  if (report.step == nullptr || !has_position(report)) return {};
  const simulation::Epoch& epoch = report.step->epoch;
  const double error = std::hypot(epoch.error_enu_m.x(), epoch.error_enu_m.y());
  VisualShape bubble;
  bubble.name = "bubble";
  bubble.centre = report.antenna_world_m;
  bubble.lit = true;
  if (epoch.observed.fix.status == positioning::FixStatus::Fix && std::isfinite(error)) {
    bubble.radius = std::clamp(scale * error, kBubbleSmallest_m, kBubbleLargest_m);
    bubble.colour = drawing::viridis(error / kBubbleWorst_m).with_alpha(kBubbleAlpha);
  } else {
    bubble.radius = kBubbleNoFix_m;
    bubble.colour = drawing::colour_of(Visibility::Blocked).with_alpha(kBubbleAlpha);
  }
  return {bubble};
}

std::vector<VisualShape> visual_shapes(const live::ReceiverReport& report, const VisualSettings& settings) {
  std::vector<VisualShape> shapes;
  if (settings.show_rays) shapes = ray_shapes(report, settings.ray_length_m);
  if (!settings.show_bubble) return shapes;
  for (VisualShape& shape : bubble_shapes(report, settings.bubble_scale)) shapes.push_back(std::move(shape));
  return shapes;
}

std::vector<VisualLedger::Change> VisualLedger::update(const std::vector<VisualShape>& shapes,
                                                       bool everything) {
  std::vector<Change> changes;
  std::set<std::string> seen;
  for (const VisualShape& shape : shapes) {
    if (!seen.insert(shape.name).second) continue;
    const auto [at, is_new] = entries_.try_emplace(shape.name);
    Entry& entry = at->second;
    if (is_new) entry.id = next_id_();
    const bool whole = is_new || everything || !same_look(entry.shape, shape);
    if (whole || !entry.visible || !(entry.shape == shape))
      changes.push_back({shape.name, entry.id, true, whole, shape});
    entry.visible = true;
    entry.shape = shape;
  }
  for (auto& [name, entry] : entries_) {
    if (!entry.visible || seen.contains(name)) continue;
    entry.visible = false;
    changes.push_back({name, entry.id, false, false, {}});
  }
  return changes;
}

std::vector<std::string> VisualLedger::clear() {
  std::vector<std::string> names;
  names.reserve(entries_.size());
  for (const auto& entry : entries_) names.push_back(entry.first);
  entries_.clear();
  return names;
}

}  // namespace canyon::adapters
