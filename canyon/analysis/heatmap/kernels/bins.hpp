#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace canyon::heatmap {

/// Items, each in every bin that it touches.
class Bins {
 public:
  /// @param bins_of bins_of(item, call) calls call(bin) for each bin of an item in [0, items)
  template <class BinsOf>
  void fill(std::size_t bins, std::uint32_t items, const BinsOf& bins_of) {
    first_.assign(bins + 1, 0);
    for (std::uint32_t i = 0; i < items; ++i) bins_of(i, [&](std::size_t bin) { ++first_[bin + 1]; });
    for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
    items_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t i = 0; i < items; ++i) bins_of(i, [&](std::size_t bin) { items_[next[bin]++] = i; });
  }
  /// Appends the items of the bins [first, last].
  void append(std::size_t first, std::size_t last, std::vector<std::uint32_t>& items) const {
    items.insert(items.end(), items_.begin() + first_[first], items_.begin() + first_[last + 1]);
  }

 private:
  std::vector<std::uint32_t> first_;  ///< index into items_ of each bin's first; finally their number
  std::vector<std::uint32_t> items_;
};

/// Ascending, each once.
template <class T>
void sort_unique(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace canyon::heatmap
