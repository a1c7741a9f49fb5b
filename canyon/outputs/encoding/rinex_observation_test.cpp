#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/outputs/encoding/stream.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sample_signals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding {
namespace {

ReceiverDescription sample_header() {
  ReceiverDescription header;
  header.name = "rover \xC3\xA4";
  header.systems = {gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  for (std::uint8_t slot = 1; slot <= 24; ++slot) {
    header.glonass_channels[{gnss::System::GLONASS, slot}] = slot % 14 - 7;
  }
  header.interval_s = 0.5;
  header.begin = test::sample_time();
  return header;
}

struct Parsed {
  std::multimap<std::string, std::string> header;  ///< columns 1 to 60 by label
  struct Epoch {
    geodesy::GpsTime tag;
    std::map<std::string, std::pair<double, std::optional<double>>> observations;
  };
  std::vector<Epoch> epochs;

  [[nodiscard]] std::string one(const std::string& label) const {
    EXPECT_EQ(header.count(label), 1U) << label;
    const auto found = header.find(label);
    return found == header.end() ? std::string() : found->second;
  }
};

/// Reads back by the columns of the RINEX 3.04 document, tables A2 and A3.
Parsed read_back(const std::filesystem::path& path) {
  TextFile file(path);
  Parsed parsed;
  bool in_header = true;
  const auto integer = [](std::string_view text) {
    return static_cast<int>(parse_integer(text).value_or(-1));
  };
  std::size_t expected = 0;
  while (const auto line = file.next_line()) {
    if (in_header) {
      EXPECT_EQ(line->size(), 80U) << *line;
      const std::string label(trim(column(*line, 60, 20)));
      parsed.header.emplace(label, std::string(column(*line, 0, 60)));
      in_header = label != "END OF HEADER";
      continue;
    }
    if (line->front() == '>') {
      EXPECT_EQ(expected, parsed.epochs.empty() ? 0 : parsed.epochs.back().observations.size());
      // A1,1X,I4,4(1X,I2.2),F11.7,2X,I1,I3
      const geodesy::GpsTime minute = geodesy::gps_from_calendar(
          {integer(column(*line, 2, 4)), integer(column(*line, 7, 2)), integer(column(*line, 10, 2)),
           integer(column(*line, 13, 2)), integer(column(*line, 16, 2)), 0, 0});
      const auto seconds = parse_double(column(*line, 18, 11));
      EXPECT_TRUE(seconds) << *line;
      EXPECT_LT(seconds.value_or(99), 60.0);
      EXPECT_EQ(column(*line, 31, 1), "0");
      expected = static_cast<std::size_t>(integer(column(*line, 32, 3)));
      parsed.epochs.push_back({minute + seconds.value_or(0), {}});
      continue;
    }
    const auto range = parse_double(column(*line, 3, 14));
    EXPECT_TRUE(range) << *line;
    EXPECT_EQ(trim(column(*line, 17, 2)), "");
    parsed.epochs.back().observations[std::string(line->substr(0, 3))] = {
        range.value_or(0), parse_double(column(*line, 19, 14))};
  }
  EXPECT_FALSE(in_header);
  EXPECT_EQ(expected, parsed.epochs.empty() ? 0 : parsed.epochs.back().observations.size());
  return parsed;
}

/// Five epochs of 0.5 s, the third without any measurement.
std::vector<simulation::Epoch> sample_run() {
  std::vector<simulation::Epoch> epochs;
  for (int i = 0; i < 5; ++i) {
    epochs.push_back(
        test::sample_epoch(test::sample_time() + 0.5 * i, test::sample_point(), {1, 2, 3}, i != 3));
    // The clock gains 33 ns per epoch, so that tags are rounded up and down.
    epochs.back().observed.receiver_time = epochs.back().observed.receiver_time + 33e-9 * i;
    for (auto& satellite : epochs.back().observed.satellites) {
      if (i == 2) satellite.measurement.reset();
      if (i == 4 && satellite.measurement) satellite.measurement->doppler_hz.reset();
    }
  }
  return epochs;
}

void write(const std::filesystem::path& path, const std::vector<simulation::Epoch>& epochs,
           bool signals = false) {
  ReceiverDescription header = sample_header();
  header.signal.enabled = signals;
  const auto sink = open_file("rinex_observation", path, 0, header);
  for (const auto& epoch : epochs) sink->write(epoch);
  sink->finish();
}

// A receiver after a week rollover writes 1999, and the leap seconds sent by satellites today.
TEST(RinexObservation, HasTheDateThatTheReceiverBelieves) {
  const test::TemporaryFolder folder;
  std::vector<simulation::Epoch> epochs = sample_run();
  for (auto& epoch : epochs) epoch.observed.events.weeks_off = -1024;
  write(folder / "off.obs", epochs);
  write(folder / "right.obs", sample_run());
  const Parsed off = read_back(folder / "off.obs"), right = read_back(folder / "right.obs");
  ASSERT_EQ(off.epochs.size(), right.epochs.size());
  EXPECT_EQ(right.epochs[0].tag - off.epochs[0].tag, 1024 * 604'800.0);
  EXPECT_EQ(off.epochs[0].observations, right.epochs[0].observations);
  EXPECT_EQ(off.one("TIME OF FIRST OBS").substr(2, 16), "1999     9    12");
  EXPECT_EQ(off.one("LEAP SECONDS"), right.one("LEAP SECONDS"));
}

TEST(RinexObservation, HeaderIsComplete) {
  const test::TemporaryFolder folder;
  write(folder / "receiver.obs", sample_run());
  const Parsed file = read_back(folder / "receiver.obs");
  EXPECT_EQ(file.one("RINEX VERSION / TYPE").substr(0, 41), "     3.04           OBSERVATION DATA    M");
  EXPECT_EQ(trim(file.one("MARKER NAME")), "rover ??");
  EXPECT_EQ(file.one("END OF HEADER").size(), 60U);
  for (const char* label : {"PGM / RUN BY / DATE", "OBSERVER / AGENCY", "REC # / TYPE / VERS", "ANT # / TYPE",
                            "ANTENNA: DELTA H/E/N", "GLONASS COD/PHS/BIS", "MARKER TYPE"}) {
    EXPECT_EQ(file.header.count(label), 1U) << label;
  }
  const std::string position = file.one("APPROX POSITION XYZ");
  const Eigen::Vector3d truth = geodesy::ecef_from_geodetic(test::sample_point());
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(*parse_double(position.substr(static_cast<std::size_t>(14 * i), 14)), truth[i], 5.1e-5);
  }
  EXPECT_EQ(file.one("TIME OF FIRST OBS"), "  2019     4    28    12    58   21.0001235     GPS         ");
  // 21 s + 123456.78 ns (kept as 123457) + 4 * (0.5 s + 33 ns).
  EXPECT_EQ(file.one("TIME OF LAST OBS"), "  2019     4    28    12    58   23.0001236     GPS         ");
  EXPECT_EQ(file.one("INTERVAL").substr(0, 10), "     0.500");
  EXPECT_EQ(file.one("LEAP SECONDS").substr(0, 6), "    18");
  std::vector<std::string> types;
  for (auto [it, end] = file.header.equal_range("SYS / # / OBS TYPES"); it != end; ++it) {
    types.emplace_back(trim(it->second));
  }
  EXPECT_EQ(types, (std::vector<std::string>{"G    2 C1C D1C", "R    2 C1C D1C", "E    2 C1X D1X",
                                             "C    2 C2I D2I", "J    2 C1C D1C", "S    2 C1C D1C"}));
  EXPECT_EQ(file.header.count("SYS / PHASE SHIFT"), 6U);
  std::map<std::string, int> channels;
  for (auto [it, end] = file.header.equal_range("GLONASS SLOT / FRQ #"); it != end; ++it) {
    for (std::size_t i = 4; i + 6 < 60; i += 7) {
      if (trim(it->second.substr(i, 6)).empty()) continue;
      channels[it->second.substr(i, 3)] = static_cast<int>(*parse_integer(it->second.substr(i + 4, 2)));
    }
  }
  EXPECT_EQ(file.header.find("GLONASS SLOT / FRQ #")->second.substr(0, 4), " 24 ");
  ASSERT_EQ(channels.size(), 24U);
  for (int slot = 1; slot <= 24; ++slot) {
    const gnss::SatelliteId id{gnss::System::GLONASS, static_cast<std::uint8_t>(slot)};
    EXPECT_EQ(channels[gnss::to_string(id)], slot % 14 - 7);
  }
}

TEST(RinexObservation, TagIsRoundedAndPseudorangeIsNot) {
  const test::TemporaryFolder folder;
  const auto epochs = sample_run();
  write(folder / "receiver.obs", epochs);
  const Parsed file = read_back(folder / "receiver.obs");
  ASSERT_EQ(file.epochs.size(), 4U) << "the epoch without measurements is left out";
  const std::size_t kept[] = {0, 1, 3, 4};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& written = epochs[kept[i]].observed;
    const auto& read = file.epochs[i];
    EXPECT_LE(std::abs(read.tag - written.receiver_time), 50.1e-9);
    EXPECT_EQ(read.tag.nanoseconds() % 100, 0);
    EXPECT_EQ(read.observations.size(), 10U);
    for (const auto& satellite : written.satellites) {
      const auto found = read.observations.find(gnss::to_string(satellite.id));
      ASSERT_EQ(found != read.observations.end(), satellite.measurement.has_value());
      if (!satellite.measurement) continue;
      EXPECT_NEAR(found->second.first, satellite.measurement->pseudorange_m, 0.6e-3);
      ASSERT_EQ(found->second.second.has_value(), satellite.measurement->doppler_hz.has_value());
      if (found->second.second) {
        EXPECT_NEAR(*found->second.second, *satellite.measurement->doppler_hz, 0.6e-3);
      }
    }
  }
}

TEST(RinexObservation, TagRoundsIntoTheNextDay) {
  const test::TemporaryFolder folder;
  // 2019-12-31 23:59:59.99999996 GPST.
  auto epoch = test::sample_epoch(geodesy::gps_from_calendar({2019, 12, 31, 23, 59, 59, 999'999'960}),
                                  test::sample_point(), {0, 0, 0});
  epoch.observed.receiver_time = epoch.observed.time;
  write(folder / "receiver.obs", {epoch});
  const std::string text = test::read_bytes(folder / "receiver.obs");
  EXPECT_NE(text.find("\n> 2020 01 01 00 00  0.0000000  0 10\n"), std::string::npos);
  EXPECT_EQ(read_back(folder / "receiver.obs").one("TIME OF FIRST OBS").substr(0, 43),
            "  2020     1     1     0     0    0.0000000");
}

TEST(RinexObservation, NothingReceivedIsAHeaderAlone) {
  const test::TemporaryFolder folder;
  write(folder / "receiver.obs", {sample_run()[2]});
  const Parsed file = read_back(folder / "receiver.obs");
  EXPECT_TRUE(file.epochs.empty());
  EXPECT_EQ(file.one("TIME OF FIRST OBS").substr(0, 43), "  2019     4    28    12    58   21.0000000");
  EXPECT_EQ(file.one("TIME OF LAST OBS"), file.one("TIME OF FIRST OBS"));
}

TEST(RinexObservation, EqualRunsGiveEqualBytes) {
  const test::TemporaryFolder folder;
  write(folder / "a.obs", sample_run());
  write(folder / "b.obs", sample_run());
  EXPECT_EQ(test::read_bytes(folder / "a.obs"), test::read_bytes(folder / "b.obs"));
}

/// Four epochs of 0.5 s with strengths and phases, which follow the Doppler. G05 slips before the third; R01
/// is missing at the second and third and returns with continuous phase; C03 starts a new arc at the fourth,
/// after a gap of one.
std::vector<simulation::Epoch> signal_run() {
  std::vector<simulation::Epoch> epochs;
  const geodesy::GpsTime begin = test::sample_time();
  for (int i = 0; i < 4; ++i) {
    epochs.push_back(test::sample_signal_epoch(begin + 0.5 * i, begin - 2));
    auto& satellites = epochs.back().observed.satellites;
    for (auto& s : satellites) {
      if (!s.measurement) continue;
      const double cycles = -*s.measurement->doppler_hz * 0.5 * i;
      if (s.measurement->carrier_phase_cycles) *s.measurement->carrier_phase_cycles += cycles;
      s.measurement->pseudorange_m += cycles * geodesy::kSpeedOfLight / s.measurement->carrier_frequency_hz;
    }
    if (i >= 2) {
      satellites[0].measurement->phase_since = begin + 0.75;  // G05
      *satellites[0].measurement->carrier_phase_cycles += 7;
    }
    if (i == 1 || i == 2) satellites[5].measurement.reset();              // R01
    if (i == 2) satellites[9].measurement->carrier_phase_cycles.reset();  // C03
    if (i == 3) satellites[9].measurement->phase_since = begin + 1.25;
  }
  return epochs;
}

/// The 16 characters of a satellite's observation `n` at epoch `e` (both from 0).
std::string observation_field(const std::string& text, int e, const std::string& satellite, int n) {
  std::size_t at = text.find("END OF HEADER");
  for (int i = 0; i <= e; ++i) at = text.find("\n> ", at) + 1;
  const std::size_t end = std::min(text.find("\n> ", at), text.size());
  const std::size_t line = text.find("\n" + satellite, at);
  if (line >= end) return "absent";
  std::string fields = text.substr(line + 4, text.find('\n', line + 1) - line - 4);
  fields.resize(16 * 4, ' ');
  return fields.substr(static_cast<std::size_t>(16 * n), 16);
}

TEST(RinexObservation, PhasesAndStrengths) {
  const test::TemporaryFolder folder;
  const auto epochs = signal_run();
  write(folder / "receiver.obs", epochs, true);
  const std::string text = test::read_bytes(folder / "receiver.obs");
  for (const char* line : {"G    4 C1C L1C D1C S1C", "R    4 C1C L1C D1C S1C", "E    4 C1X L1X D1X S1X",
                           "C    4 C2I L2I D2I S2I", "J    4 C1C L1C D1C S1C"}) {
    EXPECT_NE(text.find(std::string("\n") + line + " "), std::string::npos) << line;
  }
  EXPECT_NE(text.find("\nDBHZ" + std::string(56, ' ') + "SIGNAL STRENGTH UNIT"), std::string::npos);
  // A1,1X,A3,1X,F8.5
  EXPECT_NE(text.find("\nC L2I  0.00000" + std::string(46, ' ') + "SYS / PHASE SHIFT"), std::string::npos);

  // 46.3 dB-Hz: 42-47 is class 7 of table 12.
  EXPECT_EQ(observation_field(text, 0, "G05", 0).substr(14), " 7");
  EXPECT_EQ(observation_field(text, 0, "G05", 1).substr(14), " 7");
  EXPECT_EQ(observation_field(text, 0, "G05", 3), "        46.300  ");
  EXPECT_EQ(trim(observation_field(text, 0, "G12", 1)), "") << "has no phase";
  EXPECT_EQ(observation_field(text, 0, "E36", 1).substr(14), " 3");

  // Phase and measured phase differ by whole cycles, constant along an arc; at its beginning the phase is
  // within half a cycle of the range.
  std::map<std::string, double> arcs;
  for (int i = 0; i < 4; ++i) {
    const auto& seen = epochs[static_cast<std::size_t>(i)].observed;
    for (const auto& s : seen.satellites) {
      const std::string id = gnss::to_string(s.id);
      if (!s.measurement || !s.measurement->carrier_phase_cycles) continue;
      const double cycles_per_m = s.measurement->carrier_frequency_hz / geodesy::kSpeedOfLight;
      const auto range = parse_double(trim(observation_field(text, i, id, 0).substr(0, 14)));
      const auto phase = parse_double(trim(observation_field(text, i, id, 1).substr(0, 14)));
      ASSERT_TRUE(range && phase) << id << " at " << i;
      const double whole = *phase - *s.measurement->carrier_phase_cycles;
      EXPECT_NEAR(whole, std::round(whole), 0.6e-3) << id;
      // Three decimals of a metre are 2.6e-3 cycles.
      EXPECT_LE(std::abs(*phase - *range * cycles_per_m), 0.51) << id << " at " << i;
      const bool slipped = (id == "G05" && i == 2) || (id == "C03" && i == 3);
      EXPECT_EQ(observation_field(text, i, id, 1)[14], slipped ? '1' : ' ') << id << " at " << i;
      if (arcs.count(id) > 0 && !slipped) {
        EXPECT_NEAR(arcs[id], whole, 2e-3) << id << " at " << i;
      }
      arcs[id] = whole;
    }
  }
  EXPECT_EQ(observation_field(text, 1, "R01", 1), "absent");
  EXPECT_EQ(trim(observation_field(text, 2, "C03", 1)), "");
}

// RINEX 3.04, table 12.
TEST(RinexObservation, StrengthIndicator) {
  for (const auto& [cn0_dbhz, indicator] : {std::pair{-10.0, 1},
                                            {0.0, 1},
                                            {11.99, 1},
                                            {12.0, 2},
                                            {17.99, 2},
                                            {18.0, 3},
                                            {24.0, 4},
                                            {30.0, 5},
                                            {35.9, 5},
                                            {36.0, 6},
                                            {42.0, 7},
                                            {48.0, 8},
                                            {53.9, 8},
                                            {54.0, 9},
                                            {99.0, 9}}) {
    EXPECT_EQ(signal_strength_indicator(cn0_dbhz), indicator) << cn0_dbhz;
  }
}

// RTKLIB reads the file with its own readrnx and writes the result.
class RinexObservationJudged : public testing::TestWithParam<bool> {};
TEST_P(RinexObservationJudged, RtklibReadsTheSame) {
  CANYON_NEEDS_PROGRAM("convbin");
  const test::TemporaryFolder folder;
  write(folder / "receiver.obs", GetParam() ? signal_run() : sample_run(), GetParam());
  const auto result =
      test::run_program("cd '" + folder.path().string() + "' && convbin -r rinex -v 3.04 -od " +
                        (GetParam() ? "-os" : "") + " -o judged.obs receiver.obs 2>/dev/null");
  ASSERT_EQ(result.status, 0);
  const auto epochs_and_header = [](const std::filesystem::path& path, std::string& slots) {
    std::map<std::string, std::map<std::string, std::string>> epochs;  // by tag, by satellite: text
    TextFile file(path);
    std::string tag;
    std::set<std::string> phase_seen;
    while (const auto line = file.next_line()) {
      if (line->find("GLONASS SLOT / FRQ #") != std::string_view::npos) slots += *line;
      if (line->front() == '>') {
        tag = std::string(trim(*line));
      } else if (!tag.empty()) {
        const std::string satellite(line->substr(0, 3));
        std::string fields(line->substr(3));
        if (GetParam()) {
          // convbin writes no strength indicators, and calls each satellite's first phase a loss of lock.
          fields.resize(16 * 4, ' ');
          for (std::size_t i = 15; i < fields.size(); i += 16) fields[i] = ' ';
          if (trim(fields.substr(16, 14)).size() > 0 && phase_seen.insert(satellite).second) fields[30] = ' ';
        }
        epochs[tag][satellite] = std::string(trim(fields));
      }
    }
    return epochs;
  };
  std::string ours_slots, theirs_slots;
  const auto ours = epochs_and_header(folder / "receiver.obs", ours_slots);
  const auto theirs = epochs_and_header(folder / "judged.obs", theirs_slots);
  ASSERT_EQ(ours.size(), 4U);
  EXPECT_EQ(ours, theirs);
  EXPECT_EQ(ours_slots, theirs_slots);
}
INSTANTIATE_TEST_SUITE_P(WithoutAndWithSignals, RinexObservationJudged, testing::Bool(),
                         [](const auto& each) { return each.param ? "Signals" : "Pseudoranges"; });

}  // namespace
}  // namespace canyon::encoding
