#include "canyon/sky/orbit/sky.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::orbit {

namespace {

using geodesy::GpsTime;
using geodesy::kEarthRotationRate;
using geodesy::kSpeedOfLight;
using ::testing::HasSubstr;

const GpsTime kReception = GpsTime::from_week(2051, 46701.25);
const geodesy::Geodetic kHongKong = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 5);

/// Counts calls; a circular equatorial-inclined orbit in closed form, or a satellite at rest over the ground.
class CircularSky final : public Sky {
 public:
  CircularSky(double radius, double inertial_rate, double inclination, double phase)
      : radius_(radius), rate_(inertial_rate), inclination_(inclination), phase_(phase) {}

  std::vector<gnss::SatelliteId> satellites() const override { return {{gnss::System::GPS, 1}}; }
  std::optional<SatelliteState> state(gnss::SatelliteId, GpsTime t) const override {
    ++questions;
    if (t < valid_from) return std::nullopt;
    const double dt = t - kReception;
    const double u = phase_ + rate_ * dt;
    const double c = std::cos(inclination_);
    const double s = std::sin(inclination_);
    const Eigen::Vector3d p = radius_ * Eigen::Vector3d(std::cos(u), std::sin(u) * c, std::sin(u) * s);
    const Eigen::Vector3d v =
        radius_ * rate_ * Eigen::Vector3d(-std::sin(u), std::cos(u) * c, std::cos(u) * s);
    SatelliteState state;
    state.position_m = rotate_earth(p, dt);
    state.velocity_mps =
        rotate_earth(v, dt) - Eigen::Vector3d(0, 0, kEarthRotationRate).cross(state.position_m);
    state.clock_bias_s = 1e-4 + 1e-9 * dt;
    state.clock_drift = 1e-9;
    return state;
  }
  std::string source(gnss::SatelliteId, GpsTime) const override { return "circle"; }

  GpsTime valid_from = GpsTime::from_week(0, 0);
  mutable int questions = 0;

 private:
  double radius_, rate_, inclination_, phase_;
};

TEST(RotateEarth, TurnsAxesWithTheEarth) {
  // A quarter sidereal day later the ECEF x axis has the direction of the former y axis: a fixed point on +y
  // is on +x.
  const Eigen::Vector3d rotated = rotate_earth({0, 2, 3}, geodesy::kPi / 2 / kEarthRotationRate);
  EXPECT_NEAR((rotated - Eigen::Vector3d(2, 0, 3)).norm(), 0, 1e-14);
}

// The flight time is the root of |p(t - tau) - r| = c tau in the inertial frame of the reception instant:
// bisection in this frame, in which nothing rotates, is independent of the solver.
TEST(LineOfSight, AgreesWithBisectionInTheInertialFrame) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(0, 2 * geodesy::kPi);
  const Eigen::Vector3d receiver = geodesy::ecef_from_geodetic(kHongKong);
  const Observer observer(receiver);
  for (const double radius : {26'560e3, 29'600e3, 42'164e3}) {
    const double rate = std::sqrt(3.986004418e14 / std::pow(radius, 3));
    for (int i = 0; i < 50; ++i) {
      const double phase = angle(random);
      const double inclination = angle(random) / 4;
      const CircularSky sky(radius, rate, inclination, phase);
      const auto los = line_of_sight(sky, {gnss::System::GPS, 1}, kReception, observer);
      ASSERT_TRUE(los);
      const auto inertial = [&](double tau) {
        const double u = phase - rate * tau;
        return Eigen::Vector3d(radius * Eigen::Vector3d(std::cos(u), std::sin(u) * std::cos(inclination),
                                                        std::sin(u) * std::sin(inclination)));
      };
      double low = 0;
      double high = 1;
      for (int k = 0; k < 80; ++k) {
        const double middle = (low + high) / 2;
        ((inertial(middle) - receiver).norm() > kSpeedOfLight * middle ? low : high) = middle;
      }
      const bool up = los->elevation_rad > 0;
      const Eigen::Vector3d exact = inertial(low);
      // Instants are whole nanoseconds (4 um of orbit); far below the horizon 2 mm are guaranteed.
      const double tolerance = up ? 1e-5 : 2e-3;
      EXPECT_NEAR(los->range_m, (exact - receiver).norm(), tolerance);
      EXPECT_LT((los->position_at_reception_m - exact).norm(), tolerance);
      EXPECT_NEAR(kReception - los->transmit_time, low, 0.6e-9);
      EXPECT_NEAR(los->range_m / kSpeedOfLight, kReception - los->transmit_time, 0.6e-9);
      EXPECT_NEAR(los->state.clock_bias_s, 1e-4 - 1e-9 * low, 1e-17);
      EXPECT_LT((rotate_earth(los->state.position_m, kReception - los->transmit_time) - exact).norm(),
                tolerance);
      EXPECT_LE(sky.questions, 2);
      if (los->elevation_rad < geodesy::radians(-6)) {
        EXPECT_EQ(sky.questions, 1);
      }
    }
  }
}

// Textbook form (RTKLIB manual 2.4.2, E.3): the rotation adds omega/c (x_s y_r - y_s x_r) to the
// range between the two ECEF positions.
TEST(LineOfSight, SagnacCorrectionAgreesWithTheTextbook) {
  const Eigen::Vector3d r = geodesy::ecef_from_geodetic(kHongKong);
  int seen = 0;
  for (int i = 0; i < 36; ++i) {
    const CircularSky sky(26'560e3, 1.4586e-4, geodesy::radians(55), geodesy::radians(10 * i));
    const auto los = line_of_sight(sky, {gnss::System::GPS, 1}, kReception, r);
    ASSERT_TRUE(los);
    const Eigen::Vector3d s = los->state.position_m;
    const double textbook = kEarthRotationRate / kSpeedOfLight * (s.x() * r.y() - s.y() * r.x());
    EXPECT_NEAR(los->range_m - (s - r).norm(), textbook, 1e-3);
    if (std::abs(textbook) > 10) ++seen;
  }
  EXPECT_GT(seen, 10);
}

TEST(LineOfSight, DirectionAnglesAndVectorAreOne) {
  const Eigen::Vector3d r = geodesy::ecef_from_geodetic(kHongKong);
  const CircularSky sky(26'560e3, 1.4586e-4, geodesy::radians(55), geodesy::radians(80));
  const auto los = line_of_sight(sky, {gnss::System::GPS, 1}, kReception, r);
  ASSERT_TRUE(los);
  const Eigen::Vector3d expected = geodesy::enu_from_ecef_rotation(kHongKong).transpose() *
                                   geodesy::enu_from_azimuth_elevation(los->azimuth_rad, los->elevation_rad);
  EXPECT_LT((expected - los->direction_ecef).norm(), 1e-12);
  EXPECT_LT((r + los->range_m * los->direction_ecef - los->position_at_reception_m).norm(), 1e-6);
  EXPECT_NEAR(los->velocity_at_reception_mps.norm(), los->state.velocity_mps.norm(), 1e-9);
}

TEST(LineOfSight, IsEmptyWhereTheSkyHasNoState) {
  CircularSky sky(26'560e3, 1.4586e-4, 1, geodesy::radians(80));
  sky.valid_from = kReception;  // transmission is 70 ms before
  EXPECT_FALSE(
      line_of_sight(sky, {gnss::System::GPS, 1}, kReception, geodesy::ecef_from_geodetic(kHongKong)));
}

TEST(LineOfSight, VelocityIsTheDerivativeOfThePosition) {
  const Eigen::Vector3d r = geodesy::ecef_from_geodetic(kHongKong);
  const BroadcastSky sky(nominal_constellation(kReception, kReception, {gnss::System::GPS}));
  const Observer observer(r);
  int seen = 0;
  for (const gnss::SatelliteId id : sky.satellites()) {
    const auto before = line_of_sight(sky, id, kReception - 0.5, observer);
    const auto at = line_of_sight(sky, id, kReception, observer);
    const auto after = line_of_sight(sky, id, kReception + 0.5, observer);
    ASSERT_TRUE(before && at && after);
    if (at->elevation_rad < 0) continue;
    ++seen;
    // d range/dt = e.v / (1 + e.v/c) for a receiver at rest; e.v to first order within 1e-5 of 800 m/s.
    const double rate = at->direction_ecef.dot(at->velocity_at_reception_mps);
    const double sagnac = kEarthRotationRate / kSpeedOfLight *
                          (at->state.velocity_mps.x() * r.y() - at->state.velocity_mps.y() * r.x());
    EXPECT_NEAR(after->range_m - before->range_m, rate, 0.01 + std::abs(sagnac));
  }
  EXPECT_GE(seen, 6);
}

const geodesy::Geodetic kObserver = geodesy::Geodetic::from_degrees(55.82, 37.61, 150);
const std::vector<double> kAzimuth{0.1, 2.7, -1.2, 6.9, 4.0};
const std::vector<double> kElevation{0, 0.35, 1.1, 1.5, 0.7};

std::string message(const std::vector<double>& azimuth, const std::vector<double>& elevation) {
  return test::refusal([&] { const FrozenSky sky(kObserver, azimuth, elevation); });
}

TEST(FrozenSky, GivesBackTheAnglesAtAnyTime) {
  const FrozenSky sky(kObserver, kAzimuth, kElevation);
  const std::vector<gnss::SatelliteId> ids = sky.satellites();
  ASSERT_EQ(ids.size(), 5U);
  for (const double hours : {0.0, 1.7, 2000.0}) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      EXPECT_EQ(ids[i], (gnss::SatelliteId{gnss::System::GPS, static_cast<std::uint8_t>(i + 1)}));
      const auto los = line_of_sight(sky, ids[i], GpsTime::from_week(2051, hours * 3600 + 0.123456789),
                                     geodesy::ecef_from_geodetic(kObserver));
      ASSERT_TRUE(los);
      EXPECT_NEAR(los->elevation_rad, kElevation[i], 1e-9);
      EXPECT_NEAR(std::remainder(los->azimuth_rad - kAzimuth[i], 2 * geodesy::kPi), 0, 1e-9);
      EXPECT_NEAR(los->range_m, 20'200e3, 1e-3);
      EXPECT_EQ(los->state.velocity_mps, Eigen::Vector3d::Zero());
      EXPECT_EQ(los->state.clock_bias_s, 0);
      EXPECT_DOUBLE_EQ(los->state.carrier_frequency_hz, 1575.42e6);
    }
  }
}

TEST(FrozenSky, HardlyTurnsAcrossACity) {
  const FrozenSky sky(kObserver, kAzimuth, kElevation);
  const geodesy::LocalFrame frame(kObserver);
  const Eigen::Vector3d receiver = frame.ecef_from_local({1000, -500, 80});
  for (std::size_t i = 0; i < kAzimuth.size(); ++i) {
    const auto los = line_of_sight(sky, sky.satellites()[i], GpsTime::from_week(2051, 0), receiver);
    ASSERT_TRUE(los);
    // Compared as directions: near the zenith the azimuth alone changes more. Earth's curvature adds 1.8e-4.
    const Eigen::Vector3d wanted =
        frame.ecef_from_local_rotation() * geodesy::enu_from_azimuth_elevation(kAzimuth[i], kElevation[i]);
    EXPECT_LT((los->direction_ecef - wanted).norm(), 1e-4);
  }
}

TEST(FrozenSky, KnowsOnlyItsSatellites) {
  const FrozenSky sky(kObserver, {1}, {1});
  EXPECT_FALSE(sky.state({gnss::System::GPS, 2}, GpsTime()));
  EXPECT_FALSE(sky.state({gnss::System::GPS, 0}, GpsTime()));
  EXPECT_FALSE(sky.state({gnss::System::Galileo, 1}, GpsTime()));
  EXPECT_THAT(sky.source({gnss::System::GPS, 2}, GpsTime()), HasSubstr("G02 is not"));
  EXPECT_THAT(sky.source({gnss::System::GPS, 1}, GpsTime()),
              HasSubstr("azimuth 57.30 deg, elevation 57.30 deg"));
}

TEST(FrozenSky, NamesWhatIsWrong) {
  EXPECT_THAT(message({1, 2}, {0.5}), HasSubstr("2 azimuths but 1 elevations"));
  EXPECT_THAT(message({}, {}), HasSubstr("give 1 to 63"));
  EXPECT_THAT(message(std::vector<double>(64, 1), std::vector<double>(64, 1)), HasSubstr("64 satellites"));
  EXPECT_THAT(message({1, 40}, {0.5, 45}), AllOf(HasSubstr("elevation 45 of satellite 2"),
                                                 HasSubstr("looks like degrees"), HasSubstr("0.785398")));
  EXPECT_THAT(message({1}, {-0.1}), HasSubstr("0 to pi/2 rad"));
  EXPECT_THAT(message({1}, {std::numeric_limits<double>::quiet_NaN()}), HasSubstr("out of range"));
  EXPECT_THAT(message({std::numeric_limits<double>::infinity()}, {1}), HasSubstr("not a finite number"));
  EXPECT_EQ(message({1}, {1.5708}), "");
}

}  // namespace

}  // namespace canyon::orbit
