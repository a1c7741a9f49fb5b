// RTCM 3 of simulated receivers, checked by RTKLIB: convbin converts it to RINEX, which must equal Canyon's,
// and rnx2rtkp fixes a rover's ambiguities with a base station's messages.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/rtcm.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/program.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/ubx_device.hpp"

namespace canyon {
namespace {

namespace fs = std::filesystem;

/// RINEX by convbin: NAME.obs and NAME.nav in `folder`.
/// @param when the stream's date, which is not in its messages
void convert(const fs::path& stream, geodesy::GpsTime when, const fs::path& folder, const std::string& name,
             const std::string& options = {}) {
  const geodesy::CalendarTime c = geodesy::calendar_from_gps(when);
  const std::string command = fmt::format(
      "timeout 60 convbin -r rtcm3 -v 3.04 -f 8 -tr {:04d}/{:02d}/{:02d} {:02d}:{:02d}:{:02d} -os -od {} -o "
      "'{}' -n "
      "'{}' '{}' >/dev/null 2>&1",
      c.year, c.month, c.day, c.hour, c.minute, c.second, options, (folder / (name + ".obs")).string(),
      (folder / (name + ".nav")).string(), stream.string());
  ASSERT_EQ(test::run_program(command).status, 0) << command;
}

constexpr const char* kOpenField =
    "city: {open: true, origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 10}}\n";
constexpr const char* kOutputs =
    "outputs: {rtcm: true, epochs_csv: false, satellites_csv: false, nmea: false, kml: false, geojson: "
    "false, "
    "pictures: false}\n";

// Resolutions of MSM7 and of RINEX, half a step of each: code 2^-29 ms and 1 mm, phase 2^-31 ms and 0.001
// cycles, range rate 0.1 mm/s and 0.001 Hz, C/N0 1/16 and 0.001 dB.
struct Compared {
  std::map<std::string, int> signals;  ///< observations by system and code
  int slips = 0, slips_flagged = 0;    ///< Canyon's cycle slips; those also flagged by RTKLIB
  int false_slips = 0;                 ///< flagged without a slip in Canyon's
  int no_doppler = 0;                  ///< observations without a Doppler in the result
};
Compared compare_observations(const std::string& yaml) {
  constexpr double kDrift = 5e-7;  // of the clock below
  const test::TemporaryFolder folder;
  // Clocks with readings off whole milliseconds, so that all values are shifted with the tags.
  const auto simulation = test::prepare(yaml + R"(
duration_s: 40
rate_hz: 5
trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 2000, north_m: 1000, up_m: 40}], speed_mps: 20}
receivers:
  - name: rover
    profile: survey
    clock: {bias_s: 3.141e-4, drift: 5e-7, drift_walk: 0}
    tracks: [L1CA, L1C, L2C, L5, E1, E5a, E5b, B1I, B3I, G1, G2]
    ionosphere: true
)" + kOutputs,
                                        folder.path());
  test::run_and_write(simulation, folder.path());
  convert(folder / "receiver.rtcm3", simulation.begin(), folder.path(), "judged");
  Compared compared;
  std::set<std::pair<gnss::SatelliteId, std::string>> started;
  rinex::ObservationOptions all;
  all.all_signals = true;
  const auto ours = rinex::read_rinex_observations(folder / "receiver.obs", all);
  const auto theirs = rinex::read_rinex_observations(folder / "judged.obs", all);
  EXPECT_EQ(theirs.epochs.size(), ours.epochs.size());
  if (theirs.epochs.size() != ours.epochs.size()) return compared;
  EXPECT_EQ(theirs.header.receiver, "Canyon");
  using geodesy::kSpeedOfLight;
  constexpr double kMillisecond_m = kSpeedOfLight * 1e-3;
  const double code_m = std::ldexp(kMillisecond_m, -30) + 0.001 + 1e-4;
  const double phase_m = std::ldexp(kMillisecond_m, -32);
  for (std::size_t k = 0; k < ours.epochs.size(); ++k) {
    const auto& a = ours.epochs[k];
    const auto& b = theirs.epochs[k];
    const double shift_s = b.receiver_time - a.receiver_time;
    EXPECT_LE(std::abs(shift_s), 0.0005001);
    EXPECT_EQ(b.receiver_time.nanoseconds() % 1'000'000, 0);
    std::map<std::pair<gnss::SatelliteId, std::string>, const rinex::ObservedSignal*> decoded;
    for (const auto& s : b.signals) decoded[{s.id, s.code.data()}] = &s;
    EXPECT_EQ(decoded.size(), a.signals.size());
    for (const auto& s : a.signals) {
      const auto at = decoded.find({s.id, s.code.data()});
      EXPECT_NE(at, decoded.end()) << to_string(s.id) << ' ' << s.code.data();
      if (at == decoded.end()) continue;
      const rinex::ObservedSignal& t = *at->second;
      const int channel = s.id.system == gnss::System::GLONASS ? ours.header.glonass_channels.at(s.id) : 0;
      const double carrier_hz = gnss::carrier_hz(*s.signal, gnss::l1_frequency_hz(s.id.system, channel));
      const double wavelength_m = kSpeedOfLight / carrier_hz;
      EXPECT_EQ(t.pseudorange_m.has_value(), s.pseudorange_m.has_value());
      if (!t.pseudorange_m) continue;
      EXPECT_NEAR(*t.pseudorange_m, *s.pseudorange_m + kSpeedOfLight * shift_s, code_m);
      if (t.doppler_hz) {
        // Tags of whole milliseconds are those of a clock that does not drift. RTKLIB keeps 24 bits of a
        // Doppler.
        EXPECT_NEAR(*t.doppler_hz, *s.doppler_hz * (1 + kDrift) + carrier_hz * kDrift,
                    0.5e-4 / wavelength_m + 0.00101 + std::ldexp(std::abs(*t.doppler_hz), -24));
      }
      compared.no_doppler += t.doppler_hz ? 0 : 1;
      EXPECT_NEAR(t.cn0_dbhz.value(), s.cn0_dbhz.value(), 1.0 / 32 + 0.0011);
      EXPECT_EQ(t.carrier_phase_cycles.has_value(), s.carrier_phase_cycles.has_value());
      if (s.carrier_phase_cycles && t.carrier_phase_cycles) {
        EXPECT_NEAR(*t.carrier_phase_cycles, *s.carrier_phase_cycles + carrier_hz * shift_s,
                    phase_m / wavelength_m + 0.00101 + 1e-4);
        const bool first = started.insert({s.id, s.code.data()}).second;
        const bool slip = (s.loss_of_lock & 1) != 0, flagged = (t.loss_of_lock & 1) != 0;
        compared.slips += slip ? 1 : 0;
        compared.slips_flagged += slip && flagged ? 1 : 0;
        compared.false_slips += flagged && !slip && !first ? 1 : 0;
      }
      ++compared.signals[std::string(1, gnss::letter(s.id.system)) + s.code.data()];
    }
  }
  int total = 0;
  for (const auto& [signal, count] : compared.signals) total += count;
  std::cout << fmt::format(
      "{} observations of {} signals compared, {} without Doppler; of {} cycle slips {} are told, {} where "
      "none is\n",
      total, compared.signals.size(), compared.no_doppler, compared.slips, compared.slips_flagged,
      compared.false_slips);
  return compared;
}

TEST(RtcmByConvbin, ObservationsAreThoseOfTheRinexFile) {
  CANYON_NEEDS_PROGRAM("convbin");
  const Compared compared =
      compare_observations(std::string(kOpenField) +
                           "sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\n"
                           "start: 2026-03-01T10:00:00Z\n");
  // RTKLIB 2.4.3 b34 supports neither B1C nor B2a in MSM; BeiDou-3 has no B2I.
  EXPECT_EQ(compared.signals.size(), 11U);
  EXPECT_GE(compared.signals.at("G1C"), 201 * 6);
  EXPECT_EQ(compared.false_slips + compared.no_doppler, 0);
}

TEST(RtcmByConvbin, CycleSlipsShowInTheLockTime) {
  CANYON_NEEDS_PROGRAM("convbin");
  const Compared compared = compare_observations(
      "city: {synthetic: {blocks_east: 4, blocks_north: 3, street_width_m: 18, min_height_m: 35, "
      "max_height_m: 60, "
      "seed: 7}, origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 10}}\n"
      "sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\nstart: 2026-03-01T10:00:00Z\n");
  EXPECT_GT(compared.slips, 20);
  // A reader detects a slip if the lock time has decreased, not if the old arc was shorter than the new one
  // (RTCM 10403.3, DF407).
  EXPECT_GE(compared.slips_flagged, 0.9 * compared.slips);
  EXPECT_EQ(compared.false_slips, 0);
}

TEST(RtcmByConvbin, ObservationsOfQzssAndSbasAreThoseOfTheRinexFile) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_SHARED_DATA(path, test::kRealDays[0]);
  // That day's geostationary satellites are marked unfit for ranging; adds one at 80 E that is not, 42,164 km
  // from the Earth's centre.
  const test::TemporaryFolder folder;
  std::ofstream(folder / "sbas.nav")
      << fmt::format("{:<60}{}\n{:60}{}\n", "     3.04           N: GNSS NAV DATA    S: SBAS",
                     "RINEX VERSION / TYPE", "", "END OF HEADER")
      << "S29 2020 06 25 12 08 32 0.000000000000E+00 0.000000000000E+00 3.893160000000E+05\n"
         "     7.321700000000E+03 0.000000000000E+00 0.000000000000E+00 0.000000000000E+00\n"
         "     4.152340000000E+04 0.000000000000E+00 0.000000000000E+00 4.000000000000E+00\n"
         "     0.000000000000E+00 0.000000000000E+00 0.000000000000E+00 1.760000000000E+02\n";
  const Compared compared = compare_observations(
      "city: {open: true, origin: {latitude_deg: 50, longitude_deg: 80, height_m: 10}}\nsky: {navigation: [" +
      fs::absolute(path).string() + ", " + (folder / "sbas.nav").string() +
      "], systems: [GPS, QZSS, SBAS]}\nstart: 2020-06-25T12:10:00Z\n");
  EXPECT_EQ(compared.signals.count("J1C"), 1U);
  EXPECT_EQ(compared.signals.count("S1C"), 1U);
}

// A u-blox base's UBX line with MSM4 and MSM7 as requested by hosts.
TEST(RtcmByConvbin, ReadsTheBaseOnAUbxLine) {
  CANYON_NEEDS_PROGRAM("convbin");
  const test::TemporaryFolder folder;
  const auto simulation = test::prepare(
      std::string(kOpenField) +
          "sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\nstart: 2026-03-01T10:00:00Z\n"
          "duration_s: 20\ntrajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 100, north_m: "
          "0, up_m: 2}], "
          "speed_mps: 1}\nreceivers: [{name: base, profile: survey, tracks: [L1CA, L2C, L5, E1, E5a, B1I, "
          "B3I, G1, G2], clock: {bias_s: 0, drift: 0, "
          "drift_walk: 0}, "
          "fixed: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 20}}]\n" +
          kOutputs,
      folder.path());
  const auto epochs = test::run_and_write(simulation, folder.path());
  rinex::ObservationOptions all;
  all.all_signals = true;
  const auto ours = rinex::read_rinex_observations(folder / "receiver.obs", all);
  for (const int level : {4, 7}) {
    const auto line = encoding::format_named("ubx").make(encoding::describe_receiver(simulation, 0));
    // RTKLIB skips a message after a 0xD3 of another protocol: CFG-UART1OUTPROT-UBX off.
    // CFG-MSGOUT-RTCM_3X_TYPE1005, 1074 or 1077 ... 1124 or 1127 and 1230 of UART1.
    const std::initializer_list<std::pair<std::uint32_t, std::uint64_t>> kMsm4{
        {0x10740001, 0}, {0x10740004, 1}, {0x209102be, 1}, {0x2091035f, 1},
        {0x20910364, 1}, {0x20910369, 1}, {0x2091036e, 1}, {0x20910304, 1}};
    const std::initializer_list<std::pair<std::uint32_t, std::uint64_t>> kMsm7{
        {0x10740001, 0}, {0x10740004, 1}, {0x209102be, 1}, {0x209102cd, 1},
        {0x209102d2, 1}, {0x20910319, 1}, {0x209102d7, 1}, {0x20910304, 1}};
    (void)line->device()->receive(0,
                                  encoding::ubx::frame(0x068A, test::values(1, level == 4 ? kMsm4 : kMsm7)));
    {
      std::ofstream stream(folder / "line.ubx", std::ios::binary);
      for (const simulation::Epoch& epoch : epochs) stream << line->encode(epoch);
    }
    convert(folder / "line.ubx", simulation.begin(), folder.path(), "judged");
    const auto theirs = rinex::read_rinex_observations(folder / "judged.obs", all);
    ASSERT_EQ(theirs.epochs.size(), ours.epochs.size());
    const geodesy::Geodetic position{geodesy::radians(22.298), geodesy::radians(114.178), 20};
    EXPECT_LT(
        (theirs.header.approximate_position_ecef.value() - geodesy::ecef_from_geodetic(position)).norm(),
        1e-3);
    // Half a step of DF400 or DF405, and of RINEX.
    const double code_m = std::ldexp(geodesy::kSpeedOfLight * 1e-3, level == 4 ? -25 : -30) + 0.0011;
    std::size_t compared = 0;
    for (std::size_t k = 0; k < ours.epochs.size(); ++k) {
      EXPECT_EQ(theirs.epochs[k].receiver_time, ours.epochs[k].receiver_time);
      std::map<std::pair<gnss::SatelliteId, std::string>, const rinex::ObservedSignal*> decoded;
      for (const auto& s : theirs.epochs[k].signals) decoded[{s.id, s.code.data()}] = &s;
      for (const auto& s : ours.epochs[k].signals) {
        const auto at = decoded.find({s.id, s.code.data()});
        ASSERT_NE(at, decoded.end()) << to_string(s.id) << ' ' << s.code.data();
        EXPECT_NEAR(at->second->pseudorange_m.value(), s.pseudorange_m.value(), code_m);
        EXPECT_EQ(at->second->doppler_hz.has_value(), level == 7);
        EXPECT_NEAR(at->second->cn0_dbhz.value(), s.cn0_dbhz.value(), level == 4 ? 0.51 : 0.033);
        // DF401 and DF406: 0.6 mm and 0.07 mm. MSM4 lacks the channel of a GLONASS satellite, which RTKLIB
        // needs.
        const bool no_channel = level == 4 && s.id.system == gnss::System::GLONASS;
        EXPECT_EQ(at->second->carrier_phase_cycles.has_value(),
                  s.carrier_phase_cycles.has_value() && !no_channel);
        if (s.carrier_phase_cycles && at->second->carrier_phase_cycles) {
          EXPECT_NEAR(*at->second->carrier_phase_cycles, *s.carrier_phase_cycles,
                      level == 4 ? 0.0026 : 0.0015);
        }
        ++compared;
      }
    }
    std::cout << "MSM" << level << ": " << compared << " observations\n";
    EXPECT_GT(compared, 1000U);
  }
}

/// `a` equals `b` to 12 digits.
void expect_close(double a, double b, const std::string& what) {
  EXPECT_NEAR(a, b, 2e-11 * std::abs(b) + 1e-18) << what;
}

// A real day: broadcast values are multiples of the messages' resolution, so nothing may be lost.
TEST(RtcmByConvbin, EphemeridesOfARealDayComeThroughWhole) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_SHARED_DATA(path, test::kRealDays[0]);
  gnss::NavigationData day = rinex::read_rinex_navigation(path);
  // GLONASS's messages have only the time of day: RTKLIB resolves it within 12 h of the given noon.
  const geodesy::GpsTime noon = geodesy::gps_from_utc({.year = 2020, .month = 6, .day = 25, .hour = 12});
  day.glonass.erase(std::remove_if(day.glonass.begin(), day.glonass.end(),
                                   [&](const auto& e) { return std::abs(e.toe - noon) > 42'000; }),
                    day.glonass.end());
  const test::TemporaryFolder folder;
  {
    std::ofstream stream(folder / "day.rtcm3", std::ios::binary);
    for (const auto& e : day.kepler) stream << encoding::rtcm::frame(encoding::rtcm::ephemeris(e));
    for (const auto& e : day.glonass) stream << encoding::rtcm::frame(encoding::rtcm::ephemeris(e));
  }
  convert(folder / "day.rtcm3", noon, folder.path(), "judged", "-ro -EPHALL");
  const gnss::NavigationData back = rinex::read_rinex_navigation(folder / "judged.nav");
  using Key = std::tuple<gnss::SatelliteId, geodesy::GpsTime, bool>;
  std::map<Key, const gnss::KeplerEphemeris*> kepler;
  for (const auto& e : back.kepler) kepler[{e.id, e.toe, is_galileo_fnav(e)}] = &e;
  std::map<gnss::System, std::pair<int, int>> found;  // of all
  for (const auto& e : day.kepler) {
    ++found[e.id.system].second;
    const auto at = kepler.find({e.id, e.toe, is_galileo_fnav(e)});
    if (at == kepler.end()) continue;
    ++found[e.id.system].first;
    const gnss::KeplerEphemeris& t = *at->second;
    const std::string what = to_string(e.id);
    EXPECT_EQ(t.toc, e.toc) << what;
    for (const auto member :
         {&gnss::KeplerEphemeris::af0, &gnss::KeplerEphemeris::af1, &gnss::KeplerEphemeris::af2,
          &gnss::KeplerEphemeris::sqrt_a, &gnss::KeplerEphemeris::eccentricity,
          &gnss::KeplerEphemeris::inclination, &gnss::KeplerEphemeris::inclination_rate,
          &gnss::KeplerEphemeris::right_ascension, &gnss::KeplerEphemeris::right_ascension_rate,
          &gnss::KeplerEphemeris::argument_of_perigee, &gnss::KeplerEphemeris::mean_anomaly,
          &gnss::KeplerEphemeris::mean_motion_difference, &gnss::KeplerEphemeris::cuc,
          &gnss::KeplerEphemeris::cus, &gnss::KeplerEphemeris::cic, &gnss::KeplerEphemeris::cis,
          &gnss::KeplerEphemeris::crc, &gnss::KeplerEphemeris::crs}) {
      expect_close(t.*member, e.*member, what);
    }
    expect_close(t.group_delay[0], e.group_delay[0], what);
    EXPECT_EQ(is_healthy(t), is_healthy(e)) << what;
    if (e.id.system == gnss::System::Galileo && !is_galileo_fnav(e)) {
      expect_close(t.group_delay[1], e.group_delay[1], what);
      EXPECT_EQ(t.health, e.health) << what;
    }
    EXPECT_EQ(t.iode, e.iode) << what;
  }
  std::map<std::pair<gnss::SatelliteId, geodesy::GpsTime>, const gnss::GlonassEphemeris*> glonass;
  for (const auto& e : back.glonass) glonass[{e.id, e.toe}] = &e;
  for (const auto& e : day.glonass) {
    ++found[gnss::System::GLONASS].second;
    const auto at = glonass.find({e.id, e.toe});
    if (at == glonass.end()) continue;
    ++found[gnss::System::GLONASS].first;
    const gnss::GlonassEphemeris& t = *at->second;
    const std::string what = to_string(e.id);
    expect_close(t.clock_bias_s, e.clock_bias_s, what);
    expect_close(t.frequency_bias, e.frequency_bias, what);
    for (std::size_t i = 0; i < 3; ++i) {
      expect_close(t.position_m[i], e.position_m[i], what);
      expect_close(t.velocity_mps[i], e.velocity_mps[i], what);
      expect_close(t.acceleration_mps2[i], e.acceleration_mps2[i], what);
    }
    EXPECT_EQ(t.channel, e.channel) << what;
    EXPECT_EQ(is_healthy(t), is_healthy(e)) << what;
  }
  for (const auto& [system, counts] : found) {
    std::cout << gnss::name(system) << ": " << counts.first << " of " << counts.second << " ephemerides\n";
    EXPECT_EQ(counts.first, counts.second) << gnss::name(system);
  }
}

struct Baselines {
  int fixed = 0, floating = 0, all = 0;
  double horizontal_rms_m = 0, vertical_rms_m = 0;  ///< of fixed epochs
  // Differential code fixes, of rnx2rtkp and of the rover itself; 3D RMS.
  int differential = 0, reported_differential = 0;
  double differential_rms_m = 0, reported_differential_rms_m = 0;
};

/// A rover's path relative to a base station by rnx2rtkp, epoch by epoch, from the RTCM of both.
Baselines solve(const std::string& yaml, const std::string& mode = "kinematic",
                const std::string& frequency = "l1+l2") {
  const test::TemporaryFolder folder;
  const auto simulation = test::prepare(yaml + kOutputs, folder.path());
  const auto epochs = test::run_and_write(simulation, folder.path());
  for (const char* name : {"base", "rover"}) {
    convert(folder.path() / name / "receiver.rtcm3", simulation.begin(), folder.path(), name);
  }
  std::ofstream(folder / "rtk.conf")
      << "pos1-posmode=" << mode << "\npos1-frequency=" << frequency
      << "\npos1-soltype=forward\npos1-elmask=15\npos1-ionoopt="
         "brdc\n"
         "pos1-tropopt=saas\npos1-navsys=45\npos2-armode=continuous\npos2-gloarmode=off\nant2-postype="
         "rinexhead\n"
         "out-solformat=xyz\nout-outhead=off\nout-timesys=gpst\nout-timeform=tow\nout-timendec=3\n";
  const std::string command =
      "cd '" + folder.path().string() +
      "' && timeout 120 rnx2rtkp -k rtk.conf -o rtk.pos rover.obs base.obs rover.nav base.nav "
      ">/dev/null 2>&1";
  EXPECT_EQ(test::run_program(command).status, 0);
  std::map<std::int64_t, const simulation::Epoch*> rover;
  for (const auto& epoch : epochs) {
    if (epoch.receiver == 1) rover[std::llround(epoch.observed.time.seconds_of_week() * 10)] = &epoch;
  }
  Baselines result;
  result.all = static_cast<int>(rover.size());
  std::istringstream lines(test::read_bytes(folder / "rtk.pos"));
  for (std::string line; std::getline(lines, line);) {
    const auto cells = split_blanks(line);
    if (line.rfind('%', 0) == 0 || cells.size() < 7) continue;
    const auto quality = *parse_integer(cells[5]);
    if (quality == 2) ++result.floating;
    if (quality != 1 && quality != 4) continue;
    const simulation::Epoch& epoch = *rover.at(std::llround(*parse_double(cells[1]) * 10));
    const Eigen::Vector3d solved(*parse_double(cells[2]), *parse_double(cells[3]), *parse_double(cells[4]));
    // The epoch's tag is of the receiver's clock; the rover has moved by at most millimetres since.
    const Eigen::Vector3d error =
        geodesy::enu_from_ecef_rotation(epoch.truth.position) * (solved - epoch.truth_ecef);
    if (quality == 4) {
      ++result.differential;
      result.differential_rms_m += error.squaredNorm();
      continue;
    }
    ++result.fixed;
    result.horizontal_rms_m += error.head<2>().squaredNorm();
    result.vertical_rms_m += error.z() * error.z();
  }
  result.horizontal_rms_m = std::sqrt(result.horizontal_rms_m / std::max(1, result.fixed));
  result.vertical_rms_m = std::sqrt(result.vertical_rms_m / std::max(1, result.fixed));
  for (const auto& [tag, epoch] : rover) {
    if (epoch->observed.fix.kind() != positioning::FixKind::Differential) continue;
    ++result.reported_differential;
    result.reported_differential_rms_m += epoch->error_enu_m.squaredNorm();
  }
  result.differential_rms_m = std::sqrt(result.differential_rms_m / std::max(1, result.differential));
  result.reported_differential_rms_m =
      std::sqrt(result.reported_differential_rms_m / std::max(1, result.reported_differential));
  std::cout << fmt::format("{} differential, RMS {:.3f} m; of the rover's own fixes {}, {:.3f} m\n",
                           result.differential, result.differential_rms_m, result.reported_differential,
                           result.reported_differential_rms_m);
  std::cout << fmt::format(
      "{} of {} epochs fixed, {} floating; RMS of the fixed ones {:.4f} m horizontal, {:.4f} m "
      "vertical\n",
      result.fixed, result.all, result.floating, result.horizontal_rms_m, result.vertical_rms_m);
  return result;
}

constexpr const char* kBaseAndRover = R"(
sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}
start: 2026-03-01T10:00:00Z
duration_s: 300
rate_hz: 1
trajectory: {waypoints: [{east_m: -90, north_m: 0, up_m: 1.5}, {east_m: 90, north_m: 0, up_m: 1.5}], speed_mps: 1, hold_s: 60}
receivers:
  - {name: base, fixed: {east_m: -300, north_m: 300, up_m: 80}, profile: survey, independent_noise: true,
     clock: {bias_s: 3.3e-4, drift: 1e-8}, ionosphere: true, troposphere: true}
  - {name: rover, profile: survey, independent_noise: true,
     clock: {bias_s: -2.1e-4, drift: -2e-8}, ionosphere: true, troposphere: true}
)";

TEST(RtcmByRnx2rtkp, AmbiguitiesAreFixedUnderAnOpenSky) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  const Baselines open = solve(std::string(kOpenField) + kBaseAndRover);
  EXPECT_GE(open.fixed, 0.99 * open.all);
  EXPECT_LT(open.horizontal_rms_m, 0.01);
  EXPECT_LT(open.vertical_rms_m, 0.05);
}

TEST(RtcmByRnx2rtkp, AmbiguitiesFloatInAStreet) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  const Baselines street = solve(
      std::string(
          "city:\n  synthetic: {blocks_east: 4, blocks_north: 3, street_width_m: 30, min_height_m: 10, "
          "max_height_m: 20, seed: 7}\n  origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: "
          "10}") +
      kBaseAndRover);
  EXPECT_LT(street.fixed, 0.2 * street.all);
  EXPECT_GT(street.floating, 0.5 * street.all);
}

// Differential code fixes of the same measurements: Canyon's and RTKLIB's from the files.
TEST(RtcmByRnx2rtkp, DifferentialFixesAreAsGoodAsOurs) {
  CANYON_NEEDS_PROGRAM("convbin");
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  std::string scenario = std::string(kOpenField) + kBaseAndRover;
  const std::string keys =
      "elevation_mask_deg: 15, smoothing: {method: none}, position_filter: {enabled: false}, raim: {enabled: "
      "false}, ";
  for (const char* receiver : {"{name: base, ", "{name: rover, "}) {
    scenario.insert(scenario.find(receiver) + std::string(receiver).size(), keys);
  }
  scenario.insert(scenario.find("{name: rover, ") + 14,
                  "corrections: {from: base}, correct_troposphere: true, ");
  // Equal noise for all: survey's weights include a budget of range errors, which are absent here.
  scenario.insert(scenario.find("nominal: true, ") + 15, "errors: {enabled: false}, ");
  const Baselines open = solve(scenario, "dgps", "l1");
  EXPECT_EQ(open.reported_differential, open.all);
  EXPECT_GE(open.differential, 0.99 * open.all);
  EXPECT_LT(open.reported_differential_rms_m, 1.15 * open.differential_rms_m);
  EXPECT_GT(open.reported_differential_rms_m, 0.5 * open.differential_rms_m);
}

TEST(BaseStation, StandsStillWhereTheScenarioPutsIt) {
  const test::TemporaryFolder folder;
  const auto simulation = test::prepare(std::string(kOpenField) + kBaseAndRover, folder.path());
  const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(22.298, 114.178, 10));
  for (const double s : {0.0, 123.4, 300.0}) {
    const simulation::Pose pose = simulation.antenna_pose(0, simulation.begin() + s);
    EXPECT_LT((frame.local_from_geodetic(pose.position) - Eigen::Vector3d(-300, 300, 80)).norm(), 1e-6);
    EXPECT_EQ(pose.velocity_enu_mps.norm(), 0);
    EXPECT_EQ(pose.time, simulation.begin() + s);
  }
}

}  // namespace
}  // namespace canyon
