#include "canyon/analysis/heatmap/engine/engine.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/option_values.hpp"

namespace canyon::heatmap {
namespace {

using propagation::Model;
using simulation::ReceiverConfig;
using test::another_value;
using test::CircularSky;
using test::nested;

Request some_request() {
  Request request;
  request.grid = Grid::covering(-40.3, -36.7, 55.7, 59.3, 2);
  request.grid.tile_size = 16;
  request.times = {CircularSky::kEpoch, CircularSky::kEpoch + std::chrono::minutes(30)};
  request.altitudes_m = {2, 15};
  return request;
}

simulation::Environment environment_with(std::map<gnss::System, gnss::Klobuchar> klobuchar = {}) {
  return {city::synthetic_city({}), std::make_shared<CircularSky>(std::vector{gnss::System::GPS}),
          std::move(klobuchar)};
}

TEST(HeatmapKey, ChangesWithEverythingThatValuesDependOn) {
  const Request request = some_request();
  const ReceiverConfig receiver;
  const simulation::Environment environment = environment_with();
  const auto key = [&](const Request& r, const ReceiverConfig& c, const std::string& input = "input") {
    return Heatmap(environment, c, r, input).key();
  };
  std::map<std::string, std::string> keys{{key(request, receiver), "as it is"}};
  EXPECT_EQ(keys.begin()->first.size(), 32U);
  EXPECT_EQ(key(request, receiver), keys.begin()->first);
  const auto expect_new = [&](const std::string& made, const std::string& what) {
    const auto [found, fresh] = keys.emplace(made, what);
    EXPECT_TRUE(fresh) << what << " gives the key of " << found->second;
  };
  expect_new(key(request, receiver, "other input"), "input");
  const simulation::Environment other = environment_with({{gnss::System::GPS, {{1e-8, 0, 0, 0}, {}}}});
  expect_new(Heatmap(other, receiver, request, "input").key(), "ionosphere");
  const auto with_request = [&](const char* what, const auto& change) {
    Request changed = request;
    change(changed);
    expect_new(key(changed, receiver), what);
  };
  with_request("west", [](Request& r) { r.grid.west_m += 1e-9; });
  with_request("south", [](Request& r) { r.grid.south_m += 1; });
  with_request("spacing", [](Request& r) { r.grid.spacing_m = 2.5; });
  with_request("columns", [](Request& r) { ++r.grid.columns; });
  with_request("rows", [](Request& r) { ++r.grid.rows; });
  with_request("tiles", [](Request& r) { r.grid.tile_size = 32; });
  with_request("area", [](Request& r) { r.area = Area{{{{0, 0}, {1, 0}, {0, 1}}}}; });
  with_request("area's corner", [](Request& r) { r.area = Area{{{{0, 0}, {1, 0}, {0, 2}}}}; });
  with_request("altitudes", [](Request& r) { r.altitudes_m = {2, 15, 30}; });
  with_request("times", [](Request& r) { r.times[1] = r.times[1] + std::chrono::nanoseconds(1); });
  with_request("layers", [](Request& r) { std::swap(r.layers[0], r.layers[1]); });
  with_request("draws", [](Request& r) { r.samples.samples = 65; });
  with_request("seed", [](Request& r) { r.samples.seed = 2; });
  options::Document document;
  document.known = options::describe(request).paths();
  for (const options::Key& each : options::describe(request).keys) {
    if (each.path == "motion") continue;  // only that of receivers with a filter may differ
    with_request(each.path.c_str(), [&](Request& r) {
      options::read(options::parse_yaml(nested(each.path, another_value(each)), document, ""), document, r);
    });
  }

  const auto with_receiver = [&](const char* what, const auto& change) {
    ReceiverConfig changed = receiver;
    changed.options.signal.enabled = true;  // its options count then
    change(changed.options, changed.propagation);
    expect_new(key(request, changed), what);
  };
  using Options = receiver::ReceiverOptions;
  using Paths = propagation::PropagationOptions;
  with_receiver("strength", [](Options&, Paths&) {});
  with_receiver("model", [](Options&, Paths& p) { p.model = Model::Mirror; });
  with_receiver("order", [](Options&, Paths& p) { p.reflection_order = 2; });
  with_receiver("range", [](Options&, Paths& p) { p.max_range_m = 299; });
  with_receiver("incidence", [](Options&, Paths& p) { p.max_incidence_rad = 1.5; });
  with_receiver("ground", [](Options&, Paths& p) { p.ground_reflection = true; });
  with_receiver("diffraction", [](Options&, Paths& p) { p.diffraction = true; });
  with_receiver("diffuse", [](Options&, Paths& p) { p.diffuse = true; });
  with_receiver("foliage", [](Options&, Paths& p) { p.through_foliage = true; });
  with_receiver("edges", [](Options&, Paths& p) { p.edges.edge_radius_m = 1; });
  with_receiver("edges of terrain", [](Options&, Paths& p) { p.edges.terrain = true; });
  with_receiver("scattering", [](Options&, Paths& p) { p.scattering.bounces = 2; });
  with_receiver("name", [](Options& o, Paths&) { o.name = "rover"; });
  with_receiver("mask", [](Options& o, Paths&) { o.fix.elevation_mask_rad = 0.2; });
  with_receiver("satellites", [](Options& o, Paths&) { o.fix.min_satellites = 5; });
  with_receiver("weights", [](Options& o, Paths&) { o.fix.weights.weighting = positioning::Weighting::Cn0; });
  with_receiver("C/N0 mask", [](Options& o, Paths&) { o.fix.cn0_mask_dbhz = 20; });
  with_receiver("RAIM", [](Options& o, Paths&) { o.fix.raim.enabled = true; });
  with_receiver("PDOP", [](Options& o, Paths&) { o.fix.max_pdop = 50; });
  with_receiver("noise", [](Options& o, Paths&) { o.noise.ou.sigma_m_per_sqrt_s = 0.3; });
  with_receiver("mean", [](Options& o, Paths&) { o.noise.ou.mu_m = 0.3; });
  with_receiver("no noise", [](Options& o, Paths&) { o.noise.enabled = false; });
  with_receiver("drift", [](Options& o, Paths&) { o.noise.drift_enabled = true; });
  with_receiver("clock", [](Options& o, Paths&) { o.clock.bias_s = 1e-3; });
  with_receiver("troposphere", [](Options& o, Paths&) { o.troposphere = true; });
  with_receiver("corrected", [](Options& o, Paths&) { o.fix.correct_troposphere = true; });
  with_receiver("antenna", [](Options& o, Paths&) { o.signal.antenna = signal::survey_antenna(); });
  with_receiver("link", [](Options& o, Paths&) { o.signal.link.above_minimum_db = 1; });
  with_receiver("offset", [](Options& o, Paths&) { o.signal.offset_db["GPS"] = 1; });
  with_receiver("slabs", [](Options& o, Paths&) { o.signal.strength.slabs = false; });
  with_receiver("bandwidth", [](Options& o, Paths&) { o.signal.front_end_bandwidth_hz = 2e7; });
  with_receiver("spacing", [](Options& o, Paths&) { o.signal.dll.spacing_chips = 0.1; });
  with_receiver("PLL", [](Options& o, Paths&) { o.signal.pll.loop_bandwidth_hz = 10; });
  with_receiver("FLL", [](Options& o, Paths&) { o.signal.fll.loop_bandwidth_hz = 4; });
  with_receiver("lock", [](Options& o, Paths&) { o.signal.lock.tracking_threshold_dbhz = 20; });
  with_receiver("shadowing", [](Options& o, Paths&) { o.signal.shadowing.enabled = true; });
  with_receiver("shadows", [](Options& o, Paths&) { o.signal.shadowing.frame_m = 5; });
  with_receiver("steps", [](Options& o, Paths&) { o.signal.cn0_step_db = 1; });
  // A cell has no previous epoch for a filter.
  ReceiverConfig filtered = receiver;
  filtered.options.filter.enabled = true;
  EXPECT_EQ(key(request, filtered), key(request, receiver));
}

TEST(HeatmapKey, ChangesWithEveryKeyOfAReceiver) {
  const simulation::Environment environment = environment_with({{gnss::System::GPS, {{1e-8, 0, 0, 0}, {}}}});
  std::map<std::string, std::string> keys;
  const auto store_key = [&](const std::string& line) {
    const ReceiverConfig receiver = simulation::parse_profile("description: d\n" + line, "p.yaml").receiver;
    return Heatmap(environment, receiver, some_request(), "").key();
  };
  const auto expect_new = [&](const std::string& line, const std::string& what) {
    const auto [found, fresh] = keys.emplace(store_key(line), what);
    EXPECT_TRUE(fresh) << what << " gives the key of " << found->second;
  };
  const std::string plain = store_key("");
  expect_new("", "the defaults");
  for (const options::Key& key : simulation::profile_keys()) {
    // Cells are antenna positions, wherever the antenna is on a vehicle, and have no previous epoch.
    if (key.path.starts_with("lever_arm.") || key.path.starts_with("position_filter.")) {
      EXPECT_EQ(store_key(nested(key.path, another_value(key))), plain) << key.path;
      continue;
    }
    std::string value = another_value(key);
    if (key.path == "signal.lock.acquisition_threshold_dbhz") value = "30";
    expect_new(nested(key.path, value) + "\n", key.path);
  }
}

// FNV-1a of "" and "heat map\n", worked out by the published recipe in Python:
// h = 0xcbf29ce484222325; for b in data: h = (h ^ b) * 0x100000001b3 mod 2^64.
TEST(HeatmapKey, IsTwoHashes) {
  EXPECT_EQ(hash_text(""), "cbf29ce4842223252161065a1bbb3f1d");
  EXPECT_NE(hash_text("a"), hash_text("b"));
}

}  // namespace
}  // namespace canyon::heatmap
