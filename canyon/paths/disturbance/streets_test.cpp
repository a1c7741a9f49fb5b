#include "canyon/paths/disturbance/streets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::disturbance::streets_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geodesy::GpsTime;
using propagation::Path;
using propagation::PathKind;
using ::testing::HasSubstr;

const GpsTime kStart = GpsTime::from_week(2051, 46701);
constexpr double kWavelength = geodesy::kSpeedOfLight / 1575.42e6;

/// Vehicles only.
StreetOptions traffic() {
  StreetOptions options;
  options.enabled = true;
  options.trees_per_km = options.signs_per_km = options.awnings_per_km = options.footbridges_per_km = 0;
  options.azimuth_deg = 90;
  return options;
}

std::vector<Body> bodies(const Street& street, GpsTime time, const Road* road = nullptr,
                         const Vector3d& antenna = {0, 0, 1.8}) {
  std::vector<Body> found;
  street.near(time, road, antenna, 0, found);
  return found;
}

/// East for 400 m, then north for 400 m, at 10 m/s with a stop of 30 s at the corner.
Road corner() {
  Road road;
  for (int k = 0; k <= 40; ++k) road.add(kStart + k, Vector2d(10 * k, 0));
  for (int k = 0; k <= 40; ++k) road.add(kStart + (70 + k), Vector2d(400, 10 * k));
  return road;
}

Blockage blockage(const Body& body, const Vector3d& antenna, const Vector3d& arrival, double leg_m,
                  double wavelength_m) {
  return disturbance::blockage(body, SightLine(antenna, arrival, leg_m), wavelength_m);
}

TEST(Road, TellsWayAndDirection) {
  const Road road = corner();
  EXPECT_TRUE(road.leads());
  EXPECT_NEAR(road.along_m(kStart + 12.5), 125, 1e-9);
  EXPECT_NEAR(road.along_m(kStart + 50.0), 400, 1e-9);
  EXPECT_NEAR(road.along_m(kStart + 1000.0), 800, 1e-9);
  EXPECT_NEAR((road.at(125).point - Vector2d(125, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((road.at(125).ahead - Vector2d(1, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((road.at(400).ahead - Vector2d(1, 1).normalized()).norm(), 0, 1e-9);
  // Straight beyond both ends.
  EXPECT_NEAR((road.at(-50).point - Vector2d(-50, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((road.at(850).point - Vector2d(400, 450)).norm(), 0, 1e-9);
}

TEST(Street, HasTheDensityAndTheMixThatAreAskedFor) {
  StreetOptions options = traffic();
  options.region = StreetRegion::EastAsia;
  options.vehicles_per_km = 30;
  options.lanes = 2;
  std::map<double, int> lengths;
  int count = 0, sample_count = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Street street(options, seed);
    for (int k = 0; k < 100; ++k, ++sample_count) {
      for (const Body& body : bodies(street, kStart + 977.0 * k)) {
        ++count;
        ++lengths[2 * body.half_length_m];
      }
    }
  }
  // An antenna at rest keeps its own lane free: three lanes over 100 m. About 6.6 slots of each are occupied
  // with a probability of 0.45: the deviation of a sample is 2.2, of the mean of 2,000 0.05 vehicles, 0.6 %.
  const double expected = 3 * 30 * 0.1 * sample_count;
  EXPECT_NEAR(count, expected, 0.025 * expected);
  // Cars have 4.5 m, 60 % of East Asia's vehicles; double-deckers and buses 12 m, 11 %.
  EXPECT_NEAR(lengths[4.5] / static_cast<double>(count), 0.60, 0.03);
  EXPECT_NEAR(lengths[12.0] / static_cast<double>(count), 0.11, 0.02);
}

// For an infinite row of vehicles of length L, k per metre, a direction perpendicular to the road is blocked
// for the fraction k L of the time.
TEST(Street, BlocksADirectionSquareToTheRoadForTheShareOfItsVehiclesLength) {
  StreetOptions options = traffic();
  options.region = StreetRegion::Tr37885;
  options.vehicle_fractions = {{"tr37885_bus", 1}};
  options.lanes = 1;
  options.vehicles_per_km = 25;
  options.antenna_height_m = 1.6;
  int blocked = 0, sample_count = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Street street(options, seed);
    for (int k = 0; k < 100; ++k, ++sample_count) {
      const Vector3d antenna(0, 0, 1.6);
      // The road is eastwards, vehicles drive on the right: the oncoming lane is to the north, its near side
      // 2 m away and 1.4 m higher than the antenna, 35 deg.
      for (const Body& body : bodies(street, kStart + 977.0 * k, nullptr, antenna)) {
        const Vector3d s = geodesy::enu_from_azimuth_elevation(0, geodesy::radians(30));
        blocked += blockage(body, antenna, s, std::numeric_limits<double>::infinity(), kWavelength).cuts;
        const Vector3d over = geodesy::enu_from_azimuth_elevation(0, geodesy::radians(36));
        EXPECT_FALSE(
            blockage(body, antenna, over, std::numeric_limits<double>::infinity(), kWavelength).cuts);
      }
    }
  }
  // A binomial deviation of 4000 samples is 0.0074.
  EXPECT_NEAR(blocked / static_cast<double>(sample_count), 0.025 * 13, 4 * 0.0074);
}

TEST(Street, MovesBodiesSteadilyAndStopsThemAtRedLights) {
  StreetOptions options = traffic();
  options.lanes = 1;
  options.vehicles_per_km = 65;
  options.cycle_s = 90;
  options.red_s = 40;
  const Street street(options, 5);
  const double speed_mps = street_numbers(options).speed_mps;
  constexpr double kStep = 0.1;
  std::map<std::uint64_t, Vector2d> before;
  int running = 0, is_stationary = 0;
  for (int k = 0; k < 9000; ++k) {
    std::map<std::uint64_t, Vector2d> now;
    for (const Body& body : bodies(street, kStart + kStep * k)) now[body.name] = body.centre;
    double moved = -1;
    for (const auto& [name, point] : now) {
      const auto was = before.find(name);
      if (was == before.end()) continue;
      moved = (point - was->second).norm();
      EXPECT_LE(moved, speed_mps * kStep + 1e-5);
      EXPECT_NEAR(point.y(), was->second.y(), 1e-5);
    }
    running += moved > speed_mps * kStep - 1e-5;
    is_stationary += moved >= 0 && moved < 1e-5;
    before = now;
  }
  // Green for 50 of 90 s, over ten cycles.
  EXPECT_NEAR(running / static_cast<double>(running + is_stationary), 50.0 / 90, 0.02);
}

TEST(Street, SparesTheAntennasVehicleAndOthers) {
  StreetOptions options = traffic();
  options.vehicles_per_km = 65;
  const Road road = corner();
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Street street(options, seed);
    for (int k = 0; k <= 110; ++k) {
      const GpsTime time = kStart + k;
      const Road::Point own = road.at(road.along_m(time));
      const std::vector<Body> around = bodies(street, time, &road);
      EXPECT_GT(around.size(), 10U);
      // At a corner lanes of both streets overlap; Streets omits bodies that contain the antenna.
      if (std::abs(road.along_m(time) - 400) < 60) continue;
      for (const Body& body : around) {
        const Vector2d from = body.centre - own.point;
        const double ahead = std::abs(from.dot(own.ahead));
        const double aside = std::abs(own.ahead.x() * from.y() - own.ahead.y() * from.x());
        EXPECT_TRUE(ahead > 2.5 + body.half_length_m || aside > 1 + body.half_width_m);
        for (const Body& other : around) {
          const Vector2d between = other.centre - body.centre;
          if (&other == &body || std::abs(between.y() * own.ahead.x() - between.x() * own.ahead.y()) > 1) {
            continue;
          }
          EXPECT_GE(between.norm(), body.half_length_m + other.half_length_m + 2 - 1e-6);
        }
      }
    }
  }
}

TEST(Street, IsAFunctionOfSeedTimeAndRoad) {
  StreetOptions options;
  options.enabled = true;
  const Road road = corner();
  const Street one(options, 1), again(options, 1), other(options, 2);
  const auto points = [&](const Street& street, double seconds, const Vector3d& antenna) {
    std::vector<double> numbers;
    for (const Body& body : bodies(street, kStart + seconds, &road, antenna)) {
      numbers.insert(numbers.end(), {body.centre.x(), body.centre.y(), body.top_m});
    }
    return numbers;
  };
  const std::vector<double> first = points(one, 20, {200, 0, 1.8});
  EXPECT_FALSE(first.empty());
  (void)points(one, 77, {400, 70, 1.8});
  EXPECT_EQ(points(one, 20, {200, 0, 1.8}), first);
  EXPECT_EQ(points(again, 20, {200, 0, 1.8}), first);
  // Another receiver of the vehicle sees the same bus at the same position.
  EXPECT_EQ(points(again, 20, {201.5, 0.7, 1.8}), first);
  EXPECT_NE(points(other, 20, {200, 0, 1.8}), first);
}

TEST(Street, HasTheFurnitureThatIsAskedFor) {
  StreetOptions options = traffic();
  options.vehicles_per_km = 0;
  EXPECT_TRUE(bodies(Street(options, 1), kStart).empty());
  const auto mean = [&](const auto& set, Body::Kind kind) {
    StreetOptions with = options;
    set(with);
    int count = 0;
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
      for (const Body& body : bodies(Street(with, seed), kStart)) count += body.kind == kind;
    }
    return count / 400.0;
  };
  // 100 m of both sides; a Poisson deviation of 400 samples of 8 is 0.14.
  EXPECT_NEAR(mean([](StreetOptions& o) { o.trees_per_km = 40; }, Body::Kind::Crown), 8, 0.6);
  EXPECT_NEAR(mean([](StreetOptions& o) { o.signs_per_km = 40; }, Body::Kind::Structure), 8, 0.6);
  EXPECT_NEAR(mean([](StreetOptions& o) { o.awnings_per_km = 40; }, Body::Kind::Structure), 8, 0.6);
  EXPECT_NEAR(mean([](StreetOptions& o) { o.footbridges_per_km = 10; }, Body::Kind::Structure), 1, 0.2);
}

/// A satellite in clear view.
propagation::Arrival arrival(const Vector3d& satellite) {
  propagation::Arrival result;
  result.antenna_enu = {0, 0, 1.6};
  propagation::SatelliteView view;
  view.line.direction_ecef = satellite;
  Path path;
  path.arrival = satellite;
  path.arrival_elevation_rad = std::asin(satellite.z());
  view.paths.paths = {path};
  result.views = {view};
  return result;
}

TEST(Streets, MakeADirectPathADiffractedOneWhereABusCutsIt) {
  StreetsOptions options;
  options.street = traffic();
  options.street.lanes = 1;
  options.street.vehicle_fractions = {{"double_decker", 1}};
  options.street.antenna_height_m = 1.6;
  const Vector3d north = geodesy::enu_from_azimuth_elevation(0, geodesy::radians(25));
  StreetsOptions ideal = options;
  ideal.strength = false;
  int cut = 0, mirrored = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Streets streets(options, seed), hard(ideal, seed);
    propagation::Arrival soft_arrival = arrival(north), hard_arrival = arrival(north);
    const propagation::Antenna antenna{kStart, {}, {}};
    streets.apply(antenna, soft_arrival);
    hard.apply(antenna, hard_arrival);
    const std::vector<Path>& paths = soft_arrival.views[0].paths.paths;
    if (paths.empty()) continue;
    const bool is_cut = paths.front().kind == PathKind::Diffracted;
    EXPECT_EQ(hard_arrival.views[0].paths.paths.empty(), is_cut);
    cut += is_cut;
    if (is_cut) {
      EXPECT_LT(paths.front().amplitude_factor, 0.6);
      EXPECT_GT(paths.front().excess_m, 0);
      EXPECT_LT(paths.front().excess_m, 3);
    }
    // From the south the oncoming lane's side, 2.05 m away, is a mirror.
    propagation::Arrival south =
        arrival(geodesy::enu_from_azimuth_elevation(geodesy::kPi, geodesy::radians(25)));
    hard.apply(antenna, south);
    for (const Path& path : south.views[0].paths.paths) {
      if (path.kind != PathKind::Reflected) continue;
      ++mirrored;
      EXPECT_NEAR(path.excess_m, 2 * 2.05 * std::cos(geodesy::radians(25)), 1e-9);
    }
    EXPECT_EQ(is_cut, south.views[0].paths.paths.size() == 2);
  }
  EXPECT_GT(cut, 5);
  EXPECT_EQ(mirrored, cut);
}

TEST(Streets, TellWhereTheirBodiesAre) {
  StreetsOptions options;
  options.street = traffic();
  const std::vector<Body> expected = bodies(Street(options.street, 3), kStart);
  ASSERT_FALSE(expected.empty());
  Streets streets(options, 3);
  for (int epoch = 0; epoch < 2; ++epoch) {
    propagation::Arrival one = arrival(geodesy::enu_from_azimuth_elevation(0, geodesy::radians(30)));
    one.bodies.emplace_back().name = 7;  // a host's
    streets.apply({kStart, {}, {}}, one);
    ASSERT_EQ(one.bodies.size(), expected.size() + 1);
    EXPECT_EQ(one.bodies[0].name, 7U);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(one.bodies[i + 1].name, expected[i].name);
      EXPECT_EQ(one.bodies[i + 1].centre, expected[i].centre);
    }
  }
}

TEST(Streets, AddTheCrownsOnTheWay) {
  StreetsOptions options;
  options.street = traffic();
  options.street.vehicles_per_km = 0;
  options.street.trees_per_km = 200;
  double depth = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Streets streets(options, seed);
    propagation::Arrival one = arrival(geodesy::enu_from_azimuth_elevation(0, geodesy::radians(30)));
    streets.apply({kStart, {}, {}}, one);
    ASSERT_EQ(one.views[0].paths.paths.size(), 1U);
    EXPECT_EQ(one.views[0].paths.paths[0].amplitude_factor, 1);
    depth = std::max(depth, one.views[0].paths.paths[0].foliage_depth_m);
  }
  EXPECT_GT(depth, 2);
}

TEST(StreetOptions, RefuseWhatCannotBe) {
  const test::SpoiledOptions<StreetOptions> problem;
  EXPECT_EQ(problem([](StreetOptions&) {}), "");
  EXPECT_THAT(problem([](StreetOptions& o) { o.vehicles_per_km = 70; }), HasSubstr("vehicles_per_km"));
  EXPECT_THAT(problem([](StreetOptions& o) { o.red_s = 91; }), HasSubstr("red_phase_s"));
  EXPECT_THAT(problem([](StreetOptions& o) { o.vehicle_fractions = {{"tank", 1}}; }), HasSubstr("'tank'"));
  EXPECT_THAT(problem([](StreetOptions& o) { o.vehicle_fractions = {{"car", 0}}; }), HasSubstr("all 0"));
}

TEST(StreetNumbers, FollowTheFundamentalDiagram) {
  for (std::size_t region = 0; region < 4; ++region) {
    double sum = 0;
    for (const VehicleClass& each : vehicle_classes()) sum += each.weights.at(region);
    EXPECT_NEAR(sum, 1, 1e-12);
  }
  StreetOptions options;
  options.speed_mps = 14;
  options.vehicles_per_km = 20;
  EXPECT_EQ(street_numbers(options).speed_mps, 14);
  // 5 m/s (140 / 56 - 1) = 7.5 m/s.
  options.vehicles_per_km = 56;
  EXPECT_NEAR(street_numbers(options).speed_mps, 7.5, 1e-12);
}

}  // namespace
}  // namespace canyon::disturbance::streets_test
