#include "canyon/validation/ranked_sample.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "canyon/base/random.hpp"

namespace canyon::validation {

RankedSample::RankedSample(std::vector<Item> items) : items_(std::move(items)) {
  std::sort(items_.begin(), items_.end(), [](const Item& a, const Item& b) { return a.score < b.score; });
}

// Mann-Whitney: pairs in which the NLOS observation scores above the LOS one, equals half.
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

std::vector<std::vector<std::uint16_t>> block_draws(std::size_t epochs, std::size_t block, int resamples,
                                                    std::uint64_t seed) {
  assert(block >= 1);
  block = std::min(block, std::max<std::size_t>(epochs, 1));
  RandomStream random(seed, "bootstrap");
  std::vector<std::vector<std::uint16_t>> draws(static_cast<std::size_t>(resamples),
                                                std::vector<std::uint16_t>(epochs, 0));
  if (epochs == 0) return draws;
  for (std::vector<std::uint16_t>& times : draws) {
    for (std::size_t drawn = 0; drawn < epochs;) {
      const auto first = static_cast<std::size_t>(random.uniform() * static_cast<double>(epochs));
      for (std::size_t k = 0; k < block && drawn < epochs; ++k, ++drawn) ++times[(first + k) % epochs];
    }
  }
  return draws;
}

}  // namespace canyon::validation
