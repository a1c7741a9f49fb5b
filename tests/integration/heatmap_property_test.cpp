// Heat maps compared with the receiver: options, cities, skies and cells are random, and each cell of a map
// is compared with a simulation of a receiver at that cell and time. Map and receiver share their rules, but
// the map solves most cells with other arithmetic.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "canyon/analysis/heatmap/cells/cell_solver.hpp"
#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap_property_test {
namespace {

using Eigen::Vector3d;
using geodesy::radians;
using gnss::System;
using heatmap::CellState;
using heatmap::Layer;
using positioning::Weighting;

constexpr std::uint64_t kSeed = 11;
constexpr int kCases = 1000;
/// Shared fixes of cells are linearized at the true position: within these limits their errors are accurate
/// to 0.1 %, and to some 0.1 % if the troposphere is corrected with the estimated height.
constexpr double kWidest_m = 1000, kWeakest = 100;
constexpr double kLinear = 1e-3, kByAtmosphere = 4e-3;

const std::vector<Layer> kLayers{Layer::HorizontalError,
                                 Layer::VerticalError,
                                 Layer::SatellitesUsed,
                                 Layer::Hdop,
                                 Layer::Pdop,
                                 Layer::Vdop,
                                 Layer::SatellitesVisible};

class Dice {
 public:
  Dice(std::uint64_t seed, int number) : random_(seed, fmt::format("case {}", number)) {}

  double between(double low, double high) { return low + (high - low) * random_.uniform(); }
  int whole(int low, int high) { return low + static_cast<int>((high - low + 1) * random_.uniform()); }
  bool chance(double p) { return random_.uniform() < p; }
  template <class Value>
  Value one_of(std::initializer_list<Value> values) {
    return *std::next(values.begin(), whole(0, static_cast<int>(values.size()) - 1));
  }

 private:
  RandomStream random_;
};

/// One city, sky and receiver, and the cells of a map.
struct Case {
  simulation::Scenario scenario;  ///< with one receiver
  geodesy::GpsTime time;
  gnss::NavigationData navigation;
  heatmap::Request request;
};

void draw_receiver(Dice& dice, receiver::ReceiverOptions& o) {
  o.fix.elevation_mask_rad = radians(dice.between(0, 25));
  o.fix.min_satellites = dice.chance(0.6) ? 4 : dice.whole(4, 8);
  o.fix.max_iterations = dice.chance(0.8) ? dice.one_of({20, 21, 40, 1000}) : dice.whole(5, 12);
  // At 1e-8 m and less, rounding decides when a fix converges.
  o.fix.convergence_m = dice.chance(0.6) ? 1e-6 : std::pow(10, dice.between(-7, 0));
  if (dice.chance(0.3)) o.fix.max_pdop = dice.between(1.2, 8);
  o.fix.weights.weighting = dice.one_of({Weighting::Sigma, Weighting::Equal, Weighting::Elevation});
  o.fix.weights.elevation_a_m = dice.between(0.1, 2);
  o.fix.weights.elevation_b_m = dice.between(0.1, 2);
  o.troposphere = dice.chance(0.5);
  o.fix.correct_troposphere = dice.chance(0.5);
  o.ionosphere = dice.chance(0.3);
  o.fix.correct_ionosphere = dice.chance(0.3);
  o.clock.bias_s = dice.between(-0.01, 0.01);
  o.noise.enabled = dice.chance(0.5);
  o.noise.ou.mu_m = dice.between(-3, 3);
  o.noise.drift_enabled = dice.chance(0.3);
  o.fix.raim.enabled = dice.chance(0.05);
  if (!dice.chance(0.1)) return;
  // With strength; its randomness depends only on the seed.
  o.noise.enabled = false;
  o.signal.enabled = true;
  o.signal.loop_noise = false;
  o.signal.lock.warm_start = true;
  o.fix.cn0_mask_dbhz = dice.between(0, 45);
  if (dice.chance(0.5)) o.fix.weights.weighting = Weighting::Cn0;
}

void draw_propagation(Dice& dice, propagation::PropagationOptions& o) {
  o.model = dice.one_of({propagation::Model::Mirror, propagation::Model::Specular});
  o.reflection_order = dice.whole(0, 2);
  o.max_range_m = dice.between(50, 400);
  o.ground_reflection = dice.chance(0.2);
  o.diffraction = dice.chance(0.2);
  o.diffuse = dice.chance(0.1);
}

/// A mask that is this close to a satellite at a position.
double mask_below_a_satellite(Dice& dice, const orbit::Sky& sky, geodesy::GpsTime time, const Vector3d& ecef,
                              double margin_rad, double otherwise) {
  std::vector<double> elevations;
  for (const gnss::SatelliteId id : sky.satellites()) {
    const auto line = orbit::line_of_sight(sky, id, time, ecef);
    if (line && line->elevation_rad > radians(2) && line->elevation_rad < radians(50)) {
      elevations.push_back(line->elevation_rad);
    }
  }
  if (elevations.empty()) return otherwise;
  const auto one = static_cast<std::size_t>(dice.whole(0, static_cast<int>(elevations.size()) - 1));
  return elevations[one] - margin_rad;
}

Case draw_case(int number, const std::filesystem::path& folder) {
  Dice dice(kSeed, number);
  Case sampled;
  simulation::Scenario& scenario = sampled.scenario;
  heatmap::Request& request = sampled.request;
  city::SyntheticCityOptions city;
  city.blocks_east = dice.whole(1, 3);
  city.blocks_north = dice.whole(1, 3);
  city.block_size_m = dice.between(20, 60);
  city.street_width_m = dice.between(8, 30);
  city.max_height_m = dice.between(15, 120);
  city.seed = static_cast<std::uint64_t>(dice.whole(1, 1'000'000));
  const double height_m = dice.between(-20, 3000);
  city.origin = geodesy::Geodetic::from_degrees(dice.between(-70, 70), dice.between(-180, 180), height_m);
  scenario.city.source = city;
  scenario.city.origin = city.origin;

  constexpr auto kBegin = geodesy::GpsTime::from_nanoseconds(2400 * geodesy::GpsTime::kNanosecondsPerWeek);
  sampled.time = kBegin + std::chrono::seconds(dice.whole(0, 700'000));
  scenario.start = sampled.time;
  scenario.duration_s = 0;
  scenario.rate_hz = 1;
  // The seed of a map's first sample.
  scenario.seed =
      RandomStream(request.samples.seed, fmt::format("heatmap/{}/0", sampled.time.nanoseconds())).next();
  std::set<System> systems{System::GPS};
  for (const System system : {System::GLONASS, System::Galileo, System::BeiDou}) {
    if (dice.chance(0.4)) systems.insert(system);
  }
  sampled.navigation = orbit::nominal_constellation(sampled.time - 1.0, sampled.time + 1.0, systems);
  // RTKLIB's default set (ionmodel, rtkcmn.c).
  sampled.navigation.klobuchar[System::GPS] = {{0.1118e-07, -0.7451e-08, -0.5961e-07, 0.1192e-06},
                                               {0.1167e+06, -0.2294e+06, -0.1311e+06, 0.1049e+07}};
  rinex::write_rinex_navigation(folder / "sky.rnx", sampled.navigation);
  scenario.sky.navigation = {folder / "sky.rnx"};
  scenario.sky.systems = systems;
  scenario.sky.errors.enabled = false;

  const std::uint32_t across = 4;
  const double spacing_m = dice.between(0.5, 1.5);
  const double west_m = dice.between(-50, 50), south_m = dice.between(-50, 50);
  request.grid = heatmap::Grid::covering(west_m, south_m, west_m + across * spacing_m,
                                         south_m + across * spacing_m, spacing_m);
  request.grid.tile_size = dice.one_of({1U, 2U, across});
  request.altitudes_m = {dice.between(1, 20)};
  request.times = {sampled.time};
  request.layers = kLayers;
  request.samples.samples = 1;
  request.receivers.model = heatmap::ReceiverModel::Run;  // steady states have their own bounds and tests

  scenario.receivers.resize(1);
  simulation::ReceiverConfig& receiver = scenario.receivers.front();
  draw_receiver(dice, receiver.options);
  draw_propagation(dice, receiver.propagation);
  const geodesy::LocalFrame frame(city.origin);
  const Eigen::Vector2d middle(request.grid.west_m + across * spacing_m / 2,
                               request.grid.south_m + across * spacing_m / 2);
  const Vector3d point(middle.x(), middle.y(), request.altitudes_m.front());
  scenario.trajectory.waypoints = {frame.geodetic_from_local(point)};
  if (dice.chance(0.3)) {
    // The map uses satellites above the mask at the tile's centre. At a fix 1 km off, up is rotated by 2e-4
    // rad.
    const double margin_rad = 2.5e-4 + 3e-5 * std::pow(dice.between(0, 1), 2);
    const simulation::BuiltSky sky = simulation::build_sky(scenario.sky, sampled.time, sampled.time,
                                                           scenario.trajectory.waypoints.front());
    receiver.options.fix.elevation_mask_rad =
        mask_below_a_satellite(dice, *sky.sky, sampled.time, frame.ecef_from_local(point), margin_rad,
                               receiver.options.fix.elevation_mask_rad);
  }
  return sampled;
}

std::string words(const Case& sampled) {
  const receiver::ReceiverOptions& o = sampled.scenario.receivers.front().options;
  const propagation::PropagationOptions& p = sampled.scenario.receivers.front().propagation;
  std::string systems;
  for (const System system : sampled.scenario.sky.systems) systems += std::string(gnss::name(system)) + " ";
  return fmt::format(
      "{}mask {:.7f} deg, weights {}, at least {} satellites, at most {} iterations, convergence {:.1e} m, "
      "PDOP to {:.3g}, signal with ionosphere {} troposphere {}, corrected {} {}, noise {}, drift {}, RAIM "
      "{}, "
      "strength {}, C/N0 mask {:.1f}; model {} of order {}, ground {}, diffraction {}, diffuse {}, reach "
      "{:.0f} m; city {} at {:.0f} m; tiles of {} cells of {:.2f} m at {:.1f} m",
      systems, geodesy::degrees(o.fix.elevation_mask_rad), positioning::name(o.fix.weights.weighting),
      o.fix.min_satellites, o.fix.max_iterations, o.fix.convergence_m, o.fix.max_pdop, o.ionosphere,
      o.troposphere, o.fix.correct_ionosphere, o.fix.correct_troposphere, o.noise.enabled,
      o.noise.drift_enabled, o.fix.raim.enabled, o.signal.enabled, o.fix.cn0_mask_dbhz,
      p.model == propagation::Model::Mirror ? "mirror" : "specular", p.reflection_order, p.ground_reflection,
      p.diffraction, p.diffuse, p.max_range_m, sampled.scenario.city.as<city::SyntheticCityOptions>()->seed,
      sampled.scenario.city.origin->height_m, sampled.request.grid.tile_size, sampled.request.grid.spacing_m,
      sampled.request.altitudes_m.front());
}

/// A receiver for each cell, all of one scenario: antennas relative to the single position of its trajectory.
simulation::Simulation receivers_at_cells(const Case& sampled, const geodesy::LocalFrame& frame,
                                          city::City city) {
  simulation::Scenario scenario = sampled.scenario;
  const simulation::ReceiverConfig one = scenario.receivers.front();
  scenario.receivers.clear();
  const geodesy::Geodetic& mast = scenario.trajectory.waypoints.front();
  const heatmap::Grid& grid = sampled.request.grid;
  for (std::uint32_t row = 0; row < grid.rows; ++row) {
    for (std::uint32_t column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d centre = grid.centre(column, row);
      const Vector3d point(centre.x(), centre.y(), sampled.request.altitudes_m.front());
      simulation::ReceiverConfig receiver = one;
      receiver.lever_arm_m = geodesy::enu_from_ecef_rotation(mast) *
                             (frame.ecef_from_local(point) - geodesy::ecef_from_geodetic(mast));
      scenario.receivers.push_back(receiver);
    }
  }
  return {std::move(scenario), std::move(city)};
}

/// The values of a map at a point.
struct Result {
  bool free = true;
  bool solved = false;
  int visible = 0, used = 0;
  double horizontal_m = 0, vertical_m = 0, hdop = 0, pdop = 0, vdop = 0;
};

/// The receiver's values, with the noise (except its mean) removed from its measurements.
Result answer_of(const simulation::Epoch& epoch, const simulation::Simulation& simulation,
                 const receiver::ReceiverOptions& options) {
  Result result;
  result.free = epoch.containment == raytrace::Containment::Free;
  result.visible = epoch.observed.visible;
  positioning::Fix fix = epoch.observed.fix;
  if (options.noise.enabled && result.free) {
    std::vector<positioning::Measurement> measurements;
    for (const receiver::SatelliteObservation& satellite : epoch.observed.satellites) {
      if (!satellite.measurement) continue;
      measurements.push_back(*satellite.measurement);
      measurements.back().pseudorange_m -= satellite.noise_m - options.noise.ou.mu_m;
    }
    fix = positioning::solve_fix(epoch.observed.receiver_time, measurements, simulation.environment().sky(),
                                 options.fix, simulation.environment().klobuchar());
  }
  result.solved = fix.solved();
  result.used = static_cast<int>(fix.used.size());
  if (!result.solved) return result;
  const Vector3d error = geodesy::enu_from_ecef_rotation(epoch.truth.position) *
                         (fix.position_ecef - geodesy::ecef_from_geodetic(epoch.truth.position));
  result.horizontal_m = error.head<2>().norm();
  result.vertical_m = error.z();
  const double none = std::nan("");
  result.hdop = fix.dop ? fix.dop->hdop : none;
  result.pdop = fix.dop ? fix.dop->pdop : none;
  result.vdop = fix.dop ? fix.dop->vdop : none;
  return result;
}

Result answer_of(const heatmap::TileValues& values, std::size_t cells, std::size_t cell) {
  const auto value = [&](std::size_t layer) { return double{values.values[layer * cells + cell]}; };
  Result result;
  result.free = values.state[cell] == CellState::Computed;
  if (!result.free) return result;
  result.used = static_cast<int>(value(2));
  result.visible = static_cast<int>(value(6));
  result.solved = !std::isnan(value(0));
  result.horizontal_m = value(0);
  result.vertical_m = value(1);
  result.hdop = value(3);
  result.pdop = value(4);
  result.vdop = value(5);
  return result;
}

std::string words(const Result& a) {
  if (!a.free) return "covered";
  return a.solved ? fmt::format("fix of {} of {}, {:.4f} m and {:.4f} m off, PDOP {:.4f}", a.used, a.visible,
                                a.horizontal_m, a.vertical_m, a.pdop)
                  : fmt::format("none of {}", a.visible);
}

/// Whether arrivals change within 1 mm of a point: at the edge of a shadow or wall both results are accepted.
bool at_an_edge(const simulation::Environment& environment, const propagation::PropagationOptions& options,
                geodesy::GpsTime time, const Vector3d& point) {
  const propagation::Propagator propagator = environment.make_propagator(options);
  const geodesy::LocalFrame& frame = environment.city().frame;
  const auto look_angles = [&](const Vector3d& at) {
    std::vector<Vector3d> directions;
    for (const gnss::SatelliteId id : environment.sky().satellites()) {
      const auto line = orbit::line_of_sight(environment.sky(), id, time, frame.ecef_from_local(point));
      if (!line || !(line->elevation_rad > 0)) continue;
      directions.emplace_back(frame.ecef_from_local_rotation().transpose() * line->direction_ecef);
    }
    std::vector<propagation::SatellitePaths> paths(directions.size());
    propagator.trace(at, directions, paths);
    return paths;
  };
  const auto here = look_angles(point);
  for (const Vector3d& step : {Vector3d(1e-3, 0, 0), Vector3d(-1e-3, 0, 0), Vector3d(0, 1e-3, 0),
                               Vector3d(0, -1e-3, 0), Vector3d(0, 0, 1e-3), Vector3d(0, 0, -1e-3)}) {
    const auto there = look_angles(point + step);
    for (std::size_t i = 0; i < here.size(); ++i) {
      if (here[i].visibility != there[i].visibility || here[i].paths.size() != there[i].paths.size())
        return true;
      if (here[i].received() && std::abs(here[i].tracked_excess_m() - there[i].tracked_excess_m()) > 0.01) {
        return true;
      }
    }
  }
  return false;
}

struct Count {
  int cells = 0, covered = 0, fixes = 0, none = 0, extreme = 0, at_edges = 0, cases_failed = 0,
      by_receivers = 0;
  double worst = 0, worst_dop = 0;
};

/// Empty: equal.
std::string difference(const Result& map, const Result& receiver, const receiver::ReceiverOptions& options,
                       Count& count) {
  if (map.free != receiver.free) return "placement";
  if (!map.free) {
    ++count.covered;
    return {};
  }
  if (map.visible != receiver.visible) return "satellites received";
  const double off_m = std::hypot(receiver.horizontal_m, receiver.vertical_m);
  if (receiver.solved && (!(receiver.pdop < kWeakest) || off_m > kWidest_m)) {
    ++count.extreme;
    return {};
  }
  if (map.solved != receiver.solved) return "fix or none";
  if (map.used != receiver.used) return "satellites used";
  if (!map.solved) {
    ++count.none;
    return {};
  }
  ++count.fixes;
  const double metres = std::max(std::abs(map.horizontal_m - receiver.horizontal_m),
                                 std::abs(map.vertical_m - receiver.vertical_m));
  const double dop = std::max({std::abs(map.hdop / receiver.hdop - 1), std::abs(map.pdop / receiver.pdop - 1),
                               std::abs(map.vdop / receiver.vdop - 1)});
  const double fraction = metres / std::max(1.0, off_m);
  const bool through_atmosphere = options.troposphere || options.fix.correct_troposphere ||
                                  options.ionosphere || options.fix.correct_ionosphere;
  const bool coarse = options.fix.convergence_m > 1e-3;
  if (!(fraction < kLinear + (through_atmosphere || coarse ? kByAtmosphere : 0))) return "position";
  if (!(dop < 1e-3)) return "DOP";
  count.worst = std::max(count.worst, fraction);
  count.worst_dop = std::max(count.worst_dop, dop);
  return {};
}

void judge_case(int number, const std::filesystem::path& folder, Count& count) {
  const Case sampled = draw_case(number, folder);
  const simulation::ReceiverConfig& receiver = sampled.scenario.receivers.front();
  city::City city = city::synthetic_city(*sampled.scenario.city.as<city::SyntheticCityOptions>());
  const geodesy::LocalFrame frame = city.frame;
  const simulation::Simulation simulation = receivers_at_cells(sampled, frame, std::move(city));
  test::Recorder recorder;
  simulation.run({&recorder});
  const heatmap::Heatmap map(simulation.environment(), receiver, sampled.request, "property");
  count.by_receivers += heatmap::cell_method(receiver) == heatmap::CellMethod::Shared ? 0 : 1;

  std::vector<std::string> problems;
  const heatmap::Grid& grid = sampled.request.grid;
  for (std::size_t u = 0; u < map.unit_count(); ++u) {
    const heatmap::Tile tile = map.unit(u).tile;
    const heatmap::TileValues values = map.compute(u);
    for (std::size_t i = 0; i < tile.cells(); ++i) {
      const auto column = static_cast<std::uint32_t>(tile.first_column + i % tile.columns);
      const auto row = static_cast<std::uint32_t>(tile.first_row + i / tile.columns);
      const simulation::Epoch& epoch = recorder.epochs.at(std::size_t{row} * grid.columns + column);
      const Result expected = answer_of(epoch, simulation, receiver.options);
      const Result mapped = answer_of(values, tile.cells(), i);
      ++count.cells;
      const std::string problem = difference(mapped, expected, receiver.options, count);
      if (problem.empty()) continue;
      const Eigen::Vector2d centre = grid.centre(column, row);
      if (at_an_edge(simulation.environment(), receiver.propagation, sampled.time,
                     {centre.x(), centre.y(), sampled.request.altitudes_m.front()})) {
        ++count.at_edges;
        continue;
      }
      problems.push_back(fmt::format("\n  cell {} {}: {}; map: {}; receiver: {}", column, row, problem,
                                     words(mapped), words(expected)));
    }
  }
  if (problems.empty()) return;
  ++count.cases_failed;
  problems.resize(std::min<std::size_t>(problems.size(), 3));
  ADD_FAILURE() << "case " << number << " of seed " << kSeed << ": " << words(sampled)
                << fmt::format("{}", fmt::join(problems, ""));
}

TEST(HeatmapProperty, MapsAreWhatReceiversFindWhateverTheirOptions) {
  const test::TemporaryFolder folder;
  Count count;
  for (int number = 0; number < kCases; ++number) judge_case(number, folder.path(), count);
  std::cout << fmt::format(
      "{} cases ({} by receivers of their own), {} cells: {} fixes within {:.1e} and DOPs within {:.1e}, "
      "{} "
      "without a fix, {} covered, {} beyond the promise, {} at edges; {} cases failed\n",
      kCases, count.by_receivers, count.cells, count.fixes, count.worst, count.worst_dop, count.none,
      count.covered, count.extreme, count.at_edges, count.cases_failed);
  EXPECT_GT(count.fixes, count.cells / 4);
  EXPECT_GT(count.none, count.cells / 20);
  EXPECT_LT(count.extreme, count.cells / 20);
  EXPECT_LT(count.at_edges, count.cells / 100);
}

}  // namespace
}  // namespace canyon::heatmap_property_test
