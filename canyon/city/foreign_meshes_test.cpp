// Meshes written by other programs: unspecified or unusual uses of their formats.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "canyon/base/payload.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_file.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::city {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class ForeignMeshes : public ::testing::Test {
 protected:
  City read(const std::string& name, const std::string& bytes) {
    const std::filesystem::path path = folder_.path() / name;
    std::ofstream(path, std::ios::binary) << bytes;
    return read_mesh_city(path, {});
  }
  std::string refusal_of(const std::string& name, const std::string& bytes) {
    return test::refusal([&] { (void)read(name, bytes); });
  }

  test::TemporaryFolder folder_;
};

/// A tetrahedron; `tail` follows the numbers of each vertex.
std::string obj(const std::string& tail) {
  std::string text;
  for (const char* position : {"0 0 0", "9 0 0", "0 9 0", "0 0 9"})
    text += "v " + std::string(position) + tail + "\n";
  return text + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
}

TEST_F(ForeignMeshes, VerticesOfObjWithWeightsAndColours) {
  // Appendix B1: a weight is of rational curves and surfaces, not of faces.
  for (const char* tail : {"", " 1", " 1.0", " 2.0", " 0.5 0.5 0.5", " 255 128 0"}) {
    const City city = read("a.obj", obj(tail));
    EXPECT_EQ(city.mesh.triangles.size(), 4U) << tail;
    EXPECT_EQ(city.bounds().max.x(), 9) << tail;
  }
}

std::string ply(const std::string& comment, const std::string& element, const std::string& faces) {
  return "ply\nformat ascii 1.0\n" + comment +
         "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n" + element +
         "property list uchar int vertex_indices\nend_header\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n" + faces;
}
const std::string kPlyFaces = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";

/// The tetrahedron as binary STL.
std::string stl(const std::string& head, std::uint32_t triangles = 4) {
  std::string bytes = head;
  bytes.resize(80);
  bytes += test::bytes_of<std::uint32_t>({triangles});
  const float corners[4][3] = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {0, 0, 9}};
  const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  for (const auto& face : faces) {
    bytes += test::bytes_of<float>({0, 0, 0});
    for (const int v : face) bytes += test::bytes_of<float>({corners[v][0], corners[v][1], corners[v][2]});
    bytes += std::string(2, '\0');
  }
  return bytes;
}

TEST_F(ForeignMeshes, StripsOfPlyAreRefused) {
  EXPECT_THAT(refusal_of("a.ply", ply("", "element tristrips 1\n", "4 0 1 2 3\n")),
              AllOf(HasSubstr("a.ply:7: has strips of triangles"), HasSubstr("export it with faces")));
}

TEST_F(ForeignMeshes, LengthsAndVersionsOfGlb) {
  const std::string good = test::triangle_glb({0, 0, 0, 9, 0, 0, 0, 9, 0}, {0, 1, 2});
  EXPECT_EQ(read("a.glb", good).mesh.triangles.size(), 1U);
  EXPECT_THAT(refusal_of("a.glb", good.substr(0, good.size() - 4)), HasSubstr("the data end early"));
  std::string other = good;
  other[4] = 1;
  EXPECT_THAT(refusal_of("a.glb", other), HasSubstr("is glTF 1, which is not supported"));
  other = good;
  other[14] = 9;  // in the length of the JSON chunk
  EXPECT_THAT(refusal_of("a.glb", other), HasSubstr("the data end early"));
  EXPECT_THAT(refusal_of("a.gltf", R"({"asset": {"version": "1.0"}})"),
              HasSubstr("is glTF '1.0', which is not supported"));
  EXPECT_THAT(refusal_of("a.gltf", R"({"asset": {"version": "2.0", "minVersion": "2.1"}})"),
              HasSubstr("is glTF '2.1', which is not supported"));
}

// glTF 2.0, 5.25: a matrix excludes other transforms and is affine. Rotations are normalised quaternions.
TEST_F(ForeignMeshes, TransformsOfGltf) {
  const auto with = [](const std::string& node) {
    return test::box_glb(10, 20, 30, ",\"name\":\"n\"" + node);
  };
  const auto expect_size = [&](const std::string& node, const Eigen::Vector3d& size) {
    const City city = read("a.glb", with(node));
    EXPECT_LT((city.bounds().max - city.bounds().min - size).norm(), 1e-5) << node;
  };
  // A quarter turn about glTF's y, which is up.
  for (const char* rotation : {"0,0.70710678,0,0.70710678", "0,0.707,0,0.707", "0,1,0,1"})
    expect_size(",\"rotation\":[" + std::string(rotation) + "]", {20, 10, 30});
  expect_size(R"(,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1])", {10, 20, 30});
  EXPECT_THAT(refusal_of("a.glb", with(R"(,"rotation":[0,0,0,0])")), HasSubstr("rotation is zero"));
  EXPECT_THAT(refusal_of("a.glb", with(R"(,"rotation":[0,0,1])")),
              HasSubstr("a.glb: 'rotation' is not a list of 4 numbers"));
  EXPECT_THAT(refusal_of("a.glb", with(R"(,"scale":[2,2])")),
              HasSubstr("'scale' is not a list of 3 numbers"));
  const std::string identity = R"(,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1])";
  for (const char* part : {R"(,"translation":[1,0,0])", R"(,"rotation":[0,0,0,1])", R"(,"scale":[2,2,2])"})
    EXPECT_THAT(refusal_of("a.glb", with(identity + part)), HasSubstr("both a matrix and a translation"))
        << part;
  EXPECT_THAT(refusal_of("a.glb", with(R"(,"matrix":[1,0,0,0.1,0,1,0,0,0,0,1,0,0,0,0,1])")),
              HasSubstr("'matrix' is not an affine matrix"));
}

TEST_F(ForeignMeshes, InstancesOfGltfStandAtTheirPlaces) {
  const std::string positions = test::bytes_of<float>({0, 0, 0, 50, 0, 0});
  const City city = read(
      "a.gltf",
      fmt::format(
          R"({{"asset":{{"version":"2.0"}},"extensionsRequired":["EXT_mesh_gpu_instancing"],"scene":0,"scenes":[{{"nodes":[0]}}],)"
          R"("nodes":[{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":1}}}}}}}}],)"
          R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],)"
          R"("buffers":[{{"byteLength":60,"uri":"data:application/octet-stream;base64,{}"}}],)"
          R"("bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}}],"accessors":[)"
          R"({{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},)"
          R"({{"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"}}]}})",
          base64(test::bytes_of<float>({0, 0, 0, 9, 0, 0, 0, 9, 0}) + positions)));
  EXPECT_EQ(city.mesh.triangles.size(), 2U);
  EXPECT_EQ(city.bounds().max.x(), 59);
}

TEST_F(ForeignMeshes, FortransExponentsAreRead) {
  const auto with = [](std::string text, const std::string& number, const std::string& to) {
    return text.replace(text.find(number), number.size(), to);
  };
  const std::string points = ply("", "element face 4\n", kPlyFaces);
  const std::string facet =
      "solid house\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 9 0 0\n"
      "   vertex 0 9 0\n  endloop\n endfacet\nendsolid house\n";
  for (const char* nine : {"9 0 0", "0.9E1 0 0", "0.9D1 0 0"}) {
    EXPECT_EQ(read("a.obj", with(obj(""), "9 0 0", nine)).bounds().max.x(), 9);
    EXPECT_EQ(read("a.ply", with(points, "9 0 0", nine)).bounds().max.x(), 9);
    EXPECT_EQ(read("a.stl", with(facet, "9 0 0", nine)).bounds().max.x(), 9);
  }
}

TEST_F(ForeignMeshes, LinesOfObjThatAreNotRead) {
  const City city = read("a.obj", "curv 0 1 1 2\nvn 0 0 1\ns off\n<html>\n" + obj(""));
  EXPECT_EQ(city.mesh.triangles.size(), 4U);
  EXPECT_THAT(city.notes.lines(),
              Contains(HasSubstr("2 lines are of an unsupported kind (line 1: 'curv 0 1 1 2')")));
}

// 20 x 10 with two holes of 2 x 2 in a row, and a spur: 192 m2.
TEST_F(ForeignMeshes, FacesThatGoToTheirHolesAndBack) {
  const City city = read("a.obj",
                         "v 0 0 0\nv 20 0 0\nv 20 10 0\nv 0 10 0\nv 4 4 0\nv 4 6 0\nv 6 6 0\nv 6 4 0\n"
                         "v 12 4 0\nv 12 6 0\nv 14 6 0\nv 14 4 0\nv 18 8 0\n"
                         "f 1 2 3 13 3 4 1 5 6 7 8 9 10 11 12 9 8 5\n");
  double area = 0;
  for (const auto& [a, b, c] : city.mesh.triangles) {
    const auto& v = city.mesh.vertices;
    area += (v[b] - v[a]).cross(v[c] - v[a]).z() / 2;
  }
  EXPECT_NEAR(area, 192, 1e-9);
  EXPECT_THAT(city.notes.lines(), Not(Contains(HasSubstr("cross themselves"))));
}

TEST_F(ForeignMeshes, FacesThatCrossThemselvesAreCounted) {  // a star of five points
  const City city = read("a.obj", "v 10 0 0\nv -8 6 0\nv 3 -9 0\nv 3 9 0\nv -8 -6 0\nf 1 2 3 4 5\n");
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("1 faces cross themselves")));
}

TEST_F(ForeignMeshes, DataBeyondWhatThePlyHeaderCounts) {
  const auto note = Contains(HasSubstr("counted in the header"));
  const std::string whole = ply("", "element face 4\n", kPlyFaces);
  EXPECT_THAT(read("a.ply", whole + "\n \n").notes.lines(), Not(note));
  const City more = read("a.ply", whole + "3 0 1 2\n\n3 0 1 3\n");
  EXPECT_EQ(more.mesh.triangles.size(), 4U);
  EXPECT_THAT(more.notes.lines(), Contains(HasSubstr("17 bytes follow the data counted in the header")));
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n" +
      test::bytes_of<float>({0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9});
  const auto face = [](int a, int b, int c) { return "\3" + test::bytes_of<std::int32_t>({a, b, c}); };
  binary += face(0, 2, 1) + face(0, 1, 3) + face(1, 2, 3) + face(2, 0, 3);
  EXPECT_THAT(read("a.ply", binary).notes.lines(), Not(note));
  EXPECT_THAT(read("a.ply", binary + "\n").notes.lines(), Not(note));
  EXPECT_THAT(read("a.ply", binary + face(0, 1, 2)).notes.lines(),
              Contains(HasSubstr("13 bytes follow the data counted in the header")));
}

TEST_F(ForeignMeshes, BinaryStlOfAnotherSizeThanItSays) {
  for (const char* head : {"made by a program", "solid made by a program"}) {
    EXPECT_EQ(read("a.stl", stl(head)).mesh.triangles.size(), 4U) << head;
    EXPECT_THAT(refusal_of("a.stl", stl(head, 3)),
                HasSubstr("whose size does not match its number of triangles"))
        << head;
  }
}

TEST_F(ForeignMeshes, AsciiStlInCapitals) {
  EXPECT_EQ(read("a.stl",
                 "SOLID house\n FACET NORMAL 0 0 1\n  OUTER LOOP\n   VERTEX 0 0 0\n"
                 "   VERTEX 9 0 0\n   VERTEX 0 9 0\n  ENDLOOP\n ENDFACET\nENDSOLID house\n")
                .mesh.triangles.size(),
            1U);
}

// glTF 2.0, 3.5.1: a library of entities. A house of 10 x 10 x 20 m.
TEST_F(ForeignMeshes, GltfWithoutSceneIsReadWhole) {
  const City city = read_mesh_city(test::case_file("gltf-no-scene/library.gltf"), {});
  EXPECT_EQ(city.mesh.triangles.size(), 12U);
  EXPECT_LT((city.bounds().max - city.bounds().min - Eigen::Vector3d(10, 10, 20)).norm(), 1e-6);
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("has no scene; all its nodes are read")));
  // Children are placed by their parents, once.
  std::string text = test::read_bytes(test::case_file("gltf-no-scene/library.gltf"));
  text.replace(text.find("\"nodes\": ["), 10,
               "\"nodes\": [{\"children\": [1], \"translation\": [0, 5, 0]}, ");
  const City moved = read("a.gltf", text);
  EXPECT_EQ(moved.mesh.triangles.size(), 12U);
  EXPECT_NEAR(moved.bounds().min.z(), 5, 1e-6);
  // A scene without nodes is a scene.
  text.replace(1, 0, "\"scenes\": [{}], ");
  EXPECT_THAT(refusal_of("b.gltf", text),
              HasSubstr("has no triangle that is read; 1 meshes are not in the scene and left out"));
}

TEST_F(ForeignMeshes, GltfNamesOnlyFilesOfItsFolder) {
  const auto naming = [](const std::string& uri) {
    return fmt::format(
        R"({{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":)"
        R"([{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"buffers":[{{"byteLength":36,"uri":"{}"}}],)"
        R"("bufferViews":[{{"buffer":0,"byteLength":36}}],)"
        R"("accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}]}})",
        uri);
  };
  const std::string triangle = test::bytes_of<float>({0, 0, 0, 9, 0, 0, 0, 9, 0});
  std::filesystem::create_directories(folder_ / "in/sub");
  for (const char* name : {"out.bin", "in/a b.bin", "in/sub/a.bin"})
    std::ofstream(folder_ / name, std::ios::binary) << triangle;
  std::filesystem::create_symlink(folder_ / "out.bin", folder_ / "in/link.bin");
  for (const char* uri : {"a%20b.bin", "sub/a.bin", "sub/../a b.bin"})
    EXPECT_EQ(read("in/a.gltf", naming(uri)).mesh.triangles.size(), 1U) << uri;
  const std::string outside = (folder_ / "out.bin").string();
  for (const std::string& uri : {std::string("../out.bin"), std::string("%2e%2e/out.bin"), outside,
                                 "file://" + outside, std::string("link.bin")})
    EXPECT_THAT(refusal_of("in/a.gltf", naming(uri)), HasSubstr("is outside the folder of this file")) << uri;
}

TEST_F(ForeignMeshes, PointsAndLinesAreNoCity) {
  for (const std::string& text :
       {std::string("v 0 0 0\nv 9 0 0\np 1 2\n"), std::string("v 0 0 0\nv 9 0 0\nl 1 2\n")})
    EXPECT_THAT(refusal_of("a.obj", text), HasSubstr("has no triangle, only points or lines"));
}

}  // namespace
}  // namespace canyon::city
