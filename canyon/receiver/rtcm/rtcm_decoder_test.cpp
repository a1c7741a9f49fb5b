// The messages are composed here field by field, of known values or of a recorded base; RTKLIB reads the same
// bytes (convbin). canyon/outputs/encoding/rtcm_corrections_test.cpp has those of Canyon's own encoder.
#include "canyon/receiver/rtcm/rtcm_decoder.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <random>
#include <set>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/receiver/rtcm/frames.hpp"
#include "canyon/receiver/rtcm/rtcm_file.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/support/program.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/rtcm_messages.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::rtcm {
namespace {

using broadcast::Bits;
using geodesy::GpsTime;
using gnss::System;
using testing::HasSubstr;

CorrectionsDecoder::Epochs decode(CorrectionsDecoder& decoder, const std::string& bytes,
                                  GpsTime now = kTime) {
  return decoder.feed(bytes, now);
}

TEST(RtcmDecoder, EverySignalHasItsRinexCodeInTheMask) {
  for (const System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      if (signal.msm == 0) continue;
      EXPECT_EQ(rinex_code(system, signal.msm), signal.code) << gnss::name(system) << ' ' << signal.name;
    }
  }
  EXPECT_EQ(rinex_code(System::GPS, 10), "2W");
  EXPECT_EQ(rinex_code(System::GPS, 32), "1X");
  EXPECT_EQ(rinex_code(System::SBAS, 24), "5X");
  EXPECT_EQ(rinex_code(System::QZSS, 9), "6S");
  EXPECT_EQ(rinex_code(System::Galileo, 20), "8X");
  for (const int empty : {0, 1, 5, 33}) EXPECT_EQ(rinex_code(System::GPS, empty), "");
  EXPECT_EQ(satellite_at(System::SBAS, 1), satellite("S20"));
  EXPECT_EQ(satellite_at(System::GLONASS, 25), std::nullopt);
}

// Table 3.5-75: indicator, minimum lock time.
TEST(RtcmDecoder, LockTimeIndicator) {
  const std::vector<std::pair<int, double>> table{{0, 0},     {63, 63},     {64, 64},        {95, 126},
                                                  {96, 128},  {127, 252},   {128, 256},      {159, 504},
                                                  {160, 512}, {352, 32768}, {703, 66060288}, {704, 67108864}};
  for (const auto& [indicator, ms] : table) {
    EXPECT_EQ(lock_time_indicator(ms * 1e-3, true), indicator);
    EXPECT_EQ(min_lock_ms(indicator, true), ms);
    if (ms > 0) {
      EXPECT_EQ(lock_time_indicator((ms - 0.5) * 1e-3, true), indicator - 1);
    }
  }
  EXPECT_EQ(lock_time_indicator(1e9, true), 704);
}

// Table 3.5-74.
TEST(RtcmDecoder, LeastLockTimes) {
  EXPECT_EQ(min_lock_ms(0, false), 0);
  EXPECT_EQ(min_lock_ms(1, false), 32);
  EXPECT_EQ(min_lock_ms(15, false), 524'288);
}

/// Cells of all systems with values that are no multiples of the resolutions.
std::map<System, std::vector<Cell>> random_cells(std::mt19937& random) {
  std::uniform_real_distribution<double> range(20e6, 40e6), neighbour(-50, 50), rate(-900, 900), cn0(20, 55);
  std::map<System, std::vector<Cell>> cells;
  for (const System system : gnss::kAllSystems) {
    for (const int number : {3, 7, 9}) {
      const gnss::SatelliteId id{system,
                                 static_cast<std::uint8_t>(number + (system == System::SBAS ? 20 : 0))};
      const double range_m = range(random), rate_mps = rate(random);
      for (const gnss::Signal& signal : gnss::signals_of(system)) {
        if (signal.msm == 0) continue;
        const double code_m = range_m + neighbour(random);
        Cell cell{id,
                  signal.code,
                  code_m,
                  code_m + neighbour(random),
                  rate_mps + 0.001 * neighbour(random),
                  100,
                  cn0(random),
                  number == 7,
                  system == System::GLONASS ? number : 0};
        if (number == 9) cell.phase_m = std::nullopt;
        cells[system].push_back(cell);
      }
    }
  }
  return cells;
}

TEST(RtcmDecoder, ValuesComeBackToTheirResolution) {
  std::mt19937 random(1);
  for (int kind = 4; kind <= 7; ++kind) {
    const auto cells = random_cells(random);
    std::string bytes = "$GNGGA,*00\r\n" + frame(station_message()) + "\xB5\x62\xD3\x01\xD3";
    for (const auto& [system, list] : cells)
      bytes += frame(msm(system, kind, kTime, list, system != System::SBAS)) + "$GNRMC\r\n";
    std::uniform_int_distribution<std::size_t> some(1, 300);
    for (const bool single : {true, false}) {
      CorrectionsDecoder decoder([](gnss::SatelliteId id) { return id.number - 7; });
      CorrectionsDecoder::Epochs epochs;
      for (std::size_t at = 0; at < bytes.size();) {
        const std::size_t size = single ? 1 : some(random);
        for (const auto& epoch : decoder.feed(std::string_view(bytes).substr(at, size), kTime + 1000))
          epochs.push_back(epoch);
        at += size;
      }
      ASSERT_EQ(epochs.size(), 1U);
      const rtk::Corrections& epoch = *epochs[0];
      EXPECT_EQ(epoch.receiver_time, kTime);
      EXPECT_EQ(epoch.station, 7);
      EXPECT_LT((epoch.station_ecef - kPosition).norm(), 1e-4);
      std::map<std::pair<gnss::SatelliteId, std::string_view>, const positioning::Measurement*> seen;
      for (const auto& o : epoch.observations) seen[{o.measurement.id, o.signal->code}] = &o.measurement;
      std::size_t expected = 0;
      const bool fine = kind >= 6;
      const double ms = kMillisecond_m;
      for (const auto& [system, list] : cells) {
        for (const Cell& cell : list) {
          ++expected;
          const auto at = seen.find({cell.id, cell.code});
          ASSERT_NE(at, seen.end()) << to_string(cell.id) << ' ' << cell.code;
          const positioning::Measurement& m = *at->second;
          EXPECT_NEAR(m.pseudorange_m, cell.range_m, ms * (fine ? 0x1p-30 : 0x1p-25) + 1e-6);
          const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
          EXPECT_EQ(m.carrier_phase_cycles.has_value(), cell.phase_m.has_value());
          EXPECT_EQ(m.phase_since.has_value(), cell.phase_m.has_value());
          if (cell.phase_m) {
            EXPECT_NEAR(*m.carrier_phase_cycles * wavelength_m, *cell.phase_m,
                        ms * (fine ? 0x1p-32 : 0x1p-30) + 1e-6);
            EXPECT_EQ(m.half_cycle, cell.half_cycle);
            // 100 s of lock: from 98.304 s on (DF407), from 65.536 s on (DF402).
            EXPECT_NEAR(kTime - *m.phase_since, fine ? 98.304 : 65.536, 1e-6);
          }
          EXPECT_EQ(m.doppler_hz.has_value(), kind % 2 == 1);
          if (m.doppler_hz) {
            EXPECT_NEAR(*m.doppler_hz * wavelength_m, -*cell.rate_mps, 0.5001e-4);
          }
          EXPECT_NEAR(*m.cn0_dbhz, cell.cn0_dbhz, fine ? 0x1.01p-5 : 0.501);
          if (system == System::GLONASS && cell.code == "1C") {
            EXPECT_EQ(m.carrier_frequency_hz, 1602e6 + (cell.id.number - 7) * 0.5625e6);
          }
        }
      }
      EXPECT_EQ(epoch.observations.size(), expected);
      EXPECT_EQ(decoder.status().messages.size(), 7U);
      EXPECT_TRUE(decoder.status().problems.empty());
      EXPECT_EQ(decoder.status().epochs, 1U);
    }
  }
}

TEST(RtcmDecoder, WithoutChannelGlonassHasNoPhase) {
  const std::string bytes =
      frame(station_message()) + frame(msm(System::GLONASS, 4, kTime, {some_cell("R03", "1C")}));
  CorrectionsDecoder decoder;
  const auto epochs = decode(decoder, bytes);
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_FALSE(epochs[0]->observations[0].measurement.carrier_phase_cycles);
  EXPECT_EQ(epochs[0]->observations[0].measurement.carrier_frequency_hz, 1602e6);
  // 15: unknown (DF419).
  const auto unknown = decode(decoder, frame(msm(System::GLONASS, 7, kTime + 0.5, {some_cell("R03", "1C")})));
  EXPECT_FALSE(unknown.at(0)->observations[0].measurement.carrier_phase_cycles);
  // Message 1020 gives it: satellite 3, channel 5.
  Bits ephemeris;
  ephemeris.put(1020, 12).put(3, 6).put(12, 5).put(0, 40);
  const auto next =
      decode(decoder, frame(ephemeris) + frame(msm(System::GLONASS, 4, kTime + 1, {some_cell("R03", "1C")})));
  ASSERT_EQ(next.size(), 1U);
  EXPECT_TRUE(next[0]->observations[0].measurement.carrier_phase_cycles);
  EXPECT_EQ(next[0]->observations[0].measurement.carrier_frequency_hz, 1602e6 + 5 * 0.5625e6);
}

TEST(RtcmDecoder, BestCodeOfASignalIsTaken) {
  CorrectionsDecoder decoder;
  Cell data = some_cell("G07", "2S"), both = some_cell("G07", "2X"), encrypted = some_cell("G07", "2W");
  both.range_m += 10;
  const auto epochs =
      decode(decoder, frame(station_message()) + frame(msm(System::GPS, 7, kTime, {encrypted, data, both})));
  ASSERT_EQ(epochs.size(), 1U);
  ASSERT_EQ(epochs[0]->observations.size(), 2U);
  EXPECT_EQ(epochs[0]->observations[0].signal->name, "L2C");
  EXPECT_NEAR(epochs[0]->observations[0].measurement.pseudorange_m, data.range_m, 0.001);
  EXPECT_EQ(epochs[0]->observations[1].signal->name, "L2P");
  // Galileo's 1X is preferred to 1C, which comes before it. When the code changes, the phase restarts.
  Cell pilot = some_cell("E07", "1C"), joint = some_cell("E07", "1X");
  joint.range_m += 10;
  const auto taken = [&](double s, const std::vector<Cell>& cells) {
    return decode(decoder, frame(msm(System::Galileo, 7, kTime + s, cells)))
        .at(0)
        ->observations.at(0)
        .measurement;
  };
  EXPECT_NEAR(taken(1, {pilot, joint}).pseudorange_m, joint.range_m, 0.001);
  EXPECT_EQ(*taken(2, {pilot}).phase_since, kTime + 2);
}

/// Whether each epoch's phase of G07 restarts, for epochs with these lock times [s].
std::vector<bool> slips(int kind, double interval_s, const std::vector<double>& locks) {
  CorrectionsDecoder decoder;
  (void)decode(decoder, frame(station_message()));
  std::vector<bool> seen;
  std::optional<GpsTime> since;
  GpsTime time = kTime;
  for (const double lock_s : locks) {
    const auto epochs =
        decode(decoder, frame(msm(System::GPS, kind, time, {some_cell("G07", "1C", lock_s)})));
    const GpsTime now = epochs.at(0)->observations.at(0).measurement.phase_since.value();
    seen.push_back(since && now > *since);
    since = now;
    time = time + interval_s;
  }
  return seen;
}

TEST(RtcmDecoder, LockTimesShowSlips) {
  using Slips = std::vector<bool>;
  // Each lock time of a stream without slips, from 0 s on, at 1 Hz, 5 Hz and every 30 s.
  for (const double interval_s : {0.2, 1.0, 30.0}) {
    std::vector<double> locks;
    locks.reserve(3000);
    for (int i = 0; i < 3000; ++i) locks.push_back(i * interval_s);
    EXPECT_EQ(slips(7, interval_s, locks), Slips(3000, false)) << interval_s;
    // DF402 doubles from one indicator to the next: the second epoch may be a slip.
    const Slips coarse = slips(4, interval_s, locks);
    EXPECT_LE(std::count(coarse.begin(), coarse.end(), true), 1) << interval_s;
    EXPECT_FALSE(coarse[0]);
  }
  EXPECT_EQ(slips(7, 1, {100, 101, 0.5, 1.5, 2.5}), (Slips{false, false, true, false, false}));
  // It fell, although it is longer than the time between the epochs.
  EXPECT_EQ(slips(7, 1, {100, 101, 50, 51}), (Slips{false, false, true, false}));
  // Shorter than the elapsed time: 20 s ago it was 5 s, now 10.
  EXPECT_EQ(slips(7, 20, {5, 10, 30}), (Slips{false, true, false}));
  EXPECT_EQ(slips(5, 20, {5, 10, 30, 50}), (Slips{false, true, true, false}));
  EXPECT_EQ(slips(7, 1, {0, 0, 0}), (Slips{false, true, true}));
  // The last indicators have no end.
  EXPECT_EQ(slips(6, 1, {70000, 70001, 70002}), (Slips{false, false, false}));
  EXPECT_EQ(slips(4, 1, {600, 601, 700}), (Slips{false, false, false}));
}

TEST(RtcmDecoder, WeeksAndDaysEnd) {
  const GpsTime end = GpsTime::from_week(2321, 0);
  for (const double before : {5.0, 0.001, -0.001, -14.0, -18.0}) {
    for (const double now : {-3600.0, -1.0, 1.0, 3600.0}) {
      CorrectionsDecoder decoder;
      std::string bytes = frame(station_message());
      for (const System system : {System::GPS, System::GLONASS, System::BeiDou}) {
        const char* id = system == System::GPS ? "G07" : system == System::GLONASS ? "R07" : "C21";
        bytes += frame(msm(system, 7, end - before, {some_cell(id, system == System::BeiDou ? "2I" : "1C")},
                           system != System::BeiDou));
      }
      const auto epochs = decode(decoder, bytes, end + now);
      ASSERT_EQ(epochs.size(), 1U) << before;
      EXPECT_EQ(epochs[0]->receiver_time, end - before);
      EXPECT_EQ(epochs[0]->observations.size(), 3U);
    }
  }
}

TEST(RtcmDecoder, EpochsEndWithTheirLastMessageOrTheNextTime) {
  CorrectionsDecoder decoder;
  const auto gps = [](double s, bool more) {
    return frame(msm(System::GPS, 5, kTime + s, {some_cell("G07", "1C")}, more));
  };
  const auto galileo = [](double s, bool more) {
    return frame(msm(System::Galileo, 5, kTime + s, {some_cell("E07", "1C")}, more));
  };
  EXPECT_EQ(decode(decoder, frame(station_message()) + gps(0, true)).size(), 0U);
  auto epochs = decode(decoder, gps(1, true));  // the last message of 0 s was lost
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_EQ(epochs[0]->receiver_time, kTime);
  epochs = decode(decoder, galileo(1, false));
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_EQ(epochs[0]->observations.size(), 2U);
  // A base that marks each message as the last: the epoch is delivered again with more.
  epochs = decode(decoder, gps(2, false) + galileo(2, false) + galileo(2, false));
  ASSERT_EQ(epochs.size(), 2U);
  EXPECT_EQ(epochs[0]->observations.size(), 1U);
  EXPECT_EQ(epochs[1]->observations.size(), 2U);
  EXPECT_EQ(epochs[1]->receiver_time, kTime + 2);
  (void)decode(decoder, gps(3, true));
  EXPECT_EQ(decoder.finish().size(), 1U);
  EXPECT_EQ(decoder.finish().size(), 0U);
}

TEST(RtcmDecoder, EpochsWithoutAPlaceAreHeldBack) {
  CorrectionsDecoder decoder;
  const auto observations = [](double s, int station) {
    return frame(msm(System::GPS, 7, kTime + s, {some_cell("G07", "1C")}, false, station));
  };
  // The stream starts in the middle of a frame.
  EXPECT_TRUE(decode(decoder, observations(0, 7).substr(9) + observations(1, 7)).empty());
  EXPECT_EQ(decoder.status().epochs_held_back, 1U);
  auto epochs = decode(decoder, frame(station_message(kPosition, 7, 1.5)) + observations(2, 7));
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_LT((epochs[0]->station_ecef - kPosition).norm(),
            1e-4);  // of the antenna, independent of the height over the marker
  EXPECT_TRUE(decode(decoder, observations(3, 8)).empty());
  EXPECT_EQ(decoder.status().station, 8);
  EXPECT_TRUE(decode(decoder, frame(station_message({0, 0, 0}, 8)) +
                                  frame(station_message(2 * kPosition, 8)) + observations(4, 8))
                  .empty());
  EXPECT_EQ(
      decoder.status().problems.at(
          "message 1005: the position is not within 10 km below and 100 km above the Earth's ellipsoid"),
      2U);
  EXPECT_EQ(decode(decoder, frame(station_message(kPosition, 8)) + observations(5, 8)).size(), 1U);
}

// Some bases and casters number 1005 differently from observations.
TEST(RtcmDecoder, PlaceUnderTheNumberOfAStationThatNeverObserves) {
  CorrectionsDecoder decoder;
  const auto observations = [](double s, int station) {
    return frame(msm(System::GPS, 7, kTime + s, {some_cell("G07", "1C")}, false, station));
  };
  const auto epochs = decode(decoder, frame(station_message(kPosition, 0)) + observations(1, 7) +
                                          frame(station_message(kPosition, 0)) + observations(2, 7));
  ASSERT_EQ(epochs.size(), 2U);
  EXPECT_EQ(epochs[1]->station, 7);
  EXPECT_LT((epochs[1]->station_ecef - kPosition).norm(), 1e-4);
  // The phases continue.
  EXPECT_EQ(epochs[1]->observations[0].measurement.phase_since,
            epochs[0]->observations[0].measurement.phase_since);
  // Two such stations: ambiguous.
  EXPECT_TRUE(decode(decoder, frame(station_message(kPosition, 1)) + observations(3, 7)).empty());
  // Its own position has priority.
  EXPECT_EQ(decode(decoder, frame(station_message(kPosition, 7)) + observations(4, 7)).size(), 1U);
}

TEST(RtcmDecoder, NamesAndBiasesAreKept) {
  CorrectionsDecoder decoder;
  Bits names;
  names.put(1033, 12).put(7, 12);
  const auto text = [&](std::string_view word) {
    names.put(word.size(), 8);
    for (const char c : word) names.put(static_cast<unsigned char>(c), 8);
  };
  text("TRM59800.00     SCIS");
  names.put(0, 8);
  text("123");
  text("SEPT MOSAIC-X5");
  text("4.14");
  text("");
  Bits biases;  // not aligned; L1 C/A and L2 C/A: -71.94 m, 3 m
  biases.put(1230, 12).put(7, 12).put(0, 4).put(0b1010, 4).count(-3597, 16).count(150, 16);
  Cell glonass = some_cell("R07", "1C"), precise = some_cell("R07", "2P");
  glonass.extended = precise.extended = 7;
  const Bits observed = msm(System::GLONASS, 7, kTime, {glonass, precise});
  const auto before = decode(decoder, frame(station_message()) + frame(names) + frame(observed));
  const auto epochs =
      decode(decoder, frame(biases) + frame(msm(System::GLONASS, 7, kTime + 1.0, {glonass, precise})));
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_EQ(epochs[0]->antenna_name, "TRM59800.00     SCIS");
  EXPECT_EQ(epochs[0]->receiver_name, "SEPT MOSAIC-X5");
  ASSERT_EQ(before.size(), 1U);
  ASSERT_EQ(epochs[0]->observations.size(), before[0]->observations.size());
  const auto metres = [](const rtk::SignalMeasurement& seen) {
    return *seen.measurement.carrier_phase_cycles * geodesy::kSpeedOfLight /
           seen.measurement.carrier_frequency_hz;
  };
  const rtk::SignalMeasurement &first = epochs[0]->observations[0], &was = before[0]->observations[0];
  EXPECT_FALSE(was.aligned);
  EXPECT_TRUE(first.aligned);
  EXPECT_NEAR(metres(first) - metres(was), -71.94, 1e-6);
  EXPECT_GT(*first.measurement.phase_since, *was.measurement.phase_since);
  EXPECT_FALSE(epochs[0]->observations[1].aligned);  // L2 P: no bias given
}

TEST(RtcmDecoder, BrokenContentIsCountedAndCostsNothingElse) {
  CorrectionsDecoder decoder;
  const Bits good = msm(System::GPS, 7, kTime, {some_cell("G07", "1C"), some_cell("G08", "1C")});
  Bits cut;
  for (std::size_t i = 0; i < good.size() - 20; ++i) cut.put(good[i] ? 1 : 0, 1);
  Bits empty;  // a satellite, and no signal
  empty.put(1077, 12)
      .put(7, 12)
      .put(time_field(System::GPS, kTime), 30)
      .put(1, 1)
      .put(0, 18)
      .put(4, 64)
      .put(0, 32)
      .put(0, 36);
  Bits wide;  // 64 satellites and 32 signals
  wide.put(1077, 12)
      .put(7, 12)
      .put(0, 30)
      .put(0, 19)
      .put(~std::uint64_t{0}, 64)
      .put(0xFFFFFFFF, 32)
      .put(0, 64);
  Bits late;
  late.put(1077, 12).put(7, 12).put(604'800'000, 30).put(0, 19).put(0, 64).put(0, 32);
  Bits unread;
  unread.put(1013, 12).put(0, 40);
  Bits compact;
  compact.put(1073, 12).put(7, 12).put(0, 64).put(0, 64).put(0, 17);
  std::string bytes = frame(station_message());
  for (const Bits& bits : {cut, empty, wide, late, unread, Bits(), compact, good}) bytes += frame(bits);
  const auto epochs = decode(decoder, bytes);
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_EQ(epochs[0]->observations.size(), 2U);
  std::vector<std::string> problems;
  for (const auto& [sentence, count] : decoder.status().problems) problems.push_back(sentence);
  EXPECT_EQ(
      problems,
      (std::vector<std::string>{
          "a message is too short for its number and station", "message 1073: its masks have no cell",
          "message 1077: its masks have no cell", "message 1077: shorter than its masks require",
          "message 1077: the masks have more than 64 cells", "message 1077: the time is beyond its period"}));
  EXPECT_EQ(decoder.status().messages_unread, (std::map<int, std::uint64_t>{{1013, 1}}));
}

TEST(RtcmDecoder, EverySingleWrongBitIsRefused) {
  const std::string first = frame(station_message()),
                    last = frame(msm(System::GPS, 7, kTime + 1, {some_cell("G07", "1C")}));
  const std::string middle =
      frame(msm(System::GPS, 7, kTime, {some_cell("G07", "1C"), some_cell("G09", "1C")}));
  // Enough bytes after it for the longest length that a wrong bit makes.
  std::string rest = last;
  while (rest.size() < 1100) rest += "$GNGGA,1\r\n";
  for (std::size_t bit = 0; bit < 8 * middle.size(); ++bit) {
    std::string damaged = first;
    damaged.append(middle).append(rest);
    char& byte = damaged[first.size() + bit / 8];
    byte = static_cast<char>(byte ^ 1 << bit % 8);
    CorrectionsDecoder decoder;
    const auto epochs = decode(decoder, damaged);
    ASSERT_EQ(epochs.size(), 1U) << bit;
    EXPECT_EQ(epochs[0]->receiver_time, kTime + 1);
  }
}

TEST(RtcmDecoder, HostileBytesNeverCrash) {
  std::mt19937 random(2);
  std::uniform_int_distribution<int> byte(0, 255), length(0, 1023);
  const std::vector<int> numbers{1004, 1005, 1006, 1007, 1008, 1012, 1020, 1033, 1230, 1074,
                                 1075, 1076, 1077, 1084, 1087, 1097, 1107, 1117, 1127, 1137,
                                 1001, 1003, 1009, 1011, 1071, 1073, 1082, 1083, 1121, 1123};
  const RangeTable ranges = [](gnss::SatelliteId id, GpsTime,
                               const Eigen::Vector3d&) -> std::optional<double> {
    return id.number % 3 == 0 ? std::nullopt : std::optional(2e7 + id.number);
  };
  CorrectionsDecoder decoder({}, true, ranges);
  (void)decode(decoder, frame(station_message()));
  for (int i = 0; i < 4000; ++i) {
    // Valid frames of any content: half of them with few satellites and signals.
    Bits message;
    message.put(static_cast<std::uint64_t>(numbers[static_cast<std::size_t>(i) % numbers.size()]), 12);
    const int bytes = length(random);
    if (i % 2 == 0)
      message.put(7, 12)
          .put(static_cast<std::uint64_t>(byte(random)), 30)
          .put(0, 19)
          .put(std::uint64_t{3} << byte(random) % 60, 64)
          .put(0xC0, 32);
    for (int k = 0; k < bytes - 24; ++k) message.put(static_cast<std::uint64_t>(byte(random)), 8);
    std::string text = frame(message);
    if (i % 5 == 0) text.resize(text.size() / 2);
    if (i % 7 == 0) text += "\xD3\x03\xFF";
    for (const auto& epoch : decode(decoder, text)) {
      for (const auto& o : epoch->observations) {
        EXPECT_TRUE(std::isfinite(o.measurement.pseudorange_m));
        EXPECT_NE(o.signal, nullptr);
      }
    }
  }
  for (int i = 0; i < 300'000; ++i)
    (void)decoder.feed(std::string(1, static_cast<char>(byte(random))), kTime);
  EXPECT_LT(decoder.status().problems.size(), 200U);
  EXPECT_LT(decoder.status().messages_unread.size(), 4096U);
  // It still decodes.
  std::string rest(1100, ' ');
  CorrectionsDecoder::Epochs epochs = decode(
      decoder, rest + frame(station_message()) + frame(msm(System::GPS, 7, kTime, {some_cell("G07", "1C")})));
  EXPECT_EQ(epochs.size(), 1U);
}

/// 1004 (GPS) or 1012 (GLONASS): each satellite's cells of 1C, and of L2 if it has that. With one band: 1002,
/// 1010.
Bits legacy(System system, GpsTime time, const std::map<gnss::SatelliteId, std::vector<Cell>>& satellites,
            bool more, bool two_bands = true) {
  const bool glonass = system == System::GLONASS;
  Bits bits;
  bits.put((glonass ? 1010 : 1002) + (two_bands ? 2 : 0), 12).put(7, 12);
  const std::uint64_t reported = time_field(system, time);
  bits.put(glonass ? reported & ((1U << 27) - 1) : reported, glonass ? 27 : 30);
  bits.put(more ? 1 : 0, 1).put(satellites.size(), 5).put(0, 4);
  const double unit_m = kMillisecond_m * (glonass ? 2 : 1);
  const auto lock = [](double s) {
    return static_cast<std::uint64_t>(s < 24 ? s : s < 72 ? (s + 24) / 2 : 50);
  };
  for (const auto& [id, cells] : satellites) {
    const Cell& one = cells[0];
    const auto whole = static_cast<std::uint64_t>(one.range_m / unit_m);
    const auto rest =
        static_cast<std::uint64_t>(std::llround((one.range_m - static_cast<double>(whole) * unit_m) / 0.02));
    const double range_m = static_cast<double>(whole) * unit_m + 0.02 * static_cast<double>(rest);
    // DF012: jumps by 1,500 cycles if the phase is too far.
    const auto phase = [&](const Cell& cell, double carrier_hz) {
      const double rollover_m = 1500 * geodesy::kSpeedOfLight / carrier_hz;
      const double ahead_m = *cell.phase_m - range_m;
      return cell.phase_m ? field(ahead_m - rollover_m * std::round(ahead_m / rollover_m), 0.0005, 20)
                          : none(20);
    };
    const auto carrier_hz = [&](std::size_t k) {
      return glonass ? (k == 0 ? 1602e6 + one.extended * 0.5625e6 - 7 * 0.5625e6
                               : 1246e6 + one.extended * 0.4375e6 - 7 * 0.4375e6)
                     : (k == 0 ? 1575.42e6 : 1227.6e6);
    };
    bits.put(id.number, 6).put(0, 1);
    if (glonass) bits.put(static_cast<std::uint64_t>(one.extended), 5);
    bits.put(rest, glonass ? 25 : 24).put(phase(one, carrier_hz(0)), 20).put(lock(one.lock_s), 7);
    bits.put(whole, glonass ? 7 : 8).positive(one.cn0_dbhz, 0.25, 8);
    if (!two_bands) continue;
    bits.put(0, 2);
    if (cells.size() < 2) {
      bits.put(none(14), 14).put(none(20), 20).put(0, 7).put(0, 8);
      continue;
    }
    const Cell& two = cells[1];
    bits.put(field(two.range_m - range_m, 0.02, 14), 14).put(phase(two, carrier_hz(1)), 20);
    bits.put(lock(two.lock_s), 7).positive(two.cn0_dbhz, 0.25, 8);
  }
  return bits;
}

// A phase that diverges from the codes, as by the ionosphere: DF012 can represent 262 m of it.
TEST(RtcmDecoder, LegacyPhasesGoOnAcrossTheirTurns) {
  CorrectionsDecoder decoder;
  (void)decode(decoder, frame(station_message()));
  std::optional<double> last_m;
  for (int k = 0; k < 400; ++k) {
    Cell cell = some_cell("G07", "1C", 10 + k);
    cell.phase_m = cell.range_m + 3 * k;
    const auto epochs = decode(decoder, frame(legacy(System::GPS, kTime + k, {{cell.id, {cell}}}, false)));
    ASSERT_EQ(epochs.size(), 1U);
    const positioning::Measurement& m = epochs[0]->observations.at(0).measurement;
    const double phase_m = *m.carrier_phase_cycles * geodesy::kSpeedOfLight / m.carrier_frequency_hz;
    if (last_m) {
      EXPECT_NEAR(phase_m - *last_m, 3, 0.0011);
    }
    EXPECT_EQ(*m.phase_since, kTime - 10);
    last_m = phase_m;
  }
}

TEST(RtcmDecoder, LegacyMessagesOfOneBand) {
  for (const char* name : {"G07", "R07"}) {
    std::vector<positioning::Measurement> measured;
    for (const bool two_bands : {true, false}) {
      CorrectionsDecoder decoder;
      (void)decode(decoder, frame(station_message()));
      const Cell cell = some_cell(name, "1C", 10);
      const auto epochs =
          decode(decoder, frame(legacy(cell.id.system, kTime, {{cell.id, {cell}}}, false, two_bands)));
      ASSERT_EQ(epochs.size(), 1U) << name;
      ASSERT_EQ(epochs[0]->observations.size(), 1U);
      measured.push_back(epochs[0]->observations[0].measurement);
    }
    EXPECT_EQ(measured[0].id, measured[1].id);
    EXPECT_EQ(measured[0].pseudorange_m, measured[1].pseudorange_m);
    EXPECT_EQ(measured[0].carrier_phase_cycles, measured[1].carrier_phase_cycles);
    EXPECT_EQ(measured[0].cn0_dbhz, measured[1].cn0_dbhz);
  }
}

/// The compared data: the first minute of a recorded base of five systems, three bands.
struct Recorded {
  rinex::RinexObservations file;
  std::vector<std::map<System, std::vector<Cell>>> epochs;
};
Recorded recorded(const std::filesystem::path& path) {
  rinex::ObservationOptions all;
  all.all_signals = true;
  Recorded read{rinex::read_rinex_observations(path, all), {}};
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, std::pair<double, GpsTime>> arcs;
  for (const auto& epoch : read.file.epochs) {
    if (read.epochs.size() == 60) break;
    auto& cells = read.epochs.emplace_back();
    for (const auto& s : epoch.signals) {
      if (!s.pseudorange_m) continue;
      const auto channel = read.file.header.glonass_channels.find(s.id);
      const bool glonass = s.id.system == System::GLONASS;
      if (glonass && channel == read.file.header.glonass_channels.end()) continue;
      const int number = glonass ? channel->second : 0;
      const double wavelength_m =
          geodesy::kSpeedOfLight / gnss::carrier_hz(*s.signal, gnss::l1_frequency_hz(s.id.system, number));
      Cell cell{s.id,
                s.code.data(),
                *s.pseudorange_m,
                {},
                {},
                0,
                s.cn0_dbhz.value_or(0),
                (s.loss_of_lock & 2) != 0,
                glonass ? number + 7 : 0};
      if (s.doppler_hz) cell.rate_mps = -*s.doppler_hz * wavelength_m;
      if (s.carrier_phase_cycles) {
        const auto [at, first] = arcs.try_emplace({s.id, s.signal});
        if (first || (s.loss_of_lock & 1) != 0)
          at->second = {std::round(cell.range_m / wavelength_m - *s.carrier_phase_cycles),
                        epoch.receiver_time};
        cell.phase_m = (*s.carrier_phase_cycles + at->second.first) * wavelength_m;
        cell.lock_s = epoch.receiver_time - at->second.second;
      }
      cells[s.id.system].push_back(cell);
    }
  }
  return read;
}

// convbin reads the same bytes. Its RINEX has three decimals: half of one, its own rounding, and that of its
// float Dopplers (0.00025 Hz).
void compare_with_rtklib(const std::string& bytes, const Recorded& base, bool glonass_phases,
                         std::size_t signals) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "base.rtcm3", std::ios::binary) << bytes;
  const geodesy::CalendarTime c = geodesy::calendar_from_gps(base.file.epochs[0].receiver_time);
  const std::string command = fmt::format(
      "timeout 60 convbin -r rtcm3 -v 3.04 -f 8 -tr {:04d}/{:02d}/{:02d} {:02d}:{:02d}:{:02d} -os -od -o "
      "'{}' '{}' >/dev/null 2>&1",
      c.year, c.month, c.day, c.hour, c.minute, c.second, (folder / "judged.obs").string(),
      (folder / "base.rtcm3").string());
  ASSERT_EQ(test::run_program(command).status, 0) << command;
  rinex::ObservationOptions all;
  all.all_signals = true;
  const auto theirs = rinex::read_rinex_observations(folder / "judged.obs", all);
  const auto ours = read_rtcm_corrections(
      folder / "base.rtcm3", base.file.epochs[0].receiver_time,
      [&](gnss::SatelliteId id) -> std::optional<int> { return base.file.header.glonass_channels.at(id); });
  EXPECT_TRUE(ours.status.problems.empty());
  EXPECT_EQ(ours.status.checksum_errors, 0U);
  ASSERT_EQ(ours.epochs.size(), base.epochs.size());
  ASSERT_EQ(theirs.epochs.size(), base.epochs.size());
  std::size_t values = 0, phases = 0, rates = 0;
  for (std::size_t k = 0; k < ours.epochs.size(); ++k) {
    EXPECT_EQ(ours.epochs[k]->receiver_time, theirs.epochs[k].receiver_time);
    std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, const rinex::ObservedSignal*> index;
    for (const auto& s : theirs.epochs[k].signals) index[{s.id, s.signal}] = &s;
    for (const auto& o : ours.epochs[k]->observations) {
      const positioning::Measurement& m = o.measurement;
      const auto at = index.find({m.id, o.signal});
      ASSERT_NE(at, index.end()) << to_string(m.id) << ' ' << o.signal->name;
      ++values;
      EXPECT_NEAR(m.pseudorange_m, at->second->pseudorange_m.value(), 0.00051)
          << to_string(m.id) << ' ' << o.signal->name;
      if (at->second->carrier_phase_cycles) {
        ++phases;
        EXPECT_NEAR(m.carrier_phase_cycles.value(), *at->second->carrier_phase_cycles, 0.00052)
            << to_string(m.id) << ' ' << o.signal->name << ' ' << k;
        EXPECT_EQ(m.half_cycle, (at->second->loss_of_lock & 2) != 0);
      } else if (m.id.system != System::GLONASS || glonass_phases) {
        EXPECT_FALSE(m.carrier_phase_cycles) << to_string(m.id) << ' ' << o.signal->name;
      }
      if (at->second->doppler_hz) {
        ++rates;
        EXPECT_NEAR(m.doppler_hz.value(), *at->second->doppler_hz, 0.00076);
      }
      EXPECT_NEAR(m.cn0_dbhz.value_or(0), at->second->cn0_dbhz.value_or(0), 0.0011);
    }
  }
  std::cout << "compared " << values << " pseudoranges, " << phases << " phases, " << rates << " Dopplers\n";
  EXPECT_EQ(values, signals);
  EXPECT_GT(phases, signals * 8 / 10);
}

TEST(RtcmDecoder, MsmOfARecordedBaseAsRtklibReadsThem) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_SHARED_DATA(path, "rtk-nagoya-20240624/base.obs");
  const Recorded base = recorded(path);
  for (int kind = 4; kind <= 7; ++kind) {
    std::string bytes = frame(station_message());
    std::size_t signals = 0;
    for (std::size_t k = 0; k < base.epochs.size(); ++k) {
      std::vector<Bits> messages;
      for (const auto& [system, cells] : base.epochs[k]) {
        signals += cells.size();
        // At most 64 cells in a message: at most ten satellites.
        std::vector<Cell> part;
        std::set<gnss::SatelliteId> satellites;
        for (const Cell& cell : cells) {
          if (satellites.insert(cell.id).second && satellites.size() % 10 == 1 && !part.empty()) {
            messages.push_back(msm(system, kind, base.file.epochs[k].receiver_time, part, true));
            part.clear();
          }
          part.push_back(cell);
        }
        messages.push_back(msm(system, kind, base.file.epochs[k].receiver_time, part,
                               system != base.epochs[k].rbegin()->first));
      }
      for (const Bits& message : messages) bytes += frame(message);
    }
    SCOPED_TRACE(kind);
    compare_with_rtklib(bytes, base, kind % 2 == 1, signals);
  }
}

TEST(RtcmDecoder, LegacyMessagesOfARecordedBaseAsRtklibReadsThem) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_SHARED_DATA(path, "rtk-nagoya-20240624/base.obs");
  const Recorded base = recorded(path);
  for (const bool two_bands : {true, false}) {
    std::string bytes = frame(station_message());
    std::size_t signals = 0;
    for (std::size_t k = 0; k < base.epochs.size(); ++k) {
      for (const System system : {System::GPS, System::GLONASS}) {
        std::map<gnss::SatelliteId, std::vector<Cell>> satellites;
        for (const Cell& cell : base.epochs[k].at(system)) {
          if (cell.code == "1C") satellites[cell.id].push_back(cell);
          // There is space for one of L2: P(Y) is left out.
          if (two_bands && cell.code.front() == '2' && cell.code != "2W" && satellites.count(cell.id) > 0 &&
              cell.phase_m)
            satellites[cell.id].push_back(cell);
        }
        for (const auto& [id, cells] : satellites) signals += cells.size();
        bytes += frame(
            legacy(system, base.file.epochs[k].receiver_time, satellites, system == System::GPS, two_bands));
      }
    }
    compare_with_rtklib(bytes, base, true, signals);
  }
}

TEST(RtcmDecoder, FilesWithoutCorrectionsSayWhatIsMissing) {
  const test::TemporaryFolder folder;
  const auto refused = [&](const std::string& bytes) {
    std::ofstream(folder / "base.rtcm3", std::ios::binary) << bytes;
    return test::refusal([&] { (void)read_rtcm_corrections(folder / "base.rtcm3", kTime); });
  };
  EXPECT_THAT(refused("$GNGGA\r\n"), HasSubstr("base.rtcm3: has no message of RTCM 3; give a recorded"));
  EXPECT_THAT(refused(frame(station_message())),
              HasSubstr("has no observations of a base; have the base send MSM4"));
  const std::string observations = frame(msm(System::GPS, 7, kTime, {some_cell("G07", "1C")}));
  EXPECT_THAT(refused(observations),
              HasSubstr("has no position of the station; have the base send message 1005"));
  EXPECT_EQ(refused(frame(station_message()) + observations), "");
  // Each message is marked as the last of its epoch: the decoded file has the epoch once, complete.
  std::ofstream(folder / "base.rtcm3", std::ios::binary)
      << frame(station_message()) + observations +
             frame(msm(System::Galileo, 7, kTime, {some_cell("E07", "1C")}));
  const auto read = read_rtcm_corrections(folder / "base.rtcm3", kTime).epochs;
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0]->observations.size(), 2U);
  EXPECT_THAT(test::refusal([&] { (void)read_rtcm_corrections(folder / "none.rtcm3", kTime); }),
              HasSubstr("none.rtcm3"));
}

}  // namespace
}  // namespace canyon::rtcm
