#include "canyon/disturbance/shadowing.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace canyon::disturbance {

Shadowing::Shadowing(const ShadowingOptions& options, std::uint64_t seed, const std::string& key)
    : options_((options.validate(), options)),
      nodes_(options.shared_angle_rad),
      shadows_(nodes_, seed, key + "/shadow"),
      levels_stream_(seed, key + "/shadow level"),
      levels_(nodes_.size()) {
  SkyNodes::draw(levels_stream_, levels_);
  RandomStream stream(seed, key + "/shadow place");
  origin_m_ = stream.uniform() * options_.frame_m;
  axis_ = {stream.normal(), stream.normal(), stream.normal()};
  axis_.normalize();
}

void Shadowing::go_to(double way_m, double height_m) {
  assert(way_m >= way_m_);
  share_above_ = options_.environment == ShadowingEnvironment::Custom
                     ? 1
                     : skyline_numbers(options_).share_above(height_m);
  if (way_m <= way_m_) return;
  const double steps = (way_m - way_m_) / options_.correlation_m;
  const double kept = std::exp(-steps), fresh = std::sqrt(-std::expm1(-2 * steps));
  for (double& level : levels_) level = level * kept + fresh * coins(levels_stream_);
  way_m_ = way_m;
}

Shadowing::Place Shadowing::place(const Eigen::Vector3d& direction) const {
  const double frames =
      (way_m_ + origin_m_ + options_.obstacle_distance_m * axis_.dot(direction)) / options_.frame_m;
  const double frame = std::floor(frames);
  return {static_cast<std::int64_t>(frame), (frames - frame) * options_.frame_m};
}

double Shadowing::passed(FrameStates::States states, double into_m) const {
  if (states.now == states.before || into_m >= options_.transition_m) return states.now ? 1 : 0;
  const double turned = into_m / options_.transition_m;
  return states.now ? turned : 1 - turned;
}

ShadowingParameters Shadowing::parameters(double elevation_rad) const {
  ShadowingParameters p = shadowing_parameters(options_, elevation_rad);
  if (share_above_ == 1) return p;
  const double share = share_above_ * p.shadowed_share();
  p.enter = p.leave * share / (1 - share);
  return p;
}

Shadowing::Shadow Shadowing::of(const Eigen::Vector3d& direction) {
  nodes_.shares(direction, shares_);
  const Place here = place(direction);
  const ShadowingParameters p = parameters(std::asin(std::min(direction.z(), 1.0)));
  const FrameStates::States states = shadows_.at(here.frame, shares_, {p.enter, p.leave});
  const double share = passed(states, here.into_m);
  const double mean = p.clear_mean_db + share * (p.shadowed_mean_db - p.clear_mean_db);
  const double sigma = p.clear_sigma_db + share * (p.shadowed_sigma_db - p.clear_sigma_db);
  return {mean + sigma * SkyNodes::blend(shares_, levels_), states.now};
}

}  // namespace canyon::disturbance
