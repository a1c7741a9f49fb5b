#include "canyon/outputs/encoding/nmea.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sample_signals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding {
namespace {

using testing::ElementsAre;

/// Bodies (without "$", checksum and line end) of the sentences whose type is `type`.
std::vector<std::string> bodies(const std::string& text, const std::string& type = "") {
  std::vector<std::string> found;
  for (const std::string_view line : split(text, '\n')) {
    if (line.empty()) continue;
    EXPECT_EQ(line.front(), '$');
    EXPECT_EQ(line.back(), '\r');
    const std::size_t star = line.find('*');
    const std::string body(line.substr(1, star - 1));
    EXPECT_EQ(nmea_sentence(body), std::string(line) + '\n');
    if (type.empty() || body.substr(2, 3) == type) found.push_back(body);
  }
  return found;
}

simulation::Epoch epoch_at(double seconds, bool fix = true) {
  return test::sample_epoch(test::sample_time() + seconds, test::sample_point(), {1, -2, 3}, fix);
}

// The sample GGA of Wikipedia's article "NMEA 0183".
TEST(Nmea, Checksum) {
  EXPECT_EQ(nmea_sentence("GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,"),
            "$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n");
}

TEST(Nmea, SentencesOfAnEpoch) {
  simulation::Epoch epoch = epoch_at(0);
  // 22 deg 17.895000' N, 114 deg 10.725000' E.
  epoch.observed.fix.position = geodesy::Geodetic::from_degrees(22.29825, 114.17875, 12.3456);
  const std::string text = nmea_epoch(epoch);
  EXPECT_THAT(bodies(text, "RMC"),
              // hypot(3.1, 4.2) m/s = 10.147 kn towards 143.57 deg
              ElementsAre("GNRMC,125803.00,A,2217.895000,N,11410.725000,E,10.147,143.57,280419,,,A,V"));
  EXPECT_THAT(bodies(text, "GGA"),
              ElementsAre("GNGGA,125803.00,2217.895000,N,11410.725000,E,1,09,1.25,12.346,M,0.0,M,,"));
  EXPECT_THAT(
      bodies(text, "GSA"),
      ElementsAre("GNGSA,A,3,05,12,17,,,,,,,,,,2.10,1.25,1.69,1",
                  "GNGSA,A,3,65,88,,,,,,,,,,,2.10,1.25,1.69,2", "GNGSA,A,3,11,,,,,,,,,,,,2.10,1.25,1.69,3",
                  "GNGSA,A,3,03,30,,,,,,,,,,,2.10,1.25,1.69,4", "GNGSA,A,3,02,,,,,,,,,,,,2.10,1.25,1.69,5"));
  // Covariance [4 1.5; 1.5 2.25]: eigenvalues 3.125 +- sqrt(0.875^2 + 1.5^2) = 4.8616, 1.3884;
  // major axis atan2(2 * 1.5, 2.25 - 4) / 2 = 60.13 deg from north.
  EXPECT_THAT(bodies(text, "GST"), ElementsAre("GNGST,125803.00,1.500,2.205,1.178,60.13,1.500,2.000,3.000"));
  EXPECT_THAT(
      bodies(text, "GSV"),
      ElementsAre("GPGSV,2,1,05,05,60,046,,12,30,000,,17,16,200,,24,05,090,,1", "GPGSV,2,2,05,31,25,120,,1",
                  "GLGSV,1,1,02,65,40,010,,88,55,310,,1", "GAGSV,1,1,02,11,70,250,,36,33,180,,7",
                  "GBGSV,1,1,02,03,48,220,,30,20,080,,1", "GQGSV,1,1,01,02,80,060,,1"));
}

TEST(Nmea, SouthWestAndRoundingToAWholeDegree) {
  simulation::Epoch epoch = epoch_at(0);
  // 33 deg 59.9999999' S rounds to 34 deg 00.000000'.
  epoch.observed.fix.position = geodesy::Geodetic::from_degrees(-(34 - 1e-9), -70.5 - 1.0 / 3, -5.0);
  EXPECT_THAT(bodies(nmea_epoch(epoch), "GGA"),
              ElementsAre("GNGGA,125803.00,3400.000000,S,07050.000000,W,1,09,1.25,-5.000,M,0.0,M,,"));
}

// The altitude is above mean sea level, and sea level and the altitude together give the ellipsoidal height.
TEST(Nmea, SaysWhereMeanSeaLevelIs) {
  simulation::Epoch epoch = epoch_at(0);
  epoch.observed.fix.position = geodesy::Geodetic::from_degrees(22.29825, 114.17875, 12.3456);
  epoch.geoid_undulation_m = -2.375;
  EXPECT_THAT(bodies(nmea_epoch(epoch), "GGA"),
              ElementsAre("GNGGA,125803.00,2217.895000,N,11410.725000,E,1,09,1.25,14.721,M,-2.375,M,,"));
  epoch.observed.fix.status = positioning::FixStatus::NoSignal;
  EXPECT_THAT(bodies(nmea_epoch(epoch), "GGA"), ElementsAre("GNGGA,125803.00,,,,,0,00,,,M,,M,,"));
}

// Quality 6, mode E, status A and GSA's 2 of a dead reckoning fix: the table of position fix flags in
// u-blox's interface descriptions (UBX-18010854, 4.1.6).
TEST(Nmea, APredictionIsEstimated) {
  simulation::Epoch epoch = test::predicted(epoch_at(0));
  epoch.observed.fix.position = geodesy::Geodetic::from_degrees(22.29825, 114.17875, 12.3456);
  const std::string text = nmea_epoch(epoch);
  EXPECT_THAT(bodies(text, "RMC"),
              ElementsAre("GNRMC,125803.00,A,2217.895000,N,11410.725000,E,10.147,143.57,280419,,,E,V"));
  EXPECT_THAT(bodies(text, "GGA"),
              ElementsAre("GNGGA,125803.00,2217.895000,N,11410.725000,E,6,00,,12.346,M,0.0,M,,"));
  EXPECT_THAT(bodies(text, "GSA"), ElementsAre("GNGSA,A,2,,,,,,,,,,,,,,,,"));
}

// GGA's quality, age and station, RMC's mode: NMEA 0183 v4.11; position fix flags of UBX-22008968, 1.3.
TEST(Nmea, SaysWhatTheCorrectionsMadeOfTheFix) {
  const auto expect = [](positioning::FixKind kind, const std::string& quality, const std::string& mode) {
    const std::string text = nmea_epoch(test::corrected(epoch_at(0), kind));
    EXPECT_THAT(text, testing::HasSubstr(",E," + quality + ",09,1.25,")) << text;
    EXPECT_THAT(text, testing::HasSubstr(",0.0,M,1.6,0007*")) << text;
    EXPECT_THAT(text, testing::HasSubstr(",280419,,," + mode + ",V*")) << text;
    EXPECT_THAT(bodies(text, "GSA"), testing::Each(testing::HasSubstr("GSA,A,3,")));
  };
  expect(positioning::FixKind::Differential, "2", "D");
  expect(positioning::FixKind::Float, "5", "F");
  expect(positioning::FixKind::Fixed, "4", "R");

  simulation::Epoch unknown = test::corrected(epoch_at(0), positioning::FixKind::Fixed);
  unknown.observed.fix.correction_age_s.reset();
  unknown.observed.fix.correction_station.reset();
  EXPECT_THAT(nmea_epoch(unknown), testing::HasSubstr(",0.0,M,,*"));
  const simulation::Epoch lost = test::corrected(epoch_at(0, false), positioning::FixKind::Fixed);
  EXPECT_THAT(nmea_epoch(lost), testing::HasSubstr(",0,00,,,M,,M,,*"));
  const simulation::Epoch prediction =
      test::corrected(test::predicted(epoch_at(0)), positioning::FixKind::Fixed);
  EXPECT_THAT(nmea_epoch(prediction), testing::HasSubstr(",0.0,M,,*"));
}

// True heading, only of fixed ambiguities between two antennas.
TEST(Nmea, SaysWhereTwoAntennasPoint) {
  using positioning::FixKind;
  const auto headings = [](FixKind kind, bool moving_base, const Eigen::Vector3d& vector_enu) {
    return bodies(nmea_epoch(test::with_baseline(epoch_at(0), kind, moving_base, vector_enu)), "HDT");
  };
  EXPECT_THAT(headings(FixKind::Fixed, true, {-0.6, 0.8, 0.1}), ElementsAre("GNHDT,323.13,T"));
  EXPECT_THAT(headings(FixKind::Fixed, true, {-1e-5, 1, 0}), ElementsAre("GNHDT,0.00,T"));
  EXPECT_THAT(headings(FixKind::Float, true, {-0.6, 0.8, 0.1}), ElementsAre());
  EXPECT_THAT(headings(FixKind::Fixed, false, {-0.6, 0.8, 0.1}), ElementsAre());
}

// 1024 weeks before 2019-04-28 it was 1999-09-12.
TEST(Nmea, StatesTheDateThatTheReceiverBelieves) {
  simulation::Epoch epoch = epoch_at(0, false);
  epoch.observed.events.weeks_off = -1024;
  epoch.observed.events.utc_off_s = 1;
  EXPECT_THAT(bodies(nmea_epoch(epoch), "RMC"), ElementsAre("GNRMC,125804.00,V,,,,,,,120999,,,N,V"));
}

TEST(Nmea, WithoutAFixNothingLooksLikeAPosition) {
  simulation::Epoch epoch = epoch_at(0, false);
  epoch.observed.fix.position = {};  // 0, 0: must not be written
  epoch.observed.fix.dop = positioning::Dop{1, 1, 1, 1, 1};
  epoch.observed.fix.velocity_enu_mps = Eigen::Vector3d::Zero();
  const std::string text = nmea_epoch(epoch);
  EXPECT_THAT(bodies(text, "RMC"), ElementsAre("GNRMC,125803.00,V,,,,,,,280419,,,N,V"));
  EXPECT_THAT(bodies(text, "GGA"), ElementsAre("GNGGA,125803.00,,,,,0,00,,,M,,M,,"));
  EXPECT_THAT(bodies(text, "GSA"), ElementsAre("GNGSA,A,1,,,,,,,,,,,,,,,,"));
  EXPECT_THAT(bodies(text, "GST"), ElementsAre("GNGST,125803.00,,,,,,,"));
  EXPECT_EQ(bodies(text, "GSV").size(), 6U);
}

TEST(Nmea, NothingInView) {
  simulation::Epoch epoch = epoch_at(0, false);
  epoch.observed.satellites.clear();
  EXPECT_THAT(bodies(nmea_epoch(epoch), "GSV"), ElementsAre("GPGSV,1,1,00,1"));
}

TEST(Nmea, OneSystemSpeaksForItself) {
  simulation::Epoch epoch = epoch_at(0);
  auto& seen = epoch.observed;
  seen.satellites.clear();
  seen.fix.used.clear();
  for (int i = 1; i <= 5; ++i) {
    seen.satellites.push_back(
        test::sample_satellite("C0" + std::to_string(i), 60 * i, 45, propagation::Visibility::LOS));
    seen.fix.used.push_back(seen.satellites.back().id);
  }
  const std::string text = nmea_epoch(epoch);
  EXPECT_THAT(bodies(text, "GSA"), ElementsAre("GBGSA,A,3,01,02,03,04,05,,,,,,,,2.10,1.25,1.69,4"));
  for (const std::string& body : bodies(text)) EXPECT_EQ(body.substr(0, 2), "GB") << body;
}

// NMEA 0183 lists SBAS as GPS satellites: one talker, one list.
TEST(Nmea, SbasStandsBesideGps) {
  simulation::Epoch epoch = epoch_at(0);
  auto& seen = epoch.observed;
  seen.satellites.clear();
  seen.fix.used.clear();
  for (const char* id : {"G05", "G07", "G12", "G30", "S23", "S36"}) {
    seen.satellites.push_back(test::sample_satellite(id, 60, 45, propagation::Visibility::LOS));
    seen.fix.used.push_back(seen.satellites.back().id);
  }
  const std::string text = nmea_epoch(epoch);
  EXPECT_THAT(bodies(text, "GSA"), ElementsAre("GPGSA,A,3,05,07,12,30,36,49,,,,,,,2.10,1.25,1.69,1"));
  for (const std::string& body : bodies(text)) EXPECT_EQ(body.substr(0, 2), "GP") << body;
  const auto gsv = bodies(text, "GSV");
  ASSERT_EQ(gsv.size(), 2U);
  EXPECT_THAT(gsv[0], testing::StartsWith("GPGSV,2,1,06,05,45,060,"));
  EXPECT_THAT(gsv[1], testing::StartsWith("GPGSV,2,2,06,36,45,060,"));
}

TEST(Nmea, MoreThanTwelveSatellitesTakeASecondGsa) {
  simulation::Epoch epoch = epoch_at(0);
  epoch.observed.fix.used.clear();
  for (std::uint8_t i = 1; i <= 14; ++i) epoch.observed.fix.used.push_back({gnss::System::GPS, i});
  EXPECT_THAT(bodies(nmea_epoch(epoch), "GSA"),
              ElementsAre("GNGSA,A,3,01,02,03,04,05,06,07,08,09,10,11,12,2.10,1.25,1.69,1",
                          "GNGSA,A,3,13,14,,,,,,,,,,,2.10,1.25,1.69,1"));
}

TEST(Nmea, SatelliteNumbers) {
  const auto number = [](const char* id) { return nmea_satellite_number(*gnss::parse_satellite(id)); };
  EXPECT_EQ(number("G32"), 32);
  EXPECT_FALSE(number("G33")) << "33 is an SBAS satellite in NMEA";
  EXPECT_EQ(number("S20"), 33);  // PRN 120 to 151 are 33 to 64
  EXPECT_EQ(number("S51"), 64);
  EXPECT_FALSE(number("S52"));
  EXPECT_FALSE(number("S19"));
  EXPECT_EQ(number("R24"), 88);
  EXPECT_EQ(number("E36"), 36);
  EXPECT_EQ(number("C63"), 63);
  EXPECT_EQ(number("J10"), 10);
  EXPECT_FALSE(number("J11"));
}

TEST(Nmea, TimeIsUtcWithLeapSecondsAndRoundedOnce) {
  EXPECT_EQ(bodies(nmea_epoch(epoch_at(0.1)), "GGA").front().substr(6, 9), "125803.10");
  EXPECT_EQ(bodies(nmea_epoch(epoch_at(0.125)), "GGA").front().substr(6, 10), "125803.125");
  EXPECT_EQ(bodies(nmea_epoch(epoch_at(0.9999999)), "GGA").front().substr(6, 9), "125804.00");
  // Second 60 of 2016-12-31.
  const auto leap = geodesy::gps_from_utc({2016, 12, 31, 23, 59, 60, 0});
  const std::string text = nmea_epoch(test::sample_epoch(leap, test::sample_point(), {0, 0, 0}));
  EXPECT_EQ(bodies(text, "GGA").front().substr(6, 9), "235960.00");
  EXPECT_NE(bodies(text, "RMC").front().find(",311216,"), std::string::npos);
}

TEST(Nmea, SentencesKeepTo82Characters) {
  simulation::Epoch epoch = epoch_at(0.125);
  epoch.observed.fix.position = geodesy::Geodetic::from_degrees(-22.123456789, -114.123456789, -123.456);
  epoch.observed.fix.dop = positioning::Dop{99, 99.99, 99.99, 99.99, 99};
  epoch.observed.fix.covariance_enu *= 1e4;
  const std::string text = nmea_epoch(epoch);
  for (const std::string_view line : split(text, '\n')) EXPECT_LE(line.size() + 1, 82U) << line;
}

TEST(Nmea, SignalStrengthOfWhatIsTracked) {
  simulation::Epoch epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time());
  auto& seen = epoch.observed;
  seen.satellites[0].measurement->cn0_dbhz = 46.5;  // to the nearest dB
  seen.satellites[1].measurement->cn0_dbhz = -3;    // two digits hold 00 to 99
  seen.satellites[2].measurement->cn0_dbhz = 120.0;
  // G24 is below the mask, G31 is blocked.
  EXPECT_THAT(bodies(nmea_epoch(epoch), "GSV"),
              ElementsAre("GPGSV,2,1,05,05,60,046,47,12,30,000,00,17,16,200,99,24,05,090,,1",
                          "GPGSV,2,2,05,31,25,120,,1", "GLGSV,1,1,02,65,40,010,42,88,55,310,41,1",
                          "GAGSV,1,1,02,11,70,250,40,36,33,180,22,7",
                          "GBGSV,1,1,02,03,48,220,38,30,20,080,37,1", "GQGSV,1,1,01,02,80,060,36,1"));
  EXPECT_THAT(bodies(nmea_epoch(epoch), "GSA")[2], "GNGSA,A,3,11,,,,,,,,,,,,2.10,1.25,1.69,3")
      << "E36, which RAIM has excluded, is not in the fix";
}

class GpsdDecode : public testing::Test {
 protected:
  /// Output of gpsdecode for the file that the sink wrote.
  static std::vector<nlohmann::json> decode(const std::filesystem::path& path) {
    const auto result = test::run_program("gpsdecode < '" + path.string() + "'");
    EXPECT_EQ(result.status, 0);
    std::vector<nlohmann::json> reports;
    for (const std::string_view line : split(result.output, '\n')) {
      if (!line.empty()) reports.push_back(nlohmann::json::parse(line));
    }
    return reports;
  }
};

TEST_F(GpsdDecode, ReadsTheSameFixes) {
  CANYON_NEEDS_PROGRAM("gpsdecode");
  const test::TemporaryFolder folder;
  const auto sink = open_file("nmea", folder / "receiver.nmea", 0);
  std::map<std::string, simulation::Epoch> by_time;
  for (int i = 0; i < 20; ++i) {
    geodesy::Geodetic geodetic = test::sample_point();
    geodetic.latitude_rad += 1.2345e-7 * i * i;
    geodetic.longitude_rad -= 2.3456e-7 * i;
    const bool fix = i < 8 || i > 10;
    auto epoch =
        test::sample_epoch(test::sample_time() + 0.1 * i, geodetic, {0.1 * i, 2.0 - i, 0.5 * i}, fix);
    epoch.geoid_undulation_m = 39.62549;
    sink->write(epoch);
    by_time[geodesy::format_utc(epoch.observed.time)] = epoch;
  }
  sink->finish();
  int fixes = 0, no_fixes = 0, sigmas = 0;
  double worst_m = 0;
  for (const auto& report : decode(folder / "receiver.nmea")) {
    if (report.at("class") == "TPV") {
      ASSERT_TRUE(by_time.count(report.at("time"))) << report;
      const auto& fix = by_time.at(report.at("time")).observed.fix;
      if (!fix.solved()) {
        ++no_fixes;
        EXPECT_EQ(report.at("mode"), 1) << report;
        EXPECT_FALSE(report.contains("lat")) << report;
        continue;
      }
      // gpsd 3.25 also reports while an epoch's sentences are still arriving; the complete epoch follows.
      if (report.at("mode") == 1) continue;
      ++fixes;
      EXPECT_EQ(report.at("mode"), 3) << report;
      const auto decoded = geodesy::Geodetic::from_degrees(report.at("lat"), report.at("lon"),
                                                           report.at("altHAE").get<double>());
      worst_m = std::max(worst_m, (geodesy::ecef_from_geodetic(decoded) - fix.position_ecef).norm());
      EXPECT_NEAR(report.at("altMSL").get<double>(), fix.position.height_m - 39.62549, 1.1e-3);
      EXPECT_NEAR(report.at("geoidSep").get<double>(), 39.625, 1e-3);
      EXPECT_NEAR(report.at("speed").get<double>(), std::hypot(3.1, 4.2), 1e-3);
      EXPECT_NEAR(report.at("track").get<double>(), 143.57, 0.01);
    } else if (report.at("class") == "GST" && report.contains("rms")) {
      ++sigmas;
      EXPECT_EQ(report.at("rms"), 1.5);
      EXPECT_NEAR(report.at("lat").get<double>(), 1.5, 1e-3);
      EXPECT_NEAR(report.at("lon").get<double>(), 2.0, 1e-3);
      EXPECT_NEAR(report.at("alt").get<double>(), 3.0, 1e-3);
      EXPECT_NEAR(report.at("major").get<double>(), 2.205, 1e-3);
      EXPECT_NEAR(report.at("minor").get<double>(), 1.178, 1e-3);
      EXPECT_NEAR(report.at("orient").get<double>(), 60.13, 0.01);
    }
  }
  // gpsd needs an epoch or two to learn the cycle.
  EXPECT_GE(fixes, 14);
  EXPECT_GE(no_fixes, 2);
  EXPECT_GE(sigmas, 14);
  // Six decimals of a minute are at most 0.93 mm off in each of latitude and longitude, three of a metre 0.5
  // mm.
  EXPECT_LT(worst_m, 1.5e-3);
  RecordProperty("worst_mm", std::to_string(worst_m * 1e3));
}

TEST_F(GpsdDecode, ReadsTheSameSatellites) {
  CANYON_NEEDS_PROGRAM("gpsdecode");
  const test::TemporaryFolder folder;
  const auto path = folder / "receiver.nmea";
  {
    std::ofstream out(path, std::ios::binary);
    for (int i = 0; i < 4; ++i) {
      // gpsd 3.22 ignores the system identifier of GSA and talker GQ, so GPS and GLONASS are checked.
      simulation::Epoch epoch =
          test::sample_signal_epoch(test::sample_time() + static_cast<double>(i), test::sample_time());
      auto& seen = epoch.observed;
      const auto foreign = [](gnss::SatelliteId id) { return id.system > gnss::System::GLONASS; };
      seen.satellites.erase(std::remove_if(seen.satellites.begin(), seen.satellites.end(),
                                           [&](const auto& s) { return foreign(s.id); }),
                            seen.satellites.end());
      seen.fix.used.erase(std::remove_if(seen.fix.used.begin(), seen.fix.used.end(), foreign),
                          seen.fix.used.end());
      out << nmea_epoch(epoch);
    }
  }
  nlohmann::json sky;
  for (const auto& report : decode(path)) {
    if (report.at("class") == "SKY" && report.contains("satellites")) sky = report;
  }
  ASSERT_FALSE(sky.is_null());
  EXPECT_EQ(sky.at("nSat"), 7);
  EXPECT_EQ(sky.at("uSat"), 5);
  EXPECT_EQ(sky.at("hdop"), 1.25);
  EXPECT_EQ(sky.at("pdop"), 2.1);
  EXPECT_EQ(sky.at("vdop"), 1.69);
  std::map<int, nlohmann::json> by_prn;
  for (const auto& satellite : sky.at("satellites")) by_prn[satellite.at("PRN")] = satellite;
  for (const int prn : {5, 12, 17, 65, 88}) EXPECT_EQ(by_prn[prn].value("used", false), true) << prn;
  for (const int prn : {24, 31}) EXPECT_EQ(by_prn[prn].value("used", true), false) << prn;
  // C/N0 of G05 46.3, G12 45.3, R24 41.3 - 1.
  EXPECT_EQ(by_prn[5].value("ss", -1.0), 46);
  EXPECT_EQ(by_prn[12].value("ss", -1.0), 45);
  EXPECT_EQ(by_prn[88].value("ss", -1.0), 41);
  EXPECT_EQ(by_prn[65].value("gnssid", -1), 6);
  EXPECT_EQ(by_prn[65].value("svid", -1), 1);
  EXPECT_EQ(by_prn[88].value("el", 0.0), 55);
  EXPECT_EQ(by_prn[88].value("az", 0.0), 310);
  EXPECT_EQ(by_prn[12].value("az", -1.0), 0);
}

TEST_F(GpsdDecode, ReadsEverySystemInView) {
  CANYON_NEEDS_PROGRAM("gpsdecode");
  const test::TemporaryFolder folder;
  const auto sink = open_file("nmea", folder / "receiver.nmea", 0);
  for (int i = 0; i < 4; ++i) sink->write(epoch_at(i));
  sink->finish();
  std::map<std::pair<int, int>, nlohmann::json> seen;  // by gpsd's system and satellite number
  for (const auto& report : decode(folder / "receiver.nmea")) {
    // gpsd 3.25 reports DOPs alone as well.
    if (report.at("class") != "SKY" || !report.contains("satellites")) continue;
    for (const auto& satellite : report.at("satellites")) {
      seen[{satellite.at("gnssid"), satellite.at("svid")}] = satellite;
    }
  }
  EXPECT_EQ((seen[{2, 11}].value("el", 0.0)), 70);  // Galileo
  EXPECT_EQ((seen[{2, 36}].value("az", 0.0)), 180);
  EXPECT_EQ((seen[{3, 3}].value("az", 0.0)), 220);  // BeiDou
  EXPECT_EQ((seen[{3, 30}].value("el", 0.0)), 20);
}

}  // namespace
}  // namespace canyon::encoding
