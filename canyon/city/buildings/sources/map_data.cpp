#include "canyon/city/buildings/sources/map_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {

std::optional<double> metres_of_unit(std::string_view unit) {
  static const auto kUnits =
      dictionary<double>({{"m|m.|metre|meter|metres|meters|mt|mts|mtr|mtrs|9001", 1},
                          {"\xD0\xBC|\xD0\xBC.|\xE7\xB1\xB3", 1},  // Russian, Japanese
                          {"mm|millimetre|millimeter", 1e-3},
                          {"cm|centimetre|centimeter", 0.01},
                          {"dm|decimetre|decimeter", 0.1},
                          {"km|kilometre|kilometer|9036", 1e3},
                          {"in|inch|inches|[in_i]", 0.0254},
                          {"ft|ft.|foot|feet|[ft_i]|9002", 0.3048},
                          {"us-ft|ftus|us survey foot|foot_us|[ft_us]|9003", 1200.0 / 3937},
                          {"yd|yard|yards|[yd_i]", 0.9144},
                          {"mi", 1609.344}});
  const auto found = kUnits.find(unit);
  return found == kUnits.end() ? std::nullopt : std::optional(found->second);
}

std::string_view tag(const TagMap& tags, const char* key) {
  const auto found = tags.find(key);
  return found == tags.end() ? std::string_view() : trim(found->second);
}

std::optional<bool> has_ended(std::string_view date) {
  constexpr std::string_view kPresent = "2026-12-01", kDigits = "0123456789";
  std::vector<std::string_view> before;  // "31", "12" of "31.12.2031"
  for (std::size_t at = 0; (at = date.find_first_of(kDigits, at)) != std::string_view::npos;) {
    const std::size_t size = std::min(date.find_first_not_of(kDigits, at), date.size()) - at;
    std::string end(date.substr(at, size));
    at += size;
    if (size != 4 && size != 8) {
      before.push_back(date.substr(at - size, size));
      continue;
    }
    if (end < "1000") return std::nullopt;
    if (size == 8) end.insert(6, "-").insert(4, "-");
    end += date.substr(at);
    if (at == date.size() && size == 4)
      for (auto part = before.rbegin(); part != before.rend(); ++part) end += fmt::format("-{:0>2}", *part);
    return end <= kPresent || date.starts_with("before");
  }
  return std::nullopt;
}

void LonLatBox::validate() const {
  const auto check = [](double value, double limit, const char* bound) {
    if (!(std::abs(value) <= limit))
      throw InputError(fmt::format("{} bound of the box is {} deg", bound, value),
                       fmt::format("it must be within [-{0}, {0}]; a box is west,south,east,north", limit));
  };
  check(west, 180, "west");
  check(south, 90, "south");
  check(east, 180, "east");
  check(north, 90, "north");
  if (west > east && east + 360 - west > 180) {
    throw InputError(fmt::format("west bound {} of the box is east of its east bound {}", west, east),
                     "a box is west,south,east,north");
  }
  if (west == east) throw InputError(fmt::format("the box has no width: west = east = {}", west));
  if (!(south < north)) {
    throw InputError(fmt::format("south bound {} of the box is not below its north bound {}", south, north),
                     "a box is west,south,east,north");
  }
}

LonLatBox LonLatBox::unwrapped() const {
  LonLatBox box = *this;
  if (west > east) box.east += 360;
  return box;
}

double LonLatBox::middle_longitude() const {
  return 0.5 * (west + unwrapped().east);
}

double longitude_near(double longitude, double other) {
  return longitude - 360 * std::round((longitude - other) / 360);
}

Eigen::AlignedBox2d MapFeature::bounds() const {
  Eigen::AlignedBox2d box;
  for (const MapPolygon& polygon : polygons)
    for (const LonLat& point : polygon.outer) box.extend(point);
  for (const LonLat& point : line) box.extend(point);
  for (const MapSurface& surface : surfaces)
    for (const Eigen::Vector3d& corner : surface.outer) box.extend(LonLat(corner.head<2>()));
  return box;
}

void MapFeature::bring_near(double longitude) {
  const double middle = bounds().center().x();
  const double cycles = longitude_near(middle, longitude) - middle;
  if (cycles == 0) return;
  const auto rotation = [cycles](auto& points) {
    for (auto& position : points) position.x() += cycles;
  };
  rotation(line);
  for (MapPolygon& polygon : polygons) {
    rotation(polygon.outer);
    std::for_each(polygon.inners.begin(), polygon.inners.end(), rotation);
  }
  for (MapSurface& surface : surfaces) {
    rotation(surface.outer);
    std::for_each(surface.inners.begin(), surface.inners.end(), rotation);
  }
}

}  // namespace canyon::buildings
