// CorrectionsDecoder reads the RTCM stream of Canyon's receiver.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "canyon/receiver/rtcm/frames.hpp"
#include "canyon/receiver/rtcm/rtcm_file.hpp"
#include "tests/support/sample_signals.hpp"
#include "tests/support/ubx_device.hpp"

namespace canyon::encoding {
namespace {

TEST(RtcmCorrections, OwnStreamComesBackToItsResolution) {
  const geodesy::GpsTime begin = test::sample_time();
  simulation::Epoch epoch = test::sample_signal_epoch(begin, begin - 100);
  ReceiverDescription description{.name = "base", .systems = {gnss::System::GPS}, .begin = begin};
  description.station_ecef = epoch.truth_ecef;
  for (const auto& s : epoch.observed.satellites) {
    if (s.id.system == gnss::System::GLONASS) description.glonass_channels[s.id] = 1;
  }
  const auto encoder = format_named("rtcm").make(description);
  canyon::rtcm::CorrectionsDecoder decoder;
  RawObservations raw(Tags::WholeMilliseconds);
  std::size_t compared = 0, phases = 0;
  std::map<gnss::SatelliteId, geodesy::GpsTime> since;
  for (int k = 0; k < 40; ++k) {
    const geodesy::GpsTime time = begin + 0.2 * k;
    // All phases slip at the 20th epoch.
    epoch = test::sample_signal_epoch(time, k < 20 ? begin - 100 : begin + 3.95);
    const auto decoded = decoder.feed(encoder->encode(epoch), time + 3000);
    const RawEpoch expected = raw.next(epoch.observed);
    ASSERT_EQ(decoded.size(), 1U);
    EXPECT_EQ(decoded[0]->receiver_time, expected.tag);
    EXPECT_EQ(decoded[0]->receiver_name, "Canyon");
    EXPECT_EQ(decoded[0]->antenna_name, "ADVNULLANTENNA");
    EXPECT_LT((decoded[0]->station_ecef - *description.station_ecef).norm(), 1e-4);
    ASSERT_EQ(decoded[0]->observations.size(), expected.observations.size());
    for (const RawObservation& o : expected.observations) {
      const auto at =
          std::find_if(decoded[0]->observations.begin(), decoded[0]->observations.end(),
                       [&](const auto& d) { return d.measurement.id == o.id && d.signal == o.signal; });
      ASSERT_NE(at, decoded[0]->observations.end()) << to_string(o.id);
      const positioning::Measurement& m = at->measurement;
      EXPECT_NEAR(m.pseudorange_m, o.pseudorange_m, canyon::rtcm::kMillisecond_m * 0x1p-30 + 1e-6);
      EXPECT_NEAR(m.cn0_dbhz.value(), o.measurement->cn0_dbhz.value(), 0x1.01p-5);
      EXPECT_EQ(m.doppler_hz.has_value(), o.doppler_hz.has_value());
      if (m.doppler_hz) {
        EXPECT_NEAR(*m.doppler_hz, *o.doppler_hz, 0.0003 + 1e-9);
      }
      ASSERT_EQ(m.carrier_phase_cycles.has_value(), o.carrier_phase_cycles.has_value());
      ++compared;
      if (!m.carrier_phase_cycles) continue;
      ++phases;
      const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
      EXPECT_NEAR(*m.carrier_phase_cycles * wavelength_m, *o.carrier_phase_cycles * wavelength_m,
                  canyon::rtcm::kMillisecond_m * 0x1p-32 + 1e-6)
          << to_string(o.id);
      const auto [arc, first] = since.try_emplace(o.id, *m.phase_since);
      EXPECT_EQ(*m.phase_since > arc->second, !first && k == 20) << to_string(o.id) << ' ' << k;
      arc->second = *m.phase_since;
    }
  }
  EXPECT_GE(compared, 40U * 5);
  EXPECT_GE(phases, 40U * 4);
  EXPECT_TRUE(decoder.status().problems.empty());
  EXPECT_EQ(decoder.status().checksum_errors, 0U);
}

// A u-blox base receiver sends the RTCM 3 messages enabled by CFG-MSGOUT among its UBX messages.
TEST(RtcmCorrections, GoOutOverAUbxLine) {
  const geodesy::GpsTime begin = test::sample_time();
  simulation::Epoch epoch = test::sample_signal_epoch(begin, begin - 100);
  ReceiverDescription description{.name = "base", .systems = {gnss::System::GPS}, .begin = begin};
  const auto types = [&](Encoder& encoder, int epochs) {
    std::map<int, std::uint64_t> counts;
    canyon::rtcm::CorrectionsDecoder decoder;
    for (int k = 0; k < epochs; ++k) {
      epoch = test::sample_signal_epoch(begin + k, begin - 100);
      (void)decoder.feed(encoder.encode(epoch), begin + k);
    }
    EXPECT_EQ(decoder.status().checksum_errors, 0U);
    for (const auto& [type, count] : decoder.status().messages) counts[type] = count;
    return counts;
  };
  using Counts = std::map<int, std::uint64_t>;
  const auto moving = format_named("ubx").make(description);
  // 1005 at each second epoch, 1074, 1077 and 1230 at each, on UART1.
  (void)moving->device()->receive(
      0, ubx::frame(0x068A,
                    test::values(1, {{0x209102be, 2}, {0x2091035f, 1}, {0x209102cd, 1}, {0x20910304, 1}})));
  EXPECT_EQ(types(*moving, 4), Counts{}) << "CFG-UART1OUTPROT-RTCM3X is off";
  (void)moving->device()->receive(0, ubx::frame(0x068A, test::values(1, {{0x10740004, 1}})));
  EXPECT_EQ(types(*moving, 4), (Counts{{1074, 4}, {1077, 4}})) << "no place is known, no phases of GLONASS";

  description.station_ecef = epoch.truth_ecef;
  description.systems.insert(gnss::System::GLONASS);
  description.signal.enabled = true;
  description.tracks = {"L1CA", "G1"};
  const auto base = format_named("ubx").make(description);
  (void)base->device()->receive(
      0, ubx::frame(0x068A,
                    test::values(1, {{0x10740004, 1}, {0x209102be, 2}, {0x209102cd, 1}, {0x20910304, 1}})));
  EXPECT_EQ(types(*base, 4), (Counts{{1005, 2}, {1077, 4}, {1230, 4}}));

  // CFG-TMODE sets another position: 47.123456789 deg, 8.5 deg, 400.1234 m.
  (void)base->device()->receive(0, ubx::frame(0x068A, test::values(1, {{0x20030001, 2},
                                                                       {0x20030002, 1},
                                                                       {0x40030009, 471234567},
                                                                       {0x2003000c, 89},
                                                                       {0x4003000a, 85000000},
                                                                       {0x4003000b, 40012},
                                                                       {0x2003000e, 34}})));
  canyon::rtcm::CorrectionsDecoder decoder;
  std::shared_ptr<const rtk::Corrections> last;
  for (int k = 4; k < 6; ++k) {
    for (auto& came :
         decoder.feed(base->encode(test::sample_signal_epoch(begin + k, begin - 100)), begin + k))
      last = came;
  }
  ASSERT_NE(last, nullptr);
  const geodesy::Geodetic reported{geodesy::radians(47.123456789), geodesy::radians(8.5), 400.1234};
  EXPECT_LT((last->station_ecef - geodesy::ecef_from_geodetic(reported)).norm(), 2e-4);
}

// RTCM among commands on a receiver's UBX line: RXM-RTCM reports each received message
// (UBX-22008968, 3.17.10), and each damaged one.
TEST(RtcmCorrections, ComeOverAUbxLine) {
  const geodesy::GpsTime begin = test::sample_time();
  simulation::Epoch epoch = test::sample_signal_epoch(begin, begin - 100);
  ReceiverDescription description{.name = "base", .systems = {gnss::System::GPS}, .begin = begin};
  description.station_ecef = epoch.truth_ecef;
  const std::string bytes = format_named("rtcm").make(description)->encode(epoch);
  const auto encoder = format_named("ubx").make({.name = "rover", .begin = begin});
  Device* const device = encoder->device();
  // CFG-VALSET, RAM: CFG-MSGOUT-UBX_RXM_RTCM_UART1 (0x20910269) and USB (0x2091026b) of each message.
  std::string settings("\x00\x01\x00\x00", 4);
  for (const char port : {'\x68', '\x69', '\x6a', '\x6b', '\x6c'})
    settings += std::string{port, 2, '\x91', 0x20, 1};
  // Same for RXM-COR.
  for (const char port : {'\xb6', '\xb7', '\xb8', '\xb9', '\xba'})
    settings += std::string{port, 6, '\x91', 0x20, 1};
  (void)device->receive(0, ubx::frame(0x068A, settings));
  (void)encoder->encode(epoch);
  std::string logged = device->receive(0, bytes.substr(0, 40));
  logged += device->receive(0, bytes.substr(40));
  const auto came = device->take_corrections();
  ASSERT_EQ(came.size(), 1U);
  EXPECT_LT((came[0]->station_ecef - *description.station_ecef).norm(), 1e-4);
  EXPECT_TRUE(device->take_corrections().empty());
  std::size_t messages = 0;
  const std::string header{'\xb5', '\x62', '\x02', '\x32', 8, 0};
  for (std::size_t at = logged.find(header); at != std::string::npos; at = logged.find(header, at + 1))
    ++messages;
  EXPECT_GE(messages, 3U);  // 1005, 1033 and MSM7 of each system
  const std::string correction{'\xb5', '\x62', '\x02', '\x34', 12, 0};
  std::size_t corrections = 0;
  for (std::size_t at = logged.find(correction); at != std::string::npos;
       at = logged.find(correction, at + 1))
    ++corrections;
  EXPECT_EQ(corrections, messages);
  std::string broken = bytes;
  broken[broken.size() - 10] ^= 1;
  EXPECT_NE(device->receive(0, broken).find(header), std::string::npos);
}

}  // namespace
}  // namespace canyon::encoding
