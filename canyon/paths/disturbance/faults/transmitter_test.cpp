#include "canyon/paths/disturbance/faults/transmitter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/disturbance/faults/spoofing.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::disturbance::transmitter_test {
namespace {

using Eigen::Vector3d;
using geodesy::kPi;

constexpr double kHz = 1575.42e6;
constexpr double kWavelength_m = geodesy::kSpeedOfLight / kHz;
const geodesy::GpsTime kBegin = geodesy::GpsTime::from_week(2100, 1000);

FaultContext scene(const std::vector<std::pair<Vector3d, Vector3d>>& boxes) {
  city::City city;
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.18, 10));
  for (const auto& [low, high] : boxes) {
    canyon::test::append_box(city.mesh, "box", city::Surface::Building, city::Material::Concrete, low, high);
  }
  FaultContext context;
  context.name = "it";
  context.begin = kBegin;
  context.city = std::make_shared<const city::City>(city);
  context.rays = std::make_shared<const raytrace::RayScene>(city.mesh);
  return context;
}
TransmitterOptions at(const Vector3d& point) {
  TransmitterOptions options;
  options.course.position.east_m = point.x();
  options.course.position.north_m = point.y();
  options.course.position.up_m = point.z();
  return options;
}
/// J of ITU-R P.526-15, 4.1, by its integral far behind the edge: sqrt(2) pi nu, within 0.1 dB above nu = 3.
double deep_loss_db(double detour_m) {
  return 20 * std::log10(std::sqrt(2) * kPi * 2 * std::sqrt(detour_m / kWavelength_m));
}
TransmitterPath shortest_path(const FaultContext& context, const TransmitterOptions& options,
                              const Vector3d& antenna) {
  return Transmitter(options, context).shortest_path(kBegin, antenna, kHz);
}

// Friis: 20 log10(4 pi 100 m / 0.1903 m) = 76.40 dB, 6.02 dB for each doubling; constant within a wavelength.
TEST(Transmitter, FallsAsInFreeSpace) {
  const FaultContext open = scene({});
  const TransmitterOptions options = at({0, 0, 2});
  EXPECT_NEAR(shortest_path(open, options, {100, 0, 2}).gain_db, -76.40, 0.005);
  EXPECT_NEAR(shortest_path(open, options, {0, 200, 2}).gain_db, -76.40 - 6.02, 0.01);
  EXPECT_EQ(shortest_path(open, options, {100, 0, 2}).obstruction_db, 0);
  EXPECT_NEAR(shortest_path(open, options, {0, 0, 2}).gain_db, -20 * std::log10(4 * kPi), 1e-9);
  EXPECT_LT((shortest_path(open, options, {0, 100, 2}).arrival - Vector3d(0, -1, 0)).norm(), 1e-12);
}

TEST(Transmitter, HasABeam) {
  TransmitterOptions options = at({0, 0, 2});
  options.beam.width_deg = 60;
  options.beam.azimuth_deg = 90;
  const FaultContext open = scene({});
  const auto gain_db = [&](double azimuth_deg) {
    const Vector3d to = 100 * geodesy::enu_from_azimuth_elevation(geodesy::radians(azimuth_deg), 0);
    return shortest_path(open, options, to + Vector3d(0, 0, 2)).gain_db -
           shortest_path(open, at({0, 0, 2}), to + Vector3d(0, 0, 2)).gain_db;
  };
  EXPECT_NEAR(gain_db(90), 0, 1e-3);
  EXPECT_NEAR(gain_db(120), -3, 1e-3);
  EXPECT_NEAR(gain_db(60), -3, 1e-3);
  EXPECT_NEAR(gain_db(270), -20, 1e-3);
}

TEST(Transmitter, DrivesAlongItsCourse) {
  TransmitterOptions options;
  options.course.waypoints.resize(3);
  const double points[3][2] = {{0, 0}, {100, 0}, {100, 50}};
  for (std::size_t i = 0; i < 3; ++i) {
    options.course.waypoints[i].east_m = points[i][0];
    options.course.waypoints[i].north_m = points[i][1];
    options.course.waypoints[i].up_m = 1;
  }
  options.course.speed_mps = 5;
  const Transmitter transmitter(options, scene({}));
  EXPECT_LT((transmitter.position(kBegin + -5.0) - Vector3d(0, 0, 1)).norm(), 1e-9);
  EXPECT_LT((transmitter.position(kBegin + 10.0) - Vector3d(50, 0, 1)).norm(), 1e-9);
  EXPECT_LT((transmitter.position(kBegin + 24.0) - Vector3d(100, 20, 1)).norm(), 1e-9);
  EXPECT_LT((transmitter.position(kBegin + 99.0) - Vector3d(100, 50, 1)).norm(), 1e-9);
}

// A wall 18 m above both, 50 m from each: its detour is 2 sqrt(50^2 + 18^2) - 100 m.
TEST(Transmitter, BendsOverARoof) {
  const FaultContext wall = scene({{{-2000, 49.9, 0}, {2000, 50.1, 20}}});
  const double expected = deep_loss_db(2 * std::hypot(50, 18) - 100);
  EXPECT_NEAR(expected, 34.2, 0.1);
  EXPECT_NEAR(shortest_path(wall, at({0, 0, 2}), {0, 100, 2}).obstruction_db, expected, 0.2);
  // Above it nothing blocks the line; grazing it takes half of the field.
  EXPECT_NEAR(shortest_path(wall, at({0, 0, 40}), {0, 100, 40}).obstruction_db, 0, 1e-9);
  EXPECT_NEAR(shortest_path(wall, at({0, 0, 20}), {0, 100, 20}).obstruction_db, 6.02, 0.3);
  // Stations of the profile are 0.25 m apart. nu = -0.4: 6.9 + 20 log10(sqrt(0.5^2 + 1) - 0.5) = 2.72 dB
  // (P.526-15, 4.1).
  const double clearance_m = 0.4 * std::sqrt(kWavelength_m * 50 * 50 / (2 * 100.0));
  const FaultContext thick = scene({{{-2000, 49.8, 0}, {2000, 50.2, 20}}});
  EXPECT_NEAR(shortest_path(thick, at({0, 0, 20 + clearance_m}), {0, 100, 20 + clearance_m}).obstruction_db,
              2.72, 0.05);
}

// A tower of 20 m in a line of 100 m: both sides equal, 3 dB less than one of them.
TEST(Transmitter, BendsAroundBothSides) {
  const FaultContext tower = scene({{{-10, 49.9, 0}, {10, 50.1, 400}}});
  EXPECT_NEAR(shortest_path(tower, at({0, 0, 2}), {0, 100, 2}).obstruction_db,
              deep_loss_db(2 * std::hypot(50, 10) - 100) - 3.01, 0.2);
  // A wall that ends at one of them leaves the other path.
  const FaultContext one = scene({{{-10, 49.9, 0}, {10, 50.1, 400}}, {{5, 70, 0}, {500, 70.2, 400}}});
  EXPECT_NEAR(shortest_path(one, at({0, 0, 2}), {0, 100, 2}).obstruction_db,
              deep_loss_db(2 * std::hypot(50, 10) - 100), 0.2);
}

// A wall of metal 30 m from a line of 80 m is a mirror: its image is 2 sqrt(40^2 + 30^2) = 100 m away, with
// all of the power. If a tower blocks the line, only the reflection remains.
TEST(Transmitter, IsReflectedByWalls) {
  FaultContext context = scene({{{-10, 39.9, 0}, {10, 40.1, 400}}});
  city::City city = *context.city;
  canyon::test::append_box(city.mesh, "mirror", city::Surface::Building, city::Material::Metal, {30, -500, 0},
                           {31, 500, 50});
  context.city = std::make_shared<const city::City>(city);
  context.rays = std::make_shared<const raytrace::RayScene>(city.mesh);
  TransmitterOptions options = at({0, 0, 2});
  const auto routes = Transmitter(options, context).paths(kBegin, {0, 80, 2}, kHz);
  ASSERT_EQ(routes.size(), 2U);
  EXPECT_GT(routes[0].obstruction_db, 20);
  EXPECT_NEAR(routes[1].length_m, 100, 1e-9);
  EXPECT_NEAR(routes[1].gain_db, -76.40, 0.05);
  EXPECT_LT((routes[1].arrival - Vector3d(0.6, -0.8, 0)).norm(), 1e-9);
  // Behind a screen that ends at the mirror point, no reflection arrives.
  canyon::test::append_box(city.mesh, "screen", city::Surface::Building, city::Material::Concrete,
                           {20, 10, 0}, {21, 35, 50});
  context.city = std::make_shared<const city::City>(city);
  context.rays = std::make_shared<const raytrace::RayScene>(city.mesh);
  EXPECT_EQ(Transmitter(options, context).paths(kBegin, {0, 80, 2}, kHz).size(), 1U);
}

// Bullington: two roofs 18 m above the line at a quarter and three quarters equal one edge of 36 m in the
// middle.
TEST(Transmitter, TakesTwoRoofsAsOneEdge) {
  const FaultContext roofs =
      scene({{{-3000, 24.9, 0}, {3000, 25.1, 20}}, {{-3000, 74.9, 0}, {3000, 75.1, 20}}});
  EXPECT_NEAR(shortest_path(roofs, at({0, 0, 2}), {0, 100, 2}).obstruction_db,
              deep_loss_db(2 * std::hypot(50, 36) - 100), 0.3);
}

TEST(Transmitter, OptionsAreChecked) {
  JammingOptions jammer;
  EXPECT_THROW(jammer.validate(), InputError);  // no position
  jammer.transmitter = at({0, 0, 1});
  EXPECT_THROW(jammer.validate(), InputError);  // no emissions
  jammer.preset = "privacy_l1";
  EXPECT_NO_THROW(jammer.validate());
  jammer.transmitter.course.position.up_m.reset();
  EXPECT_THROW(jammer.validate(), InputError);
  SpoofingOptions spoofer;
  spoofer.transmitter = at({0, 0, 1});
  EXPECT_NO_THROW(spoofer.validate());
  spoofer.satellites = {"GPS", "E05"};
  EXPECT_NO_THROW(spoofer.validate());
  spoofer.satellites = {"Navstar"};
  EXPECT_THROW(spoofer.validate(), InputError);
  spoofer.satellites = {};
  spoofer.signals = {"L9"};
  EXPECT_THROW(spoofer.validate(), InputError);
  spoofer.signals = {};
  spoofer.kind = SpoofingOptions::Kind::Meaconing;
  spoofer.delay_s = -1e-6;
  EXPECT_THROW(spoofer.validate(), InputError);
}

TEST(Jamming, SendsWhatItsPresetSays) {
  JammingOptions options;
  options.transmitter = at({100, 0, 0});
  options.preset = "privacy_l1_l2";
  Jamming jamming(options, scene({}));
  propagation::Arrival arrival;
  jamming.apply({kBegin, Vector3d::Zero(), Vector3d::Zero()}, arrival);
  ASSERT_EQ(arrival.interference.size(), 2U);
  const propagation::Interference& l1 = arrival.interference[0];
  EXPECT_EQ(l1.spectrum.shape, propagation::Spectrum::Shape::Chirp);
  EXPECT_EQ(l1.spectrum.centre_hz, kHz);
  EXPECT_NEAR(l1.power_dbw, 10 - 30 - 76.40, 0.01);
  EXPECT_EQ(l1.polarisation, propagation::Polarisation::Linear);
  EXPECT_LT((l1.arrival - Vector3d(1, 0, 0)).norm(), 1e-12);
  // L2 is 1227.6 MHz: 20 log10(1575.42 / 1227.6) less loss.
  EXPECT_NEAR(arrival.interference[1].power_dbw - l1.power_dbw, 2.167, 0.001);
}

TEST(PullOff, IsEvenlyAccelerated) {
  PullOffOptions pull;
  pull.hold_s = 10;
  pull.rate_mps = 4;
  pull.acceleration_mps2 = 0.5;
  EXPECT_EQ(pull.progress(10, 100).travelled_m, 0);
  EXPECT_NEAR(pull.progress(14, 100).travelled_m, 0.5 * 0.5 * 16, 1e-12);
  EXPECT_NEAR(pull.progress(14, 100).speed_mps, 2, 1e-12);
  EXPECT_NEAR(pull.progress(28, 100).travelled_m, 16 + 40, 1e-12);
  EXPECT_EQ(pull.progress(100, 100).travelled_m, 100);
  EXPECT_EQ(pull.progress(100, 100).speed_mps, 0);
}

}  // namespace
}  // namespace canyon::disturbance::transmitter_test
