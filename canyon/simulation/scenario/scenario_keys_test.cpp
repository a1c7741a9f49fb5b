#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/documented.hpp"
#include "tests/support/option_values.hpp"
#include "tests/support/program.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::simulation::scenario_keys_test {
namespace {

using canyon::test::another_value;
using canyon::test::bad_values;
using canyon::test::nested;
using canyon::test::read_bytes;
using canyon::test::run_program;
using options::Node;
using test::error_of;
using test::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::filesystem::path kSource = canyon_source_dir;

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

// Scenarios that together contain every key.
std::vector<std::string> scenarios_with_every_key() {
  const std::string propagation =
      "{model: specular, reflection_order: 1, max_range_m: 300, max_incidence_deg: 89, ground_reflection: "
      "false, diffraction: {enabled: true, max_range_m: 200, edge_radius_m: 1, "
      "terrain: true}, diffuse: {enabled: true, scattering_coefficient: 0.3, bounces: 2, max_range_m: 200, "
      "scattering_angle_sigma_rad: 0.2}, through_foliage: true, "
      "retrace_interval_s: 2, "
      "retrace_distance_m: 0.5}";
  const std::string noise =
      "{enabled: true, theta_per_s: 0.02, mu_m: 0, sigma_m_per_sqrt_s: 0.2, doppler_sigma_hz: 0.1, "
      "drift: {enabled: false}}";
  const std::string shadowing =
      "{enabled: true, environment: urban, skyline: {obstacle_fraction: 0.1, height_m: 6}, frame_m: 4}";
  return {
      "city: {facades: {mix: europe, named: keep}, roofs_m: 2, mesh: f, origin: {latitude_deg: 1, "
      "longitude_deg: 2, "
      "height_m: 3}, "
      "offset: {east_m: 1, north_m: 2, up_m: 3}, heading_deg: 4, scale: 1, up_axis: Z, terrain_names: [a, "
      "b]}\n"
      "sky: {navigation: [f], systems: [GPS], allow_stale: true}\n"
      "start: {week: 2051, tow: 1}\n"
      "duration_s: 10\nrate_hz: 5\nseed: 3\n"
      "trajectory: {file: f, format: csv, height_above_terrain_m: 2, columns: {time: a, unix_time: b, "
      "gps_week: c, gps_cycle: m, gps_tow: d, latitude: e, longitude: g, height: h, height_msl: i, x: j, y: "
      "k, z: l}}\n"
      "outputs: {epochs_csv: true, satellites_csv: true, signals_csv: true, paths_csv: true, nmea: true, "
      "gps_input: true, hil_gps: true, gps_raw_int: true, gps_rtcm_data: true, rtcm: true, ubx: {enabled: "
      "true, generation: m10}, sbf: true, "
      "rinex_observation: true, "
      "rinex4_observation: true, "
      "rinex_navigation: true, imu: true, wheels: true, barometer: true, magnetometer: true, sensors_npz: "
      "true, highres_imu: true, kml: true, geojson: "
      "true, gpx: true, mcap: true, "
      "samples: true, "
      "pictures: true}\n"
      "map: {motion: driving, speed_mps: 5}\n"
      "samples: {bands: [L1, E5a], rate_hz: 2e6, intermediate_hz: 5e5, bandwidth_hz: 1e6, real_valued: true, "
      "noise: "
      "false, format: 2bit, noise_level: 0.5}\n"
      "live: {poses: [{from: 'stdin:', format: mavlink, id: a, receivers: [rover], messages: [SIM_STATE], "
      "axes: "
      "ned, body: frd, east_m: 1, north_m: 2, up_m: 3, heading_deg: 4, scale: 5, timeout_s: 1, smoothing_s: "
      "0.1}], streams: [{receiver: rover, format: ubx, to: 'pty:', rate_hz: 5, latency_s: 0.1, link_baud: "
      "57600, jitter_s: "
      "0.01, ephemerides: false, virtual_station: true, generation: m8}], "
      "clock: stamps, speed: 2, wait_s: 0.1, stagger: true, resume: true, control: 'tcp://127.0.0.1:7878', "
      "changes: true}\n"
      "propagation: " +
          propagation + "\nnoise: " + noise + "\nshadowing: " + shadowing + "\nsurroundings: dense\n",
      "streets: {enabled: true, region: east_asia, class: arterial, lanes: 2, vehicles_per_km: 30, "
      "vehicle_fractions: [car=80, bus=20], speed_mps: 9, cycle_s: 80, red_phase_s: 30, trees_per_km: 10, "
      "signs_per_km: "
      "20, awnings_per_km: 30, footbridges_per_km: 1, antenna_height_m: 2, azimuth_deg: 45}\n"
      "city: {facades: {fractions: [tile=25, metal=75]}, georeference: {sigma_m: 2, heading_sigma_deg: "
      "0.5}, synthetic: {blocks_east: 2, blocks_north: "
      "2, block_size_m: 50, street_width_m: 20, "
      "min_height_m: 10, "
      "max_height_m: 30, seed: 2}}\n"
      "sky: {nominal: true, errors: {enabled: true, orbit_clock_m: [GPS=1], orbit_clock_time_s: 600, "
      "ionosphere_fraction: 0.4, ionosphere_time_s: 600, ionosphere_length_m: 1e6, solar_flux_sfu: 150, "
      "troposphere_m: 0.1, "
      "troposphere_time_s: 600, troposphere_length_m: 1e5}}\n"
      "start: 2026-06-01T12:00:00Z\noutputs: [nmea, kml]\n"
      "trajectory: {attitude: aircraft, waypoints: [{latitude_deg: 1, longitude_deg: 2, height_m: 3, "
      "height_above_terrain_m: 4, speed_mps: 5, hold_s: 6}, {east_m: 1, north_m: 2, up_m: 3}], "
      "speed_mps: 3, hold_s: 1, acceleration_mps2: 2}\n"
      "receivers: [{name: a, profile: paper, independent_noise: true, tracks: [L1CA, E5a], exclude_signals: "
      "[GPS-IIR], concurrent_systems: beidou_by_b1c, uses: [E5a], ionosphere_sigma_m: 4, sigma_factor: "
      "[GLONASS=2], "
      "smoothing: {method: hatch, "
      "window_s: 60}, biases: {code_m: [GLONASS=3], glonass_channel_m: 0.1, drift_sigma_m: 0.2, "
      "drift_time_s: "
      "600}, spoofing_check: {enabled: true, gain_db: 2, jump_m: 100, hold_s: 10}, combination: "
      "ionosphere_free, covariance_by_residuals: true, "
      "elevation_mask_deg: 5, cn0_mask_dbhz: 6, min_satellites: 4, "
      "max_pdop: 25, max_iterations: 20, convergence_m: 1e-6, weights: {weighting: cn0, elevation_a_m: 0.4, "
      "elevation_b_m: 0.5}, raim: {enabled: true, false_alarm: 1e-4, "
      "max_exclusions: 2}, corrections: {from: b, max_age_s: 30, rate_hz: 1, latency_s: 0.8, "
      "jitter_s: 0.2, loss_fraction: 0.01, range_m: 5000, outages_s: [20, 40], station_error_m: [1, 2, 3], "
      "virtual_station: true}, rtk: "
      "{enabled: true, integers: hold, "
      "ratio: 2, min_success: 0.9, fix_glonass: true, ionosphere_gradient: 1e-6, troposphere_gradient: "
      "1e-7}, "
      "dead_reckoning: {enabled: "
      "true, non_holonomic: false, sideways_mps: 0.2, upwards_mps: 0.2, alignment_speed_mps: 4, gate_sigmas: "
      "5, error_distance_m: 20, error_height_distance_m: 200, error_time_s: 30, range_error_sigma_m: 1, "
      "divergence_timeout_s: "
      "10, max_sigma_m: 50}, position_filter: {enabled: "
      "true, "
      "acceleration_horizontal: 1, "
      "acceleration_vertical: 0.4, clock_frequency_density: 1e-19, clock_drift_density: 1e-19, coast_s: 3, "
      "max_sigma_m: 90, error_correlation_s: 2}, signal: {enabled: true, antenna: survey, "
      "link: "
      "{above_minimum_db: 2, "
      "antenna_temperature_k: 200, noise_figure_db: 3, implementation_loss_db: 2}, offset_db: "
      "[GPS=1, BeiDou-2&BeiDou-GEO=-4], installation: roof, installation_db: 3, installation_sigma_db: 2, "
      "satellite_sigma_db: 1, "
      "strength: {slabs: false}, shadowing: " +
          shadowing +
          ", "
          "front_end_bandwidth_hz: "
          "4e6, wide_front_end_bandwidth_hz: 30e6, front_end_compression_dbm: -20, dll: {discriminator: "
          "dot_product, "
          "spacing_chips: 0.2, spacings_chips: [E1=0.1], loop_bandwidth_hz: 0.5, loop_bandwidths_hz: "
          "[E1=0.2], narrow_below_dbhz: 30, integration_s: 0.01, "
          "peak_check_s: 2}, pll: "
          "{loop_bandwidth_hz: 10, loop_bandwidths_hz: [L5=5], "
          "integration_s: 0.01}, fll: {loop_bandwidth_hz: 4, loop_bandwidths_hz: [L5=1], integration_s: "
          "0.01}, lock: "
          "{acquisition_threshold_dbhz: 20, tracking_threshold_dbhz: 15, cold_acquisition_s: 10, "
          "reacquisition_s: 2, hold_s: 3, memory_s: 100, warm_start: true}, phase_threshold_dbhz: 27, "
          "cn0_sigma_db: 0.5, cn0_averaging_s: 1, cn0_step_db: 1, loop_noise: false}, ionosphere: true, "
          "troposphere: true, "
          "orbit_errors: true, "
          "correct_ionosphere: true, "
          "correct_troposphere: true, lever_arm: {forward_m: 1, left_m: 2, up_m: 3}, "
          "clock: {bias_s: 1e-3, drift: 1e-7, drift_walk: 1e-9, time_tag_sigma_s: 1e-8}, propagation: " +
          propagation +
          ", fix_noise: {horizontal_m: 1, vertical_m: 2, horizontal_mps: 0.1, vertical_mps: 0.2}, noise: " +
          noise +
          "}, {name: b, fixed: {latitude_deg: 1, longitude_deg: 2, height_m: 30}, signal: {antenna_rows: "
          "[[0, -5, -5], [90, 3, -10]], antenna_lower_rows: [[0, -6, "
          "-6], [90, 2, "
          "-11]]}}, {name: c, fixed: {east_m: 1, north_m: 2, up_m: 30}}]\n",
      // NOLINTNEXTLINE(bugprone-suspicious-missing-comma)
      "city: {open: true, origin: {latitude_deg: 1, longitude_deg: 2}}\nsky: {sp3: f}\n"
      "trajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n",
      "city: {osm: [f, f], terrain: f, geoid_undulation_m: 2, bbox: [1, 2, 3, 4], lod: 2, crs: EPSG:25832, "
      "level_height_m: 3, "
      "default_height_m: 9, heights: [house=7], foliage: true, tunnels: true, bridges: true, "
      "terrain_margin_m: 100, "
      "terrain_spacing_m: 10, tree_height_m: 9, tree_crown_m: 4, wood_height_m: 10}\n"
      "trajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n",
      "city: {open: true, origin: {latitude_deg: 1, longitude_deg: 2}}\n"
      "trajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n"
      "sensors: {imu: {profile: tactical, rate_hz: 200, axes: frd, position: {forward_m: 1, left_m: 2, up_m: "
      "3}, orientation: {roll_deg: 1, pitch_deg: 2, yaw_deg: 3}, gyroscope: {angle_random_walk_deg_sqrt_h: "
      "0.1, bias_instability_deg_h: 1, rate_random_walk_deg_h_sqrt_h: 1, turn_on_bias_deg_s: 0.1, scale_ppm: "
      "100, misalignment_deg: 0.1, g_sensitivity_deg_h_g: 1, resolution_deg_s: 0.01, range_deg_s: 500, "
      "temperature_deg_h_k: 1, scale_temperature_ppm_k: 5}, "
      "accelerometer: {velocity_random_walk_mps_sqrt_h: 0.1, bias_instability_mg: 0.1, "
      "acceleration_random_walk_mg_sqrt_h: 0.1, turn_on_bias_mg: 1, scale_ppm: 100, misalignment_deg: 0.1, "
      "resolution_mg: 0.1, range_g: 8, temperature_mg_k: 0.1, scale_temperature_ppm_k: 5}, temperature: "
      "{air_c: 10, warming_k: 5, "
      "warming_time_s: 60}, vibration: [{frequency_hz: 80, bandwidth_hz: 1, acceleration_mps2: 2, "
      "rate_deg_s: "
      "3}], time_offset_s: 0.01, time_jitter_s: 0.001, loss_fraction: 0.01, frozen: [{from_s: 1, until_s: "
      "2}]}, "
      "wheels: "
      "{rate_hz: 5, track_m: 1, tick_m: 0.1, "
      "scale: 0.01, slip: 0.01, slip_time_s: 2, direction: false, slips: [{from_s: 1, until_s: 2, factor: "
      "3}]}, barometer: {rate_hz: 50, "
      "position: {forward_m: 1, left_m: 2, up_m: 3}, sea_level_pressure_pa: 100000, sea_level_temperature_c: "
      "20, noise_pa: 2, turn_on_pa: 50, drift_pa: 10, airflow: -0.2, resolution_pa: 1, "
      "profile: bmp388, pressure_change_pa_h: 50, temperature_pa_k: 1}, "
      "magnetometer: {profile: rm3100, rate_hz: 20, axes: "
      "frd, orientation: {roll_deg: 1, pitch_deg: 2, yaw_deg: 3}, noise_ut: 0.1, bias_instability_ut: 0.1, "
      "hard_iron_ut: 5, soft_iron: 0.1, resolution_ut: 0.1, range_ut: 500, roadside_field_ut: 2}}\n",
      "city: {file: c.canyon, geoid: EGM96}\ntrajectory: {position: {latitude_deg: 1, longitude_deg: 2, "
      "height_m: 3}}\n",
      "city: {open: true, origin: {latitude_deg: 1, longitude_deg: 2}}\n"
      "trajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n"
      "faults: [{jamming: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}, beam: {width_deg: 60, "
      "azimuth_deg: 10, elevation_deg: 5}, polarisation: left, emissions: [{shape: "
      "chirp, "
      "centre_hz: 1.5e9, width_hz: 1e6, period_s: 1e-5, power_dbm: 3}]}}, {jamming: {waypoints: [{east_m: 1, "
      "north_m: 2, up_m: 3}, {latitude_deg: 1, longitude_deg: 2, height_m: 3}], speed_mps: 3, preset: "
      "privacy_l1}}, {spoofing: {position: {east_m: 1, north_m: 2, up_m: 3}, beam: {width_deg: 60, "
      "azimuth_deg: 10, elevation_deg: 5}, kind: meaconing, shows: {position: {east_m: "
      "1, "
      "north_m: 2, up_m: 3}}, pull_off: {hold_s: 1, rate_mps: 2, acceleration_mps2: 1, east_m: 1, north_m: "
      "2, up_m: "
      "3, clock_m: 4}, carrier: held, delay_s: 1e-6, advantage_db: 4, ramp_s: 2, ramp_from_db: 10, "
      "satellites: "
      "[GPS], signals: [L1CA], mask_deg: 3}}, {spoofing: {waypoints: [{east_m: 1, north_m: 2, up_m: 3}, "
      "{latitude_deg: "
      "1, longitude_deg: 2, height_m: 3}], speed_mps: 3, power_dbm: 1, shows: {waypoints: [{east_m: 1, "
      "north_m: 2, "
      "up_m: 3}, {latitude_deg: 1, longitude_deg: 2, height_m: 3}], speed_mps: 2}}}, {spoofing: {position: "
      "{latitude_deg: 1, longitude_deg: 2, height_m: 3}, shows: {position: {latitude_deg: 1, longitude_deg: "
      "2, "
      "height_m: 3}}}}, {jamming: {position: {east_m: 1, north_m: 2, up_m: 3}, preset: privacy_l1}}, {name: "
      "f, from_s: 1, until_s: 2, receivers: [rover], outage: {satellites: [G05, Galileo], "
      "mode: "
      "unhealthy}}, {from_s: 1, duration_s: 3, ephemeris: {satellites: [G05], radial_m: 1, along_m: 2, "
      "cross_m: 3, "
      "radial_mps: 1, along_mps: 2, cross_mps: 3, clock_offset_s: 1e-7, clock_drift: 1e-10, clock_in: "
      "signal}}, "
      "{clock: {jump_s: 1e-3, drift: 1e-8}}, {time: {weeks: -1024, utc_s: 1}}, {antenna: {azimuth_from_deg: "
      "1, "
      "azimuth_to_deg: 2, elevation_from_deg: 3, elevation_to_deg: 4, loss_db: 5, stage: after, "
      "period_s: 3, on_s: 1}}, {restart: "
      "{kind: warm, search_s: 2, ephemeris_s: 20}}, {fix: {stuck: true, late_s: 1, repeat: 2, drop_fraction: "
      "0.1, "
      "east_m: 1, north_m: 2, up_m: 3, forward_m: 1, after_outage_s: 5, growth_s: 4, "
      "state: fixed, accuracy_m: 0.1, accuracy_factor: 2, without_satellites: true}}, {force: {fix: float, "
      "horizontal_m: 0.2, vertical_m: "
      "0.3}}, "
      "{scintillation: {satellites: [GPS], s4: 0.6, "
      "sigma_phi_rad: "
      "0.2, correlation_s: 1, phase_correlation_s: 3}}]\n",
      "city: {synthetic: {}}\nsky: {frozen: {satNum: 1, satAzimuth: 1, satElevation: 1}}\ninterval_s: 60\n"
      "trajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n",
      "city: {tiles: {file: f, error_m: 2, bbox: [1, 2, 3, 4], margin_m: 90, max_tiles: 9, allow_external: "
      "true, "
      "cache: c, timeout_s: 5}}\nstart: 2026-06-01T12:00:00Z\n"
      "trajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n",
      "city: {tiles: {url: 'https://example.org/tileset.json'}}\nstart: 2026-06-01T12:00:00Z\n"
      "trajectory: {position: {latitude_deg: 1, longitude_deg: 2, height_m: 3}}\n"};
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
    EXPECT_TRUE(table.insert(key.path).second) << key.path << " is given twice in the table";
    EXPECT_FALSE(key.meaning.empty()) << key.path;
  }
  EXPECT_EQ(used, table);
}

// --- every key, through every reader
// ---------------------------------------------------------------------------------

// The first scalar or list at a key's path, or null.
Node::Entry* at_path(Node& node, const std::string& path) {
  const std::size_t end = path.find_first_of(".[");
  const std::string name = path.substr(0, end);
  for (Node::Entry& entry : node.entries) {
    if (entry.key != name) continue;
    if (end == std::string::npos) return entry.value.kind == Node::Kind::Mapping ? nullptr : &entry;
    if (path[end] == '.') return at_path(entry.value, path.substr(end + 1));
    for (Node& item : entry.value.items) {
      if (Node::Entry* found = at_path(item, path.substr(path.find('.', end) + 1))) return found;
    }
  }
  return nullptr;
}

void expect_reported(const InputError& error, const options::Key& key, const std::string& file, int line) {
  const std::string name = key.path.substr(key.path.find_last_of('.') + 1);
  EXPECT_EQ(error.file(), file) << key.path << ": " << error.what();
  EXPECT_EQ(error.line(), line) << key.path << ": " << error.what();
  EXPECT_THAT(error.problem(), StartsWith(name + ": ")) << key.path;
  EXPECT_NE(error.hint(), "") << key.path << ": " << error.what();
}

TEST(EveryKey, IsRefusedOutsideItsRangeWithFileLineAndCure) {
  const TemporaryFolder folder;
  (void)folder.write("f", "");
  (void)folder.write("c.canyon", "");
  options::Document document;
  document.file = folder / "s.yaml";
  document.known = scenario_description().paths();
  std::vector<Node> roots;
  for (const std::string& text : scenarios_with_every_key()) {
    roots.push_back(options::parse_yaml(text, document, ""));
  }
  int refused = 0;
  for (const options::Key& key : scenario_keys()) {
    for (const std::string& bad : bad_values(key)) {
      bool found = false;
      for (Node root : roots) {
        Node::Entry* entry = at_path(root, key.path);
        if (entry == nullptr) continue;
        found = true;
        entry->value = options::parse_yaml("bad: " + bad, document, "").entries[0].value;
        Scenario scenario;
        expect_reported(error_of([&] { options::read(root, document, scenario); }), key,
                        (folder / "s.yaml").string(), entry->line);
        ++refused;
        break;
      }
      EXPECT_TRUE(found) << key.path;
    }
  }
  EXPECT_GT(refused, 400);
}

TEST(EveryKey, IsReadByItsFormerNameToo) {
  const TemporaryFolder folder;
  (void)folder.write("f", "");
  (void)folder.write("c.canyon", "");
  options::Document document;
  document.file = folder / "s.yaml";
  document.set_keys(scenario_description());
  std::set<std::string> untested;
  for (const auto& [name, path] : scenario_description().former_names) untested.insert(name);
  EXPECT_GT(untested.size(), 20U);
  for (const std::string& text : scenarios_with_every_key()) {
    const Node root = options::parse_yaml(text, document, "");
    Scenario expected;
    options::read(root, document, expected);
    for (const auto& [name, path] : scenario_description().former_names) {
      Node former = root;
      Node::Entry* entry = at_path(former, path);
      if (entry == nullptr) continue;
      entry->key = name.substr(name.find_last_of('.') + 1);
      Scenario scenario;
      ASSERT_NO_THROW(options::read(former, document, scenario)) << name;
      EXPECT_EQ(options::exact_text(scenario), options::exact_text(expected)) << name;
      untested.erase(name);
    }
  }
  EXPECT_THAT(untested, ::testing::IsEmpty());
}

TEST(EveryKey, OfAReceiverIsRefusedByProfilesAndHostsToo) {
  for (const options::Key& key : profile_keys()) {
    for (const std::string& bad : bad_values(key)) {
      const std::string line = "\n" + nested(key.path, bad) + "\n";
      expect_reported(error_of([&] { (void)parse_profile("description: d" + line, "p.yaml"); }), key,
                      "p.yaml", 2);
      expect_reported(error_of([&] { (void)parse_live_config("seed: 1" + line, "host"); }), key, "host", 2);
    }
  }
}

// A change of any field of a receiver appears in exact_text(), and so in the key of a heat map's store.
ReceiverConfig profile_with(const std::string& line) {
  return parse_profile("description: d\n" + line + "\n", "p.yaml").receiver;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(ReceiverKeys, DefaultsOfTheTableAreThoseOfTheStructs) {
  const std::string plain = options::exact_text(ReceiverConfig());
  for (const ScenarioKey& key : profile_keys()) {
    if (key.default_value.empty()) continue;
    EXPECT_EQ(options::exact_text(profile_with(nested(key.path, key.default_value))), plain) << key.path;
  }
}

TEST(ReceiverKeys, EachKeySetsAFieldOfItsOwn) {
  const std::vector<std::string> plain = lines_of(options::exact_text(ReceiverConfig()));
  const auto world_entry = std::count_if(plain.begin(), plain.end(), [](const std::string& line) {
    return line.starts_with("signal.shadowing.");  // of a scenario, not of a profile
  });
  std::set<std::string> changed_by_any;
  for (const ScenarioKey& key : profile_keys()) {
    std::string value = another_value(key);
    if (key.path == "signal.lock.acquisition_threshold_dbhz") value = "30";
    std::vector<std::string> changed;
    ASSERT_NO_THROW(changed = lines_of(options::exact_text(profile_with(nested(key.path, value)))))
        << key.path << ": " << value;
    ASSERT_EQ(changed.size(), plain.size());
    std::vector<std::string> where;
    for (std::size_t i = 0; i < plain.size(); ++i) {
      if (changed[i] != plain[i]) where.push_back(plain[i].substr(0, plain[i].find(':')));
    }
    // An antenna is its name and its rows.
    ASSERT_EQ(where.size(), key.path == "signal.antenna"             ? 3U
                            : key.path.starts_with("signal.antenna") ? 2U
                                                                     : 1U)
        << key.path << ": " << value;
    EXPECT_TRUE(std::find(where.begin(), where.end(), key.path) != where.end()) << key.path;
    changed_by_any.insert(where.begin(), where.end());
  }
  EXPECT_EQ(changed_by_any.size() + static_cast<std::size_t>(world_entry), plain.size())
      << "a field that no key sets";
}

TEST(ReceiverKeys, ScenariosAndHostsHaveThoseOfProfiles) {
  const std::vector<std::string> scenario = scenario_description().paths();
  const std::vector<std::string> live = options::describe<RunnerConfig>().paths();
  for (const ScenarioKey& key : profile_keys()) {
    EXPECT_THAT(scenario, ::testing::Contains("receivers[]." + key.path));
    EXPECT_THAT(live, ::testing::Contains(key.path));
  }
}

TEST(ScenarioKeys, DocumentationHasTheSameTable) {
  canyon::test::expect_documented("keys.md", "keys of a scenario", options::markdown(scenario_keys()));
}

TEST(ScenarioKeys, HelpTextNamesEveryKeyUnitAndDefault) {
  const std::string help = options::plain_text(scenario_keys());
  for (const ScenarioKey& key : scenario_keys()) {
    EXPECT_THAT(help, HasSubstr(key.path));
    EXPECT_THAT(help, HasSubstr(key.meaning));
  }
  EXPECT_THAT(help, HasSubstr("[deg, default 10]"));
}

// --- written back, and the schema
// ---------------------------------------------------------------------------------

// The examples of the repository with the files that they name, all empty; a scenario of each profile; and
// those with every key.
std::map<std::string, std::string> all_scenarios(const TemporaryFolder& folder) {
  for (const char* sub :
       {"hongkong", "urbannav-tst-20190428", "urbannav-tst-20210517", "berlin-potsdamer-platz"}) {
    std::filesystem::create_directories(folder / sub);
  }
  for (const char* name :
       {"f", "c.canyon", "hongkong/buildings.dae", "urbannav-tst-20190428/hksc1180.19n",
        "urbannav-tst-20190428/hksc1180.19b", "urbannav-tst-20190428/groundTruth_TST.csv",
        "urbannav-tst-20210517/hksc137c.21n", "urbannav-tst-20210517/hksc137c.21f",
        "urbannav-tst-20210517/UrbanNav_TST_GT.txt", "berlin-potsdamer-platz/buildings.city.json",
        "berlin-potsdamer-platz/brdc1580.16n", "berlin-potsdamer-platz/brdc1580.16g",
        "berlin-potsdamer-platz/truth.csv"}) {
    (void)folder.write(name, "");
  }
  std::map<std::string, std::string> texts;
  for (const auto& entry : std::filesystem::directory_iterator(kSource / "examples")) {
    if (entry.path().extension() != ".yaml" || entry.path().filename() == "recordings.yaml") continue;
    texts[entry.path().filename().string()] = read_bytes(entry.path());
  }
  for (const BuiltInProfile& profile : built_in_profiles()) {
    texts[std::string(profile.name)] = fmt::format(
        "city: {{synthetic: {{}}}}\nstart: 2026-06-01T12:00:00.123456789Z\nrate_hz: 1/60\n"
        "trajectory: {{position: {{east_m: 0.1, north_m: 2, up_m: 3}}}}\nreceivers: [{{profile: {}}}]\n",
        profile.name);
  }
  const std::vector<std::string> whole = scenarios_with_every_key();
  for (std::size_t i = 0; i < whole.size(); ++i) texts[fmt::format("every key {}", i)] = whole[i];
  return texts;
}

TEST(ScenarioYaml, ReadsBackToTheBit) {
  const TemporaryFolder folder;
  const TemporaryFolder far_away;
  for (const auto& [name, text] : all_scenarios(folder)) {
    const Scenario scenario = parse_scenario(text, folder / "s.yaml");
    const std::string shown = scenario_yaml(scenario);
    Scenario again;
    ASSERT_NO_THROW(again = parse_scenario(shown, far_away / "t.yaml")) << name << "\n" << shown;
    EXPECT_EQ(options::exact_text(again), options::exact_text(scenario)) << name;
    EXPECT_EQ(scenario_yaml(again), shown) << name;
    EXPECT_EQ(again.warnings, scenario.warnings) << name;
    ASSERT_EQ(again.trajectory.waypoints.size(), scenario.trajectory.waypoints.size()) << name;
    for (std::size_t i = 0; i < again.trajectory.waypoints.size(); ++i) {
      EXPECT_EQ(again.trajectory.waypoints[i].latitude_rad, scenario.trajectory.waypoints[i].latitude_rad);
      EXPECT_EQ(again.trajectory.waypoints[i].longitude_rad, scenario.trajectory.waypoints[i].longitude_rad);
      EXPECT_EQ(again.trajectory.waypoints[i].height_m, scenario.trajectory.waypoints[i].height_m);
    }
    EXPECT_EQ(again.start, scenario.start) << name;
  }
}

// A tree as JSON, plain words as YAML 1.2's core schema resolves them.
std::string json_of(const Node& node) {
  std::string text;
  switch (node.kind) {
    case Node::Kind::Empty:
      return "null";
    case Node::Kind::Scalar: {
      const bool bare = node.text == "true" || node.text == "false" || parse_double(node.text).has_value();
      if (bare) return node.text.front() == '.' ? "0" + node.text : node.text;
      for (const char c : node.text)
        text += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
      return "\"" + text + "\"";
    }
    case Node::Kind::List:
      for (const Node& item : node.items) text += (text.empty() ? "" : ",") + json_of(item);
      return "[" + text + "]";
    case Node::Kind::Mapping:
      for (const Node::Entry& entry : node.entries) {
        text += fmt::format("{}\"{}\":{}", text.empty() ? "" : ",", entry.key, json_of(entry.value));
      }
      return "{" + text + "}";
  }
  return text;
}

// Reference: Python's jsonschema (Debian: python3-jsonschema).
TEST(ScenarioSchema, AcceptsTheExamplesAndRefusesBrokenOnes) {
  if (run_program("python3 -c 'import jsonschema' 2>/dev/null").status != 0) {
    GTEST_SKIP() << "SKIPPED: the judge python3-jsonschema is not installed here";
  }
  const TemporaryFolder folder;
  options::Document document;
  const std::string ok = "city: {synthetic: {}}\n";
  std::map<std::string, std::string> good = all_scenarios(folder);
  good["interval"] = ok + "interval_s: 60\n";
  good["empty section"] = ok + "receivers: [{signal: }]\n";
  good["none"] = ok + "receivers: [{max_pdop: none}]\n";
  const std::vector<std::string> broken{
      "sky: {nominal: true}\n",
      ok + "sed: 1\n",
      ok + "rate_hz: 0\n",
      ok + "rate_hz: fast\n",
      ok + "rate_hz: 1\ninterval_s: 1\n",
      ok + "interval_s: 0\n",
      ok + "receivers: {name: a}\n",
      ok + "faults: [{from_s: 1}]\n",
      ok + "faults: [{outage: {}, clock: {}}]\n",
      ok + "faults: [{until_s: 1, duration_s: 1, outage: {}}]\n",
      ok + "receivers: []\n",
      ok + "receivers: [{elevation_mask_deg: 90}]\n",
      ok + "receivers: [{elevation_mask_deg: ten}]\n",
      ok + "receivers: [{min_satellites: 4.5}]\n",
      ok + "receivers: [{signal: {dll: {discriminator: doubledelta}}}]\n",
      ok + "receivers: [{signal: {antenna: patch, antenna_rows: [[0, 1, 2]]}}]\n",
      ok + "receivers: [{noise: {enabled: perhaps}}]\n",
      ok + "receivers: [{clock: 5}]\n",
      ok + "sky: {nominal: true, sp3: f}\n",
      ok + "start: {week: 2051}\n",
      "city: {}\n",
      "city: {open: true, synthetic: {}}\n",
      "city: {open: true, origin: {latitude_deg: 91, longitude_deg: 1}}\n",
      "city: {open: true, origin: {latitude_deg: 1}}\n",
  };
  std::string cases = "{\"good\": {";
  for (const auto& [name, text] : good) {
    cases += fmt::format("{}\"{}\": {}", cases.back() == '{' ? "" : ",\n", name,
                         json_of(options::parse_yaml(text, document, "")));
  }
  cases += "}, \"broken\": {";
  for (const std::string& text : broken) {
    Node name;
    name.kind = Node::Kind::Scalar;
    name.text = text.substr(0, text.size() - 1);
    std::replace(name.text.begin(), name.text.end(), '\n', ' ');
    cases += fmt::format("{}{}: {}", cases.back() == '{' ? "" : ",\n", json_of(name),
                         json_of(options::parse_yaml(text, document, "")));
  }
  (void)folder.write("judged.json", cases + "}}");
  (void)folder.write("schema.json", options::json_schema(scenario_description(), "scenario"));
  (void)folder.write("judge.py", R"(
import json, jsonschema
schema, judged = json.load(open('schema.json')), json.load(open('judged.json'))
jsonschema.Draft7Validator.check_schema(schema)
judge = jsonschema.Draft7Validator(schema)
for name, scenario in judged['good'].items():
    for error in judge.iter_errors(scenario):
        print('refused:', name, list(error.absolute_path), error.message[:200])
for name, scenario in judged['broken'].items():
    if judge.is_valid(scenario): print('accepted:', name)
)");
  const auto verdict = run_program("cd '" + folder.path().string() + "' && python3 judge.py 2>&1");
  EXPECT_EQ(verdict.status, 0) << verdict.output;
  EXPECT_EQ(verdict.output, "");
}

TEST(ScenarioRate, IntervalsAndFractionsAreExact) {
  const auto rate = [](const std::string& line) {
    return parse_scenario("city: {synthetic: {}}\nstart: 2026-06-01T12:00:00Z\n" + line +
                              "\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n",
                          "s.yaml")
        .rate_hz.value();
  };
  // The simulation's step is 1 / rate in whole nanoseconds.
  for (const double interval_s : {0.001, 0.05, 0.1, 1.0 / 3, 7.0, 60.0, 86'400.0}) {
    const double ns = std::round(1e9 / rate(fmt::format("interval_s: {}", interval_s)));
    EXPECT_EQ(ns, std::round(interval_s * 1e9)) << interval_s;
  }
  EXPECT_EQ(std::round(1e9 / rate("rate_hz: 1/60")), 60e9);
  EXPECT_EQ(rate("rate_hz: 1/4"), 0.25);
  const auto fault = [&](const std::string& line) {
    return std::string(error_of([&] { rate(line); }).what());
  };
  EXPECT_THAT(fault("rate_hz: 1/0"), HasSubstr("'1/0' is not a number"));
  EXPECT_THAT(fault("rate_hz: -1/60"), HasSubstr("out of range; it is above 0"));
  EXPECT_THAT(fault("rate_hz: 1\ninterval_s: 1"), HasSubstr("conflicts with 'rate_hz'"));
  EXPECT_THAT(fault("duration_s: 1/2"), HasSubstr("is not a number"));
}

}  // namespace
}  // namespace canyon::simulation::scenario_keys_test
