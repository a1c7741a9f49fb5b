// Observation files of every signal: the rules of RINEX 3.04 and 4.00, checked by Canyon's reader and RTKLIB.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/program.hpp"

namespace canyon {
namespace {

using receiver::SatelliteObservation;
using receiver::SignalObservation;
using test::read_bytes;

/// Twenty seconds in a street with all signals of Canyon: satellites rise and set, phases slip. Made once.
struct Run {
  test::TemporaryFolder folder;
  std::vector<simulation::Epoch> epochs = test::run_and_write(
      test::prepare(
          "city: {synthetic: {blocks_east: 4, blocks_north: 4, seed: 5}}\n"
          "sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\nstart: "
          "2026-03-01T10:00:00Z\n"
          "trajectory: {waypoints: [{east_m: -76, north_m: 0}, {east_m: 76, north_m: 0}], speed_mps: "
          "8, height_above_terrain_m: 1.5}\nrate_hz: 2\n"
          "receivers: [{name: rover, profile: survey, ionosphere: true, clock: {bias_s: 2e-4, drift: "
          "1e-7}, tracks: [L1CA, L1C, L2C, L5, E1, E5a, E5b, B1I, B1C, B2I, B2a, B3I, B2b, G1, G2]}]\n"
          "outputs: {pictures: false, rinex4_observation: true}\n",
          folder.path()),
      folder.path());
};
const Run& run() {
  static const Run made;
  return made;
}

/// A file parsed by the columns of tables A2 and A3.
struct ObservationFile {
  struct Field {
    std::string value;  ///< F14.3
    char lost_lock = ' ', strength = ' ';
  };
  struct Epoch {
    std::string line;
    std::map<std::string, std::map<std::string, Field>> satellites;  ///< by name, by type
  };
  std::vector<std::pair<std::string, std::string>> header;  ///< label, columns 1 to 60
  std::map<char, std::vector<std::string>> types;
  std::vector<Epoch> epochs;

  [[nodiscard]] std::vector<std::string> records(const std::string& label) const {
    std::vector<std::string> found;
    for (const auto& [name, content] : header) {
      if (name == label) found.push_back(content);
    }
    return found;
  }
};

ObservationFile parse(const std::string& text) {
  ObservationFile file;
  std::istringstream lines(text);
  std::string line;
  char system = ' ';
  while (std::getline(lines, line)) {
    EXPECT_EQ(line.size(), 80U) << line;
    line.resize(80, ' ');
    const std::string label(trim(line.substr(60)));
    file.header.emplace_back(label, line.substr(0, 60));
    if (label == "END OF HEADER") break;
    if (label != "SYS / # / OBS TYPES") continue;
    if (line[0] != ' ') system = line[0];
    for (const std::string_view type : split_blanks(std::string_view(line).substr(6, 54))) {
      file.types[system].emplace_back(type);
    }
  }
  std::size_t expected = 0;
  while (std::getline(lines, line)) {
    if (line[0] == '>') {
      if (!file.epochs.empty()) {
        EXPECT_EQ(file.epochs.back().satellites.size(), expected);
      }
      expected = static_cast<std::size_t>(parse_integer(line.substr(32, 3)).value());
      file.epochs.push_back({std::string(trim(line)), {}});
      continue;
    }
    const std::vector<std::string>& types = file.types[line[0]];
    EXPECT_LE(line.size(), 3 + 16 * types.size()) << line;
    line.resize(3 + 16 * types.size(), ' ');
    auto& satellite = file.epochs.back().satellites[line.substr(0, 3)];
    for (std::size_t i = 0; i < types.size(); ++i) {
      const std::string field = line.substr(3 + 16 * i, 16);
      if (trim(field.substr(0, 14)).empty()) continue;
      satellite[types[i]] = {field.substr(0, 14), field[14], field[15]};
    }
  }
  return file;
}

const ObservationFile& file_of(const std::string& name) {
  static std::map<std::string, ObservationFile> files;
  const auto found = files.find(name);
  if (found != files.end()) return found->second;
  return files.emplace(name, parse(read_bytes(run().folder / name))).first->second;
}

class RinexFiles : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] bool version4() const { return std::string(GetParam()) == "receiver.rnx"; }
  [[nodiscard]] const ObservationFile& file() const { return file_of(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(OfBothVersions, RinexFiles, testing::Values("receiver.obs", "receiver.rnx"),
                         [](const auto& each) {
                           return std::string(each.param) == "receiver.obs" ? "Rinex304" : "Rinex400";
                         });

// Table A2. 4.00 calls SYS / PHASE SHIFT and GLONASS COD/PHS/BIS strongly deprecated: decoders and encoders
// shall ignore them.
TEST_P(RinexFiles, HaveTheirVersionsHeader) {
  const std::string version = version4() ? "4.00" : "3.04";
  ASSERT_FALSE(file().header.empty());
  EXPECT_EQ(file().header.front().first, "RINEX VERSION / TYPE");
  // F9.2,11X,A1,19X,A1
  const std::string& first = file().header.front().second;
  EXPECT_EQ(first.substr(0, 21), "     " + version + "           O");
  EXPECT_EQ(first[40], 'M');
  EXPECT_EQ(file().header.back().first, "END OF HEADER");

  std::set<std::string> needed{"RINEX VERSION / TYPE", "PGM / RUN BY / DATE", "MARKER NAME",
                               "MARKER TYPE",          "OBSERVER / AGENCY",   "REC # / TYPE / VERS",
                               "ANT # / TYPE",         "APPROX POSITION XYZ", "ANTENNA: DELTA H/E/N",
                               "SYS / # / OBS TYPES",  "TIME OF FIRST OBS",   "GLONASS SLOT / FRQ #",
                               "END OF HEADER"};
  if (!version4()) needed.insert({"SYS / PHASE SHIFT", "GLONASS COD/PHS/BIS"});
  const std::set<std::string> repeated{"COMMENT", "SYS / # / OBS TYPES", "SYS / PHASE SHIFT",
                                       "GLONASS SLOT / FRQ #"};
  std::set<std::string> allowed{"COMMENT", "SIGNAL STRENGTH UNIT", "INTERVAL", "TIME OF LAST OBS",
                                "LEAP SECONDS"};
  allowed.insert(needed.begin(), needed.end());
  std::map<std::string, int> counts;
  for (const auto& [label, content] : file().header) {
    EXPECT_EQ(allowed.count(label), 1U) << label;
    ++counts[label];
  }
  for (const std::string& label : needed) EXPECT_EQ(counts.count(label), 1U) << label;
  for (const auto& [label, count] : counts) {
    EXPECT_TRUE(count == 1 || repeated.count(label) > 0) << label << " stands " << count << " times";
  }
  EXPECT_EQ(file().records("SIGNAL STRENGTH UNIT").front().substr(0, 5), "DBHZ ");
}

// A1,2X,I3,13(1X,A3); codes of tables 4 to 9 in the tracked bands and channels.
TEST_P(RinexFiles, NameTypesOfTheTables) {
  const std::map<char, std::string> attributes{
      {'G', "1C 1S 1L 1X 1P 1W 2C 2D 2S 2L 2X 2P 2W 5I 5Q 5X"},
      {'R', "1C 1P 2C 2P 3I 3Q 3X 4A 4B 4X 6A 6B 6X"},
      {'E', "1A 1B 1C 1X 1Z 5I 5Q 5X 7I 7Q 7X 8I 8Q 8X 6A 6B 6C 6X 6Z"},
      {'C', "2I 2Q 2X 1D 1P 1X 5D 5P 5X 7I 7Q 7X 7D 7P 7Z 8D 8P 8X 6I 6Q 6X"}};
  std::map<char, std::size_t> reported;
  for (const std::string& record : file().records("SYS / # / OBS TYPES")) {
    if (record[0] != ' ') reported[record[0]] = static_cast<std::size_t>(*parse_integer(record.substr(3, 3)));
    for (std::size_t i = 6; i < 58; i += 4) EXPECT_EQ(record[i], ' ') << record;
    EXPECT_EQ(record.substr(58), "  ");
  }
  std::size_t types = 0;
  for (const auto& [system, list] : file().types) {
    EXPECT_EQ(list.size(), reported[system]) << system;
    EXPECT_EQ(std::set<std::string>(list.begin(), list.end()).size(), list.size()) << system;
    for (const std::string& type : list) {
      EXPECT_NE(std::string("CLDS").find(type[0]), std::string::npos) << type;
      EXPECT_THAT(attributes.at(system), testing::HasSubstr(type.substr(1))) << system << type;
    }
    types += list.size();
  }
  EXPECT_EQ(types, 4U * 15);
}

// 9.1 of 3.04: phases of a band are aligned, with a record of each code; A1,1X,A3,1X,F8.5 and
// 4(1X,A3,1X,F8.3).
TEST_P(RinexFiles, StateTheShiftOfEveryPhase) {
  if (version4()) return;  // has no such records: HaveTheirVersionsHeader
  std::set<std::string> phases, shifts;
  for (const auto& [system, list] : file().types) {
    for (const std::string& type : list) {
      if (type[0] == 'L') phases.insert(std::string(1, system) + " " + type + "  0.00000");
    }
  }
  for (const std::string& record : file().records("SYS / PHASE SHIFT")) {
    EXPECT_TRUE(shifts.emplace(trim(record)).second) << record;
  }
  EXPECT_EQ(shifts, phases);
  EXPECT_EQ(file().records("GLONASS COD/PHS/BIS").front().substr(0, 27), " C1C    0.000 C2C    0.000 ");
}

// 2X,I2.2 ... of A3: epochs in order, each value F14.3 with its digits. GFZRNX's check (user's guide, "RINEX
// File Check and Repair") does not change a header without unused types and with INTERVAL and times of the
// first and last epoch equal to the data.
TEST_P(RinexFiles, HoldWhatTheHeaderSays) {
  ASSERT_EQ(file().epochs.size(), run().epochs.size());
  std::set<std::string> found, declared;
  double before = 0;
  for (const ObservationFile::Epoch& epoch : file().epochs) {
    // A1,1X,I4,4(1X,I2.2),F11.7,2X,I1,I3
    ASSERT_EQ(epoch.line.substr(0, 18), "> 2026 03 01 10 00");
    EXPECT_EQ(epoch.line.substr(29, 3), "  0");
    const double seconds = parse_double(epoch.line.substr(18, 11)).value();
    if (before > 0) {
      EXPECT_NEAR(seconds - before, 0.5, 1e-6);
    }
    before = seconds;
    for (const auto& [satellite, fields] : epoch.satellites) {
      for (const auto& [type, field] : fields) {
        found.insert(satellite.substr(0, 1) + type);
        EXPECT_TRUE(parse_double(field.value)) << field.value;
        EXPECT_EQ(field.value[10], '.');
        const bool indicated = type[0] == 'C' || type[0] == 'L';
        EXPECT_TRUE(indicated ? field.strength >= '1' && field.strength <= '9' : field.strength == ' ')
            << type;
        EXPECT_TRUE(field.lost_lock == ' ' || (field.lost_lock == '1' && type[0] == 'L')) << type;
      }
    }
  }
  for (const auto& [system, list] : file().types) {
    for (const std::string& type : list) declared.insert(system + type);
  }
  // No nominal satellite is a BeiDou-2.
  for (const char* type : {"CC7I", "CL7I", "CD7I", "CS7I"}) EXPECT_EQ(declared.erase(type), 1U) << type;
  EXPECT_EQ(found, declared);
  EXPECT_EQ(file().records("INTERVAL").front().substr(0, 10), "     0.500");
  const std::string last = file().epochs.back().line.substr(18, 11);
  EXPECT_EQ(file().records("TIME OF FIRST OBS").front().substr(30, 13),
            "  " + file().epochs.front().line.substr(18, 11));
  EXPECT_EQ(file().records("TIME OF LAST OBS").front().substr(30, 13), "  " + last);
}

// A signal at a time, by the reader of recordings.
TEST_P(RinexFiles, ComeBackThroughOurReader) {
  int pseudoranges = 0, phases = 0, dopplers = 0, strengths = 0;
  for (const gnss::System system :
       {gnss::System::GPS, gnss::System::GLONASS, gnss::System::Galileo, gnss::System::BeiDou}) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      if (!signal.only_recorded.empty()) continue;
      rinex::ObservationOptions options;
      options.systems = {system};
      options.codes[system] = {std::string(signal.code)};
      rinex::RinexObservationReader reader(run().folder / GetParam(), options);
      EXPECT_EQ(reader.header().version, version4() ? 4.0 : 3.04);
      for (const simulation::Epoch& epoch : run().epochs) {
        const auto read = reader.next();
        ASSERT_TRUE(read);
        std::map<gnss::SatelliteId, rinex::ObservedSignal> by_satellite;
        for (const rinex::ObservedSignal& s : read->signals) by_satellite[s.id] = s;
        EXPECT_LE(std::abs(read->receiver_time - epoch.observed.receiver_time), 50.1e-9);
        std::size_t expected = 0;
        for (const SatelliteObservation& satellite : epoch.observed.satellites) {
          if (satellite.id.system != system) continue;
          const SignalObservation* seen = satellite.signal == &signal ? &satellite : nullptr;
          for (const SignalObservation& other : satellite.more) {
            if (other.signal == &signal) seen = &other;
          }
          if (seen == nullptr || !seen->measurement) continue;
          ++expected;
          ASSERT_EQ(by_satellite.count(satellite.id), 1U) << gnss::to_string(satellite.id) << signal.name;
          const positioning::Measurement& m = *seen->measurement;
          const rinex::ObservedSignal& s = by_satellite[satellite.id];
          EXPECT_NEAR(s.pseudorange_m.value(), m.pseudorange_m, 0.6e-3);
          EXPECT_NEAR(s.doppler_hz.value(), m.doppler_hz.value(), 0.6e-3);
          EXPECT_NEAR(s.cn0_dbhz.value(), m.cn0_dbhz.value(), 0.6e-3);
          ASSERT_EQ(s.carrier_phase_cycles.has_value(), m.carrier_phase_cycles.has_value());
          ++pseudoranges, ++dopplers, ++strengths;
          if (!s.carrier_phase_cycles) continue;
          // Whole cycles apart (the arc's beginning).
          const double apart = *s.carrier_phase_cycles - *m.carrier_phase_cycles;
          EXPECT_NEAR(apart, std::round(apart), 0.6e-3) << gnss::to_string(satellite.id) << signal.name;
          ++phases;
        }
        EXPECT_EQ(by_satellite.size(), expected) << signal.name;
      }
      EXPECT_EQ(reader.report().notes.losses(), 0U);
    }
  }
  std::cout << GetParam() << ": " << pseudoranges << " pseudoranges and " << phases << " phases come back\n";
  EXPECT_GT(pseudoranges, 1000);
  EXPECT_GT(phases, 1000);
}

// RTKLIB's convbin reads both versions and writes the result.
TEST_P(RinexFiles, ComeBackThroughConvbin) {
  CANYON_NEEDS_PROGRAM("convbin");
  const test::TemporaryFolder folder;
  const auto result = test::run_program("cd '" + folder.path().string() +
                                        "' && convbin -r rinex -v 3.04 -od -os -o judged.obs '" +
                                        (run().folder / GetParam()).string() + "' 2>/dev/null");
  ASSERT_EQ(result.status, 0);
  const ObservationFile converted = parse(read_bytes(folder / "judged.obs"));
  ASSERT_EQ(converted.epochs.size(), file().epochs.size());
  std::size_t values = 0, slips = 0;
  std::set<std::string> seen;  // phases: convbin calls the first one a loss of lock
  for (std::size_t i = 0; i < converted.epochs.size(); ++i) {
    const ObservationFile::Epoch &ours = file().epochs[i], &theirs = converted.epochs[i];
    EXPECT_EQ(ours.line, theirs.line);
    ASSERT_EQ(ours.satellites.size(), theirs.satellites.size());
    for (const auto& [satellite, fields] : ours.satellites) {
      const auto& other = theirs.satellites.at(satellite);
      ASSERT_EQ(fields.size(), other.size()) << satellite << " at " << ours.line;
      for (const auto& [type, field] : fields) {
        ASSERT_EQ(other.count(type), 1U) << satellite << ' ' << type;
        EXPECT_EQ(field.value, other.at(type).value) << satellite << ' ' << type << " at " << ours.line;
        ++values;
        if (type[0] != 'L' || seen.insert(satellite + type).second) continue;
        EXPECT_EQ(field.lost_lock, other.at(type).lost_lock)
            << satellite << ' ' << type << " at " << ours.line;
        slips += field.lost_lock == '1';
      }
    }
  }
  std::cout << GetParam() << ": convbin gives back " << values << " values with " << slips << " slips\n";
  EXPECT_GT(values, 5000U);
  EXPECT_EQ(converted.records("GLONASS SLOT / FRQ #"), file().records("GLONASS SLOT / FRQ #"));
}

TEST(RinexFilesOfBothVersions, DifferInTheHeaderAlone) {
  const auto body = [](const char* name) {
    const std::string text = read_bytes(run().folder / name);
    return text.substr(text.find("END OF HEADER"));
  };
  EXPECT_EQ(body("receiver.obs"), body("receiver.rnx"));
}

TEST(RinexFilesOfBothVersions, AreSolvedAlikeByRtklib) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  const auto solve = [](const char* name) {
    const auto result =
        test::run_program("cd '" + run().folder.path().string() + "' && timeout 120 rnx2rtkp -p 0 " + name +
                          " sky.nav 2>/dev/null | grep -v '^%'");
    EXPECT_EQ(result.status, 0) << name;
    return result.output;
  };
  const std::string solutions = solve("receiver.obs");
  EXPECT_GE(std::count(solutions.begin(), solutions.end(), '\n'), 10);
  EXPECT_EQ(solve("receiver.rnx"), solutions);
}

}  // namespace
}  // namespace canyon
