#include "canyon/city/city_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/city.hpp"

// Layout, everything little-endian:
//   magic     8 bytes, 0x89 "CANYON" 0x0A (a copy in text mode damages it detectably, as in PNG)
//   version   u32
//   blocks    "INFO", "VERT", "TRIS", "MATS", each: tag 4 bytes, u64 bytes unpacked, u64 bytes packed, u32
//             CRC-32 (zlib's, of the 20 bytes before it and the packed bytes), packed bytes (zlib stream)
// INFO  u64 vertices, u64 triangles, f64 latitude, longitude [rad], height [m], heading [rad],
//       from version 2 on f64 geoid undulation [m], in 3 u8 that is not read, name, u32 notes and each
//       note, u32 objects and of each: name, u8 surface, u32 triangles; from version 2 on u8 facades of each
//       object. A text is u32 bytes and its bytes; notes of a loss or a guess begin with its name and ": ".
// VERT  f64 x y z of each vertex [m]; byte planes: all first bytes of the 3 n numbers, all second bytes, ...
// TRIS  u32 a b c of each triangle, each number minus the one before it (modulo 2^32); byte planes
// MATS  u8 material of each triangle
// Planes and differences are cheap to undo and improve zlib's compression.

namespace canyon::city {
namespace {

constexpr std::string_view kMagic{
    "\x89"
    "CANYON\n",
    8};
/// A city is written in the oldest version that can represent it, so that older programs can read it.
constexpr std::uint32_t kVersion = 3;
constexpr std::size_t kBlockHeader = 24;
/// A zlib stream unpacks to at most this many bytes for each byte (zlib's documentation: 1032).
constexpr std::uint64_t kMaxUnpacked = 1040;
constexpr std::string_view kCopyAgain = "copy it again, or build the city again";

constexpr auto kLastSurface = static_cast<std::uint8_t>(Surface::Vehicle);
constexpr auto kLastMaterial = static_cast<std::uint8_t>(Material::Foliage);
constexpr auto kLastMix = static_cast<std::uint8_t>(FacadeMix::ByBuilding);

template <typename Number>
void put(std::string& out, Number value) {
  std::uint64_t bits = 0;
  if constexpr (std::is_floating_point_v<Number>)
    bits = same_bytes<std::uint64_t>(value);
  else
    bits = static_cast<std::uint64_t>(value);
  for (std::size_t byte = 0; byte < sizeof value; ++byte) out += static_cast<char>(bits >> (8 * byte) & 0xFF);
}

template <typename Number>
Number get(std::string_view in) {
  std::uint64_t bits = 0;
  for (std::size_t byte = 0; byte < sizeof(Number); ++byte)
    bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(in[byte])) << (8 * byte);
  if constexpr (std::is_floating_point_v<Number>)
    return same_bytes<Number>(bits);
  else
    return static_cast<Number>(bits);
}

void put_text(std::string& out, const std::string& text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

std::uint32_t crc_of(std::string_view head, std::string_view body) {
  const auto bytes = [](std::string_view s) { return reinterpret_cast<const Bytef*>(s.data()); };
  return static_cast<std::uint32_t>(crc32_z(crc32_z(0, bytes(head), head.size()), bytes(body), body.size()));
}

/// `count` values number(i) of type `Number`, as byte planes.
template <typename Number, typename At>
std::string planes_of(std::size_t count, const At& number) {
  std::string planes(count * sizeof(Number), '\0');
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) {
    bytes.clear();
    put<Number>(bytes, number(i));
    for (std::size_t byte = 0; byte < sizeof(Number); ++byte) planes[byte * count + i] = bytes[byte];
  }
  return planes;
}

template <typename Number>
Number from_planes(std::string_view planes, std::size_t count, std::size_t i) {
  std::array<char, sizeof(Number)> bytes{};
  for (std::size_t byte = 0; byte < sizeof(Number); ++byte) bytes[byte] = planes[byte * count + i];
  return get<Number>(std::string_view(bytes.data(), bytes.size()));
}

void write_block(OutputFile& file, std::string_view tag, const std::string& raw) {
  uLongf size = compressBound(static_cast<uLong>(raw.size()));
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(raw.data()),
                static_cast<uLong>(raw.size()), Z_DEFAULT_COMPRESSION) != Z_OK)
    throw InputError(file.path(), 0, "not enough memory to pack the city", "split it");
  packed.resize(size);
  std::string header(tag);
  put(header, static_cast<std::uint64_t>(raw.size()));
  put(header, static_cast<std::uint64_t>(packed.size()));
  put(header, crc_of(header, packed));
  file.write(header);
  file.write(packed);
}

std::uint32_t version_of(const City& city) {
  const auto named = [](const Object& object) { return object.facades != FacadeMix::ByBuilding; };
  const bool any = std::any_of(city.mesh.objects.begin(), city.mesh.objects.end(), named);
  return city.geoid_undulation_m != 0 || any ? 2 : 1;
}

std::string info_block(const City& city, std::uint32_t version) {
  std::string info;
  put(info, static_cast<std::uint64_t>(city.mesh.vertices.size()));
  put(info, static_cast<std::uint64_t>(city.mesh.triangles.size()));
  put(info, city.frame.origin().latitude_rad);
  put(info, city.frame.origin().longitude_rad);
  put(info, city.frame.origin().height_m);
  put(info, city.frame.heading_rad());
  if (version > 1) put(info, city.geoid_undulation_m);
  put_text(info, city.name);
  const std::vector<ReadReport::Entry> notes = city.notes.entries();
  put(info, static_cast<std::uint32_t>(notes.size()));
  for (const auto& [level, note] : notes) {
    const bool plain = level == ReadReport::Level::Remark;
    put_text(info, plain ? note : fmt::format("{}: {}", ReadReport::name(level), note));
  }
  put(info, static_cast<std::uint32_t>(city.mesh.objects.size()));
  for (const Object& object : city.mesh.objects) {
    put_text(info, object.name);
    put(info, static_cast<std::uint8_t>(object.surface));
    put(info, object.triangle_count);
  }
  if (version > 1)
    for (const Object& object : city.mesh.objects) put(info, static_cast<std::uint8_t>(object.facades));
  return info;
}

class CityFileReader {
 public:
  explicit CityFileReader(const std::filesystem::path& path) : path_(path) {}

  City read() {
    load();
    read_header();
    City city = read_info(block("INFO", "header"));
    read_vertices(city.mesh, block("VERT", "vertices"));
    read_triangles(city.mesh, block("TRIS", "triangles"));
    read_materials(city.mesh, block("MATS", "materials"));
    if (!rest_.empty())
      throw InputError(path_, 0, fmt::format("has {} bytes after its last block", rest_.size()), kCopyAgain);
    try {
      check_mesh(city.mesh, city.name);
    } catch (const InputError& error) {
      throw InputError(path_, 0, error.problem(), kCopyAgain);
    }
    return city;
  }

 private:
  [[noreturn]] void damaged(std::string_view block, std::string_view how) const {
    throw InputError(path_, 0, fmt::format("block '{}' is damaged: {}", block, how), kCopyAgain);
  }

  void load() {
    std::error_code error;
    check_input_file(path_);
    const std::uintmax_t size = std::filesystem::file_size(path_, error);
    std::ifstream in(path_, std::ios::binary);
    if (error || !in) throw InputError(path_, 0, "cannot be read");
    bytes_.resize(static_cast<std::size_t>(size));
    in.read(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
    if (in.gcount() != static_cast<std::streamsize>(bytes_.size()))
      throw InputError(path_, 0, "cannot be read to its end");
    rest_ = bytes_;
  }

  void read_header() {
    if (rest_.substr(0, kMagic.size()) != kMagic) {
      throw InputError(path_, 0, "is not a Canyon city",
                       "mesh files keep their own ending (.dae, .obj, .stl, .gltf, .glb, .ply)");
    }
    rest_.remove_prefix(kMagic.size());
    if (rest_.size() < 4) throw InputError(path_, 0, "is cut short before its version", kCopyAgain);
    version_ = get<std::uint32_t>(rest_);
    rest_.remove_prefix(4);
    if (version_ > kVersion) {
      throw InputError(path_, 0,
                       fmt::format("is of version {}, this Canyon reads up to {}", version_, kVersion),
                       "update Canyon, or build the city again with this one");
    }
    if (version_ == 0) throw InputError(path_, 0, "is of version 0, which does not exist", kCopyAgain);
  }

  std::string block(std::string_view tag, std::string_view name) {
    if (rest_.size() < kBlockHeader)
      throw InputError(path_, 0, fmt::format("is cut short before its block '{}'", name), kCopyAgain);
    if (rest_.substr(0, 4) != tag) damaged(name, "another block is in its place");
    const auto unpacked = get<std::uint64_t>(rest_.substr(4));
    const auto packed = get<std::uint64_t>(rest_.substr(12));
    const auto crc = get<std::uint32_t>(rest_.substr(20));
    const std::string_view head = rest_.substr(0, 20);
    rest_.remove_prefix(kBlockHeader);
    if (packed > rest_.size()) {
      throw InputError(path_, 0,
                       fmt::format("is cut short in block '{}': {} of {} bytes", name, rest_.size(), packed),
                       kCopyAgain);
    }
    const std::string_view body = rest_.substr(0, static_cast<std::size_t>(packed));
    rest_.remove_prefix(body.size());
    if (crc_of(head, body) != crc) damaged(name, "its checksum differs");
    if (unpacked / kMaxUnpacked > packed) damaged(name, "its size is impossible");
    std::string raw(static_cast<std::size_t>(unpacked), '\0');
    auto size = static_cast<uLongf>(raw.size());
    // zlib needs an output buffer even for no output.
    std::array<Bytef, 1> nothing{};
    Bytef* to = raw.empty() ? nothing.data() : reinterpret_cast<Bytef*>(raw.data());
    if (uncompress(to, &size, reinterpret_cast<const Bytef*>(body.data()), static_cast<uLong>(body.size())) !=
            Z_OK ||
        size != raw.size())
      damaged(name, "it does not unpack");
    return raw;
  }

  template <typename Number>
  Number take(std::string_view& from) const {
    if (from.size() < sizeof(Number)) damaged("header", "it ends early");
    const auto value = get<Number>(from);
    from.remove_prefix(sizeof(Number));
    return value;
  }

  std::string take_text(std::string_view& from) const {
    const auto size = take<std::uint32_t>(from);
    if (size > from.size()) damaged("header", "a text is longer than what is left");
    std::string text(from.substr(0, size));
    from.remove_prefix(size);
    return text;
  }

  /// A count of items of at least `smallest` bytes each, limited so that it is safe to allocate.
  std::uint32_t take_count(std::string_view& from, std::size_t smallest) const {
    const auto count = take<std::uint32_t>(from);
    if (count > from.size() / smallest) damaged("header", "a count exceeds its size");
    return count;
  }

  City read_info(const std::string& block) {
    std::string_view from = block;
    City city;
    vertices_ = take<std::uint64_t>(from);
    triangles_ = take<std::uint64_t>(from);
    geodesy::Geodetic origin;
    origin.latitude_rad = take<double>(from);
    origin.longitude_rad = take<double>(from);
    origin.height_m = take<double>(from);
    const auto heading_rad = take<double>(from);
    try {
      city.frame = geodesy::LocalFrame(origin, heading_rad);
    } catch (const InputError& error) {
      damaged("header", error.problem());
    }
    if (version_ >= 2) {
      city.geoid_undulation_m = take<double>(from);
      if (!(std::abs(city.geoid_undulation_m) <= 1000))
        damaged("header", "its geoid undulation is impossible");
    }
    if (version_ == 3) (void)take<std::uint8_t>(from);
    city.name = take_text(from);
    const std::uint32_t notes = take_count(from, 4);
    for (std::uint32_t i = 0; i < notes; ++i) {
      std::string note = take_text(from);
      ReadReport::Level level = ReadReport::Level::Remark;
      for (const auto each : {ReadReport::Level::Loss, ReadReport::Level::Guess}) {
        if (!note.starts_with(fmt::format("{}: ", ReadReport::name(each)))) continue;
        note.erase(0, ReadReport::name(each).size() + 2);
        level = each;
      }
      city.notes.add_line(level, note);
    }
    const std::uint32_t objects = take_count(from, 9);
    city.mesh.objects.reserve(objects);
    std::uint64_t next = 0;
    for (std::uint32_t i = 0; i < objects; ++i) {
      Object object;
      object.name = take_text(from);
      const auto surface = take<std::uint8_t>(from);
      if (surface > kLastSurface) damaged("header", fmt::format("object {} has surface {}", i, surface));
      object.surface = static_cast<Surface>(surface);
      object.triangle_count = take<std::uint32_t>(from);
      object.first_triangle = static_cast<std::uint32_t>(next);
      next += object.triangle_count;
      if (next > triangles_) damaged("header", "its objects have more triangles than the city");
      city.mesh.objects.push_back(std::move(object));
    }
    if (next != triangles_) damaged("header", "its objects do not cover the city's triangles");
    for (std::uint32_t i = 0; version_ > 1 && i < objects; ++i) {
      const auto mix = take<std::uint8_t>(from);
      if (mix > kLastMix) damaged("header", fmt::format("object {} has facades {}", i, mix));
      city.mesh.objects[i].facades = static_cast<FacadeMix>(mix);
    }
    if (!from.empty()) damaged("header", "data follow its end");
    return city;
  }

  void check_size(std::string_view name, const std::string& raw, std::uint64_t count,
                  std::size_t bytes_each) const {
    if (raw.size() / bytes_each != count || raw.size() % bytes_each != 0)
      damaged(name, fmt::format("{} bytes for {} {}", raw.size(), count, name));
  }

  void read_vertices(Mesh& mesh, const std::string& raw) const {
    check_size("vertices", raw, vertices_, 24);
    const std::size_t numbers = 3 * static_cast<std::size_t>(vertices_);
    mesh.vertices.resize(static_cast<std::size_t>(vertices_));
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        mesh.vertices[i][static_cast<Eigen::Index>(axis)] = from_planes<double>(raw, numbers, 3 * i + axis);
  }

  void read_triangles(Mesh& mesh, const std::string& raw) const {
    check_size("triangles", raw, triangles_, 12);
    const std::size_t numbers = 3 * static_cast<std::size_t>(triangles_);
    mesh.triangles.resize(static_cast<std::size_t>(triangles_));
    std::uint32_t last = 0;
    for (std::size_t i = 0; i < numbers; ++i) {
      last += from_planes<std::uint32_t>(raw, numbers, i);
      mesh.triangles[i / 3][i % 3] = last;
    }
  }

  void read_materials(Mesh& mesh, const std::string& raw) const {
    check_size("materials", raw, triangles_, 1);
    mesh.materials.reserve(raw.size());
    for (const char c : raw) {
      const auto material = static_cast<std::uint8_t>(c);
      if (material > kLastMaterial) damaged("materials", fmt::format("a triangle has material {}", material));
      mesh.materials.push_back(static_cast<Material>(material));
    }
  }

  std::filesystem::path path_;
  std::string bytes_;
  std::string_view rest_;
  std::uint32_t version_ = 0;
  std::uint64_t vertices_ = 0;
  std::uint64_t triangles_ = 0;
};

}  // namespace

void write_city_file(const std::filesystem::path& path, const City& city) {
  const Mesh& mesh = city.mesh;
  check_mesh(mesh, city.name);
  OutputFile file(path);
  std::string header(kMagic);
  const std::uint32_t version = version_of(city);
  put(header, version);
  file.write(header);
  write_block(file, "INFO", info_block(city, version));
  write_block(file, "VERT", planes_of<double>(3 * mesh.vertices.size(), [&](std::size_t i) {
                return mesh.vertices[i / 3][static_cast<Eigen::Index>(i % 3)];
              }));
  write_block(file, "TRIS", planes_of<std::uint32_t>(3 * mesh.triangles.size(), [&](std::size_t i) {
                const std::uint32_t before = i == 0 ? 0 : mesh.triangles[(i - 1) / 3][(i - 1) % 3];
                return mesh.triangles[i / 3][i % 3] - before;
              }));
  std::string materials;
  materials.reserve(mesh.materials.size());
  for (const Material material : mesh.materials) materials += static_cast<char>(material);
  write_block(file, "MATS", materials);
  file.commit();
}

City read_city_file(const std::filesystem::path& path) {
  return CityFileReader(path).read();
}

std::size_t crop(Mesh& mesh, const Eigen::AlignedBox2d& plan) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  const auto is_near = [&](std::uint32_t first, std::uint32_t count) {
    Eigen::AlignedBox2d box;
    for (std::uint32_t t = first; t < first + count; ++t)
      for (const std::uint32_t index : mesh.triangles[t]) box.extend(mesh.vertices[index].head<2>().eval());
    return plan.intersects(box);
  };
  Mesh kept;
  std::vector<std::uint32_t> slot(mesh.vertices.size(), kUnused);
  for (Object& object : mesh.objects) {
    const bool terrain = object.surface == Surface::Terrain;
    if (!terrain && !is_near(object.first_triangle, object.triangle_count)) continue;
    const auto first = static_cast<std::uint32_t>(kept.triangles.size());
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      if (terrain && !is_near(t, 1)) continue;
      std::array<std::uint32_t, 3> corners = mesh.triangles[t];
      for (std::uint32_t& corner : corners) {
        std::uint32_t& to = slot[corner];
        if (to == kUnused) {
          to = static_cast<std::uint32_t>(kept.vertices.size());
          kept.vertices.push_back(mesh.vertices[corner]);
        }
        corner = to;
      }
      kept.triangles.push_back(corners);
      kept.materials.push_back(mesh.materials[t]);
    }
    const auto count = static_cast<std::uint32_t>(kept.triangles.size()) - first;
    if (count == 0) continue;
    object.first_triangle = first;
    object.triangle_count = count;
    kept.objects.push_back(std::move(object));
  }
  const std::size_t dropped = mesh.objects.size() - kept.objects.size();
  mesh = std::move(kept);
  return dropped;
}

}  // namespace canyon::city
