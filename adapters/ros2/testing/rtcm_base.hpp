#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "adapters/ros2/node_settings.hpp"
#include "adapters/ros2/node_truth.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"

namespace canyon::adapters::ros2::test {

/// A receiver of the node moved by poses, with its log.
class PoseReceiver {
 public:
  PoseReceiver(const NodeSettings& settings, std::shared_ptr<simulation::CityScene> scene,
               geodesy::GpsTime start, const std::string& receiver_name)
      : truth_(settings, scene->city),
        hosted_(setup_of(settings, std::move(scene), start, receiver_name,
                         [this](live::Severity, const std::string& line) { logged_.push_back(line); })) {}
  /// The result of PoseInbox::take().
  std::string add(const simulation::RigidPose& pose, double stamp_s, std::int64_t now_ns) {
    return truth_.take(pose, stamp_s, now_ns);
  }
  void receive_rtcm(std::string_view bytes, std::int64_t now_ns) { hosted_.take_rtcm(bytes, now_ns); }
  std::optional<simulation::ReceiverRunner::Step> observe(std::int64_t now_ns, std::string& reason) {
    (void)hosted_.due(now_ns);
    hosted_.begin(now_ns, [&](std::string& why) {
      auto motion = truth_.at(now_ns, why);
      reason = why;
      return motion;
    });
    hosted_.finish();
    if (hosted_.step() == nullptr) return std::nullopt;
    return *hosted_.step();
  }
  void change(const NodeSettings& settings) { hosted_.set_config(driven_config(settings, "/receiver")); }
  [[nodiscard]] const simulation::ReceiverRunner& receiver() const { return hosted_.receiver(); }
  [[nodiscard]] std::vector<std::string> take_warnings() { return std::exchange(logged_, {}); }

 private:
  std::vector<std::string> logged_;
  NodeTruth truth_;
  live::HostedReceiver hosted_;
};

/// An open field, overridden by `more`.
inline NodeSettings open_field(const Parameters& more) {
  Parameters given{{"city.open", true},
                   {"city.origin.latitude_deg", 22.3},
                   {"city.origin.longitude_deg", 114.17},
                   {"start", "2026-06-01T08:00:00Z"},
                   {"profile", "ublox-f9p"}};
  for (const auto& [name, value] : more) given[name] = value;
  return read_settings(given);
}

inline std::unique_ptr<PoseReceiver> make_receiver(const NodeSettings& settings, const std::string& name) {
  return std::make_unique<PoseReceiver>(
      settings, std::make_shared<simulation::CityScene>(simulation::load_city(settings.live)),
      *settings.live.start, name);
}

/// A base station of that field, with its RTCM 3.
class Base {
 public:
  explicit Base(const Parameters& more = {}) : receiver_(make_receiver(with(more), "/base")) {
    const auto described = encoding::describe_receivers(receiver_->receiver(), 1);
    encoder_ = encoding::format_named("rtcm").make(described.front());
  }
  /// The messages of its epoch at `now_ns`.
  [[nodiscard]] std::string bytes(std::int64_t now_ns) {
    std::string reason;
    return encoder_->encode(receiver_->observe(now_ns, reason).value().epoch);
  }

 private:
  static NodeSettings with(const Parameters& more) {
    Parameters given{
        {"pose.source", "fixed"}, {"fixed.east_m", 900.0}, {"fixed.north_m", 300.0}, {"fixed.up_m", 5.0}};
    for (const auto& [name, value] : more) given[name] = value;
    return open_field(given);
  }

  std::unique_ptr<PoseReceiver> receiver_;
  std::unique_ptr<encoding::Encoder> encoder_;
};

}  // namespace canyon::adapters::ros2::test
