// Messages whose whole milliseconds are removed must give the same ranges as with them.
#include "canyon/receiver/rtcm/rtcm_file.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <memory>

#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/rtcm_messages.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::rtcm {
namespace {

using broadcast::Bits;
using geodesy::GpsTime;
using gnss::System;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Key;

void copy(const Bits& from, std::size_t first, std::size_t count, Bits& to) {
  for (std::size_t k = 0; k < count; ++k) to.put(from.number(first + k, 1), 1);
}

/// MSM1, MSM2 or MSM3 of an MSM4: RTCM 10403.3, tables 3.5-80 to 3.5-84. MSM4 has for each satellite 8 bits
/// of whole milliseconds and 10 of the rest, and for each cell 15 bits of code, 22 of phase, 4 of lock time,
/// 1 of half cycles and 6 of C/N0.
Bits reduced(const Bits& msm4, int kind) {
  constexpr std::size_t kMasks = 73;
  std::size_t satellites = 0, signals = 0, cells = 0;
  for (std::size_t k = 0; k < 64; ++k) satellites += msm4.number(kMasks + k, 1);
  for (std::size_t k = 0; k < 32; ++k) signals += msm4.number(kMasks + 64 + k, 1);
  const std::size_t mask = kMasks + 96;
  for (std::size_t k = 0; k < satellites * signals; ++k) cells += msm4.number(mask + k, 1);
  Bits bits;
  bits.put(msm4.number(0, 12) - 4 + static_cast<std::uint64_t>(kind), 12);
  copy(msm4, 12, mask - 12 + satellites * signals, bits);
  std::size_t at = mask + satellites * signals + 8 * satellites;
  copy(msm4, at, 10 * satellites, bits);
  at += 10 * satellites;
  if (kind != 2) copy(msm4, at, 15 * cells, bits);
  at += 15 * cells;
  if (kind != 1) copy(msm4, at, (22 + 4 + 1) * cells, bits);
  return bits;
}

/// Ranges of some satellites, with a clock that is `clock_m` ahead.
std::vector<Cell> some_cells(double clock_m) {
  std::vector<Cell> cells;
  for (const char* name : {"G03", "G07", "G11", "G19", "G30"}) {
    Cell cell = some_cell(name, "1C");
    cell.range_m = 20.1e6 + 1'234'567.0 * static_cast<double>(cells.size()) + clock_m;
    cell.phase_m = cell.range_m + 4;
    cells.push_back(cell);
  }
  return cells;
}

/// Predictions of the ranges of some_cells(0), off by less than 1 km.
RangeTable some_table(double off_m = 700) {
  return [off_m](gnss::SatelliteId id, GpsTime, const Eigen::Vector3d&) -> std::optional<double> {
    for (const Cell& cell : some_cells(0))
      if (cell.id == id) return cell.range_m + off_m * (id.number % 3 - 1);
    return std::nullopt;
  };
}

TEST(WholeMilliseconds, MessagesWithoutThemGiveTheRangesOfThoseWithThem) {
  for (const double clock_m : {0.0, 50'000.0, -140'000.0}) {
    const Bits msm4 = msm(System::GPS, 4, kTime, some_cells(clock_m));
    CorrectionsDecoder whole;
    const auto expected = whole.feed(frame(station_message()) + frame(msm4), kTime);
    ASSERT_EQ(expected.size(), 1U);
    for (const int kind : {1, 3}) {
      CorrectionsDecoder decoder({}, true, some_table());
      const auto epochs = decoder.feed(frame(station_message()) + frame(reduced(msm4, kind)), kTime);
      EXPECT_THAT(decoder.status().problems, IsEmpty());
      ASSERT_EQ(epochs.size(), 1U);
      ASSERT_EQ(epochs[0]->observations.size(), 5U);
      for (std::size_t k = 0; k < 5; ++k) {
        const auto& m = epochs[0]->observations[k].measurement;
        const auto& as = expected[0]->observations[k].measurement;
        EXPECT_NEAR(m.pseudorange_m, as.pseudorange_m, 1e-6) << clock_m;
        EXPECT_FALSE(m.cn0_dbhz);
        EXPECT_EQ(m.carrier_phase_cycles.has_value(), kind == 3);
        if (kind == 3) {
          EXPECT_NEAR(*m.carrier_phase_cycles, *as.carrier_phase_cycles, 1e-6);
        }
      }
    }
  }
}

TEST(WholeMilliseconds, WithoutEphemeridesNothingIsGuessed) {
  const Bits msm3 = reduced(msm(System::GPS, 4, kTime, some_cells(0)), 3);
  CorrectionsDecoder decoder;
  EXPECT_THAT(decoder.feed(frame(station_message()) + frame(msm3), kTime), IsEmpty());
  EXPECT_THAT(decoder.status().problems, Contains(Key(HasSubstr("they need ephemerides and the position"))));
  EXPECT_EQ(decoder.status().without_milliseconds.size(), 5U);
  // Epochs of MSM4 in between are read.
  const auto epochs = decoder.feed(frame(msm(System::GPS, 4, kTime + 1, some_cells(0))), kTime);
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_EQ(epochs[0]->observations.size(), 5U);
}

TEST(WholeMilliseconds, OneThatContradictsIsLeftOut) {
  std::vector<Cell> cells = some_cells(1000);
  cells[2].range_m += 0.3 * kMillisecond_m;
  CorrectionsDecoder decoder({}, true, some_table());
  const auto epochs =
      decoder.feed(frame(station_message()) + frame(reduced(msm(System::GPS, 4, kTime, cells), 3)), kTime);
  ASSERT_EQ(epochs.size(), 1U);
  EXPECT_EQ(epochs[0]->observations.size(), 4U);
  EXPECT_THAT(decoder.status().problems, Contains(Key(HasSubstr("do not agree with it"))));
}

// A position that is off by 60 km.
TEST(WholeMilliseconds, AWrongPlaceIsRefused) {
  CorrectionsDecoder decoder({}, true, some_table(60'000));
  EXPECT_THAT(
      decoder.feed(frame(station_message()) + frame(reduced(msm(System::GPS, 4, kTime, some_cells(0)), 3)),
                   kTime),
      IsEmpty());
  EXPECT_THAT(decoder.status().problems, Contains(Key(HasSubstr("check the position of the station"))));
}

TEST(WholeMilliseconds, PhasesAloneAreNamed) {
  CorrectionsDecoder decoder({}, true, some_table());
  EXPECT_THAT(
      decoder.feed(frame(station_message()) + frame(reduced(msm(System::GPS, 4, kTime, some_cells(0)), 2)),
                   kTime),
      IsEmpty());
  EXPECT_THAT(decoder.status().problems, Contains(Key(HasSubstr("message 1072: it has only phases"))));
}

// RTCM 10403.3, tables 3.5-1 to 3.5-3, 3.5-10: 1001 and 1009, of which 1002 and 1010 have more fields.
TEST(WholeMilliseconds, LegacyMessages) {
  for (const bool glonass : {false, true}) {
    const double unit_m = kMillisecond_m * (glonass ? 2 : 1);
    const std::vector<Cell> cells = some_cells(30'000);
    Bits bits;
    const System system = glonass ? System::GLONASS : System::GPS;
    bits.put(glonass ? 1009 : 1001, 12).put(7, 12);
    const std::uint64_t reported = time_field(system, kTime);
    bits.put(glonass ? reported & ((1U << 27) - 1) : reported, glonass ? 27 : 30)
        .put(0, 1)
        .put(cells.size(), 5)
        .put(0, 4);
    for (std::size_t k = 0; k < cells.size(); ++k) {
      bits.put(k + 1, 6).put(0, 1);
      if (glonass) bits.put(k + 3, 5);
      const double modulo_m = std::fmod(cells[k].range_m, unit_m);
      bits.put(static_cast<std::uint64_t>(std::llround(modulo_m / 0.02)), glonass ? 25 : 24);
      bits.put(field(3, 0.0005, 20), 20).put(50, 7);
    }
    const RangeTable table = [](gnss::SatelliteId id, GpsTime, const Eigen::Vector3d&) {
      return std::optional<double>(some_cells(0).at(id.number - 1U).range_m);
    };
    CorrectionsDecoder decoder({}, true, table);
    const auto epochs = decoder.feed(frame(station_message()) + frame(bits), kTime);
    EXPECT_THAT(decoder.status().problems, IsEmpty());
    ASSERT_EQ(epochs.size(), 1U);
    ASSERT_EQ(epochs[0]->observations.size(), cells.size());
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const auto& m = epochs[0]->observations[k].measurement;
      EXPECT_NEAR(m.pseudorange_m, cells[k].range_m, 0.0101);
      EXPECT_NEAR(*m.carrier_phase_cycles * geodesy::kSpeedOfLight / m.carrier_frequency_hz - m.pseudorange_m,
                  3, 0.0003);
    }
  }
}

// The ranges of a recorded base, with its own clock, by the broadcast ephemerides of the hour.
TEST(WholeMilliseconds, OfARecordedBase) {
  CANYON_SHARED_DATA(observations, "rtk-nagoya-20240624/base.obs");
  CANYON_SHARED_DATA(ephemerides, "rtk-nagoya-20240624/base.nav");
  const auto sky = std::make_shared<orbit::BroadcastSky>(rinex::read_rinex_navigation(ephemerides));
  const auto file = rinex::read_observations(observations, {});
  ASSERT_TRUE(file.header.approximate_position_ecef);
  std::size_t compared = 0, left_out = 0;
  CorrectionsDecoder decoder({}, true, range_table(sky));
  (void)decoder.feed(frame(station_message(*file.header.approximate_position_ecef)),
                     file.epochs[0].receiver_time);
  for (std::size_t k = 0; k < std::min<std::size_t>(file.epochs.size(), 600); k += 10) {
    const auto& epoch = file.epochs[k];
    std::map<System, std::vector<Cell>> cells;
    std::map<gnss::SatelliteId, double> ranges_m;
    for (const auto& s : epoch.signals) {
      if (!s.pseudorange_m || s.id.system == System::SBAS) continue;
      Cell cell = some_cell("G01", s.code.data());
      cell.id = s.id;
      cell.range_m = *s.pseudorange_m;
      cell.phase_m = {};
      cells[s.id.system].push_back(cell);
      ranges_m[s.id] = *s.pseudorange_m;
    }
    std::string bytes;
    for (const auto& [system, those] : cells)
      bytes += frame(reduced(msm(system, 4, epoch.receiver_time, those, system != cells.rbegin()->first), 1));
    const auto epochs = decoder.feed(bytes, epoch.receiver_time);
    ASSERT_EQ(epochs.size(), 1U);
    left_out += ranges_m.size() - epochs[0]->observations.size();
    for (const auto& seen : epochs[0]->observations) {
      EXPECT_NEAR(seen.measurement.pseudorange_m, ranges_m.at(seen.measurement.id), 0.01)
          << to_string(seen.measurement.id);
      ++compared;
    }
  }
  std::cout << "compared " << compared << " pseudoranges, " << left_out << " without ephemerides\n";
  EXPECT_GT(compared, 1000U);
  EXPECT_LT(left_out, compared / 10);
}

TEST(WholeMilliseconds, FilesSayWhatTheyLack) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "base.rtcm3", std::ios::binary)
      << frame(station_message()) + frame(reduced(msm(System::GPS, 4, kTime, some_cells(0)), 3));
  EXPECT_THAT(test::refusal([&] { (void)read_rtcm_corrections(folder / "base.rtcm3", kTime); }),
              HasSubstr("omit the whole milliseconds of ranges"));
  EXPECT_EQ(read_rtcm_corrections(folder / "base.rtcm3", kTime, {}, true, some_table()).epochs.size(), 1U);
  std::ofstream(folder / "base.rtcm3", std::ios::binary)
      << frame(station_message()) + frame(reduced(msm(System::GPS, 4, kTime, some_cells(0)), 2));
  EXPECT_THAT(test::refusal([&] { (void)read_rtcm_corrections(folder / "base.rtcm3", kTime); }),
              HasSubstr("has no observations of a base (message 1072: it has only phases"));
}

}  // namespace
}  // namespace canyon::rtcm
