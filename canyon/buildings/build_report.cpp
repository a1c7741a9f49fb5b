// Declared in canyon/buildings/builder_steps.hpp.
#include "canyon/buildings/builder_steps.hpp"

#include <fmt/format.h>

#include <array>
#include <set>

#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"
#include "canyon/buildings/shapes/outlines.hpp"

namespace canyon::buildings {

void count_surveyed(BuildReport& report, FeatureKind kind) {
  ++report.surveyed;
  if (kind == FeatureKind::Structure) {
    ++report.structures;
  } else {
    ++(kind == FeatureKind::Part ? report.parts : report.buildings);
  }
}

void count_guesses(BuildReport& report, const Shape& shape, bool facade_known) {
  switch (shape.height_source) {
    case HeightSource::Tag:
      ++report.heights_tagged;
      break;
    case HeightSource::Levels:
      ++report.heights_from_levels;
      break;
    case HeightSource::Default:
      ++report.heights_default;
      break;
  }
  if (shape.roof != RoofShape::Flat && shape.roof_source == HeightSource::Default) ++report.roofs_default;
  if (!facade_known) ++report.materials_default;
}

void add_guesses(ReadReport& notes, const BuildReport& report, const MapData& map,
                 const HeightDefaults& heights, bool level) {
  const std::size_t all =
      report.heights_tagged + report.heights_from_levels + report.heights_default + report.surveyed;
  if (2 * report.heights_default > all) {
    notes.say(
        ReadReport::Level::Guess,
        fmt::format(
            "{} of {} heights are guesses: the map has neither heights nor levels there; 'default_height_m', "
            "'heights' by type or another map change them",
            report.heights_default, all));
  }
  constexpr double kLevel_m = 5;
  const std::vector<double> lowest = level ? lowest_heights_m(map) : std::vector<double>();
  const std::vector<double> ends = quantiles(lowest, std::array{0.05, 0.95});
  if (!ends.empty() && ends[1] - ends[0] > kLevel_m) {
    notes.say(
        ReadReport::Level::Guess,
        fmt::format(
            "the lowest points of the buildings differ by {:.0f} m (5 to 95 % of them), but the ground is "
            "level, since no terrain is given: many buildings stand too high or too low on it; give "
            "heights of the ground (terrain)",
            ends[1] - ends[0]));
  }
  std::set<std::string, std::less<>> types;
  for (const MapFeature& feature : map.features) {
    for (const char* key : {"building", "building:part"}) {
      if (const auto tag = feature.tags.find(key); tag != feature.tags.end()) types.insert(tag->second);
    }
  }
  const HeightDefaults known;
  for (const auto& [type, height_m] : known.by_type) types.insert(type);
  for (const auto& [type, height_m] : heights.by_type) {
    if (types.count(type) > 0) continue;
    const auto meant = closest(type, {types.begin(), types.end()});
    notes.say(ReadReport::Level::Guess,
              fmt::format("heights: the map has no building of type '{}'{}", type,
                          meant ? fmt::format("; did you mean '{}'?", *meant) : ""));
  }
}

std::string format_report(const BuildReport& r) {
  std::string text;
  const auto line = [&text](const char* label, const std::string& rest) {
    text += fmt::format("{:<12}{}\n", label, rest);
  };
  // ", 3 so", only where there are any.
  const auto also = [](std::size_t n, const char* what) {
    return n == 0 ? std::string() : fmt::format(", {} {}", n, what);
  };
  line("buildings", fmt::format("{}{}{}", r.buildings, also(r.outlines_cut, "of them beside or below parts"),
                                also(r.outlines_replaced, "more replaced by their parts")));
  line("parts", fmt::format("{}{}{}", r.parts, also(r.parts_alone, "without an outline"),
                            also(r.parts_beyond, "reaching beyond theirs")));
  if (r.structures > 0)
    line("structures", fmt::format("{} bridges, tunnels, installations, furniture", r.structures));
  if (r.tunnels > 0 || r.bridges > 0)
    line("roads", fmt::format("{} under roofs, {} bridges", r.tunnels, r.bridges));
  if (r.surveyed > 0) line("surfaces", fmt::format("{} with surfaces of their own", r.surveyed));
  if (r.trees > 0 || r.woods > 0) line("foliage", fmt::format("{} trees, {} woods", r.trees, r.woods));
  if (r.foliage_left_out > 0) {
    line("foliage", fmt::format("{} trees, rows and woods of the map left out (foliage takes them)",
                                r.foliage_left_out));
  }
  line("heights",
       fmt::format("{} tagged, {} from levels, {} by default{}", r.heights_tagged, r.heights_from_levels,
                   r.heights_default, also(r.heights_inherited, "taken from the building of a part")));
  line("guesses",
       fmt::format("{} roof heights, {} facade materials (concrete)", r.roofs_default, r.materials_default));
  line("geometry", fmt::format("{} repaired, {} skipped", r.repaired, r.skipped));
  return text;
}

}  // namespace canyon::buildings
