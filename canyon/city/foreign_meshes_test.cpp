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

// glTF 2.0, 5.25: rotations are unit quaternions; a matrix stands alone and is affine.
TEST_F(ForeignMeshes, TransformsThatGltfDoesNotAllow) {
  const auto with = [](const std::string& node) {
    return test::box_glb(10, 20, 30, ",\"name\":\"n\"" + node);
  };
  const auto size_of = [&](const std::string& node) -> Eigen::Vector3d {
    const City city = read("a.glb", with(node));
    return city.bounds().max - city.bounds().min;
  };
  // A quarter turn about glTF's y, which is up; in three decimals as well.
  EXPECT_LT((size_of(R"(,"rotation":[0,0.70710678,0,0.70710678])") - Eigen::Vector3d(20, 10, 30)).norm(),
            1e-3);
  EXPECT_LT((size_of(R"(,"rotation":[0,0.707,0,0.707])") - Eigen::Vector3d(20, 10, 30)).norm(), 0.05);
  EXPECT_LT((size_of(R"(,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1])") - Eigen::Vector3d(10, 20, 30)).norm(),
            1e-3);
  EXPECT_THAT(
      refusal_of("a.glb", with(R"(,"rotation":[0,1,0,1])")),
      AllOf(HasSubstr("a.glb: node 0 'n' has a rotation that is not a unit quaternion (its length is 1.414)"),
            HasSubstr("export it again")));
  EXPECT_THAT(refusal_of("a.glb", with(R"(,"rotation":[0,0,0,0])")), HasSubstr("not a unit quaternion"));
  EXPECT_THAT(refusal_of("a.glb", with(R"(,"rotation":[0,0,1])")),
              HasSubstr("a rotation that is not 4 numbers"));
  EXPECT_THAT(refusal_of("a.glb", with(R"(,"scale":[2,2])")), HasSubstr("a scale that is not 3 numbers"));
  const std::string identity = R"(,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1])";
  for (const char* part : {R"(,"translation":[1,0,0])", R"(,"rotation":[0,0,0,1])", R"(,"scale":[2,2,2])"})
    EXPECT_THAT(refusal_of("a.glb", with(identity + part)), HasSubstr("a matrix beside a translation"))
        << part;
  EXPECT_THAT(refusal_of("a.glb", with(R"(,"matrix":[1,0,0,0.1,0,1,0,0,0,0,1,0,0,0,0,1])")),
              HasSubstr("a matrix whose last row is not 0 0 0 1"));
}

TEST_F(ForeignMeshes, FortransExponentsAreRefused) {
  const auto refused = [](const char* place) {
    return AllOf(HasSubstr(place), HasSubstr("D1'"), HasSubstr("write its exponent with E"));
  };
  const auto with = [](std::string text, const std::string& number, const std::string& to) {
    return text.replace(text.find(number), number.size(), to);
  };
  EXPECT_EQ(read("a.obj", with(obj(""), "9 0 0", "0.9E1 0 0")).mesh.triangles.size(), 4U);
  EXPECT_THAT(refusal_of("a.obj", with(obj(""), "9 0 0", "0.9D1 0 0")), refused("a.obj:2: '0.9D1'"));
  const std::string points = ply("", "element face 4\n", kPlyFaces);
  EXPECT_THAT(refusal_of("a.ply", with(points, "9 0 0", "0.9D1 0 0")), refused("a.ply:11: '0.9D1'"));
  const std::string facet =
      "solid house\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 9 0 0\n"
      "   vertex 0 9 0\n  endloop\n endfacet\nendsolid house\n";
  EXPECT_EQ(read("a.stl", facet).mesh.triangles.size(), 1U);
  EXPECT_THAT(refusal_of("a.stl", with(facet, "9 0 0", "0.9d1 0 0")),
              AllOf(HasSubstr("a.stl:5: '0.9d1'"), HasSubstr("write its exponent with E")));
}

TEST_F(ForeignMeshes, DataBeyondWhatThePlyHeaderCounts) {
  const auto note = Contains(HasSubstr("that the header counts"));
  const std::string whole = ply("", "element face 4\n", kPlyFaces);
  EXPECT_THAT(read("a.ply", whole + "\n \n").notes, Not(note));
  const City more = read("a.ply", whole + "3 0 1 2\n\n3 0 1 3\n");
  EXPECT_EQ(more.mesh.triangles.size(), 4U);
  EXPECT_THAT(more.notes, Contains(HasSubstr("2 lines follow the data that the header counts")));
  EXPECT_THAT(read("a.ply", ply("", "element face 4\n", "3 0 2 1 7\n3 0 1 3\n3 1 2 3\n3 2 0 3\n")).notes,
              Contains(HasSubstr("1 lines have more numbers than their properties")));
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n" +
      test::bytes_of<float>({0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9});
  const auto face = [](int a, int b, int c) { return "\3" + test::bytes_of<std::int32_t>({a, b, c}); };
  binary += face(0, 2, 1) + face(0, 1, 3) + face(1, 2, 3) + face(2, 0, 3);
  EXPECT_THAT(read("a.ply", binary).notes, Not(note));
  EXPECT_THAT(read("a.ply", binary + "\n").notes, Not(note));
  EXPECT_THAT(read("a.ply", binary + face(0, 1, 2)).notes,
              Contains(HasSubstr("13 bytes follow the data that the header counts")));
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
