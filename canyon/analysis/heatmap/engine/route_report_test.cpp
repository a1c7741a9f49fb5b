#include "canyon/analysis/heatmap/engine/route_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::heatmap::route_report_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geodesy::GpsTime;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
const geodesy::LocalFrame kFrame(geodesy::Geodetic::from_degrees(48, 11, 500));
const GpsTime kStart = GpsTime::from_week(2300, 0);

simulation::Trajectory drive(const std::vector<Vector2d>& corners, double speed_mps) {
  std::vector<simulation::Waypoint> points;
  for (const Vector2d& corner : corners) {
    points.push_back({kFrame.geodetic_from_local({corner.x(), corner.y(), 20}), speed_mps});
  }
  return simulation::Trajectory::from_waypoints(kStart, points, std::nullopt);
}

MapSample result(std::vector<float> values, CellState state = CellState::Computed) {
  MapSample result;
  result.values = std::move(values);
  result.state = state;
  return result;
}

// 200 m eastwards. Error: 2 m west of east 100, then 10 m; none from 140 to 160 (no fix); a building from
// 180.
const std::vector<Layer> kLayers{Layer::SatellitesUsed, Layer::HorizontalError};
std::optional<MapSample> street(const Vector2d& enu, double /*altitude*/, GpsTime /*time*/) {
  if (enu.x() > 180) return result({kNaN, kNaN}, CellState::InsideBuilding);
  if (enu.x() > 140 && enu.x() < 160) return result({3, kNaN});
  return result({8, enu.x() < 100 ? 2.0F : 10.0F});
}

TEST(JudgeRoute, TellsExpectedErrorAvailabilityAndTheWorstStretch) {
  RouteOptions options;
  options.step_m = 0.5;
  options.stretch_m = 40;
  const RouteReport report = report_route(street, kFrame, kLayers, drive({{0, 0}, {200, 0}}, 10), options);
  EXPECT_NEAR(report.length_m, 200, 0.01);
  EXPECT_NEAR(report.duration_s, 20, 0.001);
  // The route is slightly longer than 200 m on the ellipsoid, or not: 400 or 401 pieces.
  EXPECT_NEAR(static_cast<double>(report.stations.size()), 400, 1);
  EXPECT_NEAR(static_cast<double>(report.no_answer), 40, 1);
  EXPECT_EQ(report.outside, 0U);
  EXPECT_EQ(report.known + report.no_answer, report.stations.size());
  // 160 of 180 m have a fix: 100 m with 2 m, 60 m with 10 m.
  ASSERT_TRUE(report.availability);
  EXPECT_NEAR(*report.availability, 160.0 / 180, 0.005);
  ASSERT_EQ(report.error, 1U);
  const LayerSummary& error = report.layers[1];
  EXPECT_NEAR(error.mean, (100 * 2 + 60 * 10) / 160.0, 0.05);
  EXPECT_EQ(error.median, 2);
  EXPECT_EQ(error.p95, 10);
  EXPECT_EQ(error.least, 2);
  EXPECT_EQ(error.greatest, 10);
  EXPECT_EQ(report.layers[0].values, report.known);
  // The first 40 m with nothing but 10 m begin at 100 m.
  ASSERT_TRUE(report.worst);
  EXPECT_NEAR(*report.worst_error_m, 10, 1e-9);
  EXPECT_NEAR(report.worst->from_m, 100, 1);
  EXPECT_NEAR(report.worst->to_m - report.worst->from_m, 40, 0.6);
  ASSERT_TRUE(report.no_fix);
  EXPECT_NEAR(report.no_fix->from_m, 140, 1);
  EXPECT_NEAR(report.no_fix->to_m, 160, 1);
}

TEST(JudgeRoute, WalksRoundCornersAtItsOwnPaceOrAnother) {
  std::vector<GpsTime> times;
  std::vector<double> altitudes;
  const MapLookup map = [&](const Vector2d&, double altitude, GpsTime time) -> std::optional<MapSample> {
    times.push_back(time);
    altitudes.push_back(altitude);
    return std::nullopt;
  };
  // 30 m east, 40 m north.
  const auto route = drive({{0, 0}, {30, 0}, {30, 40}}, 5);
  RouteOptions options;
  options.step_m = 10;
  RouteReport report = report_route(map, kFrame, kLayers, route, options);
  EXPECT_NEAR(report.length_m, 70, 0.1);
  EXPECT_EQ(report.outside, report.stations.size());
  EXPECT_EQ(report.known, 0U);
  EXPECT_FALSE(report.availability);
  EXPECT_FALSE(report.worst);
  EXPECT_FALSE(report.no_fix);
  EXPECT_TRUE(std::isnan(report.layers[1].mean));
  for (const RouteStation& station : report.stations) {
    const double distance = station.travelled_m;
    const Vector2d expected = distance < 30 ? Vector2d(distance, 0) : Vector2d(30, distance - 30);
    EXPECT_LT((station.enu - expected).norm(), 0.4) << distance;
    EXPECT_NEAR(station.time - kStart, distance / 5, 0.1);
  }
  EXPECT_NEAR(altitudes.front(), 520, 0.01);  // 20 m over an origin at 500 m
  times.clear();
  altitudes.clear();
  options.speed_mps = 2;
  options.start = kStart + 1000.0;
  options.altitude_m = 15;
  report = report_route(map, kFrame, kLayers, route, options);
  EXPECT_NEAR(report.duration_s, 35, 0.1);
  EXPECT_NEAR(times.back() - kStart, 1000 + report.stations.back().travelled_m / 2, 1e-6);
  EXPECT_EQ(altitudes.front(), 15);
}

TEST(JudgeRoute, APlaceIsOneStation) {
  const auto position = simulation::Trajectory::fixed(kStart, kFrame.geodetic_from_local({110, 0, 2}), 60);
  const RouteReport report = report_route(street, kFrame, kLayers, position, {});
  ASSERT_EQ(report.stations.size(), 1U);
  EXPECT_EQ(report.layers[1].mean, 10);
  EXPECT_EQ(*report.availability, 1);
  EXPECT_EQ(*report.worst_error_m, 10);
  EXPECT_EQ(report.length_m, 0);
  EXPECT_EQ(report.duration_s, 60);
}

TEST(JudgeRoute, ExpectsTheMeanOverDrawsWhereThereIsOne) {
  const std::vector<Layer> layers{Layer::HorizontalErrorP95, Layer::HorizontalError,
                                  Layer::HorizontalErrorMean, Layer::Availability};
  const MapLookup map = [](const Vector2d&, double, GpsTime) { return result({9, 1, 4, 0.25F}); };
  const RouteReport report = report_route(map, kFrame, layers, drive({{0, 0}, {20, 0}}, 10), {});
  EXPECT_EQ(report.error, 2U);
  EXPECT_NEAR(*report.availability, 0.25, 1e-12);
  // A fix for a quarter of the time counts as mostly no fix.
  ASSERT_TRUE(report.no_fix);
  EXPECT_EQ(report.no_fix->count, report.stations.size());
  const RouteReport blind = report_route([](const Vector2d&, double, GpsTime) { return result({1}); }, kFrame,
                                         {Layer::SkyView}, drive({{0, 0}, {20, 0}}, 10), {});
  EXPECT_FALSE(blind.error);
  EXPECT_FALSE(blind.availability);
}

TEST(JudgeRoute, RefusesOptionsOutOfRange) {
  const auto route = drive({{0, 0}, {20, 0}}, 10);
  const auto with = [&](auto&& change) {
    RouteOptions options;
    change(options);
    return report_route(street, kFrame, kLayers, route, options);
  };
  EXPECT_THROW((void)with([](RouteOptions& o) { o.step_m = 0; }), InputError);
  EXPECT_THROW((void)with([](RouteOptions& o) { o.step_m = 1e-7; }), InputError);
  EXPECT_THROW((void)with([](RouteOptions& o) { o.stretch_m = -1; }), InputError);
  EXPECT_THROW((void)with([](RouteOptions& o) { o.speed_mps = 0; }), InputError);
  EXPECT_THROW((void)with([](RouteOptions& o) { o.altitude_m = kNaN; }), InputError);
}

}  // namespace
}  // namespace canyon::heatmap::route_report_test
