#include "canyon/orbit/frozen_sky.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "canyon/geodesy/constants.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;
using ::testing::HasSubstr;

const geodesy::Geodetic kPlace = geodesy::Geodetic::from_degrees(55.82, 37.61, 150);
const std::vector<double> kAzimuth{0.1, 2.7, -1.2, 6.9, 4.0};
const std::vector<double> kElevation{0, 0.35, 1.1, 1.5, 0.7};

std::string message(const std::vector<double>& azimuth, const std::vector<double>& elevation) {
  return test::refusal([&] { const FrozenSky sky(kPlace, azimuth, elevation); });
}

TEST(FrozenSky, GivesBackTheAnglesAtAnyTime) {
  const FrozenSky sky(kPlace, kAzimuth, kElevation);
  const std::vector<gnss::SatelliteId> ids = sky.satellites();
  ASSERT_EQ(ids.size(), 5U);
  for (const double hours : {0.0, 1.7, 2000.0}) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      EXPECT_EQ(ids[i], (gnss::SatelliteId{gnss::System::GPS, static_cast<std::uint8_t>(i + 1)}));
      const auto los = line_of_sight(sky, ids[i], GpsTime::from_week(2051, hours * 3600 + 0.123456789),
                                     geodesy::ecef_from_geodetic(kPlace));
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
  const FrozenSky sky(kPlace, kAzimuth, kElevation);
  const geodesy::LocalFrame frame(kPlace);
  const Eigen::Vector3d receiver = frame.ecef_from_local({1000, -500, 80});
  for (std::size_t i = 0; i < kAzimuth.size(); ++i) {
    const auto los = line_of_sight(sky, sky.satellites()[i], GpsTime::from_week(2051, 0), receiver);
    ASSERT_TRUE(los);
    // As directions: near the zenith the azimuth alone turns further. Earth's curvature adds 1.8e-4.
    const Eigen::Vector3d wanted =
        frame.ecef_from_local_rotation() * geodesy::enu_from_azimuth_elevation(kAzimuth[i], kElevation[i]);
    EXPECT_LT((los->direction_ecef - wanted).norm(), 1e-4);
  }
}

TEST(FrozenSky, KnowsOnlyItsSatellites) {
  const FrozenSky sky(kPlace, {1}, {1});
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
