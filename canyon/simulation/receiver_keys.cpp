// The table of a receiver's keys: scenarios, hosts and profiles share it. Defaults come from the structs.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "canyon/geodesy/constants.hpp"
#include "canyon/simulation/scenario_keys.hpp"
#include "canyon/simulation/scenario_sections.hpp"

namespace canyon::simulation {
namespace {

// Adds rows below one path.
class Rows {
 public:
  Rows(std::vector<ScenarioKey>& keys, std::string at) : keys_(keys), at_(std::move(at)) {}
  void operator()(const std::string& key, const char* unit, std::string value, std::string meaning) const {
    keys_.push_back({at_ + key, unit, std::move(value), std::move(meaning)});
  }

 private:
  std::vector<ScenarioKey>& keys_;
  std::string at_;
};

void add_fix(const Rows& add) {
  const positioning::FixOptions o;
  add("elevation_mask_deg", "deg", show_deg(o.elevation_mask_rad),
      "satellites below are neither measured nor used");
  add("cn0_mask_dbhz", "dB-Hz", show(o.cn0_mask_dbhz), "satellites weaker than this are not used in the fix");
  add("min_satellites", "satellites", show(o.min_satellites),
      "needed for a fix, on top of one for each constellation beyond the first");
  add("max_pdop", "", show(o.max_pdop), "a fix of larger PDOP is none");
  add("max_iterations", "", show(o.max_iterations), "of the least squares");
  add("convergence_m", "m", show(o.convergence_m), "the step that ends them");
  add("weights.weighting", "", word(o.weights.weighting),
      "of pseudoranges against each other: sigma (their simulated deviation), equal, elevation or cn0");
  add("weights.elevation_a_m", "m", show(o.weights.elevation_a_m),
      "elevation: sigma^2 = a^2 + b^2 / sin(elevation)^2");
  add("weights.elevation_b_m", "m", show(o.weights.elevation_b_m), "likewise");
  add("weights.cn0_floor_m2", "m^2", show(o.weights.cn0_floor_m2),
      "cn0: sigma^2 = floor + scale 10^(-C/N0 / 10)");
  add("weights.cn0_scale_m2_hz", "m^2 Hz", show(o.weights.cn0_scale_m2_hz), "likewise");
  add("raim.enabled", "", show(o.raim.enabled),
      "exclude satellites whose residuals contradict the others (receiver autonomous integrity monitoring)");
  add("raim.false_alarm", "", show(o.raim.false_alarm), "probability of a false alarm of one fix");
  add("raim.max_exclusions", "satellites", show(o.raim.max_exclusions), "from one fix at most");
  add("raim.sigma_scale", "", show(o.raim.sigma_scale),
      "residuals are tested against the weights' deviation times this");
}

void add_filter(const Rows& add) {
  const positioning::PositionFilterOptions o;
  add("position_filter.enabled", "", show(o.enabled),
      "extended Kalman filter behind the fix; false: each epoch's fix stands alone");
  add("position_filter.acceleration_horizontal", "m/s^2/sqrt(Hz)", show(o.acceleration_horizontal),
      "spectral density of the white acceleration it expects");
  add("position_filter.acceleration_vertical", "m/s^2/sqrt(Hz)", show(o.acceleration_vertical),
      "likewise, upwards");
  add("position_filter.clock_frequency_density", "s^2/s", show(o.clock_frequency_density),
      "white frequency noise of the clock it expects");
  add("position_filter.clock_drift_density", "1/s^2 s", show(o.clock_drift_density),
      "random walk of that frequency");
  add("position_filter.gate_sigmas", "", show(o.gate_sigmas),
      "innovations beyond so many standard deviations are left out; none: all are taken");
  add("position_filter.coast_s", "s", show(o.coast_s), "it begins anew after so long without a measurement");
}

void add_signal(const Rows& add) {
  const tracking::SignalOptions o;
  add("signal.enabled", "", show(o.enabled),
      "strength and tracking of signals; false: whatever arrives is measured, at its shortest path");
  add("signal.antenna", "", o.antenna.name(), "isotropic, patch, survey or phone");
  add("signal.antenna_rows", "deg, dBic, dBic", "",
      "instead: a pattern of rows [elevation, RHCP gain, LHCP gain], elevations rising");
  add("signal.link.above_minimum_db", "dB", show(o.link.above_minimum_db),
      "satellites' power over what their interface documents promise");
  add("signal.link.antenna_temperature_k", "K", show(o.link.antenna_temperature_k),
      "of sky, ground and losses in front of the amplifier");
  add("signal.link.noise_figure_db", "dB", show(o.link.noise_figure_db),
      "of the receiver with its amplifier");
  add("signal.link.implementation_loss_db", "dB", show(o.link.implementation_loss_db),
      "of filter, quantisation and correlation");
  for (const gnss::System system : gnss::kAllSystems) {
    add(fmt::format("signal.system_offset_db.{}", gnss::name(system)), "dB", "0",
        fmt::format("added to the C/N0 of {}", gnss::name(system)));
  }
  add("signal.satellite_sigma_db", "dB", show(o.satellite_sigma_db),
      "standard deviation of a constant of each satellite's power");
  add("signal.strength.slabs", "", show(o.strength.slabs),
      "facades are slabs of their material's thickness; false: half spaces");
  add("signal.strength.roughness_m", "m", show(o.strength.roughness_m),
      "standard deviation of the heights of reflecting surfaces; 0: mirrors");
  add("signal.strength.foliage", "", word(o.strength.foliage),
      "loss through vegetation by ITU-R P.833: woodland (2.1) or slant_path (2.2)");
  add("signal.shadowing.enabled", "", show(o.shadowing.enabled),
      "shadow on the direct signal by what no map has: vehicles, trees, signs");
  add("signal.shadowing.environment", "", word(o.shadowing.environment),
      "whose numbers: urban, suburban or custom");
  add("signal.shadowing.custom.clear_mean_db", "dB", show(o.shadowing.custom.clear_mean_db),
      "custom: mean level in the clear");
  add("signal.shadowing.custom.clear_sigma_db", "dB", show(o.shadowing.custom.clear_sigma_db),
      "its standard deviation");
  add("signal.shadowing.custom.shadowed_mean_db", "dB", show(o.shadowing.custom.shadowed_mean_db),
      "mean level in shadow");
  add("signal.shadowing.custom.shadowed_sigma_db", "dB", show(o.shadowing.custom.shadowed_sigma_db),
      "its standard deviation");
  add("signal.shadowing.custom.enter", "", show(o.shadowing.custom.enter),
      "probability that shadow follows a clear frame");
  add("signal.shadowing.custom.leave", "", show(o.shadowing.custom.leave),
      "probability that a clear frame follows shadow");
  add("signal.shadowing.frame_m", "m", show(o.shadowing.frame_m), "states last whole frames of this length");
  add("signal.shadowing.transition_m", "m", show(o.shadowing.transition_m),
      "way over which one state passes into the other");
  add("signal.shadowing.correlation_m", "m", show(o.shadowing.correlation_m),
      "way over which levels correlate by 1/e");
  add("signal.shadowing.obstacle_distance_m", "m", show(o.shadowing.obstacle_distance_m),
      "to what casts the shadow, which moves as the satellite does");
  add("signal.front_end_bandwidth_hz", "Hz", show(o.front_end_bandwidth_hz),
      "two-sided, of an ideal filter; none: no filter");
  add("signal.dll.discriminator", "", word(o.dll.discriminator),
      "of the code loop: coherent, early_late_power, dot_product or double_delta");
  add("signal.dll.spacing_chips", "chips", show(o.dll.spacing_chips),
      "from early to late correlator (double_delta: of the inner pair)");
  add("signal.dll.loop_bandwidth_hz", "Hz", show(o.dll.loop_bandwidth_hz), "one-sided noise bandwidth");
  add("signal.dll.integration_s", "s", show(o.dll.integration_s), "coherent integration");
  add("signal.pll.loop_bandwidth_hz", "Hz", show(o.pll.loop_bandwidth_hz),
      "one-sided noise bandwidth of the phase loop");
  add("signal.pll.integration_s", "s", show(o.pll.integration_s), "coherent integration");
  add("signal.fll.loop_bandwidth_hz", "Hz", show(o.fll.loop_bandwidth_hz),
      "one-sided noise bandwidth of the frequency loop (Doppler)");
  add("signal.fll.integration_s", "s", show(o.fll.integration_s), "coherent integration");
  add("signal.fll.noise_factor", "", show(o.fll.noise_factor),
      "1 at high C/N0, 2 near the tracking threshold");
  add("signal.lock.acquisition_threshold_dbhz", "dB-Hz", show(o.lock.acquisition_threshold_dbhz),
      "a signal is found at this C/N0");
  add("signal.lock.tracking_threshold_dbhz", "dB-Hz", show(o.lock.tracking_threshold_dbhz),
      "and kept down to this");
  add("signal.lock.cold_acquisition_s", "s", show(o.lock.cold_acquisition_s),
      "from appearance to first measurement where nothing is known of the signal");
  add("signal.lock.reacquisition_s", "s", show(o.lock.reacquisition_s), "likewise of one tracked before");
  add("signal.lock.hold_s", "s", show(o.lock.hold_s),
      "loops coast so long below the threshold before they search");
  add("signal.lock.memory_s", "s", show(o.lock.memory_s), "a signal lost longer ago is cold again");
  add("signal.lock.warm_start", "", show(o.lock.warm_start),
      "the receiver has run long since: all signals are known at the first epoch");
  add("signal.phase_threshold_dbhz", "dB-Hz", show(o.phase_threshold_dbhz),
      "carrier phase is tracked down to this C/N0");
  add("signal.cn0_sigma_db", "dB", show(o.cn0_sigma_db),
      "standard deviation of the receiver's C/N0 estimate");
  add("signal.cn0_step_db", "dB", show(o.cn0_step_db), "C/N0 is stated in steps of this; 0: as it is");
  add("signal.loop_noise", "", show(o.loop_noise), "thermal noise of code, phase and Doppler from C/N0");
}

}  // namespace

std::string show(bool value) {
  return value ? "true" : "false";
}
std::string show(int value) {
  return fmt::format("{}", value);
}
std::string show(double value) {
  return std::isinf(value) ? "none" : fmt::format("{:.9g}", value);
}
std::string show_deg(double radians) {
  return fmt::format("{:.9g}", geodesy::degrees(radians));
}

void add_propagation_keys(std::vector<ScenarioKey>& keys, const std::string& at) {
  const Rows add(keys, at);
  const propagation::PropagationOptions o;
  add("model", "", "specular",
      "specular: image method on planar facets; mirror: the paper's algorithm 2 (one mirror ray)");
  add("reflection_order", "", show(o.reflection_order),
      "reflections on a path at most: 0 (direct signal only), 1 or 2; specular only");
  add("max_range_m", "m", show(o.max_range_m),
      "reach of the mirror ray, and of the way from antenna to the (last) reflection point");
  add("max_incidence_deg", "deg", show_deg(o.max_incidence_rad),
      "largest angle of incidence of a reflection, from the facade's normal; specular only");
  add("ground_reflection", "", show(o.ground_reflection), "reflect from terrain as well; specular only");
  add("diffraction.enabled", "", show(o.diffraction),
      "paths around single edges of roofs and walls; specular only");
  add("diffraction.max_range_m", "m", show(o.edges.max_range_m), "reach of the leg from antenna to edge");
  add("diffraction.max_bending_deg", "deg", show_deg(o.edges.max_bending_rad),
      "largest angle between that leg and the direction to the satellite");
  add("diffraction.max_loss_db", "dB", show(o.edges.max_loss_db), "largest loss of a path that is kept");
  add("diffraction.max_clear_nu", "", show(o.edges.max_clear_nu),
      "with the straight line clear, edges up to this Fresnel-Kirchhoff parameter from it");
  add("diffraction.max_paths", "", show(o.edges.max_paths), "of one satellite, the strongest ones");
  add("diffraction.terrain", "", show(o.edges.edges.terrain), "crests of the terrain as well");
  add("diffraction.free_edges", "", show(o.edges.edges.free_edges),
      "rims of sheets and of meshes that do not close");
  add("diffraction.min_turn_deg", "deg", show_deg(o.edges.edges.min_turn_rad),
      "least angle between the faces of an edge");
  add("diffuse.enabled", "", show(o.diffuse),
      "scattering by facades that are no mirrors, of blocked satellites; specular only");
  add("diffuse.rays", "", show(o.scattering.rays), "directions that facades are looked for in");
  add("diffuse.scattering_coefficient", "", show(o.scattering.scattering_coefficient),
      "amplitude scattered over amplitude that a smooth wall would reflect");
  add("diffuse.wall_reflectance", "", show(o.scattering.wall_reflectance),
      "power that a smooth wall would reflect");
  add("diffuse.lobe_exponent", "", show(o.scattering.lobe_exponent),
      "0: Lambert's lobe; more: about the mirror's direction, 3 to 4 by measurements");
  add("diffuse.lowest_elevation_deg", "deg", show_deg(o.scattering.lowest_elevation_rad),
      "nothing is looked for below");
  add("diffuse.max_range_m", "m", show(o.scattering.max_range_m), "reach of these rays");
  add("diffuse.min_power_db", "dB", show(o.scattering.min_power_db),
      "paths farther below the line of sight are dropped");
  add("diffuse.class_m", "m", show(o.scattering.class_m),
      "width of the classes of detour that ways are gathered in");
  add("diffuse.max_paths", "", show(o.scattering.max_paths), "classes of one satellite, the strongest ones");
  add("through_foliage", "", show(o.through_foliage),
      "vegetation weakens the direct signal instead of blocking it; specular only");
}

void add_noise_keys(std::vector<ScenarioKey>& keys, const std::string& at) {
  const Rows add(keys, at);
  const receiver::NoiseOptions o;
  add("enabled", "", show(o.enabled), "noise on pseudoranges and Doppler");
  add("theta_per_s", "1/s", show(o.ou.theta_per_s),
      "mean reversion of each satellite's Ornstein-Uhlenbeck process");
  add("mu_m", "m", show(o.ou.mu_m), "its mean");
  add("sigma_m_per_sqrt_s", "m/sqrt(s)", show(o.ou.sigma_m_per_sqrt_s),
      "its diffusion; the standard deviation is sigma / sqrt(2 theta)");
  add("doppler_sigma_hz", "Hz", show(o.doppler_sigma_hz), "standard deviation of white noise on Doppler");
  add("drift.enabled", "", show(o.drift_enabled),
      "the paper's drift mode: while slow or with few satellites in sight, means move away from mu");
  add("drift.below_speed_mps", "m/s", show(o.drift_below_speed_mps), "drift while slower than this");
  add("drift.below_los", "satellites", show(o.drift_below_los),
      "drift while fewer satellites are in line of sight");
  add("drift.mu_sigma_m", "m", show(o.drift_mu_sigma_m),
      "standard deviation of the drifted means, drawn once per satellite");
}

void add_receiver_keys(std::vector<ScenarioKey>& keys, const std::string& at) {
  const Rows add(keys, at);
  const receiver::ReceiverOptions o;
  add_fix(add);
  add("ionosphere", "", show(o.ionosphere),
      "put the broadcast ionosphere (Klobuchar) into the signals; needs its coefficients in the navigation "
      "files");
  add("troposphere", "", show(o.troposphere), "put Saastamoinen's troposphere into the signals");
  add("correct_ionosphere", "", show(o.fix.correct_ionosphere), "correct it in the fix");
  add("correct_troposphere", "", show(o.fix.correct_troposphere), "correct it in the fix");
  add_filter(add);
  add("lever_arm.forward_m", "m", "0", "antenna from the trajectory's point: ahead, turned by its yaw");
  add("lever_arm.left_m", "m", "0", "to the left");
  add("lever_arm.up_m", "m", "0", "up");
  add("clock.bias_s", "s", show(o.clock.bias_s), "receiver clock minus GPST at the first epoch");
  add("clock.drift", "s/s", show(o.clock.drift), "its rate at the first epoch");
  add("clock.drift_walk", "s/s/sqrt(s)", show(o.clock.drift_walk), "random walk of the drift");
  add_signal(add);
  add_noise_keys(keys, at + "noise.");
  add_propagation_keys(keys, at + "propagation.");
}

}  // namespace canyon::simulation
