#include "canyon/analysis/heatmap/engine/engine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <thread>
#include <utility>

#include "canyon/analysis/heatmap/cells/cell_solver.hpp"
#include "canyon/base/arithmetic.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/disturbances.hpp"
#include "tests/support/downtown.hpp"
#include "tests/support/observe.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using propagation::Model;
using propagation::Visibility;
using receiver::Receiver;
using receiver::ReceiverEpoch;
using simulation::ReceiverConfig;
using test::CircularSky;
using test::downtown;
using test::TemporaryFolder;

constexpr geodesy::GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);

ReceiverConfig receiver_of(Model model) {
  ReceiverConfig receiver;
  receiver.propagation.model = model;
  return receiver;
}

/// Streets and roofs around the middle of downtown, away from walls.
Request small_request(std::uint32_t cells = 48) {
  Request request;
  request.grid = Grid::covering(-40.3, -36.7, -40.3 + 2.0 * cells, -36.7 + 2.0 * cells, 2);
  request.grid.tile_size = 16;
  request.times = {kTime, kTime + std::chrono::minutes(30), kTime + std::chrono::hours(3)};
  request.altitudes_m = {2, 15};
  return request;
}

Heatmap map_of(Model model, Request request) {
  return {downtown(), receiver_of(model), std::move(request), "downtown"};
}

/// Values of a whole map by layer, time, altitude, row, column.
std::vector<float> assemble(const Heatmap& map, const std::function<TileValues(std::size_t)>& values_of) {
  const Request& request = map.request();
  const std::size_t altitudes = request.altitudes_m.size(), times = request.times.size();
  std::vector<float> all(request.layers.size() * times * altitudes * request.grid.cells(), -12345);
  for (std::size_t i = 0; i < map.unit_count(); ++i) {
    const Heatmap::Unit unit = map.unit(i);
    const TileValues values = values_of(i);
    EXPECT_EQ(values.first_time, unit.first_time);
    EXPECT_EQ(values.times, unit.times);
    EXPECT_EQ(values.state.size(), altitudes * unit.tile.cells());
    std::size_t from = 0;
    for (std::size_t l = 0; l < request.layers.size(); ++l) {
      for (std::size_t t = 0; t < unit.times; ++t) {
        for (std::size_t a = 0; a < altitudes; ++a) {
          for (std::size_t r = 0; r < unit.tile.rows; ++r) {
            for (std::size_t c = 0; c < unit.tile.columns; ++c, ++from) {
              const std::size_t to =
                  (((l * times + unit.first_time + t) * altitudes + a) * request.grid.rows +
                   unit.tile.first_row + r) *
                      request.grid.columns +
                  unit.tile.first_column + c;
              EXPECT_EQ(all[to], -12345);
              all[to] = values.values[from];
            }
          }
        }
      }
    }
    EXPECT_EQ(from, values.values.size());
  }
  EXPECT_EQ(std::count(all.begin(), all.end(), -12345.0F), 0);
  return all;
}
std::vector<float> computed(const Heatmap& map) {
  return assemble(map, [&](std::size_t i) { return map.compute(i); });
}
std::vector<float> stored(const Heatmap& map, const TileStore& store) {
  return assemble(map, [&](std::size_t i) { return store.load(i).value(); });
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// A receiver that tracks only some satellites, and BeiDou on B1C. The map agrees with separate receivers in
// the cells, including the ionosphere.
TEST(Heatmap, FollowsWhatTheReceiverTracks) {
  using gnss::System;
  const simulation::Environment environment(
      city::synthetic_city({}),
      std::make_shared<CircularSky>(std::vector{System::GPS, System::GLONASS, System::BeiDou}),
      {{System::GPS, {{1e-8, 0, 0, 0}, {9e4, 0, 0, 0}}}});
  ReceiverConfig receiver = receiver_of(Model::Specular);
  receiver.options.tracks = {"L1CA", "B1C"};
  receiver.options.at_once = receiver::AtOnce::BeiDouByB1C;
  receiver.options.ionosphere = true;
  receiver.options.fix.max_iterations = 30;
  receiver.options.fix.convergence_m = 1e-4;
  Request request = small_request(40);
  request.grid.tile_size = 40;
  request.times = {kTime};
  request.altitudes_m = {2};
  request.layers = {Layer::SatellitesVisible, Layer::SatellitesUsed, Layer::HorizontalError, Layer::Hdop};
  const Heatmap map(environment, receiver, request, "");
  const std::vector<float> found = computed(map);

  const TileTracer tracer(environment, receiver.propagation, receiver.options.fix.elevation_mask_rad);
  const TileCells cells =
      tracer.cells(request.grid, request.grid.tile(0), nullptr, 2, AltitudeKind::AboveTerrain);
  std::vector<std::vector<float>> expected(request.layers.size(), std::vector<float>(cells.state.size()));
  const std::vector<std::span<float>> spans(expected.begin(), expected.end());
  EXPECT_TRUE(
      cell_solver(CellMethod::Run, environment, tracer, {receiver, nullptr, request.samples, {}, {}, {}})
          ->solve(cells, kTime, request.layers, spans, {}));
  int compared = 0;
  for (std::size_t l = 0; l < expected.size(); ++l) {
    for (std::size_t i = 0; i < cells.state.size(); ++i) {
      if (cells.state[i] != CellState::Computed || !std::isfinite(expected[l][i])) continue;
      EXPECT_NEAR(found[l * cells.state.size() + i], expected[l][i], 1e-3 * std::max(1.0F, expected[l][i]));
      ++compared;
    }
  }
  EXPECT_GT(compared, 200);
  receiver.options.tracks = {};
  receiver.options.at_once = receiver::AtOnce::All;
  EXPECT_FALSE(same_bits(computed(Heatmap(environment, receiver, request, "")), found));
}

TEST(Heatmap, UnitsCoverEveryCellAndTimeOnceAndAreBounded) {
  for (const std::size_t times : {std::size_t{1}, std::size_t{7}, std::size_t{300}}) {
    Request request;
    request.grid = Grid::covering(0, 0, 700, 530, 1);
    request.times.clear();
    for (std::size_t t = 0; t < times; ++t) request.times.push_back(kTime + 30.0 * static_cast<double>(t));
    request.layers = layers_of_one_look();
    request.altitudes_m = {2, 15, 40};
    const Heatmap map = map_of(Model::Mirror, request);
    std::vector<int> seen(request.grid.cells() * times);
    for (std::size_t i = 0; i < map.unit_count(); ++i) {
      const Heatmap::Unit unit = map.unit(i);
      EXPECT_LE(std::size_t{21} * 3 * unit.times * unit.tile.cells() * sizeof(float), Heatmap::kUnitBytes);
      for (std::size_t t = unit.first_time; t < unit.first_time + unit.times; ++t) {
        for (std::size_t k = 0; k < unit.tile.cells(); ++k) {
          const std::size_t column = unit.tile.first_column + k % unit.tile.columns;
          const std::size_t row = unit.tile.first_row + k / unit.tile.columns;
          ++seen.at((t * request.grid.rows + row) * request.grid.columns + column);
        }
      }
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(seen.size()));
    EXPECT_GE(map.unit_count(), std::min<std::size_t>(256, 9 * times));
    for (std::size_t tile = 0; tile < request.grid.tile_count(); ++tile) {
      for (std::size_t t = 0; t < times; ++t) {
        const Heatmap::Unit unit = map.unit(map.unit_of(tile, t));
        EXPECT_EQ(unit.tile.first_column, request.grid.tile(tile).first_column);
        EXPECT_EQ(unit.tile.first_row, request.grid.tile(tile).first_row);
        EXPECT_TRUE(unit.first_time <= t && t < unit.first_time + unit.times);
      }
    }
  }
  // A single time may be larger, up to a bound.
  Request deep = small_request();
  deep.grid = Grid::covering(0, 0, 300, 300, 1);
  deep.layers = layers_of_one_look();
  deep.altitudes_m.clear();
  for (int i = 0; i < 40; ++i) deep.altitudes_m.push_back(i);
  EXPECT_EQ(map_of(Model::Mirror, deep).unit(0).times, 1U);
  for (int i = 40; i < 100; ++i) deep.altitudes_m.push_back(i);
  EXPECT_THROW(map_of(Model::Mirror, deep), InputError);
}

TEST(Heatmap, RequestsAreChecked) {
  const auto broken = [](const auto& change) {
    Request request = small_request();
    EXPECT_NO_THROW(request.validate());
    change(request);
    EXPECT_THROW(request.validate(), InputError);
    EXPECT_THROW(map_of(Model::Mirror, request), InputError);
  };
  broken([](Request& r) { r.grid.columns = 0; });
  broken([](Request& r) { r.area = Area{}; });
  broken([](Request& r) { r.altitudes_m = {}; });
  broken([](Request& r) { r.altitudes_m = {15, 2}; });
  broken([](Request& r) { r.altitudes_m = {std::nan("")}; });
  broken([](Request& r) { r.altitudes_m = {1e6}; });
  broken([](Request& r) { r.times = {}; });
  broken([](Request& r) { r.times = {kTime, kTime}; });
  broken([](Request& r) { r.times = {kTime, kTime - 1.0}; });
  broken([](Request& r) { r.layers = {}; });
  broken([](Request& r) { r.layers = {Layer::Hdop, Layer::Hdop}; });
  broken([](Request& r) { r.samples.samples = 0; });
  ReceiverConfig receiver = receiver_of(Model::Mirror);
  receiver.propagation.max_range_m = -1;
  EXPECT_THROW(Heatmap(downtown(), receiver, small_request(), ""), InputError);
  receiver = receiver_of(Model::Mirror);
  receiver.options.fix.min_satellites = 1;
  EXPECT_THROW(Heatmap(downtown(), receiver, small_request(), ""), InputError);
}

TEST(Heatmap, ThreadsAndRanksGiveTheSameBytes) {
  for (const Model model : {Model::Mirror, Model::Specular}) {
    Request request = small_request();
    request.layers = layers_of_one_look();
    request.samples.samples = 8;
    const Heatmap map = map_of(model, request);
    const std::vector<float> expected = computed(map);
    EXPECT_GT(std::count_if(expected.begin(), expected.end(), [](float v) { return !std::isnan(v); }), 1000);
    const TemporaryFolder folder;
    for (const int threads : {1, 2}) {
      TileStore store(folder / ("threads" + std::to_string(threads)), map.key(), "");
      MapRunOptions options;
      options.threads = threads;
      const MapRunResult result = map.run(store, options);
      EXPECT_EQ(result.computed, map.unit_count());
      EXPECT_EQ(result.cells_computed, request.grid.cells() * 2 * 3);
      EXPECT_FALSE(result.interrupted);
      EXPECT_TRUE(same_bits(stored(map, store), expected)) << threads;
    }
    // As two processes: each with its own map and its own object of the folder, one common count. The first
    // creates the folder before the other opens it.
    { const TileStore made(folder / "ranks", map.key(), ""); }
    std::atomic<std::size_t> next{0}, units{0};
    std::atomic<int> ready{0};
    const auto process = [&] {
      const Heatmap rank_map = map_of(model, request);
      TileStore store(folder / "ranks", rank_map.key(), "");
      MapRunOptions options;
      options.threads = 1;
      options.processes = 2;
      options.begin_queue = [&] {
        ++ready;
        while (ready < 2) std::this_thread::yield();
      };
      options.next = [&] { return next++; };
      const MapRunResult result = rank_map.run(store, options);
      EXPECT_EQ(result.resumed, 0U);
      EXPECT_FALSE(result.interrupted);
      units += result.computed;
    };
    std::thread other(process);
    process();
    other.join();
    EXPECT_EQ(units, map.unit_count());
    EXPECT_TRUE(same_bits(stored(map, TileStore(folder / "ranks", map.key(), "")), expected));
  }
}

// Tiles differ in the directions of satellites (up to 2e-5 rad): only cells at edges differ noticeably.
TEST(Heatmap, TilesOfAnySizeGiveTheSameWithoutDraws) {
  Request request = small_request(96);
  request.altitudes_m = {15};
  request.layers = {Layer::HorizontalError,   Layer::VerticalError, Layer::Hdop,
                    Layer::SatellitesVisible, Layer::SatellitesLos, Layer::NlosFraction,
                    Layer::LargestExcess,     Layer::Availability,  Layer::SkyView};
  std::vector<std::vector<float>> maps;
  for (const std::uint32_t size : {16U, 37U, 256U}) {
    request.grid.tile_size = size;
    maps.push_back(computed(map_of(Model::Mirror, request)));
  }
  for (const auto& other : {maps[1], maps[2]}) {
    std::size_t different = 0;
    double largest = 0;
    for (std::size_t i = 0; i < other.size(); ++i) {
      if (std::isnan(other[i]) && std::isnan(maps[0][i])) continue;
      const double difference = std::abs(static_cast<double>(other[i]) - static_cast<double>(maps[0][i]));
      if (difference < 0.05) {
        largest = std::max(largest, difference);
      } else {
        ++different;
      }
    }
    std::cout << other.size() << " values, " << different << " different, others within " << largest << "\n";
    EXPECT_LT(different, other.size() / 2000);
  }
}

/// A map's values at one cell compared with a single stationary receiver there: Environment::arrival() and
/// Receiver::observe(), as in `canyon trace` and `canyon simulate`.
struct CellCheck {
  std::size_t cells = 0, fixes = 0, different = 0;
  double largest_m = 0;
};
CellCheck check_cells(const simulation::Environment& environment, const ReceiverConfig& config,
                      Request request, std::size_t step) {
  request.layers = {Layer::HorizontalError,   Layer::VerticalError,     Layer::Hdop,
                    Layer::SatellitesLos,     Layer::SatellitesVisible, Layer::SatellitesUsed,
                    Layer::SatellitesBlocked, Layer::LargestExcess,     Layer::Availability};
  const Heatmap map(environment, config, request, "");
  const std::vector<float> values = computed(map);
  const propagation::Propagator propagator = environment.make_propagator(config.propagation);
  receiver::ReceiverOptions quiet = config.options;
  quiet.noise.enabled = false;
  const geodesy::LocalFrame& frame = environment.city().frame;
  const std::size_t plane = request.grid.cells();
  const std::size_t per_layer = plane * request.times.size() * request.altitudes_m.size();
  CellCheck check;
  for (std::size_t i = 0; i < per_layer; i += step) {
    const std::size_t cell = i % plane, a = i / plane % request.altitudes_m.size();
    const geodesy::GpsTime time = request.times[i / plane / request.altitudes_m.size()];
    const Eigen::Vector2d at = request.grid.centre(static_cast<std::uint32_t>(cell % request.grid.columns),
                                                   static_cast<std::uint32_t>(cell / request.grid.columns));
    const Vector3d point(at.x(), at.y(), request.altitudes_m[a]);  // the ground is flat at 0
    const propagation::Arrival arrival = environment.arrival(time, point, propagator);
    const auto value = [&](std::size_t layer) { return static_cast<double>(values[layer * per_layer + i]); };
    if (arrival.containment != raytrace::Containment::Free) {
      for (std::size_t l = 0; l < request.layers.size(); ++l) EXPECT_TRUE(std::isnan(value(l)));
      continue;
    }
    Receiver receiver(quiet, 1);
    const Vector3d truth = frame.ecef_from_local(point);
    const ReceiverEpoch epoch =
        test::observe_views(receiver, time, truth, Vector3d::Zero(), arrival.views,
                            frame.ecef_from_local_rotation(), arrival.containment, environment.sky());
    int los = 0;
    double excess_m = 0;
    for (const receiver::SatelliteObservation& s : epoch.satellites) {
      if (!s.above_mask) continue;
      los += s.visibility == Visibility::LOS || s.visibility == Visibility::LOSMultipath;
      excess_m = std::max(excess_m, s.excess_m);
    }
    ++check.cells;
    check.fixes += epoch.fix.solved();
    bool same = value(3) == los && value(4) == epoch.visible && value(6) == epoch.blocked &&
                value(8) == (epoch.fix.solved() ? 1 : 0) &&
                value(5) == static_cast<double>(epoch.fix.used.size());
    if (epoch.visible > 0) same = same && std::abs(value(7) - excess_m) < 0.02;
    if (same && epoch.fix.solved()) {
      const Vector3d error = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(truth)) *
                             (epoch.fix.position_ecef - truth);
      const double difference =
          std::max(std::abs(value(0) - error.head<2>().norm()), std::abs(value(1) - error.z()));
      // Detours differ by millimetres (directions of the tile's centre), times DOP.
      same = difference < 0.01 * (1 + epoch.fix.dop->pdop) &&
             std::abs(value(2) - epoch.fix.dop->hdop) < 2e-3 * epoch.fix.dop->hdop;
      if (same) check.largest_m = std::max(check.largest_m, difference);
    }
    check.different += !same;
  }
  return check;
}

TEST(Heatmap, CellsHaveWhatAReceiverHasThere) {
  for (const Model model : {Model::Mirror, Model::Specular}) {
    const CellCheck check = check_cells(downtown(), receiver_of(model), small_request(), 7);
    std::cout << check.cells << " cells, " << check.fixes << " fixes, " << check.different
              << " different, errors of the others within " << check.largest_m << " m\n";
    EXPECT_GT(check.fixes, check.cells / 10);
    EXPECT_LE(check.different, check.cells / 500);
  }
}

// Noise on the solved position requires the slow method; this little noise changes nothing else.
TEST(Heatmap, ReceiversOfTheirOwnForEachCellAgree) {
  ReceiverConfig slow = receiver_of(Model::Mirror);
  slow.options.fix_noise.vertical_mps = 1e-12;
  EXPECT_EQ(cell_method(slow), CellMethod::Run);
  Request request = small_request(24);
  request.times.resize(1);
  const CellCheck check = check_cells(downtown(), slow, request, 1);
  EXPECT_GT(check.fixes, 100U);
  EXPECT_LE(check.different, 2U);

  request.layers = layers_of_one_look();
  request.samples.samples = 300;
  request.grid = Grid::covering(-40.3, -36.7, -40.3 + 16, -36.7 + 16, 2);
  request.altitudes_m = {40};
  const std::vector<float> by_receivers = computed(Heatmap(downtown(), slow, request, ""));
  const std::vector<float> by_solver = computed(Heatmap(downtown(), receiver_of(Model::Mirror), request, ""));
  std::map<Layer, double> worst;
  for (std::size_t i = 0; i < by_solver.size(); ++i) {
    const Layer layer = request.layers[i / request.grid.cells()];
    ASSERT_EQ(std::isnan(by_solver[i]), std::isnan(by_receivers[i])) << info(layer).name;
    if (std::isnan(by_solver[i])) continue;
    const double difference =
        std::abs(static_cast<double>(by_solver[i]) - static_cast<double>(by_receivers[i]));
    const double scale = info(layer).needs_samples ? std::max(1.0, static_cast<double>(by_solver[i])) : 1.0;
    worst[layer] = std::max(worst[layer], difference / scale);
  }
  for (const auto& [layer, difference] : worst) {
    // 300 realizations: the standard error of an RMS is 4 %, of a quantile some 8 %; four of them are
    // allowed.
    EXPECT_LT(difference, info(layer).needs_samples ? 0.4 : 0.03) << info(layer).name;
  }
  EXPECT_EQ(worst.size(), request.layers.size());
}

// In the open RTK is fixed at once, within centimetres; without a correction never; and without a base the
// layers are rejected.
TEST(Heatmap, RtkLayersAreThoseOfAReceiverBesideItsBase) {
  const auto receivers = [](const std::string& corrections) {
    return simulation::parse_scenario(
               "city: {open: true, origin: {latitude_deg: 0, longitude_deg: 0}}\nsky: {nominal: "
               "true}\nstart: 2026-06-01T06:00:00Z\nduration_s: 1\n"
               "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}]}\nreceivers:\n"
               "  - {name: rover, profile: ublox-f9p, rtk: true, corrections: {from: base" +
                   corrections +
                   "}}\n  - {name: base, profile: survey, fixed: {east_m: 900, north_m: 300, up_m: 5}}\n",
               "scenario.yaml")
        .receivers;
  };
  const simulation::Environment open(
      city::City(), std::make_shared<CircularSky>(std::vector{gnss::System::GPS, gnss::System::Galileo}));
  Request request;
  request.grid = Grid::covering(0, 0, 4, 2, 2);
  request.times = {kTime};
  request.samples.samples = 3;
  request.limits.rtk_s = 15;
  request.layers = {Layer::RtkFixedFraction, Layer::RtkTimeToFix, Layer::RtkFixedErrorP95};
  const auto map = [&](const std::vector<ReceiverConfig>& of) {
    const auto base = simulation::base_of(of, of[0]);
    return Heatmap(open, of[0], request, "", base ? &*base : nullptr);
  };
  const auto values = map(receivers("")).compute(0).values;
  ASSERT_EQ(values.size(), 6U);
  for (std::size_t cell = 0; cell < 2; ++cell) {
    EXPECT_GT(values[cell], 0.7);
    EXPECT_LE(values[2 + cell], 5);
    EXPECT_LT(values[4 + cell], 0.05);
  }
  const auto none = map(receivers(", loss: 1")).compute(0).values;
  EXPECT_EQ(none[0], 0);
  EXPECT_TRUE(std::isnan(none[2]));
  EXPECT_TRUE(std::isnan(none[4]));
  EXPECT_NE(map(receivers("")).key(), map(receivers(", loss: 1")).key());

  request.samples.samples = 10'000;
  EXPECT_THROW((void)map(receivers("")), InputError);  // gigabytes of the base's epochs
  request.samples.samples = 3;
  auto without = receivers("");
  without.pop_back();
  EXPECT_THROW((void)map(without), InputError);
  without = receivers("");
  without[0].options.rtk.enabled = false;
  EXPECT_THROW((void)map(without), InputError);
}

TEST(Heatmap, HonoursDisturbances) {
  // A receiver whose cells would share fixes, from whose sky a disturbance removes all satellites but the
  // first three: a fix of two systems needs five.
  ReceiverConfig disturbed = receiver_of(Model::Mirror);
  ASSERT_EQ(cell_method(disturbed), CellMethod::Shared);
  disturbed.disturbances = {test::always("three are left", [](propagation::Arrival& arrival) {
    arrival.views.resize(std::min<std::size_t>(3, arrival.views.size()));
  })};
  Request request = small_request(8);
  request.times.resize(1);
  request.altitudes_m = {40};
  request.layers = {Layer::Availability, Layer::SatellitesVisible};
  const Heatmap without(downtown(), receiver_of(Model::Mirror), request, "");
  const Heatmap with(downtown(), disturbed, request, "");
  EXPECT_NE(with.key(), without.key());
  const std::vector<float> before = computed(without), after = computed(with);
  const std::size_t cells = request.grid.cells();
  std::size_t fixes = 0;
  for (std::size_t i = 0; i < cells; ++i) {
    ASSERT_EQ(std::isnan(before[i]), std::isnan(after[i]));
    if (std::isnan(before[i])) continue;
    fixes += before[i] == 1;
    EXPECT_EQ(after[i], 0);
    EXPECT_LE(after[cells + i], 3);
  }
  EXPECT_GT(fixes, 5U);
}

TEST(Heatmap, DrawsAStreetForEachDraw) {
  ReceiverConfig in_traffic = receiver_of(Model::Mirror);
  in_traffic.options.noise.enabled = false;
  const ReceiverConfig empty = in_traffic;
  in_traffic.streets.enabled = true;
  in_traffic.streets.vehicle_fractions = {{"double_decker", 1}};
  in_traffic.streets.vehicles_per_km = 60;
  Request request = small_request(6);
  request.times.resize(1);
  request.altitudes_m = {2};
  request.samples.samples = 8;
  request.layers = {Layer::SatellitesLos, Layer::HorizontalErrorP95};
  const Heatmap without(downtown(), empty, request, "");
  const Heatmap with(downtown(), in_traffic, request, "");
  EXPECT_NE(with.key(), without.key());
  const std::vector<float> before = computed(without), after = computed(with);
  EXPECT_TRUE(same_bits(computed(with), after));
  const std::size_t cells = request.grid.cells();
  int moved = 0;
  for (std::size_t i = 0; i < cells; ++i) {
    if (std::isnan(before[i])) continue;
    // Without noise the street is empty.
    EXPECT_EQ(after[i], before[i]);
    // Without strength a satellite behind a bus is lost or received by a reflection: another fix.
    moved += std::abs(after[cells + i] - before[cells + i]) > 0.1F;
  }
  EXPECT_GT(moved, 5);
}

/// A map of a receiver whose signals have strength, compared with the receiver itself in every cell.
void expect_as_receiver(const std::function<void(receiver::ReceiverOptions&)>& change) {
  ReceiverConfig receiver = receiver_of(Model::Specular);
  receiver.options.signal.enabled = true;
  receiver.options.signal.satellite_sigma_db = 2;
  change(receiver.options);
  Request request = small_request(8);
  request.grid.tile_size = 5;
  request.altitudes_m = {2};
  request.times.resize(1);
  request.samples.samples = 5;
  request.receivers.model = ReceiverModel::Run;
  request.layers = {Layer::HorizontalErrorMean, Layer::Availability, Layer::SatellitesVisible,
                    Layer::SatellitesLos};
  const std::vector<float> values = computed(Heatmap(downtown(), receiver, request, ""));
  const propagation::Propagator propagator = downtown().make_propagator(receiver.propagation);
  receiver::ReceiverOptions warm = receiver.options;
  warm.signal.lock.warm_start = true;
  const geodesy::LocalFrame& frame = downtown().city().frame;
  std::size_t compared = 0;
  for (std::size_t i = 0; i < request.grid.cells(); ++i) {
    const Eigen::Vector2d at = request.grid.centre(static_cast<std::uint32_t>(i % request.grid.columns),
                                                   static_cast<std::uint32_t>(i / request.grid.columns));
    const Vector3d point(at.x(), at.y(), 2);
    const propagation::Arrival arrival = downtown().arrival(kTime, point, propagator);
    if (arrival.containment != raytrace::Containment::Free) continue;
    double sum = 0;
    int fixes = 0;
    for (int d = 0; d < 5; ++d) {
      // The seed of realization d at any cell, by its documented recipe.
      const std::uint64_t seed =
          RandomStream(request.samples.seed,
                       "heatmap/" + std::to_string(kTime.nanoseconds()) + "/" + std::to_string(d))
              .next();
      Receiver one(warm, seed);
      const Vector3d truth = frame.ecef_from_local(point);
      const ReceiverEpoch epoch =
          test::observe_views(one, kTime, truth, Vector3d::Zero(), arrival.views,
                              frame.ecef_from_local_rotation(), arrival.containment, downtown().sky());
      if (!epoch.fix.solved()) continue;
      ++fixes;
      const Vector3d error = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(truth)) *
                             (epoch.fix.position_ecef - truth);
      sum += error.head<2>().norm();
    }
    ++compared;
    EXPECT_FLOAT_EQ(values[request.grid.cells() + i], static_cast<float>(fixes) / 5);
    if (fixes > 0) {
      EXPECT_FLOAT_EQ(values[i], static_cast<float>(sum / fixes));
    } else {
      EXPECT_TRUE(std::isnan(values[i]));
    }
    EXPECT_GE(values[2 * request.grid.cells() + i], 0);
  }
  EXPECT_GT(compared, 20U);
}

TEST(Heatmap, SignalsWithStrengthAreThoseOfTheReceiver) {
  expect_as_receiver([](receiver::ReceiverOptions&) {});
}

// Compared with receivers that track all of them; the map leaves out satellites that no fix uses.
TEST(Heatmap, FixesOfSeveralSignalsAreThoseOfTheReceiver) {
  for (const auto combination : {receiver::Combination::First, receiver::Combination::IonosphereFree,
                                 receiver::Combination::Uncombined}) {
    expect_as_receiver([&](receiver::ReceiverOptions& options) {
      options.tracks = {"L1CA", "L2C", "E1", "E5a"};
      options.signal.antenna = signal::dual_patch_antenna();
      options.fix_input.combination = combination;
    });
  }
}

TEST(Heatmap, LineOfSightAndSkyNeedNoReceiver) {
  Request request = small_request();
  request.layers = {Layer::SkyView, Layer::SatellitesLos};
  ReceiverConfig receiver = receiver_of(Model::Specular);
  const std::vector<float> alone = computed(Heatmap(downtown(), receiver, request, ""));
  receiver.options.signal.enabled = true;  // without effect here
  EXPECT_TRUE(same_bits(computed(Heatmap(downtown(), receiver, request, "")), alone));
  request.layers = {Layer::SkyView, Layer::SatellitesLos, Layer::Hdop};
  const std::vector<float> with_others = computed(map_of(Model::Mirror, request));
  std::size_t different = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    different += same_bytes<std::uint32_t>(alone[i]) != same_bytes<std::uint32_t>(with_others[i]);
  }
  EXPECT_EQ(different, 0U);
  // The sky is the same at all times.
  const std::size_t a_time = request.grid.cells() * 2;
  EXPECT_TRUE(same_bits({alone.begin(), alone.begin() + static_cast<std::ptrdiff_t>(a_time)},
                        {alone.begin() + static_cast<std::ptrdiff_t>(a_time),
                         alone.begin() + static_cast<std::ptrdiff_t>(2 * a_time)}));
}

TEST(Heatmap, ResumesWhatIsLost) {
  const TemporaryFolder folder;
  const Heatmap map = map_of(Model::Mirror, small_request());
  const std::vector<float> expected = computed(map);
  {
    TileStore store(folder / "tiles", map.key(), "");
    EXPECT_EQ(map.run(store).computed, map.unit_count());
  }
  for (const char* lost : {"unit-000000000.tile", "unit-000000005.tile", "unit-000000017.tile"}) {
    EXPECT_TRUE(fs::remove(folder / "tiles" / lost)) << lost;
  }
  TileStore store(folder / "tiles", map.key(), "");
  std::vector<std::size_t> reported;
  MapRunOptions options;
  options.progress = [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(total, map.request().grid.cells() * 2 * 3);
    reported.push_back(done);
  };
  const MapRunResult result = map.run(store, options);
  EXPECT_EQ(result.units, map.unit_count());
  EXPECT_EQ(result.computed, 3U);
  EXPECT_EQ(result.resumed, map.unit_count() - 3);
  EXPECT_EQ(result.cells_computed, 3U * 256 * 2);
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  EXPECT_EQ(reported.front(), map.request().grid.cells() * 2 * 3 - std::size_t{3} * 256 * 2);
  EXPECT_EQ(reported.back(), map.request().grid.cells() * 2 * 3);
  EXPECT_TRUE(same_bits(stored(map, store), expected));
}

TEST(Heatmap, StopsBetweenTimesAndKeepsWhatIsDone) {
  const TemporaryFolder folder;
  Request request = small_request(192);  // slow enough to be stopped by the first report after its beginning
  request.layers = layers_of_one_look();
  request.grid.tile_size = 64;
  const Heatmap map = map_of(Model::Specular, request);
  TileStore store(folder / "tiles", map.key(), "");
  std::atomic<bool> stop{false};
  MapRunOptions options;
  options.stop = &stop;
  options.progress = [&](std::size_t done, std::size_t) { stop = done > 0; };
  const MapRunResult result = map.run(store, options);
  EXPECT_TRUE(result.interrupted);
  EXPECT_LT(result.computed, map.unit_count());
  const MapRunResult rest = map.run(store);
  EXPECT_FALSE(rest.interrupted);
  EXPECT_EQ(rest.resumed, result.computed);
  EXPECT_EQ(rest.computed + rest.resumed, map.unit_count());
}

TEST(Heatmap, DamagedUnitsAndBadOptionsStopIt) {
  const TemporaryFolder folder;
  const Heatmap map = map_of(Model::Mirror, small_request());
  TileStore store(folder / "tiles", map.key(), "");
  EXPECT_EQ(map.run(store).computed, map.unit_count());
  fs::resize_file(folder / "tiles/unit-000000002.tile", 100);
  try {
    (void)map.run(store);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("unit-000000002.tile"), std::string::npos);
  }
  MapRunOptions options;
  options.threads = -1;
  EXPECT_THROW((void)map.run(store, options), InputError);
  // A store that becomes read-only: no unit is lost, and the error is thrown.
  fs::remove_all(folder / "tiles");
  EXPECT_THROW((void)map.run(store), InputError);
}

}  // namespace
}  // namespace canyon::heatmap
