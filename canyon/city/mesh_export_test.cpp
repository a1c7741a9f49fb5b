#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_parts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "canyon/base/input_error.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/city_comparison.hpp"
#include "tests/support/program.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::city {
namespace {

using canyon::test::read_bytes;
using canyon::test::TemporaryFolder;
using ::testing::HasSubstr;

/// Names, surfaces and materials that a careless round trip would lose.
City awkward_city() {
  City city;
  city.name = "terrain & <co>";
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(55.82, 37.61, 150.25));
  const auto box = [&](std::string name, Surface surface, Material material, double x) {
    canyon::test::append_box(city.mesh, std::move(name), surface, material, {x, 1200.123, 0},
                             {x + 7.654321, 1210.5, 10 + x / 100}, 0.01 * x);
  };
  box("Big house", Surface::Building, Material::Glass, -2000);
  box("house", Surface::Building, Material::Brick, -1900);
  box("house", Surface::Building, Material::Metal, -1800);
  box("", Surface::Building, Material::Unknown, -1700);
  box("Ground floor shop", Surface::Building, Material::Plaster, -1600);
  box("Oak 7", Surface::Foliage, Material::Wood, -1500);
  box("bus", Surface::Vehicle, Material::Metal, -1400);
  box("\xD0\x9E\xD1\x81\xD1\x82 \"&<>'\\#", Surface::Building, Material::Stone, -1300);
  box("line\nbreak\xFF", Surface::Building, Material::Concrete, -1200);
  box("building:x_x0041_", Surface::Building, Material::Concrete, -1100);
  box("<$>", Surface::Building, Material::Ground, -1000);
  box("7th", Surface::Building, Material::Ground, -900);
  box(std::string(300, 'n'), Surface::Building, Material::Ground, -800);
  append_object(city.mesh, "flat sheet", Surface::Building, Material::Glass,
                {{0, 0, 5}, {9, 0, 5}, {0, 9, 5}}, {{0, 1, 2}});
  append_object(city.mesh, "hill", Surface::Terrain, Material::Stone,
                {{-3000, -3000, 0}, {3000, -3000, -2}, {3000, 3000, 1}, {-3000, 3000, 3}},
                {{0, 1, 2}, {0, 2, 3}});
  append_object(city.mesh, "hole", Surface::Building, Material::Glass, {{0, 0, 5}, {9, 0, 5}, {0, 9, 5}},
                {{0, 2, 1}});
  // Two parts that do not touch, of three materials, in one object.
  canyon::test::append_box(city.mesh, "twin", Surface::Building, Material::Brick, {100, 0, 0}, {110, 10, 10});
  canyon::test::append_box(city.mesh, "twin b", Surface::Building, Material::Glass, {120, 0, 0},
                           {130, 10, 10});
  city.mesh.objects[city.mesh.objects.size() - 2].triangle_count += city.mesh.objects.back().triangle_count;
  city.mesh.objects.pop_back();
  city.mesh.materials.back() = Material::Metal;
  return city;
}

MeshImportOptions at_origin_of(const City& city) {
  MeshImportOptions options;
  options.origin = city.frame.origin();
  return options;
}

class MeshExport : public ::testing::TestWithParam<const char*> {};

TEST_P(MeshExport, RoundTripKeepsTrianglesObjectsSurfacesAndMaterials) {
  const TemporaryFolder folder;
  const auto path = folder / (std::string("my city") + GetParam());
  const City city = awkward_city();
  write_mesh(path, city);
  const City read = read_mesh_city(path, at_origin_of(city));
  City expected = city;
  for (Object& object : expected.mesh.objects) object.name = object.name.substr(0, 120);
  EXPECT_EQ(canyon::test::difference_of(expected, read, 1e-3), "");
}

TEST_P(MeshExport, RoundTripOfASyntheticDowntown) {
  const TemporaryFolder folder;
  const auto path = folder / (std::string("c") + GetParam());
  const City city = synthetic_city({});
  write_mesh(path, city);
  EXPECT_EQ(canyon::test::difference_of(city, read_mesh_city(path, at_origin_of(city)), 1e-3), "");
}

TEST_P(MeshExport, RoundTripOfHongKong) {
  CANYON_SHARED_DATA(dae, "hongkong/buildings.dae");
  const TemporaryFolder folder;
  const auto path = folder / (std::string("hk") + GetParam());
  const City city = read_mesh_city(dae, {});
  write_mesh(path, city);
  EXPECT_EQ(canyon::test::difference_of(city, read_mesh_city(path, {}), 1e-3), "");
}

TEST_P(MeshExport, IsTheSameBytesEachTimeAndLeavesNothingBeside) {
  const TemporaryFolder folder;
  const auto path = folder / (std::string("a") + GetParam());
  write_mesh(path, awkward_city());
  const std::string once = read_bytes(path);
  write_mesh(path, awkward_city());
  EXPECT_EQ(read_bytes(path), once);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    EXPECT_EQ(entry.path().stem(), "a");
    ++files;
  }
  EXPECT_EQ(files, std::string(GetParam()) == ".obj" ? 2U : 1U);
}

TEST_P(MeshExport, RefusesWhatCannotBeWritten) {
  const TemporaryFolder folder;
  const std::string name = std::string("a") + GetParam();
  EXPECT_THROW(write_mesh(folder / name, City{}), InputError);
  EXPECT_THROW(write_mesh(folder / "none" / name, awkward_city()), InputError);
  std::filesystem::create_directory(folder / name);
  EXPECT_THROW(write_mesh(folder / name, awkward_city()), InputError);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

INSTANTIATE_TEST_SUITE_P(Formats, MeshExport, ::testing::Values(".glb", ".obj", ".dae"),
                         [](const auto& format) { return std::string(format.param).substr(1); });

TEST(MeshExportFormats, RefusesAnotherEnding) {
  const TemporaryFolder folder;
  try {
    write_mesh(folder / "a.stl", awkward_city());
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("unknown mesh format '.stl'; use .glb, .obj or .dae"));
  }
}

std::uint32_t u32_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes.at(at + i));
  return value;
}

float f32_at(const std::string& bytes, std::size_t at) {
  const std::uint32_t bits = u32_at(bytes, at);
  float value = 0;
  std::memcpy(&value, &bits, 4);
  return value;
}

// Checked by the standard's own rules (Khronos glTF 2.0, 3.6 and 4.4).
TEST(MeshExportFormats, GlbKeepsTheStandard) {
  const TemporaryFolder folder;
  const City city = awkward_city();
  write_mesh(folder / "a.glb", city);
  const std::string bytes = read_bytes(folder / "a.glb");
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(u32_at(bytes, 4), 2U);
  EXPECT_EQ(u32_at(bytes, 8), bytes.size());
  const std::uint32_t json_size = u32_at(bytes, 12);
  ASSERT_EQ(json_size % 4, 0U);
  ASSERT_EQ(bytes.substr(16, 4), "JSON");
  const auto json = nlohmann::json::parse(bytes.substr(20, json_size));
  const std::size_t chunk = 20 + json_size;
  const std::uint32_t binary_size = u32_at(bytes, chunk);
  ASSERT_EQ(bytes.substr(chunk + 4, 4), std::string("BIN\0", 4));
  ASSERT_EQ(chunk + 8 + binary_size, bytes.size());
  EXPECT_EQ(json["buffers"][0]["byteLength"], binary_size);
  EXPECT_FALSE(json.contains("extensionsUsed"));
  EXPECT_NEAR(json["asset"]["extras"]["origin"]["latitude_deg"].get<double>(), 55.82, 1e-12);

  const auto& accessors = json["accessors"];
  const auto start_of = [&](const nlohmann::json& accessor) {
    const auto& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    const std::size_t offset = accessor["byteOffset"];
    const std::size_t size = accessor["type"] == "VEC3" ? 12 : 4;
    EXPECT_EQ(offset % 4, 0U);
    EXPECT_LE(offset + size * accessor["count"].get<std::size_t>(), view["byteLength"].get<std::size_t>());
    EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), binary_size);
    return chunk + 8 + view["byteOffset"].get<std::size_t>() + offset;
  };
  std::size_t triangles = 0;
  Box bounds;
  for (const auto& node : json["nodes"]) {
    if (!node.contains("mesh")) continue;
    for (const auto& primitive : json["meshes"][node["mesh"].get<std::size_t>()]["primitives"]) {
      const auto& position = accessors[primitive["attributes"]["POSITION"].get<std::size_t>()];
      const std::size_t positions = start_of(position);
      const std::size_t count = position["count"];
      std::array<float, 3> low{1e30F, 1e30F, 1e30F};
      std::array<float, 3> high{-1e30F, -1e30F, -1e30F};
      for (std::size_t i = 0; i < 3 * count; ++i) {
        const float value = f32_at(bytes, positions + 4 * i);
        low[i % 3] = std::min(low[i % 3], value);
        high[i % 3] = std::max(high[i % 3], value);
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(position["min"][axis].get<float>(), low[axis]);
        EXPECT_EQ(position["max"][axis].get<float>(), high[axis]);
      }
      // Y up: east is x, north is -z.
      const auto& t = node["translation"];
      bounds.min = bounds.min.cwiseMin(Eigen::Vector3d(
          low[0] + t[0].get<double>(), -high[2] - t[2].get<double>(), low[1] + t[1].get<double>()));
      bounds.max = bounds.max.cwiseMax(Eigen::Vector3d(
          high[0] + t[0].get<double>(), -low[2] - t[2].get<double>(), high[1] + t[1].get<double>()));
      const auto& index = accessors[primitive["indices"].get<std::size_t>()];
      const std::size_t indices = start_of(index);
      for (std::size_t i = 0; i < index["count"].get<std::size_t>(); ++i) {
        EXPECT_LT(u32_at(bytes, indices + 4 * i), count);
      }
      triangles += index["count"].get<std::size_t>() / 3;
      EXPECT_LT(primitive["material"].get<std::size_t>(), json["materials"].size());
    }
  }
  EXPECT_EQ(triangles, city.mesh.triangles.size());
  EXPECT_LT((bounds.min - city.bounds().min).norm(), 1e-3);
  EXPECT_LT((bounds.max - city.bounds().max).norm(), 1e-3);
}

// Read by the basic rules of the format (Wavefront's appendix B1), in double precision.
TEST(MeshExportFormats, ObjHoldsMicrometres) {
  const TemporaryFolder folder;
  const City city = awkward_city();
  write_mesh(folder / "a.obj", city);
  std::istringstream in(read_bytes(folder / "a.obj"));
  std::vector<Eigen::Vector3d> vertices;
  double area = 0;
  std::size_t objects = 0;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "o") ++objects;
    if (key == "v") {
      Eigen::Vector3d v;
      words >> v.x() >> v.y() >> v.z();
      vertices.push_back(v);
    }
    if (key == "f") {
      std::array<std::size_t, 3> f{};
      words >> f[0] >> f[1] >> f[2];
      ASSERT_LE(*std::max_element(f.begin(), f.end()), vertices.size());
      const Eigen::Vector3d a = vertices[f[0] - 1];
      area += (vertices[f[1] - 1] - a).cross(vertices[f[2] - 1] - a).norm() / 2;
    }
  }
  EXPECT_EQ(objects, city.mesh.objects.size());
  double expected = 0;
  for (const auto& [a, b, c] : city.mesh.triangles) {
    const auto& v = city.mesh.vertices;
    expected += (v[b] - v[a]).cross(v[c] - v[a]).norm() / 2;
  }
  EXPECT_NEAR(area, expected, 1e-9 * expected);
  const std::string library = read_bytes(folder / "a.mtl");
  for (const Material material : materials_of(city.mesh)) {
    EXPECT_THAT(library, HasSubstr("newmtl " + std::string(material_name(material)) + "\n"));
  }
}

TEST(MeshExportFormats, ColladaIsWellFormed) {
  CANYON_NEEDS_PROGRAM("xmllint");
  const TemporaryFolder folder;
  write_mesh(folder / "a.dae", awkward_city());
  EXPECT_EQ(canyon::test::run_program("xmllint --noout '" + (folder / "a.dae").string() + "' 2>&1").output,
            "");
  const auto count = canyon::test::run_program("xmllint --xpath \"count(//*[local-name()='node'])\" '" +
                                               (folder / "a.dae").string() + "'");
  EXPECT_EQ(std::stoul(count.output), awkward_city().mesh.objects.size());
}

TEST(MeshMarks, NodeNamesComeBack) {
  const City city = awkward_city();
  for (const NameCharacters characters :
       {NameCharacters::Utf8, NameCharacters::Word, NameCharacters::XmlName}) {
    const auto names = node_names(city.mesh.objects, characters);
    ASSERT_EQ(names.size(), city.mesh.objects.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      const NodeName read = read_node_name(names[i]);
      EXPECT_EQ(read.name, city.mesh.objects[i].name.substr(0, 120));
      EXPECT_EQ(read.surface, city.mesh.objects[i].surface);
    }
    if (characters == NameCharacters::Utf8) continue;
    auto sorted = names;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(std::adjacent_find(sorted.begin(), sorted.end()), sorted.end());
    for (const std::string& name : names) EXPECT_EQ(name.find(' '), std::string::npos) << name;
  }
}

TEST(MeshMarks, MaterialsHaveNamesOfTheirOwn) {
  for (int i = 0; i <= static_cast<int>(Material::Foliage); ++i) {
    EXPECT_EQ(material_by_name(material_name(static_cast<Material>(i))), static_cast<Material>(i));
  }
  EXPECT_EQ(material_by_name("chocolate"), Material::Unknown);
}

TEST(MeshParts, MetresAreShort) {
  const auto text = [](double metres) {
    fmt::memory_buffer out;
    append_metres(out, metres);
    return std::string(out.data(), out.size());
  };
  EXPECT_EQ(text(0), "0");
  EXPECT_EQ(text(-1e-9), "0");
  EXPECT_EQ(text(100), "100");
  EXPECT_EQ(text(-1234.5), "-1234.5");
  EXPECT_EQ(text(0.0000014), "0.000001");
}

// Surface prefixes of names are also read in files of other programs.
TEST(MeshMarks, AnotherProgramsFileMayNameSurfaces) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.obj") << "o foliage:oak\nv 0 0 0\nv 9 0 0\nv 0 0 9\nv 9 0 9\nf 1 2 3\n"
                                     "o building:Ground_floor\nf 2 4 3\no terrain\nv 0 9 0\nf 1 2 5\n";
  const City city = read_mesh_city(folder / "a.obj", {});
  ASSERT_EQ(city.mesh.objects.size(), 3U);
  EXPECT_EQ(city.mesh.objects[0].name, "oak");
  EXPECT_EQ(city.mesh.objects[0].surface, Surface::Foliage);
  EXPECT_EQ(city.mesh.objects[1].name, "Ground_floor");
  EXPECT_EQ(city.mesh.objects[1].surface, Surface::Building);
  EXPECT_EQ(city.mesh.objects[2].surface, Surface::Terrain);
}

}  // namespace
}  // namespace canyon::city
