#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::test {

/// An antenna and its clock, moved by white acceleration and white and random-walk frequency, stepped exactly
/// (a step's gain g gives g dt / 2, and a part of variance q dt^3 / 12 that does not depend on it); and the
/// measurements of a receiver there, by an independent implementation of the measurement equations.
class TestDrive {
 public:
  TestDrive(const orbit::Sky& sky, geodesy::GpsTime start, const geodesy::Geodetic& geodetic,
            std::uint64_t seed)
      : sky_(sky),
        random_(seed, "drive"),
        time_(start),
        position_(geodesy::ecef_from_geodetic(geodetic)),
        ecef_from_enu_(geodesy::enu_from_ecef_rotation(geodetic).transpose()) {}

  Eigen::Vector3d velocity_enu = Eigen::Vector3d::Zero();
  /// Roots of densities of the acceleration, ENU [m/s^2/sqrt(Hz)]; 0: as steered.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
  double clock_frequency_density = 0, clock_drift_density = 0;
  double bias_s = 0, drift = 0;
  std::map<gnss::System, double> system_bias_m;
  double sigma_m = 2;
  double doppler_sigma_hz = 0.2;
  bool doppler = true;
  double mask_rad = 0.2;

  void advance(double dt) {
    Eigen::Vector3d step = velocity_enu * dt;
    for (int axis = 0; axis < 3; ++axis) {
      const double gain = acceleration(axis) * std::sqrt(dt) * random_.normal();
      step(axis) += gain * dt / 2 + acceleration(axis) * dt * std::sqrt(dt / 12) * random_.normal();
      velocity_enu(axis) += gain;
    }
    position_ += ecef_from_enu_ * step;
    const double gain = std::sqrt(clock_drift_density * dt) * random_.normal();
    bias_s += drift * dt + gain * dt / 2 +
              std::sqrt(clock_drift_density * dt * dt * dt / 12) * random_.normal() +
              std::sqrt(clock_frequency_density * dt) * random_.normal();
    drift += gain;
    time_ = time_ + dt;
  }

  /// Measurements of every satellite above the mask, with white noise of sigma_m and doppler_sigma_hz.
  [[nodiscard]] std::vector<positioning::Measurement> measure() {
    using geodesy::kSpeedOfLight;
    std::vector<positioning::Measurement> measurements;
    const orbit::Observer observer(position_);
    const Eigen::Vector3d velocity = ecef_from_enu_ * velocity_enu;
    const Eigen::Vector3d omega(0, 0, geodesy::kEarthRotationRate);
    for (const gnss::SatelliteId id : sky_.satellites()) {
      const auto line = orbit::line_of_sight(sky_, id, time_, observer);
      if (!line || line->elevation_rad < mask_rad) continue;
      positioning::Measurement m;
      m.id = id;
      m.carrier_frequency_hz = line->state.carrier_frequency_hz;
      m.sigma_m = sigma_m;
      m.doppler_sigma_hz = doppler_sigma_hz;
      m.pseudorange_m = line->range_m +
                        kSpeedOfLight * (bias_s - line->state.clock_bias_s + line->state.group_delay_s) +
                        sigma_m * random_.normal();
      if (const auto bias = system_bias_m.find(id.system); bias != system_bias_m.end()) {
        m.pseudorange_m += bias->second;
      }
      if (doppler) {
        const double g = 1 + line->direction_ecef.dot(line->velocity_at_reception_mps +
                                                      omega.cross(line->position_at_reception_m)) /
                                 kSpeedOfLight;
        const double rate = line->direction_ecef.dot(line->velocity_at_reception_mps - velocity) / g;
        m.doppler_hz = -(rate + kSpeedOfLight * (drift - line->state.clock_drift)) / (1 + drift) *
                           m.carrier_frequency_hz / kSpeedOfLight +
                       doppler_sigma_hz * random_.normal();
      }
      measurements.push_back(m);
    }
    return measurements;
  }

  [[nodiscard]] geodesy::GpsTime receiver_time() const { return time_ + bias_s; }
  [[nodiscard]] const Eigen::Vector3d& position() const { return position_; }
  [[nodiscard]] Eigen::Vector3d error_enu(const positioning::Fix& fix) const {
    return ecef_from_enu_.transpose() * (fix.position_ecef - position_);
  }
  [[nodiscard]] double elevation_rad(gnss::SatelliteId id) const {
    return orbit::line_of_sight(sky_, id, time_, position_)->elevation_rad;
  }
  [[nodiscard]] double azimuth_rad(gnss::SatelliteId id) const {
    return orbit::line_of_sight(sky_, id, time_, position_)->azimuth_rad;
  }
  [[nodiscard]] RandomStream& random() { return random_; }

 private:
  const orbit::Sky& sky_;
  RandomStream random_;
  geodesy::GpsTime time_;
  Eigen::Vector3d position_;
  Eigen::Matrix3d ecef_from_enu_;
};

}  // namespace canyon::test
