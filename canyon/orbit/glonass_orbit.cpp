// Declared in canyon/orbit/broadcast_sky.hpp.
#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/orbit/broadcast_sky.hpp"

namespace canyon::orbit {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kOmega = geodesy::kPz90RotationRate;
constexpr double kLargestStep = 60;  // [s]

// Equations of motion in the rotating frame, ICD GLONASS L1, L2 5.1, A.3.1.2.
Vector6d derivative(const Vector6d& x, const Eigen::Vector3d& luni_solar) {
  const double r2 = x.head<3>().squaredNorm();
  const double r = std::sqrt(r2);
  const double flattening = 1.5 * geodesy::kPz90J2 * geodesy::kPz90Mu * geodesy::kPz90SemiMajorAxis *
                            geodesy::kPz90SemiMajorAxis / (r2 * r2 * r);
  const double z2 = 5 * x[2] * x[2] / r2;
  const double central = -geodesy::kPz90Mu / (r2 * r);
  Vector6d d;
  d.head<3>() = x.tail<3>();
  const double in_plane = central - flattening * (1 - z2);
  d[3] = (in_plane + kOmega * kOmega) * x[0] + 2 * kOmega * x[4] + luni_solar[0];
  d[4] = (in_plane + kOmega * kOmega) * x[1] - 2 * kOmega * x[3] + luni_solar[1];
  d[5] = (central - flattening * (3 - z2)) * x[2] + luni_solar[2];
  return d;
}

Vector6d at_toe(const gnss::GlonassEphemeris& e) {
  Vector6d x;
  x << e.position_m[0], e.position_m[1], e.position_m[2], e.velocity_mps[0], e.velocity_mps[1],
      e.velocity_mps[2];
  return x;
}

/// Goes on for `left` seconds by whole steps, then the rest: the answer is continuous in time. Steps of 60 s
/// leave 1.3 mm after 30 min.
void integrate(const gnss::GlonassEphemeris& e, Vector6d& x, double left) {
  const Eigen::Vector3d luni_solar(e.acceleration_mps2[0], e.acceleration_mps2[1], e.acceleration_mps2[2]);
  while (left != 0) {
    const double h = std::abs(left) > kLargestStep ? std::copysign(kLargestStep, left) : left;
    const Vector6d k1 = derivative(x, luni_solar);
    const Vector6d k2 = derivative(x + h / 2 * k1, luni_solar);
    const Vector6d k3 = derivative(x + h / 2 * k2, luni_solar);
    const Vector6d k4 = derivative(x + h * k3, luni_solar);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    left -= h;
  }
}

SatelliteState state_of(const gnss::GlonassEphemeris& e, const Vector6d& x, double dt) {
  SatelliteState state;
  state.position_m = x.head<3>();
  state.velocity_mps = x.tail<3>();
  // ICD GLONASS 4.4: tau_n and gamma_n contain relativity.
  state.clock_bias_s = e.clock_bias_s + e.frequency_bias * dt;
  state.clock_drift = e.frequency_bias;
  state.carrier_frequency_hz = l1_frequency_hz(gnss::System::GLONASS, e.channel);
  const auto signals = gnss::signals_of(gnss::System::GLONASS);
  for (std::size_t i = 1; i < signals.size(); ++i) {
    if (signals[i].group_delay != gnss::GroupDelay::DeltaTau) continue;
    state.more_group_delays_s[i - 1] = e.group_delay_difference_s;  // ICD GLONASS 4.4: leaves so much later
  }
  return state;
}

}  // namespace

SatelliteState propagate(const gnss::GlonassEphemeris& e, geodesy::GpsTime t) {
  Vector6d x = at_toe(e);
  const double dt = t - e.toe;
  integrate(e, x, dt);
  return state_of(e, x, dt);
}

struct GlonassOrbit::Steps {
  static constexpr int kEach = 30;
  std::array<std::array<Vector6d, kEach + 1>, 2> after;  ///< forwards, backwards

  explicit Steps(const gnss::GlonassEphemeris& e) {
    for (std::size_t way = 0; way < 2; ++way) {
      after[way][0] = at_toe(e);
      for (std::size_t i = 1; i <= kEach; ++i) {
        after[way][i] = after[way][i - 1];
        integrate(e, after[way][i], way == 0 ? kLargestStep : -kLargestStep);
      }
    }
  }
};

SatelliteState GlonassOrbit::propagate(const gnss::GlonassEphemeris& e, geodesy::GpsTime t) const {
  std::call_once(computed_, [&] { steps_ = std::make_shared<const Steps>(e); });
  const double dt = t - e.toe;
  // The last step of integrate() may be a whole one.
  const double steps = std::ceil(std::abs(dt) / kLargestStep) - 1;
  const auto whole = static_cast<std::size_t>(std::clamp<double>(steps, 0, Steps::kEach));
  Vector6d x = steps_->after[dt < 0 ? 1 : 0][whole];
  integrate(e, x, dt - std::copysign(static_cast<double>(whole) * kLargestStep, dt));
  return state_of(e, x, dt);
}

SatelliteState propagate(const gnss::SbasEphemeris& e, geodesy::GpsTime t) {
  const double dt = t - e.toe;
  const Eigen::Map<const Eigen::Vector3d> position(e.position_m.data()), velocity(e.velocity_mps.data()),
      acceleration(e.acceleration_mps2.data());
  SatelliteState state;
  state.position_m = position + velocity * dt + acceleration * (dt * dt / 2);
  state.velocity_mps = velocity + acceleration * dt;
  state.clock_bias_s = e.clock_bias_s + e.clock_drift * dt;
  state.clock_drift = e.clock_drift;
  state.carrier_frequency_hz = l1_frequency_hz(gnss::System::SBAS);
  return state;
}

}  // namespace canyon::orbit
