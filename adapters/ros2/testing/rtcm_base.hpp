#pragma once

#include <memory>
#include <string>
#include <vector>

#include "adapters/ros2/node_settings.hpp"
#include "adapters/ros2/pose_receiver.hpp"
#include "canyon/output/encoder.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/load_city.hpp"

namespace canyon::adapters::ros2::test {

/// An open field, `more` over it.
inline NodeSettings open_field(const Parameters& more) {
  Parameters given{{"city.open", true},
                   {"city.origin.latitude_deg", 22.3},
                   {"city.origin.longitude_deg", 114.17},
                   {"start", "2026-06-01T08:00:00Z"},
                   {"profile", "ublox-f9p"}};
  for (const auto& [name, value] : more) given[name] = value;
  return read_settings(given);
}

inline PoseReceiver make_receiver(const NodeSettings& settings, const std::string& name) {
  std::vector<std::string> warnings;
  return {settings, std::make_shared<simulation::CityScene>(simulation::load_city(settings.live, warnings)),
          *settings.live.start, name};
}

/// A base station of that field, with its RTCM 3.
class Base {
 public:
  explicit Base(const Parameters& more = {}) : receiver_(make_receiver(with(more), "/base")) {
    const auto described = output::describe_receivers(receiver_.receiver(), 1);
    encoder_ = output::format_named("rtcm").make(described.front());
  }
  /// The messages of its epoch at `now_ns`.
  [[nodiscard]] std::string bytes(std::int64_t now_ns) {
    std::string reason;
    return encoder_->encode(receiver_.observe(now_ns, reason).value().epoch);
  }

 private:
  static NodeSettings with(const Parameters& more) {
    Parameters given{
        {"pose.source", "fixed"}, {"fixed.east_m", 900.0}, {"fixed.north_m", 300.0}, {"fixed.up_m", 5.0}};
    for (const auto& [name, value] : more) given[name] = value;
    return open_field(given);
  }

  PoseReceiver receiver_;
  std::unique_ptr<output::Encoder> encoder_;
};

}  // namespace canyon::adapters::ros2::test
