#include "canyon/simulation/scenario_keys.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "canyon/simulation/profile.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::simulation {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;

const std::filesystem::path kSource = canyon_source_dir;

std::string read_text(const std::filesystem::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// Key paths of a YAML text, lists of mappings as "[]".
void collect(const YAML::Node& node, const std::string& path, std::set<std::string>& paths) {
  if (node.IsMap() && node.size() > 0) {
    for (const auto& pair : node) {
      collect(pair.second, (path.empty() ? "" : path + ".") + pair.first.Scalar(), paths);
    }
  } else if (node.IsSequence() && node.size() > 0 && node[0].IsMap()) {
    for (const YAML::Node& item : node) collect(item, path + "[]", paths);
  } else {
    paths.insert(path);
  }
}

// Scenarios that together hold every key.
std::vector<std::string> scenarios_with_every_key() {
  const std::string propagation =
      "{model: specular, reflection_order: 1, max_range_m: 300, max_incidence_deg: 89, ground_reflection: "
      "false, diffraction: {enabled: true, max_range_m: 200, max_bending_deg: 45, max_loss_db: 30, "
      "max_clear_nu: 1, max_paths: 2, terrain: true, free_edges: false, min_turn_deg: 6}, diffuse: {enabled: "
      "true, rays: 64, scattering_coefficient: 0.3, wall_reflectance: 0.2, lobe_exponent: 3, "
      "lowest_elevation_deg: -5, "
      "max_range_m: 200, min_power_db: -30, class_m: 5, max_paths: 4}, through_foliage: true}";
  const std::string noise =
      "{enabled: true, theta_per_s: 0.02, mu_m: 0, sigma_m_per_sqrt_s: 0.2, doppler_sigma_hz: 0.1, "
      "drift: {enabled: false, below_speed_mps: 0.5, below_los: 5, mu_sigma_m: 2}}";
  return {
      "city: {mesh: f, origin: {latitude_deg: 1, longitude_deg: 2, height_m: 3}, "
      "offset: {east_m: 1, north_m: 2, up_m: 3}, heading_deg: 4, scale: 1, up_axis: Z, terrain_names: [a, "
      "b]}\n"
      "sky: {navigation: [f], systems: [GPS], allow_stale: true}\n"
      "start: {week: 2051, tow: 1}\n"
      "duration_s: 10\nrate_hz: 5\nseed: 3\n"
      "trajectory: {file: f, format: nmea, height_above_terrain_m: 2}\n"
      "outputs: {epochs_csv: true, satellites_csv: true, nmea: true, rinex_observation: true, "
      "rinex_navigation: true, kml: true, geojson: true, pictures: true}\n"
      "propagation: " +
          propagation + "\nnoise: " + noise + "\n",
      "city: {georeference: {sigma_m: 2, heading_sigma_deg: 0.5}, synthetic: {blocks_east: 2, blocks_north: "
      "2, block_size_m: 50, street_width_m: 20, "
      "min_height_m: 10, "
      "max_height_m: 30, seed: 2}}\n"
      "sky: {nominal: true}\nstart: 2026-06-01T12:00:00Z\n"
      "trajectory: {waypoints: [{latitude_deg: 1, longitude_deg: 2, height_m: 3}, {east_m: 1, north_m: 2, "
      "up_m: 3}], "
      "speed_mps: 3, hold_s: 1}\n"
      "receivers: [{name: a, profile: paper, elevation_mask_deg: 5, cn0_mask_dbhz: 6, min_satellites: 4, "
      "max_pdop: 25, max_iterations: 20, convergence_m: 1e-6, weights: {weighting: cn0, elevation_a_m: 0.4, "
      "elevation_b_m: 0.5, cn0_floor_m2: 9, cn0_scale_m2_hz: 2e4}, raim: {enabled: true, false_alarm: 1e-4, "
      "max_exclusions: 2, sigma_scale: 2}, position_filter: {enabled: true, acceleration_horizontal: 1, "
      "acceleration_vertical: 0.4, clock_frequency_density: 1e-19, clock_drift_density: 1e-19, gate_sigmas: "
      "none, coast_s: 3}, signal: {enabled: true, antenna: survey, link: {above_minimum_db: 2, "
      "antenna_temperature_k: 200, noise_figure_db: 3, implementation_loss_db: 2}, system_offset_db: {GPS: "
      "1, "
      "GLONASS: 2, Galileo: 3, BeiDou: 4, QZSS: 5}, satellite_sigma_db: 1, strength: {slabs: false, "
      "roughness_m: 0.1, foliage: slant_path}, shadowing: {enabled: true, environment: custom, custom: {"
      "clear_mean_db: -1, clear_sigma_db: 1, shadowed_mean_db: -7, shadowed_sigma_db: 3, enter: 0.1, leave: "
      "0.2}, frame_m: 4, transition_m: 2, correlation_m: 2, obstacle_distance_m: 5}, front_end_bandwidth_hz: "
      "4e6, dll: {discriminator: "
      "dot_product, "
      "spacing_chips: 0.2, loop_bandwidth_hz: 0.5, integration_s: 0.01}, pll: {loop_bandwidth_hz: 10, "
      "integration_s: 0.01}, fll: {loop_bandwidth_hz: 4, integration_s: 0.01, noise_factor: 2}, lock: "
      "{acquisition_threshold_dbhz: 20, tracking_threshold_dbhz: 15, cold_acquisition_s: 10, "
      "reacquisition_s: 2, hold_s: 3, memory_s: 100, warm_start: true}, phase_threshold_dbhz: 27, "
      "cn0_sigma_db: 0.5, cn0_step_db: 1, loop_noise: false}, ionosphere: true, troposphere: true, "
      "correct_ionosphere: true, "
      "correct_troposphere: true, lever_arm: {forward_m: 1, left_m: 2, up_m: 3}, "
      "clock: {bias_s: 1e-3, drift: 1e-7, drift_walk: 1e-9}, propagation: " +
          propagation + ", noise: " + noise +
          "}, {name: b, signal: {antenna_rows: [[0, -5, -5], [90, 3, -10]]}}]\n",
      "city: {open: true, origin: {latitude_deg: 1, longitude_deg: 2}}\nsky: {sp3: f}\n"
      "trajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n",
      "city: {osm: [f, f], terrain: f, geoid_undulation_m: 2, bbox: [1, 2, 3, 4], level_height_m: 3, "
      "default_height_m: 9, heights: [house=7], foliage: true}\n"
      "trajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n",
      "city: {file: c.canyon}\ntrajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n",
      "city: {synthetic: {}}\nsky: {frozen: {satNum: 1, satAzimuth: 1, satElevation: 1}}\n"
      "trajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n"};
}

TEST(ScenarioKeys, TheReaderAcceptsEveryKeyOfTheTableAndNoOther) {
  const TemporaryFolder folder;
  (void)folder.write("f", "");
  (void)folder.write("c.canyon", "");
  std::set<std::string> used;
  for (const std::string& text : scenarios_with_every_key()) {
    EXPECT_NO_THROW((void)parse_scenario(text, folder / "s.yaml")) << text;
    collect(YAML::Load(text), "", used);
  }
  used.erase("city.synthetic");  // "{}" in the last one; its keys stand for themselves
  std::set<std::string> table;
  for (const ScenarioKey& key : scenario_keys()) {
    EXPECT_TRUE(table.insert(key.path).second) << key.path << " stands twice in the table";
    EXPECT_FALSE(key.meaning.empty()) << key.path;
  }
  EXPECT_EQ(used, table);
}

// --- every key of a receiver means one field
// ------------------------------------------------------------------

// Every field of a receiver's configuration, one text each.
std::vector<std::string> fields(const ReceiverConfig& config) {
  const receiver::ReceiverOptions& o = config.options;
  const tracking::SignalOptions& s = o.signal;
  const propagation::PropagationOptions& p = config.propagation;
  std::vector<std::string> texts;
  const auto number = [&texts](double value) { texts.push_back(fmt::format("{:.9g}", value)); };
  const auto all = [&number](std::initializer_list<double> values) {
    for (const double value : values) number(value);
  };
  all({o.fix.elevation_mask_rad, o.fix.cn0_mask_dbhz, double(o.fix.min_satellites), o.fix.max_pdop,
       double(o.fix.max_iterations), o.fix.convergence_m, double(o.fix.correct_ionosphere),
       double(o.fix.correct_troposphere), double(o.ionosphere), double(o.troposphere)});
  const positioning::WeightOptions& w = o.fix.weights;
  all({double(w.weighting), w.elevation_a_m, w.elevation_b_m, w.cn0_floor_m2, w.cn0_scale_m2_hz});
  const positioning::RaimOptions& r = o.fix.raim;
  all({double(r.enabled), r.false_alarm, double(r.max_exclusions), r.sigma_scale});
  const positioning::PositionFilterOptions& f = o.filter;
  all({double(f.enabled), f.acceleration_horizontal, f.acceleration_vertical, f.clock_frequency_density,
       f.clock_drift_density, f.gate_sigmas, f.coast_s});
  all({config.lever_arm_m.x(), config.lever_arm_m.y(), config.lever_arm_m.z(), o.clock.bias_s, o.clock.drift,
       o.clock.drift_walk});
  const receiver::NoiseOptions& n = o.noise;
  all({double(n.enabled), n.ou.theta_per_s, n.ou.mu_m, n.ou.sigma_m_per_sqrt_s, n.doppler_sigma_hz,
       double(n.drift_enabled), n.drift_below_speed_mps, double(n.drift_below_los), n.drift_mu_sigma_m});
  std::string antenna = s.antenna.name();
  for (const signal::PatternPoint& point : s.antenna.points()) {
    antenna += fmt::format(" {} {} {}", point.elevation_deg, point.rhcp_dbic, point.lhcp_dbic);
  }
  texts.push_back(antenna);
  all({double(s.enabled), s.link.above_minimum_db, s.link.antenna_temperature_k, s.link.noise_figure_db,
       s.link.implementation_loss_db, s.satellite_sigma_db, double(s.strength.slabs), s.strength.roughness_m,
       double(s.strength.foliage), s.front_end_bandwidth_hz});
  for (const gnss::System system : gnss::kAllSystems) {
    const auto at = s.system_offset_db.find(system);
    number(at == s.system_offset_db.end() ? 0 : at->second);
  }
  all({double(s.dll.discriminator), s.dll.spacing_chips, s.dll.loop_bandwidth_hz, s.dll.integration_s,
       s.pll.loop_bandwidth_hz, s.pll.integration_s, s.fll.loop_bandwidth_hz, s.fll.integration_s,
       s.fll.noise_factor});
  all({s.lock.acquisition_threshold_dbhz, s.lock.tracking_threshold_dbhz, s.lock.cold_acquisition_s,
       s.lock.reacquisition_s, s.lock.hold_s, s.lock.memory_s, double(s.lock.warm_start),
       s.phase_threshold_dbhz, s.cn0_sigma_db, s.cn0_step_db, double(s.loop_noise)});
  const disturbance::ShadowingOptions& h = s.shadowing;
  all({double(h.enabled), double(h.environment), h.custom.clear_mean_db, h.custom.clear_sigma_db,
       h.custom.shadowed_mean_db, h.custom.shadowed_sigma_db, h.custom.enter, h.custom.leave, h.frame_m,
       h.transition_m, h.correlation_m, h.obstacle_distance_m});
  all({double(p.model), double(p.reflection_order), p.max_range_m, p.max_incidence_rad,
       double(p.ground_reflection), double(p.diffraction), double(p.diffuse), double(p.through_foliage)});
  all({p.edges.max_range_m, p.edges.max_bending_rad, p.edges.max_loss_db, p.edges.max_clear_nu,
       double(p.edges.max_paths), double(p.edges.edges.terrain), double(p.edges.edges.free_edges),
       p.edges.edges.min_turn_rad});
  const propagation::DiffuseOptions& d = p.scattering;
  all({double(d.rays), d.scattering_coefficient, d.wall_reflectance, double(d.lobe_exponent),
       d.lowest_elevation_rad, d.max_range_m, d.min_power_db, d.class_m, double(d.max_paths)});
  return texts;
}

// "a.b.c" and a value as YAML on one line.
std::string nested(const std::string& path, const std::string& value) {
  std::string open;
  std::string close;
  std::stringstream names(path);
  for (std::string name; std::getline(names, name, '.');) {
    if (!open.empty()) {
      open += "{";
      close += "}";
    }
    open += name + ": ";
  }
  return open + value + close;
}

ReceiverConfig profile_with(const std::string& line) {
  return parse_profile("description: d\n" + line + "\n", "p.yaml").receiver;
}

TEST(ReceiverKeys, DefaultsOfTheTableAreThoseOfTheStructs) {
  const std::vector<std::string> plain = fields(ReceiverConfig());
  for (const ScenarioKey& key : profile_keys()) {
    if (key.default_value.empty()) continue;
    EXPECT_EQ(fields(profile_with(nested(key.path, key.default_value))), plain) << key.path;
  }
}

// A value that is allowed, and not the default.
std::string another(const ScenarioKey& key) {
  static const std::map<std::string, std::string> kWords{{"true", "false"},
                                                         {"false", "true"},
                                                         {"sigma", "cn0"},
                                                         {"patch", "phone"},
                                                         {"woodland", "slant_path"},
                                                         {"urban", "suburban"},
                                                         {"early_late_power", "coherent"},
                                                         {"specular", "mirror"},
                                                         {"", "[[0, -5, -5], [90, 3, -10]]"},
                                                         {"none", "20"}};
  const auto word = kWords.find(key.default_value);
  if (word != kWords.end()) return word->second;
  const double value = std::stod(key.default_value);
  const bool whole = key.default_value.find_first_of(".e") == std::string::npos;
  if (value == 0) return whole ? "1" : "0.1";
  return whole && value > 1 ? fmt::format("{}", static_cast<int>(value) - 1)
                            : fmt::format("{:.9g}", value * 0.75);
}

TEST(ReceiverKeys, EachKeySetsAFieldOfItsOwn) {
  const std::vector<std::string> plain = fields(ReceiverConfig());
  std::map<std::size_t, std::string> setter;
  for (const ScenarioKey& key : profile_keys()) {
    std::string value = another(key);
    // Where the next value below is out of range.
    if (key.path == "propagation.reflection_order") value = "2";
    if (key.path == "min_satellites") value = "6";
    if (key.path == "signal.fll.noise_factor") value = "1.5";
    if (key.path == "signal.front_end_bandwidth_hz") value = "4e6";
    if (key.path == "clock.bias_s") value = "0.01";
    if (key.path == "clock.drift" || key.path == "clock.drift_walk") value = "1e-6";
    std::vector<std::string> changed;
    ASSERT_NO_THROW(changed = fields(profile_with(nested(key.path, value)))) << key.path << ": " << value;
    std::vector<std::size_t> where;
    for (std::size_t i = 0; i < plain.size(); ++i) {
      if (changed[i] != plain[i]) where.push_back(i);
    }
    ASSERT_EQ(where.size(), 1U) << key.path << ": " << value;
    const auto [other, fresh] = setter.emplace(where.front(), key.path);
    // Two ways to name an antenna.
    EXPECT_TRUE(fresh || key.path == "signal.antenna_rows") << key.path << " and " << other->second;
  }
  EXPECT_EQ(setter.size(), plain.size()) << "a field that no key sets";
}

TEST(ReceiverKeys, ScenariosHaveThoseOfProfiles) {
  std::set<std::string> paths;
  for (const ScenarioKey& key : scenario_keys()) paths.insert(key.path);
  for (const ScenarioKey& key : profile_keys())
    EXPECT_EQ(paths.count("receivers[]." + key.path), 1U) << key.path;
}

TEST(ScenarioKeys, DocumentationHasTheSameTable) {
  std::vector<std::string> rows;
  std::istringstream page(read_text(kSource / "docs/scenario.md"));
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("| `", 0) == 0) rows.push_back(line);
  }
  ASSERT_EQ(rows.size(), scenario_keys().size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ScenarioKey& key = scenario_keys()[i];
    EXPECT_EQ(rows[i],
              "| `" + key.path + "` | " + key.unit + " | " + key.default_value + " | " + key.meaning + " |");
  }
}

TEST(ScenarioKeys, HelpTextNamesEveryKeyUnitAndDefault) {
  const std::string help = format_scenario_keys();
  for (const ScenarioKey& key : scenario_keys()) {
    EXPECT_THAT(help, HasSubstr(key.path));
    EXPECT_THAT(help, HasSubstr(key.meaning));
  }
  EXPECT_THAT(help, HasSubstr("[deg, default 10]"));
}

}  // namespace
}  // namespace canyon::simulation
