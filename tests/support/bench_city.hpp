#pragma once

#include <Eigen/Core>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::bench {

/// A city and points in its streets, antennas 2 m above flat ground.
struct BenchCity {
  city::City city;
  std::vector<Eigen::Vector3d> positions;
};

/// Tsim Sha Tsui and the recorded drive through it (every epoch) if the shared data exist; else the synthetic
/// city and points along its two middle streets.
inline BenchCity bench_city() {
  const std::filesystem::path data = std::filesystem::path(canyon_source_dir) / ".." / "shared" / "data";
  const std::filesystem::path mesh = data / "hongkong/buildings.dae";
  const std::filesystem::path drive = data / "urbannav-tst-20190428/groundTruth_TST.csv";
  BenchCity bench;
  if (!std::filesystem::exists(mesh) || !std::filesystem::exists(drive)) {
    bench.city = city::synthetic_city({});
    for (double along = -250; along <= 250; along += 2) {
      bench.positions.emplace_back(along, 0.3, 2);
      bench.positions.emplace_back(0.3, along, 2);
    }
    return bench;
  }
  city::MeshImportOptions options;
  options.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  options.offset_m = {0, 8, 0};  // registration of the mesh against the drive
  bench.city = city::read_mesh_city(mesh, options);
  TextFile file(drive);
  while (const auto line = file.next_line()) {
    const auto fields = split(*line, ',');
    if (fields.size() < 5) continue;
    const auto latitude = parse_double(fields[2]), longitude = parse_double(fields[3]);
    if (!latitude || !longitude) continue;
    Eigen::Vector3d point =
        bench.city.frame.local_from_geodetic(geodesy::Geodetic::from_degrees(*latitude, *longitude, 0));
    point.z() = 2;  // the terrain of this mesh is flat at 0
    bench.positions.push_back(point);
  }
  return bench;
}

/// Directions spread evenly over the sky between 5 and 85 degrees of elevation (a golden spiral).
inline std::vector<Eigen::Vector3d> spread_sky(int count) {
  std::vector<Eigen::Vector3d> sky;
  const double low = std::sin(geodesy::radians(5)), high = std::sin(geodesy::radians(85));
  for (int i = 0; i < count; ++i) {
    const double elevation = std::asin(low + (high - low) * (i + 0.5) / count);
    sky.push_back(
        geodesy::enu_from_azimuth_elevation(std::fmod(i * 2.39996322972865332, 2 * geodesy::kPi), elevation));
  }
  return sky;
}

}  // namespace canyon::bench
