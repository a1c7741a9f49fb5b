#include "canyon/receiver/fix_input.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/rtk/rtk_filter.hpp"

namespace canyon::receiver {
namespace {

using geodesy::kSpeedOfLight;
using positioning::Measurement;

/// Combinations of closer carriers amplify their own errors more than tenfold.
constexpr double kApart_hz = 100e6;

double squared(double x) {
  return x * x;
}

/// (f1 / f2)^2: ratio of the ionosphere's delays, second over first.
double delay_ratio(const Measurement& first, const Measurement& second) {
  return squared(first.carrier_frequency_hz / second.carrier_frequency_hz);
}

}  // namespace

void FixInputOptions::validate() const {
  gnss::check_signals(uses);
  options::check(smoothing, "smoothing");
  options::check(*this);
  for (const auto& [group, factor] : sigma_factor) gnss::check_group(group);
}

void visit(options::Visitor& v, FixInputOptions& o) {
  static constexpr std::string_view kCombinations[]{"first", "ionosphere_free", "uncombined"};
  v.choice({"combination", "",
            "pseudoranges of the fix: first (the first signal); ionosphere_free (combination of two); "
            "uncombined (with estimated ionospheric delays)"},
           o.combination, kCombinations);
  gnss::visit_signals(v, {"uses", "", "signals used in the fix, best first; if omitted: all tracked signals"},
                      o.uses);
  v.number({"ionosphere_sigma_m", "m",
            "uncombined: standard deviation of the slant delay at L1 after the model's correction"},
           o.ionosphere_sigma_m, {0, 1000, true});
  gnss::visit_group_values(
      v,
      {"sigma_factor", "",
       "factors on the standard deviations of groups of signals in the fix: [GLONASS=1.5, L5=0.5]"},
      o.sigma_factor, {0, 1000, true});
  v.part("smoothing", o.smoothing);
}

FixInput::FixInput(const ReceiverOptions& options)
    : options_(options.fix_input),
      fix_(options.fix),
      noise_(options.slow_error()),
      shared_m_(options.shared_error_m()) {}

void FixInput::gather(const SatelliteObservation& satellite, geodesy::GpsTime time) {
  codes_.clear();
  const auto take = [&](const SignalObservation& observed) {
    if (!observed.measurement) return;
    const Measurement& m = *observed.measurement;
    const gnss::Signal& signal = *observed.signal;
    Code code{
        &signal, m, 1, shared_m_, squared(gnss::kL1_hz / m.carrier_frequency_hz), observed.code_rate_per_s};
    for (const auto& [group, factor] : options_.sigma_factor) {
      if (!gnss::in_group(group, satellite.id, signal, time)) continue;
      code.measurement.sigma_m *= factor;
      code.measurement.sigma_factor *= factor;
      code.shared_m *= factor;
    }
    codes_.push_back(code);
  };
  satellite.for_each_signal(take);
}

/// Keeps the codes that may be used in the fix, best first.
void FixInput::choose(const gnss::Signal& first) {
  const std::vector<std::string>& uses = options_.uses;
  const auto rank = [&](const Code& code) { return std::find(uses.begin(), uses.end(), code.signal->name); };
  std::erase_if(codes_, [&](const Code& code) {
    const std::optional<double>& cn0_dbhz = code.measurement.cn0_dbhz;
    if (cn0_dbhz && *cn0_dbhz < fix_.cn0_mask_dbhz) return true;
    if (!uses.empty()) return rank(code) == uses.end();
    return options_.combination == Combination::First && code.signal != &first;
  });
  if (uses.empty()) return;
  std::stable_sort(codes_.begin(), codes_.end(),
                   [&](const Code& a, const Code& b) { return rank(a) < rank(b); });
}

/// Change of a carrier's range since the previous epoch, if its phase is continuous.
std::optional<double> FixInput::step_m(const Carrier& carrier, const Measurement& m) const {
  if (!carrier.phase_m || !m.carrier_phase_cycles || !m.phase_since || *m.phase_since > carrier.time)
    return std::nullopt;
  return *m.carrier_phase_cycles * kSpeedOfLight / m.carrier_frequency_hz - *carrier.phase_m;
}

void FixInput::smooth(gnss::SatelliteId id, geodesy::GpsTime time) {
  const auto carrier_of = [&](const Code& code) -> Carrier& {
    return carriers_[{id, gnss::index_of(*code.signal)}];
  };
  steps_m_.clear();
  for (const Code& code : codes_) steps_m_.push_back(step_m(carrier_of(code), code.measurement));
  for (std::size_t i = 0; i < codes_.size(); ++i) {
    Measurement& m = codes_[i].measurement;
    std::optional<double> step = steps_m_[i];
    if (step && options_.smoothing.smoothing == positioning::Smoothing::DivergenceFree) {
      double apart_hz = kApart_hz;
      for (std::size_t k = 0; k < codes_.size(); ++k) {
        const Measurement& other = codes_[k].measurement;
        const double hz = std::abs(other.carrier_frequency_hz - m.carrier_frequency_hz);
        if (!steps_m_[k] || hz < apart_hz) continue;
        apart_hz = hz;
        // Carriers measure rho - I and rho - g I; rho + I has the delay of the code.
        step = *steps_m_[i] + 2 * (*steps_m_[i] - *steps_m_[k]) / (delay_ratio(m, other) - 1);
      }
    }
    Carrier& carrier = carrier_of(codes_[i]);
    const double loop_sigma_m = std::sqrt(std::max(0.0, squared(m.sigma_m) - squared(noise_.sigma_m)));
    const auto smoothed = carrier.code.next(
        time, m.pseudorange_m, step, {noise_, {loop_sigma_m, codes_[i].loop_rate_per_s}}, options_.smoothing);
    m.pseudorange_m = smoothed.pseudorange_m;
    m.sigma_factor *= smoothed.sigma_m / m.sigma_m;
    m.sigma_m = smoothed.sigma_m;
    carrier.time = time;
    carrier.phase_m.reset();
    if (m.carrier_phase_cycles)
      carrier.phase_m = *m.carrier_phase_cycles * kSpeedOfLight / m.carrier_frequency_hz;
  }
}

void FixInput::refer_to_l1(const orbit::SatelliteState& state) {
  const double l1_m = positioning::satellite_range(state, nullptr).code;
  for (Code& code : codes_)
    code.measurement.pseudorange_m -= positioning::satellite_range(state, code.signal).code - l1_m;
}

void FixInput::correct(gnss::SatelliteId id, geodesy::GpsTime time, const CodeCorrections& corrections) {
  const double ageing_m = rtk::kAgeing_mps * corrections.age_s(time).value_or(0);
  reported_sigmas_m_.clear();
  std::erase_if(codes_, [&](Code& code) {
    const CodeCorrections::Correction* correction = corrections.of(id, *code.signal);
    if (correction == nullptr) return true;
    Measurement& m = code.measurement;
    const double independent_m = std::sqrt(std::max(0.0, squared(m.sigma_m) - squared(code.shared_m)));
    reported_sigmas_m_.push_back(std::hypot(independent_m, correction->reported_sigma_m, ageing_m));
    const double sigma_m = std::hypot(m.sigma_m, correction->sigma_m);
    m.pseudorange_m += correction->metres;
    m.sigma_factor *= sigma_m / m.sigma_m;
    m.sigma_m = sigma_m;
    return false;
  });
}

std::optional<FixInput::CombinedMeasurement> FixInput::next(const SatelliteObservation& satellite,
                                                            const orbit::SatelliteState& state,
                                                            geodesy::GpsTime time, double model_m,
                                                            const CodeCorrections* corrections) {
  gather(satellite, time);
  if (options_.smoothing.smoothing != positioning::Smoothing::None) smooth(satellite.id, time);
  choose(*satellite.signal);
  refer_to_l1(state);
  std::optional<CombinedMeasurement> chosen = combine(satellite.elevation_rad, model_m);
  if (!chosen || corrections == nullptr) return chosen;
  correct(satellite.id, time, *corrections);
  const auto corrected = combine(satellite.elevation_rad, model_m);
  if (!corrected) return chosen;
  chosen->corrected = corrected->measurement;
  for (std::size_t i = 0; i < codes_.size(); ++i) codes_[i].measurement.sigma_m = reported_sigmas_m_[i];
  const double reported_m = combine(satellite.elevation_rad, model_m)->measurement.sigma_m;
  chosen->corrected->reported_sigma_ratio = std::min(1.0, reported_m / corrected->measurement.sigma_m);
  return chosen;
}

std::optional<FixInput::CombinedMeasurement> FixInput::combine(double elevation_rad, double model_m) {
  if (codes_.empty()) return std::nullopt;
  if (options_.combination == Combination::IonosphereFree) return ionosphere_free();
  if (options_.combination == Combination::Uncombined) return uncombined(elevation_rad, model_m);
  return CombinedMeasurement{codes_.front().measurement, std::nullopt, std::nullopt};
}

std::optional<FixInput::CombinedMeasurement> FixInput::ionosphere_free() const {
  const Code& first = codes_.front();
  const Code* other = nullptr;
  double apart_hz = kApart_hz;
  for (const Code& code : codes_) {
    const double hz = std::abs(code.signal->carrier_hz - first.signal->carrier_hz);
    if (hz < apart_hz || (other != nullptr && hz == apart_hz)) continue;
    apart_hz = hz;
    other = &code;
  }
  if (other == nullptr && !fix_.correct_ionosphere) return std::nullopt;
  CombinedMeasurement chosen{first.measurement, std::nullopt, std::nullopt};
  if (other == nullptr) return chosen;
  // (f1^2 P1 - f2^2 P2) / (f1^2 - f2^2).
  Measurement& m = chosen.measurement;
  const double ratio = delay_ratio(m, other->measurement);
  const double a = ratio / (ratio - 1), b = -1 / (ratio - 1);
  m.pseudorange_m = a * m.pseudorange_m + b * other->measurement.pseudorange_m;
  m.sigma_m = std::hypot(a * m.sigma_m, b * other->measurement.sigma_m);
  m.sigma_factor = std::hypot(a * m.sigma_factor, b * other->measurement.sigma_factor);
  m.ionosphere_fraction = 0;
  return chosen;
}

FixInput::CombinedMeasurement FixInput::uncombined(double elevation_rad, double model_m) {
  // P_i = x + g_i I + e_i, I with the a priori deviation sigma_I about its model. The weights of x are those
  // of the rows of C^-1, C = diag(sigma_i^2) + sigma_I^2 g g^T (Sherman & Morrison).
  double sum = 0, sum_g = 0, sum_gg = 0;
  for (Code& code : codes_) {
    code.sigma_m = fix_.weights.sigma_m(code.measurement, elevation_rad);
    const double weight = 1 / squared(code.sigma_m);
    sum += weight;
    sum_g += weight * code.iono_rate;
    sum_gg += weight * squared(code.iono_rate);
  }
  const double prior = squared(options_.ionosphere_sigma_m);
  const double k = prior * sum_g / (1 + prior * sum_gg);
  const double information = sum - k * sum_g;
  double pseudorange_m = 0, variance = 0, rate = 0;
  for (const Code& code : codes_) {
    const double w = (1 - k * code.iono_rate) / squared(code.sigma_m) / information;
    pseudorange_m += w * code.measurement.pseudorange_m;
    variance += squared(w * code.measurement.sigma_m);
    rate += w * code.iono_rate;
  }
  const Code& first = codes_.front();
  CombinedMeasurement chosen{first.measurement, std::nullopt, std::nullopt};
  if (codes_.size() > 1) {
    // The estimate of I itself, from the residual of each code.
    double seen = 0;
    for (const Code& code : codes_) {
      seen += code.iono_rate / squared(code.sigma_m) *
              (code.measurement.pseudorange_m - pseudorange_m - (code.iono_rate - rate) * model_m);
    }
    chosen.ionosphere_m = model_m + prior / (1 + prior * sum_gg) * seen;
  }
  Measurement& m = chosen.measurement;
  m.pseudorange_m = pseudorange_m;
  m.sigma_m = std::sqrt(variance + prior * squared(rate));
  m.sigma_factor /= std::sqrt(information) * first.sigma_m;
  m.ionosphere_fraction = rate / first.iono_rate;
  return chosen;
}

}  // namespace canyon::receiver
