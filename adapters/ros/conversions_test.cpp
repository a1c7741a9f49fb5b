#include "adapters/ros/conversions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "tests/support/carried_columns.hpp"
#include "tests/support/sample_signals.hpp"

#ifdef CANYON_WITH_ROS
#include "adapters/ros/ros1_types.hpp"
#endif
#ifdef CANYON_WITH_ROS2
#include <canyon_msgs/msg/gnss_multipath.hpp>
#include <canyon_msgs/msg/gnss_satellites.hpp>
#include <geometry_msgs/msg/twist_with_covariance_stamped.hpp>
#include <sensor_msgs/msg/laser_scan.hpp>
#include <sensor_msgs/msg/nav_sat_fix.hpp>
#endif

// Every conversion with mocks of messages as generated in ROS 1 and in ROS 2 and, in builds with one of them,
// with its real messages.

namespace canyon::ros_messages {
namespace {

using testing::ElementsAre;
using testing::NanSensitiveFloatEq;

/// ROS 1: unsigned seconds, `nsec`, constants as enumerators.
struct Ros1Kind {
  struct Time {
    std::uint32_t sec = 7, nsec = 7;  // not zero, to detect unset values
  };
  static std::uint32_t nanoseconds(const Time& time) { return time.nsec; }
};
/// ROS 2: signed seconds, `nanosec`.
struct Ros2Kind {
  struct Time {
    std::int32_t sec = 7;
    std::uint32_t nanosec = 7;
  };
  static std::uint32_t nanoseconds(const Time& time) { return time.nanosec; }
};

template <class Kind>
struct Mocks : Kind {
  struct Header {
    typename Kind::Time stamp;
    std::string frame_id = "unset";
  };
  struct NavSatStatus {
    // Values of sensor_msgs/NavSatStatus.msg.
    enum { STATUS_NO_FIX = -1, STATUS_FIX = 0, STATUS_GBAS_FIX = 2 };
    enum { SERVICE_GPS = 1, SERVICE_GLONASS = 2, SERVICE_COMPASS = 4, SERVICE_GALILEO = 8 };
    std::int8_t status = 7;
    std::uint16_t service = 7;
  };
  struct NavSatFix {
    static constexpr std::uint8_t COVARIANCE_TYPE_UNKNOWN = 0, COVARIANCE_TYPE_DIAGONAL_KNOWN = 2,
                                  COVARIANCE_TYPE_KNOWN = 3;
    Header header;
    NavSatStatus status;
    double latitude = 7, longitude = 7, altitude = 7;
    std::array<double, 9> position_covariance{7, 7, 7, 7, 7, 7, 7, 7, 7};
    std::uint8_t position_covariance_type = 7;
  };
  struct Vector3 {
    double x = 7, y = 7, z = 7;
  };
  struct Twist {
    Vector3 linear, angular;
  };
  struct TwistWithCovariance {
    Twist twist;
    std::array<double, 36> covariance = [] {
      std::array<double, 36> sevens{};
      sevens.fill(7);
      return sevens;
    }();
  };
  struct TwistWithCovarianceStamped {
    Header header;
    TwistWithCovariance twist;
  };
  struct LaserScan {
    Header header;
    float angle_min = 7, angle_max = 7, angle_increment = 7, time_increment = 7, scan_time = 7, range_min = 7,
          range_max = 7;
    std::vector<float> ranges, intensities;
  };
  struct GnssMultipath {
    Header header;
    NavSatFix rec_pos;
    std::vector<float> dop, range_offset;
    std::vector<std::int32_t> sats_blocked;
    std::int32_t num_vis_sat = 7, num_block_sat = 7;
    std::vector<float> noise;
  };
  struct GnssSatellite {
    static constexpr std::uint8_t GPS = 0, GLONASS = 1, GALILEO = 2, BEIDOU = 3, QZSS = 4, SBAS = 5;
    static constexpr std::uint8_t LOS = 0, LOS_MULTIPATH = 1, NLOS = 2, BLOCKED = 3;
    static constexpr std::uint8_t SEARCHING = 0, TRACKING = 1, HOLDING = 2;
    std::string id;
    std::uint8_t system = 7;
    std::int32_t prn = 7;
    double azimuth = 7, elevation = 7;
    std::uint8_t above_mask = 7;
    std::uint8_t visibility = 7;
    float cn0 = 7;
    double pseudorange = 7, doppler = 7, carrier_frequency = 7;
    float excess_path = 7, noise = 7, pseudorange_error = 7;
    std::uint8_t used = 7;
    float residual = 7;
    std::uint8_t lock = 7;
    float true_cn0 = 7;
    double carrier_phase = 7, phase_lock = 7;
    std::uint8_t excluded = 7;
  };
  struct GnssSatellites {
    static constexpr std::uint8_t NOT_SOLVED = 0, FIX = 1, TOO_FEW_SATELLITES = 2, SINGULAR = 3,
                                  NOT_CONVERGED = 4, NO_SIGNAL = 5, NO_TRUTH = 6, WEAK_GEOMETRY = 7;
    static constexpr std::uint8_t KIND_NONE = 0, KIND_SINGLE = 1, KIND_DIFFERENTIAL = 2, KIND_FLOAT = 3,
                                  KIND_FIXED = 4, KIND_DEAD_RECKONING = 5, KIND_COMBINED = 6;
    Header header;
    std::uint8_t fix_status = 7, fix_kind = 7;
    float correction_age = 7;
    std::int32_t gps_week = 7;
    double gps_tow = 7, clock_bias = 7, clock_drift = 7;
    std::vector<std::string> faults;
    std::vector<GnssSatellite> satellites;
  };
};

#ifdef CANYON_WITH_ROS
struct RosMessages {
  using NavSatFix = ros1::NavSatFix;
  using TwistWithCovarianceStamped = ros1::TwistWithCovarianceStamped;
  using LaserScan = ros1::LaserScan;
  using GnssMultipath = ros1::GnssMultipath;
  using GnssSatellite = ros1::GnssSatellite;
  using GnssSatellites = ros1::GnssSatellites;
  static std::uint32_t nanoseconds(const ros::Time& time) { return time.nsec; }
};
using AllTypes = testing::Types<Mocks<Ros1Kind>, Mocks<Ros2Kind>, RosMessages>;
#elif defined(CANYON_WITH_ROS2)
struct RosMessages {
  using NavSatFix = sensor_msgs::msg::NavSatFix;
  using TwistWithCovarianceStamped = geometry_msgs::msg::TwistWithCovarianceStamped;
  using LaserScan = sensor_msgs::msg::LaserScan;
  using GnssMultipath = canyon_msgs::msg::GnssMultipath;
  using GnssSatellite = canyon_msgs::msg::GnssSatellite;
  using GnssSatellites = canyon_msgs::msg::GnssSatellites;
  static std::uint32_t nanoseconds(const builtin_interfaces::msg::Time& time) { return time.nanosec; }
};
using AllTypes = testing::Types<RosMessages>;
#else
using AllTypes = testing::Types<Mocks<Ros1Kind>, Mocks<Ros2Kind>>;
#endif

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

Head sample_head() {
  return {{1234, 567'000'089}, "antenna"};
}

/// The sample with a different number in every field.
simulation::Epoch distinct_epoch() {
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0});
  positioning::Fix& fix = epoch.observed.fix;
  fix.position = geodesy::Geodetic::from_degrees(22.25, -114.5, 33.75);
  fix.covariance_enu << 11, 12, 13, 21, 22, 23, 31, 32, 33;
  fix.velocity_enu_mps = Eigen::Vector3d(3.5, -4.25, 0.125);
  fix.velocity_covariance_enu = Eigen::Matrix3d::Zero();
  *fix.velocity_covariance_enu << 0.11, 0.12, 0.13, 0.21, 0.22, 0.23, 0.31, 0.32, 0.33;
  fix.dop = positioning::Dop{5.5, 1.5, 2.5, 3.5, 4.5};  // GDOP, PDOP, HDOP, VDOP, TDOP
  for (std::size_t i = 0; i < fix.residuals_m.size(); ++i) fix.residuals_m[i] = 0.5 + static_cast<double>(i);
  epoch.faults = {"jammer", "outage 2"};
  epoch.observed.clock_bias_s = 1.25e-4;
  epoch.observed.clock_drift = -3e-9;
  for (std::size_t i = 0; i < epoch.observed.satellites.size(); ++i) {
    auto& satellite = epoch.observed.satellites[i];
    if (!satellite.measurement) continue;
    satellite.noise_m = 0.125 * static_cast<double>(i + 1);
    satellite.pseudorange_error_m = satellite.excess_m + satellite.noise_m + 64;
  }
  return epoch;
}

template <class Kind>
class Conversions : public testing::Test {
 protected:
  template <class Header>
  static void expect_head(const Header& header) {
    EXPECT_EQ(header.stamp.sec, 1234);
    EXPECT_EQ(Kind::nanoseconds(header.stamp), 567'000'089U);
    EXPECT_EQ(header.frame_id, "antenna");
  }
  template <class Fix>
  static void expect_fix(const Fix& fix) {
    expect_head(fix.header);
    EXPECT_EQ(static_cast<int>(fix.status.status), 0);
    EXPECT_EQ(fix.status.service, 1 + 2 + 4 + 8);
    EXPECT_NEAR(fix.latitude, 22.25, 1e-12);
    EXPECT_NEAR(fix.longitude, -114.5, 1e-12);
    EXPECT_EQ(fix.altitude, 33.75);
    const std::vector<double> covariance(fix.position_covariance.begin(), fix.position_covariance.end());
    EXPECT_THAT(covariance, ElementsAre(11, 12, 13, 21, 22, 23, 31, 32, 33));
    EXPECT_EQ(static_cast<int>(fix.position_covariance_type), 3);
    Fix variances = fix;
    make_covariance_diagonal(variances);
    const std::vector<double> diagonal(variances.position_covariance.begin(),
                                       variances.position_covariance.end());
    EXPECT_THAT(diagonal, ElementsAre(11, 0, 0, 0, 22, 0, 0, 0, 33));
    EXPECT_EQ(static_cast<int>(variances.position_covariance_type), 2);
  }
  template <class Fix>
  static void expect_no_fix(const Fix& fix) {
    expect_head(fix.header);
    EXPECT_EQ(static_cast<int>(fix.status.status), -1);
    EXPECT_EQ(fix.status.service, 0);
    EXPECT_TRUE(std::isnan(fix.latitude) && std::isnan(fix.longitude) && std::isnan(fix.altitude));
    for (const double element : fix.position_covariance) EXPECT_TRUE(std::isnan(element));
    EXPECT_EQ(static_cast<int>(fix.position_covariance_type), 0);
  }
};
TYPED_TEST_SUITE(Conversions, AllTypes);

TYPED_TEST(Conversions, FixHasPositionCovarianceAndSystems) {
  using Fix = typename TypeParam::NavSatFix;
  simulation::Epoch epoch = distinct_epoch();
  this->expect_fix(fix_message<Fix>(sample_head(), &epoch));
  // One system at a time: each has its own bit, QZSS none.
  for (const auto& [id, bit] : {std::pair{"G01", 1}, {"R01", 2}, {"C01", 4}, {"E01", 8}, {"J01", 0}}) {
    epoch.observed.fix.used = {*gnss::parse_satellite(id)};
    EXPECT_EQ(fix_message<Fix>(sample_head(), &epoch).status.service, bit) << id;
  }
}

TYPED_TEST(Conversions, FixWithoutSolutionSaysSo) {
  using Fix = typename TypeParam::NavSatFix;
  const auto epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0}, false);
  this->expect_no_fix(fix_message<Fix>(sample_head(), &epoch));
  this->expect_no_fix(fix_message<Fix>(sample_head(), nullptr));
}

TYPED_TEST(Conversions, VelocityIsEastNorthUp) {
  using Twist = typename TypeParam::TwistWithCovarianceStamped;
  const auto epoch = distinct_epoch();
  const auto message = velocity_message<Twist>(sample_head(), &epoch);
  this->expect_head(message.header);
  EXPECT_EQ(message.twist.twist.linear.x, 3.5);
  EXPECT_EQ(message.twist.twist.linear.y, -4.25);
  EXPECT_EQ(message.twist.twist.linear.z, 0.125);
  EXPECT_TRUE(std::isnan(message.twist.twist.angular.x));
  EXPECT_TRUE(std::isnan(message.twist.twist.angular.y));
  EXPECT_TRUE(std::isnan(message.twist.twist.angular.z));
  const std::vector<double> covariance(message.twist.covariance.begin(), message.twist.covariance.end());
  EXPECT_THAT(covariance, ElementsAre(0.11, 0.12, 0.13, 0, 0, 0,  //
                                      0.21, 0.22, 0.23, 0, 0, 0,  //
                                      0.31, 0.32, 0.33, 0, 0, 0,  //
                                      0, 0, 0, -1, 0, 0,          //
                                      0, 0, 0, 0, 0, 0,           //
                                      0, 0, 0, 0, 0, 0));
}

TYPED_TEST(Conversions, VelocityThatIsNotKnownIsMarked) {
  using Twist = typename TypeParam::TwistWithCovarianceStamped;
  auto without_velocity = distinct_epoch();
  without_velocity.observed.fix.velocity_enu_mps.reset();
  const auto without_fix = test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0}, false);
  for (const simulation::Epoch* epoch : {static_cast<const simulation::Epoch*>(&without_velocity),
                                         &without_fix, static_cast<const simulation::Epoch*>(nullptr)}) {
    const auto message = velocity_message<Twist>(sample_head(), epoch);
    this->expect_head(message.header);
    EXPECT_TRUE(std::isnan(message.twist.twist.linear.x));
    EXPECT_TRUE(std::isnan(message.twist.twist.linear.y));
    EXPECT_TRUE(std::isnan(message.twist.twist.linear.z));
    EXPECT_EQ(message.twist.covariance[0], -1);
    EXPECT_EQ(message.twist.covariance[7], 0);
    EXPECT_EQ(message.twist.covariance[21], -1);
  }
  auto without_covariance = distinct_epoch();
  without_covariance.observed.fix.velocity_covariance_enu.reset();
  const auto message = velocity_message<Twist>(sample_head(), &without_covariance);
  EXPECT_EQ(message.twist.twist.linear.y, -4.25);
  EXPECT_EQ(message.twist.covariance[0], -1);
}

TYPED_TEST(Conversions, MultipathHasOneOffsetPerSatelliteAboveTheMask) {
  using Multipath = typename TypeParam::GnssMultipath;
  const auto epoch = distinct_epoch();
  const auto message = multipath_message<Multipath>(sample_head(), &epoch);
  this->expect_head(message.header);
  this->expect_fix(message.rec_pos);
  EXPECT_THAT(message.dop, ElementsAre(1.5F, 2.5F, 3.5F, 4.5F, 5.5F));  // P, H, V, T, G
  // G05 G12 G17 G31 R01 R24 E11 E36 C03 C30 J02; G24 is below the mask, G31 is blocked.
  EXPECT_THAT(message.range_offset,
              ElementsAre(0, 0, 35.25F, NanSensitiveFloatEq(kNaN), 0, 0, 0, 12.5F, 0, 0, 0));
  EXPECT_THAT(message.noise, ElementsAre(0.125F, 0.25F, 0.375F, NanSensitiveFloatEq(kNaN), 0.75F, 0.875F,
                                         1.0F, 1.125F, 1.25F, 1.375F, 1.5F));
  EXPECT_THAT(message.sats_blocked, ElementsAre(31));
  EXPECT_EQ(message.num_vis_sat, 10);
  EXPECT_EQ(message.num_block_sat, 1);
  EXPECT_EQ(message.num_vis_sat, epoch.observed.visible);
  EXPECT_EQ(message.num_block_sat, epoch.observed.blocked);
}

TYPED_TEST(Conversions, MultipathWithoutFixKeepsItsSatellites) {
  using Multipath = typename TypeParam::GnssMultipath;
  const auto epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0}, false);
  const auto message = multipath_message<Multipath>(sample_head(), &epoch);
  this->expect_no_fix(message.rec_pos);
  ASSERT_EQ(message.dop.size(), 5U);
  for (const float value : message.dop) EXPECT_TRUE(std::isnan(value));
  EXPECT_EQ(message.range_offset.size(), 11U);
  EXPECT_EQ(message.range_offset[2], 35.25F);
  EXPECT_EQ(message.num_vis_sat, 10);
}

TYPED_TEST(Conversions, MultipathWithoutTruthIsEmpty) {
  using Multipath = typename TypeParam::GnssMultipath;
  const auto message = multipath_message<Multipath>(sample_head(), nullptr);
  this->expect_head(message.header);
  this->expect_no_fix(message.rec_pos);
  EXPECT_EQ(message.dop.size(), 5U);
  EXPECT_TRUE(message.range_offset.empty() && message.noise.empty() && message.sats_blocked.empty());
  EXPECT_EQ(message.num_vis_sat, 0);
  EXPECT_EQ(message.num_block_sat, 0);
}

TYPED_TEST(Conversions, SatellitesCarryEverything) {
  using Satellites = typename TypeParam::GnssSatellites;
  using Satellite = typename TypeParam::GnssSatellite;
  const auto epoch = distinct_epoch();
  const auto message = satellites_message<Satellites>(sample_head(), &epoch);
  this->expect_head(message.header);
  EXPECT_EQ(static_cast<int>(message.fix_status), static_cast<int>(Satellites::FIX));
  EXPECT_EQ(static_cast<int>(message.fix_kind), static_cast<int>(Satellites::KIND_SINGLE));
  EXPECT_TRUE(std::isnan(message.correction_age));
  EXPECT_EQ(message.gps_week, 2051);
  EXPECT_EQ(message.gps_tow, 46701);
  EXPECT_EQ(message.clock_bias, 1.25e-4);
  EXPECT_EQ(message.clock_drift, -3e-9);
  ASSERT_EQ(message.satellites.size(), 12U);

  std::vector<std::string> ids;
  std::vector<int> prns, systems;
  for (const auto& satellite : message.satellites) {
    ids.emplace_back(satellite.id.data(), satellite.id.size());
    prns.push_back(satellite.prn);
    systems.push_back(satellite.system);
    EXPECT_TRUE(std::isnan(satellite.cn0) && std::isnan(satellite.true_cn0) &&
                std::isnan(satellite.carrier_phase) && std::isnan(satellite.phase_lock));
    EXPECT_FALSE(satellite.excluded);
  }
  EXPECT_THAT(
      ids, ElementsAre("G05", "G12", "G17", "G24", "G31", "R01", "R24", "E11", "E36", "C03", "C30", "J02"));
  EXPECT_THAT(prns, ElementsAre(5, 12, 17, 24, 31, 65, 88, 311, 336, 403, 430, 194));
  EXPECT_THAT(systems, ElementsAre(0, 0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4));

  const Satellite& nlos = message.satellites[2];            // G17
  EXPECT_NEAR(nlos.azimuth, 3.4906585039886591, 1e-15);     // 200 deg: 200 * pi / 180
  EXPECT_NEAR(nlos.elevation, 0.27052603405912107, 1e-15);  // 15.5 deg
  EXPECT_TRUE(nlos.above_mask);
  EXPECT_EQ(static_cast<int>(nlos.visibility), static_cast<int>(Satellite::NLOS));
  EXPECT_NEAR(nlos.pseudorange, 2.1e7 + 17002.09865 + 35.25, 1e-6);  // as in sample_satellite()
  EXPECT_NEAR(nlos.doppler, -1217.5678, 1e-9);
  EXPECT_EQ(nlos.carrier_frequency, 1575.42e6);
  EXPECT_EQ(nlos.excess_path, 35.25F);
  EXPECT_EQ(nlos.noise, 0.375F);
  EXPECT_EQ(nlos.pseudorange_error, 99.625F);
  EXPECT_TRUE(nlos.used);
  EXPECT_EQ(nlos.residual, 2.5F);  // the third used

  EXPECT_EQ(static_cast<int>(message.satellites[0].visibility), static_cast<int>(Satellite::LOS));
  EXPECT_EQ(static_cast<int>(message.satellites[1].visibility), static_cast<int>(Satellite::LOS_MULTIPATH));

  const Satellite& low = message.satellites[3];  // G24
  EXPECT_FALSE(low.above_mask);
  EXPECT_FALSE(low.used);
  EXPECT_EQ(low.excess_path, 0);
  EXPECT_TRUE(std::isnan(low.pseudorange) && std::isnan(low.noise) && std::isnan(low.residual));

  const Satellite& blocked = message.satellites[4];  // G31
  EXPECT_EQ(static_cast<int>(blocked.visibility), static_cast<int>(Satellite::BLOCKED));
  EXPECT_TRUE(blocked.above_mask);
  EXPECT_TRUE(std::isnan(blocked.excess_path) && std::isnan(blocked.pseudorange) &&
              std::isnan(blocked.doppler) && std::isnan(blocked.carrier_frequency) &&
              std::isnan(blocked.noise) && std::isnan(blocked.pseudorange_error) &&
              std::isnan(blocked.residual));

  const Satellite& unused = message.satellites[8];  // E36
  EXPECT_FALSE(unused.used);
  EXPECT_EQ(unused.noise, 1.125F);
  EXPECT_TRUE(std::isnan(unused.residual));
  EXPECT_EQ(message.satellites[11].residual, 8.5F);  // J02, the ninth used
}

// sensor_msgs/NavSatStatus: -1 no fix, 0 fix, 2 with a ground-based augmentation.
TYPED_TEST(Conversions, SayWhatKindOfFixItIs) {
  using NavSatFix = typename TypeParam::NavSatFix;
  using Satellites = typename TypeParam::GnssSatellites;
  using positioning::FixKind;
  auto epoch = distinct_epoch();
  epoch.observed.fix.correction_age_s = 1.5;
  const auto expect = [&](int kind, int status, bool age) {
    const auto satellites = satellites_message<Satellites>(sample_head(), &epoch);
    EXPECT_EQ(static_cast<int>(satellites.fix_kind), kind);
    EXPECT_EQ(std::isfinite(satellites.correction_age), age);
    EXPECT_EQ(static_cast<int>(fix_message<NavSatFix>(sample_head(), &epoch).status.status), status);
  };
  expect(1, 0, false);
  int code = 2;
  for (const FixKind solution : {FixKind::Differential, FixKind::Float, FixKind::Fixed}) {
    epoch.observed.fix.solution = solution;
    expect(code++, 2, true);
  }
  epoch.observed.fix.used.clear();
  expect(5, -1, false);
  const NavSatFix prediction = fix_message<NavSatFix>(sample_head(), &epoch);
  EXPECT_EQ(prediction.latitude, 22.25);
  EXPECT_EQ(prediction.position_covariance[0], 11);
  EXPECT_EQ(static_cast<int>(prediction.status.service), 0);
  epoch.observed.fix.status = positioning::FixStatus::WeakGeometry;
  expect(0, -1, false);
}

// The columns of epochs.csv in the message. The fix is in the topics fix, velocity and multipath.
TYPED_TEST(Conversions, SatellitesSayWhatTheyLackOfEpochs) {
  using M = typename TypeParam::GnssSatellites;
  const test::Carried<M> carried{
      {"gps_week", [](const M& m) -> test::ReportedValue { return 1.0 * m.gps_week; }},
      {"gps_tow", [](const M& m) -> test::ReportedValue { return m.gps_tow; }},
      {"status",
       [](const M& m) -> test::ReportedValue {
         return std::string(m.fix_status == M::FIX ? "fix" : "no fix");
       }},
      {"clock_bias_s", [](const M& m) -> test::ReportedValue { return m.clock_bias; }},
      {"clock_drift", [](const M& m) -> test::ReportedValue { return m.clock_drift; }},
      {"fix_kind", [](const M& m) -> test::ReportedValue { return 1.0 * m.fix_kind; }},
      {"correction_age_s", [](const M& m) -> test::ReportedValue { return 1.0 * m.correction_age; }},
      {"faults",
       [](const M& m) -> test::ReportedValue {
         std::vector<std::string> names;
         for (const auto& fault : m.faults) names.emplace_back(fault.data(), fault.size());
         return encoding::fault_names(names);
       }},
  };
  const std::set<std::string> lacks{"true_latitude_deg",
                                    "true_longitude_deg",
                                    "true_height_m",
                                    "fix_latitude_deg",
                                    "fix_longitude_deg",
                                    "fix_height_m",
                                    "error_east_m",
                                    "error_north_m",
                                    "error_up_m",
                                    "gdop",
                                    "pdop",
                                    "hdop",
                                    "vdop",
                                    "tdop",
                                    "rating",
                                    "tracked",
                                    "not_tracked",
                                    "used",
                                    "reason",
                                    "placement",
                                    "true_velocity_east_mps",
                                    "true_velocity_north_mps",
                                    "true_velocity_up_mps",
                                    "fix_velocity_east_mps",
                                    "fix_velocity_north_mps",
                                    "fix_velocity_up_mps",
                                    "sigma_east_m",
                                    "sigma_north_m",
                                    "sigma_up_m",
                                    "covariance_east_north_m2",
                                    "covariance_east_up_m2",
                                    "covariance_north_up_m2",
                                    "clock_gps_s",
                                    "clock_glonass_s",
                                    "clock_galileo_s",
                                    "clock_beidou_s",
                                    "clock_qzss_s",
                                    "excluded",
                                    "consistent",
                                    "error_horizontal_m",
                                    "baseline_kind",
                                    "ambiguity_ratio",
                                    "baseline_east_m",
                                    "baseline_north_m",
                                    "baseline_up_m",
                                    "heading_deg",
                                    "heading_sigma_deg",
                                    "wrong_fix",
                                    "fusion",
                                    "vehicle_heading_deg",
                                    "vehicle_heading_sigma_deg",
                                    "velocity_covariance_east_m2ps2",
                                    "velocity_covariance_east_north_m2ps2",
                                    "velocity_covariance_east_up_m2ps2",
                                    "velocity_covariance_north_m2ps2",
                                    "velocity_covariance_north_up_m2ps2",
                                    "velocity_covariance_up_m2ps2"};
  simulation::Epoch epoch = distinct_epoch();
  epoch.observed.fix.solution = positioning::FixKind::Differential;
  epoch.observed.fix.correction_age_s = 1.5;
  test::expect_carried(encoding::TableKind::Epochs, epoch, satellites_message<M>(sample_head(), &epoch),
                       carried, lacks);
}

// Week and second of the week are in the enclosing message. Some numbers have single precision.
TYPED_TEST(Conversions, SatellitesSayWhatTheyLackOfSatellites) {
  using M = typename TypeParam::GnssSatellites;
  using S = typename TypeParam::GnssSatellite;
  const test::Carried<S> carried{
      {"sat", [](const S& s) -> test::ReportedValue { return std::string(s.id.data(), s.id.size()); }},
      {"azimuth_deg", [](const S& s) -> test::ReportedValue { return geodesy::degrees(s.azimuth); }},
      {"elevation_deg", [](const S& s) -> test::ReportedValue { return geodesy::degrees(s.elevation); }},
      {"visibility", [](const S& s) -> test::ReportedValue { return 1.0 * s.visibility; }},
      {"excess_path_m", [](const S& s) -> test::ReportedValue { return 1.0 * s.excess_path; }},
      {"pseudorange_m", [](const S& s) -> test::ReportedValue { return s.pseudorange; }},
      {"pseudorange_error_m", [](const S& s) -> test::ReportedValue { return 1.0 * s.pseudorange_error; }},
      {"noise_m", [](const S& s) -> test::ReportedValue { return 1.0 * s.noise; }},
      {"used", [](const S& s) -> test::ReportedValue { return s.used ? 1.0 : 0.0; }},
      {"above_mask", [](const S& s) -> test::ReportedValue { return s.above_mask ? 1.0 : 0.0; }},
      {"doppler_hz", [](const S& s) -> test::ReportedValue { return s.doppler; }},
      {"carrier_frequency_hz", [](const S& s) -> test::ReportedValue { return s.carrier_frequency; }},
      {"residual_m", [](const S& s) -> test::ReportedValue { return 1.0 * s.residual; }},
      {"cn0_dbhz", [](const S& s) -> test::ReportedValue { return 1.0 * s.cn0; }},
      {"true_cn0_dbhz", [](const S& s) -> test::ReportedValue { return 1.0 * s.true_cn0; }},
      {"lock", [](const S& s) -> test::ReportedValue { return 1.0 * s.lock; }},
      {"carrier_phase_cycles", [](const S& s) -> test::ReportedValue { return s.carrier_phase; }},
      {"phase_lock_s", [](const S& s) -> test::ReportedValue { return s.phase_lock; }},
      {"excluded", [](const S& s) -> test::ReportedValue { return s.excluded ? 1.0 : 0.0; }},
  };
  const std::set<std::string> lacks{"gps_week", "gps_tow",        "sigma_m",      "cycle_slip",
                                    "signal",   "map_visibility", "obstacles_db", "tracked_path"};
  const simulation::Epoch epoch =
      test::sample_signal_epoch(test::sample_time(), test::sample_time() - 12.5, {1, 2, 3});
  const auto message = satellites_message<M>(sample_head(), &epoch);
  test::expect_carried(encoding::TableKind::Satellites, epoch, message.satellites.at(0), carried, lacks,
                       1e-6);
}

TYPED_TEST(Conversions, SatellitesSayHowTheFixEnded) {
  using Satellites = typename TypeParam::GnssSatellites;
  using positioning::FixStatus;
  auto epoch = distinct_epoch();
  for (const auto& [status, code] : {std::pair{FixStatus::NotSolved, 0},
                                     {FixStatus::Fix, 1},
                                     {FixStatus::TooFewSatellites, 2},
                                     {FixStatus::Singular, 3},
                                     {FixStatus::NotConverged, 4},
                                     {FixStatus::NoSignal, 5},
                                     {FixStatus::WeakGeometry, 7}}) {
    epoch.observed.fix.status = status;
    EXPECT_EQ(static_cast<int>(satellites_message<Satellites>(sample_head(), &epoch).fix_status), code);
  }
  const auto message = satellites_message<Satellites>(sample_head(), nullptr);
  this->expect_head(message.header);
  EXPECT_EQ(static_cast<int>(message.fix_status), 6);
  EXPECT_EQ(static_cast<int>(message.fix_kind), 0);
  EXPECT_EQ(message.gps_week, -1);
  EXPECT_TRUE(std::isnan(message.gps_tow) && std::isnan(message.clock_bias) &&
              std::isnan(message.clock_drift));
  EXPECT_TRUE(message.satellites.empty());
}

// Numbers are those of sample_signal_epoch().
TYPED_TEST(Conversions, SatellitesCarryStrengthLockAndPhase) {
  using Satellites = typename TypeParam::GnssSatellites;
  using Satellite = typename TypeParam::GnssSatellite;
  auto epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time() - 12.5);
  auto& held = epoch.observed.satellites[5];  // R01
  held.lock = tracking::LockState::Holding;
  held.measurement.reset();
  held.cn0_dbhz = 14.5;
  const auto message = satellites_message<Satellites>(sample_head(), &epoch);
  const Satellite& g05 = message.satellites[0];
  EXPECT_EQ(g05.cn0, 46.3F);
  EXPECT_EQ(g05.true_cn0, 46.55F);
  EXPECT_EQ(static_cast<int>(g05.lock), static_cast<int>(Satellite::TRACKING));
  EXPECT_NEAR(g05.carrier_phase, 1239.5678, 1e-9);
  EXPECT_EQ(g05.phase_lock, 12.5);
  EXPECT_FALSE(g05.excluded);
  const Satellite& g12 = message.satellites[1];  // no phase
  EXPECT_EQ(g12.cn0, 45.3F);
  EXPECT_TRUE(std::isnan(g12.carrier_phase) && std::isnan(g12.phase_lock));
  const Satellite& g31 = message.satellites[4];  // blocked
  EXPECT_EQ(static_cast<int>(g31.lock), static_cast<int>(Satellite::SEARCHING));
  EXPECT_TRUE(std::isnan(g31.cn0) && std::isnan(g31.true_cn0));
  const Satellite& r01 = message.satellites[5];
  EXPECT_EQ(static_cast<int>(r01.visibility), static_cast<int>(Satellite::LOS));
  EXPECT_EQ(static_cast<int>(r01.lock), static_cast<int>(Satellite::HOLDING));
  EXPECT_EQ(r01.true_cn0, 14.5F);
  EXPECT_TRUE(std::isnan(r01.cn0) && std::isnan(r01.excess_path) && std::isnan(r01.carrier_phase));
  EXPECT_TRUE(message.satellites[8].excluded);  // E36
}

TYPED_TEST(Conversions, ScanHasOneRangePerRay) {
  using Scan = typename TypeParam::LaserScan;
  const std::vector<double> ranges{12.5, 99.25, std::numeric_limits<double>::infinity(), 4.75};
  const auto message = scan_message<Scan>(sample_head(), ranges, 250.5);
  this->expect_head(message.header);
  EXPECT_THAT(message.ranges, ElementsAre(12.5F, 99.25F, std::numeric_limits<float>::infinity(), 4.75F));
  EXPECT_EQ(message.angle_min, 0);
  EXPECT_EQ(message.angle_max, 3);
  EXPECT_EQ(message.angle_increment, 1);
  EXPECT_EQ(message.time_increment, 0);
  EXPECT_EQ(message.scan_time, 0);
  EXPECT_EQ(message.range_min, 0);
  EXPECT_EQ(message.range_max, 250.5F);
  EXPECT_TRUE(message.intensities.empty());
  EXPECT_EQ(scan_message<Scan>(sample_head(), {}, 1).angle_max, 0);
}

TEST(PrnNumber, IsDistinctOverAllConstellations) {
  // Extended NMEA 0183 numbering: the first and last satellite of each constellation.
  for (const auto& [id, number] : {std::pair{"G01", 1},
                                   {"G63", 63},
                                   {"R01", 65},
                                   {"R32", 96},
                                   {"E01", 301},
                                   {"E36", 336},
                                   {"C01", 401},
                                   {"C63", 463},
                                   {"J01", 193},
                                   {"J10", 202},
                                   {"S20", 120},
                                   {"S58", 158}}) {
    EXPECT_EQ(prn_number(*gnss::parse_satellite(id)), number) << id;
  }
}

}  // namespace
}  // namespace canyon::ros_messages
