#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "canyon/base/base64.hpp"
#include "tests/support/cityjson_house.hpp"
#include "tests/support/damaged_city.hpp"
#include "tests/support/osm_text.hpp"

// Small maps, meshes and height grids as other programs write them, with a byte left out, or a line doubled
// or left out: they give the same city, a city within a metre, a remark or an error.
namespace canyon::damaged_cities_test {
namespace {

using test::DamageCounts;

constexpr std::size_t kEvery = 3;

struct House {
  double west, south, length, width, height;
};
const std::vector<House> kHouses{{12, 9, 14, 11, 12},
                                 {43, 11, 17, 13, 21},
                                 {74, 8, 12, 16, 15},
                                 {15, 47, 19, 12, 33},
                                 {52, 52, 21, 15, 18}};

using Corner = std::array<double, 3>;
using Face = std::vector<std::size_t>;
struct Part {
  std::string name;
  std::vector<Corner> corners;
  std::vector<Face> faces;  ///< front sides outwards
};

std::vector<Part> city_parts() {
  std::vector<Part> parts{{"Ground", {{0, 0, 0}, {110, 0, 0}, {110, 90, 0}, {0, 90, 0}}, {{0, 1, 2, 3}}}};
  for (const House& h : kHouses) {
    const double east = h.west + h.length, north = h.south + h.width;
    Part part{fmt::format("House.{:03d}", parts.size()), {}, {}};
    for (const double z : {0.0, h.height}) {
      part.corners.insert(part.corners.end(),
                          {{h.west, h.south, z}, {east, h.south, z}, {east, north, z}, {h.west, north, z}});
    }
    part.faces = {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
    parts.push_back(std::move(part));
  }
  return parts;
}

/// Triangles of a part's faces.
std::vector<std::array<std::size_t, 3>> triangles_of(const Part& part) {
  std::vector<std::array<std::size_t, 3>> triangles;
  for (const Face& face : part.faces)
    for (std::size_t i = 2; i < face.size(); ++i) triangles.push_back({face[0], face[i - 1], face[i]});
  return triangles;
}

Eigen::Vector3d normal_of(const Part& part, const std::array<std::size_t, 3>& triangle) {
  const auto at = [&](std::size_t i) {
    const Corner& c = part.corners[triangle[i]];
    return Eigen::Vector3d(c[0], c[1], c[2]);
  };
  return (at(1) - at(0)).cross(at(2) - at(0)).normalized();
}

std::string obj() {  // as Blender writes it
  std::string text = "# Blender 4.0.2\n";
  std::size_t first = 1, normal = 0;
  for (const Part& part : city_parts()) {
    text += fmt::format("o {}\n", part.name);
    for (const Corner& c : part.corners) text += fmt::format("v {:.6f} {:.6f} {:.6f}\n", c[0], c[1], c[2]);
    for (const Face& face : part.faces) {
      const Eigen::Vector3d n = normal_of(part, {face[0], face[1], face[2]});
      text += fmt::format("vn {:.4f} {:.4f} {:.4f}\n", n.x(), n.y(), n.z());
    }
    text += "s 0\n";
    for (const Face& face : part.faces) {
      text += "f";
      ++normal;
      for (const std::size_t v : face) text += fmt::format(" {}//{}", first + v, normal);
      text += "\n";
    }
    first += part.corners.size();
  }
  return text;
}

std::string stl_ascii() {
  std::string text = "solid city\n";
  for (const Part& part : city_parts()) {
    for (const auto& triangle : triangles_of(part)) {
      const Eigen::Vector3d n = normal_of(part, triangle);
      text += fmt::format(" facet normal {:e} {:e} {:e}\n  outer loop\n", n.x(), n.y(), n.z());
      for (const std::size_t v : triangle) {
        const Corner& c = part.corners[v];
        text += fmt::format("   vertex {:e} {:e} {:e}\n", c[0], c[1], c[2]);
      }
      text += "  endloop\n endfacet\n";
    }
  }
  return text + "endsolid city\n";
}

template <typename T>
void put(std::string& bytes, T value) {
  std::array<char, sizeof value> raw{};
  std::memcpy(raw.data(), &value, sizeof value);
  bytes.append(raw.data(), raw.size());
}

std::string stl_binary() {
  std::string triangles;
  std::uint32_t count = 0;
  for (const Part& part : city_parts()) {
    for (const auto& triangle : triangles_of(part)) {
      const Eigen::Vector3d n = normal_of(part, triangle);
      for (const double x : {n.x(), n.y(), n.z()}) put(triangles, static_cast<float>(x));
      for (const std::size_t v : triangle)
        for (const double x : part.corners[v]) put(triangles, static_cast<float>(x));
      put(triangles, std::uint16_t{0});
      ++count;
    }
  }
  std::string head = "Exported from SketchUp";
  head.resize(80, ' ');
  put(head, count);
  return head + triangles;
}

std::string ply(bool binary) {
  std::string vertices, faces;
  std::size_t first = 0, count = 0;
  for (const Part& part : city_parts()) {
    for (const Corner& c : part.corners) {
      if (!binary) vertices += fmt::format("{:.3f} {:.3f} {:.3f}\n", c[0], c[1], c[2]);
      for (const double x : c)
        if (binary) put(vertices, static_cast<float>(x));
    }
    for (const Face& face : part.faces) {
      if (binary) put(faces, static_cast<std::uint8_t>(face.size()));
      if (!binary) faces += fmt::format("{}", face.size());
      for (const std::size_t v : face) {
        if (binary) put(faces, static_cast<std::uint32_t>(first + v));
        if (!binary) faces += fmt::format(" {}", first + v);
      }
      if (!binary) faces += "\n";
      ++count;
    }
    first += part.corners.size();
  }
  return fmt::format(
             "ply\nformat {} 1.0\ncomment by MeshLab\nelement vertex {}\nproperty float x\n"
             "property float y\nproperty float z\nelement face {}\n"
             "property list uchar int vertex_indices\nend_header\n",
             binary ? "binary_little_endian" : "ascii", first, count) +
         vertices + faces;
}

struct Gltf {
  std::string json, buffer;
};

Gltf gltf_parts(const std::string& uri) {
  Gltf out;
  std::string nodes, meshes, accessors, views, children;
  std::size_t number = 0;
  for (const Part& part : city_parts()) {
    const std::size_t at = out.buffer.size();
    Corner low = part.corners[0], high = low;
    for (const Corner& c : part.corners) {
      for (std::size_t i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], c[i]);
        high[i] = std::max(high[i], c[i]);
      }
      for (const double x : {c[0], c[2], -c[1]}) put(out.buffer, static_cast<float>(x));
    }
    const std::size_t middle = out.buffer.size();
    const auto triangles = triangles_of(part);
    for (const auto& triangle : triangles)
      for (const std::size_t v : triangle) put(out.buffer, static_cast<std::uint16_t>(v));
    const std::size_t end = out.buffer.size();
    const char* comma = number == 0 ? "" : ",\n";
    views += fmt::format(R"({}{{"buffer":0,"byteOffset":{},"byteLength":{},"target":34962}},)"
                         R"({{"buffer":0,"byteOffset":{},"byteLength":{},"target":34963}})",
                         comma, at, middle - at, middle, end - middle);
    accessors += fmt::format(
        R"({}{{"bufferView":{},"componentType":5126,"count":{},"type":"VEC3","min":[{},{},{}],"max":[{},{},{}]}},)"
        R"({{"bufferView":{},"componentType":5123,"count":{},"type":"SCALAR"}})",
        comma, 2 * number, part.corners.size(), low[0], low[2], -high[1], high[0], high[2], -low[1],
        2 * number + 1, 3 * triangles.size());
    meshes +=
        fmt::format(R"({}{{"name":"{}","primitives":[{{"attributes":{{"POSITION":{}}},"indices":{}}}]}})",
                    comma, part.name, 2 * number, 2 * number + 1);
    nodes += fmt::format(R"({}{{"name":"{}","mesh":{}}})", comma, part.name, number);
    children += fmt::format("{}{}", number == 0 ? "" : ",", number);
    ++number;
    while (out.buffer.size() % 4 != 0) out.buffer += '\0';
  }
  const std::string source = uri.empty() ? "" : R"("uri":")" + uri + base64(out.buffer) + R"(",)";
  out.json = fmt::format(
      "{{\"asset\":{{\"version\":\"2.0\",\"generator\":\"Khronos glTF Blender I/O\"}},\n"
      "\"scene\":0,\"scenes\":[{{\"nodes\":[{}]}}],\n\"nodes\":[{}],\n\"meshes\":[{}],\n"
      "\"accessors\":[{}],\n\"bufferViews\":[{}],\n\"buffers\":[{{{}\"byteLength\":{}}}]}}\n",
      children, nodes, meshes, accessors, views, source, out.buffer.size());
  return out;
}

std::string gltf() {
  return gltf_parts("data:application/octet-stream;base64,").json;
}

std::string glb() {
  Gltf parts = gltf_parts("");
  while (parts.json.size() % 4 != 0) parts.json += ' ';
  std::string bytes = "glTF";
  put(bytes, std::uint32_t{2});
  put(bytes, static_cast<std::uint32_t>(28 + parts.json.size() + parts.buffer.size()));
  put(bytes, static_cast<std::uint32_t>(parts.json.size()));
  bytes += "JSON" + parts.json;
  put(bytes, static_cast<std::uint32_t>(parts.buffer.size()));
  bytes += std::string("BIN\0", 4) + parts.buffer;
  return bytes;
}

std::string dae() {  // as SketchUp writes it
  std::string geometries, nodes;
  for (const Part& part : city_parts()) {
    std::string numbers, counts, indices;
    for (const Corner& c : part.corners) numbers += fmt::format("{:.3f} {:.3f} {:.3f} ", c[0], c[1], c[2]);
    for (const Face& face : part.faces) {
      counts += fmt::format("{} ", face.size());
      for (const std::size_t v : face) indices += fmt::format("{} ", v);
    }
    geometries += fmt::format(
        "<geometry id=\"{0}-mesh\" name=\"{0}\"><mesh>\n<source id=\"{0}-positions\">\n"
        "<float_array id=\"{0}-array\" count=\"{1}\">{2}</float_array>\n<technique_common>"
        "<accessor source=\"#{0}-array\" count=\"{3}\" stride=\"3\"><param name=\"X\" type=\"float\"/>"
        "<param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor></technique_common>\n"
        "</source>\n<vertices id=\"{0}-vertices\"><input semantic=\"POSITION\" source=\"#{0}-positions\"/>"
        "</vertices>\n<polylist count=\"{4}\"><input semantic=\"VERTEX\" source=\"#{0}-vertices\" "
        "offset=\"0\"/>\n<vcount>{5}</vcount>\n<p>{6}</p>\n</polylist></mesh></geometry>\n",
        part.name, 3 * part.corners.size(), numbers, part.corners.size(), part.faces.size(), counts, indices);
    nodes += fmt::format(
        "<node id=\"{0}\" name=\"{0}\" type=\"NODE\">\n<instance_geometry url=\"#{0}-mesh\"/>\n"
        "</node>\n",
        part.name);
  }
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
         "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
         "<asset><unit name=\"meter\" "
         "meter=\"1\"/>\n<up_axis>Z_UP</up_axis></asset>\n<library_geometries>\n" +
         geometries + "</library_geometries>\n<library_visual_scenes>\n<visual_scene id=\"Scene\">\n" +
         nodes +
         "</visual_scene>\n</library_visual_scenes>\n<scene><instance_visual_scene url=\"#Scene\"/></scene>\n"
         "</COLLADA>\n";
}

constexpr double kLongitude = 11.57, kLatitude = 48.14, kDegree_m = 111'200;

std::array<double, 2> place(double east, double north) {
  return {kLongitude + east / (kDegree_m * 0.667), kLatitude + north / kDegree_m};
}

std::string osm() {
  test::OsmText text;
  int id = 100;
  for (const House& h : kHouses) {
    const std::int64_t n = 10 * ++id;
    std::int64_t k = n;
    for (const auto& [x, y] : {std::array{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
      const auto [lon, lat] = place(h.west + x * h.length, h.south + y * h.width);
      text.node(k++, lon, lat);
    }
    text.way(id, {n, n + 1, n + 2, n + 3, n},
             {{"building", "yes"}, {"height", fmt::format("{}", h.height)}, {"roof:shape", "flat"}});
  }
  return text.text();
}

std::string overpass() {
  std::string elements;
  int id = 100;
  for (const House& h : kHouses) {
    std::string geometry, nodes;
    const std::int64_t n = 10 * ++id;
    int k = 0;
    for (const auto& [x, y] : {std::array{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}, {0.0, 0.0}}) {
      const auto [lon, lat] = place(h.west + x * h.length, h.south + y * h.width);
      geometry += fmt::format("{}\n{{ \"lat\": {:.7f}, \"lon\": {:.7f} }}", k == 0 ? "" : ",", lat, lon);
      nodes += fmt::format("{}{}", k == 0 ? "" : ",\n", n + k % 4);
      ++k;
    }
    elements += fmt::format(
        "{}{{\n\"type\": \"way\",\n\"id\": {},\n\"nodes\": [{}],\n\"geometry\": [{}],\n\"tags\": "
        "{{\n\"building\": "
        "\"yes\",\n\"height\": \"{}\"\n}}\n}}",
        elements.empty() ? "" : ",\n", id, nodes, geometry, h.height);
  }
  return "{\n\"version\": 0.6,\n\"generator\": \"Overpass API\",\n\"elements\": [\n" + elements + "\n]\n}\n";
}

std::string city_json() {
  return test::cityjson(test::cityjson_building("house", test::kHouseSolid, R"({"measuredHeight":9.0})"));
}

std::string ascii_grid() {
  const auto [west, south] = place(-150, -150);
  std::string text = fmt::format(
      "ncols 12\nnrows 12\nxllcorner {:.7f}\nyllcorner {:.7f}\ncellsize 0.0005\nNODATA_value -9999\n", west,
      south);
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 12; ++column)
      text += fmt::format("{:.1f} ", 520 + 1.3 * column + 0.7 * row);
    text += "\n";
  }
  return text;
}

struct File {
  const char* name;
  std::string text;
  int silent;  ///< of every kEvery-th byte: what nobody can know: a digit within the plausible range, a
               ///< corner or tag left out, half of the ground
};

/// The map over the heights of a grid.
simulation::CityConfig over_heights(const std::filesystem::path& path) {
  const std::filesystem::path map = path.parent_path() / "map.osm";
  if (!std::filesystem::exists(map)) std::ofstream(map, std::ios::binary) << osm();
  std::ofstream(path.parent_path() / "heights.prj")
      << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  simulation::CityConfig config = simulation::city_config(map);
  config.as<simulation::MapCity>()->terrain = {path};
  config.as<simulation::MapCity>()->build.terrain_margin_m = 20;
  return config;
}

void check(const std::vector<File>& files, const test::DamagedCity::Settings& settings = {}) {
  for (const File& file : files) {
    const DamageCounts counts = test::DamagedCity(file.name, file.text, settings).run(kEvery);
    EXPECT_LE(counts.silent.size() * test::damage_stride(kEvery),
              static_cast<std::size_t>(file.silent) * kEvery)
        << testing::PrintToString(counts.silent);
    EXPECT_GT(counts.said + counts.refused, 100) << file.name;
  }
}

TEST(DamagedCities, MeshesDoNotChangeSilently) {
  check({{"city.obj", obj(), 8},
         {"city.stl", stl_ascii(), 18},
         {"binary.stl", stl_binary(), 0},
         {"city.ply", ply(false), 7},
         {"binary.ply", ply(true), 0},
         {"city.gltf", gltf(), 0},
         {"city.glb", glb(), 0},
         {"city.dae", dae(), 3}});
}

TEST(DamagedCities, MapsDoNotChangeSilently) {
  check({{"city.osm", osm(), 53}, {"overpass.json", overpass(), 27}, {"city.json", city_json(), 2}});
}

TEST(DamagedCities, HeightsDoNotChangeSilently) {
  check({{"heights.asc", ascii_grid(), 3}}, over_heights);
}

}  // namespace
}  // namespace canyon::damaged_cities_test
