#include "canyon/city/buildings/builder_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string_view>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/shapes/footprint.hpp"
#include "canyon/city/buildings/shapes/solid.hpp"

namespace canyon::buildings {
namespace {

constexpr double kStep_m = 10;
// The middle of a chord of this length is s^2 / (8 R) = 5 mm below the sphere.
constexpr double kFlatSpacing_m = 500;
constexpr double kMetresPerDegree = 111'320;  // of latitude, for step lengths only

constexpr double kRoof_m = 0.5, kWall_m = 0.4, kDeck_m = 1, kLayer_m = 6;
constexpr double kPiece_m = 30, kOverlap_m = 0.5;

bool is_footway(const TagMap& tags) {
  const std::string_view highway = tag(tags, "highway");
  return highway == "footway" || highway == "path" || highway == "steps" || highway == "cycleway" ||
         highway == "pedestrian";
}

double width_m(const TagMap& tags) {
  const double lanes = length_tag_m(tags, "lanes", 1, 16, 0);
  const double otherwise = lanes > 0                       ? 3.5 * lanes
                           : is_footway(tags)              ? 3
                           : !tag(tags, "railway").empty() ? 5
                                                           : 8;
  return length_tag_m(tags, "width", 1, 100, otherwise);
}

double inner_height_m(const TagMap& tags) {
  const double headroom = length_tag_m(tags, "maxheight", 1.5, 20, 0);
  if (headroom > 0) return headroom + 0.3;
  return is_footway(tags) ? 3 : 5;
}

/// A section of a way over ground that counts as level.
struct Piece {
  std::vector<Point2> line;
  double ground_m = 0;
};

std::vector<Piece> pieces_of(const std::vector<Eigen::Vector3d>& line, bool level) {
  std::vector<Piece> pieces;
  if (level) {
    Piece& whole = pieces.emplace_back();
    whole.ground_m = line.front().z();
    for (const Eigen::Vector3d& point : line) {
      whole.line.emplace_back(point.head<2>());
      whole.ground_m = std::min(whole.ground_m, point.z());
    }
    return pieces;
  }
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector3d step = line[i + 1] - line[i];
    const double length = step.head<2>().norm();
    if (length < 1e-3) continue;
    const int count = static_cast<int>(std::ceil(length / kPiece_m));
    for (int k = 0; k < count; ++k) {
      // Pieces overlap within the way, but not at its ends.
      const double more = kOverlap_m / length;
      const bool first = i == 0 && k == 0, last = i + 2 == line.size() && k + 1 == count;
      const double from = static_cast<double>(k) / count - (first ? 0 : more);
      const double to = static_cast<double>(k + 1) / count + (last ? 0 : more);
      const Eigen::Vector3d a = line[i] + from * step, b = line[i] + to * step;
      pieces.push_back({{a.head<2>(), b.head<2>()}, std::min(a.z(), b.z())});
    }
  }
  return pieces;
}

constexpr auto kHeightKeys = {"height", "building:height", "est_height", "building:levels"};
constexpr auto kFacadeKeys = {"building:facade:material", "facade:material", "building:material",
                              "building:cladding"};
constexpr auto kUseKeys = {"building", "building:structure", "start_date"};
constexpr auto kRoofKeys = {"roof:material", "building:roof:material"};

bool has_any(const TagMap& tags, std::initializer_list<const char*> keys) {
  return std::any_of(keys.begin(), keys.end(), [&tags](const char* key) { return tags.count(key) > 0; });
}

/// Inherits all of these keys if none of them is present.
void inherit(TagMap& tags, const TagMap& from, std::initializer_list<const char*> keys) {
  if (has_any(tags, keys)) return;
  for (const char* key : keys) {
    const auto found = from.find(key);
    if (found != from.end()) tags.insert(*found);
  }
}

}  // namespace

Eigen::Vector3d MapFrame::mesh_from_map(const LonLat& point, double height_m) const {
  return frame_.local_from_geodetic(geodesy::Geodetic::from_degrees(point.y(), point.x(), height_m));
}

Eigen::Vector3d MapFrame::map_from_mesh(const Eigen::Vector3d& point) const {
  const geodesy::Geodetic position = frame_.geodetic_from_local(point);
  return {geodesy::degrees(position.longitude_rad), geodesy::degrees(position.latitude_rad),
          position.height_m};
}

std::optional<double> MapFrame::ground_height_m(const LonLat& point) const {
  if (terrain_ == nullptr) return frame_.origin().height_m;
  return terrain_->height_m(point);
}

std::optional<Eigen::Vector3d> MapFrame::ground(const LonLat& point) const {
  const std::optional<double> height = ground_height_m(point);
  if (!height) return std::nullopt;
  return mesh_from_map(point, *height);
}

std::optional<Ground> ground_along(const std::vector<MapPolygon>& polygons, const MapFrame& map_frame,
                                   bool terrain) {
  Ground ground;
  double sum = 0;
  std::size_t count = 0;
  const auto add = [&](const LonLat& point) {
    const std::optional<double> height = map_frame.ground_height_m(point);
    if (!height) return;
    const double z = map_frame.mesh_from_map(point, *height).z();
    sum += z;
    if (count++ == 0 || z < ground.lowest_z) {
      ground.lowest_z = z;
      ground.lowest_height_m = *height;
    }
  };
  for (const MapPolygon& polygon : polygons) {
    for (std::size_t i = 0; i < polygon.outer.size(); ++i) {
      const LonLat& a = polygon.outer[i];
      add(a);
      if (!terrain) continue;
      const LonLat& b = polygon.outer[(i + 1) % polygon.outer.size()];
      const double length_m = (b - a).norm() * kMetresPerDegree;  // at least the true one
      const int steps = static_cast<int>(std::min(1000.0, std::ceil(length_m / kStep_m)));
      for (int k = 1; k < steps; ++k) add(a + (b - a) * k / steps);
    }
  }
  if (count == 0) return std::nullopt;
  ground.mean_z = sum / static_cast<double>(count);
  return ground;
}

void append_ground(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Terrain* terrain,
                   const Eigen::AlignedBox2d& bounds, double terrain_spacing_m) {
  if (terrain == nullptr) {
    append_sheet(mesh, bounds.min(), bounds.max(), kFlatSpacing_m, [&](const Eigen::Vector2d& at) {
      // The drop below the frame's plane, to first order; the rest is d^4 / (8 R^3), 1 mm at 38 km.
      return frame.origin().height_m - frame.geodetic_from_local({at.x(), at.y(), 0}).height_m;
    });
    return;
  }
  terrain->append(mesh, frame, bounds.min(), bounds.max(), terrain_spacing_m);
}

bool is_facade_known(const TagMap& tags) {
  return std::any_of(kFacadeKeys.begin(), kFacadeKeys.end(), [&tags](const char* key) {
    const auto found = tags.find(key);
    return found != tags.end() && material_from_tag(found->second) != city::Material::Unknown;
  });
}

double length_tag_m(const TagMap& tags, const char* key, double low, double high, double otherwise) {
  const auto found = tags.find(key);
  if (found == tags.end()) return otherwise;
  const std::optional<double> value = parse_length_m(found->second);
  return value && *value >= low && *value <= high ? *value : otherwise;
}

TagMap FeatureTags::of(std::size_t feature, bool* inherited) const {
  TagMap tags = map_.features[feature].tags;
  if (!building_[feature]) return tags;
  const TagMap& from = map_.features[*building_[feature]].tags;
  const bool height_given = has_any(tags, kHeightKeys);
  inherit(tags, from, kHeightKeys);
  inherit(tags, from, kFacadeKeys);
  inherit(tags, from, kRoofKeys);
  if (inherited != nullptr) *inherited = !height_given && has_any(tags, kHeightKeys);
  return tags;
}

Shape FeatureTags::shape(std::size_t feature) const {
  std::vector<std::string> ignored;
  return shape_from_tags(of(feature), heights_, map_.features[feature].id, ignored);
}

city::FacadeMix FeatureTags::facades(std::size_t feature) const {
  TagMap tags = map_.features[feature].tags;
  if (building_[feature])
    for (const char* key : kUseKeys) inherit(tags, map_.features[*building_[feature]].tags, {key});
  return facades_from_tags(tags);
}

void count_surveyed(BuildReport& report, FeatureKind kind) {
  ++report.surveyed;
  if (kind == FeatureKind::Structure)
    ++report.structures;
  else
    ++(kind == FeatureKind::Part ? report.parts : report.buildings);
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
    notes.add_line(ReadReport::Level::Guess, fmt::format("{} of {} heights are guesses: the map has neither "
                                                         "heights nor levels for them; 'default_height_m', "
                                                         "'heights' by type or another map change them",
                                                         report.heights_default, all));
  }
  constexpr double kLevel_m = 5;
  const std::vector<double> lowest = level ? lowest_heights_m(map) : std::vector<double>();
  const std::vector<double> ends = quantiles(lowest, std::array{0.05, 0.95});
  if (!ends.empty() && ends[1] - ends[0] > kLevel_m) {
    notes.add_line(
        ReadReport::Level::Guess,
        fmt::format(
            "the lowest points of the buildings differ by {:.0f} m (5 to 95 % of them), but the ground is "
            "level, because no terrain is given: many buildings are too high or too low; give heights of the "
            "ground (terrain)",
            ends[1] - ends[0]));
  }
  std::set<std::string, std::less<>> types;
  for (const MapFeature& feature : map.features) {
    for (const char* key : {"building", "building:part"})
      if (const auto tag = feature.tags.find(key); tag != feature.tags.end()) types.insert(tag->second);
  }
  const HeightDefaults known;
  for (const auto& [type, height_m] : known.by_type) types.insert(type);
  for (const auto& [type, height_m] : heights.by_type) {
    if (types.count(type) > 0) continue;
    const std::string hint = did_you_mean(closest(type, {types.begin(), types.end()}));
    notes.add_line(ReadReport::Level::Guess, fmt::format("heights: the map has no building of type '{}'{}{}",
                                                         type, hint.empty() ? "" : "; ", hint));
  }
}

std::string format_report(const BuildReport& r) {
  std::string text;
  const auto line = [&text](const char* label, const std::string& rest) {
    text += fmt::format("{:<12}{}\n", label, rest);
  };
  // ", 3 so", only if the count is not zero.
  const auto also = [](std::size_t n, const char* what) {
    return n == 0 ? std::string() : fmt::format(", {} {}", n, what);
  };
  line("buildings", fmt::format("{}{}{}", r.buildings, also(r.outlines_cut, "of them next to or below parts"),
                                also(r.outlines_replaced, "more replaced by their parts")));
  line("parts", fmt::format("{}{}{}", r.parts, also(r.parts_alone, "without an outline"),
                            also(r.parts_beyond, "extending beyond theirs")));
  if (r.structures > 0)
    line("structures", fmt::format("{} bridges, tunnels, installations, furniture", r.structures));
  if (r.tunnels > 0 || r.bridges > 0)
    line("roads", fmt::format("{} under roofs, {} bridges", r.tunnels, r.bridges));
  if (r.surveyed > 0) line("surfaces", fmt::format("{} with their own surfaces", r.surveyed));
  if (r.trees > 0 || r.woods > 0) line("foliage", fmt::format("{} trees, {} woods", r.trees, r.woods));
  if (r.foliage_left_out > 0) {
    line("foliage",
         fmt::format("{} trees, rows and woods of the map left out (enable foliage)", r.foliage_left_out));
  }
  line("heights",
       fmt::format("{} tagged, {} from levels, {} by default{}", r.heights_tagged, r.heights_from_levels,
                   r.heights_default, also(r.heights_inherited, "inherited from a part's building")));
  line("guesses",
       fmt::format("{} roof heights, {} facade materials (concrete)", r.roofs_default, r.materials_default));
  line("geometry", fmt::format("{} repaired, {} skipped", r.repaired, r.skipped));
  return text;
}

PassageKind passage_kind(const TagMap& tags) {
  const std::string_view tunnel = tag(tags, "tunnel"), bridge = tag(tags, "bridge");
  if (!tunnel.empty() && tunnel != "no") return PassageKind::Tunnel;
  return !bridge.empty() && bridge != "no" ? PassageKind::Bridge : PassageKind::Covered;
}

bool append_passage(city::Mesh& mesh, const std::string& id, const TagMap& tags,
                    const std::vector<Eigen::Vector3d>& line, bool level) {
  const PassageKind kind = passage_kind(tags);
  const double half_m = width_m(tags) / 2;
  const std::size_t before = mesh.objects.size();
  const auto append = [&](const std::vector<Polygon2>& polygons, double from_m, double to_m,
                          double ground_m) {
    Shape shape;
    shape.min_height_m = from_m;
    shape.height_m = to_m;
    std::vector<std::string> ignored;
    for (const Polygon2& polygon : polygons) {
      const std::size_t count = mesh.objects.size() - before;
      append_solid(mesh, count == 0 ? id : fmt::format("{}#{}", id, count + 1), city::Surface::Building,
                   polygon, shape, ground_m, ground_m, ignored);
    }
  };
  for (const Piece& piece : pieces_of(line, level)) {
    if (kind == PassageKind::Bridge) {
      const double deck_m = kLayer_m * length_tag_m(tags, "layer", 1, 5, 1);
      append(ribbon(piece.line, half_m), deck_m, deck_m + kDeck_m, piece.ground_m);
      continue;
    }
    const double inner_m = inner_height_m(tags);
    const bool walls = kind == PassageKind::Tunnel;
    const std::vector<Polygon2> over = ribbon(piece.line, half_m + (walls ? kWall_m : 0));
    append(over, inner_m, inner_m + kRoof_m, piece.ground_m);
    if (walls) append(subtract(over, ribbon(piece.line, half_m)), 0, inner_m, piece.ground_m);
  }
  return mesh.objects.size() > before;
}

}  // namespace canyon::buildings
