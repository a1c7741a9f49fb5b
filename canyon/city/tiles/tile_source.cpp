#include "canyon/city/tiles/tile_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <regex>
#include <set>
#include <thread>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/gdal.hpp"
#include "canyon/city/buildings/sources/gml_document.hpp"
#include "canyon/city/buildings/sources/http_client.hpp"
#include "canyon/city/meshes/gltf_buffers.hpp"

namespace canyon::tiles {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxTile = std::uint64_t{1} << 29;
constexpr int kTries = 3;
constexpr double kMaxPause_s = 20;
/// Lifetime of a download if the server gives none.
constexpr double kKept_s = 30 * 86400.0;

/// $NAME and ${NAME} replaced by the environment's.
std::string with_variables(std::string text) {
  static const std::regex kVariable(R"(\$\{?(\w*)\}?)");
  std::string out;
  for (std::smatch match; std::regex_search(text, match, kVariable); text = match.suffix().str()) {
    const std::string name = match[1];
    const char* value = name.empty() ? nullptr : std::getenv(name.c_str());
    if (value == nullptr) {
      throw InputError(
          fmt::format("the environment has no variable '{}', which the tileset's address uses", name),
          fmt::format("set it: export {}=...", name.empty() ? "NAME" : name));
    }
    out += match.prefix().str() + value;
  }
  return out + text;
}

/// scheme://host:port of a URL.
std::string server_of(const std::string& url) {
  const std::size_t host = url.find("//");
  const std::size_t end = host == std::string::npos ? host : url.find_first_of("/?#", host + 2);
  return lower_case(url.substr(0, end));
}

std::string_view query_of(std::string_view url) {
  url = url.substr(0, url.find('#'));
  const std::size_t mark = url.find('?');
  return mark == std::string_view::npos ? std::string_view() : url.substr(mark + 1);
}

/// `url` with the missing parameters of `base`.
std::string with_query_of(const std::string& base, const std::string& url) {
  std::set<std::string_view> own;
  const std::string_view query = query_of(url);
  for (const std::string_view item : split(query, '&')) own.insert(item.substr(0, item.find('=')));
  std::string out = url.substr(0, url.find('#'));
  bool first = out.find('?') == std::string::npos;
  for (const std::string_view item : split(query_of(base), '&')) {
    if (item.empty() || own.count(item.substr(0, item.find('='))) > 0) continue;
    out += first ? '?' : '&';
    out += item;
    first = false;
  }
  return out;
}

std::string all_of(const buildings::ByteReader& read) {
  std::string bytes = buildings::first_bytes(read, kMaxTile + 1);
  if (bytes.size() > kMaxTile) throw InputError(fmt::format("unpacks to more than {} bytes", kMaxTile));
  return bytes;
}

/// A file of an archive, by its GDAL name.
std::string read_member(const std::string& name) {
  const buildings::ByteReader file = buildings::gdal::bytes_of(name);
  if (!file) throw InputError("is not in the archive, or cannot be unpacked", "is the archive complete?");
  std::string bytes = all_of(file);
  return is_gzip(bytes) && name.rfind("/vsigzip/", 0) != 0 ? read_member("/vsigzip/" + name) : bytes;
}

}  // namespace

TileSource::TileSource(const TileOptions& options) : options_(options) {
  if (options.file) {
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(*options.file, error);
    root_ = (error ? *options.file : whole).string();
    if (is_archive(root_)) {
      check_input_file(root_);
      root_ = in_archive(root_, "tileset.json");
    }
  } else {
    root_ = with_variables(options.url);
    folder_ = buildings::downloads_folder(options.cache) / "tiles";
    make_output_folder(folder_);
  }
}

TileSource::~TileSource() {
  std::error_code ignored;
  for (const fs::path& path : not_to_keep_) fs::remove(path, ignored);
}

std::string TileSource::resolve(const std::string& base, const std::string& uri) const {
  if (uri.empty()) throw InputError("a tile names no file");
  if (uri.starts_with("data:")) return uri;
  const std::size_t colon = uri.find_first_of(":/?#");
  const bool has_scheme = colon != std::string::npos && uri[colon] == ':';
  if (has_scheme && !is_web_address(uri)) {
    throw InputError(fmt::format("'{}' is an address of an unsupported kind", uri.substr(0, colon + 1)),
                     "give files of the tileset's folder or server");
  }
  if (is_web_address(base) || has_scheme) return resolve_web(base, uri);
  return resolve_path(base, uri);
}

std::string TileSource::resolve_path(const std::string& base, const std::string& uri) const {
  const fs::path relative(meshes::percent_decoded(uri.substr(0, uri.find_first_of("?#"))));
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::path(base).parent_path() / relative, error);
  if (error || (!options_.allow_external && !is_in_folder_of(whole, root_))) {
    throw InputError(fmt::format("'{}' is outside the tileset's folder and is not read", uri),
                     "if you trust the tileset, set city.tiles.allow_external: true");
  }
  return whole.string();
}

std::string TileSource::resolve_web(const std::string& base, const std::string& uri) const {
  const std::string url = is_web_address(base) ? buildings::resolve_url(base, uri) : uri;
  const bool same_server = server_of(url) == server_of(root_);
  if (!same_server && !options_.allow_external) {
    throw InputError(
        fmt::format("'{}' is on another server than the tileset and is not read", public_address(url)),
        "if you trust the tileset, set city.tiles.allow_external: true");
  }
  return server_of(url) == server_of(base) ? with_query_of(base, url) : url;
}

/// The server, and a hash of the whole address: any parameter may select the file, and none may be written.
std::filesystem::path TileSource::cached(const std::string& address) const {
  const std::string bare = public_address(address), server = server_of(bare);
  const std::string ending = fs::path(bare).extension().string().substr(0, 16);
  return folder_ / fmt::format("{}-{:016x}{}", server.substr(server.rfind('/') + 1, 100),
                               fnv1a(address.substr(0, address.find('#'))), ending);
}

void TileSource::prefetch(const std::vector<std::string>& addresses) {
  std::vector<std::string> wanted;
  for (const std::string& address : addresses) {
    if (!is_web_address(address) || fetched_.count(address) > 0) continue;
    fetched_.emplace(address, std::string());
    std::error_code error;
    // The modification time of a download is the time of its expiry.
    const auto stale = fs::last_write_time(cached(address), error);
    if (error || stale < fs::file_time_type::clock::now()) wanted.push_back(address);
  }
  if (!wanted.empty()) download(wanted);
}

void TileSource::download(const std::vector<std::string>& addresses) {
  std::vector<std::string> left = addresses;
  for (int attempt = 1; !left.empty(); ++attempt) {
    std::vector<std::string> again;
    double pause_s = 0;
    buildings::HttpGetOptions options;
    options.timeout_s = options_.timeout_s;
    options.largest = kMaxTile;
    options.allow_external = options_.allow_external;
    buildings::http_get_all(left, options, [&](std::size_t i, buildings::HttpResponse&& response) {
      const std::string& address = left[i];
      const bool busy = response.status == 429 || response.status >= 500;
      if (busy && attempt < kTries) {
        again.push_back(address);
        pause_s = std::max(pause_s, response.retry_after_s.value_or(1));
        return;
      }
      if (!response.problem.empty() || response.status != 200) {
        fetched_[address] = !response.problem.empty()
                                ? response.problem
                                : fmt::format("the server responded with HTTP status {}", response.status);
        return;
      }
      ++downloaded_files_;
      downloaded_bytes_ += response.body.size();
      const fs::path path = cached(address);
      overwrite_cache_file(path, response.body);
      const double kept_s = response.keep_s.value_or(kKept_s);
      if (kept_s <= 0) not_to_keep_.push_back(path);
      std::error_code ignored;
      fs::last_write_time(path,
                          fs::file_time_type::clock::now() +
                              std::chrono::seconds(static_cast<std::int64_t>(std::min(kept_s, kKept_s))),
                          ignored);
    });
    left = std::move(again);
    if (!left.empty())
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(pause_s, kMaxPause_s)));
  }
}

std::string TileSource::read(const std::string& address) {
  if (auto data = meshes::data_of(address)) return std::move(*data);
  fs::path path = address;
  if (is_web_address(address)) {
    prefetch({address});
    if (const std::string& problem = fetched_.at(address); !problem.empty()) throw InputError(problem);
    path = cached(address);
  }
  if (is_in_archive(path.string())) return read_member(path.string());
  check_input_file(path, kMaxTile);
  GzipFile file(path);
  std::string bytes = all_of([&](char* to, std::size_t size) { return file.read(to, size, 0); });
  if (file.cut_short()) throw InputError("the gzip data end early", "get the tile again");
  return bytes;
}

}  // namespace canyon::tiles
