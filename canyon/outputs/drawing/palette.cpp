#include "canyon/outputs/drawing/palette.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace canyon::drawing {

std::uint32_t packed(const Colour& c) {
  const auto byte = [](double x) {
    return static_cast<std::uint32_t>(std::lround(255 * std::clamp(x, 0.0, 1.0)));
  };
  return byte(c.r) << 16 | byte(c.g) << 8 | byte(c.b);
}

Colour mix(const Colour& from, const Colour& to, double t) {
  const double s = std::isnan(t) ? 0 : std::clamp(t, 0.0, 1.0);
  return {from.r + s * (to.r - from.r), from.g + s * (to.g - from.g), from.b + s * (to.b - from.b),
          from.a + s * (to.a - from.a)};
}

Colour between(std::span<const Colour> stops, double t) {
  const double at = (std::isnan(t) ? 0 : std::clamp(t, 0.0, 1.0)) * static_cast<double>(stops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), stops.size() - 2);
  return mix(stops[i], stops[i + 1], at - static_cast<double>(i));
}

Colour viridis(double t) {
  static constexpr std::array kStops{rgb(0x440154), rgb(0x472D7B), rgb(0x3B528B),
                                     rgb(0x2C728E), rgb(0x21918C), rgb(0x28AE80),
                                     rgb(0x5EC962), rgb(0xADDC30), rgb(0xFDE725)};
  return between(kStops, t);
}

Colour colour_of(propagation::Visibility visibility) {
  static constexpr std::array kColours{kGreen, kBlue, kOrange, rgb(0x7A7A7A)};
  return kColours[static_cast<std::size_t>(visibility)];
}

}  // namespace canyon::drawing
