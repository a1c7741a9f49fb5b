#include "canyon/receiver/tracking/code_tracking.hpp"

#include <fmt/format.h>

#include <boost/container/small_vector.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/receiver/tracking/zero_search.hpp"

namespace canyon::tracking {
namespace {

constexpr double kStep = 0.25;         // of a time constant, between two evaluations of the discriminator
constexpr double kCheckedChips = 1.5;  // before the replica, for earlier paths
constexpr double kAtRest = 1e-10;      // chips
constexpr double kSilent = ZeroSearch<double>::kSilent;

double sinc(double x) {
  return std::abs(x) < 1e-8 ? 1.0 : std::sin(x) / x;
}

/// One value for each path, without allocation for the usual number of paths of a channel.
template <typename Value>
struct PerPath : boost::container::small_vector<Value, 64> {
  using boost::container::small_vector<Value, 64>::small_vector;
  operator std::span<const Value>() const { return {this->data(), this->size()}; }  // NOLINT(*-explicit-*)
};

/// Power of averaged paths.
struct Power {
  double strongest = 0, total = 0;
  explicit Power(std::span<const CodeTracker::Averaged> paths) {
    for (const CodeTracker::Averaged& path : paths) {
      strongest = std::max(strongest, path.power());
      total += path.power();
    }
  }
  [[nodiscard]] bool any() const { return strongest > 0 && std::isfinite(total); }
};

}  // namespace

std::string_view name(Discriminator discriminator) {
  static constexpr std::string_view kNames[]{"coherent", "early-late power", "dot product", "double delta"};
  return kNames[static_cast<std::size_t>(discriminator)];
}

CorrelatorBank correlator_bank(const DllOptions& options) {
  const double d = options.spacing_chips;
  if (options.discriminator == Discriminator::DoubleDelta) return {4, {-d / 2, d / 2, -d, d}, {2, -2, -1, 1}};
  return {2, {-d / 2, d / 2}, {1, -1}};
}

/// The discriminator, and the sum of the powers of its correlators.
struct CodeTracker::Pull {
  double d = 0;
  double power = 0;

  [[nodiscard]] bool silent() const { return std::abs(d) <= kSilent * power; }
};

CodeTracker::CodeTracker(const CorrelationOptions& signal, const DllOptions& loop)
    : correlation_(signal), options_(loop) {
  options_.validate();
  bank_ = correlator_bank(options_);
  // Features of D: the spacing, knots of R, and the front end's impulse response.
  step_chips_ = std::min(options_.spacing_chips / 8, correlation_.knot_spacing_chips() / 8);
  const Averaged direct{0, {1, 0}, 0};
  const Pull early = pull(-step_chips_, {&direct, 1}), late = pull(step_chips_, {&direct, 1});
  if (!(early.d < 0 && late.d > 0)) {
    throw InputError(fmt::format("correlators {} chips apart do not find the peak of {}",
                                 options_.spacing_chips, name(signal.modulation)),
                     "reduce their spacing");
  }
  const double small = step_chips_ / 1024;
  const Pull neighbour = pull(small, {&direct, 1});
  gain_chips_ = small * neighbour.power / neighbour.d;

  // The highest peak of |R| after the first zero of R: BOC(6,1) causes ripples on the main peak.
  constexpr double kGrid = 1.0 / 512;
  double highest = 0.25 * correlation_.value(0);
  bool after = false;
  for (double at = kGrid; at < 1; at += kGrid) {
    const double r = correlation_.value(at);
    after = after || r < 0;
    if (!after || std::abs(r) <= highest) continue;
    highest = std::abs(r);
    side_peak_chips_ = at;
  }
}

CodeTracker::Averaged CodeTracker::average(const SignalPath& path) const {
  if (!std::isfinite(path.delay_m) || !std::isfinite(path.amplitude.real()) ||
      !std::isfinite(path.amplitude.imag()) || !std::isfinite(path.fading_hz)) {
    throw InputError(fmt::format("a signal path has delay {} m, amplitude ({}, {}) and fading {} Hz",
                                 path.delay_m, path.amplitude.real(), path.amplitude.imag(), path.fading_hz),
                     "give finite values");
  }
  const CoherenceWeights kept = coherence_weights(path.fading_hz);
  return {path.delay_m / correlation_.chip_m(), kept.coherent * path.amplitude,
          kept.incoherent * std::norm(path.amplitude)};
}

CodeTracker::CoherenceWeights CodeTracker::coherence_weights(double fading_hz) const {
  const double kept = sinc(geodesy::kPi * fading_hz * options_.integration_s);
  const double ratio = 2 * geodesy::kPi * fading_hz / (4 * options_.loop_bandwidth_hz);
  const double passed = 1 / (1 + ratio * ratio);
  return {std::sqrt(passed) * kept, (1 - passed) * kept * kept};
}

CodeTracker::Pull CodeTracker::pull(double delay_chips, std::span<const Averaged> paths) const {
  std::array<std::complex<double>, 4> sum{};
  std::complex<double> prompt_sum;
  double incoherent = 0;
  double prompt_incoherent = 0;
  Pull result;
  const bool power = options_.discriminator == Discriminator::EarlyLatePower;
  const auto count = static_cast<std::size_t>(bank_.count);
  for (const Averaged& path : paths) {
    const double lag = delay_chips - path.delay_chips;
    std::array<double, 4> r{};
    double x = 0;
    for (std::size_t k = 0; k < count; ++k) {
      r[k] = correlation_.value(lag + bank_.offset_chips[k]);
      sum[k] += path.coherent * r[k];
      x += bank_.weight[k] * r[k];
      result.power += path.incoherent * r[k] * r[k];
    }
    if (power) {
      incoherent += path.incoherent * (r[0] * r[0] - r[1] * r[1]);
      continue;
    }
    const double p = correlation_.value(lag);
    prompt_sum += path.coherent * p;
    incoherent += path.incoherent * x * p;
    prompt_incoherent += path.incoherent * p * p;
  }
  for (std::size_t k = 0; k < count; ++k) result.power += std::norm(sum[k]);
  if (power) {
    result.d = std::norm(sum[0]) - std::norm(sum[1]) + incoherent;
    return result;
  }
  std::complex<double> x;
  for (std::size_t k = 0; k < count; ++k) x += bank_.weight[k] * sum[k];
  result.d = (x * std::conj(prompt_sum)).real() + incoherent;
  if (options_.discriminator != Discriminator::Coherent) return result;
  const double prompt_power = std::norm(prompt_sum) + prompt_incoherent;
  result.d = prompt_power > 0 ? result.d / std::sqrt(prompt_power) : 0;
  result.power = std::sqrt(result.power);
  return result;
}

CodeLock CodeTracker::prompt(double delay_chips, std::span<const Averaged> paths) const {
  CodeLock lock;
  lock.delay_m = delay_chips * correlation_.chip_m();
  for (const Averaged& path : paths) {
    const double r = correlation_.value(delay_chips - path.delay_chips);
    lock.prompt += path.coherent * r;
    lock.prompt_power += path.incoherent * r * r;
  }
  lock.prompt_power += std::norm(lock.prompt);
  return lock;
}

double CodeTracker::discriminator(double delay_m, std::span<const SignalPath> paths) const {
  if (!std::isfinite(delay_m))
    throw InputError(fmt::format("a code delay is {} m", delay_m), "it must be finite");
  PerPath<Averaged> averaged;
  for (const SignalPath& path : paths) averaged.push_back(average(path));
  return pull(delay_m / correlation_.chip_m(), averaged).d;
}

/// Search for the zero that a replica converges to among averaged paths.
struct CodeTracker::Search {
  const CodeTracker& tracker;
  std::span<const Averaged> paths;
  double least_power;                                                 ///< of the prompt correlator
  double low = std::numeric_limits<double>::infinity(), high = -low;  ///< the window [chips]

  Search(const CodeTracker& of, std::span<const Averaged> averaged, double strongest)
      : tracker(of), paths(averaged) {
    const double r0 = of.correlation_.value(0);
    least_power = kMinPrompt * strongest * r0 * r0;
    for (const Averaged& path : paths) {
      if (path.power() <= 0) continue;
      low = std::min(low, path.delay_chips - 1);
      high = std::max(high, path.delay_chips + 1);
    }
  }

  [[nodiscard]] bool inside(double at) const { return at >= low && at <= high; }
  [[nodiscard]] double pull_at(double at) const {
    const Pull pulled = tracker.pull(at, paths);
    return pulled.silent() ? 0 : pulled.d;
  }
  [[nodiscard]] std::optional<CodeLock> accepted(double at) const {
    const CodeLock lock = tracker.prompt(at, paths);
    if (lock.prompt_power < least_power) return std::nullopt;
    return lock;
  }
  [[nodiscard]] std::optional<CodeLock> finish(ZeroSearch<double>& search) const {
    using State = ZeroSearch<double>::State;
    while (search.state == State::Refining || (search.state == State::Scanning && inside(search.at)))
      search.take(pull_at(search.at));
    if (search.state != State::Located) return std::nullopt;
    return accepted(search.at);
  }

  /// The zero that the loop converges to from `start`. A start without pull is a zero if D rises there.
  [[nodiscard]] std::optional<CodeLock> run(double start) const {
    const double maximum = tracker.step_chips_;
    const Pull pulled = tracker.pull(start, paths);
    ZeroSearch<double> search;
    if (!pulled.silent()) {
      search.run(start, pulled.d, tracker.gain_chips_ * pulled.d / pulled.power, maximum);
      return finish(search);
    }
    for (double step = maximum / 1024; step <= maximum; step *= 2) {
      const double d_low = pull_at(start - step), d_high = pull_at(start + step);
      if (!(d_low < 0 && d_high > 0)) continue;
      search.refine(start - step, start + step, d_low, d_high);
      return finish(search);
    }
    return std::nullopt;
  }

  /// The nearest stable zero to either side.
  [[nodiscard]] std::optional<CodeLock> nearest(double start) const {
    using State = ZeroSearch<double>::State;
    const double step = tracker.step_chips_, d_start = pull_at(start);
    ZeroSearch<double> later, earlier;
    later.scan(start, d_start, 1, step, step);
    earlier.scan(start, d_start, -1, step, step);
    for (int i = 0; i < ZeroSearch<double>::kMaxLooks / 2; ++i) {
      for (ZeroSearch<double>* search : {&later, &earlier}) {
        const double at = search->at;
        if (!inside(at)) continue;
        const double d = pull_at(at);
        search->take(d);
        if (search->state != State::Refining) continue;
        if (const std::optional<CodeLock> lock = finish(*search)) return lock;
        search->scan(at, d, search == &later ? 1 : -1, step, step);
      }
    }
    return std::nullopt;
  }

  /// The path's delay at which the prompt correlator is strongest; the earliest of equal ones.
  [[nodiscard]] double peak() const {
    double peak = 0, peak_power = -1;
    for (const Averaged& path : paths) {
      if (path.power() <= 0) continue;
      const double power = tracker.prompt(path.delay_chips, paths).prompt_power;
      if (power > peak_power * (1 + 1e-12) ||
          (power >= peak_power * (1 - 1e-12) && path.delay_chips < peak && peak_power >= 0)) {
        peak_power = power;
        peak = path.delay_chips;
      }
    }
    return peak;
  }
};

std::optional<CodeLock> CodeTracker::lock(std::span<const SignalPath> paths,
                                          std::optional<double> prior_m) const {
  PerPath<Averaged> averaged;
  for (const SignalPath& path : paths) averaged.push_back(average(path));
  return lock_averaged(averaged, prior_m);
}

std::optional<CodeLock> CodeTracker::lock_averaged(std::span<const Averaged> paths,
                                                   std::optional<double> prior_m) const {
  if (prior_m && !std::isfinite(*prior_m))
    throw InputError(fmt::format("the previous code delay is {} m", *prior_m), "it must be finite");
  const Power power(paths);
  if (!power.any()) return std::nullopt;
  const Search search(*this, paths, power.strongest);
  if (prior_m && search.inside(*prior_m / correlation_.chip_m())) {
    if (const auto lock = search.run(*prior_m / correlation_.chip_m())) return lock;
  }
  const double peak = search.peak();
  if (const auto lock = search.run(peak)) return lock;
  return search.nearest(peak);
}

/// A loop during CodeTracker::follow(): paths as seen by the correlators of a step.
struct CodeTracker::Loop {
  const CodeTracker& tracker;
  std::span<const SignalPath> paths;
  double dt_s = 0;
  PerPath<Averaged> now;
  PerPath<std::complex<double>> rotations;  ///< phase rotation per step
  bool changing = false;                    ///< from step to step

  /// At the first of the steps ending `simulated_s` later with `at_end`: averaged over T, longer steps by
  /// powers.
  Loop(const CodeTracker& of, std::span<const SignalPath> all, std::span<const Averaged> at_end,
       double simulated_s, double step_s)
      : tracker(of),
        paths(all),
        dt_s(step_s),
        now(at_end.begin(), at_end.end()),
        rotations(all.size(), boost::container::default_init) {
    const double integration_s = of.options_.integration_s;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const SignalPath& path = paths[i];
      changing = changing || path.drift_mps != 0 || (path.fading_hz != 0 && !path.diffuse);
      Averaged& averaged = now[i];
      rotations[i] = {1, 0};
      averaged.delay_chips -= path.drift_mps * (simulated_s - dt_s / 2) / of.correlation_.chip_m();
      if (path.diffuse) continue;
      const double kept = sinc(geodesy::kPi * path.fading_hz * integration_s);
      const double over_step = dt_s > integration_s ? sinc(geodesy::kPi * path.fading_hz * dt_s) : kept;
      const double angle = -2 * geodesy::kPi * path.fading_hz;
      averaged.coherent = path.amplitude * over_step * std::polar(1.0, angle * (simulated_s - dt_s / 2));
      averaged.incoherent = std::norm(path.amplitude) * std::max(0.0, kept * kept - over_step * over_step);
      rotations[i] = std::polar(1.0, -angle * dt_s);
    }
  }

  void go_on() {
    for (std::size_t i = 0; i < paths.size(); ++i) {
      now[i].coherent *= rotations[i];
      now[i].delay_chips += paths[i].drift_mps * dt_s / tracker.correlation_.chip_m();
    }
  }

  struct Peak {
    double delay_chips = 0, power = 0;
  };
  /// The strongest false peak on one side of the replica (-1: early).
  [[nodiscard]] Peak other_peak(double delay, double side) const {
    Peak best{delay, 0};
    const auto look_angles = [&](double at) {
      const double power = tracker.prompt(at, now).prompt_power;
      if (power > best.power) best = {at, power};
    };
    if (tracker.side_peak_chips_ > 0) look_angles(delay + side * tracker.side_peak_chips_);
    if (side > 0) return best;
    const Averaged* strongest = nullptr;
    for (const Averaged& path : now) {
      const double before = delay - path.delay_chips;
      if (before < tracker.options_.spacing_chips || before > kCheckedChips) continue;
      if (strongest == nullptr || path.power() > strongest->power()) strongest = &path;
    }
    if (strongest != nullptr) look_angles(strongest->delay_chips);
    return best;
  }

  /// Counts the time for which the peak on one side has been stronger. Returns its delay if that time is long
  /// enough for a jump. @param here power at the replica; @param scale from power to that over the noise's in
  /// T
  [[nodiscard]] std::optional<double> compare(double delay, double side, double here, double scale,
                                              double& seconds) const {
    const Peak other = other_peak(delay, side);
    const double there = scale * other.power;
    const double sigma = std::sqrt(2 * (here + there) + 2);
    const double wins = 0.5 * std::erfc((here - there) / (sigma * std::sqrt(2.0)));
    seconds = std::max(0.0, seconds + (2 * wins - 1) * dt_s);
    if (seconds < tracker.options_.peak_check_s) return std::nullopt;
    return other.delay_chips;
  }
};

std::optional<CodeLock> CodeTracker::follow(CodeLoopState& state, std::span<const SignalPath> paths,
                                            double elapsed_s, double unit_cn0_hz,
                                            double bandwidth_ratio) const {
  if (!std::isfinite(state.delay_m) || !(elapsed_s >= 0) || !std::isfinite(elapsed_s) ||
      !std::isfinite(unit_cn0_hz) || !(bandwidth_ratio > 0 && bandwidth_ratio <= 1)) {
    throw InputError(
        fmt::format("a code loop at {} m cannot advance by {} s at {} Hz with {} of its bandwidth",
                    state.delay_m, elapsed_s, unit_cn0_hz, bandwidth_ratio),
        "give finite values, a time of 0 or more, a fraction above 0 and at most 1");
  }
  state.jumped = false;
  const double chip_m = correlation_.chip_m();
  PerPath<Averaged> at_end;
  for (const SignalPath& path : paths) at_end.push_back(average(path));
  const Power power(at_end);
  if (!power.any()) return std::nullopt;

  const double k = 4 * options_.loop_bandwidth_hz * bandwidth_ratio;
  const bool checks = std::isfinite(options_.peak_check_s) && (side_peak_chips_ > 0 || paths.size() > 1);
  const double memory_s = std::max(12 / k, checks ? 2 * options_.peak_check_s : 0);
  const double simulated_s = std::min(elapsed_s, memory_s);
  double longest_s = std::max(options_.integration_s, kStep / k);
  if (checks)
    longest_s = std::min(longest_s, std::max(options_.integration_s, kStep * options_.peak_check_s));
  const int steps = static_cast<int>(std::ceil(simulated_s / longest_s - 1e-9));
  const double dt_s = steps > 0 ? simulated_s / steps : 0;
  const double moves = -std::expm1(-k * dt_s);  // fraction of a constant error that a step removes
  const double scale = unit_cn0_hz * options_.integration_s;

  Loop loop(*this, paths, at_end, simulated_s, dt_s);
  double delay = state.delay_m / chip_m;
  for (int i = 0; i < steps; ++i) {
    const Pull pulled = pull(delay, loop.now);
    bool at_rest = !loop.changing;
    if (pulled.power > kSilent * power.total) {
      const double error = std::clamp(gain_chips_ * pulled.d / pulled.power, -0.5, 0.5);
      delay -= moves * error;
      at_rest = at_rest && std::abs(error) < kAtRest;
    }
    if (checks) {
      const double here = scale * prompt(delay, loop.now).prompt_power;
      std::optional<double> jump = loop.compare(delay, -1, here, scale, state.early_s);
      if (!jump) jump = loop.compare(delay, 1, here, scale, state.late_s);
      if (jump) {
        delay = *jump;
        state.early_s = state.late_s = 0;
        state.jumped = true;
        at_rest = false;
      }
    }
    if (at_rest && state.early_s == 0 && state.late_s == 0) break;
    loop.go_on();
  }
  state.delay_m = delay * chip_m;
  const double r0 = correlation_.value(0);
  const CodeLock lock = prompt(delay, at_end);
  if (lock.prompt_power < kMinPrompt * power.strongest * r0 * r0) return std::nullopt;
  return lock;
}

std::shared_ptr<const CodeTracker> shared_code_tracker(const CorrelationOptions& signal,
                                                       const DllOptions& loop) {
  static std::mutex mutex;
  static std::vector<std::shared_ptr<const CodeTracker>> made;
  constexpr std::size_t kMax = 64;  // limit for receivers whose options never repeat: calibration
  const std::lock_guard lock(mutex);
  for (const auto& each : made)
    if (each->correlation().options() == signal && each->options() == loop) return each;
  if (made.size() >= kMax) made.erase(made.begin());
  return made.emplace_back(std::make_shared<const CodeTracker>(signal, loop));
}

void DllOptions::validate() const {
  options::check(*this, "code loop");
  if (discriminator == Discriminator::DoubleDelta && spacing_chips > 0.5) {
    throw InputError(fmt::format("spacing_chips of the code loop is {}", spacing_chips),
                     "give above 0.001 and at most 0.5 chips (double delta)");
  }
  for (const auto& [name, chips] : spacings_chips) gnss::check_signals({name});
  check_bandwidths(loop_bandwidth_hz, loop_bandwidths_hz, integration_s, "code loop");
}

void check_bandwidths(double bandwidth_hz, const gnss::SignalValues& others_hz, double integration_s,
                      std::string_view loop) {
  for (const auto& [name, other_hz] : others_hz) {
    gnss::check_signals({name});
    bandwidth_hz = std::max(bandwidth_hz, other_hz);
  }
  if (!(bandwidth_hz * integration_s < 0.5)) {
    throw InputError(
        fmt::format("the {} has a bandwidth of {} Hz and integrates {} s", loop, bandwidth_hz, integration_s),
        "give a product below 0.5");
  }
}

void visit(options::Visitor& v, DllOptions& o) {
  static constexpr std::string_view kDiscriminators[]{"coherent", "early_late_power", "dot_product",
                                                      "double_delta"};
  v.choice({"discriminator", "",
            "discriminator of the code loop: coherent, early_late_power, dot_product or double_delta"},
           o.discriminator, kDiscriminators);
  v.number(
      {"spacing_chips", "chips", "distance from early to late correlator (double_delta: of the inner pair)"},
      o.spacing_chips, {0.001, 1, true});
  gnss::visit_signal_values(v, {"spacings_chips", "chips", "of signals with another spacing: [E1=0.1]"},
                            o.spacings_chips, {0.001, 1, true});
  v.number({"loop_bandwidth_hz", "Hz", "one-sided noise bandwidth"}, o.loop_bandwidth_hz, {0, 50, true});
  gnss::visit_signal_values(
      v, {"loop_bandwidths_hz", "Hz", "of signals with another bandwidth: [E1=0.2, L5=0.7]"},
      o.loop_bandwidths_hz, {0, 50, true});
  v.number({"narrow_below_dbhz", "dB-Hz",
            "C/N0 below which the loop narrows with the noise of its discriminator; 0: never"},
           o.narrow_below_dbhz, {0, 100});
  v.number({"integration_s", "s", "coherent integration"}, o.integration_s, {0, 10, true});
  v.number(
      {"peak_check_s", "s",
       "time for which another correlation peak must be stronger before the loop jumps to it; none: never"},
      o.peak_check_s, options::or_none({0.01, 100}));
}

}  // namespace canyon::tracking
