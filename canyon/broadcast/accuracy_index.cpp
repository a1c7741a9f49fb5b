#include "canyon/broadcast/accuracy_index.hpp"

#include <array>
#include <cmath>

namespace canyon::broadcast {

int accuracy_index(double accuracy_m) {
  // Upper ends of the indices; files hold these or the nominal values.
  constexpr std::array<double, 15> kUpTo{2.4, 3.4, 4.85, 6.85, 9.65, 13.65, 24,  48,
                                         96,  192, 384,  768,  1536, 3072,  6144};
  for (std::size_t i = 0; i < kUpTo.size(); ++i) {
    if (accuracy_m <= kUpTo[i]) return static_cast<int>(i);
  }
  return 15;
}

int sisa_index(double accuracy_m) {
  const auto steps = [&](double from, double step) {
    return static_cast<int>(std::ceil((accuracy_m - from) / step - 1e-6));
  };
  if (!(accuracy_m >= 0) || accuracy_m > 6) return 255;
  if (accuracy_m <= 0.5) return steps(0, 0.01);
  if (accuracy_m <= 1.0) return 50 + steps(0.5, 0.02);
  if (accuracy_m <= 2.0) return 75 + steps(1.0, 0.04);
  return 100 + steps(2.0, 0.16);
}

}  // namespace canyon::broadcast
