// Meshes as other programs write them: what their formats leave unsaid, or say in their own ways.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "canyon/city/city.hpp"
#include "canyon/city/mesh_doubts.hpp"
#include "canyon/city/mesh_file.hpp"
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

/// A tetrahedron; `tail` stands behind the numbers of each vertex.
std::string obj(const std::string& tail) {
  std::string text;
  for (const char* place : {"0 0 0", "9 0 0", "0 9 0", "0 0 9"})
    text += "v " + std::string(place) + tail + "\n";
  return text + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
}

TEST_F(ForeignMeshes, VerticesOfObjWithWeightsAndColours) {
  for (const char* tail : {"", " 1", " 1.0", " 0.5 0.5 0.5", " 255 128 0"})
    EXPECT_EQ(read("a.obj", obj(tail)).mesh.triangles.size(), 4U) << tail;
  EXPECT_THAT(refusal_of("a.obj", obj(" 2.0")),
              AllOf(HasSubstr("a.obj:1: has a vertex with the weight 2.0"), HasSubstr("x, y and z alone")));
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

TEST_F(ForeignMeshes, CommentsThatStateAUnit) {
  for (const char* unit :
       {"File units = millimeters", "Units: Feet", "units = mm", "UNIT=cm", "unit: inch"}) {
    const auto says = Contains(AllOf(HasSubstr(unit), HasSubstr("scale corrects it")));
    EXPECT_THAT(read("a.obj", "# " + std::string(unit) + "\n" + obj("")).notes, says);
    EXPECT_THAT(
        read("a.ply", ply("comment " + std::string(unit) + "\n", "element face 4\n", kPlyFaces)).notes, says);
    EXPECT_THAT(read("a.stl", stl("made by a program, " + std::string(unit))).notes, says);
  }
  for (const char* other : {"units: m", "File units = meters", "made by Unity", "feet of the building"}) {
    const auto says = Contains(HasSubstr("a comment says"));
    EXPECT_THAT(read("a.obj", "# " + std::string(other) + "\n" + obj("")).notes, Not(says)) << other;
    EXPECT_THAT(read("a.stl", stl(other)).notes, Not(says)) << other;
  }
}

TEST_F(ForeignMeshes, StripsOfPlyAreRefused) {
  EXPECT_THAT(refusal_of("a.ply", ply("", "element tristrips 1\n", "4 0 1 2 3\n")),
              AllOf(HasSubstr("a.ply:7: has strips of triangles"), HasSubstr("export it with faces")));
}

TEST_F(ForeignMeshes, LengthsAndVersionsOfGlb) {
  const std::string good = test::triangle_glb({0, 0, 0, 9, 0, 0, 0, 9, 0}, {0, 1, 2});
  EXPECT_EQ(read("a.glb", good).mesh.triangles.size(), 1U);
  EXPECT_THAT(refusal_of("a.glb", good + "more"), HasSubstr("bytes where its header says"));
  EXPECT_THAT(refusal_of("a.glb", good.substr(0, good.size() - 4)), HasSubstr("bytes where its header says"));
  std::string other = good;
  other[4] = 1;
  EXPECT_THAT(refusal_of("a.glb", other), HasSubstr("is glTF of version 1, and 2.0 is read"));
  other = good;
  other[14] = 9;  // of the length of the chunk of JSON
  EXPECT_THAT(refusal_of("a.glb", other), HasSubstr("bytes of JSON of"));
  EXPECT_THAT(refusal_of("a.gltf", R"({"asset": {"version": "1.0"}})"), HasSubstr("is glTF of version 1.0"));
  EXPECT_THAT(refusal_of("a.gltf", R"({"asset": {"version": "2.0", "minVersion": "2.1"}})"),
              HasSubstr("is glTF of version 2.1"));
}

TEST_F(ForeignMeshes, BinaryStlOfAnotherSizeThanItSays) {
  for (const char* head : {"made by a program", "solid made by a program"}) {
    EXPECT_EQ(read("a.stl", stl(head)).mesh.triangles.size(), 4U) << head;
    EXPECT_THAT(refusal_of("a.stl", stl(head, 3)), HasSubstr("whose size is not that of the triangles"))
        << head;
  }
}

TEST_F(ForeignMeshes, AsciiStlInCapitals) {
  EXPECT_THAT(refusal_of("a.stl",
                         "SOLID house\n FACET NORMAL 0 0 1\n  OUTER LOOP\n   VERTEX 0 0 0\n"
                         "   VERTEX 9 0 0\n   VERTEX 0 9 0\n  ENDLOOP\n ENDFACET\nENDSOLID house\n"),
              HasSubstr("is an ASCII STL file in capitals"));
}

TEST_F(ForeignMeshes, PointsAndLinesAreNoCity) {
  for (const std::string& text :
       {std::string("v 0 0 0\nv 9 0 0\np 1 2\n"), std::string("v 0 0 0\nv 9 0 0\nl 1 2\n")})
    EXPECT_THAT(refusal_of("a.obj", text), HasSubstr("holds no triangle, points or lines alone"));
}

TEST_F(ForeignMeshes, ThinObjectsMayBeInDegrees) {
  const City city = read(
      "a.obj", "v 11 48 0\nv 11.0001 48 0\nv 11 48.0001 0\nv 11 48 9\n" + obj("").substr(obj("").find('f')));
  EXPECT_THAT(implausible_objects(city.mesh), Contains(HasSubstr("are x and y degrees?")));
  EXPECT_THAT(implausible_objects(read("a.obj", obj("")).mesh), Not(Contains(HasSubstr("degrees"))));
}

}  // namespace
}  // namespace canyon::city
