#include "canyon/city/tiles/tile_options.hpp"

#include <vector>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::tiles {

void TileOptions::validate() const {
  if (file && !url.empty()) throw InputError("tiles has both file and url", "give one of them");
  if (!url.empty() && !is_web_address(url))
    throw InputError("url of tiles does not begin with https:// or http://", "give a file as file:");
  if (bbox_deg) {
    const auto& [west, south, east, north] = *bbox_deg;
    if (!(west < east && south < north && west >= -180 && east <= 180 && south >= -90 && north <= 90)) {
      throw InputError("bbox of tiles is not a box",
                       "give west, south, east, north in degrees, west below east and south below north");
    }
  }
  options::check(*this, "tiles");
}

void visit(options::Visitor& v, TileOptions& o) {
  v.file({"file", "", "tileset.json of 3D Tiles 1.0 or 1.1, or a .3tz archive (city.file also accepts it)"},
         o.file);
  v.text({"url", "", "instead: its http(s) address; $NAME in its query is an environment variable"}, o.url);
  v.number({"error_m", "m", "reads the coarsest tiles whose geometric error is at most this"}, o.error_m,
           {0, 10'000});
  std::vector<double> box;
  if (o.bbox_deg) box.assign(o.bbox_deg->begin(), o.bbox_deg->end());
  v.numbers({"bbox", "deg", "[west, south, east, north]: only tiles that touch this box",
             "about the scenario's trajectory"},
            box, {-180, 180});
  if (v.reads() && !box.empty()) {
    if (box.size() != 4) throw v.fault("bbox", "is not a box", "give [west, south, east, north] in degrees");
    o.bbox_deg = {box[0], box[1], box[2], box[3]};
  }
  v.number({"margin_m", "m", "around the scenario's trajectory, if there is no box"}, o.margin_m,
           {10, 50'000});
  v.integer({"max_tiles", "", "rejects a selection of more tiles"}, o.max_tiles, 1, 1'000'000);
  v.former_name("most_tiles", "max_tiles");
  v.boolean({"allow_external", "", "follow references out of the tileset's folder or to other servers"},
            o.allow_external);
  v.former_name("elsewhere", "allow_external");
  v.text({"cache", "", "folder of downloads", "~/.cache/canyon"}, o.cache);
  v.integer({"timeout_s", "s", "timeout of a server that stops sending"}, o.timeout_s, 1, 3600);
}

bool is_web_address(const std::string& text) {
  const std::string begin = lower_case(std::string_view(text).substr(0, 8));
  return begin.rfind("http://", 0) == 0 || begin == "https://";
}

std::string public_address(const std::string& address) {
  if (address.rfind("data:", 0) == 0) return address.substr(0, address.find(',')) + ",...";
  if (is_in_archive(address)) {
    std::string path = address.substr(kInArchive.size());
    return path.replace(path.find("}/"), 1, "");
  }
  if (!is_web_address(address)) return address;
  std::string bare = address.substr(0, address.find_first_of("?#"));
  const std::size_t host = bare.find("//") + 2;
  const std::size_t end = bare.find('/', host);
  const std::size_t at = bare.rfind('@', end);
  if (at != std::string::npos && at > host) bare.erase(host, at + 1 - host);
  return bare;
}

bool holds_key(const std::string& address) {
  const std::size_t mark = address.find('?');
  if (mark == std::string::npos) return false;
  for (const std::string_view item : split(std::string_view(address).substr(mark + 1), '&')) {
    const std::size_t equals = item.find('=');
    if (equals != std::string_view::npos && equals + 1 < item.size() && item[equals + 1] != '$') return true;
  }
  return false;
}

bool is_tileset(const std::filesystem::path& path) {
  if (is_web_address(path.string()) || is_archive(path)) return true;
  const std::string name = lower_case(path.filename().string());
  if (name.size() < 5 || name.substr(name.size() - 5) != ".json") return false;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return name == "tileset.json";
  const std::string head = read_head(path, 65536);
  if (head.find("\"CityJSON") != std::string::npos) return false;
  return name == "tileset.json" || (head.find("\"geometricError\"") != std::string::npos &&
                                    head.find("\"boundingVolume\"") != std::string::npos);
}

}  // namespace canyon::tiles
