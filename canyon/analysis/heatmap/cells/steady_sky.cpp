#include "canyon/analysis/heatmap/cells/steady_sky.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "canyon/analysis/heatmap/cells/cell_values.hpp"
#include "canyon/analysis/heatmap/cells/receiver_realizations.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/random_streams.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;

constexpr double kAmplitudePerDb = 20;

/// The loop of all receivers with these options, made once for each kind of signal.
std::shared_ptr<const tracking::BatchCodeLock> lane_lock_of(
    const tracking::ChannelModel::Kind& kind,
    std::vector<std::shared_ptr<const tracking::BatchCodeLock>>& made) {
  for (const auto& each : made)
    if (&each->tracker() == kind.tracker.get()) return each;
  return made.emplace_back(std::make_shared<const tracking::BatchCodeLock>(kind.tracker));
}

}  // namespace

SteadySky::SteadySky(const simulation::Environment& environment, const receiver::ReceiverOptions& options,
                     int max_clusters, const MonteCarloOptions& monte_carlo, int lanes,
                     const Vector3d& centre, geodesy::GpsTime time)
    : lanes_(lanes), padded_(tracking::BatchCodeLock::padded(static_cast<std::size_t>(lanes))) {
  const geodesy::LocalFrame& frame = environment.city().frame;
  const Vector3d centre_ecef = frame.ecef_from_local(centre);
  const orbit::Observer observer(centre_ecef);
  const std::string key = receiver::stream_name(options);
  // Lane 0 has the phases of realization 0.
  const int models = std::max(1, lanes - 1);
  NoiseSamples sampled;
  const double height_m = environment.scene().height_above_ground(centre);
  const bool obstacles = *disturbance::skyline_numbers(options.signal.shadowing).fraction > 0;
  for (int d = 0; d < models; ++d) {
    const std::uint64_t seed = sampled.seeds.emplace_back(seed_of(monte_carlo, time, d));
    models_.emplace_back(options.signal, seed, options.name, key);
    if (options.signal.shadowing.active()) {
      sampled.shadowings.emplace_back(options.signal.shadowing, seed, key).go_to(0, height_m);
      if (obstacles) skylines_.emplace_back(options.signal.shadowing, seed);
    }
  }

  const TileErrors common{options, environment.klobuchar(), time, geodesy::geodetic_from_ecef(centre_ecef)};
  std::vector<gnss::SatelliteId> above;
  std::vector<orbit::LineOfSight> lines;
  for (const gnss::SatelliteId id : environment.sky().satellites()) {
    const auto line = orbit::line_of_sight(environment.sky(), id, time, observer);
    if (!line || !(line->elevation_rad > 0) || line->elevation_rad < options.fix.elevation_mask_rad) continue;
    above.push_back(id);
    lines.push_back(*line);
  }
  sampled.space = range_errors_by_sample(environment.errors().get(), monte_carlo, time, lanes - 1, above);
  for (const sky::RangeErrorModel& each : sampled.space)
    sampled.receptions.push_back(each.reception(time, centre_ecef));

  std::erase_if(lines, [&](const orbit::LineOfSight& line) { return common.signal_of(line.id) == nullptr; });
  fix_satellites_ = heatmap::fix_satellites(lines, common.centre);
  const Eigen::Matrix3d local_from_ecef = frame.ecef_from_local_rotation().transpose();
  Locks locks;
  for (const orbit::LineOfSight& line : lines) {
    SteadySatellite s = satellite_of(common, line, locks);
    s.direction = directions_.emplace_back(local_from_ecef * line.direction_ecef);
    fill_lanes(common, sampled, static_cast<std::size_t>(max_clusters), s);
    satellites_.push_back(std::move(s));
  }
}

/// The values common to all lanes.
SteadySatellite SteadySky::satellite_of(const TileErrors& common, const orbit::LineOfSight& line,
                                        Locks& locks) {
  SteadySatellite s;
  s.line = line;
  s.direction_rate_radps = propagation::SatelliteView{line, {}}.direction_rate_radps();
  s.signal = common.signal_of(line.id);
  s.carrier_hz = gnss::carrier_hz(*s.signal, line.state.carrier_frequency_hz);
  s.wavelength_m = geodesy::kSpeedOfLight / s.carrier_hz;
  s.sigma_factor = common.sigma_factor(line.id, *s.signal);
  const tracking::ChannelModel::Kind& kind = models_.front().kind(*s.signal);
  s.code = lane_lock_of(kind, locks);
  s.peak_power = kind.peak_power;
  if (common.options.signal.loop_noise) s.noise = kind.noise;
  return s;
}

/// Sets the random values of each lane's receiver.
void SteadySky::fill_lanes(const TileErrors& common, NoiseSamples& samples, std::size_t bundles,
                           SteadySatellite& s) {
  const receiver::ReceiverOptions& options = common.options;
  const orbit::LineOfSight& line = s.line;
  const Vector3d look_angles = geodesy::enu_from_azimuth_elevation(line.azimuth_rad, line.elevation_rad);
  for (auto* list : {&s.error_m, &s.clear_cn0_hz, &s.direct_factor, &s.code_normal, &s.cn0_noise_db})
    list->assign(padded_, 0);
  for (auto* list : {&s.fade_re, &s.fade_im, &s.fade_power}) list->assign(bundles * padded_, 0);
  for (int lane = 0; lane < lanes_; ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    const bool quiet = lane == 0;
    const auto d = static_cast<std::size_t>(quiet ? 0 : lane - 1);
    const tracking::ChannelModel& model = models_[d];
    const double offset_db = quiet ? gnss::sum_of(options.signal.offset_db, line.id, *s.signal, common.time)
                                   : model.offset_db(line.id, *s.signal, common.time);
    s.clear_cn0_hz[i] = tracking::cn0_hz(model.clear_cn0_dbhz(*s.signal, line.elevation_rad, offset_db));
    s.direct_factor[i] = quiet || samples.shadowings.empty()
                             ? 1
                             : std::pow(10, samples.shadowings[d].of(look_angles).level_db / kAmplitudePerDb);
    propagation::SatelliteView view{line, {}};
    if (!quiet && !samples.space.empty()) view.space = samples.space[d].at(line, samples.receptions[d]);
    s.error_m[i] = common.error_m(view, *s.signal, s.carrier_hz);
    if (options.noise.enabled) {
      s.error_m[i] += quiet ? options.noise.ou.mu_m
                            : receiver::pseudorange_noise(options, samples.seeds[d], line.id, *s.signal)
                                  .advance(0, options.noise.ou.mu_m);
    }
    if (options.biases.drift_sigma_m > 0)
      s.error_m[i] += receiver::bias_drift(options, samples.seeds[d], *s.signal).advance(0);
    if (!quiet) {
      s.code_normal[i] = tracking::LoopNoise(s.code->tracker().options().loop_bandwidth_hz,
                                             model.stream(line.id, *s.signal, "dll"))
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
    if (lane == 1) {  // the same as lane 0
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
