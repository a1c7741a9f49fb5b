#include "tests/fuzz/targets.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <bzlib.h>
#include <zlib.h>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <osmium/io/pbf_output.hpp>
#include <osmium/io/reader.hpp>
#include <osmium/io/writer.hpp>
#include <osmium/io/xml_input.hpp>

#include "canyon/analysis/heatmap/files/area_file.hpp"
#include "canyon/analysis/heatmap/kernels/grid.hpp"
#include "canyon/analysis/study/study.hpp"
#include "canyon/analysis/validation/recorded_scene.hpp"
#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/mavlink/frames.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/city_files.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/city/tiles/read_tiles.hpp"
#include "canyon/city/tiles/tile_content.hpp"
#include "canyon/city/tiles/tile_selection.hpp"
#include "canyon/outputs/encoding/device.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/pose_source.hpp"
#include "canyon/outputs/view/probe.hpp"
#include "canyon/receiver/rtcm/rtcm_file.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/orbit/precise_sky.hpp"
#include "canyon/sky/rinex/android_log.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/citygml_text.hpp"
#include "tests/support/cityjson_house.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/observation_text.hpp"
#include "tests/support/osm_text.hpp"
#include "tests/support/rinex_sample.hpp"
#include "tests/support/sample_signals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::fuzz {
namespace {

namespace fs = std::filesystem;

const fs::path& folder() {
  static const test::TemporaryFolder instance;
  return instance.path();
}

/// The bytes written by `write` to a file of that name.
template <typename Write>
std::string written(const std::string& name, const Write& write) {
  const fs::path path = folder() / name;
  write(path);
  return test::read_bytes(path);
}

std::string observations3() {
  return test::observations3() + "> 2019 04 28 12 44 34.0000000  0  2\nG05" +
         test::field(20604864.859, ' ', '7') + test::field(108280000.25, '1') + test::field(-812.5) +
         test::field(44) + "\nR07" + test::field(2.1e7) + "\n> 2019 04 28 12 44 35.0000000  4  1\n" +
         test::header_line("moved", "COMMENT") + "> 2019 04 28 12 44 36.0000000  1  1\nC03" +
         test::field(3.8e7) + "\n";
}

std::string observations2() {
  const std::string satellite =
      test::field(1e8) + test::blank_field() + test::field(2e7) + "\n" + test::field(-10) + "\n";
  return test::observations2() + " 19  4 28 12 44 34.0000000  0  2G 5R 6\n" + satellite + satellite;
}

/// Observations in Hatanaka's compression: differences of first to third order.
std::string compact_observations() {
  return test::header_line("3.0                 COMPACT RINEX FORMAT", "CRINEX VERS   / TYPE") +
         test::header_line("", "CRINEX PROG / DATE") + test::observations3() +
         "> 2019 04 28 12 44 34.0000000  0  2      G05R07\n\n"
         "3&20604864859 3&108280000250 3&-812500 3&44000            7\n3&21000000000\n"
         "                    5\n3&-100000000\n650125 3416750 250 0\n1000\n"
         "                    6\n0\n-125 250 0 0\n-25\n";
}

/// A satellite on a circle, one record every quarter of an hour.
std::string sp3() {
  std::string text =
      "#dP2024  2 29  0  0  0.00000000      14 ORBIT IGS20 FIT  XXX\n"
      "%c M  cc GPS ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n";
  for (int k = 0; k < 14; ++k) {
    text += fmt::format("*  2024  2 29 {:2} {:2}  0.00000000\nPG07{:14.6f}{:14.6f}{:14.6f}{:14.6f}\n", k / 4,
                        15 * (k % 4), 26560 * std::cos(0.065643 * k), 26560 * std::sin(0.065643 * k), 0.0,
                        100 + 0.9 * k);
  }
  return text + "EOF\n";
}

std::string osm() {
  return test::OsmText()
      .square(1, 10, 50, 0.001, {{"building", "yes"}, {"height", "12 m"}, {"roof:shape", "gabled"}})
      .square(2, 10.002, 50, 0.003)
      .square(3, 10.003, 50.001, 0.001, {{"building:part", "yes"}})
      .node(5, 10.1, 50, {{"natural", "tree"}})
      .relation(9, {{"way", 2, "outer"}, {"way", 3, "inner"}},
                {{"type", "multipolygon"}, {"building", "office"}})
      .relation(7, {{"relation", 9, "outline"}, {"way", 3, "part"}}, {{"type", "building"}})
      .text();
}

std::string pbf(const char* format) {
  const fs::path xml = folder() / "seed.osm";
  std::ofstream(xml, std::ios::binary) << osm();
  return written("seed.pbf", [&](const fs::path& path) {
    osmium::io::Reader reader{xml.string()};
    osmium::io::Writer writer{osmium::io::File{path.string(), format}, osmium::io::overwrite::allow};
    while (osmium::memory::Buffer buffer = reader.read()) writer(std::move(buffer));
    writer.close();
  });
}

city::City houses() {
  city::City city;
  city.name = "houses";
  canyon::test::append_box(city.mesh, "a", city::Surface::Building, city::Material::Glass, {0, 0, 0},
                           {10, 20, 30});
  canyon::test::append_box(city.mesh, "b", city::Surface::Foliage, city::Material::Wood, {30, 0, -1},
                           {31, 2, 5});
  return city;
}

std::string mesh(const std::string& name) {
  return written(name, [](const fs::path& path) { city::write_mesh(path, houses()); });
}

const char* const kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

const char* const kWorld = R"(<?xml version="1.0"?>
<sdf version="1.6"><world name="w">
 <spherical_coordinates><surface_model>EARTH_WGS84</surface_model><latitude_deg>22.3</latitude_deg>
  <longitude_deg>114.17</longitude_deg><elevation>3</elevation><heading_deg>10</heading_deg></spherical_coordinates>
 <model name="m"><static>true</static><pose>1 2 3 0 0 0.5</pose>
  <link name="l"><collision name="c"><geometry><box><size>1 2 3</size></box></geometry></collision>
   <collision name="d"><pose>0 0 1 0 0 0</pose><geometry><cylinder><radius>1</radius><length>2</length></cylinder>
   </geometry></collision></link>
  <link name="k"><visual name="v"><geometry><sphere><radius>2</radius></sphere></geometry></visual>
   <visual name="p"><geometry><plane><normal>0 0 1</normal><size>9 9</size></plane></geometry></visual></link>
 </model>
 <frame name="f" attached_to="m::k"><pose>1 0 0 0 0 0</pose></frame>
 <model name="n" placement_frame="a"><static>true</static><pose relative_to="f">1 2 3 0 0 0.5</pose>
  <link name="a"/><link name="b"><pose relative_to="j">4 0 0 0 0 0</pose><collision name="c">
   <pose relative_to="a">1 0 0 0 0 0</pose><geometry><box><size>1 2 3</size></box></geometry></collision></link>
  <joint name="j" type="fixed"><parent>world</parent><child>a</child></joint>
 </model>
</world></sdf>
)";

const char* const kScenario = R"(city:
  synthetic: {blocks_east: 2, blocks_north: 2, seed: 7}
  origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
duration_s: 60
rate_hz: 2
trajectory:
  waypoints: [{east_m: -8, north_m: 0}, {east_m: 8, north_m: 0}]
  speed_mps: 5
  height_above_terrain_m: 1.5
receivers:
  - name: car
    profile: ublox-m8t
    lever_arm: {forward_m: 0.1, left_m: 0, up_m: 1.5}
    elevation_mask_deg: 10
  - name: other
outputs: {kml: false}
seed: 3
)";

const char* const kNmea =
    "$GPRMC,125803.00,A,2218.0000,N,11410.0000,E,0.1,90.0,280419,,,A\r\n"
    "$GPGGA,125803.00,2218.0000,N,11410.0000,E,1,08,1.0,5.0,M,-2.0,M,,\r\n"
    "$GPGGA,125804.00,2218.0001,N,11410.0001,E,1,08,1.0,5.0,M,-2.0,M,,\r\n"
    "$GPZDA,125805.00,28,04,2019,00,00\r\n"
    "$GPGGA,125805.00,2218.0002,N,11410.0002,E,1,08,1.0,5.0,M,-2.0,M,,\r\n";

const char* const kArea =
    R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{},"geometry":
{"type":"MultiPolygon","coordinates":[[[[114.17,22.3],[114.171,22.3],[114.171,22.301],[114.17,22.3]]],
[[[114.172,22.3],[114.173,22.3],[114.173,22.301],[114.172,22.301],[114.172,22.3]],
[[114.1722,22.3002],[114.1724,22.3002],[114.1724,22.3004],[114.1722,22.3002]]]]}}]})";

const geodesy::GpsTime kStart = geodesy::GpsTime::from_week(2100, 3600);

std::function<void(const fs::path&)> trajectory(const char* format) {
  return [format](const fs::path& path) {
    const simulation::TrajectoryFile file = simulation::read_trajectory_file(path, format, kStart);
    (void)file.trajectory.at(file.trajectory.begin() + 0.5);
  };
}

/// Reads the result back: it must be a file of its own format, or one that cannot be written.
void read_navigation(const fs::path& path) {
  const gnss::NavigationData data = rinex::read_rinex_navigation(path);
  (void)rinex::read_rinex_navigation(
      TextFile::from_string(rinex::format_rinex_navigation(data), "again.rnx"));
}

void read_sp3(const fs::path& path) {
  const orbit::PreciseSky sky(path);
  const auto [begin, end] = sky.span();
  for (const gnss::SatelliteId id : sky.satellites()) (void)sky.state(id, begin + (end - begin) / 2);
}

/// For each compression: to the end, or up to the rejected sizes.
void read_packed(const fs::path& path) {
  GzipFile file(path);
  std::string block(std::size_t{1} << 16, '\0');
  std::size_t size = 0;
  while (const std::size_t n = file.read(block.data(), block.size(), 1)) size += n;
  if (size > kMaxUnpacked) std::abort();
}

/// The same text, packed by gzip, bzip2, compress and zip.
std::vector<std::string> archives() {
  const std::string text = "some text, and some text, and some text\n";
  std::vector<std::string> seeds{text, written("seed.gz", [&](const fs::path& path) {
                                   gzFile file = gzopen(path.c_str(), "wb");
                                   (void)gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
                                   (void)gzclose(file);
                                 })};
  std::string packed(1000, '\0'), plain = text;
  auto size = static_cast<unsigned>(packed.size());
  (void)BZ2_bzBuffToBuffCompress(packed.data(), &size, plain.data(), static_cast<unsigned>(plain.size()), 1,
                                 0, 0);
  seeds.push_back(packed.substr(0, size));
  for (const char* name : {"containers/good.n.Z", "containers/good.n.zip"})
    seeds.push_back(test::read_bytes(test::case_file(name)));
  return seeds;
}

/// A frame of each message, complete and mixed with other bytes.
std::string mavlink_stream() {
  std::string stream;
  std::uint8_t sequence = 0;
  for (const mavlink::Message& message : std::initializer_list<mavlink::Message>{
           mavlink::SimState{}, mavlink::AttPosMocap{}, mavlink::Odometry{}, mavlink::HilStateQuaternion{},
           mavlink::GpsRawInt{}}) {
    stream += mavlink::encode(message, sequence++) + "\xFD\xFEx";
  }
  return stream + mavlink::encode(mavlink::LocalPositionNed{}, sequence, {}, mavlink::Version::V1);
}

/// For any cut of the bytes the same frames are found, and decoded messages can be written.
void read_mavlink(const fs::path& path) {
  const std::string bytes = test::read_bytes(path);
  std::string whole, cut;
  mavlink::MavlinkParser one, other;
  const auto into = [](std::string& to) {
    return [&to](const mavlink::Frame& f) { to += mavlink::encode(f.message, f.sequence, f.sender); };
  };
  one.receive(bytes, into(whole));
  for (std::size_t at = 0; at < bytes.size(); at += 3)
    other.receive(std::string_view(bytes).substr(at, 3), into(cut));
  if (whole != cut || one.passed_over() != other.passed_over()) std::abort();
}

std::string no_file(const std::string& uri) {
  throw InputError(uri, "tiles under test stand alone");
}

void read_tileset(const fs::path& path) {
  (void)tiles::is_tileset(path);
  tiles::TileOptions options;
  options.file = path;
  options.max_tiles = 20;
  (void)tiles::read_tiles(options, geodesy::Geodetic::from_degrees(48.2, 11.5, 560));
}

std::string subtree() {
  std::string json =
      R"({"buffers":[{"byteLength":16}],"bufferViews":[{"buffer":0,"byteLength":10}],"tileAvailability":)"
      R"({"bitstream":0},"contentAvailability":[{"constant":1}],"childSubtreeAvailability":{"constant":0}})";
  while (json.size() % 8 != 0) json += ' ';
  return "subt" + test::bytes_of<std::uint32_t>({1}) + test::bytes_of<std::uint64_t>({json.size(), 16}) +
         json + std::string(16, '\x5B');
}

/// Tilesets with embedded files as data: URIs; one refers to itself.
std::vector<std::string> tilesets() {
  const std::string box = R"("boundingVolume":{"box":[0,0,0,50,0,0,0,50,0,0,0,50]},"geometricError":)";
  const std::string content = R"("content":{"uri":"data:;base64,)" +
                              base64(test::triangle_glb({0, 0, 0, 9, 0, 0, 0, 9, 0}, {0, 1, 2})) + R"("})";
  return {test::tileset(box + "9," + content + R"(,"refine":"ADD","children":[{)" + box +
                        R"(0,"content":{"uri":"tileset.json"}}])"),
          test::tileset(
              box + "8," + content +
              R"(,"implicitTiling":{"subdivisionScheme":"OCTREE","subtreeLevels":2,"availableLevels":4,)"
              R"("subtrees":{"uri":"data:;base64,)" +
              base64(subtree()) + R"("}})")};
}

std::vector<std::string> tile_seeds() {
  const std::string gltf =
      test::triangle_glb({0, 0, 0, 9, 0, 0, 0, 9, 0}, {0, 1, 2}, R"(,"scale":[2,2,2])", "glass", {0, 0, 0});
  const std::string batched = test::b3dm(gltf, R"({"BATCH_LENGTH":1,"RTC_CENTER":[1,2,3]})",
                                         R"({"name":["a"],"class":["Building"]})");
  const std::string features = R"({"INSTANCES_LENGTH":1,"POSITION":{"byteOffset":0}})";
  const std::string instanced =
      "i3dm" +
      test::bytes_of<std::uint32_t>({1, static_cast<std::uint32_t>(44 + features.size() + gltf.size()),
                                     static_cast<std::uint32_t>(features.size()), 12, 0, 0, 1}) +
      features + test::bytes_of<float>({1, 2, 3}) + gltf;
  const std::string composite =
      "cmpt" + test::bytes_of<std::uint32_t>({1, static_cast<std::uint32_t>(16 + batched.size()), 1}) +
      batched;
  return {gltf, batched, instanced, composite};
}

/// A mesh in the format suggested by its bytes.
void read_meshes(const fs::path& path) {
  const std::string text = test::read_bytes(path);
  const auto begins = [&text](std::string_view with) { return text.rfind(with, 0) == 0; };
  const char* ending = begins("ply") ? ".ply" : begins("<") ? ".dae" : begins("v ") ? ".obj" : ".stl";
  if (begins("glTF") || begins("{")) ending = ".glb";
  (void)city::read_node_name(text);
  fs::path named = path;
  fs::copy_file(path, named.replace_extension(ending), fs::copy_options::overwrite_existing);
  (void)city::read_mesh_part(named, {});
}

// A device of each generation receives the bytes in pieces from two readers, between epochs.
void receive_ubx(const fs::path& path) {
  const std::string bytes = test::read_bytes(path);
  using simulation::UbxGeneration;
  std::vector<std::unique_ptr<encoding::Encoder>> encoders;
  encoders.push_back(encoding::encode_sbf({"rover"}));
  for (const UbxGeneration generation : {UbxGeneration::M8, UbxGeneration::F9, UbxGeneration::X20})
    encoders.push_back(encoding::encode_ubx({.name = "rover", .ubx_generation = generation}));
  for (const auto& encoder : encoders) {
    encoding::Device* const device = encoder->device();
    (void)encoder->encode(test::sample_signal_epoch(test::sample_time(), test::sample_time()));
    std::size_t at = 0;
    for (std::uint64_t piece = 0; at < bytes.size(); ++piece) {
      const std::size_t size = 1 + static_cast<unsigned char>(bytes[at]) % 64;
      if (device->receive(piece % 5 == 0 ? 1 : 0, std::string_view(bytes).substr(at, size)).size() >
          (96 << 10)) {
        std::abort();  // responses are bounded
      }
      at += size;
    }
    (void)device->take_baud();
    const auto epoch = test::sample_signal_epoch(test::sample_time() + 1, test::sample_time());
    (void)encoder->encode(epoch);
    (void)device->encode_for_reader(1);
  }
}

/// Feeds a source of poses with packets cut according to the bytes.
template <simulation::PoseFormat kFormat>
void receive_poses(const fs::path& path) {
  const std::string bytes = test::read_bytes(path);
  const geodesy::LocalFrame frame(test::sample_point());
  simulation::PoseSourceOptions options;
  options.format = kFormat;
  options.axes = simulation::WorldAxes::NED;
  options.messages = kFormat == simulation::PoseFormat::MAVLink
                         ? std::vector<std::string>{"SIM_STATE", "ODOMETRY", "LOCAL_POSITION_NED"}
                         : std::vector<std::string>{};
  live::PoseSource source(options, frame);
  std::size_t at = 0;
  for (std::int64_t piece = 0; at < bytes.size(); ++piece) {
    const std::size_t size = 1 + static_cast<unsigned char>(bytes[at]);
    source.receive({static_cast<std::uint64_t>(piece % 7), bytes.substr(at, size), piece % 3 == 0},
                   piece * 1'000'000);
    at += size;
  }
  std::string reason;
  const auto motion = source.track().at(1'000'000'000, reason);
  if (motion && !motion->position_m.allFinite()) std::abort();
  (void)source.take_notes();
  live::PoseSource log(options, frame);
  log.receive_log(
      {0, bytes}, false, [](std::int64_t) {}, [] { return true; });
}
std::vector<std::string> json_poses() {
  return {
      R"({"time_s": 12.34, "id": "uav1", "position_m": [1.5, -2, 0.8], "attitude": [1, 0, 0, 0], "velocity_mps": )"
      R"([0, 0.1, 0], "rates_radps": [0, 0, 0.2]})"
      "\n",
      R"({"time_s": 12.35, "latitude_deg": 22.301, "longitude_deg": 114.172, "height_m": 12, "yaw_deg": 90})"
      "\n"};
}
std::string binary_pose() {
  std::string b(live::kBinarySize, '\0');
  b.replace(0, 5, "CNY1\x03");
  const auto crc = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(b.data()), static_cast<uInt>(b.size() - 4)));
  std::memcpy(b.data() + b.size() - 4, &crc, 4);
  return b + b;
}
/// Commands to receivers that persist from one input to the next.
void take_commands(const fs::path& path) {
  struct Deaf final : transport::Transport {
    void send(std::string_view) override {}
    void finish(const std::optional<transport::Correction>&) override {}
  };
  static const auto scenario = simulation::parse_scenario(
      "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}\n"
      "sky: {frozen: {satAzimuth: [0, 1.5, 3, 4.5, 2], satElevation: [0.5, 0.6, 0.7, 0.8, 1.4]}}\n"
      "start: 2026-06-01T12:00:00Z\nreceivers: [{name: rover, profile: ideal}]\n",
      "commands", {false});
  static simulation::ReceiverRunner rover(simulation::RunnerConfig(scenario),
                                          std::make_shared<simulation::CityScene>(city::City{
                                              "open", geodesy::LocalFrame(test::sample_point()), {}, {}}),
                                          *scenario.start);
  static const live::SessionMetrics metrics;
  const auto commands =
      live::make_commands({scenario.file, {{"rover", &rover}}, metrics, true, [] { return 1.0; }},
                          std::make_shared<transport::Link>(std::make_unique<Deaf>()));
  const std::string text = test::read_bytes(path);
  for (const std::string_view line : split(text, '\n')) {
    if (commands->handle_request(line).back() != '\n') std::abort();
  }
}
/// Requests of the viewer's page, one per line.
void take_questions(const fs::path& path) {
  static const auto scenario = simulation::parse_scenario(
      "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}\n"
      "sky: {frozen: {satAzimuth: [0, 1.5, 3, 4.5, 2], satElevation: [0.5, 0.6, 0.7, 0.8, 1.4]}}\n"
      "start: 2026-06-01T12:00:00Z\nduration_s: 9\nreceivers: [{name: rover, profile: ideal}]\n"
      "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n",
      "questions", {});
  static const auto scene = std::make_shared<simulation::CityScene>(
      city::City{"open", geodesy::LocalFrame(test::sample_point()), {}, {}});
  static const simulation::Simulation simulation(scenario, scene);
  static view::Probe probe(simulation, scene, 12);
  const std::string text = test::read_bytes(path);
  for (const std::string_view line : split(text, '\n')) {
    if (probe.handle_request(std::string(line)).back() != '}') std::abort();
  }
}
std::vector<std::string> command_lines() {
  return {
      "{\"command\": \"help\"}\n{\"command\": \"status\"}\n{\"command\": \"options\", \"receiver\": "
      "\"rover\"}\n",
      "{\"command\": \"set\", \"options\": {\"clock.bias_s\": 1e-3}}\n{\"command\": \"faults\"}\n",
      "{\"command\": \"add_fault\", \"fault\": {\"duration_s\": 20, \"name\": \"a\", \"outage\": "
      "{\"satellites\": "
      "[\"G05\"]}}}\n{\"command\": \"end_fault\", \"name\": \"a\"}\n{\"command\": \"stop\"}\n"};
}
std::string ubx_frame(encoding::ubx::MessageId id, std::initializer_list<unsigned> payload) {
  std::string bytes;
  for (const unsigned byte : payload) bytes += static_cast<char>(byte);
  return encoding::ubx::frame(id, bytes);
}

std::string rtcm_stream() {
  const simulation::Epoch epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time() - 9);
  encoding::ReceiverDescription base{.name = "base", .begin = test::sample_time()};
  base.station_ecef = epoch.truth_ecef;
  return encoding::format_named("rtcm").make(base)->encode(epoch);
}

/// One of each command.
std::vector<std::string> ubx_seeds() {
  return {ubx_frame(0x0A04, {}) + ubx_frame(0x0107, {}) + ubx_frame(0x0135, {}) + ubx_frame(0x0215, {}),
          ubx_frame(0x0601, {1, 7, 1}) + ubx_frame(0x0601, {1, 7}) +
              ubx_frame(0x0601, {2, 0x15, 0, 1, 0, 0, 0, 0}),
          ubx_frame(0x0608, {100, 0, 1, 0, 0, 0}) + ubx_frame(0x0600, {}) +
              ubx_frame(0x0600, {1, 0, 0, 0, 0xD0, 8, 0, 0, 0, 0xC2, 1, 0, 1, 0, 1, 0, 0, 0, 0, 0}),
          ubx_frame(0x068A, {0, 1, 0, 0, 1, 0, 0x21, 0x30, 200, 0}) +
              ubx_frame(0x068B, {0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0x0F}) +
              ubx_frame(0x068C, {0, 2, 0, 0, 1, 0, 0x21, 0x30}),
          ubx_frame(0x0624, {}) + ubx_frame(0x063E, {}) + ubx_frame(0x0604, {0, 0, 0, 0}) +
              ubx_frame(0x0609, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}),
          "$PUBX,41,1,0023,0001,115200,0*1C\r\n"};
}

/// Two epochs of GPS, GLONASS and Galileo, and a fix.
std::string android_log() {
  return "# Version: v3.0.6.4 Platform: 14 Manufacturer: Acme Model: One\n"
         "# Raw,TimeNanos,FullBiasNanos,BiasNanos,HardwareClockDiscontinuityCount,Svid,State,"
         "ReceivedSvTimeNanos,Cn0DbHz,PseudorangeRateMetersPerSecond,AccumulatedDeltaRangeState,"
         "AccumulatedDeltaRangeMeters,CarrierFrequencyHz,ConstellationType,CodeType\n"
         "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,UnixTimeMillis\n"
         "Raw,100000000000,-1398498900000000000,0.5,3,5,16399,212399925000000,41.5,-350.2,25,-1234.5,"
         "1575420030,1,C\n"
         "Raw,100000000000,-1398498900000000000,0.5,3,7,32897,50381925000000,41.5,-350.2,25,-1234.5,"
         "1600312500,3,C\n"
         "Fix,GPS,48.0,11.0,547.0,1714474782000\n"
         "Raw,101000000000,-1398498900000000040,0.7,3,12,3072,25000000,41.5,-350.2,25,-1234.5,"
         "1575420030,6,C\n";
}

}  // namespace

const std::vector<Target>& targets() {
  static const std::vector<Target> all{
      {"rinex_navigation", "sky.rnx", read_navigation, {test::kRinex3Sample}},
      {"rinex_observation",
       "some.obs",
       [](const fs::path& path) {
         rinex::ObservationOptions options;
         options.all_signals = true;
         (void)rinex::read_rinex_observations(path, options);
         (void)rinex::read_rinex_observations(path);
       },
       {observations3(), observations2(), compact_observations()}},
      {"android_log",
       "gnss_log.txt",
       [](const fs::path& path) {
         rinex::ObservationOptions options;
         options.all_signals = true;
         (void)rinex::read_android_observations(path, options);
       },
       {android_log()}},
      {"ubx", "commands.ubx", receive_ubx, ubx_seeds()},
      {"rtcm",
       "base.rtcm3",
       [](const fs::path& path) {
         const rtcm::RangeTable ranges = [](gnss::SatelliteId id, geodesy::GpsTime, const Eigen::Vector3d&) {
           return std::optional<double>(2.2e7 + 1e4 * id.number);
         };
         (void)rtcm::read_rtcm_corrections(path, test::sample_time(), {}, true, ranges);
       },
       {rtcm_stream()}},
      {"sp3", "some.sp3", read_sp3, {sp3()}},
      {"osm_xml",
       "map.osm",
       [](const fs::path& path) {
         (void)buildings::read_osm({path}, {{}, true});
       },
       {osm()}},
      {"osm_pbf",
       "map.osm.pbf",
       [](const fs::path& path) {
         (void)buildings::read_osm({path}, {{}, true});
       },
       {pbf("pbf,pbf_compression=none"), pbf("pbf,pbf_compression=none,pbf_dense_nodes=false")}},
      {"cityjson",
       "map.city.json",
       [](const fs::path& path) { (void)buildings::read_city_files({path}); },
       {test::cityjson(test::cityjson_building("a", test::kHouseSolid, R"({"measuredHeight":9})"))}},
      {"citygml",
       "tile.gml",
       [](const fs::path& path) { (void)buildings::read_city_files({path}); },
       {test::citygml(
           test::citygml_member(test::gml_building("a")) +
           test::citygml_member("<bldg:Building><bldg:lod1MultiSurface><gml:surfaceMember "
                                "xlink:href=\"#a_0\"/></bldg:lod1MultiSurface></bldg:Building>"))}},
      {"tileset", "tileset.json", read_tileset, tilesets()},
      {"subtree",
       "0.subtree",
       [](const fs::path& path) { (void)tiles::read_subtree(test::read_bytes(path), 2, true, no_file); },
       {subtree()}},
      {"tile", "tile.b3dm",
       [](const fs::path& path) { (void)tiles::read_content(test::read_bytes(path), 'Y', no_file); },
       tile_seeds()},
      {"canyon",
       "city.canyon",
       [](const fs::path& path) { check_mesh(city::read_city_file(path).mesh, "fuzzed"); },
       {written("seed.canyon", [](const fs::path& path) { city::write_city_file(path, houses()); })}},
      {"mesh",
       "mesh.bytes",
       read_meshes,
       {mesh("seed.dae"), mesh("seed.glb"), kPly,
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 9 9 "
        "0\nendloop\nendfacet\nendsolid a\n",
        "v 0 0 0\nv 9 0 0\nv 9 9 0\no foliage:Oak_x0020_7\nf 1 2 3\n"}},
      {"sdf", "some.world", [](const fs::path& path) { (void)city::read_gazebo_world(path); }, {kWorld}},
      {"scenario",
       "some.yaml",
       [](const fs::path& path) { (void)simulation::parse_scenario(test::read_bytes(path), path); },
       {kScenario}},
      {"recordings",
       "list.yaml",
       [](const fs::path& path) { (void)validation::read_recording_list(path); },
       {"recordings:\n  - {name: a, class: b, scenario: list.yaml, obs: list.yaml, truth_format: nmea,\n"
        "     profile: ublox-m8t, align: true, split: 0.4}\n"}},
      {"nmea", "track.nmea", trajectory("nmea"), {kNmea}},
      {"csv",
       "track.csv",
       trajectory("csv"),
       {"time,latitude,longitude,height\n2019-04-28T12:58:03Z,22.30,114.17,5.5\n2019-04-28T12:58:04.5Z,22.31,"
        "114.18,6\n",
        "# relative\ntime_s,lat,lon,height\n0,22.3,114.17,5\n0.5,22.3,114.1701,5\n"}},
      {"rtklib",
       "track.pos",
       trajectory("rtklib"),
       {"%  GPST latitude(deg) longitude(deg) height(m) Q ns\n2024/05/01 10:00:00.000 22.3 114.17 5 1 9\n"
        "2024/05/01 10:00:01.000 22.3 114.1701 5 1 9\n"}},
      {"gnsslogger", "gnss_log.txt", trajectory("gnsslogger"), {android_log()}},
      {"archives", "packed", read_packed, archives()},
      {"urbannav",
       "track.csv",
       trajectory("urbannav"),
       {"2051,46701.5,22.3,114.17,5\n2051,46702.5,22.3,114.1701,5\n"}},
      {"gpx",
       "track.gpx",
       trajectory("gpx"),
       {"<gpx><trk><trkseg><trkpt lat=\"22.3\" "
        "lon=\"114.17\"><ele>5</ele><time>2026-06-01T08:00:00Z</time></trkpt>\n"
        "<trkpt lat='22.31' lon='114.17'><time>2026-06-01T08:00:01Z</time></trkpt></trkseg></trk></gpx>\n"}},
      {"kml",
       "track.kml",
       trajectory("kml"),
       {"<kml><gx:Track><when>2026-06-01T08:00:00Z</when><when>2026-06-01T08:00:01Z</when>\n"
        "<gx:coord>114.17 22.3 5</gx:coord><gx:coord>114.171 22.3 6</gx:coord></gx:Track></kml>\n"}},
      {"study",
       "study.yaml",
       [](const fs::path& path) { (void)study::StudyPlan::read(path); },
       {"scenario: {city: {open: true, origin: {latitude_deg: 1, longitude_deg: 2}}, start: "
        "2026-01-01T00:00:00Z,\n"
        "  duration_s: 1, trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}}\n"
        "axes:\n  - seeds: 3\n  - {key: 'receivers[].elevation_mask_deg', range: {from: 0, to: 9}, crossed: "
        "false}\n"
        "  - {key: rate_hz, values: [1, 2]}\n  - {times: {from: 2026-01-01T00:00:00Z, span_s: 10}}\n"
        "design: latin_hypercube\nruns: 5\n"}},
      {"mavlink", "frames.mavlink", read_mavlink, {mavlink_stream()}},
      {"poses_json", "poses.jsonl", receive_poses<simulation::PoseFormat::Json>, json_poses()},
      {"poses_binary", "poses.bin", receive_poses<simulation::PoseFormat::Binary>, {binary_pose()}},
      {"poses_mavlink", "poses.mavlink", receive_poses<simulation::PoseFormat::MAVLink>, {mavlink_stream()}},
      {"commands", "commands.jsonl", take_commands, command_lines()},
      {"view_questions",
       "questions.jsonl",
       take_questions,
       {R"({"type": "probe", "version": 1, "id": 7, "receiver": 0, "time_s": 3.5, "place": {"east_m": 1, )"
        R"("north_m": -2, "up_m": 10}})"}},
      {"geojson",
       "area.geojson",
       [](const fs::path& path) {
         heatmap::read_area(path, geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 0)))
             .validate();
       },
       {kArea}},
  };
  return all;
}

void read_bytes(const Target& target, std::string_view bytes) {
  const fs::path path = folder() / target.file_name;
  {
    std::ofstream out(path, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  try {
    target.read(path);
  } catch (const InputError&) {
  }
}

}  // namespace canyon::fuzz
