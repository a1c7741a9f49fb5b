#include "adapters/ros2/map_projection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <fstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::ros2 {
namespace {

using simulation::RigidPose;
using testing::HasSubstr;

MapProjectorInfo read(const std::string& yaml) {
  const test::TemporaryFolder folder;
  const auto path = folder / "map_projector_info.yaml";
  std::ofstream(path) << yaml;
  return read_map_projector_info(path);
}

std::string refused(const std::string& yaml) {
  try {
    (void)read(yaml);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

Eigen::Vector3d position_of(const MapProjectorInfo& info, const geodesy::LocalFrame& city,
                            const Eigen::Vector3d& map, double geoid_m = 0) {
  return MapProjection(info, city, geoid_m).in_city({map, Eigen::Quaterniond::Identity()}).position_m;
}

// 35.65858 N, 139.74543 E is 86,440.29 m east and 46,805.90 m north of the corner of 54SUE (PROJ: cs2cs
// EPSG:4326 to EPSG:32654).
TEST(MapProjection, PutsTheOriginOfTheCityWhereMgrsHasIt) {
  const geodesy::LocalFrame city(geodesy::Geodetic::from_degrees(35.65858, 139.74543, 40));
  const auto info = read("projector_type: MGRS\nvertical_datum: WGS84\nmgrs_grid: 54SUE\n");
  EXPECT_LT(position_of(info, city, {86440.29, 46805.90, 40}).norm(), 0.01);
  // Heights above the geoid, which is 36.7 m above the ellipsoid here.
  const auto egm = read("projector_type: MGRS\nvertical_datum: EGM2008\nmgrs_grid: 54SUE\n");
  EXPECT_LT(position_of(egm, city, {86440.29, 46805.90, 3.3}, 36.7).norm(), 0.01);
}

// West of the central meridian, 141 E, grid north points west of true north by
// atan(tan(1.25457 deg) sin(35.65858 deg)) = 0.7315 deg; lengths of the grid are 0.9996 (1 + x^2 / (2 R^2))
// = 0.99976 of those on the ground.
TEST(MapProjection, TurnsGridNorthToTrueNorth) {
  const geodesy::LocalFrame city(geodesy::Geodetic::from_degrees(35.65858, 139.74543, 0));
  const auto info = read("projector_type: MGRS\nmgrs_grid: 54SUE\n");
  const MapProjection map(info, city, 0);
  const simulation::RigidPose pose =
      map.in_city({{86440.29, 46805.90 + 1000, 0}, Eigen::Quaterniond::Identity()});
  EXPECT_NEAR(pose.position_m.head<2>().norm(), 1000 / 0.99976, 0.05);
  EXPECT_NEAR(geodesy::degrees(std::atan2(pose.position_m.x(), pose.position_m.y())), -0.7315, 1e-3);
  // A vehicle heading along the grid's east axis has a heading 0.73 deg north of east.
  const Eigen::Vector3d ahead = pose.attitude * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(geodesy::degrees(std::atan2(ahead.y(), ahead.x())), 0.7315, 1e-3);
}

TEST(MapProjection, TakesAnOriginOnTheGridOrInItsTangentialPlane) {
  const geodesy::LocalFrame city(geodesy::Geodetic::from_degrees(35.65858, 139.74543, 0));
  // Autoware uses an altitude of 0 for any value in the file.
  const std::string origin = "map_origin: {latitude: 35.65858, longitude: 139.74543, altitude: 40.0}\n";
  const auto plane = read("projector_type: LocalCartesian\n" + origin);
  EXPECT_LT((position_of(plane, city, {100, -200, 3}) - Eigen::Vector3d(100, -200, 3)).norm(), 1e-6);
  const auto grid = read("projector_type: LocalCartesianUTM\n" + origin);
  EXPECT_LT(position_of(grid, city, {0, 0, 0}).norm(), 1e-6);
  EXPECT_NEAR(position_of(grid, city, {0, 1000, 0}).x(),
              -1000 / 0.99976 * std::sin(0.7315 * 3.14159265 / 180), 0.02);
}

// On the origin's meridian lengths of the grid are the factor times those on the ground, and its north is
// true.
TEST(MapProjection, TakesAGridAboutTheOriginsMeridian) {
  const geodesy::LocalFrame city(geodesy::Geodetic::from_degrees(35.65858, 139.74543, 0));
  const std::string text =
      "projector_type: TransverseMercator\nmap_origin: {latitude: 35.65858, longitude: 139.74543}\n";
  EXPECT_LT(position_of(read(text), city, {0, 0, 0}).norm(), 1e-6);
  EXPECT_NEAR(position_of(read(text), city, {0, 1000, 0}).y(), 1000 / 0.9996, 1e-3);
  EXPECT_NEAR(position_of(read(text), city, {0, 1000, 0}).x(), 0, 1e-6);
  const auto whole = read(text + "scale_factor: 1.0\n");
  EXPECT_NEAR(position_of(whole, city, {1000, 0, 0}).x(), 1000, 1e-3);
}

TEST(MapProjection, SaysWhichFileIsWrong) {
  EXPECT_THAT(refused("vertical_datum: WGS84\n"), HasSubstr("projector_type"));
  EXPECT_THAT(refused("projector_type: Local\n"), HasSubstr("map_projector_info.yaml:1"));
  EXPECT_THAT(refused("projector_type: Local\n"), HasSubstr("'Local' is not supported"));
  EXPECT_THAT(refused("projector_type: MGRS\n"), HasSubstr("mgrs_grid"));
  EXPECT_THAT(refused("projector_type: LocalCartesian\n"), HasSubstr("needs an origin"));
  EXPECT_THAT(refused("projector_type: MGRS\nmgrs_grid: 54SUE\nvertical_datum: NN\n"), HasSubstr("'NN'"));
  const auto unknown = read("projector_type: MGRS\nmgrs_grid: 54XYZ\n");
  EXPECT_THROW(MapProjection(unknown, geodesy::LocalFrame(), 0), InputError);
}

}  // namespace
}  // namespace canyon::adapters::ros2
