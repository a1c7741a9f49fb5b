#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace canyon::propagation {

/// Orders `items` so that every run of `block` items lies close together: median splits along the widest
/// axis, at multiples of `block`. Ties keep the order of the numbers, so the result depends on nothing else.
/// @param centre Vector3d of an item
template <typename Centre>
void order_compactly(std::uint32_t* begin, std::uint32_t* end, std::size_t block, const Centre& centre) {
  const auto count = static_cast<std::size_t>(end - begin);
  if (count <= block) {
    std::sort(begin, end);
    return;
  }
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = Eigen::Vector3d::Constant(-1e300);
  for (const std::uint32_t* i = begin; i != end; ++i) {
    low = low.cwiseMin(centre(*i));
    high = high.cwiseMax(centre(*i));
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  std::uint32_t* middle = begin + (count / 2 + block - 1) / block * block;
  std::nth_element(begin, middle, end, [&](std::uint32_t a, std::uint32_t b) {
    const double ca = centre(a)[axis], cb = centre(b)[axis];
    return ca != cb ? ca < cb : a < b;
  });
  order_compactly(begin, middle, block, centre);
  order_compactly(middle, end, block, centre);
}

}  // namespace canyon::propagation
