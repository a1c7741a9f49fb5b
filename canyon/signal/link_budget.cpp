#include "canyon/signal/link_budget.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/options/values.hpp"

namespace canyon::signal {
namespace {

/// [J/K], exact by SI.
constexpr double kBoltzmann = 1.380649e-23;

}  // namespace

double elevation_rise_db(double elevation_rad) {
  if (std::isnan(elevation_rad)) throw InputError("elevation of NaN rad", "give a direction");
  constexpr double kTopDeg = 40, kTopDb = 2;
  const double elevation = std::clamp(geodesy::degrees(elevation_rad), 0.0, 90.0);
  const double x = elevation < kTopDeg ? (elevation - kTopDeg) / 35 : (elevation - kTopDeg) / 50;
  return kTopDb * (1 - x * x);
}

double noise_density_dbw_per_hz(const LinkBudgetOptions& options) {
  options.validate();
  constexpr double kReferenceK = 290;  // IEEE definition of the noise figure
  const double noise_factor = std::pow(10.0, options.noise_figure_db / 10);
  return 10 * std::log10(kBoltzmann * (options.antenna_temperature_k + kReferenceK * (noise_factor - 1)));
}

double los_cn0_dbhz(const gnss::Signal& signal, double elevation_rad, const AntennaPattern& antenna,
                    const LinkBudgetOptions& options) {
  const double power = signal.minimum_dbw + options.above_minimum_db + elevation_rise_db(elevation_rad);
  return power + antenna.gain(elevation_rad, signal.carrier_hz).rhcp_dbic -
         noise_density_dbw_per_hz(options) - options.implementation_loss_db;
}

void LinkBudgetOptions::validate() const {
  options::check(*this, "link budget");
}

void visit(options::Visitor& v, LinkBudgetOptions& o) {
  v.number({"above_minimum_db", "dB", "power of satellites above the minimum of their interface documents"},
           o.above_minimum_db, {-10, 20});
  v.number({"antenna_temperature_k", "K", "noise temperature of sky, ground and losses before the amplifier"},
           o.antenna_temperature_k, {2, 1000});
  v.number({"noise_figure_db", "dB", "noise figure of the receiver with its amplifier"}, o.noise_figure_db,
           {0, 20});
  v.number({"implementation_loss_db", "dB", "loss by filter, quantization and correlation"},
           o.implementation_loss_db, {0, 20});
}

}  // namespace canyon::signal
