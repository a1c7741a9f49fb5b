// receiver.ubx checked by readers of u-blox receivers: gpsd's decoder and RTKLIB's convbin and rnx2rtkp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/observation_epochs.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sample_signals.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon {
namespace {

namespace fs = std::filesystem;
using gnss::System;

/// Files of a receiver that tracks the signals named in both UBX and RTKLIB.
struct Files {
  explicit Files(const std::string& scenario) {
    const auto simulation = test::prepare(
        scenario +
            "receivers: [{name: rover, profile: survey, clock: {bias_s: 2e-4, drift: 1e-7}, tracks: [L1CA, "
            "L2C, E1, E5b, B1I, G1, G2]}]\n"
            "outputs: {pictures: false, kml: false, geojson: false, ubx: true}\n",
        folder.path());
    epochs = test::run_and_write(simulation, folder.path());
    encoding::ReceiverDescription m8 = encoding::describe_receiver(simulation, 0);
    m8.ubx_generation = simulation::UbxGeneration::M8;
    const auto file = encoding::open_file("ubx", folder / "receiver-m8.ubx", 0, m8);
    for (const simulation::Epoch& epoch : epochs) file->write(epoch);
    file->finish();
  }
  /// convbin's observations and navigation of a file, with the ionosphere.
  void convert(const std::string& name) const {
    const auto result = test::run_program("cd '" + folder.path().string() +
                                          "' && timeout 120 convbin -r ubx -v 3.04 -od "
                                          "-os -oi -ot -ol -f 5 -o judged.obs -n judged.nav " +
                                          name + " 2>/dev/null");
    EXPECT_EQ(result.status, 0);
  }
  test::TemporaryFolder folder;
  std::vector<simulation::Epoch> epochs;
};

/// A scenario under an open sky, 110 s: every ephemeris three times, and page 18 of LNAV.
std::string open_sky(const std::string& sky) {
  return "city: {open: true, origin: {latitude_deg: 55.5, longitude_deg: 8.4, height_m: 10}}\n" + sky +
         "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\nduration_s: 110\n";
}

const Files& nominal() {
  static const Files files(
      open_sky("sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\nstart: {week: 2408, tow: "
               "36505}\n"));
  return files;
}

/// A run in a street, where satellites appear and disappear and phases slip.
const Files& street() {
  static const Files files(
      "city: {synthetic: {blocks_east: 4, blocks_north: 4, seed: 5}}\n"
      "sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\nstart: 2026-03-01T10:00:00Z\n"
      "trajectory: {waypoints: [{east_m: -76, north_m: 0}, {east_m: 76, north_m: 0}], speed_mps: 4, "
      "height_above_terrain_m: 1.5}\nrate_hz: 5\n");
  return files;
}

// UBX has the clock's reading, which RINEX rounds to 100 ns. Both files have thousandths of metre and cycle;
// UBX has Dopplers as 32-bit floats and C/N0 in integer dB-Hz.
double phase_sigma(const receiver::ReceiverEpoch& epoch, gnss::SatelliteId id, const gnss::Signal* signal) {
  for (const receiver::SatelliteObservation& s : epoch.satellites) {
    if (s.id != id) continue;
    if (s.signal == signal && s.measurement) return s.measurement->carrier_phase_sigma_cycles;
    for (const receiver::SignalObservation& other : s.more) {
      if (other.signal == signal && other.measurement) return other.measurement->carrier_phase_sigma_cycles;
    }
  }
  return 0;
}

class UbxObservations : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(OfBothPositions, UbxObservations, testing::Bool(),
                         [](const auto& each) { return each.param ? "Street" : "OpenSky"; });

TEST_P(UbxObservations, AreThoseOfReceiverObs) {
  CANYON_NEEDS_PROGRAM("convbin");
  const Files& files = GetParam() ? street() : nominal();
  files.convert("receiver.ubx");
  const auto ours = test::observation_epochs(files.folder / "receiver.obs");
  const auto theirs = test::observation_epochs(files.folder / "judged.obs");
  ASSERT_EQ(ours.size(), theirs.size());
  std::vector<receiver::ReceiverEpoch> measured;
  for (const simulation::Epoch& epoch : files.epochs) {
    const auto& satellites = epoch.observed.satellites;
    const bool any = std::any_of(satellites.begin(), satellites.end(), [](const auto& s) {
      return s.measurement || std::any_of(s.more.begin(), s.more.end(),
                                          [](const auto& m) { return m.measurement.has_value(); });
    });
    if (any) measured.push_back(epoch.observed);
  }
  ASSERT_EQ(measured.size(), ours.size());
  std::size_t values = 0, phases = 0, dropped = 0, slips = 0;
  double worst_m = 0, worst_cycles = 0, worst_hz = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    EXPECT_LE(std::abs(ours[i].first - theirs[i].first), 100.1e-9);
    EXPECT_EQ(ours[i].second.size(), theirs[i].second.size()) << i;
    for (const auto& [key, mine] : ours[i].second) {
      const auto found = theirs[i].second.find(key);
      ASSERT_NE(found, theirs[i].second.end()) << gnss::to_string(key.first) << ' ' << key.second;
      const rinex::ObservedSignal& other = found->second;
      worst_m = std::max(worst_m, std::abs(mine.pseudorange_m.value() - other.pseudorange_m.value()));
      worst_hz = std::max(worst_hz, std::abs(mine.doppler_hz.value() - other.doppler_hz.value()));
      EXPECT_NEAR(mine.cn0_dbhz.value(), other.cn0_dbhz.value(), 0.501);
      ++values;
      if (mine.carrier_phase_cycles && !other.carrier_phase_cycles) {
        // RTKLIB drops phases with a deviation above five steps of 0.004 cycles.
        EXPECT_GT(phase_sigma(measured[i], key.first, mine.signal), 0.02);
        ++dropped;
        continue;
      }
      ASSERT_EQ(mine.carrier_phase_cycles.has_value(), other.carrier_phase_cycles.has_value());
      if (!mine.carrier_phase_cycles) continue;
      worst_cycles =
          std::max(worst_cycles, std::abs(*mine.carrier_phase_cycles - *other.carrier_phase_cycles));
      ++phases;
      if ((mine.loss_of_lock & 1) == 0) continue;
      EXPECT_EQ(other.loss_of_lock & 1, 1);
      ++slips;
    }
  }
  std::cout << values << " signals, " << phases << " phases, " << dropped << " dropped, " << slips
            << " slips; worst " << worst_m << " m, " << worst_cycles << " cycles, " << worst_hz << " Hz\n";
  EXPECT_GT(phases, 2000U);
  if (GetParam()) {
    EXPECT_GT(slips, 20U);
  }
  EXPECT_LT(worst_m, 1.01e-3);
  EXPECT_LT(worst_cycles, 1.01e-3);
  EXPECT_LT(worst_hz, 1.3e-3);
}

/// Distance of the records of convbin's file from Canyon's with the same toe, over the following hour [m].
struct Loss {
  int records = 0;
  double orbit_m = 0, clock_m = 0;
};
template <typename Record>
void compare(const std::vector<Record>& ours, const std::vector<Record>& theirs,
             std::map<System, Loss>& losses) {
  for (const Record& decoded : theirs) {
    const Record* mine = nullptr;
    for (const Record& record : ours) {
      if constexpr (std::is_same_v<Record, gnss::KeplerEphemeris>) {
        if (gnss::is_galileo_fnav(record)) continue;
      }
      if (record.id == decoded.id && record.toe == decoded.toe) mine = &record;
    }
    ASSERT_NE(mine, nullptr) << gnss::to_string(decoded.id);
    Loss& loss = losses[decoded.id.system];
    ++loss.records;
    // GLONASS records are valid for a quarter of an hour before and after.
    const double span_s = decoded.id.system == System::GLONASS ? 900 : 3600;
    for (const double age_s : {-0.5 * span_s, 0.0, 0.5 * span_s, span_s}) {
      const auto a = orbit::propagate(*mine, mine->toe + age_s),
                 b = orbit::propagate(decoded, mine->toe + age_s);
      loss.orbit_m = std::max(loss.orbit_m, (a.position_m - b.position_m).norm());
      loss.clock_m =
          std::max(loss.clock_m, geodesy::kSpeedOfLight * std::abs(a.clock_bias_s - a.group_delay_s -
                                                                   b.clock_bias_s + b.group_delay_s));
    }
    EXPECT_EQ(decoded.health, mine->health) << gnss::to_string(decoded.id);
    if constexpr (std::is_same_v<Record, gnss::KeplerEphemeris>) {
      EXPECT_EQ(decoded.toc, mine->toc);
      EXPECT_EQ(decoded.iode, mine->iode) << gnss::to_string(decoded.id);
    } else {
      EXPECT_EQ(decoded.channel, mine->channel);
    }
  }
}

std::map<System, Loss> losses(const fs::path& folder) {
  const gnss::NavigationData ours = rinex::read_rinex_navigation(folder / "sky.nav");
  const gnss::NavigationData theirs = rinex::read_rinex_navigation(folder / "judged.nav");
  std::map<System, Loss> found;
  compare(ours.kepler, theirs.kepler, found);
  compare(ours.glonass, theirs.glonass, found);
  for (const auto& [system, loss] : found) {
    std::cout << gnss::name(system) << ": " << loss.records << " records, orbit within " << loss.orbit_m
              << " m, clock within " << loss.clock_m << " m\n";
  }
  // Page 18, if there is one: alpha and beta fit into their fields.
  if (ours.klobuchar.count(System::GPS) > 0 && theirs.klobuchar.count(System::GPS) > 0) {
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(theirs.klobuchar.at(System::GPS).alpha[i], ours.klobuchar.at(System::GPS).alpha[i],
                  std::ldexp(1, -28));
      EXPECT_NEAR(theirs.klobuchar.at(System::GPS).beta[i], ours.klobuchar.at(System::GPS).beta[i],
                  std::ldexp(1, 15));
    }
  }
  EXPECT_GT(theirs.klobuchar.count(System::GPS), 0U);
  return found;
}

// A nominal sky's exact orbits are rounded to the steps of the fields: angles of 2^-31 semicircles are 2 cm
// at 26,600 km, angular rates another 2 cm in an hour; for GLONASS 2^-11 km are 0.24 m in each axis and 2^-20
// km/s 0.4 m in a quarter of an hour.
TEST(UbxFiles, GiveTheEphemeridesOfANominalSkyToTheirFields) {
  CANYON_NEEDS_PROGRAM("convbin");
  for (const char* name : {"receiver.ubx", "receiver-m8.ubx"}) {
    nominal().convert(name);
    auto found = losses(nominal().folder.path());
    for (const System system : {System::GPS, System::GLONASS, System::Galileo, System::BeiDou}) {
      EXPECT_GE(found[system].records, 6) << gnss::name(system);
      EXPECT_LT(found[system].orbit_m, system == System::GLONASS ? 0.9 : 0.15) << gnss::name(system);
      EXPECT_LT(found[system].clock_m, 1e-6) << gnss::name(system);
    }
  }
}

struct Solutions {
  std::map<std::int64_t, Eigen::Vector3d> ecef;  ///< by millisecond of the week
};
Solutions solve(const fs::path& folder, const std::string& observations, const std::string& navigation,
                int systems) {
  std::ofstream(folder / "rtk.conf")
      << "pos1-posmode=single\npos1-frequency=l1\npos1-elmask=10\npos1-ionoopt=off\npos1-tropopt=off\npos1-"
         "navsys="
      << systems
      << "\nout-solformat=xyz\nout-outhead=off\nout-timesys=gpst\nout-timeform=tow\nout-solstatic=all\n";
  const auto result = test::run_program("cd '" + folder.string() + "' && timeout 120 rnx2rtkp -k rtk.conf " +
                                        observations + ' ' + navigation + " 2>/dev/null");
  EXPECT_EQ(result.status, 0);
  Solutions solutions;
  std::istringstream lines(result.output);
  for (std::string line; std::getline(lines, line);) {
    const auto cells = split_blanks(line);
    if (line.rfind('%', 0) == 0 || cells.size() < 7) continue;
    auto& ecef = solutions.ecef[std::llround(*parse_double(cells[1]) * 1e3)];
    for (int i = 0; i < 3; ++i) ecef[i] = *parse_double(cells[static_cast<std::size_t>(2 + i)]);
  }
  return solutions;
}

double worst_m(const Solutions& a, const Solutions& b) {
  EXPECT_GE(a.ecef.size(), 100U);
  EXPECT_EQ(a.ecef.size(), b.ecef.size());
  double worst = 0;
  for (const auto& [time, ecef] : a.ecef) {
    if (b.ecef.count(time) > 0) worst = std::max(worst, (ecef - b.ecef.at(time)).norm());
  }
  return worst;
}

// Single point fixes from convbin's output of receiver.ubx compared with those of receiver.obs and sky.nav.
TEST(UbxFiles, AreSolvedByRtklibAsTheRinexFilesAre) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  nominal().convert("receiver.ubx");
  const fs::path folder = nominal().folder.path();
  constexpr int kAll = 1 + 4 + 8 + 32, kWithoutGlonass = 1 + 8 + 32;
  const double observations_m =
      worst_m(solve(folder, "receiver.obs", "sky.nav", kAll), solve(folder, "judged.obs", "sky.nav", kAll));
  const double kepler_m = worst_m(solve(folder, "receiver.obs", "sky.nav", kWithoutGlonass),
                                  solve(folder, "judged.obs", "judged.nav", kWithoutGlonass));
  const double all_m = worst_m(solve(folder, "receiver.obs", "sky.nav", kAll),
                               solve(folder, "judged.obs", "judged.nav", kAll));
  std::cout << "observations alone " << observations_m << " m, with ephemerides " << kepler_m
            << " m, GLONASS among them " << all_m << " m\n";
  EXPECT_LT(observations_m, 1e-3);
  EXPECT_LT(kepler_m, 0.10);
  EXPECT_LT(all_m, 0.5);
}

// Broadcast ephemerides are read back unchanged: fields to the last digit in RINEX.
TEST(UbxFiles, GiveRecordedEphemeridesBackAsTheyWere) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  CANYON_SHARED_DATA(data, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  const Files run(
      open_sky("sky: {navigation: ['" + data.string() + "']}\nstart: {week: 2111, tow: 382255}\n"));
  run.convert("receiver.ubx");
  for (const auto& [system, loss] : losses(run.folder.path())) {
    EXPECT_GE(loss.records, 3) << gnss::name(system);
    EXPECT_LT(loss.orbit_m, 1e-3) << gnss::name(system);
    EXPECT_LT(loss.clock_m, 1e-3) << gnss::name(system);
  }
  // UBX sends only E1-B's of Galileo's two messages, but RTKLIB would use both of sky.nav. It also always
  // uses the group delays of a satellite's first record. So only sent messages may remain.
  gnss::NavigationData sent = rinex::read_rinex_navigation(run.folder / "sky.nav");
  const gnss::NavigationData decoded = rinex::read_rinex_navigation(run.folder / "judged.nav");
  const auto not_sent = [&](const gnss::KeplerEphemeris& e) {
    return gnss::is_galileo_fnav(e) ||
           std::none_of(decoded.kepler.begin(), decoded.kepler.end(),
                        [&](const auto& other) { return other.id == e.id && other.toe == e.toe; });
  };
  sent.kepler.erase(std::remove_if(sent.kepler.begin(), sent.kepler.end(), not_sent), sent.kepler.end());
  rinex::write_rinex_navigation(run.folder / "sent.nav", sent);
  constexpr int kAll = 1 + 4 + 8 + 16 + 32;
  const double solved_m = worst_m(solve(run.folder.path(), "receiver.obs", "sent.nav", kAll),
                                  solve(run.folder.path(), "judged.obs", "judged.nav", kAll));
  std::cout << "solutions within " << solved_m << " m\n";
  EXPECT_LT(solved_m, 2e-3);
}

using simulation::UbxGeneration;
class UbxForGpsd : public testing::TestWithParam<UbxGeneration> {};
INSTANTIATE_TEST_SUITE_P(OfBothGenerations, UbxForGpsd,
                         testing::Values(UbxGeneration::F9, UbxGeneration::M8));

// Fix, DOP, satellites; and no position without a fix.
TEST_P(UbxForGpsd, IsRead) {
  CANYON_NEEDS_PROGRAM("gpsdecode");
  const test::TemporaryFolder folder;
  std::map<std::int64_t, simulation::Epoch> by_second;
  {
    const auto sink = encoding::open_file("ubx", folder / "receiver.ubx", 0,
                                          {.name = "rover", .ubx_generation = GetParam()});
    for (int i = 0; i < 20; ++i) {
      const geodesy::GpsTime time = test::sample_time() + static_cast<double>(i);
      simulation::Epoch epoch =
          test::sample_signal_epoch(time, test::sample_time(), {0.1 * i, 2.0 - i, 0.5 * i});
      if (i > 7 && i < 12) epoch = test::sample_epoch(time, test::sample_point(), {0, 0, 0}, false);
      epoch.geoid_undulation_m = 39.625;
      sink->write(epoch);
      by_second[i] = epoch;
    }
    sink->finish();
  }
  const auto result = test::run_program("gpsdecode < '" + (folder / "receiver.ubx").string() + "'");
  EXPECT_EQ(result.status, 0);
  int fixes = 0, no_fixes = 0, skies = 0;
  double worst_m = 0;
  for (const std::string_view line : split(result.output, '\n')) {
    if (line.empty()) continue;
    const auto report = nlohmann::json::parse(line);
    if (!report.contains("time")) continue;
    const double second = geodesy::parse_time(report.at("time").get<std::string>()) - test::sample_time();
    const auto found = by_second.find(std::llround(second));
    ASSERT_NE(found, by_second.end()) << report;
    const receiver::ReceiverEpoch& seen = found->second.observed;
    if (report.at("class") == "TPV") {
      if (!seen.fix.solved()) {
        ++no_fixes;
        EXPECT_EQ(report.at("mode"), 1) << report;
        EXPECT_FALSE(report.contains("lat")) << report;
        continue;
      }
      ++fixes;
      EXPECT_EQ(report.at("mode"), 3) << report;
      const auto decoded = geodesy::Geodetic::from_degrees(report.at("lat"), report.at("lon"),
                                                           report.at("altHAE").get<double>());
      worst_m = std::max(worst_m, (geodesy::ecef_from_geodetic(decoded) - seen.fix.position_ecef).norm());
      EXPECT_NEAR(report.at("altMSL").get<double>(), seen.fix.position.height_m - 39.625, 1e-3);
      EXPECT_NEAR(report.at("speed").get<double>(), std::hypot(3.1, 4.2), 1e-3);
      EXPECT_NEAR(report.at("track").get<double>(), 143.57, 0.01);
      EXPECT_NEAR(report.at("eph").get<double>(), 2.5, 1e-3);
      EXPECT_NEAR(report.at("epv").get<double>(), 3.0, 1e-3);
    } else if (report.at("class") == "SKY" && report.contains("satellites") && seen.fix.solved()) {
      ++skies;
      EXPECT_NEAR(report.at("hdop").get<double>(), 1.25, 0.005);
      EXPECT_NEAR(report.at("vdop").get<double>(), 1.69, 0.005);
      EXPECT_NEAR(report.at("pdop").get<double>(), 2.1, 0.005);
      EXPECT_EQ(report.at("uSat").get<std::size_t>(), seen.fix.used.size());
      EXPECT_EQ(report.at("nSat").get<std::size_t>(), seen.satellites.size());
      for (const auto& satellite : report.at("satellites")) {
        if (satellite.at("gnssid") == 0 && satellite.at("svid") == 5) {
          EXPECT_EQ(satellite.at("ss"), 46);
          EXPECT_EQ(satellite.at("el"), 60);
          EXPECT_EQ(satellite.at("az"), 46);
        }
      }
    }
  }
  std::cout << fixes << " fixes within " << worst_m << " m, " << no_fixes << " losses, " << skies
            << " skies\n";
  EXPECT_GE(fixes, 14);
  EXPECT_GE(no_fixes, 3);
  EXPECT_GE(skies, 12);
  // Steps of 1e-7 deg and 1 mm: 5.6 mm in latitude, the same in longitude at the equator, 0.5 mm.
  EXPECT_LT(worst_m, 8e-3);
}

}  // namespace
}  // namespace canyon
