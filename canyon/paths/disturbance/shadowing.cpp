#include "canyon/paths/disturbance/shadowing.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::disturbance {
namespace {

/// Angle between satellites whose shadows correlate by exp(-1/2): 10 deg.
constexpr double kSharedAngle_rad = 0.17453292519943295;
/// Transition of mean and deviation, linear in travelled distance, after a change of state [m], at most a
/// frame.
constexpr double kTransition_m = 2.2;
/// Correlation length of levels (to 1/e) [m].
constexpr double kCorrelation_m = 1.7;
/// Distance from antenna to obstacle [m]: if a satellite's direction rotates by an angle, shadows move over
/// the antenna by at most this times the angle, and a bridge shades the satellites ahead before those behind.
/// Assumed, range 2 (a vehicle) to 30 (across a street).
constexpr double kObstacleDistance_m = 10;
/// Speed at which obstacles pass an antenna at rest [m/s]: vehicles and people come and go, leaves move.
/// Added in quadrature to the antenna's own speed, so that it matters at rest only. Assumed: an urban shadow
/// of 33 m (mean) then ends after some five minutes. Range 0.01 (parked vehicles) to 1 (traffic).
constexpr double kObstacleSpeed_mps = 0.1;

}  // namespace

Shadowing::Shadowing(const ShadowingOptions& options, std::uint64_t seed, const std::string& key)
    : options_((options.validate(), options)),
      nodes_(kSharedAngle_rad),
      shadows_(nodes_, seed, key + "/shadow"),
      levels_stream_(seed, key + "/shadow level"),
      levels_(nodes_.size()) {
  SkyNodes::draw(levels_stream_, levels_);
  RandomStream stream(seed, key + "/shadow place");
  origin_m_ = stream.uniform() * options_.frame_m;
  axis_ = {stream.normal(), stream.normal(), stream.normal()};
  axis_.normalize();
}

void Shadowing::go_to(double travelled_m, double height_m) {
  assert(travelled_m >= travelled_m_);
  fraction_above_ = options_.numbers ? 1 : options_.skyline.fraction_above(height_m);
  if (travelled_m <= travelled_m_) return;
  const double steps = (travelled_m - travelled_m_) / kCorrelation_m;
  const double kept = std::exp(-steps), fresh = std::sqrt(-std::expm1(-2 * steps));
  for (double& level : levels_) level = level * kept + fresh * coins(levels_stream_);
  travelled_m_ = travelled_m;
}

Shadowing::SkyCell Shadowing::locate(const Eigen::Vector3d& direction) const {
  const double frames =
      (travelled_m_ + origin_m_ + kObstacleDistance_m * axis_.dot(direction)) / options_.frame_m;
  const double frame = std::floor(frames);
  return {static_cast<std::int64_t>(frame), (frames - frame) * options_.frame_m};
}

double Shadowing::passed(FrameStates::States states, double into_m) const {
  if (states.now == states.before || into_m >= kTransition_m) return states.now ? 1 : 0;
  const double rotated = into_m / kTransition_m;
  return states.now ? rotated : 1 - rotated;
}

ShadowingParameters Shadowing::parameters(double elevation_rad) const {
  ShadowingParameters p = shadowing_parameters(options_, elevation_rad);
  if (fraction_above_ == 1) return p;
  const double fraction = fraction_above_ * p.shadowed_fraction();
  p.enter = p.leave * fraction / (1 - fraction);
  return p;
}

Shadowing::Shadow Shadowing::of(const Eigen::Vector3d& direction) {
  nodes_.weights(direction, weights_);
  const SkyCell here = locate(direction);
  const ShadowingParameters p = parameters(std::asin(std::min(direction.z(), 1.0)));
  const FrameStates::States states = shadows_.at(here.frame, weights_, {p.enter, p.leave});
  const double fraction = passed(states, here.into_m);
  const double mean = p.clear_mean_db + fraction * (p.shadowed_mean_db - p.clear_mean_db);
  const double sigma = p.clear_sigma_db + fraction * (p.shadowed_sigma_db - p.clear_sigma_db);
  return {mean + sigma * SkyNodes::blend(weights_, levels_), states.now};
}

DirectShadowing::DirectShadowing(const ShadowingOptions& options, std::uint64_t seed,
                                 const std::string& receiver)
    : shadowing_(options, seed, receiver), skyline_(options, seed) {}

void DirectShadowing::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  if (before_) {
    travelled_m_ += std::hypot((antenna.position_ecef - before_->position_ecef).norm(),
                               kObstacleSpeed_mps * (antenna.time - before_->time));
  }
  before_ = antenna;
  shadowing_.go_to(travelled_m_, arrival.height_above_ground_m);
  if (arrival.containment != raytrace::Containment::Free) return;
  skyline_.go_to(arrival.antenna_enu.head<2>(), arrival.height_above_ground_m);
  for (propagation::SatelliteView& view : arrival.views) {
    for (propagation::Path& path : view.paths.paths) {
      if (path.kind == propagation::PathKind::Transmitted) continue;
      double level_db = skyline_.level_db(path.arrival);
      if (path.kind == propagation::PathKind::Direct) {
        level_db +=
            shadowing_.of(geodesy::enu_from_azimuth_elevation(view.line.azimuth_rad, view.line.elevation_rad))
                .level_db;
      }
      if (level_db != 0) path.amplitude_factor *= std::pow(10, level_db / 20);
    }
  }
}

namespace {

/// Cached frames. The slowest published chain goes back farther with a probability of 1e-6.
constexpr std::int64_t kSlots = 64;
constexpr int kFarthest = 4096;

}  // namespace

FrameStates::FrameStates(const SkyNodes& nodes, std::uint64_t seed, std::string_view key)
    : size_(nodes.size()),
      root_(RandomStream(seed, key).next()),
      frames_(kSlots, std::numeric_limits<std::int64_t>::min()),
      quarters_(kSlots * size_) {}

double FrameStates::uniform(std::int64_t frame, std::span<const SkyNodes::NodeWeight> weights) {
  const std::size_t slot = static_cast<std::uint64_t>(frame) % kSlots;
  const std::span<std::int8_t> quarters = std::span(quarters_).subspan(slot * size_, size_);
  if (frames_[slot] != frame) {
    RandomStream stream(mix64(root_ + kGolden64 * static_cast<std::uint64_t>(frame)), "frame");
    for (std::int8_t& number : quarters) number = static_cast<std::int8_t>(4 * coins(stream));
    frames_[slot] = frame;
  }
  return upper_tail(-SkyNodes::blend(weights, quarters) / 4);
}

bool FrameStates::state(std::int64_t frame, std::span<const SkyNodes::NodeWeight> weights, Steps steps) {
  const double stay = 1 - steps.leave;
  const double low = std::min(steps.enter, stay), high = std::max(steps.enter, stay);
  bool rotated = false;  // flipped by the frames between
  for (int back = 0;; ++back) {
    const double u = uniform(frame - back, weights);
    if (u < low || u >= high) return (u < low) != rotated;
    if (back == kFarthest)
      return (u - low < (high - low) * steps.enter / (steps.enter + steps.leave)) != rotated;
    // Between the bounds the state stays, or it flips in chains that change more often than not.
    if (steps.enter > stay) rotated = !rotated;
  }
}

FrameStates::States FrameStates::at(std::int64_t frame, std::span<const SkyNodes::NodeWeight> weights,
                                    Steps steps) {
  States states;
  states.before = state(frame - 1, weights, steps);
  states.now = uniform(frame, weights) < (states.before ? 1 - steps.leave : steps.enter);
  return states;
}

}  // namespace canyon::disturbance
