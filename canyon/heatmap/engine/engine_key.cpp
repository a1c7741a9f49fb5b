#include "canyon/heatmap/engine/engine_key.hpp"

#include <fmt/format.h>

#include <string_view>
#include <type_traits>

#include "canyon/base/text.hpp"

namespace canyon::heatmap {
namespace {

class Lines {
 public:
  template <class Value>
  Lines& operator()(std::string_view name, const Value& value) {
    if constexpr (std::is_enum_v<Value>) {
      text_ += fmt::format("{}: {}\n", name, static_cast<long long>(value));
    } else {
      text_ += fmt::format("{}: {}\n", name, value);  // the shortest digits that read back the same
    }
    return *this;
  }
  [[nodiscard]] std::string text() && { return std::move(text_); }

 private:
  std::string text_;
};

void add(Lines& add, const propagation::PropagationOptions& o) {
  add("propagation.model", o.model)("reflection_order", o.reflection_order)("max_range_m", o.max_range_m);
  add("max_incidence_rad", o.max_incidence_rad)("ground_reflection", o.ground_reflection);
  add("diffraction", o.diffraction)("diffuse", o.diffuse)("through_foliage", o.through_foliage);
  const propagation::DiffractionOptions& e = o.edges;
  add("edges.frequency_hz", e.frequency_hz)("edges.max_range_m", e.max_range_m);
  add("edges.max_bending_rad", e.max_bending_rad)("edges.max_loss_db", e.max_loss_db);
  add("edges.max_clear_nu", e.max_clear_nu)("edges.max_paths", e.max_paths);
  add("edges.terrain", e.edges.terrain)("edges.free_edges", e.edges.free_edges);
  add("edges.min_turn_rad", e.edges.min_turn_rad);
  const propagation::DiffuseOptions& d = o.scattering;
  add("scattering.rays", d.rays)("scattering.coefficient", d.scattering_coefficient);
  add("scattering.wall_reflectance", d.wall_reflectance)("scattering.lobe_exponent", d.lobe_exponent);
  add("scattering.lowest_elevation_rad", d.lowest_elevation_rad)("scattering.max_range_m", d.max_range_m);
  add("scattering.min_power_db", d.min_power_db)("scattering.class_m", d.class_m);
  add("scattering.max_paths", d.max_paths);
}

void add(Lines& add, const positioning::FixOptions& o) {
  add("fix.elevation_mask_rad", o.elevation_mask_rad)("fix.min_satellites", o.min_satellites);
  add("fix.max_iterations", o.max_iterations)("fix.convergence_m", o.convergence_m);
  add("fix.correct_ionosphere", o.correct_ionosphere)("fix.correct_troposphere", o.correct_troposphere);
  add("fix.cn0_mask_dbhz", o.cn0_mask_dbhz)("fix.max_pdop", o.max_pdop);
  add("weights.weighting", o.weights.weighting)("weights.elevation_a_m", o.weights.elevation_a_m);
  add("weights.elevation_b_m", o.weights.elevation_b_m)("weights.cn0_floor_m2", o.weights.cn0_floor_m2);
  add("weights.cn0_scale_m2_hz", o.weights.cn0_scale_m2_hz);
  add("raim.enabled", o.raim.enabled)("raim.false_alarm", o.raim.false_alarm);
  add("raim.max_exclusions", o.raim.max_exclusions)("raim.sigma_scale", o.raim.sigma_scale);
}

void add(Lines& add, const tracking::SignalOptions& o) {
  add("signal.enabled", o.enabled);
  if (!o.enabled) return;  // the rest then is never looked at
  add("signal.antenna", o.antenna.name());
  for (const signal::PatternPoint& point : o.antenna.points()) {
    add("antenna.elevation_deg", point.elevation_deg)("rhcp_dbic", point.rhcp_dbic);
    add("lhcp_dbic", point.lhcp_dbic);
  }
  add("link.above_minimum_db", o.link.above_minimum_db);
  add("link.antenna_temperature_k", o.link.antenna_temperature_k);
  add("link.noise_figure_db", o.link.noise_figure_db);
  add("link.implementation_loss_db", o.link.implementation_loss_db);
  for (const auto& [system, offset_db] : o.system_offset_db) {
    add("system", system)("offset_db", offset_db);
  }
  add("satellite_sigma_db", o.satellite_sigma_db);
  add("strength.slabs", o.strength.slabs)("strength.roughness_m", o.strength.roughness_m);
  add("strength.foliage", o.strength.foliage);
  const disturbance::ShadowingOptions& w = o.shadowing;
  add("shadowing.enabled", w.enabled)("shadowing.environment", w.environment)("shadowing.frame_m", w.frame_m);
  add("shadowing.transition_m", w.transition_m)("shadowing.correlation_m", w.correlation_m);
  add("shadowing.obstacle_distance_m", w.obstacle_distance_m);
  add("custom.clear_mean_db", w.custom.clear_mean_db)("custom.clear_sigma_db", w.custom.clear_sigma_db);
  add("custom.shadowed_mean_db", w.custom.shadowed_mean_db);
  add("custom.shadowed_sigma_db", w.custom.shadowed_sigma_db);
  add("custom.enter", w.custom.enter)("custom.leave", w.custom.leave);
  add("front_end_bandwidth_hz", o.front_end_bandwidth_hz);
  add("dll.discriminator", o.dll.discriminator)("dll.spacing_chips", o.dll.spacing_chips);
  add("dll.loop_bandwidth_hz", o.dll.loop_bandwidth_hz)("dll.integration_s", o.dll.integration_s);
  add("pll.loop_bandwidth_hz", o.pll.loop_bandwidth_hz)("pll.integration_s", o.pll.integration_s);
  add("fll.loop_bandwidth_hz", o.fll.loop_bandwidth_hz)("fll.integration_s", o.fll.integration_s);
  add("fll.noise_factor", o.fll.noise_factor);
  add("lock.acquisition_threshold_dbhz", o.lock.acquisition_threshold_dbhz);
  add("lock.tracking_threshold_dbhz", o.lock.tracking_threshold_dbhz);
  add("lock.cold_acquisition_s", o.lock.cold_acquisition_s)("lock.reacquisition_s", o.lock.reacquisition_s);
  add("lock.hold_s", o.lock.hold_s)("lock.memory_s", o.lock.memory_s)("lock.warm_start", o.lock.warm_start);
  add("phase_threshold_dbhz", o.phase_threshold_dbhz)("cn0_sigma_db", o.cn0_sigma_db);
  add("cn0_step_db", o.cn0_step_db)("loop_noise", o.loop_noise);
}

void add(Lines& add, const positioning::PositionFilterOptions& o) {
  add("filter.enabled", o.enabled);
  if (!o.enabled) return;
  add("filter.acceleration_horizontal", o.acceleration_horizontal);
  add("filter.acceleration_vertical", o.acceleration_vertical);
  add("filter.clock_frequency_density", o.clock_frequency_density);
  add("filter.clock_drift_density", o.clock_drift_density);
  add("filter.gate_sigmas", o.gate_sigmas)("filter.coast_s", o.coast_s);
}

void add(Lines& line, const receiver::ReceiverOptions& o) {
  line("receiver.name", o.name);
  add(line, o.fix);
  const receiver::NoiseOptions& n = o.noise;
  line("noise.enabled", n.enabled)("noise.theta_per_s", n.ou.theta_per_s)("noise.mu_m", n.ou.mu_m);
  line("noise.sigma_m_per_sqrt_s", n.ou.sigma_m_per_sqrt_s)("noise.doppler_sigma_hz", n.doppler_sigma_hz);
  line("noise.drift_enabled", n.drift_enabled)("noise.drift_below_speed_mps", n.drift_below_speed_mps);
  line("noise.drift_below_los", n.drift_below_los)("noise.drift_mu_sigma_m", n.drift_mu_sigma_m);
  line("clock.bias_s", o.clock.bias_s)("clock.drift", o.clock.drift)("clock.drift_walk", o.clock.drift_walk);
  add(line, o.signal);
  add(line, o.filter);
  line("ionosphere", o.ionosphere)("troposphere", o.troposphere);
}

void add(Lines& line, const Request& request) {
  const Grid& grid = request.grid;
  line("grid.west_m", grid.west_m)("grid.south_m", grid.south_m)("grid.spacing_m", grid.spacing_m);
  line("grid.columns", grid.columns)("grid.rows", grid.rows)("grid.tile_size", grid.tile_size);
  if (request.area) {
    for (const std::vector<Eigen::Vector2d>& ring : request.area->rings) {
      line("ring", ring.size());
      for (const Eigen::Vector2d& point : ring) line("east_m", point.x())("north_m", point.y());
    }
  }
  line("altitude_kind", request.altitude_kind);
  for (const double altitude_m : request.altitudes_m) line("altitude_m", altitude_m);
  for (const geodesy::GpsTime time : request.times) line("time_ns", time.nanoseconds());
  for (const Layer layer : request.layers) line("layer", info(layer).name);
  line("draws", request.draws.draws)("seed", request.draws.seed);
}

}  // namespace

std::string canonical_text(const Request& request, const simulation::ReceiverConfig& receiver,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar) {
  Lines lines;
  add(lines, request);
  add(lines, receiver.propagation);
  add(lines, receiver.options);
  for (const auto& [system, coefficients] : klobuchar) {
    lines("klobuchar", system);
    for (const double alpha : coefficients.alpha) lines("alpha", alpha);
    for (const double beta : coefficients.beta) lines("beta", beta);
  }
  return std::move(lines).text();
}

std::string hash_text(const std::string& text) {
  return fmt::format("{:016x}{:016x}", fnv1a(text), fnv1a("heat map\n" + text));
}

}  // namespace canyon::heatmap
