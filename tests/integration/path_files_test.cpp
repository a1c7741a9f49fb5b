// paths.csv of a run: the excess of every path, computed from its points in the file.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/integration/run_scenario.hpp"

namespace canyon {
namespace {

using Record = std::map<std::string, std::string>;

std::vector<Record> read_csv(const std::filesystem::path& path) {
  TextFile file(path);
  std::vector<std::string> names;
  std::vector<Record> records;
  while (const auto line = file.next_line()) {
    const auto cells = split(*line, ',');
    if (names.empty()) {
      names.assign(cells.begin(), cells.end());
      continue;
    }
    EXPECT_EQ(cells.size(), names.size()) << *line;
    Record record;
    for (std::size_t i = 0; i < names.size(); ++i) record[names[i]] = std::string(cells[i]);
    records.push_back(std::move(record));
  }
  return records;
}

Eigen::Vector3d point(const Record& record, const std::string& name) {
  return {parse_double(record.at(name + "_east_m")).value(),
          parse_double(record.at(name + "_north_m")).value(),
          parse_double(record.at(name + "_up_m")).value()};
}

// The path of a plane wave from direction s over p to the antenna a exceeds the straight one by the distance
// from p to a minus the advance of p towards the satellite: |p - a| - s . (p - a).
TEST(PathFiles, DetoursAreThoseOfTheirPoints) {
  const test::TemporaryFolder folder;
  const simulation::Simulation simulation = test::prepare(
      "city: {synthetic: {blocks_east: 4, blocks_north: 4, seed: 5}}\n"
      "sky: {nominal: true, systems: [GPS, Galileo]}\nstart: 2026-03-01T10:00:00Z\n"
      "trajectory: {waypoints: [{east_m: -76, north_m: 0}, {east_m: 76, north_m: 0}], speed_mps: 8, "
      "height_above_terrain_m: 1.5}\nrate_hz: 2\n"
      "propagation: {reflection_order: 2, diffraction: {enabled: true}, diffuse: {bounces: 1}}\n"
      "receivers: [{name: strong, profile: survey}, {name: plain, profile: survey, tracks: [E1], signal: "
      "{enabled: false}}]\n"
      "outputs: {pictures: false, paths_csv: true}\n",
      folder.path());
  const auto epochs = test::run_and_write(simulation, folder.path());

  std::map<std::string, Eigen::Vector3d> antennas;                            // by time, in the city's frame
  std::map<std::pair<std::string, std::string>, Eigen::Vector3d> directions;  // by time and satellite
  const geodesy::LocalFrame& frame = simulation.environment().city().frame;
  for (const Record& r : read_csv(folder / "strong" / "epochs.csv")) {
    antennas[r.at("gps_tow")] = frame.local_from_geodetic(geodesy::Geodetic::from_degrees(
        parse_double(r.at("true_latitude_deg")).value(), parse_double(r.at("true_longitude_deg")).value(),
        parse_double(r.at("true_height_m")).value()));
  }
  std::map<std::string, std::string> visibilities;
  for (const Record& r : read_csv(folder / "strong" / "satellites.csv")) {
    const Eigen::Matrix3d enu_from_ecef =
        geodesy::enu_from_ecef_rotation(frame.geodetic_from_local(antennas.at(r.at("gps_tow"))));
    directions[{r.at("gps_tow"), r.at("sat")}] =
        frame.ecef_from_local_rotation().transpose() * enu_from_ecef.transpose() *
        geodesy::enu_from_azimuth_elevation(geodesy::radians(parse_double(r.at("azimuth_deg")).value()),
                                            geodesy::radians(parse_double(r.at("elevation_deg")).value()));
    visibilities[r.at("gps_tow") + r.at("sat")] = r.at("visibility");
  }

  const auto records = read_csv(folder / "strong" / "paths.csv");
  std::map<std::string, int> counts;
  std::map<std::string, double> worst_m;
  for (const Record& r : records) {
    const Eigen::Vector3d& a = antennas.at(r.at("gps_tow"));
    const Eigen::Vector3d& s = directions.at({r.at("gps_tow"), r.at("sat")});
    const double excess_m = parse_double(r.at("excess_path_m")).value();
    const std::string kind = r.at("kind") + (r.at("order") == "2" ? " twice" : "");
    ++counts[kind];
    const std::string& visibility = visibilities.at(r.at("gps_tow") + r.at("sat"));
    // Blocked if all of them are too weak to be tracked.
    EXPECT_EQ(r.at("kind") == "direct", visibility.starts_with("LOS") && r.at("path") == "0");
    EXPECT_NE(r.at("loss_db"), "");
    EXPECT_LE(std::abs(parse_double(r.at("phase_deg")).value()), 180);
    EXPECT_EQ(r.at("material") != "", r.at("kind") == "reflected");
    EXPECT_EQ(r.at("far_material") != "", r.at("order") == "2");
    EXPECT_EQ(r.at("reflector") != "", r.at("kind") != "direct");
    if (r.at("kind") == "direct") {
      EXPECT_EQ(excess_m, 0);
      EXPECT_EQ(r.at("loss_db") + r.at("phase_deg"), "0.000.0");
      EXPECT_EQ(r.at("point_up_m"), "");
      continue;
    }
    const Eigen::Vector3d p = point(r, "point");
    Eigen::Vector3d first = p;
    double travelled_m = (p - a).norm();
    if (r.at("order") == "2") {
      first = point(r, "far_point");
      travelled_m += (first - p).norm();
    } else {
      EXPECT_EQ(r.at("far_point_up_m"), "");
    }
    const double apart = std::abs(travelled_m - s.dot(first - a) - excess_m);
    worst_m[kind] = std::max(worst_m[kind], apart);
  }
  for (const auto& [kind, count] : counts) {
    std::cout << count << ' ' << kind << " paths, detours rebuilt within " << worst_m[kind] << " m\n";
  }
  for (const char* kind : {"direct", "reflected", "reflected twice", "diffracted", "diffuse"}) {
    EXPECT_GT(counts[kind], 20) << kind;
  }
  // Points are written to millimetres, directions to 1e-6 deg.
  for (const char* kind : {"reflected", "reflected twice", "diffracted"})
    EXPECT_LT(worst_m[kind], 1e-3) << kind;
  // One point represents a class of excess paths (PropagationOptions: 10 m wide).
  EXPECT_LT(worst_m["diffuse"], 10);
  const auto bytes = std::filesystem::file_size(folder / "strong" / "paths.csv");
  std::cout << bytes / records.size() << " bytes a row\n";

  // Without strength, and only of the system tracked by the receiver.
  std::vector<Record> galileo;
  for (Record r : records) {
    r["loss_db"] = r["phase_deg"] = "";
    if (r.at("sat")[0] == 'E') galileo.push_back(std::move(r));
  }
  EXPECT_EQ(read_csv(folder / "plain" / "paths.csv"), galileo);
}

}  // namespace
}  // namespace canyon
