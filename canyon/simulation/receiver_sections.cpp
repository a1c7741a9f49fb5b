// Reads what a receiver is made of: scenarios, hosts and profiles share it. Ranges of single keys are those
// of the options' structs, whose validate() has the last word.
#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <utility>

#include "canyon/geodesy/constants.hpp"
#include "canyon/simulation/scenario_sections.hpp"

namespace canyon::simulation {
namespace {

using disturbance::ShadowingEnvironment;
using positioning::Weighting;
using signal::FoliageModel;
using tracking::Discriminator;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// One of `values` by its word().
template <typename Value>
void set_word(Value& field, YamlSection& section, std::string_view key, std::initializer_list<Value> values) {
  std::vector<std::string> words;
  for (const Value value : values) words.emplace_back(word(value));
  const auto chosen = section.choice(key, words);
  if (!chosen) return;
  for (const Value value : values) {
    if (*chosen == word(value)) field = value;
  }
}

void read_diffraction(YamlSection& section, propagation::PropagationOptions& options) {
  propagation::DiffractionOptions& o = options.edges;
  set(options.diffraction, section.boolean("enabled"));
  set(o.max_range_m, section.number("max_range_m", {0, 100e3, true}));
  set_deg(o.max_bending_rad, section.number("max_bending_deg", {0, 180, true}));
  set(o.max_loss_db, section.number("max_loss_db", {7, 100}));
  set(o.max_clear_nu, section.number("max_clear_nu", {0, 100}));
  set(o.max_paths, section.integer("max_paths", 1, 100));
  set(o.edges.terrain, section.boolean("terrain"));
  set(o.edges.free_edges, section.boolean("free_edges"));
  // 0.001 rad and more.
  set_deg(o.edges.min_turn_rad, section.number("min_turn_deg", {0.0573, 90}));
  section.finish();
  validate(o, section);
}

void read_diffuse(YamlSection& section, propagation::PropagationOptions& options) {
  propagation::DiffuseOptions& o = options.scattering;
  set(options.diffuse, section.boolean("enabled"));
  set(o.rays, section.integer("rays", 8, 4096));
  set(o.scattering_coefficient, section.number("scattering_coefficient", {0, 1}));
  set(o.wall_reflectance, section.number("wall_reflectance", {0, 1}));
  set(o.lobe_exponent, section.integer("lobe_exponent", 0, 20));
  set_deg(o.lowest_elevation_rad, section.number("lowest_elevation_deg", {-90, 90, false, true}));
  set(o.max_range_m, section.number("max_range_m", {0, 100e3, true}));
  set(o.min_power_db, section.number("min_power_db", {-100, 0}));
  set(o.class_m, section.number("class_m", {0, 1e6, true}));
  set(o.max_paths, section.integer("max_paths", 1, 64));
  section.finish();
  validate(o, section);
}

void read_weights(YamlSection& section, positioning::WeightOptions& o) {
  set_word(o.weighting, section, "weighting",
           {Weighting::Sigma, Weighting::Equal, Weighting::Elevation, Weighting::Cn0});
  set(o.elevation_a_m, section.number("elevation_a_m", {0, 1e6, true}));
  set(o.elevation_b_m, section.number("elevation_b_m", {0, 1e6, true}));
  set(o.cn0_floor_m2, section.number("cn0_floor_m2", {0, 1e9, true}));
  set(o.cn0_scale_m2_hz, section.number("cn0_scale_m2_hz", {0, 1e12}));
  section.finish();
}

void read_raim(YamlSection& section, positioning::RaimOptions& o) {
  set(o.enabled, section.boolean("enabled"));
  set(o.false_alarm, section.number("false_alarm", {0, 0.5, true}));
  set(o.max_exclusions, section.integer("max_exclusions", 1, 30));
  set(o.sigma_scale, section.number("sigma_scale", {0, 1e6, true}));
  section.finish();
}

void read_filter(YamlSection& section, positioning::PositionFilterOptions& o) {
  set(o.enabled, section.boolean("enabled"));
  set(o.acceleration_horizontal, section.number("acceleration_horizontal", {0, 100, true}));
  set(o.acceleration_vertical, section.number("acceleration_vertical", {0, 100, true}));
  set(o.clock_frequency_density, section.number("clock_frequency_density", {0, 1, true}));
  set(o.clock_drift_density, section.number("clock_drift_density", {0, 1, true}));
  set(o.gate_sigmas, section.number_or_none("gate_sigmas", {0, 1e6, true}));
  set(o.coast_s, section.number("coast_s", {0, 1e8, true}));
  section.finish();
}

signal::AntennaPattern read_antenna_rows(YamlSection& section, const std::vector<std::vector<double>>& rows) {
  std::vector<signal::PatternPoint> points;
  for (const std::vector<double>& row : rows) points.push_back({row[0], row[1], row[2]});
  try {
    return signal::AntennaPattern("rows", std::move(points));
  } catch (const InputError& e) {
    throw section.error("antenna_rows", e.problem(), e.cure());
  }
}

void read_antenna(YamlSection& section, signal::AntennaPattern& antenna) {
  const auto kind = only_one(section, {"antenna", "antenna_rows"});
  if (kind == "antenna") {
    antenna = signal::antenna_by_name(*section.choice("antenna", {"isotropic", "patch", "survey", "phone"}));
  } else if (kind == "antenna_rows") {
    antenna = read_antenna_rows(section, *section.rows("antenna_rows", 3, {-1000, 1000}));
  }
}

void read_link(YamlSection& section, signal::LinkBudgetOptions& o) {
  set(o.above_minimum_db, section.number("above_minimum_db", {-10, 20}));
  set(o.antenna_temperature_k, section.number("antenna_temperature_k", {2, 1000}));
  set(o.noise_figure_db, section.number("noise_figure_db", {0, 20}));
  set(o.implementation_loss_db, section.number("implementation_loss_db", {0, 20}));
  section.finish();
  validate(o, section);
}

void read_lock(YamlSection& section, tracking::SignalLockOptions& o) {
  constexpr Range kCn0{-100, 100};
  constexpr Range kSeconds{0, 1e8};
  set(o.acquisition_threshold_dbhz, section.number("acquisition_threshold_dbhz", kCn0));
  set(o.tracking_threshold_dbhz, section.number("tracking_threshold_dbhz", kCn0));
  set(o.cold_acquisition_s, section.number("cold_acquisition_s", kSeconds));
  set(o.reacquisition_s, section.number("reacquisition_s", kSeconds));
  set(o.hold_s, section.number("hold_s", kSeconds));
  set(o.memory_s, section.number("memory_s", kSeconds));
  set(o.warm_start, section.boolean("warm_start"));
  section.finish();
  validate(o, section);
}

void read_shadowing(YamlSection& section, disturbance::ShadowingOptions& o) {
  set(o.enabled, section.boolean("enabled"));
  set_word(o.environment, section, "environment",
           {ShadowingEnvironment::Urban, ShadowingEnvironment::Suburban, ShadowingEnvironment::Custom});
  if (auto custom = section.section("custom")) {
    constexpr Range kMean{-40, 10};
    constexpr Range kSigma{0, 20};
    set(o.custom.clear_mean_db, custom->number("clear_mean_db", kMean));
    set(o.custom.clear_sigma_db, custom->number("clear_sigma_db", kSigma));
    set(o.custom.shadowed_mean_db, custom->number("shadowed_mean_db", kMean));
    set(o.custom.shadowed_sigma_db, custom->number("shadowed_sigma_db", kSigma));
    set(o.custom.enter, custom->number("enter", {0, 1}));
    set(o.custom.leave, custom->number("leave", {0, 1, true}));
    custom->finish();
  }
  set(o.frame_m, section.number("frame_m", {0.1, 1000}));
  set(o.transition_m, section.number("transition_m", {0, 1000}));
  set(o.correlation_m, section.number("correlation_m", {0, 1000, true}));
  set(o.obstacle_distance_m, section.number("obstacle_distance_m", {0, 1000}));
  section.finish();
  validate(o, section);
}

// Bandwidth and integration: what all three loops have.
template <typename Loop>
void read_loop(YamlSection& section, Loop& o, double max_bandwidth_hz) {
  set(o.loop_bandwidth_hz, section.number("loop_bandwidth_hz", {0, max_bandwidth_hz, true}));
  set(o.integration_s, section.number("integration_s", {0, 10, true}));
}

void read_loops(YamlSection& section, tracking::SignalOptions& o) {
  if (auto dll = section.section("dll")) {
    set_word(o.dll.discriminator, *dll, "discriminator",
             {Discriminator::Coherent, Discriminator::EarlyLatePower, Discriminator::DotProduct,
              Discriminator::DoubleDelta});
    set(o.dll.spacing_chips, dll->number("spacing_chips", {0, 1, true}));
    read_loop(*dll, o.dll, 50);
    dll->finish();
    validate(o.dll, *dll);
  }
  if (auto pll = section.section("pll")) {
    read_loop(*pll, o.pll, 100);
    pll->finish();
    validate(o.pll, *pll);
  }
  if (auto fll = section.section("fll")) {
    read_loop(*fll, o.fll, 100);
    set(o.fll.noise_factor, fll->number("noise_factor", {1, 2}));
    fll->finish();
    validate(o.fll, *fll);
  }
}

void read_signal(YamlSection& section, tracking::SignalOptions& o) {
  set(o.enabled, section.boolean("enabled"));
  read_antenna(section, o.antenna);
  if (auto link = section.section("link")) read_link(*link, o.link);
  if (auto offsets = section.section("system_offset_db")) {
    for (const gnss::System system : gnss::kAllSystems) {
      if (const auto offset = offsets->number(gnss::name(system), {-20, 20})) {
        o.system_offset_db[system] = *offset;
      }
    }
    offsets->finish();
  }
  set(o.satellite_sigma_db, section.number("satellite_sigma_db", {0, 10}));
  if (auto strength = section.section("strength")) {
    set(o.strength.slabs, strength->boolean("slabs"));
    set(o.strength.roughness_m, strength->number("roughness_m", {0, 1}));
    set_word(o.strength.foliage, *strength, "foliage", {FoliageModel::Woodland, FoliageModel::SlantPath});
    strength->finish();
    validate(o.strength, *strength);
  }
  if (auto shadowing = section.section("shadowing")) read_shadowing(*shadowing, o.shadowing);
  set(o.front_end_bandwidth_hz, section.number_or_none("front_end_bandwidth_hz", {1.023e6, 511e6}));
  read_loops(section, o);
  if (auto lock = section.section("lock")) read_lock(*lock, o.lock);
  set(o.phase_threshold_dbhz, section.number("phase_threshold_dbhz", {-100, 100}));
  set(o.cn0_sigma_db, section.number("cn0_sigma_db", {0, 10}));
  set(o.cn0_step_db, section.number("cn0_step_db", {0, 10}));
  set(o.loop_noise, section.boolean("loop_noise"));
  section.finish();
}

}  // namespace

const char* word(Weighting weighting) {
  return positioning::name(weighting).data();  // a literal
}

const char* word(Discriminator discriminator) {
  switch (discriminator) {
    case Discriminator::Coherent:
      return "coherent";
    case Discriminator::EarlyLatePower:
      return "early_late_power";
    case Discriminator::DotProduct:
      return "dot_product";
    case Discriminator::DoubleDelta:
      return "double_delta";
  }
  assert(false);
  return "";
}

const char* word(FoliageModel model) {
  switch (model) {
    case FoliageModel::Woodland:
      return "woodland";
    case FoliageModel::SlantPath:
      return "slant_path";
  }
  assert(false);
  return "";
}

const char* word(ShadowingEnvironment environment) {
  switch (environment) {
    case ShadowingEnvironment::Urban:
      return "urban";
    case ShadowingEnvironment::Suburban:
      return "suburban";
    case ShadowingEnvironment::Custom:
      return "custom";
  }
  assert(false);
  return "";
}

void read_propagation(YamlSection& section, propagation::PropagationOptions& options) {
  if (const auto model = section.choice("model", {"specular", "mirror"})) {
    options.model = *model == "mirror" ? propagation::Model::Mirror : propagation::Model::Specular;
  }
  set(options.reflection_order, section.integer("reflection_order", 0, 2));
  set(options.max_range_m, section.number("max_range_m", {0, 100e3, true}));
  set_deg(options.max_incidence_rad, section.number("max_incidence_deg", {0, 90, true}));
  set(options.ground_reflection, section.boolean("ground_reflection"));
  if (auto diffraction = section.section("diffraction")) read_diffraction(*diffraction, options);
  if (auto diffuse = section.section("diffuse")) read_diffuse(*diffuse, options);
  set(options.through_foliage, section.boolean("through_foliage"));
  section.finish();
  validate(options, section);
}

void read_noise(YamlSection& section, receiver::NoiseOptions& options) {
  set(options.enabled, section.boolean("enabled"));
  set(options.ou.theta_per_s, section.number("theta_per_s", {0, 1e6, true}));
  set(options.ou.mu_m, section.number("mu_m", {-1e6, 1e6}));
  set(options.ou.sigma_m_per_sqrt_s, section.number("sigma_m_per_sqrt_s", {0, 1e6}));
  set(options.doppler_sigma_hz, section.number("doppler_sigma_hz", {0, 1e6}));
  if (auto drift = section.section("drift")) {
    set(options.drift_enabled, drift->boolean("enabled"));
    set(options.drift_below_speed_mps, drift->number("below_speed_mps", {0, 1e4}));
    set(options.drift_below_los, drift->integer("below_los", 0, 1000));
    set(options.drift_mu_sigma_m, drift->number("mu_sigma_m", {0, 1e6}));
    drift->finish();
  }
  section.finish();
  validate(options, section);
}

void read_receiver_keys(YamlSection& section, ReceiverConfig& config) {
  receiver::ReceiverOptions& o = config.options;
  set_deg(o.fix.elevation_mask_rad, section.number("elevation_mask_deg", {0, 90, false, true}));
  set(o.fix.cn0_mask_dbhz, section.number("cn0_mask_dbhz", {0, 60}));
  set(o.fix.min_satellites, section.integer("min_satellites", 4, 1000));
  set(o.fix.max_pdop, section.number_or_none("max_pdop", {0, kInfinity, true}));
  set(o.fix.max_iterations, section.integer("max_iterations", 5, 1000));
  set(o.fix.convergence_m, section.number("convergence_m", {0, 1, true}));
  if (auto weights = section.section("weights")) read_weights(*weights, o.fix.weights);
  if (auto raim = section.section("raim")) read_raim(*raim, o.fix.raim);
  set(o.ionosphere, section.boolean("ionosphere"));
  set(o.troposphere, section.boolean("troposphere"));
  set(o.fix.correct_ionosphere, section.boolean("correct_ionosphere"));
  set(o.fix.correct_troposphere, section.boolean("correct_troposphere"));
  if (auto filter = section.section("position_filter")) read_filter(*filter, o.filter);
  if (auto lever = section.section("lever_arm")) {
    set(config.lever_arm_m.x(), lever->number("forward_m", {-1000, 1000}));
    set(config.lever_arm_m.y(), lever->number("left_m", {-1000, 1000}));
    set(config.lever_arm_m.z(), lever->number("up_m", {-1000, 1000}));
    lever->finish();
  }
  if (auto clock = section.section("clock")) {
    set(o.clock.bias_s, clock->number("bias_s", {-0.1, 0.1}));
    set(o.clock.drift, clock->number("drift", {-1e-4, 1e-4}));
    set(o.clock.drift_walk, clock->number("drift_walk", {0, 1e-4}));
    clock->finish();
  }
  if (auto signal = section.section("signal")) read_signal(*signal, o.signal);
  if (auto noise = section.section("noise")) read_noise(*noise, o.noise);
  if (auto propagation = section.section("propagation")) read_propagation(*propagation, config.propagation);
  validate(o, section);
}

}  // namespace canyon::simulation
