#include "canyon/city/tiles/read_tiles.hpp"

#include <cpl_vsi.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/tiles/tile_selection.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::tiles {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(48.2, 11.5, 560);

/// A folder with a tileset and its files.
class TilesTest : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& bytes) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    write_file(folder_ / name, bytes);
  }
  [[nodiscard]] TileOptions options(const std::string& name = "tileset.json") const {
    TileOptions out;
    out.file = folder_ / name;
    return out;
  }
  [[nodiscard]] TilesCity read(const TileOptions& options) const { return read_tiles(options, kPosition); }
  [[nodiscard]] TilesCity read() const { return read(options()); }
  [[nodiscard]] std::string refusal(const TileOptions& options) const {
    return test::refusal([&] { (void)read_tiles(options, kPosition); });
  }

  test::TemporaryFolder folder_;
};

constexpr const char* kVolume = R"("boundingVolume":{"box":[0,0,0,50,0,0,0,50,0,0,0,50]})";

std::string tile(const std::string& uri, double error, const std::string& more = {}) {
  return fmt::format(R"({},"geometricError":{},"content":{{"uri":"{}"}}{})", kVolume, error, uri, more);
}

/// A coarse box of 10 m, and two fine ones of 4 m.
std::string levels(const std::string& refine) {
  return test::tileset(tile("coarse.glb", 20,
                            fmt::format(R"(,"refine":"{}","children":[{{{}}},{{{}}}])", refine,
                                        tile("a.glb", 0), tile("b.glb", 0))));
}

class LevelsTest : public TilesTest {
 protected:
  LevelsTest() {
    write("coarse.glb", test::box_glb(10, 10, 10));
    write("a.glb", test::box_glb(4, 4, 4));
    write("b.glb", test::box_glb(4, 4, 7, R"(,"translation":[20,0,0])"));
  }
};

TEST_F(LevelsTest, AMatrixBesideATranslationIsAGap) {
  write("tileset.json", levels("REPLACE"));
  write("b.glb", test::box_glb(4, 4, 7, R"(,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"scale":[1,1,1])"));
  EXPECT_THAT(read().city.notes.warnings(), Contains(HasSubstr("both a matrix and a translation")));
}

TEST_F(LevelsTest, ReplaceTakesTheCoarsestThatIsFineEnough) {
  write("tileset.json", levels("REPLACE"));
  EXPECT_EQ(read().tiles, 2U);
  EXPECT_DOUBLE_EQ(read().city.bounds().max.z(), 7);
  TileOptions rough = options();
  rough.error_m = 20;
  EXPECT_EQ(read(rough).tiles, 1U);
  EXPECT_DOUBLE_EQ(read(rough).city.bounds().max.z(), 10);
}

TEST_F(LevelsTest, AddKeepsWhatIsAbove) {
  write("tileset.json", levels("ADD"));
  EXPECT_EQ(read().tiles, 3U);
  TileOptions rough = options();
  rough.error_m = 20;
  EXPECT_EQ(read(rough).tiles, 1U);
}

TEST_F(LevelsTest, MissingAndBrokenTilesAreGaps) {
  write("tileset.json", levels("REPLACE"));
  std::filesystem::remove(folder_ / "a.glb");
  const TilesCity city = read();
  EXPECT_EQ(city.tiles, 1U);
  EXPECT_EQ(city.gaps, 1U);
  EXPECT_THAT(city.city.notes.warnings(), Contains(AllOf(HasSubstr("a.glb"), HasSubstr("no such file"))));
  EXPECT_THAT(city.city.notes.lines(), Contains(HasSubstr("a.glb")));
  const std::string whole = test::box_glb(4, 4, 4);
  for (const std::size_t cut : {0U, 3U, 11U, 40U, 200U, 500U}) {
    write("a.glb", whole.substr(0, cut));
    EXPECT_EQ(read().gaps, 1U) << cut;
  }
  write("b.glb", "");
  EXPECT_THAT(refusal(options()), HasSubstr("no tile can be read"));
}

TEST_F(LevelsTest, CoordinatesThatAreNotPlacesAreGaps) {
  write("tileset.json", levels("REPLACE"));
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e9F}) {
    write("a.glb", test::triangle_glb({0, 0, 0, bad, 0, 0, 0, 1, 0}, {0, 1, 2}));
    const TilesCity city = read();
    EXPECT_EQ(city.gaps, 1U);
    EXPECT_THAT(city.city.notes.warnings(),
                Contains(HasSubstr(bad > 1e8 && bad < 1e10 ? "km from" : "not finite")));
  }
}

TEST_F(LevelsTest, TooManyTilesAreRefused) {
  write("tileset.json", levels("REPLACE"));
  TileOptions few = options();
  few.max_tiles = 1;
  EXPECT_THAT(refusal(few), AllOf(HasSubstr("more than 1 tiles"), HasSubstr("bbox")));
}

// 507 bytes that needed 17 minutes and 2.9 GB.
TEST_F(TilesTest, FewBytesDoNotMakeManyTiles) {
  const auto subtree = [](int contents) {
    return fmt::format(
        R"(data:application/json,{{\"tileAvailability\":{{\"constant\":1}},)"
        R"(\"contentAvailability\":[{{\"constant\":{}}}],\"childSubtreeAvailability\":{{\"constant\":1}}}})",
        contents);
  };
  const auto implicit = [&](const char* scheme, int levels, const std::string& subtrees,
                            const std::string& content) {
    return test::tileset(fmt::format(
        R"({},"geometricError":9,"content":{{"uri":"{}"}},"implicitTiling":{{"subdivisionScheme":"{}",)"
        R"("subtreeLevels":{},"availableLevels":31,"subtrees":{{"uri":"{}"}}}})",
        kVolume, content, scheme, levels, subtrees));
  };
  const auto begin = std::chrono::steady_clock::now();
  TileOptions few = options();
  few.max_tiles = 10;
  for (const char* scheme : {"QUADTREE", "OCTREE"}) {
    for (const std::string& subtrees : {subtree(0), subtree(1), std::string("none"), std::string("file:x")}) {
      for (const char* content : {"a.glb", "b.json", "file:x"}) {
        write("tileset.json", implicit(scheme, 1, subtrees, content));
        EXPECT_NE(refusal(few), "") << scheme << subtrees << content;
      }
    }
  }
  write("tileset.json", implicit("OCTREE", 15, subtree(0), "a.glb"));
  EXPECT_THAT(refusal(options()), HasSubstr("more than 21000 tilesets"));
  // An address that grows with each tile.
  std::string longest;
  for (int i = 0; i < 20'000; ++i) longest += "{level}";
  write("tileset.json", implicit("OCTREE", 1, longest, "a.glb"));
  EXPECT_THAT(refusal(options()), HasSubstr("characters"));
  // Each tileset names the next one three times.
  std::string three;
  for (int i = 0; i < 20; ++i) {
    const std::string next = tile(fmt::format("{}.json", i + 1), 9);
    write(i == 0 ? "tileset.json" : fmt::format("{}.json", i),
          test::tileset(
              fmt::format(R"({},"geometricError":99,"refine":"ADD","children":[{{{}}},{{{}}},{{{}}}])",
                          kVolume, next, next, next)));
  }
  EXPECT_THAT(refusal(options()), HasSubstr("more than 21000 tilesets"));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_LT(took.count(), 200);
}

TEST_F(TilesTest, TransformsThatGrowBeyondNumbersAreGaps) {
  std::string nested = tile("a.glb", 0);
  for (int i = 0; i < 3; ++i) {
    nested = fmt::format(
        R"({},"geometricError":9,"refine":"ADD","transform":[1e200,0,0,0,0,1e200,0,0,0,0,1e200,0,0,0,0,1],)"
        R"("children":[{{{}}}])",
        kVolume, nested);
  }
  write("a.glb", test::box_glb(1, 1, 1));
  write("tileset.json",
        test::tileset(fmt::format(R"({},"geometricError":99,"refine":"ADD","children":[{{{}}},{{{}}}])",
                                  kVolume, nested, tile("a.glb", 0))));
  const TilesCity city = read();
  EXPECT_EQ(city.tiles, 1U);
  EXPECT_THAT(city.city.notes.warnings(), Contains(HasSubstr("no number")));
}

TEST_F(TilesTest, NothingOutsideTheFolderIsRead) {
  write("inner/a.glb", test::box_glb(1, 1, 1));
  write("secret.glb", test::box_glb(2, 2, 2));
  const std::string outside = (folder_ / "secret.glb").string();
  for (const std::string& uri :
       {std::string("../secret.glb"), std::string("%2e%2e/secret.glb"), outside, "file://" + outside,
        std::string("x/../../secret.glb"), std::string("http://127.0.0.1:9/secret.glb")}) {
    write("inner/tileset.json",
          test::tileset(fmt::format(
              R"({},"geometricError":9,"refine":"ADD","content":{{"uri":"a.glb"}},"children":[{{{}}}])",
              kVolume, tile(uri, 0))));
    const TilesCity city = read(options("inner/tileset.json"));
    EXPECT_EQ(city.tiles, 1U) << uri;
    EXPECT_EQ(city.gaps, 1U) << uri;
    EXPECT_DOUBLE_EQ(city.city.bounds().max.z(), 1) << uri;
  }
  std::filesystem::create_symlink(folder_ / "secret.glb", folder_ / "inner/link.glb");
  write("inner/tileset.json", test::tileset(tile("link.glb", 0)));
  EXPECT_THAT(refusal(options("inner/tileset.json")), HasSubstr("outside the tileset's folder"));
  TileOptions trusted = options("inner/tileset.json");
  trusted.allow_external = true;
  EXPECT_EQ(read(trusted).tiles, 1U);
}

TEST_F(TilesTest, TilesetsThatReferToThemselvesAreGaps) {
  write("a.glb", test::box_glb(1, 1, 1));
  const std::string children = R"(,"refine":"ADD","children":[{)" + tile("other.json", 0) + "}]";
  write("tileset.json", test::tileset(tile("a.glb", 9, children)));
  write("other.json", test::tileset(tile("./tileset.json", 0)));
  const TilesCity city = read();
  EXPECT_EQ(city.tiles, 1U);
  EXPECT_THAT(city.city.notes.warnings(), Contains(HasSubstr("refers to itself")));
}

/// A zip archive written by GDAL.
void write_archive(const std::filesystem::path& path,
                   const std::vector<std::pair<std::string, std::string>>& files) {
  // Open while its files are written; otherwise each would rewrite the archive.
  const std::string root = "/vsizip/{" + path.string() + "}";
  VSILFILE* archive = VSIFOpenL(root.c_str(), "wb");
  ASSERT_NE(archive, nullptr);
  for (const auto& [name, bytes] : files) {
    VSILFILE* file = VSIFOpenL((root + "/" + name).c_str(), "wb");
    ASSERT_NE(file, nullptr);
    ASSERT_EQ(VSIFWriteL(bytes.data(), 1, bytes.size(), file), bytes.size());
    VSIFCloseL(file);
  }
  VSIFCloseL(archive);
}

// The index of a .3tz is ignored; addresses are within the archive, and messages name it.
TEST_F(TilesTest, ArchivesAreRead) {
  const std::string root = test::tileset(tile("t/a.glb", 9,
                                              fmt::format(R"(,"refine":"ADD","children":[{{{}}},{{{}}}])",
                                                          tile("../outside.glb", 0), tile("none.glb", 0))));
  write("outside.glb", test::box_glb(1, 1, 1));
  const std::filesystem::path zip = folder_ / "town.zip", archive = folder_ / "town.3tz";
  write_archive(zip,
                {{"tileset.json", root}, {"t/a.glb", test::box_glb(10, 10, 10)}, {"@3dtilesIndex1@", "0"}});
  std::filesystem::rename(zip, archive);
  const TilesCity city = read(options("town.3tz"));
  EXPECT_EQ(city.city.name, "town");
  EXPECT_EQ(city.tiles, 1U);
  EXPECT_EQ(city.city.mesh.triangles.size(), 12U);
  EXPECT_THAT(city.city.notes.warnings(),
              Contains(HasSubstr("'../outside.glb' is outside the tileset's folder")));
  EXPECT_THAT(city.city.notes.warnings(), Contains(HasSubstr("town.3tz/none.glb: is not in the archive")));
  EXPECT_TRUE(is_tileset(archive));
  write("town.3tz", "PK");
  EXPECT_THAT(refusal(options("town.3tz")),
              AllOf(HasSubstr("town.3tz/tileset.json"), HasSubstr("is the archive complete?")));
  EXPECT_THAT(refusal(options("absent.3tz")), HasSubstr("no such file"));
}

TEST_F(TilesTest, OuterTilesetsHaveTransformsOfBoth) {
  write("sub/b.glb", test::box_glb(1, 1, 1));
  write("tileset.json",
        test::tileset(tile("sub/tileset.json", 5, R"(,"transform":[2,0,0,0,0,2,0,0,0,0,2,0,100,0,0,1])")));
  write("sub/tileset.json",
        test::tileset(tile("b.glb", 0, R"(,"transform":[1,0,0,0,0,1,0,0,0,0,1,0,7,0,0,1])")));
  const city::Box box = read().city.bounds();
  EXPECT_DOUBLE_EQ(box.min.x(), 114);
  EXPECT_DOUBLE_EQ(box.max.x(), 116);
  EXPECT_DOUBLE_EQ(box.max.z(), 2);
}

TEST_F(TilesTest, WrongFilesAreRefusedWithACure) {
  EXPECT_THAT(refusal(options()), HasSubstr("no such file"));
  write("tileset.json", "{");
  EXPECT_THAT(refusal(options()), HasSubstr("not valid JSON"));
  write("tileset.json", "{\"a\": 1}");
  EXPECT_THAT(refusal(options()), HasSubstr("has no root"));
  write("tileset.json", test::tileset(tile("a.glb", 0), "2.0"));
  EXPECT_THAT(refusal(options()), HasSubstr("version '2.0'"));
  write("tileset.json", test::tileset(R"("geometricError":0,"boundingVolume":{"box":[1,2]})"));
  EXPECT_THAT(refusal(options()), HasSubstr("'box' is not a list of 12 numbers"));
  write("tileset.json",
        test::tileset(R"("geometricError":0,"boundingVolume":{"region":[11.4,48.1,11.6,48.3,500,600]})"));
  EXPECT_THAT(refusal(options()), AllOf(HasSubstr("north 48.3 rad"), HasSubstr("latitudes within 1.57 rad")));
  write("tileset.json", test::tileset(std::string(kVolume) + R"(,"geometricError":0)"));
  EXPECT_THAT(refusal(options()), HasSubstr("no tile of it has content"));
  write("tileset.json", test::tileset(tile("a.glb", 0, R"(,"transform":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,0])")));
  EXPECT_THAT(refusal(options()), HasSubstr("affine"));
  write("tileset.json",
        R"({"asset":{"version":"1.1"},"extensionsRequired":["3DTILES_magic"],"root":{"geometricError":0}})");
  EXPECT_THAT(refusal(options()), HasSubstr("3DTILES_magic"));
}

TEST_F(TilesTest, DeepTreesEnd) {
  std::string root = tile("a.glb", 0);
  for (int i = 0; i < 300; ++i)
    root = fmt::format(R"({},"geometricError":9,"children":[{{{}}}])", kVolume, root);
  write("a.glb", test::box_glb(1, 1, 1));
  write("tileset.json", test::tileset(root));
  EXPECT_THAT(refusal(options()), HasSubstr("nested deeper"));
}

TEST_F(TilesTest, ALocalTilesetNeedsAnOrigin) {
  write("a.glb", test::box_glb(1, 1, 1));
  write("tileset.json", test::tileset(tile("a.glb", 0)));
  const TilesCity city = read_tiles(options(), std::nullopt);
  EXPECT_FALSE(city.georeferenced);
  EXPECT_THAT(city.city.notes.warnings(), ElementsAre(HasSubstr("city.origin")));
  EXPECT_THAT(read().city.notes.warnings(), IsEmpty());
  TileOptions boxed = options();
  boxed.bbox_deg = {11.4, 48.1, 11.6, 48.3};
  EXPECT_THAT(test::refusal([&] { (void)read_tiles(boxed, std::nullopt); }), HasSubstr("city.origin"));
  EXPECT_EQ(read(boxed).tiles, 1U);
  boxed.bbox_deg = {12.4, 48.1, 12.6, 48.3};
  EXPECT_THAT(refusal(boxed), HasSubstr("no tile touches the area"));
}

TEST_F(TilesTest, OnlyTilesOfTheAreaAreRead) {
  const geodesy::LocalFrame frame(kPosition);
  const Eigen::Matrix3d& axes = frame.ecef_from_local_rotation();
  const Eigen::Vector3d zero = frame.ecef_from_local({0, 0, 0});
  const std::string matrix = fmt::format(
      R"("transform":[{},{},{},0,{},{},{},0,{},{},{},0,{},{},{},1],"boundingVolume":{{"sphere":[0,0,0,5000]}})",
      axes(0, 0), axes(1, 0), axes(2, 0), axes(0, 1), axes(1, 1), axes(2, 1), axes(0, 2), axes(1, 2),
      axes(2, 2), zero.x(), zero.y(), zero.z());
  const auto at = [](const char* uri, double east) {
    return fmt::format(
        R"({{"boundingVolume":{{"box":[{},5,5,6,0,0,0,6,0,0,0,6]}},"geometricError":0,"content":{{"uri":"{}"}}}})",
        east + 5, uri);
  };
  write("near.glb", test::box_glb(10, 10, 12));
  write("tileset.json", test::tileset(matrix + R"(,"geometricError":50,"refine":"ADD","children":[)" +
                                      at("near.glb", 0) + "," + at("far.glb", 3000) + "]"));
  TileOptions boxed = options();
  boxed.bbox_deg = {11.499, 48.199, 11.501, 48.201};
  const TilesCity city = read_tiles(boxed, std::nullopt);  // far.glb does not exist and is not needed
  EXPECT_EQ(city.tiles, 1U);
  EXPECT_EQ(city.gaps, 0U);
  EXPECT_TRUE(city.georeferenced);
  // The lowest 5 % of the vertices are on the ground, at 560 m.
  EXPECT_NEAR(city.city.frame.origin().height_m, 560, 0.06);
  EXPECT_NEAR(city.city.frame.origin().latitude_rad, geodesy::radians(48.2), 1e-6);
  EXPECT_NEAR(city.city.bounds().max.z(), 12, 0.06);
  const TilesCity about = read_tiles(boxed, kPosition);
  EXPECT_TRUE(about.city.bounds().min.isApprox(Eigen::Vector3d::Zero(), 1e-6) ||
              about.city.bounds().min.norm() < 1e-6);
  EXPECT_TRUE(about.city.bounds().max.isApprox(Eigen::Vector3d(10, 10, 12), 1e-8));
}

TEST_F(TilesTest, NamesAndClassesSaySurfaces) {
  write("a.b3dm",
        test::b3dm(
            test::triangle_glb(
                {0, 0, 0, 9, 0, 0, 0, 9, 0, 20, 0, 0, 29, 0, 0, 20, 9, 0, 40, 0, 0, 49, 0, 0, 40, 0, -9},
                {0, 1, 2, 3, 4, 5, 6, 7, 8}, "", "glass", {0, 0, 0, 1, 1, 1, 2, 2, 2}),
            R"({"BATCH_LENGTH":3})",
            R"({"gml_id":["b1","t7","g"],"class":["Building","SolitaryVegetationObject","TINRelief"]})"));
  write("tileset.json", test::tileset(tile("a.b3dm", 0)));
  const city::Mesh& mesh = read().city.mesh;
  ASSERT_THAT(mesh.objects, SizeIs(3));
  EXPECT_EQ(mesh.objects[0].name, "b1");
  EXPECT_EQ(mesh.objects[0].surface, city::Surface::Building);
  EXPECT_EQ(mesh.objects[1].surface, city::Surface::Foliage);
  EXPECT_EQ(mesh.objects[2].surface, city::Surface::Terrain);
  EXPECT_EQ(mesh.materials[0], city::Material::Glass);
}

TEST_F(TilesTest, ImplicitTilingReadsWhatIsAvailable) {
  // Two levels of a quadtree in one subtree: the root, and its children 1 (east) and 2 (north).
  const std::string root =
      R"("boundingVolume":{"box":[0,0,0,50,0,0,0,50,0,0,0,50]},"geometricError":8,"refine":"REPLACE",)"
      R"("content":{"uri":"c/{level}_{x}_{y}.glb"},"implicitTiling":{"subdivisionScheme":"QUADTREE",)"
      R"("subtreeLevels":2,"availableLevels":2,"subtrees":{"uri":"s/{level}.{x}.{y}.subtree"}})";
  write("tileset.json", test::tileset(root));
  std::string json =
      R"({"buffers":[{"byteLength":1}],"bufferViews":[{"buffer":0,"byteLength":1}],"tileAvailability":{"bitstream":0},)"
      R"("contentAvailability":[{"bitstream":0}],"childSubtreeAvailability":{"constant":0}})";
  while (json.size() % 8 != 0) json += ' ';
  const std::string head =
      "subt" + test::bytes_of<std::uint32_t>({1}) + test::bytes_of<std::uint64_t>({json.size(), 8});
  const std::string bits("\x0D\0\0\0\0\0\0\0", 8);  // nodes 0, 2 and 3
  write("s/0.0.0.subtree", head + json + bits);
  write("c/0_0_0.glb", test::box_glb(1, 1, 1));
  write("c/1_1_0.glb", test::box_glb(1, 1, 2));
  write("c/1_0_1.glb", test::box_glb(1, 1, 3));
  EXPECT_EQ(read().tiles, 2U);
  EXPECT_EQ(read().gaps, 0U);
  TileOptions rough = options();
  rough.error_m = 8;
  EXPECT_DOUBLE_EQ(read(rough).city.bounds().max.z(), 1);
  write("s/0.0.0.subtree", (head + json + bits).substr(0, head.size() + json.size()));
  EXPECT_THAT(refusal(options()), HasSubstr("end early"));
  write("s/0.0.0.subtree", "subt" + test::bytes_of<std::uint32_t>({7, 0, 0, 0, 0}));
  EXPECT_THAT(refusal(options()), HasSubstr("version 7"));
}

TEST(RealTiles, FourTilesOfBuildings) {
  CANYON_SHARED_DATA(path, "3dtiles/1.0/TilesetWithRequestVolume/city/tileset.json");
  TileOptions options;
  options.file = path;
  const TilesCity city = read_tiles(options, std::nullopt);
  // Values from a reading of the files with Python's struct: 4 tiles of 10 buildings, 480 triangles in all;
  // latitudes 40.04106386384 to 40.04432009825, longitudes -75.61440970616 to -75.61001104733, ellipsoidal
  // heights 0.00000154 to 13.99297928 m.
  EXPECT_EQ(city.tiles, 4U);
  EXPECT_EQ(city.gaps, 0U);
  EXPECT_THAT(city.city.mesh.triangles, SizeIs(480));
  EXPECT_THAT(city.city.mesh.objects, SizeIs(40));
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
  for (const Eigen::Vector3d& v : city.city.mesh.vertices) {
    const geodesy::Geodetic position = city.city.frame.geodetic_from_local(v);
    const Eigen::Vector3d at(geodesy::degrees(position.latitude_rad),
                             geodesy::degrees(position.longitude_rad), position.height_m);
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  EXPECT_NEAR(low.x(), 40.04106386384396, 1e-10);
  EXPECT_NEAR(high.x(), 40.04432009825264, 1e-10);
  EXPECT_NEAR(low.y(), -75.6144097061643, 1e-10);
  EXPECT_NEAR(high.y(), -75.61001104732647, 1e-10);
  EXPECT_NEAR(low.z(), 1.541338860988617e-06, 1e-6);
  EXPECT_NEAR(high.z(), 13.992979266680777, 1e-6);
}

TEST(RealTiles, GapsOfAnIncompleteTilesetAreNamed) {
  CANYON_SHARED_DATA(path, "3dtiles/1.0/TilesetWithRequestVolume/tileset.json");
  TileOptions options;
  options.file = path;
  const TilesCity city = read_tiles(options, std::nullopt);
  EXPECT_EQ(city.tiles, 4U);
  EXPECT_THAT(city.city.notes.warnings(), Contains(HasSubstr("building.b3dm")));
  EXPECT_THAT(city.city.notes.warnings(), Contains(HasSubstr("points.pnts")));
}

TEST(RealTiles, SparseImplicitOctree) {
  CANYON_SHARED_DATA(path, "3dtiles/1.1/SparseImplicitOctree/tileset.json");
  TileOptions options;
  options.file = path;
  // By the same reading: 31 contents of 12 triangles that fill the corners of the unit cube; of level 1 one,
  // [0, 0.5]^3. Errors are 32 m / 2^level.
  const TilesCity whole = read_tiles(options, kPosition);
  EXPECT_EQ(whole.tiles, 31U);
  EXPECT_THAT(whole.city.mesh.triangles, SizeIs(372));
  EXPECT_EQ(whole.city.bounds().min, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(whole.city.bounds().max, Eigen::Vector3d(1, 1, 1));
  options.error_m = 16;
  const TilesCity coarse = read_tiles(options, kPosition);
  EXPECT_EQ(coarse.city.bounds().min, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(coarse.gaps, 0U);
}

}  // namespace
}  // namespace canyon::tiles
