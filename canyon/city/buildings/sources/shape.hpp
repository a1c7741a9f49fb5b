#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/buildings/sources/map_options.hpp"
#include "canyon/city/fwd.hpp"

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

/// The source of a height; reports and GeoJSON use the words "height", "levels", "default".
enum class HeightSource : std::uint8_t { Tag, Levels, Default };
[[nodiscard]] std::string_view name(HeightSource source);

/// Shape of a building or part above its base, from its tags (Simple 3D Buildings).
struct Shape {
  double height_m = 9;      ///< top of the roof above the ground
  double min_height_m = 0;  ///< bottom above the ground; the space below stays free
  RoofShape roof = RoofShape::Flat;
  double roof_height_m = 0;                  ///< part of height_m; 0 for Flat
  std::optional<double> roof_direction_rad;  ///< compass azimuth in which the roof slopes down
  /// roof:angle, if no roof height is tagged: set_roof_by_angle() computes roof_height_m from it.
  std::optional<double> roof_angle_rad;
  bool roof_across = false;  ///< roof:orientation=across: the ridge runs across the longer side
  city::Material facade = city::Material::Concrete;
  city::Material roof_material = city::Material::Concrete;
  HeightSource height_source = HeightSource::Default;
  HeightSource roof_source = HeightSource::Default;  ///< of roof_height_m
};

/// A length in OSM's notation, in metres: "12", "12 m", "12.5m", "10,5", "40 ft", "3'6\"", "1 km"; may be
/// negative. Empty otherwise, also for "1,500", which is ambiguous (may mean fifteen hundred).
[[nodiscard]] std::optional<double> parse_length_m(std::string_view text);
/// A direction ("135" in degrees, "SW", "nnw", "south-east") as azimuth [0, 2 pi). Empty otherwise.
[[nodiscard]] std::optional<double> parse_direction_rad(std::string_view text);

/// Reads a feature's tags (OSM wiki, Simple 3D Buildings). Wrong or implausible values (negative, above 2,000
/// m, roof higher than the building) are ignored, with a line in `warnings` that begins with `id`.
///
/// height: `height` (or building:height, est_height), the top with the roof; else (building:levels + roof
/// levels) x level_m, building:levels counted from the ground; else the default of the building's type, or
/// for parts above the ground without a height one storey above min_height. min_height: `min_height`, else
/// building:min_level x storey height (of height and levels if both are tagged); else for building=roof and
/// carport 0.3 m below the roof's eaves, for building=bridge one storey. roof: unknown shapes are Flat with a
/// warning, and similar ones are merged (half-hipped: Hipped; saltbox and crosspitched: Gabled; conical:
/// Pyramidal; barrel: Round). Its height is roof:height, else by roof:angle (in roof_planes.hpp, because the
/// footprint is not known here), else roof:levels x storey height, else the rest of `height` above
/// building:levels, else one storey but at most a third of the building. materials: of the facade
/// building:facade:material, facade:material, building:material, building:cladding, the first that is known;
/// of the roof roof:material; else Concrete.
/// The result always has 0 <= min_height_m <= height_m - roof_height_m and min_height_m < height_m.
[[nodiscard]] Shape shape_from_tags(const std::map<std::string, std::string>& tags,
                                    const HeightDefaults& defaults, const std::string& id,
                                    std::vector<std::string>& warnings);

/// A value of building:material, building:facade:material or roof:material as a material: the last known word
/// of its first item ("red_brick", "cement_block", "glass;steel": Glass); Unknown if not listed.
[[nodiscard]] city::Material material_from_tag(std::string_view value);

/// The facades of a building by its tags, for city::Object::facades: `building` (or `building:part`), the
/// year of `start_date` and `building:structure`. docs/city.md has the rules. ByBuilding if the tags do not
/// determine them.
[[nodiscard]] city::FacadeMix facades_from_tags(const std::map<std::string, std::string>& tags);

}  // namespace canyon::buildings
