#include "canyon/analysis/validation/statistics.hpp"

#include <cassert>
#include <numeric>
#include <utility>

#include "canyon/base/random.hpp"

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

std::optional<RankCorrelation> spearman(std::span<const double> x, std::span<const double> y,
                                        double confidence) {
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
  RankCorrelation result;
  result.n = x.size();
  result.rho = std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0);
  const double rest = 1 - result.rho * result.rho;
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
  const std::vector<double> own = midranks(positives);

  Separation result;
  result.auc = 0;
  const double d1 = static_cast<double>(n1), d0 = static_cast<double>(n0);
  // Fraction of the negatives below each positive.
  for (std::size_t i = 0; i < n1; ++i) result.auc += (ranks[i] - own[i]) / d0;
  result.auc /= d1;

  const std::vector<double> p = sorted_copy(positives), n = sorted_copy(negatives);
  std::sort(all.begin(), all.end());
  std::size_t i = 0, j = 0;  // number of values below the threshold
  for (std::size_t k = 0; k + 1 < all.size(); ++k) {
    if (all[k] == all[k + 1]) continue;
    while (i < n1 && p[i] <= all[k]) ++i;
    while (j < n0 && n[j] <= all[k]) ++j;
    const double accuracy = (static_cast<double>(n1 - i) / d1 + static_cast<double>(j) / d0) / 2;
    if (accuracy > result.balanced_accuracy) {
      result.balanced_accuracy = accuracy;
      result.threshold = all[k] + (all[k + 1] - all[k]) / 2;
      // There is no double between two neighbouring ones.
      if (result.threshold <= all[k]) result.threshold = all[k + 1];
    }
  }
  return result;
}

std::optional<double> kolmogorov_smirnov(std::span<const double> a, std::span<const double> b) {
  if (a.empty() || b.empty()) return std::nullopt;
  const std::vector<double> x = sorted_copy(a), y = sorted_copy(b);
  const double nx = static_cast<double>(x.size()), ny = static_cast<double>(y.size());
  double d = 0;
  std::size_t i = 0, j = 0;
  while (i < x.size() || j < y.size()) {
    const double value = j == y.size() || (i < x.size() && x[i] <= y[j]) ? x[i] : y[j];
    while (i < x.size() && x[i] == value) ++i;
    while (j < y.size() && y[j] == value) ++j;
    d = std::max(d, std::abs(static_cast<double>(i) / nx - static_cast<double>(j) / ny));
  }
  return d;
}

RankedSample::RankedSample(std::vector<Item> items) : items_(std::move(items)) {
  std::sort(items_.begin(), items_.end(), [](const Item& a, const Item& b) { return a.score < b.score; });
}

// Mann-Whitney: pairs in which the NLOS observation scores above the LOS one; ties count half.
std::optional<double> RankedSample::auc(std::span<const std::uint16_t> times) const {
  double los_below = 0, nlos_total = 0, won = 0;
  for (std::size_t i = 0; i < items_.size();) {
    double los = 0, nlos = 0;
    const double score = items_[i].score;
    for (; i < items_.size() && items_[i].score == score; ++i) {
      assert(items_[i].epoch < times.size());
      (items_[i].nlos ? nlos : los) += times[items_[i].epoch];
    }
    won += nlos * (los_below + los / 2);
    los_below += los;
    nlos_total += nlos;
  }
  if (!(los_below > 0) || !(nlos_total > 0)) return {};
  return won / (los_below * nlos_total);
}

std::vector<std::vector<std::uint16_t>> block_bootstrap(std::size_t epochs, std::size_t block, int resamples,
                                                        std::uint64_t seed) {
  assert(block >= 1);
  block = std::min(block, std::max<std::size_t>(epochs, 1));
  RandomStream random(seed, "bootstrap");
  std::vector<std::vector<std::uint16_t>> sample_count(static_cast<std::size_t>(resamples),
                                                       std::vector<std::uint16_t>(epochs, 0));
  if (epochs == 0) return sample_count;
  for (std::vector<std::uint16_t>& times : sample_count) {
    for (std::size_t sampled = 0; sampled < epochs;) {
      const auto first = static_cast<std::size_t>(random.uniform() * static_cast<double>(epochs));
      for (std::size_t k = 0; k < block && sampled < epochs; ++k, ++sampled) ++times[(first + k) % epochs];
    }
  }
  return sample_count;
}

}  // namespace canyon::validation
