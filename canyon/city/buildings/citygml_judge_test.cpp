#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/city/buildings/sources/city_files.hpp"
#include "tests/support/citygml_text.hpp"
#include "tests/support/program.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using test::citygml;
using test::citygml_member;
using test::gml_building;
using test::gml_house;
using ::testing::Contains;
using ::testing::HasSubstr;

// The real file's values from an independent reading, with Python's xml.etree (its undeclared prefix "energy"
// renamed): of each Building the polygons below lod2MultiSurface and their lowest and highest coordinate.
TEST(CityGmlJudge, PlateauTileAsAnotherReadingHasIt) {
  CANYON_SHARED_DATA(path, "citygml-plateau/53392642_bldg_6697_op2.gml");
  struct Expected {
    const char* id;
    std::size_t polygons;
    double lowest_m, highest_m, volume_m3;
  };
  const Expected expected[] = {
      {"BLD_0772bfd9", 17, 3.292, 5.364, 100.90},      {"BLD_18b21c65", 11, 3.239, 7.935, 4962.93},
      {"BLD_365251b8", 10, 2.610, 5.846, 1232.48},     {"BLD_8a3e0e2c", 11, 2.937, 6.773, 393.97},
      {"BLD_93fce453", 6, 2.982, 6.088, 1289.68},      {"BLD_abe3af3a", 80, 3.445, 12.619, 97143.91},
      {"BLD_ae7f1207", 328, 3.647, 19.661, 252005.85}, {"BLD_d818b853", 77, 3.619, 15.086, 35488.62}};
  CityReadOptions options;
  options.heights.geoid_undulation_m = 0;
  const MapData data = read_city_files({path}, options);
  ASSERT_EQ(data.features.size(), std::size(expected));
  for (std::size_t i = 0; i < std::size(expected); ++i) {
    const MapFeature& feature = data.features[i];
    EXPECT_EQ(feature.id.substr(0, 12), expected[i].id);
    EXPECT_EQ(feature.surfaces.size(), expected[i].polygons) << feature.id;
    double lowest = 1e9, highest = -1e9;
    for (const MapSurface& surface : feature.surfaces) {
      for (const Eigen::Vector3d& p : surface.outer) {
        lowest = std::min(lowest, p.z());
        highest = std::max(highest, p.z());
      }
    }
    EXPECT_NEAR(lowest, expected[i].lowest_m, 6e-4) << feature.id;
    EXPECT_NEAR(highest, expected[i].highest_m, 6e-4) << feature.id;
  }
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("8 Building LoD 2")));
  const BuiltCity built = build_city(data, nullptr, {});
  const city::Mesh& mesh = built.city.mesh;
  for (std::size_t i = 0; i < std::size(expected); ++i) {
    const city::Object& object = mesh.objects.at(built.features.at(i).first_object);
    double six = 0;
    for (std::size_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      six += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c]));
    }
    EXPECT_NEAR(six / 6, expected[i].volume_m3, 1e-3 * expected[i].volume_m3 + 0.5) << object.name;
  }
  options.model.lod = 1;
  EXPECT_THAT(read_city_files({path}, options).notes.lines(), Contains(HasSubstr("8 Building LoD 1")));
}

// Ten corners of German houses to 1 cm by cs2cs (proj-bin), which has east first here.
TEST(CityGmlJudge, Cs2csAgrees) {
  CANYON_NEEDS_PROGRAM("cs2cs");
  const test::TemporaryFolder folder;
  for (int i = 0; i < 10; ++i) {
    const double e = 390000 + 1234.5 * i, n = 5812000 + 987.6 * i;
    std::ofstream(folder / "a.gml") << citygml(citygml_member(gml_building("a", gml_house(e, n, 35))),
                                               "urn:adv:crs:ETRS89_UTM33");
    const MapData data = read_city_files({folder / "a.gml"});
    const auto checked =
        test::run_program(fmt::format("echo '{:.3f} {:.3f}' | cs2cs -f %.10f EPSG:25833 EPSG:4326", e, n));
    ASSERT_EQ(checked.status, 0);
    std::istringstream words(checked.output);
    double latitude = 0, longitude = 0;
    ASSERT_TRUE(words >> latitude >> longitude) << checked.output;
    const Eigen::Vector3d corner = data.features.at(0).surfaces.at(0).outer.at(0);
    EXPECT_NEAR(corner.x(), longitude, 1e-7);  // 7 mm
    EXPECT_NEAR(corner.y(), latitude, 9e-8);   // 1 cm
  }
}

}  // namespace
}  // namespace canyon::buildings
