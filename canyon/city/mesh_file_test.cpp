#include "canyon/city/mesh_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::city {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// A separate folder for each test, removed afterwards.
class MeshFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("canyon-mesh-" + std::to_string(getpid()) + "-" + info->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  static std::string error_of(const std::filesystem::path& path, const MeshImportOptions& options = {}) {
    return test::refusal([&] { static_cast<void>(read_mesh_city(path, options)); });
  }

  std::filesystem::path folder_;
};

/// An asymmetric box, to detect exchanged axes: 10 m east, 20 m north, 30 m up, its west, south, low corner
/// at (1, 2, 3).
const Eigen::Vector3d kMin(1, 2, 3);
const Eigen::Vector3d kMax(11, 22, 33);
constexpr double kVolume = 10 * 20 * 30;

struct Soup {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

Soup box(const Eigen::Vector3d& min = kMin, const Eigen::Vector3d& max = kMax) {
  Mesh mesh;
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Unknown, min, max);
  return {mesh.vertices, mesh.triangles};
}

/// A flat square at z = 0, facing up.
Soup sheet(double half_m) {
  return {{{-half_m, -half_m, 0}, {half_m, -half_m, 0}, {half_m, half_m, 0}, {-half_m, half_m, 0}},
          {{0, 1, 2}, {0, 2, 3}}};
}

/// The same, with coordinates rotated to a frame whose y axis points up.
Soup y_up(Soup soup) {
  for (auto& v : soup.vertices) v = Eigen::Vector3d(v.x(), v.z(), -v.y());
  return soup;
}

std::string number(double x) {
  std::ostringstream text;
  text.precision(9);
  text << x;
  return text.str();
}

std::string obj(const Soup& soup, const std::string& name = "house") {
  std::string text = "o " + name + "\n";
  for (const auto& v : soup.vertices)
    text += "v " + number(v.x()) + " " + number(v.y()) + " " + number(v.z()) + "\n";
  for (const auto& t : soup.triangles) {
    text += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " +
            std::to_string(t[2] + 1) + "\n";
  }
  return text;
}

std::string ply(const Soup& soup) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(soup.vertices.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(soup.triangles.size()) +
                     "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& v : soup.vertices)
    text += number(v.x()) + " " + number(v.y()) + " " + number(v.z()) + "\n";
  for (const auto& t : soup.triangles) {
    text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
  }
  return text;
}

std::string ply_binary(const Soup& soup) {
  std::string text = ply({});
  const auto put = [&text](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    text.append(bytes, sizeof value);
  };
  const auto replace = [&text](std::string_view from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("ascii", "binary_little_endian");
  replace("vertex 0", "vertex " + std::to_string(soup.vertices.size()));
  replace("face 0", "face " + std::to_string(soup.triangles.size()));
  for (const auto& v : soup.vertices)
    for (int k = 0; k < 3; ++k) put(static_cast<float>(v[k]));
  for (const auto& t : soup.triangles) {
    put(std::uint8_t{3});
    for (const std::uint32_t i : t) put(static_cast<std::int32_t>(i));
  }
  return text;
}

std::string stl_ascii(const Soup& soup) {
  std::string text = "solid house\n";
  for (const auto& t : soup.triangles) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (const std::uint32_t i : t) {
      const auto& v = soup.vertices[i];
      text += "   vertex " + number(v.x()) + " " + number(v.y()) + " " + number(v.z()) + "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid house\n";
}

template <typename T>
void put(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::string stl_binary(const Soup& soup) {
  std::string bytes(80, ' ');
  put(bytes, static_cast<std::uint32_t>(soup.triangles.size()));
  for (const auto& t : soup.triangles) {
    for (int k = 0; k < 3; ++k) put(bytes, 0.0F);
    for (const std::uint32_t i : t) {
      for (int k = 0; k < 3; ++k) put(bytes, static_cast<float>(soup.vertices[i][k]));
    }
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string gltf_buffer(const Soup& soup) {
  std::string bytes;
  for (const auto& v : soup.vertices) {
    for (int k = 0; k < 3; ++k) put(bytes, static_cast<float>(v[k]));
  }
  for (const auto& t : soup.triangles) {
    for (const std::uint32_t i : t) put(bytes, static_cast<std::uint16_t>(i));
  }
  while (bytes.size() % 4 != 0) bytes += '\0';
  return bytes;
}

/// glTF 2.0 with one node; `uri` names the buffer's file, nothing for GLB.
std::string gltf_json(const Soup& soup, const std::string& uri) {
  const std::size_t positions = soup.vertices.size() * 12;
  const std::size_t indices = soup.triangles.size() * 6;
  Eigen::Vector3d low = soup.vertices.front();
  Eigen::Vector3d high = low;
  for (const auto& v : soup.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const auto triple = [](const Eigen::Vector3d& v) {
    return "[" + number(v.x()) + "," + number(v.y()) + "," + number(v.z()) + "]";
  };
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"name":"house"}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{)" +
         (uri.empty() ? std::string() : "\"uri\":\"" + uri + "\",") +
         "\"byteLength\":" + std::to_string(gltf_buffer(soup).size()) +
         R"(}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" + std::to_string(positions) +
         R"(},{"buffer":0,"byteOffset":)" + std::to_string(positions) +
         ",\"byteLength\":" + std::to_string(indices) +
         R"(}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
         std::to_string(soup.vertices.size()) + ",\"min\":" + triple(low) + ",\"max\":" + triple(high) +
         R"(},{"bufferView":1,"componentType":5123,"type":"SCALAR","count":)" +
         std::to_string(soup.triangles.size() * 3) + "}]}";
}

/// GLB container, glTF 2.0 specification 4.4.
std::string glb(const Soup& soup) {
  std::string json = gltf_json(soup, "");
  while (json.size() % 4 != 0) json += ' ';
  const std::string buffer = gltf_buffer(soup);
  std::string bytes = "glTF";
  put(bytes, std::uint32_t{2});
  put(bytes, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + buffer.size()));
  put(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  put(bytes, static_cast<std::uint32_t>(buffer.size()));
  bytes += std::string("BIN\0", 4) + buffer;
  return bytes;
}

struct DaeNode {
  std::string name;
  Soup soup;
  std::string matrix = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
  std::string material = "paint";
};

std::string dae(const std::vector<DaeNode>& nodes,
                const std::string& unit = R"(<unit name="meter" meter="1"/>)",
                const std::string& up_axis = "<up_axis>Z_UP</up_axis>") {
  std::string materials;
  std::string effects;
  std::string geometries;
  std::string scene;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const DaeNode& node = nodes[n];
    const std::string id = "g" + std::to_string(n);
    effects += "<effect id=\"" + id +
               "-fx\"><profile_COMMON><technique sid=\"common\"><lambert/></technique>"
               "</profile_COMMON></effect>";
    materials += "<material id=\"" + id + "-mat\" name=\"" + node.material + "\"><instance_effect url=\"#" +
                 id + "-fx\"/></material>";
    geometries += "<geometry id=\"" + id + "\"><mesh><source id=\"" + id + "-p\"><float_array id=\"" + id +
                  "-a\" count=\"" + std::to_string(node.soup.vertices.size() * 3) + "\">";
    for (const auto& v : node.soup.vertices) {
      geometries += number(v.x()) + " " + number(v.y()) + " " + number(v.z()) + " ";
    }
    geometries += "</float_array><technique_common><accessor source=\"#" + id + "-a\" count=\"" +
                  std::to_string(node.soup.vertices.size()) +
                  "\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
                  "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices id=\"" +
                  id + "-v\"><input semantic=\"POSITION\" source=\"#" + id +
                  "-p\"/></vertices><triangles material=\"m\" count=\"" +
                  std::to_string(node.soup.triangles.size()) + "\"><input semantic=\"VERTEX\" source=\"#" +
                  id + "-v\" offset=\"0\"/><p>";
    for (const auto& t : node.soup.triangles) {
      for (const std::uint32_t i : t) geometries += std::to_string(i) + " ";
    }
    geometries += "</p></triangles></mesh></geometry>";
    scene += "<node id=\"" + node.name + "\" name=\"" + node.name + "\" type=\"NODE\"><matrix>" +
             node.matrix + "</matrix><instance_geometry url=\"#" + id +
             "\"><bind_material><technique_common><instance_material symbol=\"m\" target=\"#" + id +
             "-mat\"/></technique_common></bind_material></instance_geometry></node>";
  }
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
         "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n<asset>\n"
         "<created>2024-01-01T00:00:00</created><modified>2024-01-01T00:00:00</modified>\n" +
         unit + "\n" + up_axis + "\n</asset>\n<library_effects>" + effects +
         "</library_effects><library_materials>" + materials + "</library_materials><library_geometries>" +
         geometries + "</library_geometries><library_visual_scenes><visual_scene id=\"s\" name=\"s\">" +
         scene +
         "</visual_scene></library_visual_scenes><scene><instance_visual_scene "
         "url=\"#s\"/></scene></COLLADA>\n";
}

double volume(const Mesh& mesh) {
  double six_volumes = 0;
  for (const auto& t : mesh.triangles) {
    six_volumes += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  }
  return six_volumes / 6;
}

/// One building at the position of the box and with its front sides outwards. Binary files have floats: 24
/// bits of 33 m are 2 um.
void expect_box(const City& city, const Eigen::Vector3d& min = kMin, const Eigen::Vector3d& max = kMax) {
  ASSERT_EQ(city.mesh.triangles.size(), 12U);
  ASSERT_EQ(city.mesh.objects.size(), 1U);
  EXPECT_EQ(city.mesh.objects[0].surface, Surface::Building);
  EXPECT_EQ(city.mesh.vertices.size(), 8U) << "corners are welded";
  EXPECT_LT((city.bounds().min - min).norm(), 1e-5) << city.bounds().min.transpose();
  EXPECT_LT((city.bounds().max - max).norm(), 1e-5) << city.bounds().max.transpose();
  EXPECT_NEAR(volume(city.mesh), (max - min).prod(), 1e-2);
}

std::vector<std::string> names(const City& city) {
  std::vector<std::string> result;
  for (const Object& object : city.mesh.objects) result.push_back(object.name);
  return result;
}

TEST_F(MeshFiles, ObjIsZUpByDefault) {
  const City city = read_mesh_city(write("a.obj", obj(box())), {});
  expect_box(city);
  EXPECT_EQ(city.mesh.objects[0].name, "house");
  EXPECT_EQ(city.name, "a.obj");
}

TEST_F(MeshFiles, ObjWithQuads) {
  const std::string text =
      "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 9\nv 4 0 9\nv 4 4 9\nv 0 4 9\n"
      "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  expect_box(read_mesh_city(write("a.obj", text), {}), {0, 0, 0}, {4, 4, 9});
}

TEST_F(MeshFiles, PlyStlAndUpperCaseExtension) {
  expect_box(read_mesh_city(write("a.ply", ply(box())), {}));
  expect_box(read_mesh_city(write("a.stl", stl_ascii(box())), {}));
  expect_box(read_mesh_city(write("B.STL", stl_binary(box())), {}));
}

TEST_F(MeshFiles, GltfIsYUpMetres) {
  write("box.bin", gltf_buffer(y_up(box())));
  expect_box(read_mesh_city(write("a.gltf", gltf_json(y_up(box()), "box.bin")), {}));
  expect_box(read_mesh_city(write("a.glb", glb(y_up(box()))), {}));
}

TEST_F(MeshFiles, DevicesThatAMeshNamesAreNotRead) {
  const std::filesystem::path gltf = write("a.gltf", gltf_json(y_up(box()), "pipe.bin"));
  ASSERT_EQ(mkfifo((gltf.parent_path() / "pipe.bin").c_str(), 0600), 0);
  EXPECT_THAT(error_of(gltf), HasSubstr("pipe.bin: is a pipe or a device"));
  expect_box(read_mesh_city(write("a.obj", "mtllib none.mtl /dev/zero\n" + obj(box())), {}));
}

TEST_F(MeshFiles, UpAxisOption) {
  MeshImportOptions options;
  options.up_axis = 'Y';
  expect_box(read_mesh_city(write("a.obj", obj(y_up(box()))), options));
  expect_box(read_mesh_city(write("a.dae", dae({{"house", y_up(box())}})), options));
  options.up_axis = 'Z';
  expect_box(read_mesh_city(write("a.glb", glb(box())), options));
}

TEST_F(MeshFiles, ColladaUpAxes) {
  const std::string metre = R"(<unit meter="1" name="meter"/>)";
  expect_box(read_mesh_city(write("z.dae", dae({{"house", box()}})), {}));
  expect_box(
      read_mesh_city(write("y.dae", dae({{"house", y_up(box())}}, metre, "<up_axis> Y_UP </up_axis>")), {}));
  // COLLADA's default is Y_UP.
  expect_box(read_mesh_city(write("none.dae", dae({{"house", y_up(box())}}, metre, "")), {}));
  // X_UP: right is -y, up is x, the direction to the viewer is z (COLLADA 1.4.1, "up_axis"), which becomes
  // south.
  Soup x_up = box();
  for (auto& v : x_up.vertices) v = Eigen::Vector3d(v.z(), -v.x(), -v.y());
  expect_box(read_mesh_city(write("x.dae", dae({{"house", x_up}}, metre, "<up_axis>X_UP</up_axis>")), {}));
}

TEST_F(MeshFiles, ColladaUnits) {
  Soup centimetres = box();
  for (auto& v : centimetres.vertices) v *= 100;
  expect_box(read_mesh_city(
      write("cm.dae", dae({{"house", centimetres}}, R"(<unit meter="0.01" name="cm"/>)")), {}));
  Soup inches = box();
  for (auto& v : inches.vertices) v /= 0.0254;
  expect_box(
      read_mesh_city(write("in.dae", dae({{"house", inches}}, "<unit name='inch'\n meter='0.0254' />")), {}));
  expect_box(read_mesh_city(write("none.dae", dae({{"house", box()}}, "")), {}));
  EXPECT_THAT(error_of(write("bad.dae", dae({{"house", box()}}, R"(<unit meter="-1"/>)"))),
              HasSubstr("bad.dae:5: unit of '-1' metres"));
  EXPECT_THAT(error_of(write("bad.dae", dae({{"house", box()}}, R"(<unit metre="0.01"/>)"))),
              HasSubstr("bad.dae:5: unit of '' metres"));
}

// The same XML in another notation.
TEST_F(MeshFiles, ColladaUnitsAndAxesInAnyXml) {
  Soup inches = box();
  for (auto& v : inches.vertices) v /= 0.0254;
  const std::string unit = R"(<unit meter="0.0254"/>)", axis = "<up_axis>Z_UP</up_axis>";
  const auto expect = [&](const std::string& reported, const std::string& up) {
    SCOPED_TRACE(reported.substr(0, 60) + up);
    expect_box(read_mesh_city(write("a.dae", dae({{"house", inches}}, reported, up)), {}));
  };
  expect(R"(<unit meter = "0.0254"/>)", axis);
  expect("<unit\nmeter\t=\n'0.0254' ></unit >", axis);
  expect(R"(<!-- was: <unit name="centimeter" meter="0.01"/> -->)" + unit, axis);
  expect("<comments><![CDATA[<unit meter=\"0.01\"/></asset>]]></comments>" + unit, axis);
  expect("<title>" + std::string(std::size_t{1} << 21, 'x') + "</title>" + unit, axis);
  expect(unit, "<up_axis >Z_UP</up_axis >");
  expect(unit, "<!-- <up_axis>X_UP</up_axis> --><up_axis><!-- up --><![CDATA[Z_UP]]></up_axis>");
  std::string spaced = dae({{"house", inches}}, unit);
  spaced.insert(spaced.find("</asset>") + 7, " ");
  expect_box(read_mesh_city(write("a.dae", spaced), {}));
  expect(R"(<unit meter="2.54D-2"/>)", axis);
  std::string wide = "\xff\xfe";
  for (const char c : dae({{"house", inches}}, unit)) wide += {c, '\0'};
  expect_box(read_mesh_city(write("wide.dae", wide), {}));
}

// Unit and axes together with a node's own translation, which is in the file's unit and axes.
TEST_F(MeshFiles, NodeTransformInTheFilesFrame) {
  Soup centimetres = y_up(box());
  for (auto& v : centimetres.vertices) v *= 100;
  const City city = read_mesh_city(
      write("a.dae", dae({{"house", centimetres, "1 0 0 5000  0 1 0 700  0 0 1 -900  0 0 0 1"}},
                         R"(<unit meter="0.01"/>)", "<up_axis>Y_UP</up_axis>")),
      {});
  const Eigen::Vector3d shift(50, 9, 7);
  expect_box(city, kMin + shift, kMax + shift);
}

TEST_F(MeshFiles, RotatedNode) {
  // A quarter turn about z: (x, y) is rotated to (-y, x).
  const City city =
      read_mesh_city(write("a.dae", dae({{"house", box(), "0 -1 0 0  1 0 0 0  0 0 1 0  0 0 0 1"}})), {});
  expect_box(city, {-22, 1, 3}, {-2, 11, 33});
}

TEST_F(MeshFiles, MirroredNodeStillFacesOutwards) {
  const City city =
      read_mesh_city(write("a.dae", dae({{"house", box(), "-1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1"}})), {});
  expect_box(city, {-11, 2, 3}, {-1, 22, 33});
  EXPECT_THAT(city.notes.lines(), Not(Contains(HasSubstr("inside out"))))
      << "a mirror image is not a fault of the file";
}

TEST_F(MeshFiles, MirroredTerrainFacesUp) {
  const City city = read_mesh_city(
      write("a.dae", dae({{"terrain", sheet(100), "-1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1"}, {"house", box()}})),
      {});
  const auto& t = city.mesh.triangles[0];
  const Eigen::Vector3d normal = (city.mesh.vertices[t[1]] - city.mesh.vertices[t[0]])
                                     .cross(city.mesh.vertices[t[2]] - city.mesh.vertices[t[0]]);
  EXPECT_GT(normal.z(), 0);
}

TEST_F(MeshFiles, Georeference) {
  MeshImportOptions options;
  options.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 4);
  options.scale = 2;
  options.heading_rad = geodesy::radians(90);  // counter-clockwise: the file's x becomes north, its y west
  options.offset_m = {100, 200, -1};
  const City city = read_mesh_city(write("a.obj", obj(box())), options);
  expect_box(city, {100 - 44, 200 + 2, 6 - 1}, {100 - 4, 200 + 22, 66 - 1});
  EXPECT_EQ(city.frame.origin().height_m, 4);
  EXPECT_EQ(city.frame.heading_rad(), 0);
}

TEST_F(MeshFiles, DegenerateTrianglesAreDroppedAndCounted) {
  Soup soup = box();
  soup.triangles.push_back({0, 1, 1});
  soup.vertices.emplace_back(0.5 * (soup.vertices[0] + soup.vertices[1]));
  soup.triangles.push_back({0, 8, 1});
  const City city = read_mesh_city(write("a.obj", obj(soup)), {});
  expect_box(city);
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("2 degenerate triangles")));
  EXPECT_THAT(city.notes.lines().front(), HasSubstr("14 triangles in 1 nodes"));
}

TEST_F(MeshFiles, InsideOutBuildingIsTurned) {
  Soup soup = box();
  for (auto& t : soup.triangles) std::swap(t[0], t[1]);
  const City city = read_mesh_city(write("a.ply", ply(soup)), {});
  expect_box(city);
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("1 objects were inside out")));
}

TEST_F(MeshFiles, OneWrongTriangleIsTurned) {
  Soup soup = box();
  std::swap(soup.triangles[7][0], soup.triangles[7][2]);
  const City city = read_mesh_city(write("a.ply", ply(soup)), {});
  expect_box(city);
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("1 triangles of 1 objects flipped")));
}

TEST_F(MeshFiles, InsideOutWithoutFloorIsTurned) {
  Soup soup = box();
  soup.triangles.erase(soup.triangles.begin(),
                       soup.triangles.begin() + 2);  // canyon::test::append_box() begins with the floor
  for (auto& t : soup.triangles) std::swap(t[0], t[1]);
  const City city = read_mesh_city(write("a.ply", ply(soup)), {});
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("1 objects were inside out")));
  EXPECT_THAT(city.notes.lines(), Not(Contains(HasSubstr("not closed"))));
  const Eigen::Vector3d centre = 0.5 * (kMin + kMax);
  for (const auto& t : city.mesh.triangles) {
    const Eigen::Vector3d a = city.mesh.vertices[t[0]];
    EXPECT_LT((city.mesh.vertices[t[1]] - a).cross(city.mesh.vertices[t[2]] - a).dot(centre - a), 0);
  }
}

TEST_F(MeshFiles, OpenBuildingIsSaid) {
  Soup soup = box();
  soup.triangles.erase(soup.triangles.begin() + 2, soup.triangles.begin() + 4);  // the roof
  EXPECT_THAT(read_mesh_city(write("a.ply", ply(soup)), {}).notes.lines(),
              Contains(HasSubstr("1 buildings are not closed")));
}

TEST_F(MeshFiles, ConnectedPartsBecomeObjects) {
  Soup soup = box();
  const Soup other = box({50, 50, 0}, {60, 60, 9});
  for (const auto& t : other.triangles) soup.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  soup.vertices.insert(soup.vertices.end(), other.vertices.begin(), other.vertices.end());
  const City city = read_mesh_city(write("a.dae", dae({{"town", soup}})), {});
  EXPECT_THAT(names(city), ElementsAre("town_1", "town_2"));
  EXPECT_EQ(city.mesh.objects[1].triangle_count, 12U);
  EXPECT_NEAR(volume(city.mesh), kVolume + 900, 1e-2);
}

TEST_F(MeshFiles, TerrainByName) {
  // The second sheet is not terrain: names decide if there is one.
  const City city = read_mesh_city(
      write("a.dae",
            dae({{"City-Terrain.001", sheet(100)}, {"Underground_academy", box()}, {"helipad", sheet(5)}})),
      {});
  ASSERT_EQ(city.mesh.objects.size(), 3U);
  EXPECT_EQ(city.mesh.objects[0].surface, Surface::Terrain);
  EXPECT_EQ(city.mesh.materials[0], Material::Ground);
  EXPECT_EQ(city.mesh.objects[1].surface, Surface::Building);
  EXPECT_EQ(city.mesh.objects[2].surface, Surface::Building);
  EXPECT_EQ(summarize(city).terrain_triangles, 2U);
}

TEST_F(MeshFiles, TerrainByOtherName) {
  MeshImportOptions options;
  options.terrain_names = {"Gelaende"};
  const City city =
      read_mesh_city(write("a.dae", dae({{"dasGelaende", sheet(100)}, {"terrain", box()}})), options);
  EXPECT_EQ(city.mesh.objects[0].surface, Surface::Terrain);
  EXPECT_EQ(city.mesh.objects[1].surface, Surface::Building);
}

TEST_F(MeshFiles, TerrainByGeometry) {
  const City city = read_mesh_city(write("a.dae", dae({{"plane", sheet(100)}, {"cube", box()}})), {});
  EXPECT_EQ(city.mesh.objects[0].surface, Surface::Terrain);
  EXPECT_EQ(city.mesh.objects[1].surface, Surface::Building);
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("node 'plane' is read as terrain")));
}

TEST_F(MeshFiles, TerrainAsPartOfTheOnlyNode) {
  Soup soup = box();
  const Soup ground = sheet(100);
  for (const auto& t : ground.triangles) soup.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  soup.vertices.insert(soup.vertices.end(), ground.vertices.begin(), ground.vertices.end());
  const City city = read_mesh_city(write("a.stl", stl_binary(soup)), {});
  ASSERT_EQ(city.mesh.objects.size(), 2U);
  EXPECT_EQ(city.mesh.objects[0].surface, Surface::Building);
  EXPECT_EQ(city.mesh.objects[1].surface, Surface::Terrain);
}

TEST_F(MeshFiles, MaterialsByName) {
  const City city = read_mesh_city(
      write("a.dae", dae({{"a", box(), "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "Curtain_Glass.003"},
                          {"b", box({50, 0, 0}, {60, 9, 9}), "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "red brick"},
                          {"c", box({70, 0, 0}, {80, 9, 9}), "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "M_17"}})),
      {});
  ASSERT_EQ(city.mesh.objects.size(), 3U);
  EXPECT_EQ(city.mesh.materials[0], Material::Glass);
  EXPECT_EQ(city.mesh.materials[12], Material::Brick);
  EXPECT_EQ(city.mesh.materials[24], Material::Unknown);
}

TEST_F(MeshFiles, BadPaths) {
  EXPECT_THAT(error_of(folder_ / "missing.obj"), HasSubstr("missing.obj: no such file"));
  EXPECT_THAT(error_of(write("city.xyz", "hello")),
              HasSubstr("unknown mesh format '.xyz'; use .dae, .obj, .stl, .gltf, .glb or .ply"));
  std::filesystem::create_directories(folder_ / "folder.obj");
  EXPECT_THAT(error_of(folder_ / "folder.obj"), HasSubstr("is a folder, not a file"));
}

// Files of tests/data/cases. The compressed bytes of m.gltf are synthetic.
TEST_F(MeshFiles, CompressedGltfThatIsDamagedIsRefused) {
  EXPECT_THAT(error_of(test::case_file("gltf-meshopt/m.gltf")),
              AllOf(HasSubstr("m.gltf: "), HasSubstr("meshopt")));
  EXPECT_THAT(error_of(write("zip.obj", "PK\x03\x04 and so on")), HasSubstr("is a packed file"));
}

TEST_F(MeshFiles, RequiredExtensionsOfGltfAreNamed) {
  std::string json = gltf_json(y_up(box()), "box.bin");
  json.insert(1, R"("extensionsRequired":["EXT_of_tomorrow"],)");
  EXPECT_THAT(error_of(write("a.gltf", json)), HasSubstr("requires the glTF extension 'EXT_of_tomorrow'"));
}

TEST_F(MeshFiles, SaysWhatOfGltfItLeavesOut) {
  write("box.bin", gltf_buffer(y_up(box())));
  const std::string json = gltf_json(y_up(box()), "box.bin");
  const auto notes_of = [&](const std::string& from, const std::string& to) {
    std::string changed = json;
    changed.replace(changed.find(from), from.size(), to);
    return read_mesh_city(write("a.gltf", changed), {}).notes.lines();
  };
  const std::string node = R"({"mesh":0,)";
  EXPECT_THAT(notes_of(node, node + R"("extensions":{"KHR_node_visibility":{"visible":false}},)"),
              Contains(HasSubstr("1 nodes are hidden by KHR_node_visibility, and are built")));
  EXPECT_THAT(notes_of(R"("scene":0,)", R"("scene":0,"extensions":{"CESIUM_RTC":{"center":[1,2,3]}},)"),
              Contains(HasSubstr("(CESIUM_RTC) is not read")));
  EXPECT_THAT(notes_of(R"("indices":1}]}],)",
                       R"("indices":1},{"mode":1,"attributes":{"POSITION":0}}]},{"primitives":[]}],)"),
              AllOf(Contains(HasSubstr("1 primitives of lines or points left out")),
                    Contains(HasSubstr("1 meshes are not in the scene and left out"))));
}

// The same house with its roof as one face of six corners and as four triangles: 300 m2.
TEST_F(MeshFiles, FacesWithANotchCoverTheirGround) {
  for (const char* name : {"face6.dae", "triangles.dae"}) {
    const City city = read_mesh_city(test::case_file(std::string("mesh-concave-face/") + name), {});
    double roofs = 0;
    for (const auto& [a, b, c] : city.mesh.triangles) {
      const auto& v = city.mesh.vertices;
      const Eigen::Vector3d twice = (v[b] - v[a]).cross(v[c] - v[a]);
      if (v[a].z() > 1 && v[b].z() > 1 && v[c].z() > 1) roofs += twice.z() / 2;
    }
    EXPECT_NEAR(roofs, 300, 1e-9) << name;
  }
}

TEST_F(MeshFiles, SkewOfColladaIsRefused) {
  EXPECT_THAT(
      error_of(test::case_file("collada-skew-abort/skew.dae")),
      AllOf(HasSubstr("skew.dae:"), HasSubstr("<skew> is not read; export the node with a <matrix>")));
}

TEST_F(MeshFiles, TransformsOfColladaApplyInTheirOrder) {
  // From the right: doubled, rotated by a quarter turn about an axis of length 2, moved.
  std::string text = dae({{"house", box()}});
  const std::string matrix = "<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>";
  text.replace(text.find(matrix), matrix.size(),
               "<translate>100 0 0</translate><rotate>0 0 2 90</rotate><scale>2 2 2</scale>");
  const City city = read_mesh_city(write("a.dae", text), {});
  expect_box(city, {100 - 44, 2, 6}, {100 - 4, 22, 66});
}

TEST_F(MeshFiles, NodesOfColladaMayStandAtSeveralPlaces) {
  std::string text = dae({{"house", box()}});
  const std::size_t scene = text.find("<node id"), end = text.find("</visual_scene>");
  const std::string node = text.substr(scene, end - scene);
  text.replace(scene, node.size(),
               "<node id=\"a\"><instance_node url=\"#house\"/></node>"
               "<node id=\"b\"><translate>50 0 0</translate><instance_node url=\"#house\"/></node>");
  text.insert(text.find("<library_visual_scenes>"), "<library_nodes>" + node + "</library_nodes>");
  EXPECT_NEAR(volume(read_mesh_city(write("a.dae", text), {}).mesh), 2 * kVolume, 1e-6);
  text.insert(text.find("<instance_geometry"), "<instance_node url=\"#house\"/>");
  EXPECT_THAT(error_of(write("a.dae", text)), HasSubstr("contains itself"));
}

// Blender writes none, others do.
TEST_F(MeshFiles, CommentsBehindTheDataOfObj) {
  const std::string text =
      "o a#1 # no comment\nv 0 0 0 # corner\nv 9 0 0\nv 9 0 9 #\nv 0 0 9\nf 1 2 3 # front\nf 1 3 4\n";
  const City city = read_mesh_city(write("a.obj", text), {});
  EXPECT_EQ(city.mesh.triangles.size(), 2U);
  EXPECT_EQ(city.mesh.objects[0].name, "a#1 # no comment");
}

TEST_F(MeshFiles, AMeshOnItsSideIsSaid) {
  const auto caution = [](const char* name, std::optional<char> up_axis = {}) {
    MeshImportOptions options;
    options.up_axis = up_axis;
    const std::filesystem::path path = test::case_file(name);
    return read_mesh_city(path, options).notes.warnings();
  };
  EXPECT_THAT(caution("obj-y-up/y_up.obj"),
              ElementsAre(HasSubstr("its terrain is upright; if y is the file's up axis, set up_axis: Y")));
  EXPECT_THAT(caution("obj-y-up/z_up.obj"), IsEmpty());
  EXPECT_THAT(caution("obj-y-up/y_up.obj", 'Y'), IsEmpty());
}

TEST_F(MeshFiles, DamagedFiles) {
  const std::string whole = dae({{"house", box()}});
  EXPECT_THAT(error_of(write("cut.dae", whole.substr(0, whole.size() / 2))),
              HasSubstr("is not well-formed XML"));
  const std::string binary = stl_binary(box());
  EXPECT_THAT(error_of(write("cut.stl", binary.substr(0, 300))), HasSubstr("cut.stl: "));
  const std::string container = glb(box());
  EXPECT_THAT(error_of(write("cut.glb", container.substr(0, 200))), HasSubstr("cut.glb: "));
  const std::string points = ply(box());
  EXPECT_THAT(error_of(write("cut.ply", points.substr(0, points.size() - 60))),
              HasSubstr("cut.ply: ends within its data"));
  const auto damaged = [&](std::string_view from, std::string_view to) {
    std::string text = points;
    return error_of(write("bad.ply", text.replace(text.find(from), from.size(), to)));
  };
  const std::size_t faces = points.find("\n3 ");
  const std::string face = points.substr(faces, points.find('\n', faces + 1) - faces);
  EXPECT_THAT(damaged(face, "\n3 0 1 8"), HasSubstr("bad.ply:18: face 0 uses vertex 8 of 8"));
  EXPECT_THAT(damaged(face, "\n3 0 1 -1"), HasSubstr("uses vertex -1 of 8"));
  EXPECT_THAT(damaged(face, "\n0"), HasSubstr("face 0 has 0 corners"));
  EXPECT_THAT(damaged(face, "\n3 0 one 2"), HasSubstr("'one' instead of a number"));
  EXPECT_THAT(damaged("end_header\n", "end_header\nnan"), HasSubstr("'nan1' instead of a number"));
  EXPECT_THAT(damaged("list uchar int", "list float int"), HasSubstr("bad.ply:8: is not a property"));
  const std::string soup = ply_binary(box());
  expect_box(read_mesh_city(write("b.ply", soup), {}));
  std::string far = soup, long_list = soup;
  far[far.size() - 1] = '\x40';  // the high byte of the last vertex of the last face
  EXPECT_THAT(error_of(write("far.ply", far)), HasSubstr("far.ply: face 11 uses vertex "));
  long_list[long_list.size() - 13] = '\xff';
  EXPECT_THAT(error_of(write("long.ply", long_list)), HasSubstr("long.ply: ends within its data"));
  // 2^61 elements of 8 bytes are 2^64 bytes: 0 to a counter of 64 bits.
  EXPECT_THAT(error_of(write("many.ply",
                             "ply\nformat binary_little_endian 1.0\nelement vertex 2305843009213693952\n"
                             "property double x\nend_header\n")),
              HasSubstr("many.ply:3: declares 2305843009213693952 elements in 29 bytes"));
  const std::string facets = stl_ascii(box());
  EXPECT_THAT(error_of(write("facets.stl", facets.substr(0, facets.size() - 100))),
              HasSubstr("ends within a facet"));
  EXPECT_THAT(error_of(write("facets.stl", facets.substr(0, facets.rfind("endsolid")))),
              HasSubstr("has no endsolid"));
  // Binary files may also begin with "solid": this one has one triangle fewer than declared.
  std::string solid = std::string("solid by a CAD") + std::string(66, ' ') + std::string("\x0d\0\0\0", 4);
  solid += std::string(50 * 12, '\0');
  EXPECT_THAT(error_of(write("solid.stl", solid)), HasSubstr("binary STL file whose size does not match"));
  // Windows' Notepad.
  const std::string triangle = "v 0 0 0\nv 9 0 0\nv 9 9 0\nf 1 2 3\n";
  std::string wide = "\xff\xfe";
  for (const char c : triangle) wide += {c, '\0'};
  EXPECT_EQ(read_mesh_city(write("wide.obj", wide), {}).mesh.triangles.size(), 1U);
  EXPECT_EQ(read_mesh_city(write("mark.obj", "\xef\xbb\xbf" + triangle), {}).mesh.triangles.size(), 1U);
  for (const char* name :
       {"garbage.dae", "garbage.obj", "garbage.stl", "garbage.gltf", "garbage.glb", "garbage.ply"}) {
    EXPECT_THAT(error_of(write(name, "this is no mesh at all, sorry\n\n\x01\x02\x7f")), HasSubstr(name));
  }
  for (const char* name : {"empty.dae", "empty.obj", "empty.stl", "empty.gltf", "empty.glb", "empty.ply"}) {
    EXPECT_THAT(error_of(write(name, "")), HasSubstr(name));
  }
  std::string missing_vertex = obj(box());
  missing_vertex += "f 1 2 999\n";
  EXPECT_THAT(error_of(write("index.obj", missing_vertex)), HasSubstr("index.obj:22: uses vertex 999 of 8"));
  EXPECT_THAT(error_of(write("nan.obj", "v 0 0 0\nv 1 0 0\nv nan 5 0\nf 1 2 3\n")),
              HasSubstr("nan.obj:3: 'nan' is not a coordinate"));
}

TEST_F(MeshFiles, NoTriangles) {
  EXPECT_THAT(error_of(write("points.ply",
                             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                             "property float z\nend_header\n0 0 0\n")),
              HasSubstr("points.ply: "));
  EXPECT_THAT(error_of(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")),
              HasSubstr("has no triangle of 1e-8 m^2 or more, only 1 smaller ones"));
}

TEST_F(MeshFiles, WrongUnitsAndPlaces) {
  MeshImportOptions options;
  options.scale = 1e5;
  const auto path = write("a.obj", obj(box()));
  EXPECT_THAT(error_of(path, options), HasSubstr("the city would be 3e+06 m large"));
  EXPECT_THAT(error_of(path, options), HasSubstr("set the city's scale"));
  options.scale = 1e-3;
  EXPECT_THAT(error_of(path, options), HasSubstr("the city would be 0.03 m large"));
  // A mesh in grid coordinates of Hong Kong.
  EXPECT_THAT(error_of(write("far.obj", obj(box({836000, 818000, 0}, {836100, 818100, 50})))),
              HasSubstr("the city would be 1170 km from its origin"));
}

TEST_F(MeshFiles, LargeCoordinatesKeepTheirDigits) {
  const City city = read_mesh_city(write("a.obj", obj(box({60000.0625, 0, 0}, {60010, 10, 10}))), {});
  EXPECT_EQ(city.bounds().min.x(), 60000.0625);
}

TEST_F(MeshFiles, BadOptions) {
  const auto path = write("a.obj", obj(box()));
  MeshImportOptions options;
  options.scale = 0;
  EXPECT_THAT(error_of(path, options),
              HasSubstr("scale of the city mesh is 0; it must be above 0 and at most 1000000"));
  options = {};
  options.up_axis = 'Q';
  EXPECT_THAT(error_of(path, options), HasSubstr("up_axis of the city mesh is Q"));
  options = {};
  options.heading_rad = 90;
  EXPECT_THAT(error_of(path, options), HasSubstr("heading_rad of the city mesh is 90 "));
  options = {};
  options.offset_m.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error_of(path, options), HasSubstr("city offset"));
  options = {};
  options.origin.latitude_rad = 22.3;
  EXPECT_THAT(error_of(path, options), HasSubstr("city origin"));
}

// Checked by an independent reader of the COLLADA arrays (Python's re and float over <float_array> and <p>,
// no library): 4,018 triangles of "Terrain" and 18,446 of the buildings, of which 1,150 have no area and 494
// welded components remain; x -613.338 to 613.281, y -723.5918 to 723.616, z 0 to 274. The file's own
// orientation is right (every component encloses a positive volume), so no triangle is flipped.
TEST(HongKong, MatchesAnIndependentReader) {
  CANYON_SHARED_DATA(path, "hongkong/buildings.dae");
  MeshImportOptions options;
  options.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  const auto begin = std::chrono::steady_clock::now();
  const City city = read_mesh_city(path, options);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  std::cout << "Hong Kong mesh read in " << took.count() << " ms\n";
  for (const std::string& line : city.notes.lines()) std::cout << "  " << line << "\n";

  EXPECT_THAT(city.notes.lines().front(), HasSubstr("22464 triangles in 2 nodes; 1 unit is 1 m, Z up"));
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("1150 degenerate triangles")));
  EXPECT_THAT(city.notes.lines(), Not(Contains(HasSubstr("flipped"))));
  const CitySummary summary = summarize(city);
  EXPECT_EQ(summary.triangles, 22464U - 1150U);
  EXPECT_EQ(summary.terrain_triangles, 4018U);
  EXPECT_EQ(summary.buildings, 494U);
  EXPECT_LT((summary.bounds.min - Eigen::Vector3d(-613.338, -723.5918, 0)).norm(), 1e-4);
  EXPECT_LT((summary.bounds.max - Eigen::Vector3d(613.281, 723.616, 274)).norm(), 1e-4);
  EXPECT_EQ(summary.highest_roof_m, 274);
  std::cout << "  built area " << 100 * summary.built_area_fraction << " %\n";
  EXPECT_GT(summary.built_area_fraction, 0.2);
  EXPECT_LT(summary.built_area_fraction, 0.7);
}

}  // namespace
}  // namespace canyon::city
