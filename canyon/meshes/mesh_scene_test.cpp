#include "canyon/meshes/mesh_scene.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

#include "canyon/base/output_file.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::meshes {
namespace {

using test::bytes_of;
using ::testing::HasSubstr;
using ::testing::SizeIs;

/// Files that are small and claim, or unfold to, much. Each is refused at once.
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

// A megabyte of attributes took 44 s.
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
  // What is no element has no attributes.
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
  // Faces of two corners make no triangles, but are read for each instance.
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
      EXPECT_THAT(refused("a.ply", head + "0 0 0\n"), HasSubstr("promises")) << format;
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

TEST_F(HostileMeshTest, LongNamesAreCut) {
  const std::string name(100'000, 'n');
  write_file(folder_ / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl " + name + "\nf 1 2 3\no b\nf 1 2 3\n");
  for (const SceneNode& node : read_mesh_scene(folder_ / "a.obj").nodes)
    EXPECT_THAT(node.faces[0].material, SizeIs(1000));
}

}  // namespace
}  // namespace canyon::meshes
