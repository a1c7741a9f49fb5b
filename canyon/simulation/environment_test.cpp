#include "canyon/simulation/environment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using propagation::Visibility;
using test::error_of;
using ::testing::HasSubstr;

const GpsTime kTime = GpsTime::from_week(2051, 46701);
const Geodetic kOrigin = Geodetic::from_degrees(22.3, 114.17, 0);

// One building 100 m high whose northern wall is 20 m south of the origin, over flat ground.
city::City one_building() {
  city::City city;
  city.name = "one building";
  city.frame = geodesy::LocalFrame(kOrigin);
  city::append_object(city.mesh, "ground", city::Surface::Terrain, city::Material::Ground,
                      {{-500, -500, 0}, {500, -500, 0}, {500, 500, 0}, {-500, 500, 0}},
                      {{0, 1, 2}, {0, 2, 3}});
  canyon::test::append_box(city.mesh, "building", city::Surface::Building, city::Material::Concrete,
                           {-200, -60, 0}, {200, -20, 100});
  return city;
}

// Satellites in the south (behind the building), in the north, and near the zenith; one azimuth without
// symmetry.
std::shared_ptr<const orbit::Sky> sky() {
  return std::make_shared<orbit::FrozenSky>(kOrigin, std::vector<double>{geodesy::kPi, 0.3, 2.0},
                                            std::vector<double>{0.5, 0.7, 1.5});
}

TEST(Environment, CastsRaysWhereTheSatellitesStand) {
  const Environment environment(one_building(), sky());
  const auto propagator = environment.make_propagator({});
  const propagation::Arrival arrival = environment.arrival(kTime, {0, 0, 2}, propagator);
  EXPECT_EQ(arrival.containment, raytrace::Containment::Free);
  ASSERT_EQ(arrival.views.size(), 3U);
  EXPECT_EQ(to_string(arrival.views[0].line.id), "G01");
  EXPECT_NEAR(arrival.views[1].line.azimuth_rad, 0.3, 1e-6);
  EXPECT_NEAR(arrival.views[1].line.elevation_rad, 0.7, 1e-6);
  EXPECT_EQ(arrival.views[0].paths.visibility, Visibility::Blocked)
      << "south, behind the building, no wall opposite";
  EXPECT_NE(arrival.views[1].paths.visibility, Visibility::Blocked);
  EXPECT_EQ(arrival.views[2].paths.visibility, Visibility::LOS);
}

// The southern wall of the street reflects the satellite in the north: excess 2 h (n.s) with h = 20 m and
// n.s = cos(elevation) cos(azimuth).
TEST(Environment, ReflectionHasTheClosedFormExcess) {
  const Environment environment(one_building(), sky());
  const auto propagator = environment.make_propagator({});
  const propagation::Arrival arrival = environment.arrival(kTime, {0, 0, 2}, propagator);
  ASSERT_EQ(arrival.views[1].paths.visibility, Visibility::LOSMultipath);
  ASSERT_EQ(arrival.views[1].paths.paths.size(), 2U);
  EXPECT_NEAR(arrival.views[1].paths.paths[1].excess_m, 2 * 20 * std::cos(0.7) * std::cos(0.3), 1e-3);
}

TEST(Environment, InsideABuildingEverySatelliteIsBlocked) {
  const Environment environment(one_building(), sky());
  const auto propagator = environment.make_propagator({});
  const propagation::Arrival inside = environment.arrival(kTime, {0, -40, 10}, propagator);
  EXPECT_EQ(inside.containment, raytrace::Containment::InsideBuilding);
  const propagation::Arrival under = environment.arrival(kTime, {0, 100, -3}, propagator);
  EXPECT_EQ(under.containment, raytrace::Containment::UnderTerrain);
  for (const propagation::Arrival& arrival : {inside, under}) {
    ASSERT_EQ(arrival.views.size(), 3U);
    for (const auto& view : arrival.views) {
      EXPECT_EQ(view.paths.visibility, Visibility::Blocked);
      EXPECT_TRUE(view.paths.paths.empty());
    }
  }
}

// Vehicles of simulators rest some centimetres below the ground.
TEST(Environment, AntennasJustUnderTheTerrainStandOnIt) {
  const Environment environment(one_building(), sky());
  const auto propagator = environment.make_propagator({});
  const propagation::Arrival on = environment.arrival(kTime, {0, 0, 0.01}, propagator);
  for (const double up_m : {-0.04, -0.49}) {
    const propagation::Arrival sunk = environment.arrival(kTime, {0, 0, up_m}, propagator);
    EXPECT_EQ(sunk.containment, raytrace::Containment::Free) << up_m;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(sunk.views[i].paths.visibility, on.views[i].paths.visibility) << up_m;
      EXPECT_EQ(sunk.views[i].paths.paths.size(), on.views[i].paths.paths.size()) << up_m;
    }
  }
  EXPECT_EQ(environment.arrival(kTime, {0, 0, -0.51}, propagator).containment,
            raytrace::Containment::UnderTerrain);
  // A point in a cellar is not in ground contact.
  EXPECT_NE(environment.arrival(kTime, {0, -40, -0.1}, propagator).containment, raytrace::Containment::Free);
}

TEST(Environment, RefusesWhatIsNoPlace) {
  const Environment environment(one_building(), sky());
  const auto propagator = environment.make_propagator({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Vector3d& pose :
       {Eigen::Vector3d(nan, 0, 2), Eigen::Vector3d(0, 0, INFINITY), Eigen::Vector3d(1e300, 0, 2)}) {
    EXPECT_THAT(error_of([&] { (void)environment.arrival(kTime, pose, propagator); }).what(),
                HasSubstr("is not finite, or more than 10000 km away"));
  }
  EXPECT_THROW(Environment(one_building(), nullptr), InputError);
}

TEST(Environment, PropagatorsSurviveItsMove) {
  Environment first(one_building(), sky());
  const auto propagator = first.make_propagator({});
  const Environment second(std::move(first));
  EXPECT_EQ(second.arrival(kTime, {0, 0, 2}, propagator).views[2].paths.visibility, Visibility::LOS);
}

// Azimuth and elevation refer to the antenna's own vertical, rays to the city's frame: 8 km east the two
// verticals differ by 1.26 mrad, and the direction rotated through ECEF distinguishes them.
TEST(Environment, GetsAnotherSkyOverTheSameCity) {
  const Environment environment(one_building(), sky());
  const auto other =
      std::make_shared<orbit::FrozenSky>(kOrigin, std::vector<double>{0.4}, std::vector<double>{0.9});
  const Environment wider = environment.under(other);
  EXPECT_EQ(&wider.city(), &environment.city());
  EXPECT_EQ(&wider.scene(), &environment.scene());
  const propagation::Propagator propagator = environment.make_propagator({});
  EXPECT_EQ(wider.arrival(kTime, {0, 0, 2}, propagator).views.size(), 1U);
  EXPECT_EQ(environment.arrival(kTime, {0, 0, 2}, propagator).views.size(), 3U);
}

TEST(Environment, DirectionsAreInTheCitysFrameFarFromItsOrigin) {
  auto nominal = std::make_shared<orbit::BroadcastSky>(
      orbit::nominal_constellation(kTime - 10.0, kTime + 10.0, {gnss::System::GPS}));
  city::City city;
  city.frame = geodesy::LocalFrame(kOrigin);
  const Environment environment(std::move(city), nominal);
  const auto propagator = environment.make_propagator({});
  const Eigen::Vector3d antenna(8000, 0, 2);
  const propagation::Arrival arrival = environment.arrival(kTime, antenna, propagator);
  ASSERT_GE(arrival.views.size(), 6U);
  const geodesy::LocalFrame& frame = environment.city().frame;
  double largest_tilt = 0;
  for (const auto& view : arrival.views) {
    ASSERT_EQ(view.paths.paths.size(), 1U);
    const Eigen::Vector3d expected =
        (frame.local_from_ecef(view.line.position_at_reception_m) - antenna).normalized();
    EXPECT_LT((view.paths.paths[0].arrival - expected).norm(), 1e-9);
    const Eigen::Vector3d local_vertical =
        geodesy::enu_from_azimuth_elevation(view.line.azimuth_rad, view.line.elevation_rad);
    largest_tilt = std::max(largest_tilt, (local_vertical - expected).norm());
    EXPECT_GT(view.line.elevation_rad, 0);
  }
  EXPECT_NEAR(largest_tilt, 8000 / 6.378e6, 3e-4);
}

TEST(Environment, SatellitesAreAscendingAndAboveTheHorizon) {
  auto nominal = std::make_shared<orbit::BroadcastSky>(orbit::nominal_constellation(
      kTime - 10.0, kTime + 10.0, {gnss::System::GPS, gnss::System::Galileo, gnss::System::BeiDou}));
  city::City city;
  city.frame = geodesy::LocalFrame(kOrigin);
  const Environment environment(std::move(city), nominal);
  const auto propagator = environment.make_propagator({});
  const propagation::Arrival arrival = environment.arrival(kTime, {0, 0, 2}, propagator);
  std::size_t expected = 0;
  for (const gnss::SatelliteId id : nominal->satellites()) {
    const auto line =
        orbit::line_of_sight(*nominal, id, kTime, environment.city().frame.ecef_from_local({0, 0, 2}));
    expected += line && line->elevation_rad > 0;
  }
  EXPECT_EQ(arrival.views.size(), expected);
  for (std::size_t i = 1; i < arrival.views.size(); ++i) {
    EXPECT_LT(arrival.views[i - 1].line.id, arrival.views[i].line.id);
  }
}

}  // namespace
}  // namespace canyon::simulation
