#include "canyon/city/buildings/sources/overpass.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/city/buildings/sources/http_client.hpp"

namespace canyon::buildings {
namespace {

constexpr std::size_t kMaxTiles = 10'000;
constexpr double kMaxWait_s = 60;
constexpr double kFirstWait_s = 5;  // doubled with each retry, if the server gives no time
constexpr std::string_view kOrFile = "or give a file (such as an extract as .osm.pbf)";

/// The start of a server's response for a message: one line, without tags.
std::string excerpt(std::string_view body) {
  std::string out;
  bool tag = false;
  for (const char c : body.substr(0, 4000)) {
    if (c == '<') {
      tag = true;
      if (!out.empty() && out.back() != ' ') out += ' ';
    } else if (c == '>') {
      tag = false;
    } else if (!tag) {
      const bool blank = static_cast<unsigned char>(c) <= ' ';
      if (!blank) out += c;
      if (blank && !out.empty() && out.back() != ' ') out += ' ';
    }
    if (out.size() >= 160) {
      out += "...";
      break;
    }
  }
  return std::string(trim(out));
}

/// Sends a query, and retries if the server is busy. Returns the body of a reply with status 200.
std::string send_query(const std::string& query, const OverpassOptions& options) {
  double wait_s = kFirstWait_s;
  for (int attempt = 0;; ++attempt) {
    HttpResponse reply = http_post(options.url, query, options.timeout_s);
    if (reply.status == 200) return std::move(reply.body);
    const bool busy = reply.status == 429 || (reply.status >= 500 && reply.status <= 599);
    if (!busy || attempt >= options.retries) {
      const std::string logged = excerpt(reply.body);
      const char* meaning = reply.status == 429   ? " (too many requests)"
                            : reply.status == 504 ? " (the server is too busy)"
                                                  : "";
      throw InputError(
          fmt::format("{} responded with HTTP status {}{}{}{}", options.url, reply.status, meaning,
                      attempt > 0 ? fmt::format(" to each of {} requests", attempt + 1) : "",
                      logged.empty() ? "" : ": " + logged),
          busy ? fmt::format("try again later, {}", kOrFile)
               : fmt::format("check the address of the endpoint, {}", kOrFile));
    }
    const double pause_s = std::min(reply.retry_after_s.value_or(wait_s), kMaxWait_s);
    if (pause_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(pause_s));
    wait_s *= 2;
  }
}

/// The text of Overpass's <remark>, which may report a failure despite a good status.
std::string remark_of(std::string_view body) {
  const std::size_t begin = body.find("<remark>");
  if (begin == std::string_view::npos) return {};
  const std::size_t end = body.find("</remark>", begin);
  return excerpt(body.substr(begin, end == std::string_view::npos ? end : end - begin));
}

/// Throws unless a body is a complete OSM XML document.
void check_osm(std::string_view body, const OverpassOptions& options) {
  const std::string_view head = body.substr(0, 4096);
  const std::size_t start = head.find_first_not_of("\xEF\xBB\xBF \t\r\n");
  const bool xml = start != std::string_view::npos && head.find("<osm") != std::string_view::npos &&
                   (head.substr(start, 5) == "<?xml" || head.substr(start, 4) == "<osm");
  if (!xml) {
    const std::string logged = excerpt(body);
    throw InputError(fmt::format("{} responded with something other than OpenStreetMap XML{}", options.url,
                                 logged.empty() ? "" : ": " + logged),
                     fmt::format("check the address of the endpoint, {}", kOrFile));
  }
  // The server aborts long queries with a remark and partial data. The remark is after the data, and tags
  // cannot contain an unescaped '<'.
  const std::string remark = remark_of(body);
  if (!remark.empty()) {
    throw InputError(fmt::format("{} aborted: {}", options.url, remark),
                     "allow more time, or fetch in smaller tiles");
  }
  const std::string_view tail = trim(body);
  if (tail.size() < 6 || tail.substr(tail.size() - 6) != "</osm>") {
    throw InputError(fmt::format("the response of {} ends early, after {} bytes", options.url, body.size()),
                     "try again");
  }
}

/// Overpass QL: building candidates, relations with such ways (old-style multipolygons, building relations),
/// and all their members.
std::string map_query(const LonLatBox& box, const OverpassOptions& options) {
  std::string query = fmt::format(
      "[out:xml][timeout:{}][bbox:{:.7f},{:.7f},{:.7f},{:.7f}];\n"
      "(way[\"building\"];way[\"building:part\"];)->.b;\n"
      "(.b;relation(bw.b)[\"type\"~\"^(multipolygon|building)$\"];relation[\"building\"];"
      "relation[\"building:part\"];relation[\"type\"=\"building\"];",
      options.timeout_s, box.south, box.west, box.north, box.east);
  if (options.foliage) {
    query +=
        "\nnode[\"natural\"=\"tree\"];way[\"natural\"~\"^(wood|tree_row)$\"];way[\"landuse\"=\"forest\"];"
        "relation[\"natural\"=\"wood\"];relation[\"landuse\"=\"forest\"];";
  }
  return query + ");\n(._;>>;);\nout body;\n";
}

std::vector<LonLatBox> tiles_of(const LonLatBox& box, double tile_deg) {
  if (box.west > box.east) {
    std::vector<LonLatBox> tiles = tiles_of({box.west, box.south, 180, box.north}, tile_deg);
    const std::vector<LonLatBox> others = tiles_of({-180, box.south, box.east, box.north}, tile_deg);
    tiles.insert(tiles.end(), others.begin(), others.end());
    return tiles;
  }
  const auto pieces = [&](double extent) { return std::max(1.0, std::ceil(extent / tile_deg - 1e-9)); };
  const double columns = pieces(box.east - box.west);
  const double rows = pieces(box.north - box.south);
  if (columns * rows > static_cast<double>(kMaxTiles)) {
    throw InputError(fmt::format("the box needs {:.0f} requests of {} deg; at most {} are made",
                                 columns * rows, tile_deg, kMaxTiles),
                     "download an extract of the region as .osm.pbf and give that file");
  }
  std::vector<LonLatBox> tiles;
  for (int row = 0; row < static_cast<int>(rows); ++row) {
    for (int column = 0; column < static_cast<int>(columns); ++column) {
      const auto at = [](double from, double to, int i, double n) { return from + (to - from) * i / n; };
      tiles.push_back({at(box.west, box.east, column, columns), at(box.south, box.north, row, rows),
                       at(box.west, box.east, column + 1, columns), at(box.south, box.north, row + 1, rows)});
    }
  }
  return tiles;
}

bool is_kept(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

/// A string of Overpass QL.
std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

/// A place in the result.
struct NamedArea {
  std::string name;
  LonLatBox box;
  [[nodiscard]] double extent() const { return (box.unwrapped().east - box.west) * (box.north - box.south); }
  [[nodiscard]] bool holds(const LonLatBox& other) const {
    const LonLatBox whole = box.unwrapped();
    const double lon = longitude_near(other.middle_longitude(), box.middle_longitude());
    const double lat = (other.south + other.north) / 2;
    return lon >= whole.west && lon <= whole.east && lat >= whole.south && lat <= whole.north;
  }
};

/// Query for "A, B, C": the place A within areas named B and C.
std::string named_area_query(const std::vector<std::string_view>& pieces, int timeout_s) {
  std::string query = fmt::format("[out:json][timeout:{}];\n", timeout_s);
  std::string within;
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    const std::string area = quoted(pieces[i]);
    query += fmt::format("(area[\"name\"={0}];area[\"name:en\"={0}];)->.a{1};\n", area, i);
    within += fmt::format("(area.a{})", i);
  }
  query += '(';
  for (const char* key : {"name", "name:en"}) {
    const std::string named = fmt::format("[\"{}\"={}]", key, quoted(pieces[0]));
    query += fmt::format("relation{0}[\"boundary\"]{1};nwr{0}[\"place\"]{1};", named, within);
  }
  return query + ");\nout tags bb;\n";
}

std::vector<NamedArea> areas_of(const std::string& body, const OverpassOptions& options, bool& point) {
  const auto damaged = [&] {
    const std::string logged = excerpt(body);
    return InputError(fmt::format("{} responded with something other than a list of places{}", options.url,
                                  logged.empty() ? "" : ": " + logged),
                      "check the address of the endpoint, or give a box");
  };
  const Json response = Json::try_parse(body).value_or(Json());
  if (!response["elements"].is_array()) throw damaged();
  if (response["remark"].is_string()) {
    throw InputError(fmt::format("{} aborted: {}", options.url, excerpt(response["remark"].text())),
                     "allow more time, or give a box");
  }
  std::vector<NamedArea> points;
  for (const Json& element : response["elements"]) {
    if (!element.is_object()) throw damaged();
    if (!element.contains("bounds")) {
      point = true;
      continue;
    }
    const Json& bounds = element["bounds"];
    const auto number = [&](const char* key) {
      if (!bounds[key].is_number()) throw damaged();
      return bounds[key].get<double>();
    };
    NamedArea found;
    found.box = {number("minlon"), number("minlat"), number("maxlon"), number("maxlat")};
    if (found.box.west == found.box.east || found.box.south == found.box.north) {
      point = true;
      continue;
    }
    found.box.validate();
    const auto text = [&](const char* key) {
      return element[key].is_string() ? element[key].text() : std::string("?");
    };
    const std::string id = element["id"].is_integer() ? std::to_string(element["id"].get<long long>()) : "?";
    found.name = text("type") + "/" + id;
    points.push_back(std::move(found));
  }
  return points;
}

}  // namespace

void OverpassOptions::validate() const {
  const bool web = url.rfind("https://", 0) == 0 || url.rfind("http://", 0) == 0;
  if (!web || std::any_of(url.begin(), url.end(), [](unsigned char c) { return c <= ' ' || c == 0x7f; })) {
    throw InputError(fmt::format("'{}' is not the address of an Overpass endpoint", excerpt(url)),
                     "give one such as https://overpass-api.de/api/interpreter");
  }
  options::check(*this, "download");
}

void visit(options::Visitor& v, OverpassOptions& o) {
  v.text({"url", "", "Overpass endpoint"}, o.url);
  std::string cache = o.cache.string();
  v.text({"cache", "", "folder for downloads", "~/.cache/canyon"}, cache);
  if (v.reads()) o.cache = cache;
  v.integer({"timeout_s", "s", "timeout of one request"}, o.timeout_s, 1, 3600);
  v.integer({"retries", "", "retries after HTTP status 429 and 5xx"}, o.retries, 0, 10);
  v.number({"tile_deg", "deg", "side of a tile; larger boxes are fetched tile by tile"}, o.tile_deg,
           {0.001, 10});
  v.boolean({"foliage", "", "also read trees, tree rows and woods"}, o.foliage);
}

std::vector<std::filesystem::path> download_osm(
    const LonLatBox& box, const OverpassOptions& options,
    const std::function<void(std::size_t, std::size_t)>& progress) {
  options.validate();
  box.validate();
  const std::vector<LonLatBox> tiles = tiles_of(box, options.tile_deg);
  const std::filesystem::path folder = downloads_folder(options.cache);
  make_output_folder(folder);
  std::vector<std::filesystem::path> files;
  for (const LonLatBox& tile : tiles) {
    OverpassOptions untimed = options;  // the timeout does not affect the result
    untimed.timeout_s = 0;
    const std::uint64_t hash = fnv1a(options.url + '\n' + map_query(tile, untimed));
    const std::filesystem::path file =
        folder / fmt::format("osm_{:.5f}_{:.5f}_{:016x}.osm", tile.south, tile.west, hash);
    if (!is_kept(file)) {
      const std::string body = send_query(map_query(tile, options), options);
      check_osm(body, options);
      overwrite_cache_file(file, body);
    }
    files.push_back(file);
    if (progress) progress(files.size(), tiles.size());
  }
  return files;
}

LonLatBox find_named_area(const std::string& name, const OverpassOptions& options) {
  options.validate();
  std::vector<std::string_view> pieces;
  for (const std::string_view piece : split(name, ',')) pieces.push_back(trim(piece));
  const bool bad =
      name.size() > 200 || pieces.size() > 5 ||
      std::any_of(pieces.begin(), pieces.end(), [](std::string_view p) { return p.empty(); }) ||
      std::any_of(name.begin(), name.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; });
  if (bad) {
    throw InputError(fmt::format("'{}' is not the name of a place", excerpt(name)),
                     "give a name as in the map, with larger places after commas: Tsim Sha Tsui, Hong Kong");
  }
  const std::filesystem::path folder = downloads_folder(options.cache);
  make_output_folder(folder);
  const std::uint64_t hash = fnv1a(options.url + '\n' + named_area_query(pieces, 0));
  const std::filesystem::path file = folder / fmt::format("place_{:016x}.json", hash);
  const bool kept = is_kept(file);
  const std::string body = kept ? std::string(TextFile(file).text())
                                : send_query(named_area_query(pieces, options.timeout_s), options);
  bool point = false;
  const std::vector<NamedArea> points = areas_of(body, options, point);
  if (points.empty()) {
    if (point) {
      throw InputError(fmt::format("the place '{}' is a point on the map, without bounds", name),
                       "give a box around it: west,south,east,north");
    }
    throw InputError(fmt::format("no place named '{}' was found", name),
                     "write it as in the map, or give a box: west,south,east,north");
  }
  // A town and its boundary are several objects; the largest represents those inside it.
  const auto largest =
      std::max_element(points.begin(), points.end(),
                       [](const NamedArea& a, const NamedArea& b) { return a.extent() < b.extent(); });
  for (const NamedArea& position : points) {
    if (largest->holds(position.box)) continue;
    throw InputError(fmt::format("'{}' names several places that are far apart, {} and {} among {}", name,
                                 largest->name, position.name, points.size()),
                     "add the region or country after a comma, or give a box");
  }
  if (!kept) overwrite_cache_file(file, body);
  return largest->box;
}

}  // namespace canyon::buildings
