#pragma once

#include <cstddef>
#include <vector>

#include "canyon/base/random.hpp"

namespace canyon {

/// Shares [0, 1) of one axis for `n` points. Drawn alone, or as a Latin hypercube (McKay, Beckman, Conover,
/// Technometrics 21, 1979): each of the n strata [k/n, (k+1)/n) has one point, and axes with independent
/// streams have their strata in independent orders.
[[nodiscard]] std::vector<double> draw_sample(RandomStream random, std::size_t n, bool latin);

}  // namespace canyon
