#include "canyon/heatmap/cells/steady_sky.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/heatmap/cells/cell_receivers.hpp"
#include "canyon/heatmap/cells/cell_values.hpp"
#include "canyon/positioning/fix.hpp"
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/receiver/receiver_draws.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;

constexpr double kAmplitudePerDb = 20;

/// The loop of all receivers of these options, made once for each kind of signal.
std::shared_ptr<const tracking::LaneCodeLock> lane_lock_of(
    const tracking::ChannelModel::Kind& kind,
    std::vector<std::shared_ptr<const tracking::LaneCodeLock>>& made) {
  for (const auto& each : made) {
    if (&each->tracker() == kind.tracker.get()) return each;
  }
  return made.emplace_back(std::make_shared<const tracking::LaneCodeLock>(kind.tracker));
}

}  // namespace

SteadySky::SteadySky(const simulation::Environment& environment, const receiver::ReceiverOptions& options,
                     int most_bundles, const DrawOptions& draws, int lanes, const Vector3d& centre,
                     geodesy::GpsTime time)
    : lanes_(lanes),
      padded_((static_cast<std::size_t>(lanes) + tracking::LaneCodeLock::kWidth - 1) /
              tracking::LaneCodeLock::kWidth * tracking::LaneCodeLock::kWidth),
      time_(time) {
  const geodesy::LocalFrame& frame = environment.city().frame;
  const Vector3d centre_ecef = frame.ecef_from_local(centre);
  const geodesy::Geodetic place = geodesy::geodetic_from_ecef(centre_ecef);
  const Eigen::Matrix3d local_from_ecef = geodesy::enu_from_ecef_rotation(place);
  const orbit::Observer observer(centre_ecef);
  const std::string key = receiver::draws_of(options);
  // Lane 0 has the phases of draw 0.
  const int models = std::max(1, lanes - 1);
  std::vector<std::uint64_t> seeds;
  std::vector<disturbance::Shadowing> shadowings;
  const bool obstacles = disturbance::skyline_numbers(options.signal.shadowing).share > 0;
  for (int d = 0; d < models; ++d) {
    seeds.push_back(seed_of(draws, time, d));
    models_.emplace_back(options.signal, seeds.back(), options.name, key);
    if (options.signal.shadowing.active()) {
      shadowings.emplace_back(options.signal.shadowing, seeds.back(), key);
      if (obstacles) skylines_.emplace_back(options.signal.shadowing, seeds.back(), key);
    }
  }

  std::vector<gnss::SatelliteId> above;
  std::vector<orbit::LineOfSight> lines;
  for (const gnss::SatelliteId id : environment.sky().satellites()) {
    const auto line = orbit::line_of_sight(environment.sky(), id, time, observer);
    if (!line || !(line->elevation_rad > 0) || line->elevation_rad < options.fix.elevation_mask_rad) continue;
    above.push_back(id);
    lines.push_back(*line);
  }
  const std::vector<errors::SpaceErrors> space = space_of_draws(environment, draws, time, lanes - 1, above);
  std::vector<errors::SpaceErrors::Reception> receptions;
  receptions.reserve(space.size());
  for (const errors::SpaceErrors& each : space) receptions.push_back(each.reception(time, centre_ecef));

  const Input input{environment, options, seeds, space, receptions, shadowings, time, place, local_from_ecef};
  std::vector<std::shared_ptr<const tracking::LaneCodeLock>> locks;
  std::vector<const gnss::Signal*> wanted;
  for (const orbit::LineOfSight& line : lines) {
    receiver::signals_to_track(options, line.id, time, wanted);
    if (wanted.empty()) continue;
    SteadySatellite s = satellite_of(input, line, *wanted.front());
    const tracking::ChannelModel::Kind& kind = models_.front().kind(*s.signal);
    s.code = lane_lock_of(kind, locks);
    s.peak_power = kind.peak_power;
    if (options.signal.loop_noise) {
      // The variance is linear in 1 / (C/N0) and its square: both factors follow from two values.
      const double at_30 = std::pow(tracking::dll_jitter_m(*kind.tracker, 30), 2);
      const double at_20 = std::pow(tracking::dll_jitter_m(*kind.tracker, 20), 2);
      s.jitter_2 = (at_20 / 1e-2 - at_30 / 1e-3) / (1e-2 - 1e-3);
      s.jitter_1 = at_30 / 1e-3 - s.jitter_2 * 1e-3;
    }
    fill_lanes(input, static_cast<std::size_t>(most_bundles), s);
    directions_.push_back(s.direction);
    satellites_.push_back(std::move(s));
  }
}

/// The values that all lanes have in common.
SteadySatellite SteadySky::satellite_of(const Input& input, const orbit::LineOfSight& line,
                                        const gnss::Signal& signal) const {
  const receiver::ReceiverOptions& options = input.options;
  SteadySatellite s;
  s.line = line;
  s.direction = input.environment.city().frame.ecef_from_local_rotation().transpose() * line.direction_ecef;
  s.local = input.local_from_ecef * line.direction_ecef;
  s.turning_radps = propagation::SatelliteView{line, {}}.turning_radps();
  s.signal = &signal;
  s.carrier_hz = gnss::carrier_hz(signal, line.state.carrier_frequency_hz);
  s.wavelength_m = geodesy::kSpeedOfLight / s.carrier_hz;
  for (const auto& [group, factor] : options.ranging.sigma_factor) {
    if (gnss::in_group(group, line.id, signal, input.time)) s.sigma_factor *= factor;
  }
  const auto delay_m = [&](bool ionosphere, bool troposphere) {
    return positioning::atmosphere_m(ionosphere, troposphere, input.environment.klobuchar(), line.id.system,
                                     s.carrier_hz, input.time, input.place,
                                     {line.azimuth_rad, line.elevation_rad});
  };
  const double atmosphere_m = delay_m(options.ionosphere, options.troposphere) -
                              delay_m(options.fix.correct_ionosphere, options.fix.correct_troposphere);
  s.error_m.assign(padded_, 0);
  std::fill_n(
      s.error_m.begin(), lanes_,
      atmosphere_m + receiver::fixed_bias_m(options.biases, line.id, signal, s.carrier_hz, input.time));
  return s;
}

/// The pseudorange's error that the models of the atmosphere do not explain.
double SteadySky::error_m(const errors::SpaceDelays& space, const Input& input,
                          const orbit::LineOfSight& line, const SteadySatellite& s) {
  const receiver::ReceiverOptions& options = input.options;
  const auto beside_model = [&](bool ionosphere, double delay_m) {
    return delay_m - positioning::atmosphere_m(ionosphere, !ionosphere, input.environment.klobuchar(),
                                               line.id.system, s.carrier_hz, input.time, input.place,
                                               {line.azimuth_rad, line.elevation_rad});
  };
  const double rate = std::pow(gnss::kL1_hz / s.carrier_hz, 2);
  return (options.orbit_errors ? space.orbit_clock_m : 0) +
         (options.ionosphere ? beside_model(true, rate * space.ionosphere_m) : 0) +
         (options.troposphere ? beside_model(false, space.troposphere_m) : 0);
}

/// Fills in the random values of each lane's receiver.
void SteadySky::fill_lanes(const Input& input, std::size_t bundles, SteadySatellite& s) {
  const receiver::ReceiverOptions& options = input.options;
  const orbit::LineOfSight& line = s.line;
  const Vector3d look = geodesy::enu_from_azimuth_elevation(line.azimuth_rad, line.elevation_rad);
  for (auto* list : {&s.clear_cn0_hz, &s.direct_factor, &s.code_normal, &s.cn0_noise_db}) {
    list->assign(padded_, 0);
  }
  for (auto* list : {&s.fade_re, &s.fade_im, &s.fade_power}) list->assign(bundles * padded_, 0);
  for (int lane = 0; lane < lanes_; ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    const bool quiet = lane == 0;
    const auto d = static_cast<std::size_t>(quiet ? 0 : lane - 1);
    const tracking::ChannelModel& model = models_[d];
    const double offset_db = quiet ? gnss::sum_of(options.signal.offset_db, line.id, *s.signal, input.time)
                                   : model.offset_db(line.id, *s.signal, input.time);
    s.clear_cn0_hz[i] = tracking::cn0_hz(model.clear_cn0_dbhz(*s.signal, line.elevation_rad, offset_db));
    s.direct_factor[i] = quiet || input.shadowings.empty()
                             ? 1
                             : std::pow(10, input.shadowings[d].of(look).level_db / kAmplitudePerDb);
    if (options.noise.enabled) {
      s.error_m[i] += quiet ? options.noise.ou.mu_m
                            : receiver::pseudorange_noise(options, input.seeds[d], line.id, *s.signal)
                                  .advance(0, options.noise.ou.mu_m);
    }
    if (!quiet && !input.space.empty()) {
      s.error_m[i] += error_m(input.space[d].at(line, input.receptions[d]), input, line, s);
    }
    if (options.biases.drift_sigma_m > 0) {
      s.error_m[i] += receiver::bias_drift(options, input.seeds[d], *s.signal).advance(0);
    }
    if (!quiet) {
      s.code_normal[i] =
          tracking::LoopNoise(options.signal.dll.loop_bandwidth_hz, model.stream(line.id, *s.signal, "dll"))
              .advance(0, 1);
      s.cn0_noise_db[i] = options.signal.cn0_sigma_db * model.stream(line.id, *s.signal, "cn0").normal();
    }
    tracking::PathFades fades = model.fades(line.id, *s.signal);
    for (std::size_t k = 0; k < bundles; ++k) {
      const std::complex<double> fade = fades.rayleigh(k + 1, 0);
      const double size = std::abs(fade);
      s.fade_power[k * padded_ + i] = static_cast<float>(size * size);
      s.fade_re[k * padded_ + i] = size > 0 ? static_cast<float>(fade.real() / size) : 0;
      s.fade_im[k * padded_ + i] = size > 0 ? static_cast<float>(fade.imag() / size) : 0;
    }
  }
}

void SteadySky::phases_of(std::size_t satellite, std::uint64_t reflector, float* re, float* im) const {
  const SteadySatellite& s = satellites_[satellite];
  for (int lane = 0; lane < lanes_; ++lane) {
    const auto d = static_cast<std::size_t>(std::max(0, lane - 1));
    if (lane == 1) {  // as lane 0
      re[1] = re[0];
      im[1] = im[0];
      continue;
    }
    const std::complex<double> phase =
        models_[d].fades(s.line.id, *s.signal).fixed(models_[d].phases(), reflector);
    re[lane] = static_cast<float>(phase.real());
    im[lane] = static_cast<float>(phase.imag());
  }
}

}  // namespace canyon::heatmap
