// RTKLIB's rnx2rtkp as independent check of the emitted RINEX files and of the fix: the real program reads
// receiver.obs and sky.nav and solves them in single-point mode, atmosphere off.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/program.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon {
namespace {

// The error constants are so large that RTKLIB's elevation and ephemeris terms are negligible: equal weights,
// as in Canyon's solver. Its navsys bits: GPS 1, SBAS 2, GLONASS 4, Galileo 8, QZSS 16, BeiDou 32.
std::string config(double mask_deg, int systems) {
  return "pos1-posmode=single\npos1-frequency=l1\npos1-elmask=" + std::to_string(mask_deg) +
         "\npos1-ionoopt=off\npos1-tropopt=off\npos1-sateph=brdc\npos1-navsys=" + std::to_string(systems) +
         "\npos1-posopt5=off\npos2-rejgdop=10000\nstats-eratio1=10000\nstats-errphase=10\nstats-errphaseel="
         "0\n"
         "out-solformat=xyz\nout-outhead=off\nout-timesys=gpst\nout-timeform=tow\nout-timendec=3\nout-"
         "solstatic=all\n";
}

struct Solution {
  Eigen::Vector3d ecef;
  int satellites = 0;
};

// RTKLIB's own error model, with its broadcast ionosphere and Saastamoinen's troposphere.
std::string config_with_atmosphere(double mask_deg, int systems) {
  return "pos1-posmode=single\npos1-frequency=l1\npos1-elmask=" + std::to_string(mask_deg) +
         "\npos1-ionoopt=brdc\npos1-tropopt=saas\npos1-sateph=brdc\npos1-navsys=" + std::to_string(systems) +
         "\nout-solformat=xyz\nout-outhead=off\nout-timesys=gpst\nout-timeform=tow\nout-timendec=3\nout-"
         "solstatic=all\n";
}

/// Runs rnx2rtkp over the files in `folder`; solutions by nanosecond of week, rounded to the millisecond.
std::map<std::int64_t, Solution> solve_with_rtklib(const std::filesystem::path& folder,
                                                   const std::string& settings) {
  std::ofstream(folder / "rtk.conf") << settings;
  const std::string command = "timeout 120 rnx2rtkp -k '" + (folder / "rtk.conf").string() + "' -o '" +
                              (folder / "rtk.pos").string() + "' '" + (folder / "receiver.obs").string() +
                              "' '" + (folder / "sky.nav").string() + "' >'" + (folder / "rtk.log").string() +
                              "' 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  std::map<std::int64_t, Solution> solutions;
  std::istringstream lines(test::read_bytes(folder / "rtk.pos"));
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string_view> cells = split_blanks(line);
    if (line.rfind('%', 0) == 0 || cells.size() < 7) continue;
    Solution solution;
    for (int i = 0; i < 3; ++i) solution.ecef[i] = *parse_double(cells[static_cast<std::size_t>(2 + i)]);
    solution.satellites = static_cast<int>(*parse_integer(cells[6]));
    solutions[std::llround(*parse_double(cells[1]) * 1e3)] = solution;
  }
  return solutions;
}

std::int64_t key(geodesy::GpsTime t) {
  return std::llround(t.seconds_of_week() * 1e3);
}

// Bit sum for the systems supported by Debian's build of RTKLIB.
constexpr int kGps = 1;
constexpr int kSbas = 2;
constexpr int kGlonass = 4;
constexpr int kGalileo = 8;
constexpr int kBeiDou = 32;

void expect_open_sky(const std::string& sky, int systems, const std::filesystem::path& data = {}) {
  const test::TemporaryFolder folder;
  const std::string yaml =
      "city: {open: true, origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 10}}\n" + sky +
      "trajectory:\n"
      "  waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 3000, north_m: 2000, up_m: 100}]\n"
      "  speed_mps: 12\n"
      "receivers: [{name: rover, profile: ideal, elevation_mask_deg: 10, clock: {bias_s: 2.0e-4, drift: "
      "1.0e-7}}]\n"
      "rate_hz: 1\nduration_s: 120\n"
      "outputs: {pictures: false}\n";
  const simulation::Simulation simulation = test::prepare(yaml, data.empty() ? folder.path() : data);
  const auto epochs = test::run_and_write(simulation, folder.path());
  ASSERT_EQ(epochs.size(), 121U);
  const auto solutions = solve_with_rtklib(folder.path(), config(10, systems));
  double worst_reported = 0;
  double worst_rtklib = 0;
  for (const simulation::Epoch& epoch : epochs) {
    ASSERT_TRUE(epoch.observed.fix.solved());
    worst_reported = std::max(worst_reported, epoch.error_enu_m.norm());
    const auto found = solutions.find(key(epoch.observed.receiver_time));
    ASSERT_NE(found, solutions.end()) << test::read_bytes(folder.path() / "rtk.log");
    EXPECT_EQ(found->second.satellites, static_cast<int>(epoch.observed.fix.used.size()));
    worst_rtklib = std::max(worst_rtklib, (found->second.ecef - epoch.truth_ecef).norm());
  }
  std::cout << "open sky, 121 epochs: fix within " << worst_reported * 1e3
            << " mm of the truth, rnx2rtkp within " << worst_rtklib * 1e3 << " mm\n";
  EXPECT_LT(worst_reported, 1e-3);
  EXPECT_LT(worst_rtklib, 0.1);
}

TEST(Rnx2Rtkp, OpenSkyNominalGpsIsWithinTenCentimetres) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  expect_open_sky("sky: {nominal: true, systems: [GPS]}\nstart: 2026-03-01T10:00:00Z\n", kGps);
}

TEST(Rnx2Rtkp, OpenSkyNominalFourSystemsIsWithinTenCentimetres) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  expect_open_sky(
      "sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\nstart: 2026-03-01T10:00:00Z\n",
      kGps + kGlonass + kGalileo + kBeiDou);
}

TEST(Rnx2Rtkp, OpenSkyRecordedEphemeridesIsWithinTenCentimetres) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  CANYON_SHARED_DATA(nav, "urbannav-tst-20190428/hksc1180.19n");
  expect_open_sky(
      "sky: {navigation: [hksc1180.19n, hksc1180.19b], systems: [GPS, BeiDou]}\nstart: "
      "2019-04-28T12:58:03Z\n",
      kGps + kBeiDou, nav.parent_path());
}

// With real ephemerides the signals have real errors, and RTKLIB with its default corrections is as close to
// the truth as Canyon's fix, which uses the same models; without corrections it is not.
TEST(Rnx2Rtkp, SolvesWithItsDefaultAtmosphere) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  CANYON_SHARED_DATA(nav, "urbannav-tst-20190428/hksc1180.19n");
  const test::TemporaryFolder folder;
  const simulation::Simulation simulation = test::prepare(
      "city: {open: true, origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 10}}\n"
      "sky: {navigation: [hksc1180.19n, hksc1180.19b], systems: [GPS, BeiDou]}\n"
      "start: 2019-04-28T04:00:00Z\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"
      "receivers: [{name: rover, profile: survey, signal: {shadowing: {enabled: false}}}]\n"
      "rate_hz: 0.02\nduration_s: 7200\noutputs: {pictures: false}\n",
      nav.parent_path());
  const auto epochs = test::run_and_write(simulation, folder.path());
  EXPECT_THAT(test::read_bytes(folder.path() / "receiver.obs"),
              testing::HasSubstr("Inside: ionosphere, troposphere, orbit and clock errors"));
  const auto mean_error_m = [&](const std::string& settings) {
    double sum = 0;
    int n = 0;
    const auto solutions = solve_with_rtklib(folder.path(), settings);
    for (const simulation::Epoch& epoch : epochs) {
      const auto found = solutions.find(key(epoch.observed.receiver_time));
      if (found == solutions.end()) continue;
      sum += (found->second.ecef - epoch.truth_ecef).norm();
      ++n;
    }
    EXPECT_GT(n, 100);
    return sum / n;
  };
  double independent_m = 0;
  for (const simulation::Epoch& epoch : epochs)
    independent_m += epoch.error_enu_m.norm() / static_cast<double>(epochs.size());
  const double rtklib_m = mean_error_m(config_with_atmosphere(10, kGps + kBeiDou));
  const double uncorrected_m = mean_error_m(config(10, kGps + kBeiDou));
  std::cout << "with atmosphere, orbits and clocks: fix off by " << independent_m << " m, rnx2rtkp by "
            << rtklib_m << " m, without corrections by " << uncorrected_m << " m\n";
  EXPECT_LT(rtklib_m, 1.5 * independent_m);
  EXPECT_GT(rtklib_m, 0.5 * independent_m);
  EXPECT_GT(uncorrected_m, 2 * rtklib_m);
}

// Ranges to three synthetic, moving geostationary satellites and recorded GPS: RTKLIB also uses the clock of
// GPS for SBAS. Records have the maximum interval of message 9.
TEST(Rnx2Rtkp, OpenSkyWithSbasIsWithinTenCentimetres) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  CANYON_SHARED_DATA(nav, "urbannav-tst-20190428/hksc1180.19n");
  gnss::NavigationData data;
  const double longitudes_deg[] = {83, 110, 140};
  for (int satellite = 0; satellite < 3; ++satellite) {
    for (int record = 0; record < 3; ++record) {
      gnss::SbasEphemeris e;
      e.id = {gnss::System::SBAS, static_cast<std::uint8_t>(27 + 5 * satellite)};
      e.toe = e.transmission = geodesy::parse_time("2019-04-28T12:57:52 GPST") + 120.0 * record;
      const double longitude = geodesy::radians(longitudes_deg[satellite]);
      e.position_m = {42164e3 * std::cos(longitude), 42164e3 * std::sin(longitude), 2e4 * satellite};
      e.velocity_mps = {1.25, -2.5 * satellite, 36};
      e.acceleration_mps2 = {1e-4, 5e-5, -2e-3};
      e.clock_bias_s = 4e-7 * (satellite - 1);
      e.clock_drift = 1e-11;
      e.accuracy_m = 4;
      data.sbas.push_back(e);
    }
  }
  const test::TemporaryFolder folder;
  rinex::write_rinex_navigation(folder / "geo.nav", data);
  const std::string files = "sky: {navigation: [" + nav.string() + ", " + (folder / "geo.nav").string() + "]";
  const std::string start = "}\nstart: 2019-04-28T12:58:03Z\n";
  expect_open_sky(files + ", systems: [GPS, SBAS]" + start, kGps + kSbas);

  // Without SBAS in the settings there is none: neither ranged to nor in sky.nav.
  const auto satellites = [&](const std::string& systems) {
    const simulation::Simulation simulation = test::prepare(
        "city: {open: true, origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 10}}\n" + files +
            systems + start + "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\nduration_s: 0\n",
        folder.path());
    EXPECT_EQ(simulation.navigation().sbas.empty(), systems.empty());
    const auto ids = simulation.environment().sky().satellites();
    return std::count_if(ids.begin(), ids.end(),
                         [](gnss::SatelliteId id) { return id.system == gnss::System::SBAS; });
  };
  EXPECT_EQ(satellites(""), 0);
  EXPECT_EQ(satellites(", systems: [GPS, SBAS]"), 3);
}

/// Buildings and noise on: rnx2rtkp against Canyon's fix if both used the same satellites. The remaining
/// difference is due to RTKLIB's direction cosines, which neglect the Earth's rotation during the flight
/// (7e-6 rad): with residuals of a hundred metres and a weak geometry that moves its solution by centimetres.
void expect_same_fix(const simulation::Simulation& simulation, double mask_deg, int systems,
                     std::size_t least_compared) {
  const test::TemporaryFolder folder;
  const auto epochs = test::run_and_write(simulation, folder.path());
  const auto solutions = solve_with_rtklib(folder.path(), config(mask_deg, systems));
  std::size_t compared = 0;
  std::size_t other_satellites = 0;
  std::size_t absent = 0;
  double worst = 0;
  for (const simulation::Epoch& epoch : epochs) {
    if (!epoch.observed.fix.solved()) continue;
    const auto found = solutions.find(key(epoch.observed.receiver_time));
    if (found == solutions.end()) {
      ++absent;
    } else if (found->second.satellites != static_cast<int>(epoch.observed.fix.used.size())) {
      ++other_satellites;
    } else {
      ++compared;
      const double distance = (found->second.ecef - epoch.observed.fix.position_ecef).norm();
      worst = std::max(worst, distance);
      EXPECT_LT(distance, 0.1) << "tow " << epoch.observed.receiver_time.seconds_of_week();
    }
  }
  std::cout << "with buildings and noise: " << compared << " of " << epochs.size()
            << " epochs with the same satellites, worst distance " << worst * 1e3 << " mm; "
            << other_satellites << " with other satellites, " << absent << " without an RTKLIB solution\n";
  EXPECT_GE(compared, least_compared);
}

TEST(Rnx2Rtkp, AgreesWithOurFixInTheSyntheticCity) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  const std::string yaml =
      "city: {synthetic: {seed: 3}}\nsky: {nominal: true, systems: [GPS, Galileo]}\n"
      "start: 2026-03-01T10:00:00Z\n"
      "trajectory: {waypoints: [{east_m: -200, north_m: 0, up_m: 2}, {east_m: 200, north_m: 0, up_m: 2}], "
      "speed_mps: 4}\n"
      "receivers: [{name: rover, profile: ideal, elevation_mask_deg: 10, noise: {enabled: true}}]\n"
      "seed: 5\noutputs: {pictures: false}\n";
  const test::TemporaryFolder folder;
  expect_same_fix(test::prepare(yaml, folder.path()), 10, kGps + kGalileo, 60);
}

TEST(Rnx2Rtkp, AgreesWithOurFixInHongKong) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  CANYON_SHARED_DATA(mesh, "hongkong/buildings.dae");
  const std::string yaml =
      "city:\n  mesh: hongkong/buildings.dae\n"
      "  origin: {latitude_deg: 22.298251, longitude_deg: 114.178761, height_m: 0}\n"
      "  offset: {east_m: 0, north_m: 8, up_m: 0}\n"
      "sky:\n  navigation: [urbannav-tst-20190428/hksc1180.19n, urbannav-tst-20190428/hksc1180.19b]\n"
      "  systems: [GPS, BeiDou]\n"
      "trajectory:\n  file: urbannav-tst-20190428/groundTruth_TST.csv\n  format: urbannav\n"
      "  height_above_terrain_m: 2.0\n"
      "receivers: [{name: rover, profile: paper, elevation_mask_deg: 10}]\n"
      "propagation: {model: specular}\nseed: 1\noutputs: {pictures: false}\n";
  expect_same_fix(test::prepare(yaml, mesh.parent_path().parent_path()), 10, kGps + kBeiDou, 200);
}

}  // namespace
}  // namespace canyon
