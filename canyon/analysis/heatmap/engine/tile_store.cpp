#include "canyon/analysis/heatmap/engine/tile_store.hpp"

// Finished units of a heat map in a folder: TileStore of engine.hpp.
#include <fmt/format.h>
#include <zlib.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"

namespace canyon::heatmap {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFormat = "canyon heat map tiles";
constexpr int kVersion = 1;
constexpr std::string_view kManifest = "manifest.json";
constexpr std::string_view kExtension = ".tile";

/// Header of a unit's file, in the machine's byte order (another byte order shows in the magic number).
struct Header {
  std::array<char, 8> magic{};
  std::uint32_t byte_order = 0;
  std::uint32_t version = 0;
  std::array<std::uint64_t, 2> key{};
  std::uint64_t unit = 0;
  std::uint64_t first_time = 0, times = 0;
  std::uint64_t values = 0, states = 0;
  std::uint32_t payload_crc = 0;
  std::uint32_t header_crc = 0;  ///< of all fields before
};
static_assert(std::is_trivially_copyable_v<Header> && sizeof(Header) == 80, "no padding: bytes are written");
static_assert(sizeof(CellState) == 1 && sizeof(float) == 4);

constexpr std::array<char, 8> kMagic{'C', 'A', 'N', 'Y', 'T', 'I', 'L', 'E'};
constexpr std::uint32_t kByteOrder = 0x01020304;

std::uint32_t crc_of(const void* bytes, std::size_t size, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, static_cast<const unsigned char*>(bytes), static_cast<z_size_t>(size)));
}

std::uint32_t crc_of(const Header& header) {
  return crc_of(&header, offsetof(Header, header_crc));
}

std::uint32_t crc_of(const std::vector<float>& values, const std::vector<CellState>& state) {
  return crc_of(state.data(), state.size(), crc_of(values.data(), values.size() * sizeof(float)));
}

std::string_view bytes_of(const void* data, std::size_t size) {
  return {static_cast<const char*>(data), size};
}

InputError damaged(const fs::path& file, std::string_view what) {
  return {file, 0, fmt::format("the tile is damaged: {}", what),
          "delete this file and run the same command again: only this tile is computed again"};
}

/// Whether a name is one of this store's own files.
bool is_own(std::string_view name) {
  return name == kManifest || (name.starts_with("unit-") && name.ends_with(kExtension));
}

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

/// Null if there is no such file; InputError if it cannot be opened.
File open(const fs::path& path) {
  errno = 0;
  File file(std::fopen(path.c_str(), "rb"));
  if (!file && errno != ENOENT) {
    throw InputError(path, 0, fmt::format("cannot be read: {}", std::strerror(errno)),
                     "check the folder's permissions");
  }
  return file;
}

InputError foreign(const fs::path& folder, std::string_view problem) {
  return {folder, 0, problem,
          "give another output folder, or remove this one if its results are no longer needed"};
}

/// Throws if the folder's manifest is damaged or another map's.
void check_manifest(const fs::path& folder, const std::string& key, const std::string& description) {
  const fs::path path = folder / kManifest;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(path, 0, "has disappeared", "let no other program delete files in this folder");
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const Json manifest = Json::try_parse(text).value_or(Json());
  const auto word = [&](const char* name) -> std::string {
    return manifest[name].is_string() ? manifest[name].text() : std::string();
  };
  if (word("format") != kFormat || word("key").empty() || !manifest["version"].is_integer())
    throw foreign(folder, fmt::format("'{}' is damaged or of another program", kManifest));
  if (manifest["version"].get<std::int64_t>() != kVersion) {
    throw foreign(folder, fmt::format("the tiles here are of another version ({}, this one writes {})",
                                      manifest["version"].get<std::int64_t>(), kVersion));
  }
  if (word("key") != key) {
    throw foreign(folder, fmt::format("the tiles here are of another map ({}), not of this one ({})",
                                      word("description"), description));
  }
}

Header read_header(std::FILE* file, const fs::path& name, std::size_t unit,
                   const std::array<std::uint64_t, 2>& key) {
  Header header;
  if (std::fread(&header, sizeof header, 1, file) != 1) throw damaged(name, "it is cut short");
  if (header.magic != kMagic || header.byte_order != kByteOrder)
    throw damaged(name, "it was not written by this program on this kind of machine");
  if (header.header_crc != crc_of(header)) throw damaged(name, "the checksum of its header is wrong");
  if (header.version != static_cast<std::uint32_t>(kVersion) || header.key != key)
    throw damaged(name, "it belongs to another map");
  if (header.unit != unit) throw damaged(name, fmt::format("it is unit {}", header.unit));
  std::error_code error;
  const std::uintmax_t size = fs::file_size(name, error);
  if (error || size != sizeof header + header.values * sizeof(float) + header.states)
    throw damaged(name, "its length is wrong");
  return header;
}

}  // namespace

TileStore::TileStore(std::filesystem::path folder, const std::string& key, const std::string& description)
    : folder_(std::move(folder)), key_{fnv1a(key), fnv1a("tile " + key)} {
  make_output_folder(folder_);
  std::error_code error;
  if (!fs::exists(folder_ / kManifest, error)) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
      const std::string name = entry.path().filename().string();
      // Another process may be creating the same store.
      if (name == kManifest || is_temporary_name(name)) continue;
      throw foreign(folder_, fmt::format("the folder contains '{}' but no '{}'", name, kManifest));
    }
    if (!fs::exists(folder_ / kManifest, error)) {
      const Json manifest{
          {"format", kFormat}, {"version", kVersion}, {"key", key}, {"description", description}};
      write_file(folder_ / kManifest, manifest.dump(2) + "\n");
    }
  }
  check_manifest(folder_, key, description);
}

fs::path TileStore::path(std::size_t unit) const {
  return folder_ / fmt::format("unit-{:09}{}", unit, kExtension);
}

bool TileStore::has(std::size_t unit) const {
  const File file = open(path(unit));
  if (!file) return false;
  (void)read_header(file.get(), path(unit), unit, key_);
  return true;
}

void TileStore::save(std::size_t unit, const TileValues& values) {
  Header header;
  header.magic = kMagic;
  header.byte_order = kByteOrder;
  header.version = static_cast<std::uint32_t>(kVersion);
  header.key = key_;
  header.unit = unit;
  header.first_time = values.first_time;
  header.times = values.times;
  header.values = values.values.size();
  header.states = values.state.size();
  header.payload_crc = crc_of(values.values, values.state);
  header.header_crc = crc_of(header);
  OutputFile file(path(unit));
  file.write(bytes_of(&header, sizeof header));
  file.write(bytes_of(values.values.data(), values.values.size() * sizeof(float)));
  file.write(bytes_of(values.state.data(), values.state.size()));
  file.commit();
}

std::optional<TileValues> TileStore::load(std::size_t unit) const {
  const File file = open(path(unit));
  if (!file) return std::nullopt;
  const Header header = read_header(file.get(), path(unit), unit, key_);
  TileValues values;
  values.first_time = static_cast<std::size_t>(header.first_time);
  values.times = static_cast<std::size_t>(header.times);
  values.values.resize(static_cast<std::size_t>(header.values));
  values.state.resize(static_cast<std::size_t>(header.states));
  const auto read = [&](void* to, std::size_t size) {
    if (size > 0 && std::fread(to, size, 1, file.get()) != 1)
      throw damaged(path(unit), "it cannot be read completely");
  };
  read(values.values.data(), values.values.size() * sizeof(float));
  read(values.state.data(), values.state.size());
  if (crc_of(values.values, values.state) != header.payload_crc)
    throw damaged(path(unit), "the checksum of its values is wrong");
  return values;
}

void TileStore::remove() {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error))
    if (is_own(entry.path().filename().string())) fs::remove(entry.path(), error);
  fs::remove(folder_, error);  // only if it is empty
}

}  // namespace canyon::heatmap
