// Group delays checked by RTKLIB: rnx2rtkp solves emitted observation files in single-point mode, with its
// own group delays from the emitted navigation file. A difference from Canyon's is in the residual of a
// satellite, or in the clock of its system if all of its satellites have it.
//
//   by a single frequency: L1CA of GPS and QZSS, E1 (I/NAV), B1I;
//   by two, whose combination it corrects by its rules: with L2C, E5b, B2I.
//
// It has no rule for L5, E5a, B3I, B1C, B2a and clocks of F/NAV in these modes, and treats GLONASS's clock as
// that of the ionosphere-free pair (the ICD: of L1): canyon/sky/orbit/group_delays_test.cpp tests those with
// manual values. rnx2rtkp_test.cpp shows that G1 and SBAS have none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/program.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon {
namespace {

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  [[nodiscard]] double value() const { return sum / count; }
};

/// TGD, or BGDs, or TGD1 and TGD2 [s]: -11 to 11 ns (3.3 m) and -11.7 to 11.7 ns, different for satellites
/// that are near each other.
std::array<double, 2> made_up_delays(gnss::SatelliteId id) {
  return {(7 * id.number % 23 - 11) * 1e-9, (5 * id.number % 19 - 9) * 1.3e-9};
}

/// The results of rnx2rtkp for `receiver.obs` and `sky.nav`, in means over the epochs [m].
struct Estimates {
  std::map<std::string, Mean> residual_m;  ///< by satellite
  std::array<Mean, 4> clock_m;             ///< of GPS; of GLONASS, Galileo and BeiDou minus that of GPS
};

Estimates estimate(const std::filesystem::path& folder, int systems, bool two_frequencies) {
  std::ofstream(folder / "rtk.conf")
      << "pos1-posmode=single\npos1-frequency=" << (two_frequencies ? "l1+l2" : "l1")
      << "\npos1-ionoopt=" << (two_frequencies ? "dual-freq" : "off") << "\npos1-navsys=" << systems
      << "\npos1-elmask=5\npos1-tropopt=off\npos1-sateph=brdc\npos1-posopt5=off\npos2-rejgdop=10000\n"
         "stats-eratio1=10000\nstats-eratio2=10000\nstats-errphase=10\nstats-errphaseel=0\n"
         "out-solformat=xyz\nout-outhead=off\nout-outstat=residual\n";
  const std::string command = "cd '" + folder.string() +
                              "' && timeout 120 rnx2rtkp -k rtk.conf -o rtk.pos receiver.obs sky.nav "
                              ">rtk.log 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  Estimates estimates;
  std::istringstream lines(test::read_bytes(folder / "rtk.pos.stat"));
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string_view> cells = split(line, ',');
    if (cells.size() < 9) continue;
    // $SAT, week, tow, satellite, frequency, azimuth, elevation, residual of code [m] ...
    if (cells[0] == "$SAT" && cells[4] == "1") {
      estimates.residual_m[std::string(cells[3])].add(*parse_double(cells[7]));
    }
    // $CLK, week, tow, status, receiver, clocks [ns].
    for (std::size_t i = 0; cells[0] == "$CLK" && i < 4; ++i) {
      estimates.clock_m[i].add(*parse_double(cells[5 + i]) * 1e-9 * geodesy::kSpeedOfLight);
    }
  }
  return estimates;
}

/// Open sky at a position with satellites of all systems at once. Each satellite has its own delays, equal in
/// all of its records, since RTKLIB uses those of the first one.
Estimates solve(gnss::NavigationData data, bool with_delays, const std::string& systems,
                const std::string& tracks, int navsys, bool two_frequencies) {
  for (gnss::KeplerEphemeris& e : data.kepler) {
    e.group_delay = {};
    if (with_delays) e.group_delay = made_up_delays(e.id);
  }
  const test::TemporaryFolder folder;
  rinex::write_rinex_navigation(folder / "day.nav", data);
  const simulation::Simulation simulation = test::prepare(
      "city: {open: true, origin: {latitude_deg: 50, longitude_deg: 45, height_m: 100}}\n"
      "sky: {navigation: day.nav, systems: [" +
          systems +
          "]}\nstart: 2020-06-25T03:10:00Z\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"
          "receivers: [{name: rover, profile: ideal, clock: {bias_s: 2.0e-4, "
          "drift: 0}, tracks: [" +
          tracks +
          "]}]\npropagation: {ground_reflection: false, diffuse: {enabled: false}}\n"
          "rate_hz: 1\nduration_s: 300\noutputs: {pictures: false}\n",
      folder.path());
  (void)test::run_and_write(simulation, folder.path());
  return estimate(folder.path(), navsys, two_frequencies);
}

struct Case {
  const char* name;
  char letter;  ///< the system under test, in addition to GPS
  const char* systems;
  const char* tracks;
  int navsys;
  std::size_t clock;  ///< of it in Estimates::clock_m
  bool two_frequencies;
  std::size_t least;  ///< satellites
};

std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.name;
}

class GroupDelaysByRtklib : public testing::TestWithParam<Case> {};

// The same sky without group delays shows RTKLIB's other differences (the Earth's rotation during the flight
// to first order, 1 cm): both must differ from Canyon by the same amount.
TEST_P(GroupDelaysByRtklib, AreTheSame) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  CANYON_SHARED_DATA(file, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  const Case& c = GetParam();
  gnss::NavigationData data = rinex::read_rinex_navigation(file);
  // RTKLIB uses the group delay of I/NAV's clock.
  data.kepler.erase(std::remove_if(data.kepler.begin(), data.kepler.end(),
                                   [](const gnss::KeplerEphemeris& e) { return is_galileo_fnav(e); }),
                    data.kepler.end());
  const Estimates with = solve(data, true, c.systems, c.tracks, c.navsys, c.two_frequencies);
  const Estimates without = solve(data, false, c.systems, c.tracks, c.navsys, c.two_frequencies);
  ASSERT_EQ(with.residual_m.size(), without.residual_m.size());
  double worst = 0, largest_m = 0;
  std::size_t compared = 0;
  for (const auto& [satellite, residual] : with.residual_m) {
    const double difference = residual.value() - without.residual_m.at(satellite).value();
    EXPECT_LT(std::abs(difference), 1e-3) << satellite;
    worst = std::max(worst, std::abs(difference));
    if (satellite[0] != c.letter) continue;
    ++compared;
    for (const double delay_s : made_up_delays(*gnss::parse_satellite(satellite))) {
      largest_m = std::max(largest_m, geodesy::kSpeedOfLight * std::abs(delay_s));
    }
  }
  double clock = with.clock_m[0].value() - without.clock_m[0].value();
  EXPECT_LT(std::abs(clock), 1e-3);
  if (c.clock > 0) {
    clock = with.clock_m[c.clock].value() - without.clock_m[c.clock].value();
    EXPECT_LT(std::abs(clock), 1e-3);
  }
  EXPECT_GE(compared, c.least);
  EXPECT_GT(largest_m, 1);
  std::cout << c.name << ": " << compared << " of " << with.residual_m.size()
            << " satellites, residuals within " << worst * 1e3 << " mm, clock within "
            << std::abs(clock) * 1e3 << " mm; group delays to " << largest_m << " m\n";
}

INSTANTIATE_TEST_SUITE_P(
    Signals, GroupDelaysByRtklib,
    testing::Values(Case{"GpsL1", 'G', "GPS", "L1CA", 1, 0, false, 6},
                    Case{"GpsL2C", 'G', "GPS", "L1CA, L2C", 1, 0, true, 5},
                    Case{"QzssL1", 'J', "GPS, QZSS", "L1CA", 17, 0, false, 1},
                    Case{"QzssL2C", 'J', "GPS, QZSS", "L1CA, L2C", 17, 0, true, 1},
                    Case{"GalileoE1", 'E', "GPS, Galileo", "L1CA, E1", 9, 2, false, 5},
                    Case{"GalileoE5b", 'E', "GPS, Galileo", "L1CA, L2C, E1, E5b", 9, 2, true, 5},
                    Case{"BeiDouB1I", 'C', "GPS, BeiDou", "L1CA, B1I", 33, 3, false, 5},
                    Case{"BeiDouB2I", 'C', "GPS, BeiDou", "L1CA, L2C, B1I, B2I", 33, 3, true, 3}),
    [](const auto& c) { return std::string(c.param.name); });

}  // namespace
}  // namespace canyon
