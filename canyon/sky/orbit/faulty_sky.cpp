#include "canyon/sky/orbit/faulty_sky.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::orbit {
namespace {

/// Shifts a position and a velocity (ECEF) by an error in the axes of the orbit. The axes rotate with the
/// satellite's motion, and the error with them.
void shift(Eigen::Vector3d& position_m, Eigen::Vector3d& velocity_mps, const MessageError& error,
           double since_s) {
  const Eigen::Vector3d earth(0, 0, geodesy::kEarthRotationRate);
  const Eigen::Vector3d inertial = velocity_mps + earth.cross(position_m);
  const Eigen::Vector3d momentum = position_m.cross(inertial);
  Eigen::Matrix3d axes;
  axes.col(0) = position_m.normalized();
  axes.col(2) = momentum.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const Eigen::Vector3d offset = error.orbit_m + error.orbit_rate_mps * since_s;
  const Eigen::Vector3d rotation(0, 0, momentum.norm() / position_m.squaredNorm());
  const Eigen::Vector3d moved = axes * offset;
  position_m += moved;
  velocity_mps += axes * (error.orbit_rate_mps + rotation.cross(offset)) - earth.cross(moved);
}

/// Bits for "do not use" in every message of the system (gnss::is_healthy()).
int unhealthy(gnss::System system) {
  switch (system) {
    case gnss::System::GPS:
    case gnss::System::QZSS:
      return 0b111111;
    case gnss::System::Galileo:
      return 0b111111111;
    case gnss::System::SBAS:
      return 0b110001;
    case gnss::System::GLONASS:
    case gnss::System::BeiDou:
      break;
  }
  return 1;
}

/// Mean motion without its correction [rad/s], with one gravity for all systems: only changes are used.
double mean_motion(double a_m) {
  return std::sqrt(geodesy::kEarthMu / a_m) / a_m;
}

/// Readers keep their record until the issue of data changes. Regular issues never make this step, and it
/// differs for several simultaneous faults. BeiDou's issue is an age in hours.
void reissue(gnss::KeplerEphemeris& e) {
  constexpr int kStep = 97;
  switch (e.id.system) {
    case gnss::System::Galileo:
      e.iode = (e.iode + kStep) % 1024;
      break;
    case gnss::System::BeiDou:
      e.iode = (e.iode + 1) % 25;
      e.iodc = (e.iodc + 1) % 25;
      break;
    default:
      e.iode = (e.iode + kStep) % 256;
      e.iodc = e.iodc / 256 * 256 + (e.iodc + kStep) % 256;  // its low bits are the IODE
  }
}

void spoil(gnss::KeplerEphemeris& e, const MessageError& error) {
  reissue(e);
  e.af0 += error.clock_s + error.clock_drift * (e.toc - error.since);
  e.af1 += error.clock_drift;
  const double a = e.sqrt_a * e.sqrt_a;
  const double along_m = error.orbit_m.y() + error.orbit_rate_mps.y() * (e.toe - error.since);
  const double longer = a + error.orbit_m.x();
  e.sqrt_a = std::sqrt(longer);
  e.mean_motion_difference += mean_motion(a) - mean_motion(longer) + error.orbit_rate_mps.y() / a;
  e.mean_anomaly += along_m / a;
}

template <typename Ephemeris>
void spoil_vectors(Ephemeris& e, const MessageError& error) {
  Eigen::Vector3d position_m(e.position_m.data()), velocity_mps(e.velocity_mps.data());
  shift(position_m, velocity_mps, error, e.toe - error.since);
  for (std::size_t i = 0; i < 3; ++i) {
    e.position_m[i] = position_m[static_cast<Eigen::Index>(i)];
    e.velocity_mps[i] = velocity_mps[static_cast<Eigen::Index>(i)];
  }
  e.clock_bias_s += error.clock_s + error.clock_drift * (e.toe - error.since);
}

}  // namespace

FaultySky::FaultySky(std::shared_ptr<const Sky> truth, SatelliteFilter concerned, const MessageError& error)
    : truth_(std::move(truth)), concerned_(std::move(concerned)), error_(error) {}

std::vector<gnss::SatelliteId> FaultySky::satellites() const {
  return truth_->satellites();
}

std::optional<SatelliteState> FaultySky::state(gnss::SatelliteId id, geodesy::GpsTime t) const {
  const bool concerned = concerned_(id);
  if (concerned && error_.unhealthy) return std::nullopt;
  std::optional<SatelliteState> state = truth_->state(id, t);
  if (!state || !concerned) return state;
  const double since_s = t - error_.since;
  shift(state->position_m, state->velocity_mps, error_, since_s);
  state->clock_bias_s += error_.clock_s + error_.clock_drift * since_s;
  state->clock_drift += error_.clock_drift;
  return state;
}

std::string FaultySky::source(gnss::SatelliteId id, geodesy::GpsTime t) const {
  const std::string source = truth_->source(id, t);
  return concerned_(id) ? source + (error_.unhealthy ? ", flagged as unhealthy" : ", with an error") : source;
}

SatelliteHealth FaultySky::health(gnss::SatelliteId id, geodesy::GpsTime t) const {
  return error_.unhealthy && concerned_(id) ? SatelliteHealth::Unhealthy : truth_->health(id, t);
}

gnss::NavigationData wrong_messages(gnss::NavigationData messages, const SatelliteFilter& concerned,
                                    const MessageError& error) {
  const auto each = [&](auto& ephemerides, const auto& spoil_one) {
    for (auto& e : ephemerides) {
      if (!concerned(e.id)) continue;
      spoil_one(e);
      if (error.unhealthy) e.health = unhealthy(e.id.system);
    }
  };
  each(messages.kepler, [&](gnss::KeplerEphemeris& e) { spoil(e, error); });
  each(messages.glonass, [&](gnss::GlonassEphemeris& e) {
    spoil_vectors(e, error);
    e.frequency_bias += error.clock_drift;
  });
  each(messages.sbas, [&](gnss::SbasEphemeris& e) {
    e.iodn = (e.iodn + 1) % 256;
    spoil_vectors(e, error);
    e.clock_drift += error.clock_drift;
  });
  return messages;
}

}  // namespace canyon::orbit
