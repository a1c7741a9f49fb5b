#include "adapters/ros/raw_conversions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/sample_signals.hpp"

#ifdef CANYON_WITH_ROS2
#include <canyon_msgs/msg/gnss_raw_observations.hpp>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#endif

// Tests use mocks of messages as generated in ROS 2 and, in builds with ROS 2, the real messages.

namespace canyon::ros_messages::raw_conversions_test {
namespace {

struct Mocks {
  struct Time {
    std::int32_t sec = 7;
    std::uint32_t nanosec = 7;
  };
  struct Header {
    Time stamp;
    std::string frame_id = "unset";
  };
  struct GnssRawObservation {
    static constexpr std::uint8_t GPS = 0, GLONASS = 1, GALILEO = 2, BEIDOU = 3, QZSS = 4, SBAS = 5;
    std::string id = "unset";
    std::uint8_t system = 7;
    std::int32_t prn = 7;
    std::string code = "unset";
    double carrier_frequency = 7;
    std::int8_t frequency_channel = 77;
    double pseudorange = 7;
    float pseudorange_deviation = 7;
    double carrier_phase = 7;
    float carrier_phase_deviation = 7;
    double doppler = 7;
    float doppler_deviation = 7, cn0 = 7, lock_time = 7;
    bool loss_of_lock = true;
  };
  struct GnssRawObservations {
    Header header;
    std::int32_t gps_week = 7;
    double gps_tow = 7;
    std::int8_t leap_seconds = 7;
    std::vector<GnssRawObservation> observations;
  };
  struct KeyValue {
    std::string key, value;
  };
  struct DiagnosticStatus {
    static constexpr std::uint8_t OK = 0, WARN = 1, ERROR = 2, STALE = 3;
    std::uint8_t level = 7;
    std::string name, message, hardware_id;
    std::vector<KeyValue> values;
  };
  struct DiagnosticArray {
    Header header;
    std::vector<DiagnosticStatus> status;
  };
};

#ifdef CANYON_WITH_ROS2
struct Messages {
  using GnssRawObservations = canyon_msgs::msg::GnssRawObservations;
  using DiagnosticArray = diagnostic_msgs::msg::DiagnosticArray;
};
using AllTypes = testing::Types<Mocks, Messages>;
#else
using AllTypes = testing::Types<Mocks>;
#endif

template <class Types>
class Raw : public testing::Test {
 protected:
  using Message = typename Types::GnssRawObservations;
  const Head head_{{1234, 567'000'089}, "antenna"};
  RawObservations raw_;

  Message at(const simulation::Epoch* epoch) { return raw_.message<Message>(head_, epoch); }
};
TYPED_TEST_SUITE(Raw, AllTypes);

// Numbers are those of sample_signal_epoch() and sample_satellite().
TYPED_TEST(Raw, HasWhatIsMeasuredAndNothingElse) {
  const auto epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time() - 12.5);
  const auto message = this->at(&epoch);
  EXPECT_EQ(message.header.stamp.sec, 1234);
  EXPECT_EQ(message.header.frame_id, "antenna");
  EXPECT_EQ(message.gps_week, 2051);
  EXPECT_NEAR(message.gps_tow, 46701 + 0.00012345678, 1e-9);  // the receiver's clock
  EXPECT_EQ(message.leap_seconds, 18);                        // since 2017
  // All above the mask except G31, which is blocked.
  ASSERT_EQ(message.observations.size(), 10U);
  const auto& g05 = message.observations[0];
  EXPECT_EQ(g05.id, "G05");
  EXPECT_EQ(g05.code, "1C");
  EXPECT_EQ(g05.prn, 5);
  EXPECT_EQ(g05.system, 0);
  EXPECT_EQ(g05.carrier_frequency, 1575.42e6);
  EXPECT_EQ(g05.frequency_channel, 0);
  EXPECT_NEAR(g05.pseudorange, 2.1e7 + 5000.61725, 1e-6);
  EXPECT_EQ(g05.pseudorange_deviation, 1.5F);
  EXPECT_NEAR(g05.doppler, -1229.5678, 1e-9);
  EXPECT_EQ(g05.doppler_deviation, 0.1F);
  EXPECT_EQ(g05.cn0, 46.3F);
  EXPECT_EQ(g05.carrier_phase_deviation, 0.01F);
  EXPECT_EQ(g05.lock_time, 12.5F);
  EXPECT_FALSE(g05.loss_of_lock);
  // An integer number of cycles off the channel's count, within half a cycle of the pseudorange.
  const double cycles = g05.pseudorange * 1575.42e6 / 299792458.0;
  EXPECT_NEAR(g05.carrier_phase, cycles, 0.5 + 1e-6);
  EXPECT_NEAR(std::remainder(g05.carrier_phase - 1239.5678, 1.0), 0, 1e-6);

  const auto& g12 = message.observations[1];  // without a phase
  EXPECT_TRUE(std::isnan(g12.carrier_phase) && std::isnan(g12.carrier_phase_deviation) &&
              std::isnan(g12.lock_time));
  EXPECT_FALSE(g12.loss_of_lock);
  const auto& r01 = message.observations[3];
  EXPECT_EQ(r01.id, "R01");
  EXPECT_EQ(r01.frequency_channel, 1);  // 1602 + 0.5625 MHz
  EXPECT_EQ(r01.carrier_frequency, 1602.5625e6);
}

TYPED_TEST(Raw, TellsALostCycleOnce) {
  const geodesy::GpsTime begin = test::sample_time();
  auto first = test::sample_signal_epoch(begin, begin - 1);
  auto second = test::sample_signal_epoch(begin + 1, begin - 1);
  auto slipped = test::sample_signal_epoch(begin + 2, begin + 1.5);
  auto after = test::sample_signal_epoch(begin + 3, begin + 1.5);
  const double before = this->at(&first).observations[0].carrier_phase;
  EXPECT_EQ(this->at(&second).observations[0].carrier_phase, before);  // the same count, the same arc
  const auto lost = this->at(&slipped);
  EXPECT_TRUE(lost.observations[0].loss_of_lock);
  EXPECT_EQ(lost.observations[0].lock_time, 0.5F);
  EXPECT_FALSE(this->at(&after).observations[0].loss_of_lock);
}

TYPED_TEST(Raw, WithoutTruthThereAreNone) {
  const auto message = this->at(nullptr);
  EXPECT_EQ(message.gps_week, -1);
  EXPECT_TRUE(std::isnan(message.gps_tow));
  EXPECT_TRUE(message.observations.empty());
}

TYPED_TEST(Raw, EverySignalOfASatelliteIsOne) {
  auto epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time() - 1);
  auto& g05 = epoch.observed.satellites[0];
  const auto signals = gnss::signals_of(gnss::System::GPS);
  const gnss::Signal& l5 =
      *std::find_if(signals.begin(), signals.end(), [](const auto& s) { return s.name == "L5"; });
  receiver::SignalObservation more = g05;
  more.signal = &l5;
  more.measurement->carrier_frequency_hz = 1176.45e6;
  g05.more.push_back(more);
  const auto message = this->at(&epoch);
  ASSERT_EQ(message.observations.size(), 11U);
  EXPECT_EQ(message.observations[1].id, "G05");
  EXPECT_EQ(message.observations[1].code, "5Q");
  EXPECT_EQ(message.observations[1].carrier_frequency, 1176.45e6);
}

TYPED_TEST(Raw, DiagnosticsSayHowItIs) {
  using Diagnostics = typename TypeParam::DiagnosticArray;
  ReceiverHealth health;
  health.name = "gnss";
  health.receiver = "car";
  health.reason = "no pose on pose";
  const auto fix = test::sample_epoch(test::sample_time(), test::sample_point(), {3, 4, 0});
  const auto none = test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0}, false);
  const auto reported = [&](const simulation::Epoch* epoch) {
    return diagnostics_message<Diagnostics>(this->head_, health, epoch).status.at(0);
  };
  EXPECT_EQ(reported(&fix).level, 0);
  EXPECT_EQ(reported(&fix).message, "fix");
  EXPECT_EQ(reported(&fix).name, "gnss: receiver");
  std::string error;
  for (const auto& value : reported(&fix).values) {
    if (value.key == "horizontal error [m]") error = value.value;
  }
  EXPECT_EQ(error, "5");  // of 3 and 4
  auto prediction = fix;
  prediction.observed.fix.used.clear();
  EXPECT_EQ(reported(&prediction).level, 1);
  EXPECT_EQ(reported(&prediction).message, "prediction: no satellite is used");
  EXPECT_EQ(reported(&none).level, 1);
  EXPECT_THAT(std::string(reported(&none).message), testing::StartsWith("no fix: "));
  EXPECT_EQ(reported(nullptr).level, 2);
  EXPECT_EQ(reported(nullptr).message, "no pose on pose");
  health.finished = true;
  EXPECT_EQ(reported(nullptr).level, 0);
}

}  // namespace
}  // namespace canyon::ros_messages::raw_conversions_test
