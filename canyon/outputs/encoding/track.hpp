#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::encoding {

/// Classes of horizontal error for the colours of fixes on maps: Okabe and Ito's palette, distinct for
/// colour-blind readers too.
struct ErrorClass {
  double below_m;          ///< errors below this and not in the previous class
  std::string_view id;     ///< "error_0_2"
  std::string_view label;  ///< "below 2 m"
  std::string_view rgb;    ///< "56b4e9"
};
inline constexpr std::size_t kErrorClassCount = 5;
inline constexpr std::string_view kTruthRgb = "0072b2", kOutageRgb = "000000";
[[nodiscard]] const std::array<ErrorClass, kErrorClassCount>& error_classes();
/// Index of the class of an error [m]; the last one for NaN.
[[nodiscard]] std::size_t error_class(double horizontal_m);

/// The crossing of the antimeridian by the shorter path between two positions of a track, as the last
/// position on the side of `from` and the first on the side of `to`: longitudes of 180 and -180 deg, latitude
/// and height interpolated. Empty if it does not cross. Lines on maps are cut there (RFC 7946, 3.1.9).
[[nodiscard]] std::optional<std::array<geodesy::Geodetic, 2>> antimeridian_crossing(
    const geodesy::Geodetic& from, const geodesy::Geodetic& to);

}  // namespace canyon::encoding
