// Every source of a city and a sky for a run: the rows of the tables of `city` and `sky` in the guide of
// docs/scenario.md, in every format listed there. The files are synthetic.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/citygml_text.hpp"
#include "tests/support/cityjson_house.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/osm_text.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::simulation {
namespace {

using Folder = test::TemporaryFolder;

// --- cities ------------------------------------------------------------------------------------------

/// Writes a city's files; the text below `city:`.
struct CityFormat {
  const char* name;
  std::function<std::string(const Folder&)> write;
  bool block =
      true;  ///< a block of 20 m x 10 m, 12 m high, north-east of its zero; else something with a roof
};
std::ostream& operator<<(std::ostream& out, const CityFormat& format) {
  return out << format.name;
}

constexpr const char* kOrigin = ", origin: {latitude_deg: 48.2, longitude_deg: 11.5, height_m: 560}";

using Corners = std::array<int, 3>;
constexpr std::array<Corners, 12> kBlock{{{0, 2, 3},
                                          {0, 3, 1},
                                          {4, 5, 7},
                                          {4, 7, 6},
                                          {0, 1, 5},
                                          {0, 5, 4},
                                          {2, 6, 7},
                                          {2, 7, 3},
                                          {0, 4, 6},
                                          {0, 6, 2},
                                          {1, 3, 7},
                                          {1, 7, 5}}};
Eigen::Vector3i corner(int i) {
  return {(i & 1) != 0 ? 20 : 0, (i & 2) != 0 ? 10 : 0, (i & 4) != 0 ? 12 : 0};
}
std::string corner_text(int i) {
  const Eigen::Vector3i c = corner(i);
  return fmt::format("{} {} {}", c.x(), c.y(), c.z());
}

std::string mesh(const Folder& folder, const std::string& name, const std::string& bytes,
                 const char* key = "mesh") {
  return fmt::format("{}: {}{}", key, folder.write(name, bytes).filename().string(), kOrigin);
}

std::string obj() {
  std::string text = "o house\n";
  for (int i = 0; i < 8; ++i) text += "v " + corner_text(i) + " # corner\n";
  for (const auto& [a, b, c] : kBlock) text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}
std::string stl() {
  std::string text = "solid house\n";
  for (const Corners& face : kBlock) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int i : face) text += "vertex " + corner_text(i) + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid\n";
}
std::string ply() {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 8; ++i) text += corner_text(i) + "\n";
  for (const auto& [a, b, c] : kBlock) text += fmt::format("3 {} {} {}\n", a, b, c);
  return text;
}
std::string dae() {
  std::string positions, corners;
  for (int i = 0; i < 8; ++i) positions += corner_text(i) + " ";
  for (const auto& [a, b, c] : kBlock) corners += fmt::format("{} {} {} ", a, b, c);
  return fmt::format(
      "<COLLADA version='1.4.1'><asset><up_axis>Z_UP</up_axis></asset><library_geometries>"
      "<geometry id='g'><mesh><source id='s'><float_array id='f' "
      "count='24'>{}</float_array><technique_common>"
      "<accessor source='#f' count='8' stride='3'><param name='X' type='float'/><param name='Y' "
      "type='float'/><param name='Z' type='float'/></accessor></technique_common></source><vertices id='v'>"
      "<input semantic='POSITION' source='#s'/></vertices><triangles count='12'><input semantic='VERTEX' "
      "source='#v' offset='0'/><p>{}</p></triangles></mesh></geometry></library_geometries>"
      "<library_visual_scenes><visual_scene id='w'><node id='house'><instance_geometry url='#g'/></node>"
      "</visual_scene></library_visual_scenes><scene><instance_visual_scene url='#w'/></scene></COLLADA>",
      positions, corners);
}
/// A .gltf with its buffer in a file next to it.
std::string gltf(const Folder& folder) {
  const std::string glb = canyon::test::box_glb(20, 10, 12);
  const std::size_t size = static_cast<unsigned char>(glb[12]) | static_cast<unsigned char>(glb[13]) << 8;
  std::string json(trim(glb.substr(20, size)));
  json.insert(json.find("\"byteLength\""), "\"uri\":\"house.bin\",");
  (void)folder.write("house.bin", glb.substr(28 + size));
  return mesh(folder, "house.gltf", json);
}
std::string tiles(const Folder& folder, const char* key) {
  (void)folder.write("house.glb", canyon::test::box_glb(20, 10, 12));
  (void)folder.write("tileset.json",
                     canyon::test::tileset("\"boundingVolume\":{\"box\":[10,5,6,10,0,0,0,5,0,0,0,6]},"
                                           "\"geometricError\":0,\"content\":{\"uri\":\"house.glb\"}"));
  return std::string(key) + kOrigin;
}

canyon::test::OsmText osm() {
  canyon::test::OsmText text;
  return text.square(1, 11.5, 48.2, 1e-4, {{"building", "yes"}, {"height", "12"}});
}
void pack(const std::filesystem::path& path, const std::string& bytes) {
  gzFile out = gzopen(path.c_str(), "wb");
  gzwrite(out, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(out);
}
/// The same map, converted by osmium and bzip2.
std::string packed_osm(const Folder& folder, const std::string& name) {
  std::filesystem::copy_file(std::filesystem::path(canyon_source_dir) / "tests/data/formats" / name,
                             folder.path() / name);
  return "osm: " + name;
}
std::string overpass(const Folder& folder) {
  std::string nodes;
  const double points[4][2] = {{11.5, 48.2}, {11.5001, 48.2}, {11.5001, 48.2001}, {11.5, 48.2001}};
  for (int i = 0; i < 4; ++i)
    nodes +=
        fmt::format(R"({{"type":"node","id":{},"lon":{},"lat":{}}},)", i + 1, points[i][0], points[i][1]);
  (void)folder.write("map.json", R"({"version":0.6,"elements":[)" + nodes +
                                     R"({"type":"way","id":1,"nodes":[1,2,3,4,1],)"
                                     R"("tags":{"building":"yes","height":"12"}}]})");
  return "osm: map.json";
}
std::string world(const Folder& folder, const std::string& name) {
  (void)folder.write(
      name,
      "<sdf version='1.9'><world name='w'><spherical_coordinates><latitude_deg>48.2</latitude_deg>"
      "<longitude_deg>11.5</longitude_deg><elevation>560</elevation></spherical_coordinates>"
      "<model name='house'><static>true</static><pose>10 5 6 0 0 0</pose><link name='l'><collision name='c'>"
      "<geometry><box><size>20 10 12</size></box></geometry></collision></link></model></world></sdf>");
  return "file: " + name;
}
std::string separate_file(const Folder& folder) {
  city::City city;
  city.name = "own";
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(48.2, 11.5, 560));
  canyon::test::append_box(city.mesh, "house", city::Surface::Building, city::Material::Brick, {0, 0, 0},
                           {20, 10, 12});
  city::write_city_file(folder.path() / "own.canyon", city);
  return "file: own.canyon";
}
std::string house_json() {
  return canyon::test::cityjson(canyon::test::cityjson_building("house", canyon::test::kHouseSolid));
}
/// Its header, then a feature with its own vertices.
std::string json_sequence() {
  const std::string reference =
      R"("metadata":{"referenceSystem":"https://www.opengis.net/def/crs/EPSG/0/25832"})";
  return R"({"type":"CityJSON","version":"2.0","transform":{"scale":[0.001,0.001,0.001],"translate":[691000,5334000,500]},)" +
         reference + ",\"CityObjects\":{},\"vertices\":[]}\n" +
         R"({"type":"CityJSONFeature","id":"house","CityObjects":{)" +
         canyon::test::cityjson_building("house", canyon::test::kHouseSolid) +
         "},\"vertices\":" + canyon::test::kHouseVertices + "}\n";
}
std::string house_gml() {
  return canyon::test::citygml(canyon::test::citygml_member(canyon::test::gml_building("house")));
}
/// A raster of the ground at 500 m, in degrees.
std::string terrain(const Folder& folder) {
  std::string text = "ncols 20\nnrows 20\nxllcorner 11.49\nyllcorner 48.19\ncellsize 0.001\n";
  for (int row = 0; row < 20; ++row) text += fmt::format("{}\n", fmt::join(std::vector<int>(20, 500), " "));
  (void)folder.write("ground.asc", text);
  (void)folder.write("ground.prj",
                     "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
                     "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]");
  (void)osm().write(folder.path() / "map.osm");
  return "osm: map.osm, terrain: ground.asc, geoid_undulation_m: 46";
}

const CityFormat kCities[] = {
    {"mesh_obj", [](const Folder& f) { return mesh(f, "house.obj", obj()); }},
    {"mesh_stl", [](const Folder& f) { return mesh(f, "house.stl", stl()); }},
    {"mesh_ply", [](const Folder& f) { return mesh(f, "house.ply", ply()); }},
    {"mesh_dae", [](const Folder& f) { return mesh(f, "house.dae", dae()); }},
    {"mesh_glb", [](const Folder& f) { return mesh(f, "house.glb", canyon::test::box_glb(20, 10, 12)); }},
    {"mesh_gltf", gltf},
    {"file_obj", [](const Folder& f) { return mesh(f, "house.obj", obj(), "file"); }},
    {"file_dae", [](const Folder& f) { return mesh(f, "house.dae", dae(), "file"); }},
    {"file_canyon", separate_file},
    {"file_sdf", [](const Folder& f) { return world(f, "w.sdf"); }},
    {"file_world", [](const Folder& f) { return world(f, "w.world"); }},
    {"tiles", [](const Folder& f) { return tiles(f, "tiles: {file: tileset.json}"); }},
    {"file_tileset", [](const Folder& f) { return tiles(f, "file: tileset.json"); }},
    {"osm_xml",
     [](const Folder& f) {
       (void)osm().write(f.path() / "map.osm");
       return std::string("osm: map.osm");
     },
     false},
    {"osm_list_with_box",
     [](const Folder& f) {
       (void)osm().write(f.path() / "map.osm");
       return std::string("osm: [map.osm], bbox: [11.4, 48.1, 11.6, 48.3]");
     },
     false},
    {"file_osm",
     [](const Folder& f) {
       (void)osm().write(f.path() / "map.osm");
       return std::string("file: map.osm");
     },
     false},
    {"osm_gz",
     [](const Folder& f) {
       pack(f.path() / "map.osm.gz", osm().text());
       return std::string("osm: map.osm.gz");
     },
     false},
    {"osm_bz2", [](const Folder& f) { return packed_osm(f, "house.osm.bz2"); }, false},
    {"osm_pbf", [](const Folder& f) { return packed_osm(f, "house.osm.pbf"); }, false},
    {"osm_overpass", overpass, false},
    {"osm_terrain", terrain, false},
    {"citygml",
     [](const Folder& f) {
       (void)f.write("house.gml", house_gml());
       return std::string("osm: house.gml");
     },
     false},
    {"citygml_gz",
     [](const Folder& f) {
       pack(f.path() / "house.gml.gz", house_gml());
       return std::string("osm: house.gml.gz");
     },
     false},
    {"citygml_folder",
     [](const Folder& f) {
       std::filesystem::create_directory(f.path() / "tiles");
       (void)f.write("tiles/house.gml", house_gml());
       return std::string("osm: tiles/");
     },
     false},
    {"cityjson",
     [](const Folder& f) {
       (void)f.write("house.city.json", house_json());
       return std::string("osm: house.city.json");
     },
     false},
    {"file_cityjson",
     [](const Folder& f) {
       (void)f.write("house.json", house_json());
       return std::string("file: house.json");
     },
     false},
    {"cityjson_sequence",
     [](const Folder& f) {
       (void)f.write("house.city.jsonl", json_sequence());
       return std::string("osm: house.city.jsonl");
     },
     false},
    {"synthetic",
     [](const Folder& /*f*/) { return std::string("synthetic: {blocks_east: 1, blocks_north: 1}"); }, false},
};

class CityFormats : public ::testing::TestWithParam<CityFormat> {};

TEST_P(CityFormats, ReachARun) {
  const CityFormat& format = GetParam();
  const Folder folder;
  const std::string city = format.write(folder);
  Scenario scenario =
      parse_scenario("city: {" + city +
                         "}\nsky: {nominal: true}\nstart: 2026-06-01T08:00:00Z\nduration_s: 1\n"
                         "trajectory: {position: {east_m: 10, north_m: -1, up_m: 1.5}}\n"
                         "receivers: [{name: r, profile: ideal}]\n",
                     folder.path() / "s.yaml");
  city::City loaded = load_city(scenario);
  const city::CitySummary summary = city::summarize(loaded);
  EXPECT_EQ(summary.buildings, std::string_view(format.name) == "synthetic" ? 4U : 1U);
  EXPECT_GT(summary.highest_roof_m, 5);
  if (format.block) {
    EXPECT_LT((summary.bounds.min - Eigen::Vector3d::Zero()).norm(), 1e-3);
    EXPECT_LT((summary.bounds.max - Eigen::Vector3d(20, 10, 12)).norm(), 1e-3);
    EXPECT_THAT(loaded.notes.warnings(), ::testing::IsEmpty());
  }
  const Simulation simulation(std::move(scenario), std::move(loaded));
  EXPECT_EQ(simulation.run({}).epochs, 2U);
}

INSTANTIATE_TEST_SUITE_P(All, CityFormats, ::testing::ValuesIn(kCities),
                         [](const auto& each) { return std::string(each.param.name); });

// --- skies -------------------------------------------------------------------------------------------

/// Writes a sky's files; the text below `sky:`.
struct SkyFormat {
  const char* name;
  std::function<std::string(const Folder&)> write;
  std::size_t satellites;  ///< minimum number
};
std::ostream& operator<<(std::ostream& out, const SkyFormat& format) {
  return out << format.name;
}

const geodesy::GpsTime kNoon = geodesy::parse_time("2026-06-01T12:00:00Z");

gnss::NavigationData constellation(const std::set<gnss::System>& systems) {
  return orbit::nominal_constellation(kNoon - 60, kNoon + 60, systems);
}
const std::set<gnss::System> kGps{gnss::System::GPS};
const std::set<gnss::System> kAll{gnss::System::GPS, gnss::System::GLONASS, gnss::System::Galileo,
                                  gnss::System::BeiDou};

/// Text of RINEX 3.04 as records of lines after the header.
std::pair<std::string, std::vector<std::string>> records(const std::set<gnss::System>& systems) {
  const std::string text = rinex::format_rinex_navigation(constellation(systems));
  const std::size_t end = text.find('\n', text.find("END OF HEADER")) + 1;
  std::vector<std::string> all;
  const std::string body = text.substr(end);
  for (const std::string_view line : split(trim(body), '\n')) {
    if (!line.empty() && line.front() != ' ') all.emplace_back();
    all.back() += std::string(line) + "\n";
  }
  return {text.substr(0, end), all};
}
std::string rinex3(const std::set<gnss::System>& systems) {
  return rinex::format_rinex_navigation(constellation(systems));
}
/// RINEX 4 of the same: each record after a line with its kind.
std::string rinex4() {
  auto [text, all] = records(kAll);
  text.replace(text.find("3.04"), 4, "4.00");
  for (const std::string& record : all) {
    const char system = record.front();
    text += fmt::format("> EPH {} {}\n{}", record.substr(0, 3),
                        system == 'G'   ? "LNAV"
                        : system == 'E' ? "INAV"
                        : system == 'R' ? "FDMA"
                                        : "D1",
                        record);
  }
  return text;
}
/// RINEX 2.11 of the same: numbers for names, years of two digits, and lines one column to the left.
std::string rinex2(gnss::System system) {
  const bool glonass = system == gnss::System::GLONASS;
  std::string text = fmt::format("{:9.2f}{:11}{:<40}RINEX VERSION / TYPE\n", 2.11, "",
                                 glonass ? "GLONASS NAV DATA" : "NAVIGATION DATA");
  if (!glonass) {
    text +=
        fmt::format("{:<60}ION ALPHA\n{:<60}ION BETA\n", "    0.1118D-07 -0.7451D-08 -0.5961D-07  0.1192D-06",
                    "    0.1167D+06 -0.2294D+06 -0.1311D+06  0.1049D+07");
  }
  text += fmt::format("{:60}END OF HEADER\n", "");
  text[20] = glonass ? 'G' : 'N';
  for (const std::string& record : records({system}).second) {
    const auto lines = split(trim(record), '\n');
    const std::string_view first = lines.front();
    text += fmt::format("{} {} {:2} {:2} {:2} {:2}{:5.1f}{}\n", first.substr(1, 2), first.substr(6, 2),
                        trim(first.substr(9, 2)), trim(first.substr(12, 2)), trim(first.substr(15, 2)),
                        trim(first.substr(18, 2)), parse_double(trim(first.substr(21, 2))).value_or(0),
                        first.substr(23));
    for (std::size_t i = 1; i < lines.size(); ++i) text += std::string(lines[i].substr(1)) + "\n";
  }
  return text;
}
/// SP3 of GPS's constellation, every 15 minutes, with this many epochs before and after noon.
std::string sp3(int first, int last) {
  const orbit::BroadcastSky sky(orbit::nominal_constellation(kNoon - 4 * 3600.0, kNoon + 4 * 3600.0, kGps),
                                {kGps});
  const std::vector<gnss::SatelliteId> ids = sky.satellites();
  const auto date = [](geodesy::GpsTime t) {
    const geodesy::CalendarTime c = geodesy::calendar_from_gps(t);
    return fmt::format("{:4} {:2} {:2} {:2} {:2} {:11.8f}", c.year, c.month, c.day, c.hour, c.minute,
                       1. * c.second);
  };
  const geodesy::GpsTime noon = geodesy::parse_time("2026-06-01T12:00:00 GPST");
  std::string text =
      fmt::format("#dP{} {:7} ORBIT IGS20 FIT  XXX\n", date(noon + 900.0 * first), last - first + 1);
  text += "## 2421 129600.00000000   900.00000000 61192 0.0000000000000\n";
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (i % 17 == 0) text += i == 0 ? fmt::format("+  {:3}   ", ids.size()) : "\n+        ";
    text += to_string(ids[i]);
  }
  text += "\n++         2\n%c M  cc GPS ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n";
  for (int k = first; k <= last; ++k) {
    text += "*  " + date(noon + 900.0 * k) + "\n";
    for (const gnss::SatelliteId id : ids) {
      const auto state = sky.state(id, noon + 900.0 * k);
      if (!state) continue;
      const Eigen::Vector3d p = state->position_m / 1e3;
      text += fmt::format("P{}{:14.6f}{:14.6f}{:14.6f}{:14.6f}\n", to_string(id), p.x(), p.y(), p.z(), 0.0);
    }
  }
  return text + "EOF\n";
}

const SkyFormat kSkies[] = {
    {"nominal", [](const Folder& /*f*/) { return std::string("nominal: true"); }, 20},
    {"nominal_of_systems",
     [](const Folder& /*f*/) { return std::string("nominal: true, systems: [GPS, Galileo]"); }, 12},
    {"frozen",
     [](const Folder& /*f*/) {
       return std::string(
           "frozen: {satNum: 5, satAzimuth: [0, 1, 2, 4, 5], satElevation: [1, 0.8, 1.2, 0.9, 1.4]}");
     },
     5},
    {"rinex3",
     [](const Folder& f) {
       (void)f.write("sky.rnx", rinex3(kAll));
       return std::string("navigation: sky.rnx");
     },
     20},
    {"rinex3_list",
     [](const Folder& f) {
       (void)f.write("a.rnx", rinex3(kGps));
       (void)f.write("b.rnx", rinex3({gnss::System::Galileo}));
       return std::string("navigation: [a.rnx, b.rnx]");
     },
     12},
    {"rinex3_gz",
     [](const Folder& f) {
       pack(f.path() / "sky.rnx.gz", rinex3(kAll));
       return std::string("navigation: [sky.rnx.gz]");
     },
     20},
    {"rinex4",
     [](const Folder& f) {
       (void)f.write("sky.rnx", rinex4());
       return std::string("navigation: [sky.rnx]");
     },
     20},
    {"rinex2_of_two_systems",
     [](const Folder& f) {
       (void)f.write("day.26n", rinex2(gnss::System::GPS));
       (void)f.write("day.26g", rinex2(gnss::System::GLONASS));
       return std::string("navigation: [day.26n, day.26g]");
     },
     12},
    {"rinex_stale",
     [](const Folder& f) {
       (void)f.write("sky.rnx", rinex3(kGps));
       return std::string("navigation: [sky.rnx], allow_stale: true");
     },
     5},
    {"sp3",
     [](const Folder& f) {
       (void)f.write("day.sp3", sp3(-10, 10));
       return std::string("sp3: day.sp3, systems: [GPS]");
     },
     5},
    {"sp3_list",
     [](const Folder& f) {
       (void)f.write("first.sp3", sp3(-10, 0));
       (void)f.write("second.sp3", sp3(1, 10));
       return std::string("sp3: [first.sp3, second.sp3], systems: [GPS]");
     },
     5},
    {"sp3_gz",
     [](const Folder& f) {
       pack(f.path() / "day.sp3.gz", sp3(-10, 10));
       return std::string("sp3: [day.sp3.gz], systems: [GPS]");
     },
     5},
};

class SkyFormats : public ::testing::TestWithParam<SkyFormat> {};

TEST_P(SkyFormats, ReachARun) {
  const SkyFormat& format = GetParam();
  const Folder folder;
  const std::string sky = format.write(folder);
  Scenario scenario = parse_scenario(
      "city: {open: true, origin: {latitude_deg: 48.2, longitude_deg: 11.5, height_m: 560}}\nsky: {" + sky +
          "}\nstart: 2026-06-01T12:00:00Z\nduration_s: 2\n"
          "trajectory: {position: {east_m: 0, north_m: 0, up_m: 1.5}}\n"
          "receivers: [{name: r, profile: ideal}]\n",
      folder.path() / "s.yaml");
  city::City city = load_city(scenario);
  const Simulation simulation(std::move(scenario), std::move(city));
  EXPECT_THAT(simulation.warnings(), ::testing::IsEmpty());
  struct Sink final : EpochSink {
    void write(const Epoch& epoch) override {
      tracked = static_cast<std::size_t>(epoch.observed.visible);
      error_m = epoch.error_enu_m.norm();
    }
    void finish() override {}
    std::size_t tracked = 0;
    double error_m = 1e9;
  } sink;
  EXPECT_EQ(simulation.run({&sink}).epochs, 3U);
  EXPECT_GE(sink.tracked, format.satellites);
  EXPECT_LT(sink.error_m, 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, SkyFormats, ::testing::ValuesIn(kSkies),
                         [](const auto& each) { return std::string(each.param.name); });

}  // namespace
}  // namespace canyon::simulation
