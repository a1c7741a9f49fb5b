// receiver.sbf checked by RTKLIB's convbin: observations compared with receiver.obs, ephemerides with
// sky.nav.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>
#include <set>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/observation_epochs.hpp"
#include "tests/support/program.hpp"

namespace canyon {
namespace {

double wavelength_m(const rinex::ObservedSignal& s, const gnss::NavigationData& sky) {
  const gnss::Signal& signal = s.signal != nullptr ? *s.signal : gnss::signals_of(s.id.system).front();
  int channel = 0;
  for (const gnss::GlonassEphemeris& record : sky.glonass) {
    if (record.id == s.id) channel = record.channel;
  }
  return geodesy::kSpeedOfLight / (signal.carrier_hz + channel * signal.channel_hz);
}

/// A run of a receiver whose clock is exact: its tags are whole milliseconds in both files.
struct MakersFiles {
  /// @param format of RTKLIB; @param file that it reads
  MakersFiles(const std::string& format, const std::string& file) {
    const auto simulation = test::prepare(
        "city: {synthetic: {blocks_east: 4, blocks_north: 4, seed: 5}}\n"
        "sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\nstart: {week: 2408, tow: 36505}\n"
        "trajectory: {waypoints: [{east_m: -76, north_m: 0}, {east_m: 76, north_m: 0}], speed_mps: 1.5, "
        "height_above_terrain_m: 1.5}\n"
        "receivers: [{name: rover, profile: survey, clock: {bias_s: 0, drift: 0}, tracks: [L1CA, L2C, L5, "
        "E1, "
        "E5a, E5b, B1I, B3I, G1, G2]}]\n"
        "outputs: {pictures: false, kml: false, geojson: false, sbf: true}\n",
        folder.path());
    epochs = test::run_and_write(simulation, folder.path());
    const auto result =
        test::run_program("cd '" + folder.path().string() + "' && timeout 120 convbin -r " + format +
                          " -v 3.04 -od -os -f 6 -o judged.obs -n judged.nav " + file + " 2>/dev/null");
    EXPECT_EQ(result.status, 0);
  }
  test::TemporaryFolder folder;
  std::vector<simulation::Epoch> epochs;
};

/// Properties of this RTKLIB version's reader of a format.
struct Reading {
  double cn0_steps;                          ///< steps of written C/N0 [dB]
  std::map<std::string, std::string> codes;  ///< its names of RINEX codes, if they are others
  /// Signals that it omits.
  bool (*left_out)(gnss::SatelliteId id, const std::string& code, bool phase);
  bool doppler_without_phase;
};

void expect_the_same_observations(const MakersFiles& files, const gnss::NavigationData& sky,
                                  const Reading& reading) {
  const auto ours = test::observation_epochs(files.folder / "receiver.obs");
  const auto theirs = test::observation_epochs(files.folder / "judged.obs");
  ASSERT_EQ(ours.size(), theirs.size());
  const auto find = [&](const test::Observations& all, test::Observations::key_type key) {
    if (const auto other = reading.codes.find(key.second); other != reading.codes.end())
      key.second = other->second;
    return all.find(key);
  };
  std::size_t values = 0, phases = 0;
  double worst_m = 0, worst_phase_m = 0, worst_hz = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    EXPECT_LE(std::abs(ours[i].first - theirs[i].first), 1e-6);
    // The formats have whole milliseconds. The clock's fraction of a millisecond and its drift are not in
    // them.
    std::vector<double> moved_m, moved_hz;
    for (const auto& [key, mine] : ours[i].second) {
      const auto found = find(theirs[i].second, key);
      if (found == theirs[i].second.end()) continue;
      moved_m.push_back(*found->second.pseudorange_m - *mine.pseudorange_m);
      if (!found->second.doppler_hz) continue;
      moved_hz.push_back((*found->second.doppler_hz - *mine.doppler_hz) * wavelength_m(mine, sky));
    }
    ASSERT_FALSE(moved_hz.empty());
    const double clock_m = quantile(moved_m, 0.5).value(), drift_mps = quantile(moved_hz, 0.5).value();
    for (const auto& [key, mine] : ours[i].second) {
      const auto found = find(theirs[i].second, key);
      if (reading.left_out(key.first, key.second, mine.carrier_phase_cycles.has_value())) continue;
      ASSERT_NE(found, theirs[i].second.end()) << gnss::to_string(key.first) << ' ' << key.second;
      const rinex::ObservedSignal& other = found->second;
      const double wavelength = wavelength_m(mine, sky);
      worst_m = std::max(worst_m, std::abs(*other.pseudorange_m - *mine.pseudorange_m - clock_m));
      if (mine.carrier_phase_cycles || reading.doppler_without_phase) {
        worst_hz =
            std::max(worst_hz, std::abs(*other.doppler_hz - *mine.doppler_hz - drift_mps / wavelength));
      }
      EXPECT_NEAR(mine.cn0_dbhz.value(), reading.cn0_steps * other.cn0_dbhz.value(),
                  reading.cn0_steps > 1 ? 0.26 : 0.1);
      ++values;
      if (!mine.carrier_phase_cycles) continue;
      ASSERT_TRUE(other.carrier_phase_cycles) << gnss::to_string(key.first) << ' ' << key.second;
      worst_phase_m = std::max(
          worst_phase_m,
          std::abs((*other.carrier_phase_cycles - *mine.carrier_phase_cycles) * wavelength - clock_m));
      ++phases;
    }
  }
  std::cout << values << " signals, " << phases << " phases; worst " << worst_m << " m, " << worst_phase_m
            << " m of phase, " << worst_hz << " Hz\n";
  EXPECT_GT(phases, 1000U);
  EXPECT_LT(worst_m, 1.6e-3);
  EXPECT_LT(worst_phase_m, 1.6e-3);
  EXPECT_LT(worst_hz, 3e-3);
}

TEST(MakersFiles, OfSeptentrioAreReadByRtklib) {
  CANYON_NEEDS_PROGRAM("convbin");
  const MakersFiles files("sbf", "receiver.sbf");
  const gnss::NavigationData sky = rinex::read_rinex_navigation(files.folder / "sky.nav");
  // It omits E5b if there is E5a, and supports BeiDou's first 37 satellites. It reads the value "no phase" of
  // a further signal as a phase, and writes C/N0 in steps of 250 dB.
  expect_the_same_observations(files, sky,
                               {250,
                                {},
                                [](gnss::SatelliteId id, const std::string& code, bool) {
                                  return code == "7Q" ||
                                         (id.system == gnss::System::BeiDou && id.number > 37);
                                },
                                true});

  const gnss::NavigationData decoded = rinex::read_rinex_navigation(files.folder / "judged.nav");
  std::set<gnss::System> systems;
  for (const auto& record : decoded.kepler) {
    systems.insert(record.id.system);
    const auto mine = std::find_if(sky.kepler.begin(), sky.kepler.end(), [&](const auto& each) {
      return each.id == record.id && each.toe == record.toe;
    });
    ASSERT_NE(mine, sky.kepler.end()) << gnss::to_string(record.id);
    // It reads the last 16 bits of a page two bits too early: those of the square root of the axis.
    EXPECT_NEAR(record.eccentricity, mine->eccentricity, 1e-9) << gnss::to_string(record.id);
    EXPECT_NEAR(record.mean_anomaly, mine->mean_anomaly, 2e-9) << gnss::to_string(record.id);
  }
  if (!decoded.glonass.empty()) systems.insert(gnss::System::GLONASS);
  std::cout << decoded.kepler.size() << " and " << decoded.glonass.size() << " ephemerides of "
            << systems.size() << " systems\n";
  // It decodes neither GPSRawCA's ephemerides nor BDSRaw.
  EXPECT_EQ(systems.size(), 2U);
}

}  // namespace
}  // namespace canyon
