#include "canyon/validation/statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cassert>
#include <cmath>
#include <numeric>

#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::validation {
namespace {

[[maybe_unused]] bool all_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

std::vector<double> sorted_copy(std::span<const double> values) {
  assert(all_finite(values));
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

double variance(std::span<const double> values) {
  if (values.size() < 2) return 0;
  const double n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double sum = 0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return sum / (n - 1);
}

/// Probability that a path of n + m steps on the lattice, all orders equally likely, strays d or farther from
/// the diagonal. No ties. u[j] is the share of paths to (i, j) that have stayed within.
double exact_tail(std::size_t n, std::size_t m, double d) {
  const double dn = static_cast<double>(n), dm = static_cast<double>(m);
  // Distances are multiples of 1 / (n m): half of one apart is a rounding.
  const double limit = d - 0.5 / (dn * dm);
  const auto within = [&](std::size_t i, std::size_t j) {
    return std::abs(static_cast<double>(i) / dn - static_cast<double>(j) / dm) < limit;
  };
  std::vector<double> u(m + 1);
  u[0] = 1;
  for (std::size_t j = 1; j <= m; ++j) u[j] = within(0, j) ? u[j - 1] : 0;
  for (std::size_t i = 1; i <= n; ++i) {
    // A random order passes (i, j) from (i - 1, j) with probability i / (i + j).
    u[0] = within(i, 0) ? u[0] : 0;
    for (std::size_t j = 1; j <= m; ++j) {
      const double di = static_cast<double>(i), dj = static_cast<double>(j);
      u[j] = within(i, j) ? (di * u[j] + dj * u[j - 1]) / (di + dj) : 0;
    }
  }
  return std::clamp(1 - u[m], 0.0, 1.0);
}

}  // namespace

std::vector<double> midranks(std::span<const double> values) {
  assert(all_finite(values));
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double rank = (static_cast<double>(begin + 1) + static_cast<double>(end)) / 2;
    for (; begin < end; ++begin) ranks[order[begin]] = rank;
  }
  return ranks;
}

std::optional<Correlation> spearman(std::span<const double> x, std::span<const double> y, double confidence) {
  assert(x.size() == y.size());
  assert(confidence > 0 && confidence < 1);
  if (x.size() < 3) return std::nullopt;
  const std::vector<double> a = midranks(x), b = midranks(y);
  const double n = static_cast<double>(x.size());
  const double mean = (n + 1) / 2;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean) * (b[i] - mean);
    aa += (a[i] - mean) * (a[i] - mean);
    bb += (b[i] - mean) * (b[i] - mean);
  }
  if (aa == 0 || bb == 0) return std::nullopt;
  Correlation result;
  result.n = x.size();
  result.rho = std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0);
  const double rest = 1 - result.rho * result.rho;
  result.p_value = rest > 0 ? student_two_sided(result.rho * std::sqrt((n - 2) / rest), n - 2) : 0;
  if (x.size() < 4) return result;
  if (rest <= 0) {
    result.low = result.high = result.rho;
    return result;
  }
  const double z = std::atanh(result.rho);
  const double reach =
      normal_quantile((1 + confidence) / 2) * std::sqrt((1 + result.rho * result.rho / 2) / (n - 3));
  result.low = std::tanh(z - reach);
  result.high = std::tanh(z + reach);
  return result;
}

std::optional<Separation> separation(std::span<const double> positives, std::span<const double> negatives) {
  if (positives.empty() || negatives.empty()) return std::nullopt;
  const std::size_t n1 = positives.size(), n0 = negatives.size();
  std::vector<double> all(positives.begin(), positives.end());
  all.insert(all.end(), negatives.begin(), negatives.end());
  const std::vector<double> ranks = midranks(all);
  const std::vector<double> own1 = midranks(positives), own0 = midranks(negatives);

  Separation result;
  result.positives = n1;
  result.negatives = n0;
  const double d1 = static_cast<double>(n1), d0 = static_cast<double>(n0);
  // Share of the other side that each value beats (Sun and Xu, IEEE Signal Processing Letters 21, 2014).
  std::vector<double> beats1(n1), beats0(n0);
  for (std::size_t i = 0; i < n1; ++i) beats1[i] = (ranks[i] - own1[i]) / d0;
  for (std::size_t i = 0; i < n0; ++i) beats0[i] = 1 - (ranks[n1 + i] - own0[i]) / d1;
  result.auc = std::accumulate(beats1.begin(), beats1.end(), 0.0) / d1;
  result.standard_error = std::sqrt(variance(beats1) / d1 + variance(beats0) / d0);

  const std::vector<double> p = sorted_copy(positives), n = sorted_copy(negatives);
  std::sort(all.begin(), all.end());
  std::size_t i = 0, j = 0;  // values below the threshold
  for (std::size_t k = 0; k + 1 < all.size(); ++k) {
    if (all[k] == all[k + 1]) continue;
    while (i < n1 && p[i] <= all[k]) ++i;
    while (j < n0 && n[j] <= all[k]) ++j;
    const double accuracy = (static_cast<double>(n1 - i) / d1 + static_cast<double>(j) / d0) / 2;
    if (accuracy > result.balanced_accuracy) {
      result.balanced_accuracy = accuracy;
      result.threshold = all[k] + (all[k + 1] - all[k]) / 2;
      // Between neighbouring doubles there is no middle.
      if (result.threshold <= all[k]) result.threshold = all[k + 1];
    }
  }
  return result;
}

std::optional<KolmogorovSmirnov> kolmogorov_smirnov(std::span<const double> a, std::span<const double> b) {
  if (a.empty() || b.empty()) return std::nullopt;
  const std::vector<double> x = sorted_copy(a), y = sorted_copy(b);
  const double nx = static_cast<double>(x.size()), ny = static_cast<double>(y.size());
  KolmogorovSmirnov result;
  bool ties = false;
  std::size_t i = 0, j = 0;
  while (i < x.size() || j < y.size()) {
    const double value = j == y.size() || (i < x.size() && x[i] <= y[j]) ? x[i] : y[j];
    const std::size_t before = i + j;
    while (i < x.size() && x[i] == value) ++i;
    while (j < y.size() && y[j] == value) ++j;
    ties = ties || i + j > before + 1;
    result.d = std::max(result.d, std::abs(static_cast<double>(i) / nx - static_cast<double>(j) / ny));
  }
  if (!ties && nx * ny <= 1e6) {
    result.exact = true;
    result.p_value = exact_tail(x.size(), y.size(), result.d);
  } else {
    const double root = std::sqrt(nx * ny / (nx + ny));
    result.p_value = kolmogorov_tail((root + 0.12 + 0.11 / root) * result.d);
  }
  return result;
}

void BootstrapOptions::validate() const {
  if (resamples < 100 || resamples > 1'000'000) {
    throw InputError(fmt::format("resamples: {} is out of range", resamples), "it runs from 100 to 1000000");
  }
  if (!(confidence > 0 && confidence < 1)) {
    throw InputError(fmt::format("confidence: {} is out of range", confidence), "it lies between 0 and 1");
  }
  if (block < 1) throw InputError("block: 0 is out of range", "it is at least 1");
}

std::optional<Interval> bootstrap_interval(
    std::size_t n, const std::function<std::optional<double>(std::span<const std::size_t>)>& statistic,
    const BootstrapOptions& options) {
  options.validate();
  if (n == 0) return std::nullopt;
  const std::size_t block = std::min(options.block, n);
  RandomStream random(options.seed, "bootstrap");
  std::vector<std::size_t> drawn(n);
  std::vector<double> values;
  for (int r = 0; r < options.resamples; ++r) {
    for (std::size_t i = 0; i < n;) {
      auto at = static_cast<std::size_t>(random.uniform() * static_cast<double>(n));
      for (std::size_t k = 0; k < block && i < n; ++k, ++i) {
        drawn[i] = at;
        at = at + 1 < n ? at + 1 : 0;
      }
    }
    if (const auto value = statistic(drawn)) values.push_back(*value);
  }
  if (2 * values.size() <= static_cast<std::size_t>(options.resamples)) return std::nullopt;
  const double tail = (1 - options.confidence) / 2;
  const std::vector<double> ends = quantiles(values, std::array{tail, 1 - tail});
  return Interval{ends[0], ends[1]};
}

Histogram histogram(std::span<const double> values, double low, double high, std::size_t bins) {
  assert(all_finite(values));
  if (bins < 1) throw InputError("histogram: bins: 0 is out of range", "it is at least 1");
  if (!(low < high) || !std::isfinite(low) || !std::isfinite(high)) {
    throw InputError(fmt::format("histogram: [{}, {}) holds no bin", low, high), "low lies below high");
  }
  Histogram result;
  result.low = low;
  result.width = (high - low) / static_cast<double>(bins);
  result.counts.assign(bins, 0);
  for (const double v : values) {
    if (v < low) {
      ++result.below;
    } else if (v >= high) {
      ++result.above;
    } else {
      // The quotient of a value just below `high` may round up to the number of bins.
      const auto bin = static_cast<std::size_t>((v - low) / result.width);
      ++result.counts[std::min(bin, bins - 1)];
    }
  }
  return result;
}

double kolmogorov_tail(double lambda) {
  if (!(lambda > 0)) return 1;
  if (lambda < 1) {
    // The other series (Kolmogorov 1933): few terms where this one needs many.
    const double x = geodesy::kPi * geodesy::kPi / (8 * lambda * lambda);
    double sum = 0;
    for (int k = 1; k <= 9; k += 2) sum += std::exp(-k * k * x);
    return std::clamp(1 - std::sqrt(2 * geodesy::kPi) / lambda * sum, 0.0, 1.0);
  }
  double sum = 0;
  for (int k = 1; k <= 6; ++k) sum += (k % 2 == 1 ? 2 : -2) * std::exp(-2.0 * k * k * lambda * lambda);
  return std::clamp(sum, 0.0, 1.0);
}

double student_two_sided(double t, double degrees) {
  return 2 * cdf(complement(boost::math::students_t(degrees), std::abs(t)));
}

double normal_quantile(double p) {
  return quantile(boost::math::normal(), p);
}

}  // namespace canyon::validation
