#include "canyon/signal/foliage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::signal {
namespace {

struct WoodlandRow {
  double mhz, specific_db_per_m, maximum_db;
};
constexpr std::array<WoodlandRow, 5> kWoodland{{{105.9, 0.04, 9.4},
                                                {466.475, 0.12, 18.0},
                                                {949.0, 0.17, 26.5},
                                                {1852.2, 0.30, 29.0},
                                                {2117.5, 0.34, 34.1}}};

double woodland_db(double depth_m, double mhz) {
  std::size_t i = 0;
  while (i + 2 < kWoodland.size() && mhz > kWoodland[i + 1].mhz) ++i;
  const WoodlandRow &low = kWoodland[i], &high = kWoodland[i + 1];
  const double t = std::log(mhz / low.mhz) / std::log(high.mhz / low.mhz);
  const double gamma = low.specific_db_per_m * std::pow(high.specific_db_per_m / low.specific_db_per_m, t);
  const double maximum = low.maximum_db * std::pow(high.maximum_db / low.maximum_db, t);
  return -maximum * std::expm1(-depth_m * gamma / maximum);
}

}  // namespace

double foliage_loss_db(FoliageModel model, double depth_m, double frequency_hz, double elevation_rad) {
  if (!(depth_m >= 0) || !std::isfinite(depth_m))
    throw InputError(fmt::format("foliage of {} m", depth_m), "give a depth of 0 m or more");
  const double mhz = frequency_hz * 1e-6;
  if (!(frequency_hz >= 105.9e6 && frequency_hz <= 2117.5e6))
    throw InputError(fmt::format("frequency of {} Hz is outside the foliage tables", frequency_hz),
                     "give a carrier of 105.9e6 to 2117.5e6 Hz");
  if (!(std::abs(elevation_rad) <= geodesy::kPi / 2))
    throw InputError(fmt::format("elevation of {} rad", elevation_rad), "give -pi/2 to pi/2");
  if (depth_m == 0) return 0;
  if (model == FoliageModel::Woodland) return woodland_db(depth_m, mhz);
  const double theta = std::max(1.0, geodesy::degrees(elevation_rad));
  return 0.25 * std::pow(mhz, 0.39) * std::pow(depth_m, 0.25) * std::pow(theta, 0.05);
}

}  // namespace canyon::signal
