#include "canyon/tracking/code_tracking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/options/values.hpp"

namespace canyon::tracking {
namespace {

constexpr std::size_t kPathsWithoutAllocation = 64;
constexpr int kMostSamples = 8000;     // of one scan; there are at most three
constexpr double kLeastPrompt = 1e-3;  // of the strongest path's power
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

double CodeTracker::evaluate(double delay_chips, std::span<const Averaged> paths) const {
  std::array<std::complex<double>, 4> sum{};
  std::complex<double> prompt_sum;
  double incoherent = 0;
  double prompt_incoherent = 0;
  const bool power = options_.discriminator == Discriminator::EarlyLatePower;
  for (const Averaged& path : paths) {
    const double lag = delay_chips - path.delay;
    std::array<double, 4> r{};
    double x = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(bank_.count); ++k) {
      r[k] = correlation_.value(lag + bank_.offset_chips[k]);
      sum[k] += path.coherent * r[k];
      x += bank_.weight[k] * r[k];
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
  if (power) return std::norm(sum[0]) - std::norm(sum[1]) + incoherent;
  std::complex<double> x;
  for (std::size_t k = 0; k < static_cast<std::size_t>(bank_.count); ++k) x += bank_.weight[k] * sum[k];
  const double d = (x * std::conj(prompt_sum)).real() + incoherent;
  if (options_.discriminator != Discriminator::Coherent) return d;
  const double prompt_power = std::norm(prompt_sum) + prompt_incoherent;
  return prompt_power > 0 ? d / std::sqrt(prompt_power) : 0;
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
  std::array<Averaged, kPathsWithoutAllocation> few;
  std::vector<Averaged> many;
  if (paths.size() > few.size()) many.resize(paths.size());
  const std::span<Averaged> all =
      (many.empty() ? std::span<Averaged>(few) : std::span<Averaged>(many)).first(paths.size());
  double strongest = 0;
  double total = 0;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    all[i] = average(paths[i]);
    const double power = std::norm(all[i].coherent) + all[i].incoherent;
    strongest = std::max(strongest, power);
    total += power;
  }
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
  v.choice({"discriminator", "", "of the code loop: coherent, early_late_power, dot_product or double_delta"},
           o.discriminator, kDiscriminators);
  v.number({"spacing_chips", "chips", "from early to late correlator (double_delta: of the inner pair)"},
           o.spacing_chips, {0.001, 1, true});
  v.number({"loop_bandwidth_hz", "Hz", "one-sided noise bandwidth"}, o.loop_bandwidth_hz, {0, 50, true});
  v.number({"integration_s", "s", "coherent integration"}, o.integration_s, {0, 10, true});
}

}  // namespace canyon::tracking
