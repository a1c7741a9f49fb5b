#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

namespace canyon {

/// Marks the values outside a longest strictly rising subsequence (M. L. Fredman, "On computing the length of
/// longest increasing subsequences", 1975; n log n): the fewest to leave out so that the rest rises. The
/// first of equal values stays.
template <typename T>
std::vector<bool> outside_longest_rise(const std::vector<T>& values) {
  std::vector<std::size_t> last_of_length;
  std::vector<std::size_t> before(values.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto at = std::lower_bound(last_of_length.begin(), last_of_length.end(), values[i],
                                     [&](std::size_t k, const T& value) { return values[k] < value; });
    if (at != last_of_length.end() && values[*at] == values[i]) continue;
    if (at != last_of_length.begin()) before[i] = *std::prev(at);
    if (at == last_of_length.end()) {
      last_of_length.push_back(i);
    } else {
      *at = i;
    }
  }
  std::vector<bool> outside(values.size(), true);
  for (std::size_t i = values.empty() ? 0 : last_of_length.back(); i < values.size(); i = before[i])
    outside[i] = false;
  return outside;
}

}  // namespace canyon
