#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace canyon::study {

/// Shares [0, 1) of one axis for `n` points, the same for the same seed and name. Drawn alone, or as a Latin
/// hypercube (McKay, Beckman, Conover, Technometrics 21, 1979): each of the n strata [k/n, (k+1)/n) has one
/// point, the strata of different axes in orders that know nothing of each other.
[[nodiscard]] std::vector<double> draw_sample(std::uint64_t seed, const std::string& axis, std::size_t n,
                                              bool latin);

}  // namespace canyon::study
