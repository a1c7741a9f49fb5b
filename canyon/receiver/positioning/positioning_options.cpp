// Weights of pseudoranges.
#include "canyon/receiver/positioning/positioning_options.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/receiver/positioning/fix.hpp"

namespace canyon::positioning {

namespace {

constexpr std::string_view kWeightings[]{"sigma", "equal", "elevation", "cn0"};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

std::string_view name(Weighting weighting) {
  return kWeightings[static_cast<std::size_t>(weighting)];
}

void WeightOptions::validate() const {
  options::check(*this, "weights");
}

void visit(options::Visitor& v, WeightOptions& o) {
  v.choice({"weighting", "",
            "weights of pseudoranges: sigma (by the simulated standard deviation), equal, elevation or cn0"},
           o.weighting, kWeightings);
  v.number({"elevation_a_m", "m", "elevation: sigma^2 = a^2 + b^2 / sin(elevation)^2"}, o.elevation_a_m,
           {0, 1e6, true});
  v.number({"elevation_b_m", "m", "b of that formula"}, o.elevation_b_m, {0, 1e6, true});
}

void RaimOptions::validate() const {
  options::check(*this, "RAIM");
}

void visit(options::Visitor& v, RaimOptions& o) {
  v.boolean({"enabled", "",
             "exclude satellites whose residuals contradict the others (receiver autonomous integrity "
             "monitoring)"},
            o.enabled);
  v.number({"false_alarm", "", "probability of a false alarm of one fix"}, o.false_alarm, {0, 0.5, true});
  v.integer({"max_exclusions", "satellites", "largest number of satellites excluded from one fix"},
            o.max_exclusions, 1, 30);
}

void FixOptions::validate() const {
  weights.validate();
  raim.validate();
  options::check(*this);
}

void visit(options::Visitor& v, FixOptions& o) {
  v.angle({"elevation_mask_deg", "deg", "satellites below this elevation are neither measured nor used"},
          o.elevation_mask_rad, {0, 90, false, true});
  v.number({"cn0_mask_dbhz", "dB-Hz", "satellites below this C/N0 are not used in the fix"}, o.cn0_mask_dbhz,
           {0, 60});
  v.integer({"min_satellites", "satellites",
             "satellites required for a fix, plus one for each constellation beyond the first"},
            o.min_satellites, 4, 1000);
  v.number({"max_pdop", "", "largest PDOP of a valid fix"}, o.max_pdop,
           options::or_none({0, kInfinity, true}));
  v.integer({"max_iterations", "", "largest number of iterations of the least squares"}, o.max_iterations, 5,
            1000);
  // Coordinates of 6,400 km have no finer digits: a shorter step is rounding noise.
  v.number({"convergence_m", "m", "step size that ends the iterations"}, o.convergence_m, {1e-9, 1});
  options::visit_switch(
      v,
      {"correct_ionosphere", "", "apply the model's correction in the fix; if omitted: true with sky.errors"},
      o.correct_ionosphere);
  options::visit_switch(v,
                        {"correct_troposphere", "",
                         "apply the model's correction in the fix; if omitted: true with sky.errors"},
                        o.correct_troposphere);
  v.boolean({"covariance_by_residuals", "",
             "increase the reported covariance if residuals are larger than the weights predict"},
            o.covariance_by_residuals);
  v.part("weights", o.weights);
  v.part("raim", o.raim);
}

void PositionFilterOptions::validate() const {
  options::check(*this, "position filter");
}

void visit(options::Visitor& v, PositionFilterOptions& o) {
  v.boolean(
      {"enabled", "", "extended Kalman filter for the position; false: each epoch is solved independently"},
      o.enabled);
  v.number({"acceleration_horizontal", "m/s^2/sqrt(Hz)",
            "spectral density of the white acceleration that the filter assumes, horizontal"},
           o.acceleration_horizontal, {0, 100, true});
  v.number({"acceleration_vertical", "m/s^2/sqrt(Hz)", "the same, vertical"}, o.acceleration_vertical,
           {0, 100, true});
  v.number({"clock_frequency_density", "s^2/s", "white frequency noise of the clock that the filter assumes"},
           o.clock_frequency_density, {0, 1e-6, true});
  v.number({"clock_drift_density", "1/s^2 s", "random walk of that frequency"}, o.clock_drift_density,
           {0, 1e-6, true});
  v.number({"coast_s", "s", "the filter restarts after this time without a measurement"}, o.coast_s,
           {0, 3600, true});
  v.number({"max_sigma_m", "m", "largest standard deviation of a valid position"}, o.max_sigma_m,
           options::or_none({0, kInfinity, true}));
  v.number({"error_correlation_s", "s",
            "time constant of errors assumed in the reported accuracy; 0: white errors"},
           o.error_correlation_s, {0, 3600});
}

namespace {

/// Satellites below 5 deg get the weight of 5 deg, RTKLIB's MIN_EL: 1 / sin would be unbounded.
constexpr double kLowestElevation_rad = geodesy::radians(5);
/// sigma^2 = c + d 10^(-C/N0 / 10), as validation::ClockOptions (Kuusniemi, User-level reliability and
/// quality monitoring in satellite-based personal navigation, Tampere University of Technology 2005, where
/// signals are lightly degraded).
constexpr double kFloor_m2 = 10, kScale_m2_hz = 22'500;

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
         std::sqrt(kFloor_m2 +
                   kScale_m2_hz * std::pow(10, -measurement.cn0_dbhz.value_or(kUnknownCn0_dbhz) / 10));
}

double WeightOptions::doppler_sigma_mps(const Measurement& measurement) const {
  // From five recordings by four receivers in three streets: medians and 95 % of the filter's errors are near
  // their minimum for 0.001 to 0.01 and 20 to 40.
  constexpr double kFloor = 0.001, kScale = 40;
  const double own = geodesy::kSpeedOfLight / measurement.carrier_frequency_hz * measurement.doppler_sigma_hz;
  if (weighting != Weighting::Cn0) return own;
  return std::sqrt(own * own + kFloor +
                   kScale * std::pow(10, -measurement.cn0_dbhz.value_or(kUnknownCn0_dbhz) / 10));
}

}  // namespace canyon::positioning
