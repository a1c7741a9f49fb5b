#include "canyon/output/rinex_observation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::output {
namespace {

RinexObservationHeader sample_header() {
  RinexObservationHeader header;
  header.marker = "rover \xC3\xA4";
  header.systems = {orbit::kAllSystems.begin(), orbit::kAllSystems.end()};
  for (std::uint8_t slot = 1; slot <= 24; ++slot) {
    header.glonass_channels[{orbit::System::GLONASS, slot}] = slot % 14 - 7;
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
        test::sample_epoch(test::sample_time() + 0.5 * i, test::sample_place(), {1, 2, 3}, i != 3));
    // The clock gains 33 ns an epoch, so that tags round up and down.
    epochs.back().observed.receiver_time = epochs.back().observed.receiver_time + 33e-9 * i;
    for (auto& satellite : epochs.back().observed.satellites) {
      if (i == 2) satellite.measurement.reset();
      if (i == 4 && satellite.measurement) satellite.measurement->doppler_hz.reset();
    }
  }
  return epochs;
}

void write(const std::filesystem::path& path, const std::vector<simulation::Epoch>& epochs) {
  const auto sink = make_rinex_observation(path, 0, sample_header());
  for (const auto& epoch : epochs) sink->write(epoch);
  sink->finish();
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
  const Eigen::Vector3d truth = geodesy::ecef_from_geodetic(test::sample_place());
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
  EXPECT_EQ(types, (std::vector<std::string>{"G    2 C1C D1C", "R    2 C1C D1C", "E    2 C1C D1C",
                                             "C    2 C2I D2I", "J    2 C1C D1C"}));
  EXPECT_EQ(file.header.count("SYS / PHASE SHIFT"), 5U);
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
    const orbit::SatelliteId id{orbit::System::GLONASS, static_cast<std::uint8_t>(slot)};
    EXPECT_EQ(channels[orbit::to_string(id)], slot % 14 - 7);
  }
}

TEST(RinexObservation, PseudorangeFollowsTheRoundedTag) {
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
      const auto found = read.observations.find(orbit::to_string(satellite.id));
      ASSERT_EQ(found != read.observations.end(), satellite.measurement.has_value());
      if (!satellite.measurement) continue;
      // Transmission time, tag minus pseudorange over c, is what positions rest on: kept within 1 mm.
      const double moved_m = geodesy::kSpeedOfLight * (read.tag - written.receiver_time);
      EXPECT_NEAR(found->second.first - moved_m, satellite.measurement->pseudorange_m, 0.6e-3);
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
                                  test::sample_place(), {0, 0, 0});
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

// RTKLIB reads the file with its own readrnx and writes what it understood.
TEST(RinexObservation, RtklibReadsTheSame) {
  CANYON_NEEDS_PROGRAM("convbin");
  const test::TemporaryFolder folder;
  write(folder / "receiver.obs", sample_run());
  const auto result =
      test::run_program("cd '" + folder.path().string() +
                        "' && convbin -r rinex -v 3.04 -od -o judged.obs receiver.obs 2>/dev/null");
  ASSERT_EQ(result.status, 0);
  const auto epochs_and_header = [](const std::filesystem::path& path, std::string& slots) {
    std::map<std::string, std::map<std::string, std::string>> epochs;  // by tag, by satellite: text
    TextFile file(path);
    std::string tag;
    while (const auto line = file.next_line()) {
      if (line->find("GLONASS SLOT / FRQ #") != std::string_view::npos) slots += *line;
      if (line->front() == '>') {
        tag = std::string(trim(*line));
      } else if (!tag.empty()) {
        epochs[tag][std::string(line->substr(0, 3))] = std::string(trim(line->substr(3)));
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

}  // namespace
}  // namespace canyon::output
