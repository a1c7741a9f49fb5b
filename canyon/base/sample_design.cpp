#include "canyon/base/sample_design.hpp"

#include <numeric>
#include <utility>

namespace canyon {

std::vector<double> draw_sample(RandomStream random, std::size_t n, bool latin) {
  std::vector<double> shares(n);
  for (double& share : shares) share = random.uniform();
  if (!latin) return shares;
  std::vector<std::size_t> strata(n);
  std::iota(strata.begin(), strata.end(), std::size_t{0});
  for (std::size_t i = n; i-- > 1;) {
    std::swap(strata[i], strata[static_cast<std::size_t>(random.uniform() * static_cast<double>(i + 1))]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    shares[i] = (static_cast<double>(strata[i]) + shares[i]) / static_cast<double>(n);
  }
  return shares;
}

}  // namespace canyon
