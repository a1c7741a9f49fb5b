#include "canyon/receiver/rtk/recorded_pair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"

namespace canyon::rtk {

namespace {

/// Time tags of receivers that steer their clocks agree to milliseconds [s].
constexpr double kSameTag_s = 0.01;

void keep_signals(std::vector<SignalMeasurement>& measured, const std::vector<std::string>& names) {
  if (names.empty()) return;
  measured.erase(std::remove_if(measured.begin(), measured.end(),
                                [&](const SignalMeasurement& m) {
                                  return std::find(names.begin(), names.end(), m.signal->name) == names.end();
                                }),
                 measured.end());
}

/// The first signals, to which the sky's satellite clocks refer.
std::vector<positioning::Measurement> first_signals(const std::vector<SignalMeasurement>& measured) {
  std::vector<positioning::Measurement> result;
  for (const SignalMeasurement& m : measured)
    if (gnss::index_of(*m.signal) == 0) result.push_back(m.measurement);
  return result;
}

void check_common(const RecordedEpochs& rover, const RecordedEpochs& base, const PairOptions& options) {
  if (rover.empty() || base.empty()) {
    throw InputError(fmt::format("the {} has no epoch", rover.empty() ? "rover" : "base"),
                     "give recordings with observations");
  }
  const geodesy::GpsTime first = base.front()->receiver_time, last = base.back()->receiver_time;
  const geodesy::GpsTime begin = rover.front()->receiver_time, end = rover.back()->receiver_time;
  if (begin - last > options.max_age_s || first - end > kSameTag_s) {
    throw InputError(fmt::format("base ({} to {}) and rover ({} to {}) have no common time",
                                 geodesy::format_gpst(first, 0), geodesy::format_gpst(last, 0),
                                 geodesy::format_gpst(begin, 0), geodesy::format_gpst(end, 0)),
                     "give recordings of the same time");
  }
}

}  // namespace

RecordedEpochs recorded_epochs(const std::vector<rinex::ObservationEpoch>& recorded, const orbit::Sky& sky,
                               const std::optional<Eigen::Vector3d>& point) {
  RecordedSignals signals(sky);
  RecordedEpochs result;
  for (const rinex::ObservationEpoch& epoch : recorded) {
    Corrections epoch_fix;
    const auto reported = point || !epoch.header ? point : epoch.header->antenna_ecef();
    epoch_fix.station_ecef = reported.value_or(Eigen::Vector3d::Constant(std::nan("")));
    epoch_fix.receiver_time = epoch.receiver_time;
    epoch_fix.observations = signals.next(epoch);
    result.push_back(std::make_shared<const Corrections>(std::move(epoch_fix)));
  }
  return result;
}

std::vector<PairEpoch> solve_pair(const RecordedEpochs& rover, const RecordedEpochs& base,
                                  const orbit::Sky& sky,
                                  const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                  const PairOptions& options,
                                  const std::function<void(std::size_t, std::size_t)>& progress) {
  check_common(rover, base, options);
  RtkFilter filter(options.rtk, options.fix, options.max_age_s);
  std::vector<PairEpoch> result;
  result.reserve(rover.size());
  std::size_t next = 0;
  bool related = false;
  for (const auto& epoch : rover) {
    const geodesy::GpsTime time = epoch->receiver_time;
    while (next < base.size() && base[next]->receiver_time - time < kSameTag_s) {
      Corrections base_measurements = *base[next++];
      keep_signals(base_measurements.observations, options.signals);
      filter.take(base_measurements, sky);
    }
    std::vector<SignalMeasurement> measured = epoch->observations;
    keep_signals(measured, options.signals);
    positioning::Fix fix = solve_fix(time, first_signals(measured), sky, options.fix, klobuchar);
    if (auto relative = filter.update(time, measured, sky, fix)) {
      fix = std::move(*relative);
      related = true;
    }
    result.push_back({time, std::move(fix)});
    if (progress) progress(result.size(), rover.size());
  }
  if (!related) {
    throw InputError("no epoch has four satellites with phases of the same signals at base and rover",
                     "check that they record the same systems and bands, and give ephemerides of these");
  }
  return result;
}

std::vector<SignalMeasurement> RecordedSignals::next(const rinex::ObservationEpoch& epoch) {
  constexpr unsigned kLostLock = 1, kHalfCycle = 2;
  std::vector<SignalMeasurement> result;
  std::optional<gnss::SatelliteId> last;
  std::optional<double> l1_hz;
  static const GlonassBiases kNone;
  const GlonassBiases& biases = epoch.header ? epoch.header->glonass_bias_m : kNone;
  for (const rinex::ObservedSignal& seen : epoch.signals) {
    if (seen.id != last) {
      last = seen.id;
      const auto state = sky_.state(seen.id, epoch.receiver_time);
      l1_hz.reset();
      if (state) l1_hz = state->carrier_frequency_hz;
    }
    const gnss::Signal& signal =
        seen.signal != nullptr ? *seen.signal : gnss::signals_of(seen.id.system).front();
    const auto key = std::pair(seen.id, &signal);
    if (epoch.power_failure || (seen.loss_of_lock & kLostLock) != 0) phases_.erase(key);
    if (!l1_hz || !seen.pseudorange_m) continue;
    SignalMeasurement measured;
    measured.signal = &signal;
    positioning::Measurement& m = measured.measurement;
    m.id = seen.id;
    m.pseudorange_m = *seen.pseudorange_m;
    m.doppler_hz = seen.doppler_hz;
    m.cn0_dbhz = seen.cn0_dbhz;
    m.carrier_frequency_hz = gnss::carrier_hz(signal, *l1_hz);
    if (seen.carrier_phase_cycles) {
      const auto found = phases_.find(key);
      const bool goes_on = found != phases_.end() && before_ && found->second.seen == *before_ &&
                           found->second.code == seen.code;
      Phase& phase = phases_[key];
      if (!goes_on) phase.since = epoch.receiver_time;
      phase.seen = epoch.receiver_time;
      phase.code = seen.code;
      m.carrier_phase_cycles = seen.carrier_phase_cycles;
      m.phase_since = phase.since;
      m.half_cycle = (seen.loss_of_lock & kHalfCycle) != 0;
    }
    align(measured, seen.code.data(), biases);
    // RINEX 2 has one phase for all codes of a carrier: it counts once.
    const bool again = std::any_of(result.begin(), result.end(), [&](const SignalMeasurement& other) {
      const positioning::Measurement& o = other.measurement;
      return o.id == m.id && other.signal->carrier_hz == signal.carrier_hz &&
             o.carrier_phase_cycles == m.carrier_phase_cycles && o.doppler_hz == m.doppler_hz &&
             o.cn0_dbhz == m.cn0_dbhz;
    });
    if (again) m.carrier_phase_cycles.reset();
    result.push_back(measured);
  }
  before_ = epoch.receiver_time;
  return result;
}

void DopplerSlips::update(double dt_s, std::span<const ObservedMinusComputed> rover,
                          std::span<const SignalMeasurement> measured) {
  /// A phase and the integral of its Doppler differ by more than this [m] only if the phase slips.
  constexpr double kDopplerParts_m = 1;
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Step> steps;
  std::vector<double> apart;
  for (const SignalMeasurement& seen : measured) {
    const positioning::Measurement& m = seen.measurement;
    if (!m.carrier_phase_cycles || !m.doppler_hz) continue;
    const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
    Step step{*m.carrier_phase_cycles * wavelength_m, -*m.doppler_hz * wavelength_m, 0};
    const auto last = last_steps_.find({m.id, seen.signal});
    if (last != last_steps_.end() && dt_s > 0 && dt_s < 2) {
      step.apart_m =
          step.phase_m - last->second.phase_m - dt_s * (step.doppler_mps + last->second.doppler_mps) / 2;
      apart.push_back(step.apart_m);
    }
    steps[{m.id, seen.signal}] = step;
  }
  slipped_.clear();
  if (apart.size() > 4) {
    const double clock_m = upper_median(apart);
    for (const ObservedMinusComputed& o : rover) {
      const auto step = steps.find({o.id, o.signal});
      if (step == steps.end() || step->second.apart_m == 0) continue;
      if (std::abs(step->second.apart_m - clock_m) > kDopplerParts_m) slipped_.push_back({o.id, o.signal});
    }
  }
  last_steps_ = std::move(steps);
}

bool DopplerSlips::contains(gnss::SatelliteId id, const gnss::Signal* signal) const {
  return std::find(slipped_.begin(), slipped_.end(), std::pair(id, signal)) != slipped_.end();
}

}  // namespace canyon::rtk
