#include "canyon/analysis/heatmap/engine/map_request.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::heatmap {
namespace {

using geodesy::GpsTime;
using geodesy::parse_time;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const GpsTime kStart = parse_time("2026-03-01T10:00:00Z");

std::string fault(const std::string& text, std::optional<GpsTime> start = kStart) {
  return test::refusal([&] { (void)parse_times(text, start); });
}

TEST(MapRequest, ReadsTimes) {
  EXPECT_THAT(parse_times("", kStart), ElementsAre(kStart));
  EXPECT_THAT(parse_times("600, 0 ,600,2026-03-01T10:05:00Z", kStart),
              ElementsAre(kStart, kStart + 300.0, kStart + 600.0));
  // Both ends of a range; of a day the end is left out. 86,164 s in steps of 8 h: 0, 8 and 16 h.
  EXPECT_THAT(parse_times("0/600/5min", kStart), ElementsAre(kStart, kStart + 300.0, kStart + 600.0));
  EXPECT_THAT(parse_times("day/8h", kStart), ElementsAre(kStart, kStart + 28'800.0, kStart + 57'600.0));
  EXPECT_THAT(fault("soon"), HasSubstr("soon"));
  EXPECT_THAT(fault("0/60"), HasSubstr("day/STEP"));
  EXPECT_THAT(fault("60/0/10"), HasSubstr("is before the begin"));
  EXPECT_THAT(fault("0/60/fast"), HasSubstr("'fast' is not a valid step"));
  EXPECT_THAT(fault("day/0.1"), HasSubstr("861640"));
  EXPECT_THAT(fault("600", std::nullopt), HasSubstr("start"));
  EXPECT_THAT(fault("1975-01-01T00:00:00Z"), HasSubstr("1980-01-06"));
}

TEST(MapRequest, BoxesAroundACity) {
  const city::City city = city::synthetic_city({});
  const city::Box bounds = city.bounds();
  const EnuBox built = built_box(city);
  EXPECT_GE(built.min.x(), bounds.min.x());
  EXPECT_LE(built.max.y(), bounds.max.y());
  // A box in degrees contains its corners; 0.001 deg of latitude are 110.7 m at 22 deg (WGS 84).
  const auto corner = city.frame.geodetic_from_local({-50, -40, 0});
  const double west = geodesy::degrees(corner.longitude_rad), south = geodesy::degrees(corner.latitude_rad);
  const EnuBox box = enu_box({west, south, west + 0.001, south + 0.001}, city.frame);
  EXPECT_NEAR(box.min.x(), -50, 0.01);
  EXPECT_NEAR(box.min.y(), -40, 0.01);
  EXPECT_NEAR(box.max.y() - box.min.y(), 110.7, 0.2);
  EXPECT_NO_THROW(check_box(box, city));
  const std::array<double, 4> around = degrees_around({{-50, -40}, {60, 70}}, city.frame);
  EXPECT_NEAR(around[0], west, 1e-8);
  EXPECT_NEAR(around[1], south, 1e-8);
  EXPECT_NEAR((around[3] - around[1]) * 110.7e3, 110, 0.2);
  const geodesy::LocalFrame fiji(geodesy::Geodetic::from_degrees(-16, 180, 0));
  const std::array<double, 4> across = degrees_around({{-100, -100}, {100, 100}}, fiji);
  EXPECT_NEAR(across[0], 180 - 0.000934, 1e-5);
  EXPECT_NEAR(across[2], -180 + 0.000934, 1e-5);
  EXPECT_THROW((void)enu_box({1, 2, 1, 3}, city.frame), InputError);
  EXPECT_THROW((void)enu_box({1, 95, 2, 96}, city.frame), InputError);
  EXPECT_THROW(check_box({{10, 0}, {-10, 5}}, city::City{}), InputError);
  EXPECT_THROW((void)built_box(city::City{}), InputError);
  EXPECT_THROW(check_box({{1e5, 1e5}, {1.1e5, 1.1e5}}, city), InputError);
  EXPECT_THROW(check_box({{-2e4, -10}, {10, 10}}, city), InputError);
}

TEST(MapRequest, RefusesAltitudesBelowTheCity) {
  const city::City city = city::synthetic_city({});
  Request request;
  request.altitudes_m = {-1};
  EXPECT_THROW(check_altitudes(request, city), InputError);
  request.altitudes_m = {0, 15};
  EXPECT_NO_THROW(check_altitudes(request, city));
  request.altitude_kind = AltitudeKind::Ellipsoid;
  request.altitudes_m = {city.frame.origin().height_m + city.bounds().min.z() - 1};
  EXPECT_THROW(check_altitudes(request, city), InputError);
}

TEST(MapRequest, UsualAltitudeIsTheTrajectorys) {
  simulation::Scenario scenario;
  EXPECT_EQ(usual_altitude_m(scenario, AltitudeKind::AboveTerrain), 15);
  scenario.trajectory.height_above_terrain_m = 1.5;
  EXPECT_EQ(usual_altitude_m(scenario, AltitudeKind::AboveTerrain), 1.5);
  EXPECT_EQ(usual_altitude_m(scenario, AltitudeKind::Ellipsoid), 15);
}

TEST(MapRequest, InputKeyTellsCitiesAndSkies) {
  const auto key = [](std::uint64_t seed, gnss::System system, double later_s) {
    city::SyntheticCityOptions options;
    options.seed = seed;
    const simulation::Environment environment(city::synthetic_city(options),
                                              std::make_shared<test::CircularSky>(std::vector{system}));
    return input_key(environment, {test::CircularSky::kEpoch + later_s});
  };
  const std::string one = key(1, gnss::System::GPS, 3600);
  EXPECT_EQ(key(1, gnss::System::GPS, 3600), one);
  EXPECT_NE(key(2, gnss::System::GPS, 3600), one);
  EXPECT_NE(key(1, gnss::System::Galileo, 3600), one);
  EXPECT_NE(key(1, gnss::System::GPS, 3601), one);
}

}  // namespace
}  // namespace canyon::heatmap
