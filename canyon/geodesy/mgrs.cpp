#include "canyon/geodesy/mgrs.hpp"

#include <fmt/format.h>

#include <GeographicLib/MGRS.hpp>

#include "canyon/base/input_error.hpp"

namespace canyon::geodesy {

Utm utm_of_mgrs_square(const std::string& square) {
  const auto fault = [&square](std::string_view reason) {
    return InputError(fmt::format("'{}' is not a square of MGRS: {}", square, reason),
                      "write zone, band and the two letters of the square of 100 km, such as 54SUE");
  };
  Utm corner;
  int precision = 0;
  try {
    GeographicLib::MGRS::Reverse(square, corner.zone, corner.north, corner.easting_m, corner.northing_m,
                                 precision, false);
  } catch (const GeographicLib::GeographicErr& e) {
    throw fault(e.what());
  }
  if (precision != 0) throw fault("it has not just zone, band and two letters");
  if (corner.zone < 1) throw fault("the poles have no zone of UTM");
  return corner;
}

}  // namespace canyon::geodesy
