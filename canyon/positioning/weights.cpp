// Declared in canyon/positioning/positioning_options.hpp.
// Weights of pseudoranges.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::positioning {
namespace {

/// Lower satellites weigh as one at 5 deg, RTKLIB's MIN_EL: 1 / sin would grow beyond any bound.
constexpr double kLowestElevation_rad = geodesy::radians(5);

}  // namespace

double WeightOptions::sigma_m(const Measurement& measurement, double elevation_rad) const {
  switch (weighting) {
    case Weighting::Sigma:
    case Weighting::Equal:
      return measurement.sigma_m;
    case Weighting::Elevation:
      return measurement.sigma_factor *
             std::hypot(elevation_a_m,
                        elevation_b_m / std::sin(std::max(elevation_rad, kLowestElevation_rad)));
    case Weighting::Cn0:
      break;
  }
  return measurement.sigma_factor *
         std::sqrt(cn0_floor_m2 +
                   cn0_scale_m2_hz * std::pow(10, -measurement.cn0_dbhz.value_or(kUnknownCn0_dbhz) / 10));
}

}  // namespace canyon::positioning
