#include "canyon/output/track.hpp"

#include <cmath>
#include <limits>

#include "canyon/geodesy/constants.hpp"
#include "canyon/output/number.hpp"

namespace canyon::output {

const std::array<ErrorClass, kErrorClassCount>& error_classes() {
  static constexpr std::array<ErrorClass, kErrorClassCount> classes{{
      {2, "error_0_2", "below 2 m", "56b4e9"},
      {5, "error_2_5", "2 m to 5 m", "009e73"},
      {10, "error_5_10", "5 m to 10 m", "f0e442"},
      {30, "error_10_30", "10 m to 30 m", "e69f00"},
      {std::numeric_limits<double>::infinity(), "error_30", "30 m and more", "d55e00"},
  }};
  return classes;
}

std::size_t error_class(double horizontal_m) {
  for (std::size_t i = 0; i < kErrorClassCount; ++i) {
    if (horizontal_m < error_classes()[i].below_m) return i;
  }
  return kErrorClassCount - 1;
}

std::string kml_coordinates(const geodesy::Geodetic& point) {
  return fixed(geodesy::degrees(point.longitude_rad), 9) + ',' +
         fixed(geodesy::degrees(point.latitude_rad), 9) + ',' + fixed(point.height_m, 3);
}

std::optional<std::array<geodesy::Geodetic, 2>> antimeridian_crossing(const geodesy::Geodetic& from,
                                                                      const geodesy::Geodetic& to) {
  const double apart = to.longitude_rad - from.longitude_rad;
  if (std::abs(apart) <= geodesy::kPi) return std::nullopt;
  const double edge = std::copysign(geodesy::kPi, from.longitude_rad);
  const double share = (edge - from.longitude_rad) / (apart + 2 * edge);
  geodesy::Geodetic last = from;
  last.longitude_rad = edge;
  last.latitude_rad += share * (to.latitude_rad - from.latitude_rad);
  last.height_m += share * (to.height_m - from.height_m);
  geodesy::Geodetic first = last;
  first.longitude_rad = -edge;
  return std::array{last, first};
}

}  // namespace canyon::output
