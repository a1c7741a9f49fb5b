#include "canyon/tracking/code_tracking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/options/values.hpp"

namespace canyon::tracking {
namespace {

constexpr std::size_t kPathsWithoutAllocation = 64;
constexpr int kMostSamples = 8000;     // of one scan; there are at most three
constexpr double kStep = 0.25;         // of a time constant, between two looks at the discriminator
constexpr double kCheckedChips = 1.5;  // before the replica, for earlier paths
constexpr double kAtRest = 1e-10;      // chips
constexpr double kSilent = 1e-13;      // D below this share of all power is no pull but rounding

double sinc(double x) {
  return std::abs(x) < 1e-8 ? 1.0 : std::sin(x) / x;
}

}  // namespace

std::string_view name(Discriminator discriminator) {
  switch (discriminator) {
    case Discriminator::Coherent:
      return "coherent";
    case Discriminator::EarlyLatePower:
      return "early-late power";
    case Discriminator::DotProduct:
      return "dot product";
    case Discriminator::DoubleDelta:
      return "double delta";
  }
  assert(false);
  return "";
}

CorrelatorBank correlator_bank(const DllOptions& options) {
  const double d = options.spacing_chips;
  if (options.discriminator == Discriminator::DoubleDelta) return {4, {-d / 2, d / 2, -d, d}, {2, -2, -1, 1}};
  return {2, {-d / 2, d / 2}, {1, -1}};
}

/// A path in chips after integration and loop filter.
struct CodeTracker::Averaged {
  double delay = 0;
  std::complex<double> coherent;
  double incoherent = 0;  // power
};

/// All paths of an epoch, in place for as many as a channel usually has.
struct CodeTracker::Gathered {
  std::array<Averaged, kPathsWithoutAllocation> few;
  std::vector<Averaged> many;
  std::span<Averaged> all;
  double strongest = 0, total = 0;  // power
};

/// The discriminator, and the power of its correlators together.
struct CodeTracker::Pull {
  double d = 0;
  double power = 0;
};

/// D is negative at `low`, positive at `high`.
struct CodeTracker::Bracket {
  double low = 0, high = 0;
  double d_low = 0, d_high = 0;
};

/// Samples D from a start in one direction, a step at a time, until it has crossed zero upwards (as seen with
/// rising delay), with at most one sample between that is zero: a stretch without pull is no crossing.
struct CodeTracker::Scan {
  Scan(double start, double d, double direction) : at(start), way(direction) { take(d); }
  /// True when the bracket is found.
  bool take(double d) {
    const int sign = d > 0 ? 1 : d < 0 ? -1 : 0;
    const int wanted = way > 0 ? -1 : 1;
    if (sign == wanted) {
      from = at;
      d_from = d;
      since = 0;
    } else if (sign == -wanted && since >= 0 && since <= 1) {
      bracket = way > 0 ? Bracket{from, at, d_from, d} : Bracket{at, from, d, d_from};
      return true;
    } else if (since >= 0) {
      ++since;
      if (sign != 0) since = -1;
    }
    return false;
  }

  double at;
  double way;
  double from = 0, d_from = 0;
  int since = -1;  // samples since `from`; -1: none
  Bracket bracket;
};

CodeTracker::CodeTracker(const CorrelationOptions& signal, const DllOptions& loop)
    : correlation_(signal), options_(loop) {
  options_.validate();
  bank_ = correlator_bank(options_);
  // Features of D: the spacing, knots of R, and the front end's impulse response.
  step_chips_ = std::min(options_.spacing_chips / 8, correlation_.knot_spacing_chips() / 8);
  const Averaged direct{0, {1, 0}, 0};
  const double early = evaluate(-step_chips_, {&direct, 1});
  const double late = evaluate(step_chips_, {&direct, 1});
  if (!(early < 0 && late > 0)) {
    throw InputError(fmt::format("correlators {} chips apart do not find the peak of {}",
                                 options_.spacing_chips, name(signal.modulation)),
                     "bring them closer");
  }
  const double small = step_chips_ / 1024;
  const Pull beside = pull(small, {&direct, 1});
  gain_chips_ = small * beside.power / beside.d;

  // The highest peak of |R| behind the first zero of R: ripples of BOC(6,1) stand on the main peak.
  constexpr double kGrid = 1.0 / 512;
  double highest = 0.25 * correlation_.value(0);
  bool behind = false;
  for (double at = kGrid; at < 1; at += kGrid) {
    const double r = correlation_.value(at);
    behind = behind || r < 0;
    if (!behind || std::abs(r) <= highest) continue;
    highest = std::abs(r);
    side_peak_chips_ = at;
  }
}

CodeTracker::Averaged CodeTracker::average(const SignalPath& path) const {
  if (!std::isfinite(path.delay_m) || !std::isfinite(path.amplitude.real()) ||
      !std::isfinite(path.amplitude.imag()) || !std::isfinite(path.fading_hz)) {
    throw InputError(fmt::format("a signal path has delay {} m, amplitude ({}, {}) and fading {} Hz",
                                 path.delay_m, path.amplitude.real(), path.amplitude.imag(), path.fading_hz),
                     "all of them must be finite");
  }
  Averaged result;
  result.delay = path.delay_m / correlation_.chip_m();
  const std::complex<double> kept =
      path.amplitude * sinc(geodesy::kPi * path.fading_hz * options_.integration_s);
  const double ratio = 2 * geodesy::kPi * path.fading_hz / (4 * options_.loop_bandwidth_hz);
  const double share = 1 / (1 + ratio * ratio);
  result.coherent = std::sqrt(share) * kept;
  result.incoherent = (1 - share) * std::norm(kept);
  return result;
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
    const double lag = delay_chips - path.delay;
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

void CodeTracker::average(std::span<const SignalPath> paths, Gathered& gathered) const {
  if (paths.size() > gathered.few.size()) gathered.many.resize(paths.size());
  gathered.all =
      (gathered.many.empty() ? std::span<Averaged>(gathered.few) : std::span<Averaged>(gathered.many))
          .first(paths.size());
  for (std::size_t i = 0; i < paths.size(); ++i) {
    gathered.all[i] = average(paths[i]);
    const double power = std::norm(gathered.all[i].coherent) + gathered.all[i].incoherent;
    gathered.strongest = std::max(gathered.strongest, power);
    gathered.total += power;
  }
}

double CodeTracker::evaluate(double delay_chips, std::span<const Averaged> paths) const {
  return pull(delay_chips, paths).d;
}

CodeLock CodeTracker::prompt(double delay_chips, std::span<const Averaged> paths) const {
  CodeLock lock;
  lock.delay_m = delay_chips * correlation_.chip_m();
  for (const Averaged& path : paths) {
    const double r = correlation_.value(delay_chips - path.delay);
    lock.prompt += path.coherent * r;
    lock.prompt_power += path.incoherent * r * r;
  }
  lock.prompt_power += std::norm(lock.prompt);
  return lock;
}

/// Regula falsi with the Illinois correction, and bisection where that is slow: D may have corners.
double CodeTracker::refine(const Bracket& bracket, std::span<const Averaged> paths) const {
  auto [low, high, d_low, d_high] = bracket;
  const double small = 1e-15 * (d_high - d_low);
  int side = 0;
  for (int i = 0; i < 100 && high - low > 1e-10; ++i) {
    double middle = i % 3 == 2 ? (low + high) / 2 : (low * d_high - high * d_low) / (d_high - d_low);
    if (!(middle > low && middle < high)) middle = (low + high) / 2;
    const double d = evaluate(middle, paths);
    if (std::abs(d) <= small) return middle;
    if (d > 0) {
      high = middle;
      d_high = d;
      if (side == 1) d_low /= 2;
      side = 1;
    } else {
      low = middle;
      d_low = d;
      if (side == -1) d_high /= 2;
      side = -1;
    }
  }
  return (low + high) / 2;
}

double CodeTracker::discriminator(double delay_m, std::span<const SignalPath> paths) const {
  if (!std::isfinite(delay_m)) {
    throw InputError(fmt::format("a code delay is {} m", delay_m), "it must be finite");
  }
  std::vector<Averaged> averaged;
  averaged.reserve(paths.size());
  for (const SignalPath& path : paths) averaged.push_back(average(path));
  return evaluate(delay_m / correlation_.chip_m(), averaged);
}

std::optional<CodeLock> CodeTracker::lock(std::span<const SignalPath> paths,
                                          std::optional<double> prior_m) const {
  if (prior_m && !std::isfinite(*prior_m)) {
    throw InputError(fmt::format("the code delay before is {} m", *prior_m), "it must be finite");
  }
  Gathered gathered;
  average(paths, gathered);
  const std::span<const Averaged> all = gathered.all;
  const double strongest = gathered.strongest;
  const double total = gathered.total;
  if (!(strongest > 0) || !std::isfinite(total)) return std::nullopt;

  const double r0 = correlation_.value(0);
  double earliest = std::numeric_limits<double>::infinity();
  double latest = -earliest;
  for (const Averaged& path : all) {
    // Without power a path has no place either.
    if (std::norm(path.coherent) + path.incoherent <= 0) continue;
    earliest = std::min(earliest, path.delay);
    latest = std::max(latest, path.delay);
  }
  const double window_low = earliest - 1;
  const double window_high = latest + 1;
  const double silence =
      kSilent * (options_.discriminator == Discriminator::Coherent ? std::sqrt(total) : total);
  const auto sample = [&](double at) {
    const double d = evaluate(at, all);
    return std::abs(d) < silence ? 0.0 : d;
  };
  const auto accepted = [&](const Bracket& bracket) -> std::optional<CodeLock> {
    const CodeLock lock = prompt(refine(bracket, all), all);
    if (lock.prompt_power < kLeastPrompt * strongest * r0 * r0) return std::nullopt;
    return lock;
  };
  const auto inside = [&](double at) { return at >= window_low && at <= window_high; };

  // Where the loop is driven from `start`. Steps begin small, since a prior mostly lies beside its zero, and
  // zeros may lie close together.
  const auto follow = [&](double start) -> std::optional<CodeLock> {
    double step = step_chips_ / 1024;
    const double d = sample(start);
    if (d == 0) {
      for (; step <= step_chips_; step *= 2) {
        const Bracket around{start - step, start + step, sample(start - step), sample(start + step)};
        if (around.d_low < 0 && around.d_high > 0) return accepted(around);
      }
      return std::nullopt;
    }
    Scan scan(start, d, d < 0 ? 1 : -1);
    for (int i = 0; i < kMostSamples; ++i) {
      scan.at += scan.way * step;
      step = std::min(2 * step, step_chips_);
      if (!inside(scan.at)) break;
      if (scan.take(sample(scan.at))) return accepted(scan.bracket);
      if (scan.since < 0) break;
    }
    return std::nullopt;
  };
  // The nearest stable zero to either side.
  const auto nearest = [&](double start) -> std::optional<CodeLock> {
    const double d = sample(start);
    Scan later(start, d, 1);
    Scan earlier(start, d, -1);
    for (int i = 0; i < kMostSamples / 2; ++i) {
      for (Scan* scan : {&later, &earlier}) {
        scan->at += scan->way * step_chips_;
        if (!inside(scan->at) || !scan->take(sample(scan->at))) continue;
        if (const std::optional<CodeLock> lock = accepted(scan->bracket)) return lock;
      }
    }
    return std::nullopt;
  };

  if (prior_m) {
    const double prior = *prior_m / correlation_.chip_m();
    if (inside(prior)) {
      if (std::optional<CodeLock> lock = follow(prior)) return lock;
    }
  }
  double peak = 0;
  double peak_power = -1;
  for (const Averaged& path : all) {
    if (std::norm(path.coherent) + path.incoherent <= 0) continue;
    const double power = prompt(path.delay, all).prompt_power;
    // Of equals the first: acquisition takes the earlier of two peaks.
    if (power > peak_power * (1 + 1e-12) ||
        (power >= peak_power * (1 - 1e-12) && path.delay < peak && peak_power >= 0)) {
      peak_power = power;
      peak = path.delay;
    }
  }
  if (std::optional<CodeLock> lock = follow(peak)) return lock;
  return nearest(peak);
}

std::optional<CodeLock> CodeTracker::follow(CodeLoopState& state, std::span<const SignalPath> paths,
                                            double elapsed_s, double unit_cn0_hz) const {
  if (!std::isfinite(state.delay_m) || !(elapsed_s >= 0) || !std::isfinite(elapsed_s) ||
      !std::isfinite(unit_cn0_hz)) {
    throw InputError(fmt::format("a code loop at {} m cannot advance by {} s at {} Hz", state.delay_m,
                                 elapsed_s, unit_cn0_hz),
                     "they must be finite, the time 0 or more");
  }
  state.jumped = false;
  const double chip_m = correlation_.chip_m();
  Gathered at_end;
  average(paths, at_end);
  if (!(at_end.strongest > 0) || !std::isfinite(at_end.total)) return std::nullopt;

  const double k = 4 * options_.loop_bandwidth_hz;
  const bool checks = std::isfinite(options_.peak_check_s) && (side_peak_chips_ > 0 || paths.size() > 1);
  const double memory_s = std::max(12 / k, checks ? 2 * options_.peak_check_s : 0);
  const double simulated_s = std::min(elapsed_s, memory_s);
  double longest_s = std::max(options_.integration_s, kStep / k);
  if (checks)
    longest_s = std::min(longest_s, std::max(options_.integration_s, kStep * options_.peak_check_s));
  const int steps = static_cast<int>(std::ceil(simulated_s / longest_s - 1e-9));
  const double dt_s = steps > 0 ? simulated_s / steps : 0;
  const double moves = -std::expm1(-k * dt_s);  // share of a constant error that a step takes away

  // Paths as a step's correlators see them: averaged over T, and over a longer step, by powers.
  Gathered now;
  if (!at_end.many.empty()) now.many.resize(paths.size());
  now.all =
      (now.many.empty() ? std::span<Averaged>(now.few) : std::span<Averaged>(now.many)).first(paths.size());
  std::array<std::complex<double>, kPathsWithoutAllocation> few_turns;
  std::vector<std::complex<double>> many_turns(now.many.size());
  const std::span<std::complex<double>> turns = many_turns.empty()
                                                    ? std::span<std::complex<double>>(few_turns)
                                                    : std::span<std::complex<double>>(many_turns);
  bool changing = false;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const SignalPath& path = paths[i];
    changing = changing || path.drift_mps != 0 || (path.fading_hz != 0 && !path.diffuse);
    Averaged& averaged = now.all[i];
    averaged = at_end.all[i];
    turns[i] = {1, 0};
    averaged.delay -= path.drift_mps * (simulated_s - dt_s / 2) / chip_m;
    if (path.diffuse) continue;
    const double kept = sinc(geodesy::kPi * path.fading_hz * options_.integration_s);
    const double over_step =
        dt_s > options_.integration_s ? sinc(geodesy::kPi * path.fading_hz * dt_s) : kept;
    const double angle = -2 * geodesy::kPi * path.fading_hz;
    averaged.coherent = path.amplitude * over_step * std::polar(1.0, angle * (simulated_s - dt_s / 2));
    averaged.incoherent = std::norm(path.amplitude) * std::max(0.0, kept * kept - over_step * over_step);
    turns[i] = std::polar(1.0, -angle * dt_s);
  }

  const auto power_at = [&](double delay) {
    std::complex<double> sum;
    double incoherent = 0;
    for (const Averaged& path : now.all) {
      const double r = correlation_.value(delay - path.delay);
      sum += path.coherent * r;
      incoherent += path.incoherent * r * r;
    }
    return std::norm(sum) + incoherent;
  };
  const auto mean_power = [](const Averaged& path) { return std::norm(path.coherent) + path.incoherent; };
  double delay = state.delay_m / chip_m;
  for (int i = 0; i < steps; ++i) {
    const Pull pulled = pull(delay, now.all);
    bool at_rest = !changing;
    if (pulled.power > kSilent * at_end.total) {
      const double error = std::clamp(gain_chips_ * pulled.d / pulled.power, -0.5, 0.5);
      delay -= moves * error;
      at_rest = at_rest && std::abs(error) < kAtRest;
    }
    if (checks) {
      // Powers of correlators over T, in units of the noise's.
      const double scale = unit_cn0_hz * options_.integration_s;
      const double here = scale * power_at(delay);
      const auto count = [&](double& seconds, double side) {
        double best = 0, place = delay;
        const auto look = [&](double at) {
          const double there = scale * power_at(at);
          if (there > best) best = there, place = at;
        };
        if (side_peak_chips_ > 0) look(delay + side * side_peak_chips_);
        const Averaged* strongest = nullptr;
        for (const Averaged& path : now.all) {
          const double before = delay - path.delay;
          if (side > 0 || before < options_.spacing_chips || before > kCheckedChips) continue;
          if (strongest == nullptr || mean_power(path) > mean_power(*strongest)) strongest = &path;
        }
        if (strongest != nullptr) look(strongest->delay);
        const double sigma = std::sqrt(2 * (here + best) + 2);
        const double wins = 0.5 * std::erfc((here - best) / (sigma * std::sqrt(2.0)));
        seconds = std::max(0.0, seconds + (2 * wins - 1) * dt_s);
        if (seconds < options_.peak_check_s) return false;
        delay = place;
        return true;
      };
      if (count(state.early_s, -1) || count(state.late_s, 1)) {
        state.early_s = state.late_s = 0;
        state.jumped = true;
        at_rest = false;
      }
    }
    if (at_rest && state.early_s == 0 && state.late_s == 0) break;
    for (std::size_t j = 0; j < now.all.size(); ++j) {
      now.all[j].coherent *= turns[j];
      now.all[j].delay += paths[j].drift_mps * dt_s / chip_m;
    }
  }
  state.delay_m = delay * chip_m;
  const double r0 = correlation_.value(0);
  const CodeLock lock = prompt(delay, at_end.all);
  if (lock.prompt_power < kLeastPrompt * at_end.strongest * r0 * r0) return std::nullopt;
  return lock;
}

std::shared_ptr<const CodeTracker> shared_code_tracker(const CorrelationOptions& signal,
                                                       const DllOptions& loop) {
  static std::mutex mutex;
  static std::vector<std::shared_ptr<const CodeTracker>> made;
  constexpr std::size_t kMost = 64;  // of receivers whose options never repeat: calibration
  const std::lock_guard lock(mutex);
  for (const auto& each : made) {
    if (each->correlation().options() == signal && each->options() == loop) return each;
  }
  if (made.size() >= kMost) made.erase(made.begin());
  return made.emplace_back(std::make_shared<const CodeTracker>(signal, loop));
}

void DllOptions::validate() const {
  options::check(*this, "code loop");
  if (discriminator == Discriminator::DoubleDelta && spacing_chips > 0.5) {
    throw InputError(fmt::format("spacing_chips of the code loop is {}", spacing_chips),
                     "it must be above 0.001 and at most 0.5 chips (double delta)");
  }
  if (!(loop_bandwidth_hz * integration_s < 0.5)) {
    throw InputError(fmt::format("the code loop has a bandwidth of {} Hz and integrates {} s",
                                 loop_bandwidth_hz, integration_s),
                     "their product must be below 0.5");
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
  v.number({"loop_bandwidth_hz", "Hz", "one-sided noise bandwidth"}, o.loop_bandwidth_hz, {0, 50, true});
  v.number({"integration_s", "s", "coherent integration"}, o.integration_s, {0, 10, true});
  v.number(
      {"peak_check_s", "s",
       "time for which another correlation peak must be stronger before the loop jumps to it; none: never"},
      o.peak_check_s, options::or_none({0.01, 100}));
}

}  // namespace canyon::tracking
