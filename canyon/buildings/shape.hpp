#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::buildings {

enum class RoofShape : std::uint8_t {
  Flat,
  Gabled,
  Hipped,
  Pyramidal,
  Skillion,
  Dome,
  Onion,
  Round,
  Gambrel,
  Mansard
};
[[nodiscard]] std::string_view name(RoofShape shape);

/// Where a height came from; the words stand in reports and GeoJSON: "height", "levels", "default".
enum class HeightSource : std::uint8_t { Tag, Levels, Default };
[[nodiscard]] std::string_view name(HeightSource source);

/// Heights for buildings whose map says none; every use is counted.
struct HeightDefaults {
  double level_m = 3.0;     ///< storey height (OSM wiki, Simple 3D Buildings: about 3 m); (0, 20]
  double building_m = 9.0;  ///< any type not listed below; (0, 1000]
  std::map<std::string, double> by_type{{"house", 6},      {"detached", 6},    {"semidetached_house", 6},
                                        {"terrace", 6},    {"bungalow", 4},    {"hut", 3},
                                        {"shed", 3},       {"garage", 3},      {"garages", 3},
                                        {"carport", 3},    {"kiosk", 3},       {"roof", 4},
                                        {"greenhouse", 4}, {"apartments", 15}, {"residential", 12},
                                        {"office", 15},    {"commercial", 12}, {"retail", 6},
                                        {"hotel", 18},     {"industrial", 8},  {"warehouse", 8},
                                        {"church", 15},    {"cathedral", 25},  {"hospital", 15},
                                        {"school", 9},     {"university", 12}, {"train_station", 10},
                                        {"parking", 9}};
  void validate() const;
};

/// What a building or part looks like above its base, from its tags (Simple 3D Buildings).
struct Shape {
  double height_m = 9;      ///< top of the roof above the ground
  double min_height_m = 0;  ///< bottom above the ground; the space below stays free
  RoofShape roof = RoofShape::Flat;
  double roof_height_m = 0;                  ///< part of height_m; 0 for Flat
  std::optional<double> roof_direction_rad;  ///< compass azimuth towards which the roof slopes down
  bool roof_across = false;  ///< roof:orientation=across: the ridge runs across the longer side
  city::Material facade = city::Material::Concrete;
  city::Material roof_material = city::Material::Concrete;
  HeightSource height_source = HeightSource::Default;
  HeightSource roof_source = HeightSource::Default;  ///< of roof_height_m
};

/// A length as OSM writes it, in metres: "12", "12 m", "12.5m", "10,5", "40 ft", "3'6\"", "1 km". Empty
/// otherwise.
[[nodiscard]] std::optional<double> parse_length_m(std::string_view text);
/// A direction in degrees ("135", "SW", "nnw") as azimuth [rad]. Empty otherwise.
[[nodiscard]] std::optional<double> parse_direction_rad(std::string_view text);

/// Reads a feature's tags. Wrong or absurd values (negative, above 2,000 m, roof higher than the building)
/// are left out as if absent, with a line in `warnings` that begins with `id`.
[[nodiscard]] Shape shape_from_tags(const std::map<std::string, std::string>& tags,
                                    const HeightDefaults& defaults, const std::string& id,
                                    std::vector<std::string>& warnings);

/// building:material, building:facade:material, roof:material and facade colours' common words to a material;
/// Unknown for what is not listed.
[[nodiscard]] city::Material material_from_tag(std::string_view value);

}  // namespace canyon::buildings
