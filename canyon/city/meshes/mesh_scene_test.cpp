#include "canyon/city/meshes/mesh_scene.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <chrono>
#include <cmath>
#include <random>

#include "canyon/base/output_file.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::meshes {
namespace {

using test::bytes_of;
using ::testing::HasSubstr;
using ::testing::SizeIs;

/// Files that are small and declare, or expand to, large contents. Each is rejected at once.
class HostileMeshTest : public testing::Test {
 protected:
  [[nodiscard]] std::string refused(const std::string& name, const std::string& bytes) const {
    write_file(folder_ / name, bytes);
    return test::refusal([&] { (void)read_mesh_scene(folder_ / name); });
  }
  static std::string collada(const std::string& nodes, const std::string& geometry = {}) {
    return "<COLLADA version=\"1.4.1\"><library_geometries>" + geometry +
           "</library_geometries><library_nodes>" + nodes +
           "</library_nodes><library_visual_scenes><visual_scene id=\"v\"><node><instance_node "
           "url=\"#n0\"/></node>"
           "</visual_scene></library_visual_scenes><scene><instance_visual_scene "
           "url=\"#v\"/></scene></COLLADA>";
  }
  void TearDown() override {
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin_;
    EXPECT_LT(took.count(), 30);
  }

  test::TemporaryFolder folder_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// A megabyte of attributes needed 44 s.
TEST_F(HostileMeshTest, ElementsHaveFewAttributes) {
  std::string many;
  for (int i = 0; i < 100'000; ++i) many += fmt::format(" a{}='>'", i);
  for (const std::string before :
       {"", "<!-- don't -->", "<!-- \"> -->", "<?xml version='1.0'?>", "<!DOCTYPE a>"}) {
    EXPECT_THAT(refused("a.dae", before + "<COLLADA" + many + "/>"), HasSubstr("more than 1000 attributes"))
        << before;
    EXPECT_THAT(refused("a.dae", before + "<COLLADA><a b='<'><![CDATA[<a ']]></a><b" + many),
                HasSubstr("more than 1000 attributes"));
  }
  // Items other than elements have no attributes.
  EXPECT_THAT(refused("a.dae", "<COLLADA><!--" + many + "--><![CDATA[" + many + "]]></COLLADA>"),
              HasSubstr("no <scene>"));
  EXPECT_THAT(refused("a.dae", "<COLLADA a='"), HasSubstr("not well-formed"));
}

TEST_F(HostileMeshTest, NodesAndGeometriesAreInstancedSoOften) {
  std::string nodes;
  for (int i = 0; i < 60; ++i) {
    nodes += fmt::format(
        "<node id=\"n{0}\"><instance_node url=\"#n{1}\"/><instance_node url=\"#n{1}\"/></node>", i, i + 1);
  }
  EXPECT_THAT(refused("a.dae", collada(nodes + "<node id=\"n60\"/>")), HasSubstr("instanced too often"));
  // Faces of two corners give no triangles, but are read for each instance.
  std::string indices;
  for (int i = 0; i < 1'000'000; ++i) indices += "          ";
  std::string geometry =
      "<geometry id=\"g\"><mesh><source id=\"s\"><float_array id=\"f\" count=\"3\">0 0 0</float_array>"
      "<technique_common><accessor source=\"#f\" count=\"1\" stride=\"3\"/></technique_common></source>"
      "<vertices id=\"v0\"><input semantic=\"POSITION\" source=\"#s\"/></vertices><polygons count=\"1\">"
      "<input semantic=\"VERTEX\" offset=\"0\" source=\"#v0\"/><p>0 0" +
      indices + "</p></polygons></mesh></geometry>";
  nodes.clear();
  for (int i = 0; i < 18; ++i) {
    nodes += fmt::format(
        "<node id=\"n{0}\"><instance_node url=\"#n{1}\"/><instance_node url=\"#n{1}\"/></node>", i, i + 1);
  }
  nodes += "<node id=\"n18\"><instance_geometry url=\"#g\"/></node>";
  EXPECT_THAT(refused("a.dae", collada(nodes, geometry)), HasSubstr("instanced too often"));
}

TEST_F(HostileMeshTest, HeadersAreHeldAgainstTheFile) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const char* count : {"4000000000", "18446744073709551615", "-1"}) {
      const std::string head = fmt::format(
          "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
          "element face {}\nproperty list uint int vertex_indices\nend_header\n",
          format, count, count);
      EXPECT_THAT(refused("a.ply", head + "0 0 0\n"), HasSubstr("declares")) << format;
    }
    const std::string face = fmt::format(
        "ply\nformat {} 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\n"
        "element face 1\nproperty list uint uchar vertex_indices\nend_header\n",
        format);
    EXPECT_THAT(
        refused("a.ply", face + (format[0] == 'a' ? "0 0 0\n4294967295 0" : "\1\1\1\377\377\377\377")),
        HasSubstr("ends within"));
  }
  EXPECT_NE(
      refused("a.stl", std::string(80, ' ') + bytes_of<std::uint32_t>({0xFFFFFFFF}) + std::string(50, '\0')),
      "");
  std::string whole = test::box_glb(1, 1, 1);
  for (const std::size_t at : {8U, 12U}) {  // of the file, of the JSON
    std::string cut = whole;
    cut.replace(at, 4, "\377\377\377\377");
    EXPECT_NE(refused("a.glb", cut), "");
  }
}

// Faces of 20,000 corners did not terminate.
TEST_F(HostileMeshTest, FacesOfManyCorners) {
  constexpr int kCorners = 20'000;
  std::mt19937 random(1);
  const auto face = [&](auto&& corner) {
    std::string vertices, indices;
    for (int i = 0; i < kCorners; ++i) {
      const Eigen::Vector2d at = corner(i);
      vertices += fmt::format("v {} {} 0\n", at.x(), at.y());
      indices += fmt::format(" {}", i + 1);
    }
    write_file(folder_ / "a.obj", vertices + "f" + indices + "\n");
    return read_mesh_scene(folder_ / "a.obj");
  };
  const auto area = [](const MeshScene& scene) {
    double twice = 0;
    const SceneNode& node = scene.nodes.at(0);
    for (const auto& [a, b, c] : node.faces.at(0).triangles)
      twice += (node.vertices[b] - node.vertices[a]).cross(node.vertices[c] - node.vertices[a]).norm();
    return twice / 2;
  };
  const MeshScene tangled = face([&](int) { return Eigen::Vector2d(random() % 1000, random() % 1000); });
  EXPECT_THAT(tangled.notes.lines(), testing::Contains(HasSubstr("1 faces cross themselves")));
  // A star: kCorners triangles about its middle.
  const double step = 2 * EIGEN_PI / kCorners;
  const MeshScene star = face([&](int i) -> Eigen::Vector2d {
    return (i % 2 == 0 ? 50 : 100) * Eigen::Vector2d(std::cos(i * step), std::sin(i * step));
  });
  EXPECT_THAT(star.notes.lines(), testing::IsEmpty());
  EXPECT_NEAR(area(star), kCorners * 0.5 * 50 * 100 * std::sin(step), 1e-3);
  // A comb: a bar of 1 m below teeth, of half a square metre each.
  const MeshScene comb = face([&](int i) -> Eigen::Vector2d {
    if (i >= kCorners - 2) return {i == kCorners - 2 ? kCorners - 3 : 0, -1};
    return {i, i % 2};
  });
  EXPECT_NEAR(area(comb), 1.5 * (kCorners - 3), 1e-3);
}

TEST_F(HostileMeshTest, LongNamesAreCut) {
  const std::string name(100'000, 'n');
  write_file(folder_ / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl " + name + "\nf 1 2 3\no b\nf 1 2 3\n");
  for (const SceneNode& node : read_mesh_scene(folder_ / "a.obj").nodes)
    EXPECT_THAT(node.faces[0].material, SizeIs(1000));
}

}  // namespace
}  // namespace canyon::meshes
