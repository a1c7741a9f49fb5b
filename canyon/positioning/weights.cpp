// Weights of pseudoranges; declared in fix.hpp.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::positioning {
namespace {

/// Lower satellites weigh as one at 5 deg, RTKLIB's MIN_EL: 1 / sin would grow beyond any bound.
constexpr double kLowestElevation_rad = geodesy::radians(5);
/// A signal that carries no C/N0.
constexpr double kUnknownCn0_dbhz = 30;

void check(bool good, const char* field, double value, const char* cure) {
  if (!good) throw InputError(fmt::format("{} of the weights is {}", field, value), cure);
}

}  // namespace

std::string_view name(Weighting weighting) {
  switch (weighting) {
    case Weighting::Sigma:
      return "sigma";
    case Weighting::Equal:
      return "equal";
    case Weighting::Elevation:
      return "elevation";
    case Weighting::Cn0:
      break;
  }
  return "cn0";
}

double WeightOptions::sigma_m(const Measurement& measurement, double elevation_rad) const {
  switch (weighting) {
    case Weighting::Sigma:
    case Weighting::Equal:
      return measurement.sigma_m;
    case Weighting::Elevation:
      return std::hypot(elevation_a_m,
                        elevation_b_m / std::sin(std::max(elevation_rad, kLowestElevation_rad)));
    case Weighting::Cn0:
      break;
  }
  return std::sqrt(cn0_floor_m2 +
                   cn0_scale_m2_hz * std::pow(10, -measurement.cn0_dbhz.value_or(kUnknownCn0_dbhz) / 10));
}

void WeightOptions::validate() const {
  const auto length = [](double value) { return value > 0 && value <= 1e6; };
  check(length(elevation_a_m), "elevation_a_m", elevation_a_m, "it must lie above 0 and up to 1e6 m");
  check(length(elevation_b_m), "elevation_b_m", elevation_b_m, "it must lie above 0 and up to 1e6 m");
  check(length(cn0_floor_m2), "cn0_floor_m2", cn0_floor_m2, "it must lie above 0 and up to 1e6 m^2");
  check(cn0_scale_m2_hz >= 0 && cn0_scale_m2_hz <= 1e12, "cn0_scale_m2_hz", cn0_scale_m2_hz,
        "it must lie within 0 and 1e12 m^2 Hz");
}

}  // namespace canyon::positioning
