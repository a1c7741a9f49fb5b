#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::test {

/// Satellites on circular orbits by closed form, with imperfect clocks and group delays: a sky that shares no
/// code with the orbit folder's ephemerides. `per_system` satellites of each system in six planes.
class CircularSky final : public orbit::Sky {
 public:
  explicit CircularSky(std::vector<gnss::System> systems, int per_system = 24) {
    for (const gnss::System system : systems) {
      const int index = static_cast<int>(system);
      for (int k = 0; k < per_system; ++k) {
        Satellite s;
        s.radius_m = 26.56e6 + 1.0e6 * index;
        s.node_rad = 2 * geodesy::kPi * (k % 6) / 6 + 0.3 * index;
        s.phase_rad = 2 * geodesy::kPi * (k / 6) / ((per_system + 5) / 6) + 0.7 * (k % 6) + 0.1 * index;
        s.inclination_rad = geodesy::radians(55 + 2 * index);
        s.clock_s = 4e-4 * std::sin(1 + k + 10 * index);
        s.clock_drift = 1e-11 * std::cos(k);
        s.group_delay_s = 5e-9 * std::cos(2 + k + index);
        s.frequency_hz = gnss::l1_frequency_hz(system, k % 14 - 7);
        satellites_[gnss::SatelliteId{system, static_cast<std::uint8_t>(k + 1)}] = s;
      }
    }
  }

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override {
    std::vector<gnss::SatelliteId> ids;
    for (const auto& [id, satellite] : satellites_) ids.push_back(id);
    return ids;
  }

  [[nodiscard]] std::optional<orbit::SatelliteState> state(gnss::SatelliteId id,
                                                           geodesy::GpsTime t) const override {
    const auto found = satellites_.find(id);
    if (found == satellites_.end()) return std::nullopt;
    const Satellite& s = found->second;
    constexpr double kGravity = 3.986005e14;
    const double seconds = t - kEpoch;
    const double motion = std::sqrt(kGravity / s.radius_m) / s.radius_m;
    const double u = s.phase_rad + motion * seconds;
    const double node = s.node_rad - geodesy::kEarthRotationRate * seconds;
    const Eigen::Vector3d ascending(std::cos(node), std::sin(node), 0);
    const Eigen::Vector3d ahead(-std::sin(node) * std::cos(s.inclination_rad),
                                std::cos(node) * std::cos(s.inclination_rad), std::sin(s.inclination_rad));
    orbit::SatelliteState state;
    state.position_m = s.radius_m * (std::cos(u) * ascending + std::sin(u) * ahead);
    state.velocity_mps = s.radius_m * motion * (-std::sin(u) * ascending + std::cos(u) * ahead) -
                         Eigen::Vector3d(0, 0, geodesy::kEarthRotationRate).cross(state.position_m);
    state.clock_bias_s = s.clock_s + s.clock_drift * seconds;
    state.clock_drift = s.clock_drift;
    state.group_delay_s = s.group_delay_s;
    state.carrier_frequency_hz = s.frequency_hz;
    return state;
  }

  [[nodiscard]] std::string source(gnss::SatelliteId, geodesy::GpsTime) const override {
    return "circular test sky";
  }

  static constexpr geodesy::GpsTime kEpoch =
      geodesy::GpsTime::from_nanoseconds(2000 * geodesy::GpsTime::kNanosecondsPerWeek);

 private:
  struct Satellite {
    double radius_m = 0, node_rad = 0, phase_rad = 0, inclination_rad = 0;
    double clock_s = 0, clock_drift = 0, group_delay_s = 0, frequency_hz = 0;
  };
  std::map<gnss::SatelliteId, Satellite> satellites_;
};

}  // namespace canyon::test
