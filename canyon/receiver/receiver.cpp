#include "canyon/receiver/receiver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/receiver/atmosphere.hpp"

namespace canyon::receiver {
namespace {

using geodesy::kSpeedOfLight;
using propagation::Visibility;

/// Noise of one satellite's signal.
struct Channel {
  OuProcess code;
  RandomStream doppler;
  double drifted_mean_m;  ///< added to the mean in drift mode
  geodesy::GpsTime last;
};

bool in_line_of_sight(Visibility visibility) {
  return visibility == Visibility::LOS || visibility == Visibility::LOSMultipath;
}

/// d/dt [m/s] of geometric range plus excess path along the tracked path, per second of true time.
///
/// The light-time equation r = |S(t - r/c) - x(t)| derived: r' = e.(V - v) / (1 + e.(V + omega x S)/c), S and
/// V turned to the axes of reception. A reflection at a plane at rest sees the antenna's velocity along the
/// direction of arrival `a` in place of e; its excess 2 h (n.e), n along e - a, also changes with e while the
/// satellite moves on: 2 h n.e' = 2 excess (e - a).e' / |e - a|^2 (centimetres per second). Two planes have
/// e' times the way from the antenna's image in both to the antenna (propagation::antenna_image()).
double path_rate(const orbit::LineOfSight& line, const Eigen::Vector3d& antenna_velocity,
                 const propagation::Path& path, const Eigen::Matrix3d& ecef_from_enu) {
  const Eigen::Vector3d& e = line.direction_ecef;
  const Eigen::Vector3d& satellite = line.velocity_at_reception_mps;
  double rate = e.dot(satellite);
  if (path.kind == propagation::PathKind::Direct) {
    rate -= e.dot(antenna_velocity);
  } else {
    const Eigen::Vector3d arrival = ecef_from_enu * path.arrival;
    rate -= arrival.dot(antenna_velocity);
    const Eigen::Vector3d relative = satellite - antenna_velocity;
    const Eigen::Vector3d turning = (relative - e * e.dot(relative)) / line.range_m;
    const Eigen::Vector3d normal = e - arrival;
    const double squared = normal.squaredNorm();
    if (path.order == 2) {
      const Eigen::Vector3d between = path.point - path.far_point;
      rate += turning.dot(ecef_from_enu * between - path.leg_m * arrival + (path.leg_m + between.norm()) * e);
    } else if (squared > 1e-8) {  // at grazing incidence e and a agree and the excess is zero
      rate += 2 * path.excess_m * normal.dot(turning) / squared;
    }
  }
  const Eigen::Vector3d omega(0, 0, geodesy::kEarthRotationRate);
  const Eigen::Vector3d inertial = satellite + omega.cross(line.position_at_reception_m);
  return rate / (1 + e.dot(inertial) / kSpeedOfLight);
}

}  // namespace

void NoiseOptions::validate() const {
  ou.validate();
  const auto check = [](const char* field, double value, const char* unit) {
    if (!(value >= 0) || !std::isfinite(value)) {
      throw InputError(fmt::format("{} of the noise is {}", field, value),
                       fmt::format("it must be 0 {} or more", unit));
    }
  };
  check("doppler_sigma_hz", doppler_sigma_hz, "Hz");
  check("drift_below_speed_mps", drift_below_speed_mps, "m/s");
  check("drift_below_los", drift_below_los, "satellites");
  check("drift_mu_sigma_m", drift_mu_sigma_m, "m");
}

void ReceiverOptions::validate() const {
  if (name.empty()) throw InputError("a receiver has no name", "give every receiver a name of its own");
  try {
    fix.validate();
    noise.validate();
    clock.validate();
  } catch (const InputError& error) {
    throw InputError(fmt::format("receiver '{}': {}", name, error.problem()), error.cure());
  }
}

struct Receiver::State {
  State(ReceiverOptions receiver_options, std::uint64_t stream_seed)
      : options(std::move(receiver_options)),
        seed(stream_seed),
        clock(options.clock, RandomStream(seed, options.name + "/clock")) {
    options.validate();
    if (options.noise.enabled) {
      const double drift = options.noise.drift_enabled ? options.noise.drift_mu_sigma_m : 0;
      const double code = std::hypot(options.noise.ou.standard_deviation_m(), drift);
      if (code > 0) sigma_m = code;
      if (options.noise.doppler_sigma_hz > 0) doppler_sigma_hz = options.noise.doppler_sigma_hz;
    }
  }

  [[nodiscard]] InputError error(const std::string& problem, const char* cure) const {
    return InputError(
        fmt::format("receiver '{}' at {}: {}", options.name, geodesy::format_gpst(now), problem), cure);
  }

  void go_to(geodesy::GpsTime time) {
    now = time;
    if (last) {
      if (time < *last) throw error("time runs backwards", "give epochs in order of time");
      clock.advance(time - *last);
    }
    last = time;
  }

  Channel& channel(orbit::SatelliteId id) {
    const auto found = channels.find(id);
    if (found != channels.end()) return found->second;
    const std::string key = options.name + "/" + orbit::to_string(id);
    const double mean = options.noise.drift_mu_sigma_m * RandomStream(seed, key + "/mean").normal();
    return channels
        .emplace(id, Channel{OuProcess(options.noise.ou, RandomStream(seed, key + "/code")),
                             RandomStream(seed, key + "/doppler"), mean, now})
        .first->second;
  }

  Measurement measure(const propagation::SatelliteView& view, const Eigen::Vector3d& velocity,
                      const Eigen::Matrix3d& ecef_from_enu, bool drifting,
                      SatelliteObservation& observation) {
    const orbit::LineOfSight& line = view.line;
    Measurement m;
    m.id = line.id;
    m.carrier_frequency_hz = line.state.carrier_frequency_hz;
    m.sigma_m = sigma_m;
    m.doppler_sigma_hz = doppler_sigma_hz;

    double doppler_noise_hz = 0;
    if (options.noise.enabled) {
      Channel& noise = channel(line.id);
      const double mean = options.noise.ou.mu_m + (drifting ? noise.drifted_mean_m : 0);
      observation.noise_m = noise.code.advance(now - noise.last, mean);
      noise.last = now;
      doppler_noise_hz = options.noise.doppler_sigma_hz * noise.doppler.normal();
    }
    const double atmosphere = atmosphere_m(options.ionosphere, options.troposphere, line);
    const double corrected =
        atmosphere_m(options.fix.correct_ionosphere, options.fix.correct_troposphere, line);
    observation.pseudorange_error_m = observation.excess_m + observation.noise_m + (atmosphere - corrected);
    m.pseudorange_m =
        line.range_m + observation.excess_m +
        kSpeedOfLight * (clock.bias_s() - (line.state.clock_bias_s - line.state.group_delay_s)) + atmosphere +
        observation.noise_m;

    // -(f/c) dP/dT, T the receiver's clock: dT = (1 + drift) dt.
    assert(!view.paths.paths.empty());
    const double rate = path_rate(line, velocity, view.paths.paths.front(), ecef_from_enu) +
                        kSpeedOfLight * (clock.drift() - line.state.clock_drift);
    m.doppler_hz = -m.carrier_frequency_hz / kSpeedOfLight * rate / (1 + clock.drift()) + doppler_noise_hz;
    return m;
  }

  [[nodiscard]] double atmosphere_m(bool ionosphere, bool troposphere, const orbit::LineOfSight& line) const {
    double delay = 0;
    if (ionosphere) {
      delay += klobuchar_delay_m(klobuchar_of(*klobuchar, line.id.system), now, place, line.azimuth_rad,
                                 line.elevation_rad, line.state.carrier_frequency_hz);
    }
    if (troposphere) delay += saastamoinen_delay_m(place, line.elevation_rad);
    return delay;
  }

  ReceiverOptions options;
  std::uint64_t seed;
  ReceiverClock clock;
  std::map<orbit::SatelliteId, Channel> channels;
  std::optional<geodesy::GpsTime> last;
  /// Where there is no noise to state, covariances are per metre and per 0.1 Hz of it.
  double sigma_m = 1;
  double doppler_sigma_hz = 0.1;

  // Of the epoch in hand.
  geodesy::GpsTime now;
  geodesy::Geodetic place;
  const std::map<orbit::System, orbit::Klobuchar>* klobuchar = nullptr;
};

Receiver::Receiver(ReceiverOptions options, std::uint64_t seed)
    : state_(std::make_unique<State>(std::move(options), seed)) {}
Receiver::~Receiver() = default;
Receiver::Receiver(Receiver&&) noexcept = default;
Receiver& Receiver::operator=(Receiver&&) noexcept = default;

const ReceiverOptions& Receiver::options() const {
  return state_->options;
}

ReceiverEpoch Receiver::observe(geodesy::GpsTime time, const Eigen::Vector3d& antenna_ecef,
                                const Eigen::Vector3d& antenna_velocity_ecef,
                                std::span<const propagation::SatelliteView> views,
                                const Eigen::Matrix3d& ecef_from_enu, raytrace::Placement placement,
                                const orbit::Sky& sky,
                                const std::map<orbit::System, orbit::Klobuchar>& klobuchar) {
  State& state = *state_;
  const ReceiverOptions& options = state.options;
  state.now = time;
  if (!antenna_ecef.allFinite()) {
    throw state.error("the antenna's position is not finite", "check the trajectory");
  }
  if (!antenna_velocity_ecef.allFinite()) {
    throw state.error("the antenna's velocity is not finite", "check the trajectory");
  }
  state.go_to(time);
  state.place = geodesy::geodetic_from_ecef(antenna_ecef);
  state.klobuchar = &klobuchar;

  ReceiverEpoch epoch;
  epoch.time = time;
  epoch.clock_bias_s = state.clock.bias_s();
  epoch.clock_drift = state.clock.drift();
  epoch.receiver_time = time + state.clock.bias_s();
  epoch.satellites.reserve(views.size());

  const bool free = placement == raytrace::Placement::Free;
  int los = 0;
  for (const propagation::SatelliteView& view : views) {
    SatelliteObservation observation;
    observation.id = view.line.id;
    observation.azimuth_rad = view.line.azimuth_rad;
    observation.elevation_rad = view.line.elevation_rad;
    observation.above_mask = view.line.elevation_rad >= options.fix.elevation_mask_rad;
    if (free) {
      observation.visibility = view.paths.visibility;
      observation.excess_m = view.paths.tracked_excess_m();
    }
    if (observation.above_mask) {
      ++(observation.visibility == Visibility::Blocked ? epoch.blocked : epoch.visible);
      if (in_line_of_sight(observation.visibility)) ++los;
    }
    epoch.satellites.push_back(observation);
  }

  const bool drifting =
      options.noise.drift_enabled && (antenna_velocity_ecef.norm() < options.noise.drift_below_speed_mps ||
                                      los < options.noise.drift_below_los);
  std::vector<Measurement> measurements;
  measurements.reserve(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    SatelliteObservation& observation = epoch.satellites[i];
    if (!observation.above_mask || observation.visibility == Visibility::Blocked) continue;
    observation.measurement =
        state.measure(views[i], antenna_velocity_ecef, ecef_from_enu, drifting, observation);
    measurements.push_back(*observation.measurement);
  }
  std::sort(epoch.satellites.begin(), epoch.satellites.end(),
            [](const SatelliteObservation& a, const SatelliteObservation& b) { return a.id < b.id; });

  if (!free) {
    epoch.fix.status = FixStatus::NoSignal;
    return epoch;
  }
  epoch.fix = solve_fix(epoch.receiver_time, measurements, sky, options.fix, klobuchar);
  for (SatelliteObservation& observation : epoch.satellites) {
    observation.used = std::binary_search(epoch.fix.used.begin(), epoch.fix.used.end(), observation.id);
  }
  return epoch;
}

}  // namespace canyon::receiver
