#include "adapters/common/msgs/gnss_message.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <limits>

#include "adapters/common/testing/sample_report.hpp"

namespace canyon::adapters {
namespace {

/// gz.msgs.NavSat as protobuf's generator writes it, as far as it is used.
struct NavSat {
  struct Pair {
    std::string key_;
    std::vector<std::string> values;
    void set_key(const std::string& key) { key_ = key; }
    void add_value(const std::string& value) { values.push_back(value); }
  };
  struct Header {
    struct Stamp {
      std::int64_t sec = 0;
      std::int32_t nsec = 0;
      void set_sec(std::int64_t value) { sec = value; }
      void set_nsec(std::int32_t value) { nsec = value; }
    } stamp;
    std::deque<Pair> data;
    Stamp* mutable_stamp() { return &stamp; }
    Pair* add_data() { return &data.emplace_back(); }
  } header;
  std::string frame_id;
  double latitude = 0, longitude = 0, height = 0, east = 0, north = 0, up = 0;
  void Clear() { *this = {}; }  // NOLINT(readability-identifier-naming): as generated
  Header* mutable_header() { return &header; }
  void set_frame_id(const std::string& value) { frame_id = value; }
  void set_latitude_deg(double value) { latitude = value; }
  void set_longitude_deg(double value) { longitude = value; }
  void set_altitude(double value) { height = value; }
  void set_velocity_east(double value) { east = value; }
  void set_velocity_north(double value) { north = value; }
  void set_velocity_up(double value) { up = value; }
};

TEST(NavSatMessage, IsTheFixInDegreesMetresAndEastNorthUp) {
  test::SampleReport sample;
  sample.report.sim_time_ns = 12'345'678'901;
  const positioning::Fix& fix = sample.step.epoch.observed.fix;
  NavSat message;
  message.header.add_data();  // of the message before
  ASSERT_TRUE(fill_navsat(sample.report, "iris::base_link::gps", 7, message));
  EXPECT_EQ(message.header.stamp.sec, 12);
  EXPECT_EQ(message.header.stamp.nsec, 345'678'901);
  ASSERT_EQ(message.header.data.size(), 1U);
  EXPECT_EQ(message.header.data[0].key_, "seq");
  EXPECT_EQ(message.header.data[0].values, std::vector<std::string>{"7"});
  EXPECT_EQ(message.frame_id, "iris::base_link::gps");
  EXPECT_DOUBLE_EQ(message.latitude * 3.14159265358979323846 / 180, fix.position.latitude_rad);
  EXPECT_DOUBLE_EQ(message.longitude * 3.14159265358979323846 / 180, fix.position.longitude_rad);
  EXPECT_EQ(message.height, fix.position.height_m);
  EXPECT_EQ(message.east, fix.velocity_enu_mps->x());
  EXPECT_EQ(message.north, fix.velocity_enu_mps->y());
  EXPECT_EQ(message.up, fix.velocity_enu_mps->z());
}

// The message has no status: whoever reads it takes every one for a good fix.
TEST(NavSatMessage, ThereIsNoneWithoutAFixAVelocityOrTruth) {
  NavSat message;
  message.latitude = 47;
  const test::SampleReport no_fix(false);
  EXPECT_FALSE(fill_navsat(no_fix.report, "gps", 0, message));
  test::SampleReport no_velocity;
  no_velocity.step.epoch.observed.fix.velocity_enu_mps.reset();
  EXPECT_FALSE(fill_navsat(no_velocity.report, "gps", 0, message));
  live::ReceiverReport no_truth;
  EXPECT_FALSE(fill_navsat(no_truth, "gps", 0, message));
  EXPECT_EQ(message.latitude, 47) << "what was there stays";
}

}  // namespace
}  // namespace canyon::adapters
