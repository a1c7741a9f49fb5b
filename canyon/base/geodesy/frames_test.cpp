#include "canyon/base/geodesy/frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::geodesy {

namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::HasSubstr;

const Geodetic kHongKong = Geodetic::from_degrees(22.298251, 114.178761, 5);
const double kNan = std::numeric_limits<double>::quiet_NaN();

// echo "114.178761 22.298251 5" | gdaltransform -s_srs EPSG:4979 -t_srs EPSG:4978   (GDAL 3.6.2, PROJ 9.1),
// and so on.
TEST(Frames, EcefAgreesWithProj) {
  struct KnownValue {
    Geodetic geodetic;
    Vector3d ecef;
  };
  for (const KnownValue& k : {KnownValue{kHongKong, {-2418204.99351776, 5386089.11473486, 2405003.64337142}},
                              KnownValue{Geodetic::from_degrees(-22.9, -43.2, 812.5),
                                         {4285734.31917067, -4024572.40902843, -2466837.74685903}},
                              KnownValue{Geodetic::from_degrees(-89.5, 179.999, -50),
                                         {-55845.8302841082, 0.974693612083316, -6356458.63932701}}}) {
    EXPECT_LT((ecef_from_geodetic(k.geodetic) - k.ecef).norm(), 1e-7);
    const Geodetic back = geodetic_from_ecef(k.ecef);
    EXPECT_NEAR(back.latitude_rad, k.geodetic.latitude_rad, 1e-14);
    EXPECT_NEAR(back.longitude_rad, k.geodetic.longitude_rad, 1e-11);  // near the pole
    EXPECT_NEAR(back.height_m, k.geodetic.height_m, 1e-7);
  }
}

TEST(Frames, GeodeticIsNotGeocentric) {
  // At 45 deg the two latitudes differ by f (1 + ...) = 0.1924 deg (Vallado, 3.2).
  const Vector3d ecef = ecef_from_geodetic(Geodetic::from_degrees(45, 0, 0));
  EXPECT_NEAR(45 - degrees(std::atan2(ecef.z(), ecef.x())), 0.1924, 1e-4);
  EXPECT_NEAR(degrees(geodetic_from_ecef(ecef).latitude_rad), 45, 1e-12);
}

TEST(Frames, EnuRotationPointsEastNorthUp) {
  // At longitude 90 deg on the equator: east is -x, north is z, up is y. All three are different axes.
  const Eigen::Matrix3d r = enu_from_ecef_rotation(Geodetic::from_degrees(0, 90, 0));
  EXPECT_LT((r * Vector3d(-1, 0, 0) - Vector3d(1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((r * Vector3d(0, 0, 1) - Vector3d(0, 1, 0)).norm(), 1e-15);
  EXPECT_LT((r * Vector3d(0, 1, 0) - Vector3d(0, 0, 1)).norm(), 1e-15);
  const Eigen::Matrix3d s = enu_from_ecef_rotation(kHongKong);
  EXPECT_NEAR(s.determinant(), 1, 1e-15);
  EXPECT_LT((s * s.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  // Finite differences along parallel, meridian and vertical.
  const auto step = [&](double dlat, double dlon, double dh) {
    const Geodetic moved{kHongKong.latitude_rad + dlat, kHongKong.longitude_rad + dlon,
                         kHongKong.height_m + dh};
    return Vector3d(s * (ecef_from_geodetic(moved) - ecef_from_geodetic(kHongKong))).normalized();
  };
  EXPECT_LT((step(0, 1e-6, 0) - Vector3d(1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((step(1e-6, 0, 0) - Vector3d(0, 1, 0)).norm(), 1e-6);
  EXPECT_LT((step(0, 0, 1) - Vector3d(0, 0, 1)).norm(), 1e-6);
}

TEST(LocalFrame, MovesPointsBothWays) {
  const LocalFrame frame(kHongKong);
  EXPECT_LT(frame.local_from_geodetic(kHongKong).norm(), 1e-8);
  EXPECT_NEAR(frame.geodetic_from_local({0, 0, 100}).height_m, 105, 1e-7);
  EXPECT_GT(frame.geodetic_from_local({100, 0, 0}).longitude_rad, kHongKong.longitude_rad);
  EXPECT_GT(frame.geodetic_from_local({0, 100, 0}).latitude_rad, kHongKong.latitude_rad);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> metres(-5000, 5000);
  for (const double heading : {0.0, 0.3, -2.9}) {
    const LocalFrame rotated(kHongKong, heading);
    EXPECT_NEAR(rotated.ecef_from_local_rotation().determinant(), 1, 1e-14);
    for (int i = 0; i < 100; ++i) {
      const Vector3d p(metres(random), metres(random), metres(random) / 10);
      EXPECT_LT((rotated.local_from_ecef(rotated.ecef_from_local(p)) - p).norm(), 1e-8);
      EXPECT_LT((rotated.local_from_geodetic(rotated.geodetic_from_local(p)) - p).norm(), 1e-8);
      // The heading rotates x and y only: up and distances are unchanged.
      EXPECT_NEAR(rotated.ecef_from_local(p).norm(),
                  frame.ecef_from_local(Eigen::AngleAxisd(heading, Vector3d::UnitZ()) * p).norm(), 1e-8);
    }
  }
}

TEST(LocalFrame, HeadingTurnsTheXAxisFromEastTowardsNorth) {
  const LocalFrame frame(kHongKong);
  const LocalFrame rotated(kHongKong, radians(30));
  const Vector3d along_x = frame.local_from_ecef(rotated.ecef_from_local({100, 0, 7}));
  EXPECT_LT((along_x - Vector3d(100 * std::cos(radians(30)), 50, 7)).norm(), 1e-8);
  const Vector3d along_y = frame.local_from_ecef(rotated.ecef_from_local({0, 100, 0}));
  EXPECT_LT((along_y - Vector3d(-50, 100 * std::cos(radians(30)), 0)).norm(), 1e-8);
  EXPECT_EQ(rotated.heading_rad(), radians(30));
}

TEST(LocalFrame, RefusesBadOrigins) {
  EXPECT_THAT(test::refusal([] {
                LocalFrame(Geodetic{22.3, 114.2, 0});
              }),  // degrees for radians
              HasSubstr("origin: latitude"));
  EXPECT_THAT(test::refusal([] {
                LocalFrame(Geodetic{0.3, kNan, 0});
              }),
              HasSubstr("origin: longitude nan deg"));
  EXPECT_THAT(test::refusal([] { LocalFrame(kHongKong, kNan); }),
              HasSubstr("heading is not a finite number"));
}

TEST(CheckGeodetic, NamesFieldAndBound) {
  EXPECT_THAT(test::refusal([] { check_geodetic(Geodetic::from_degrees(90.1, 0, 0), "receiver"); }),
              HasSubstr("receiver: latitude 90.1"));
  EXPECT_THAT(test::refusal([] { check_geodetic(Geodetic::from_degrees(0, 180.5, 0), "receiver"); }),
              AllOf(HasSubstr("longitude 180.5"), HasSubstr("from -180 to 180 deg")));
  EXPECT_THAT(test::refusal([] { check_geodetic(Geodetic::from_degrees(0, 0, -10'001), "receiver"); }),
              HasSubstr("height -10001 m"));
  EXPECT_THAT(test::refusal([] {
                check_geodetic({0, 0, std::numeric_limits<double>::infinity()}, "receiver");
              }),
              HasSubstr("height inf m"));
  EXPECT_THAT(test::refusal([] { check_geodetic({kNan, 0, 0}, "receiver"); }), HasSubstr("latitude nan"));
  EXPECT_EQ(test::refusal([] { check_geodetic(Geodetic::from_degrees(90, -180, 1e8), "receiver"); }), "");
}

// No symmetry: an exchange of sine and cosine, or a wrong sign, is detected.
TEST(AzimuthElevation, AzimuthRunsFromNorthClockwise) {
  const Vector3d v = enu_from_azimuth_elevation(radians(30), radians(20));
  EXPECT_NEAR(v.x(), 0.5 * std::cos(radians(20)), 1e-15);
  EXPECT_NEAR(v.y(), std::cos(radians(30)) * std::cos(radians(20)), 1e-15);
  EXPECT_NEAR(v.z(), std::sin(radians(20)), 1e-15);
  const AzimuthElevation west = azimuth_elevation_from_enu({-3, 0.1, -1});
  EXPECT_NEAR(degrees(west.azimuth_rad), 270 + degrees(std::atan(0.1 / 3)), 1e-12);
  EXPECT_LT(west.elevation_rad, 0);
}

TEST(AzimuthElevation, RoundTripsAndStaysInRange) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> azimuth(0, 2 * kPi);
  std::uniform_real_distribution<double> elevation(-1.57, 1.57);
  for (int i = 0; i < 1000; ++i) {
    const double a = azimuth(random);
    const double e = elevation(random);
    const AzimuthElevation back = azimuth_elevation_from_enu(1e7 * enu_from_azimuth_elevation(a, e));
    EXPECT_NEAR(std::remainder(back.azimuth_rad - a, 2 * kPi), 0, 1e-12);
    EXPECT_NEAR(back.elevation_rad, e, 1e-12);
    EXPECT_GE(back.azimuth_rad, 0);
    EXPECT_LT(back.azimuth_rad, 2 * kPi);
  }
  EXPECT_EQ(azimuth_elevation_from_enu({0, 0, 2}).azimuth_rad, 0);
  EXPECT_DOUBLE_EQ(azimuth_elevation_from_enu({0, 0, 2}).elevation_rad, kPi / 2);
  EXPECT_DOUBLE_EQ(azimuth_elevation_from_enu({0, 0, -2}).elevation_rad, -kPi / 2);
  EXPECT_EQ(azimuth_elevation_from_enu({-1e-20, 1, 0}).azimuth_rad, 0);  // not 2 pi
}

TEST(Yaw, BecomesCompassAzimuth) {
  EXPECT_NEAR(degrees(azimuth_from_yaw(radians(60))), 30, 1e-12);
  EXPECT_NEAR(degrees(azimuth_from_yaw(radians(-110))), 200, 1e-12);
  EXPECT_NEAR(degrees(azimuth_from_yaw(radians(150))), 300, 1e-12);
  // Same direction as vectors.
  for (double yaw = -10; yaw < 10; yaw += 0.37) {
    const double azimuth = azimuth_from_yaw(yaw);
    const Vector3d v = enu_from_azimuth_elevation(azimuth, 0);
    EXPECT_LT((v - Vector3d(std::cos(yaw), std::sin(yaw), 0)).norm(), 1e-14);
    EXPECT_GE(azimuth, 0);
    EXPECT_LT(azimuth, 2 * kPi);
  }
}

// echo "114.178761 22.298251" | gdaltransform -s_srs EPSG:4326 -t_srs EPSG:32650   (GDAL 3.6.2, PROJ 9.1);
// EPSG:32723 is 23 south, 32632 and 32633 are 32 and 33 north.
TEST(Utm, AgreesWithProj) {
  struct KnownValue {
    Geodetic geodetic;
    Utm utm;
    int forced;
  };
  for (const KnownValue& k :
       {KnownValue{kHongKong, {50, true, 209317.97008668, 2468556.67785497}, 0},
        KnownValue{kHongKong, {49, true, 827544.342655514, 2469289.69811038}, 49},
        KnownValue{
            Geodetic::from_degrees(-22.9, -43.2, 5), {23, false, 684623.673264599, 7466421.40067048}, 0},
        // Norway: zone 32 extends west to 3 deg; Svalbard: zone 33 covers all of 9 to 21 deg.
        KnownValue{Geodetic::from_degrees(60.4, 5.3, 5), {32, true, 296191.546954719, 6701684.47512584}, 0},
        KnownValue{Geodetic::from_degrees(78, 15, 5), {33, true, 500000, 8658369.58582748}, 0}}) {
    const UtmPosition p = utm_from_geodetic(k.geodetic, k.forced);
    EXPECT_EQ(p.utm.zone, k.utm.zone);
    EXPECT_EQ(p.utm.north, k.utm.north);
    EXPECT_NEAR(p.utm.easting_m, k.utm.easting_m, 1e-6);
    EXPECT_NEAR(p.utm.northing_m, k.utm.northing_m, 1e-6);
  }
}

TEST(Utm, ConvergenceIsTheBearingOfGridNorth) {
  // West of its central meridian (117 deg) grid north is west of true north: tan(c) = tan(dlon) sin(lat) on
  // the sphere, -1.07 deg here; in zone 49 (111 deg) east of it: +1.21 deg.
  EXPECT_NEAR(degrees(utm_from_geodetic(kHongKong).convergence_rad), -1.0713, 1e-3);
  EXPECT_NEAR(degrees(utm_from_geodetic(kHongKong, 49).convergence_rad), 1.2072, 1e-3);
  for (const int zone : {49, 50}) {
    // A step to true north has the opposite bearing in the grid; its length gives the scale.
    const LocalFrame frame(kHongKong);
    const UtmPosition at = utm_from_geodetic(kHongKong, zone);
    const UtmPosition there = utm_from_geodetic(frame.geodetic_from_local({0, 100, 0}), zone);
    const double east = there.utm.easting_m - at.utm.easting_m;
    const double north = there.utm.northing_m - at.utm.northing_m;
    EXPECT_NEAR(std::atan2(east, north), -at.convergence_rad, 1e-5);
    EXPECT_NEAR(std::hypot(east, north) / 100, at.scale, 1e-5);
  }
  EXPECT_NEAR(utm_from_geodetic(Geodetic::from_degrees(10, 117, 0)).scale, 0.9996, 1e-9);
  EXPECT_NEAR(utm_from_geodetic(Geodetic::from_degrees(10, 117, 0)).convergence_rad, 0, 1e-15);
}

TEST(Utm, RefusesWhatIsOutside) {
  EXPECT_THAT(test::refusal([] { (void)utm_from_geodetic(Geodetic::from_degrees(84.5, 0, 0)); }),
              HasSubstr("80 S to 84 N"));
  EXPECT_THAT(test::refusal([] { (void)utm_from_geodetic(Geodetic::from_degrees(-80.5, 0, 0)); }),
              HasSubstr("80 S to 84 N"));
  EXPECT_THAT(test::refusal([] { (void)utm_from_geodetic(kHongKong, 20); }),
              HasSubstr("no UTM coordinates in zone 20"));
  EXPECT_THAT(test::refusal([] { (void)utm_from_geodetic(kHongKong, 99); }), HasSubstr("zone 99"));
  EXPECT_THAT(test::refusal([] { (void)utm_from_geodetic({kNan, 0, 0}); }), HasSubstr("latitude nan"));
}

// 35.65858 N, 139.74543 E is 386,440.29 m east and 3,946,805.90 m north in zone 54; 34.60374 S, 58.38159 W is
// 373,318.48 and 6,170,031.75 m in zone 21 (PROJ: cs2cs EPSG:4326 to EPSG:32654 and EPSG:32721).
TEST(Mgrs, FindsTheCornerOfASquare) {
  const Utm tokyo = utm_of_mgrs_square("54SUE");
  EXPECT_EQ(tokyo.zone, 54);
  EXPECT_TRUE(tokyo.north);
  const Utm tower = utm_from_geodetic(Geodetic::from_degrees(35.65858, 139.74543, 0)).utm;
  EXPECT_NEAR(tower.easting_m - tokyo.easting_m, 86440.29, 0.01);
  EXPECT_NEAR(tower.northing_m - tokyo.northing_m, 46805.90, 0.01);
  EXPECT_EQ(tokyo.easting_m, 300'000);
  EXPECT_EQ(tokyo.northing_m, 3'900'000);

  const Utm south = utm_of_mgrs_square("21hub");
  EXPECT_EQ(south.zone, 21);
  EXPECT_FALSE(south.north);
  EXPECT_EQ(south.easting_m, 300'000);
  EXPECT_EQ(south.northing_m, 6'100'000);
  const Utm obelisk = utm_from_geodetic(Geodetic::from_degrees(-34.60374, -58.38159, 0)).utm;
  EXPECT_NEAR(obelisk.northing_m - south.northing_m, 70031.75, 0.01);
}

TEST(Mgrs, RefusesWhatIsNotASquare) {
  for (const char* text : {"", "54", "54S", "54SU", "54SUE1234", "54SIE", "99SUE", "UAZ", "ZAH", "54 SUE",
                           "x", "54SUE\xC3\xA9"}) {
    EXPECT_THROW((void)utm_of_mgrs_square(text), InputError) << text;
  }
}

// NIMA TR8350.2, table 3.4: normal gravity on the ellipsoid at the equator and at the pole.
TEST(NormalGravity, IsThatOfTheStandard) {
  const auto at = [](double latitude_deg, double height_m) {
    return normal_gravity(ecef_from_geodetic(Geodetic::from_degrees(latitude_deg, 30, height_m)));
  };
  EXPECT_NEAR(at(0, 0).norm(), 9.7803253359, 1e-9);
  EXPECT_NEAR(at(90, 0).norm(), 9.8321849378, 1e-9);
  // Somigliana's formula with its constants, equation 4-1.
  const double s = std::pow(std::sin(22.3 * M_PI / 180), 2);
  EXPECT_NEAR(at(22.3, 0).norm(),
              9.7803253359 * (1 + 0.00193185265241 * s) / std::sqrt(1 - 0.00669437999014 * s), 1e-9);
  // Equation 4-3 with the height to the second order.
  const double a = 6378137, f = 1 / 298.257223563, m = 0.00344978650684, h = 1000;
  EXPECT_NEAR(at(22.3, h).norm(),
              at(22.3, 0).norm() * (1 - 2 / a * (1 + f + m - 2 * f * s) * h + 3 / (a * a) * h * h), 1e-7);
  // Downwards along the ellipsoid's normal on the ellipsoid.
  const Geodetic position = Geodetic::from_degrees(22.3, 30, 0);
  const Eigen::Vector3d enu = enu_from_ecef_rotation(position) * at(22.3, 0);
  EXPECT_NEAR(enu.x(), 0, 1e-12);
  EXPECT_NEAR(enu.y(), 0, 1e-9);
  EXPECT_LT(enu.z(), 0);
}

}  // namespace

}  // namespace canyon::geodesy
