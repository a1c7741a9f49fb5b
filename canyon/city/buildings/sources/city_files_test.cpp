#include "canyon/city/buildings/sources/city_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>

#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"
#include "tests/support/citygml_text.hpp"
#include "tests/support/cityjson_house.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using test::citygml;
using test::citygml_member;
using test::gml_building;
using test::gml_house;
using ::testing::Contains;
using ::testing::HasSubstr;

class CityFilesTest : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  std::string tile(const std::string& id, double east, const std::string& srs = "EPSG:25832") const {
    return citygml(citygml_member(gml_building(id, gml_house(east))), srs);
  }
  /// Four tiles below "set", one of them truncated, and a file of another kind.
  void write_set() const {
    write("set/a/one.gml", tile("one", 691000));
    write("set/a/two.xml", tile("two", 691100) + "\n");
    // UTM 33 of the same position is far from it; "one" again; CityJSON.
    write("set/b/three.gml", citygml(citygml_member(gml_building("three", gml_house(244000))) +
                                         citygml_member(gml_building("three", gml_house(244050))),
                                     "EPSG:25833"));
    write("set/b/four.json", test::cityjson(test::cityjson_building("four", test::kHouseSolid)));
    write("set/b/one_more.gml", tile("one", 691000));
    write("set/cut.gml", tile("cut", 691300).substr(0, 3000));
    write("set/readme.xml", "<readme/>");
  }
  void expect_set(const MapData& data) const {
    std::string ids;
    for (const MapFeature& feature : data.features) ids += feature.id + " ";
    EXPECT_EQ(ids, "four one three three two ");
    EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("tile left out: ")));
    EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("cut.gml:")));
    EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("1 objects are in several files")));
    EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("1 other files ignored")));
    EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("EPSG:25833 (ETRS89 / UTM zone 33N) of 1 file")));
  }
  test::TemporaryFolder folder_;
};

TEST_F(CityFilesTest, FolderOfTiles) {
  write_set();
  EXPECT_EQ(model_kind(folder_ / "set"), ModelKind::Folder);
  expect_set(read_city_files({folder_ / "set"}));
}

TEST_F(CityFilesTest, ArchiveOfTiles) {
  CANYON_NEEDS_PROGRAM("python3");
  write_set();
  ASSERT_EQ(
      test::run_program("cd " + folder_.path().string() + " && python3 -m zipfile -c set.zip set").status, 0);
  EXPECT_EQ(model_kind(folder_ / "set.zip"), ModelKind::Archive);
  expect_set(read_city_files({folder_ / "set.zip"}));
  // A folder of archives.
  std::filesystem::create_directories(folder_ / "all");
  std::filesystem::rename(folder_ / "set.zip", folder_ / "all" / "set.zip");
  expect_set(read_city_files({folder_ / "all"}));
}

TEST_F(CityFilesTest, OneFileThatIsCutOffIsAnError) {
  const auto path = write("cut.gml", tile("cut", 691300).substr(0, 3000));
  try {
    (void)read_city_files({path});
    FAIL() << "no InputError";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("cut.gml:"));
    EXPECT_THAT(e.what(), HasSubstr("is cut short"));
  }
  // A folder with only damaged tiles is rejected, too.
  write("bad/a.gml", tile("a", 691000).substr(0, 3000));
  write("bad/b.gml", tile("b", 691000).substr(0, 3000));
  EXPECT_THROW((void)read_city_files({folder_ / "bad"}), InputError);
}

TEST_F(CityFilesTest, TilesOutsideTheBoxAreNotRead) {
  write("t/a.gml", tile("a", 691000));
  std::string far = tile("b", 799000);
  far.replace(far.find("691000 5334000 500"), 18, "799000 5334000 500");
  far.replace(far.find("691010 5334008 509"), 18, "799010 5334008 509");
  write("t/b.gml", far.substr(0, 3000));  // would be an error
  CityReadOptions options;
  options.box = LonLatBox{11.5, 48.1, 11.6, 48.2};
  const MapData data = read_city_files({folder_ / "t"}, options);
  ASSERT_EQ(data.features.size(), 1U);
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("1 outside the box, not read")));
}

TEST_F(CityFilesTest, KindsByContent) {
  const std::string gml = tile("a", 691000);
  EXPECT_EQ(model_kind(write("a.dat", gml)), ModelKind::CityGml);
  EXPECT_EQ(model_kind(write("b.dat", "\xEF\xBB\xBF" + gml)), ModelKind::CityGml);
  EXPECT_EQ(model_kind(write("c.xml", "<!-- <osm> --><CityModel/>")), ModelKind::CityGml);
  EXPECT_EQ(model_kind(write("d.xml", "<osm version=\"0.6\"/>")), ModelKind::None);
  EXPECT_EQ(model_kind(write("e.dat", test::cityjson(test::cityjson_building("h", test::kHouseSolid)))),
            ModelKind::CityJson);
  EXPECT_EQ(model_kind(write("f.json", R"({"version":0.6,"elements":[]})")), ModelKind::None);
  EXPECT_EQ(model_kind(write("g.json", "{}")), ModelKind::CityJson);
  EXPECT_EQ(model_kind(folder_ / "none.gml"), ModelKind::None);
  gzFile out = gzopen((folder_ / "h.bin").c_str(), "wb");
  ASSERT_NE(out, nullptr);
  ASSERT_GT(gzwrite(out, gml.data(), static_cast<unsigned>(gml.size())), 0);
  ASSERT_EQ(gzclose(out), Z_OK);
  EXPECT_EQ(model_kind(folder_ / "h.bin"), ModelKind::CityGml);
  EXPECT_EQ(read_city_files({folder_ / "h.bin"}).features.size(), 1U);
  // A Gazebo model, and a tileset, are not folders of a city model.
  write("model/model.sdf", "<sdf/>");
  write("model/mesh.xml", gml);
  EXPECT_EQ(model_kind(folder_ / "model"), ModelKind::None);
  write("tiles/tileset.json", R"({"asset":{"version":"1.1"}})");
  EXPECT_EQ(model_kind(folder_ / "tiles"), ModelKind::None);
}

}  // namespace
}  // namespace canyon::buildings
