// Every kind of recorded path for a run: format, times, heights, with and without the key `format`.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation {
namespace {

/// A file of five points, 11.1 m and 1 s apart, starting at 48 N, 11 E, 547 m above the ellipsoid.
struct PathFormat {
  const char* name;
  const char* format;
  const char* head;
  const char* line;  ///< {i} counts points, {minutes} are those of the latitude
  const char* tail;
  const char* keys;   ///< more of the trajectory
  bool timed = true;  ///< false: driven by speed_mps
  bool dated = true;  ///< false: times count from start
  bool geoid = true;  ///< false: heights are above a sea level 47 m above the ellipsoid
};
std::ostream& operator<<(std::ostream& out, const PathFormat& format) {
  return out << format.name;
}

const PathFormat kFormats[] = {
    {"csv_dates", "csv", "time,latitude,longitude,height\n", "2024-05-01T10:00:0{i}Z,{latitude},11,547\n", "",
     ""},
    {"csv_units", "csv", "height_ft;time_ms;latitude_rad;longitude_rad\n",
     "1794.619423;{i}000;{radians};0.191986217719\n", "", "", true, false},
    {"csv_sea_level", "csv", "unix_time_s,lat,lon,height_msl_m\n", "171455760{i},{latitude},11,500\n", "", "",
     true, true, false},
    {"csv_ecef", "csv", "gps_week,gps_tow,x,y,z\n", "2312,{tow},{x},{y},{z}\n", "", ""},
    {"csv_columns", "csv", "t|s|,N,E,h\n", "{i},{latitude},11,547\n", "",
     ", columns: {time: 't|s| [s]', latitude: 'N [deg]', longitude: 'E [deg]', height: 'h [m]'}", true,
     false},
    {"csv_numbers", "csv", "", "{i}, {x}, {y}, {z}\n", "",
     ", columns: {time: '1 [s]', x: '2 [m]', y: '3 [m]', z: '4 [m]'}", true, false},
    {"urbannav", "urbannav", "", "2312,{tow},{latitude},11,547\n", "", ""},
    {"urbannav_2021", "urbannav", "", "171455760{i}.0 2312 {tow} 48 {minutes} 0 11 0 0 547 0\n", "", ""},
    {"rtklib", "rtklib", "%  GPST  latitude(deg) longitude(deg)  height(m)   Q  ns\n",
     "2024/05/01 10:00:{gps_s}.000  {latitude}  11.0  547.0  1  12\n", "", ""},
    {"nmea", "nmea", "$GPRMC,100000,A,4800.0,N,01100.0,E,0,0,010524,,,A\n",
     "$GPGGA,10000{i},48{minutes},N,01100.0,E,1,08,0.9,500.0,M,47.0,M,,\n", "", ""},
    {"nmea_without_date", "nmea", "", "$GPGGA,10000{i},48{minutes},N,01100.0,E,1,08,0.9,500.0,M,47.0,M,,\n",
     "", "", true, false},
    {"gnsslogger", "gnsslogger",
     "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,UnixTimeMillis\n",
     "Fix,GPS,{latitude},11,547,171455760{i}000\n", "", ""},
    {"gpx", "gpx", "<gpx><trk><trkseg>",
     "<trkpt lat='{latitude}' lon='11'><ele>500</ele><geoidheight>47</geoidheight>"
     "<time>2024-05-01T10:00:0{i}Z</time></trkpt>\n",
     "</trkseg></trk></gpx>", ""},
    {"gpx_without_times", "gpx", "<gpx><rte>", "<rtept lat='{latitude}' lon='11'><ele>500</ele></rtept>\n",
     "</rte></gpx>", ", speed_mps: 11.12", false, false, false},
    {"kml", "kml", "<kml><gx:Track><altitudeMode>absolute</altitudeMode>",
     "<when>2024-05-01T10:00:0{i}Z</when><gx:coord>11 {latitude} 500</gx:coord>\n", "</gx:Track></kml>", "",
     true, true, false},
    {"kml_without_times", "kml", "<kml><LineString><coordinates>", "11,{latitude},500\n",
     "</coordinates></LineString></kml>", ", speed_mps: 11.12", false, false, false},
};

class PathFormats : public ::testing::TestWithParam<std::tuple<PathFormat, bool, bool>> {};

TEST_P(PathFormats, ReachARun) {
  const auto& [format, key, terrain] = GetParam();
  std::string text = format.head;
  for (int i = 0; i < 5; ++i) {
    const double latitude = 48 + 1e-4 * i;
    const Eigen::Vector3d ecef =
        geodesy::ecef_from_geodetic(geodesy::Geodetic::from_degrees(latitude, 11, 547));
    text += fmt::format(fmt::runtime(format.line), fmt::arg("i", i), fmt::arg("latitude", latitude),
                        fmt::arg("minutes", fmt::format("{:06.3f}", 60 * 1e-4 * i)),
                        fmt::arg("radians", geodesy::radians(latitude)), fmt::arg("x", ecef.x()),
                        fmt::arg("y", ecef.y()), fmt::arg("z", ecef.z()), fmt::arg("gps_s", 18 + i),
                        fmt::arg("tow", 295218 + i));
  }
  text += format.tail;
  const test::TemporaryFolder folder;
  (void)folder.write("way.file", text);
  const std::string yaml = fmt::format(
      "city: {{synthetic: {{}}, origin: {{latitude_deg: 48, longitude_deg: 11, height_m: 520}}, "
      "geoid_undulation_m: 47}}\nsky: {{nominal: true, systems: [GPS]}}\nduration_s: 2\n{}"
      "trajectory: {{file: way.file{}{}{}}}\nreceivers: [{{name: r, profile: ideal}}]\n",
      format.dated ? "" : "start: 2024-05-01T10:00:00Z\n",
      key ? std::string(", format: ") + format.format : "", format.keys,
      terrain ? ", height_above_terrain_m: 1.5" : "");
  Scenario scenario = parse_scenario(yaml, folder.path() / "s.yaml");
  EXPECT_EQ(scenario.trajectory.format, format.format);
  city::City city = load_city(scenario);
  const Simulation simulation(std::move(scenario), std::move(city));
  EXPECT_EQ(simulation.begin(), geodesy::parse_time("2024-05-01T10:00:00Z"));
  EXPECT_EQ(simulation.epoch_count(), 3U);
  const Pose pose = simulation.vehicle_pose(simulation.begin() + 2);
  EXPECT_NEAR(geodesy::degrees(pose.position.latitude_rad), 48.0002, 1e-7);
  EXPECT_NEAR(geodesy::degrees(pose.position.longitude_rad), 11, 1e-7);
  EXPECT_NEAR(pose.position.height_m, terrain ? 521.5 : 547, 2e-3);
  EXPECT_EQ(simulation.run({}).epochs, 3U);
}

INSTANTIATE_TEST_SUITE_P(All, PathFormats,
                         ::testing::Combine(::testing::ValuesIn(kFormats), ::testing::Bool(),
                                            ::testing::Bool()),
                         [](const auto& each) {
                           return fmt::format("{}_{}_{}", std::get<0>(each.param).name,
                                              std::get<1>(each.param) ? "named" : "told_by_content",
                                              std::get<2>(each.param) ? "over_terrain" : "own_heights");
                         });

}  // namespace
}  // namespace canyon::simulation
