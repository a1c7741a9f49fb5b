// Builds a city from map features in four steps: transform outlines to the frame and repair them, assign
// parts to buildings, build the ground, build the solids.
#include "canyon/city/buildings/city_builder.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/builder_steps.hpp"
#include "canyon/city/buildings/shapes/roof_planes.hpp"
#include "canyon/city/buildings/shapes/solid.hpp"

namespace canyon::buildings {
namespace {

using city::Surface;
constexpr double kBelowTerrain_m = 1;  // walls on a terrain reach further down
constexpr double kOnGround_m = 0.5;    // parts with a lower bottom are on the ground
constexpr double kThinnest_m = 0.1;    // solids lower than this are not built
constexpr const char* kSameOutline = "the same outline as another building";
constexpr double kBeyond_m2 = 4;  // smaller areas of parts beyond their outline are drawing inaccuracies

/// A feature after the first step.
struct LocatedFeature {
  std::vector<Polygon2> polygons;
  std::optional<Ground> ground;
  std::vector<std::size_t> parts;       // of a building, by feature index
  std::optional<std::size_t> building;  // of a part
};

class Builder {
  using Level = ReadReport::Level;

 public:
  Builder(const MapData& map, const Terrain* terrain, const BuildOptions& options,
          const std::function<void(std::size_t, std::size_t)>& progress)
      : map_(map),
        terrain_(terrain),
        options_(options),
        progress_(progress),
        map_frame_(choose_origin(map, terrain, options.origin), terrain),
        located_(map.features.size()),
        tags_(map, options.heights) {}

  BuiltCity run() {
    result_.city.name = map_.source;
    result_.city.frame = map_frame_.frame();
    const LonLat origin = map_frame_.map_from_mesh(Eigen::Vector3d::Zero()).head<2>();
    const auto terrain_undulation_m =
        terrain_ != nullptr ? terrain_->geoid_undulation_m(origin) : std::nullopt;
    result_.city.geoid_undulation_m =
        terrain_undulation_m ? *terrain_undulation_m : map_.geoid_undulation_m.value_or(0);
    result_.features.resize(map_.features.size());
    for (std::size_t i = 0; i < map_.features.size(); ++i) {
      locate(i);
      if (i % 256 == 0) report_progress(i / 2);
    }
    drop_duplicates();
    assign();
    lay_ground();
    const std::size_t ground_objects = mesh().objects.size();
    for (std::size_t i = 0; i < map_.features.size(); ++i) {
      raise(i);
      if (i % 256 == 0) report_progress((map_.features.size() + i) / 2);
    }
    for (const MapFeature& passage : map_.passages) raise_passage(passage);
    report_progress(map_.features.size());
    if (mesh().objects.size() == ground_objects) {
      throw InputError(
          fmt::format("{}: none of its {} features could be built", map_.source, map_.features.size()),
          notes_.empty() ? "" : notes_.lines().front());
    }
    finish();
    return std::move(result_);
  }

 private:
  city::Mesh& mesh() { return result_.city.mesh; }
  BuildReport& report() { return result_.report; }

  void report_progress(std::size_t done) const {
    if (progress_) progress_(done, map_.features.size());
  }

  // --- transforming and repairing --------------------------------------------------------------------

  [[nodiscard]] std::vector<Point2> local_ring(const MapRing& ring) {
    std::vector<Point2> points;
    points.reserve(ring.size());
    for (const LonLat& point : ring) {
      const double height = map_frame_.ground_height_m(point).value_or(map_frame_.frame().origin().height_m);
      points.push_back(map_frame_.mesh_from_map(point, height).head<2>());
      bounds_.extend(points.back());
    }
    return points;
  }

  void skip(std::size_t i, const std::string& why) {
    ++report().skipped;
    const bool twice = why == kSameOutline;
    notes_.add_counted(twice ? Level::Remark : Level::Loss, "skipped, " + why, map_.features[i].id);
    result_.features[i].reason = why;
  }

  void locate(std::size_t i) {
    const MapFeature& feature = map_.features[i];
    BuiltFeature& built = result_.features[i];
    LocatedFeature& located = located_[i];
    built.id = feature.id;
    built.part = feature.kind == FeatureKind::Part;
    if (!feature.surfaces.empty()) {
      for (const MapSurface& surface : feature.surfaces)
        for (const Eigen::Vector3d& corner : surface.outer)
          bounds_.extend(Point2(map_frame_.mesh_from_map(corner.head<2>(), corner.z()).head<2>()));
      return;
    }
    if (!built.part && feature.kind != FeatureKind::Building && feature.kind != FeatureKind::Wood) {
      (void)local_ring(feature.line);
      return;
    }
    std::vector<Polygon2> raw;
    raw.reserve(feature.polygons.size());
    for (const MapPolygon& polygon : feature.polygons) {
      Polygon2 next;
      next.outer = local_ring(polygon.outer);
      for (const MapRing& inner : polygon.inners) next.holes.push_back(local_ring(inner));
      raw.push_back(std::move(next));
    }
    std::vector<std::string> notes;
    located.polygons = repair(raw, notes);
    const std::string logged = fmt::format("{}", fmt::join(notes, "; "));
    if (located.polygons.empty()) {
      skip(i, logged.empty() ? "no area" : logged);
      return;
    }
    if (!notes.empty()) {
      ++report().repaired;
      built.reason = logged;
      for (const std::string& note : notes)
        notes_.add_counted(Level::Remark, "repaired, " + note, feature.id);
    }
    located.ground = ground_along(feature.polygons, map_frame_, terrain_ != nullptr);
    if (!located.ground) {
      located.polygons.clear();
      skip(i, "no terrain height below it");
    }
  }

  // --- assigning parts to buildings ------------------------------------------------------------------

  [[nodiscard]] bool is_built_by_tags(std::size_t i) const {
    return map_.features[i].surfaces.empty() && !located_[i].polygons.empty();
  }

  // Some buildings are mapped twice (a way and a relation, or two uploads). Those at different heights stay.
  void drop_duplicates() {
    SameOutlines seen;
    for (std::size_t i = 0; i < located_.size(); ++i) {
      if (map_.features[i].kind != FeatureKind::Building || !is_built_by_tags(i)) continue;
      const auto same = seen.add(i, located_[i].polygons, tags_.shape(i).min_height_m);
      if (!same) continue;
      located_[i].polygons.clear();
      skip(i, kSameOutline);
      result_.features[i].reason += " (" + map_.features[*same].id + ")";
    }
  }

  void assign() {
    std::vector<std::size_t> building_index, part_index;
    std::vector<Outline> buildings, parts;
    for (std::size_t i = 0; i < located_.size(); ++i) {
      if (!is_built_by_tags(i)) continue;
      const MapFeature& feature = map_.features[i];
      const Outline outline{&feature.id, &feature.belongs_to, &located_[i].polygons};
      if (feature.kind == FeatureKind::Building) {
        building_index.push_back(i);
        buildings.push_back(outline);
      } else if (feature.kind == FeatureKind::Part) {
        part_index.push_back(i);
        parts.push_back(outline);
      }
    }
    const auto assigned = assign_parts(buildings, parts);
    std::vector<PolygonLists> groups(buildings.size());
    for (std::size_t p = 0; p < parts.size(); ++p)
      if (assigned[p]) groups[*assigned[p]].push_back(parts[p].polygons);
    for (std::size_t b = 0; b < buildings.size(); ++b) {
      groups[b].push_back(buildings[b].polygons);
      if (groups[b].size() == 1 || !is_tangled(groups[b])) continue;
      groups[b].clear();
      notes_.add_counted(Level::Loss,
                         "{} buildings with parts that cross thousands of times; parts read separately",
                         *buildings[b].id);
    }
    for (std::size_t p = 0; p < parts.size(); ++p) {
      if (!assigned[p] || groups[*assigned[p]].empty()) continue;
      located_[part_index[p]].building = building_index[*assigned[p]];
      tags_.set_building(part_index[p], building_index[*assigned[p]]);
      located_[building_index[*assigned[p]]].parts.push_back(part_index[p]);
    }
  }

  // --- ground and solids -----------------------------------------------------------------------------

  void lay_ground() {
    const Eigen::Vector2d margin = Eigen::Vector2d::Constant(std::max(options_.terrain_margin_m, 1.0));
    const Eigen::AlignedBox2d area(Point2(bounds_.min() - margin), Point2(bounds_.max() + margin));
    append_ground(mesh(), map_frame_.frame(), terrain_, area, options_.terrain_spacing_m);
  }

  void raise(std::size_t i) {
    const MapFeature& feature = map_.features[i];
    BuiltFeature& built = result_.features[i];
    built.first_object = static_cast<std::uint32_t>(mesh().objects.size());
    if (!feature.surfaces.empty()) {
      try {
        raise_surfaces(i);
      } catch (const InputError& error) {
        skip(i, std::string(error.problem()));
      }
    } else if (feature.kind == FeatureKind::Tree || feature.kind == FeatureKind::TreeRow) {
      if (options_.foliage) raise_trees(i);
    } else if (!located_[i].polygons.empty()) {
      if (feature.kind == FeatureKind::Wood) {
        if (options_.foliage) raise_wood(i);
      } else if (feature.kind == FeatureKind::Part) {
        raise_part(i);
      } else {
        raise_building(i);
      }
    }
    built.object_count = static_cast<std::uint32_t>(mesh().objects.size()) - built.first_object;
    built.built = built.object_count > 0;
    const city::FacadeMix facades = tags_.facades(i);
    for (std::uint32_t k = 0; k < built.object_count; ++k)
      mesh().objects[built.first_object + k].facades = facades;
  }

  [[nodiscard]] Shape read_shape(const std::map<std::string, std::string>& tags, const std::string& id) {
    std::vector<std::string> logged;
    Shape shape = shape_from_tags(tags, options_.heights, id, logged);
    if (!is_facade_known(tags)) shape.facade = options_.untagged_facade;
    for (const std::string& line : logged) {
      const std::size_t colon = line.find(": ");
      const std::string what = colon == std::string::npos ? line : line.substr(colon + 2);
      notes_.add_counted(what.starts_with("roof:") ? Level::Remark : Level::Loss, what, id);
    }
    return shape;
  }

  [[nodiscard]] std::vector<MapPolygon> to_map(const std::vector<Polygon2>& polygons, double z) const {
    const auto ring = [&](const std::vector<Point2>& points) {
      MapRing out;
      out.reserve(points.size());
      for (const Point2& p : points) out.push_back(map_frame_.map_from_mesh({p.x(), p.y(), z}).head<2>());
      return out;
    };
    std::vector<MapPolygon> out;
    for (const Polygon2& polygon : polygons) {
      MapPolygon next;
      next.outer = ring(polygon.outer);
      for (const auto& hole : polygon.holes) next.inners.push_back(ring(hole));
      out.push_back(std::move(next));
    }
    return out;
  }

  // Solids of one shape over polygons, and the feature's record. False if the shape has no height.
  bool raise_solids(std::size_t i, Surface surface, const std::vector<Polygon2>& polygons, Shape shape,
                    const Ground& ground, double base_z) {
    BuiltFeature& built = result_.features[i];
    if (!polygons.empty() && !set_roof_by_angle(shape, polygons.front().outer))
      notes_.add_counted(Level::Remark, "roof:angle makes a roof higher than the building; left out",
                         built.id);
    built.shape = shape;
    built.ground_m = ground.lowest_height_m;
    built.footprint = to_map(polygons, base_z);
    if (!(shape.height_m >= shape.min_height_m + kThinnest_m)) return false;
    double bottom_z = std::min(base_z, ground.lowest_z);
    if (terrain_ != nullptr) bottom_z -= kBelowTerrain_m;
    std::vector<std::string> notes;
    for (std::size_t k = 0; k < polygons.size(); ++k) {
      const std::string name = k == 0 ? built.id : fmt::format("{}#{}", built.id, k + 1);
      append_solid(mesh(), name, surface, polygons[k], shape, base_z, bottom_z, notes);
    }
    for (const std::string& note : notes) {
      notes_.add_counted(note == kNoTriangles ? Level::Loss : Level::Remark, note, built.id);
      if (built.reason.find(note) == std::string::npos)
        built.reason += (built.reason.empty() ? "" : "; ") + note;
    }
    return true;
  }

  void raise_building(std::size_t i) {
    const MapFeature& feature = map_.features[i];
    const LocatedFeature& located = located_[i];
    Shape shape = read_shape(feature.tags, feature.id);
    std::vector<Polygon2> polygons = located.polygons;
    bool cut = false;
    if (!located.parts.empty()) {
      double lowest_top = std::numeric_limits<double>::infinity();
      double lowest_bottom = std::numeric_limits<double>::infinity();
      bool on_ground = false;
      std::vector<Polygon2> covered;
      for (const std::size_t p : located.parts) {
        const Shape part = tags_.shape(p);
        covered.insert(covered.end(), located_[p].polygons.begin(), located_[p].polygons.end());
        lowest_bottom = std::min(lowest_bottom, part.min_height_m);
        if (part.min_height_m < kOnGround_m) {
          on_ground = true;
          lowest_top = std::min(lowest_top, part.height_m);
        }
      }
      if (on_ground) polygons = uncovered(polygons, unite(covered));
      const double eaves = shape.height_m - shape.roof_height_m;
      const double top = on_ground ? std::min(lowest_top, eaves) : lowest_bottom;
      if (on_ground || top < shape.height_m) {
        shape.roof = RoofShape::Flat;
        shape.roof_height_m = 0;
        shape.height_m = std::min(eaves, top);
      }
      if (polygons.empty() || shape.height_m < shape.min_height_m + kThinnest_m) {
        ++report().outlines_replaced;
        result_.features[i].reason = fmt::format("replaced by {} parts", located.parts.size());
        result_.features[i].shape = shape;
        result_.features[i].ground_m = located.ground->lowest_height_m;
        return;
      }
      cut = true;
    }
    if (!raise_solids(i, Surface::Building, polygons, shape, *located.ground, located.ground->lowest_z)) {
      skip(i, "no height");
      return;
    }
    ++report().buildings;
    if (cut) {
      ++report().outlines_cut;
      std::string& reason = result_.features[i].reason;
      reason += fmt::format("{}next to or below {} parts", reason.empty() ? "" : "; ", located.parts.size());
    }
    count_guesses(report(), shape, is_facade_known(feature.tags));
  }

  void raise_part(std::size_t i) {
    const MapFeature& feature = map_.features[i];
    const LocatedFeature& located = located_[i];
    bool inherited = false;
    const std::map<std::string, std::string> tags = tags_.of(i, &inherited);
    const Shape shape = read_shape(tags, feature.id);
    // All parts of a building are on its base, so that they stack.
    const double base_z =
        located.building ? located_[*located.building].ground->lowest_z : located.ground->lowest_z;
    if (!raise_solids(i, Surface::Building, located.polygons, shape, *located.ground, base_z)) {
      skip(i, "no height");
      return;
    }
    ++report().parts;
    if (!located.building) {
      ++report().parts_alone;
      notes_.add_counted(Level::Remark, "part without a building outline", feature.id);
    } else if (total_area(subtract(located.polygons, located_[*located.building].polygons)) > kBeyond_m2) {
      ++report().parts_beyond;
      notes_.add_counted(Level::Remark, "part extends beyond its outline", feature.id);
    }
    if (inherited) ++report().heights_inherited;
    count_guesses(report(), shape, is_facade_known(tags));
  }

  void raise_surfaces(std::size_t i) {
    const MapFeature& feature = map_.features[i];
    std::vector<std::string> notes;
    const std::size_t first_vertex = mesh().vertices.size();
    const Shape tagged = tags_.shape(i);
    const bool settled = feature.kind == FeatureKind::Structure || is_facade_known(feature.tags);
    const city::Material facade = settled ? tagged.facade : options_.untagged_facade;
    const bool added = append_surfaces(mesh(), feature.id, feature.surfaces, map_frame_.frame(), notes,
                                       facade, tagged.roof_material);
    for (std::string& note : notes) {
      if (note.rfind(feature.id + ": ", 0) == 0) note.erase(0, feature.id.size() + 2);
      notes_.add_counted(Level::Remark, note, feature.id);
    }
    BuiltFeature& built = result_.features[i];
    if (!added) {
      skip(i, "no surface that can be built");
      return;
    }
    built.reason = fmt::format("{}", fmt::join(notes, "; "));
    count_surveyed(report(), feature.kind);
    if (feature.kind == FeatureKind::Structure) return;
    double top = -std::numeric_limits<double>::infinity();
    for (std::size_t v = first_vertex; v < mesh().vertices.size(); ++v)
      top = std::max(top, mesh().vertices[v].z());
    const std::optional<Eigen::Vector3d> ground = map_frame_.ground(feature.bounds().center());
    if (ground && top < ground->z())
      notes_.add_counted(
          Level::Guess, "{} buildings entirely below the ground (heights in another unit, or another datum?)",
          feature.id);
  }

  // --- roads under roofs and over others -------------------------------------------------------------

  void raise_passage(const MapFeature& feature) {
    const bool bridge = passage_kind(feature.tags) == PassageKind::Bridge;
    if (!(bridge ? options_.bridges : options_.tunnels)) return;
    std::vector<Eigen::Vector3d> line;
    for (const LonLat& point : feature.line) {
      const std::optional<Eigen::Vector3d> ground = map_frame_.ground(point);
      if (!ground) {
        notes_.add_counted(Level::Loss, "tunnels and bridges beyond the terrain, left out", feature.id);
        return;
      }
      line.push_back(*ground);
    }
    const std::size_t first = mesh().objects.size();
    if (!append_passage(mesh(), feature.id, feature.tags, line, terrain_ == nullptr)) {
      notes_.add_counted(Level::Remark, "tunnels and bridges without a length or tangled, left out",
                         feature.id);
      return;
    }
    for (std::size_t k = first; k < mesh().objects.size(); ++k)
      mesh().objects[k].facades = city::FacadeMix::AsGiven;
    ++(bridge ? report().bridges : report().tunnels);
  }

  // --- foliage ---------------------------------------------------------------------------------------

  void raise_trees(std::size_t i) {
    const MapFeature& feature = map_.features[i];
    const double height = length_tag_m(feature.tags, "height", 1, 150, options_.tree_height_m);
    const double crown = length_tag_m(feature.tags, "diameter_crown", 0.5, 50, options_.tree_crown_m);
    const std::vector<LonLat> positions = tree_positions(feature);
    std::size_t planted = 0;
    for (const LonLat& point : positions) {
      const std::optional<Eigen::Vector3d> ground = map_frame_.ground(point);
      if (!ground) continue;
      const std::string name = planted == 0 ? feature.id : fmt::format("{}#{}", feature.id, planted + 1);
      const double foot_z =
          feature.base_m ? map_frame_.mesh_from_map(point, *feature.base_m).z() : ground->z();
      append_tree(mesh(), name, ground->head<2>(), foot_z, height, crown);
      if (planted++ == 0) {
        result_.features[i].ground_m = map_frame_.ground_height_m(point).value_or(0);
        result_.features[i].shape.height_m = height;
      }
    }
    report().trees += planted;
    if (planted == 0) skip(i, "no terrain height below it");
  }

  void raise_wood(std::size_t i) {
    const MapFeature& feature = map_.features[i];
    Shape shape;
    shape.height_m = length_tag_m(feature.tags, "height", 1, 150, options_.wood_height_m);
    shape.height_source = feature.tags.count("height") > 0 ? HeightSource::Tag : HeightSource::Default;
    shape.facade = shape.roof_material = city::Material::Foliage;
    const LocatedFeature& located = located_[i];
    if (raise_solids(i, Surface::Foliage, located.polygons, shape, *located.ground, located.ground->mean_z))
      ++report().woods;
  }

  // --- the end ---------------------------------------------------------------------------------------

  void finish() {
    check_mesh(mesh(), map_.source);
    report().foliage_left_out = map_.foliage_left_out;
    ReadReport& notes = result_.city.notes;
    const std::string text = format_report(report());
    for (const std::string_view line : split(trim(text), '\n')) notes.add_line(Level::Remark, line);
    const BuildReport& r = report();
    add_guesses(notes, r, map_, options_.heights, terrain_ == nullptr);
    if (terrain_ != nullptr) notes.append(terrain_->notes());
    notes.append(map_.notes);
    notes.append(notes_);
  }

  const MapData& map_;
  const Terrain* terrain_;
  const BuildOptions& options_;
  const std::function<void(std::size_t, std::size_t)>& progress_;
  MapFrame map_frame_;
  std::vector<LocatedFeature> located_;
  FeatureTags tags_;
  Eigen::AlignedBox2d bounds_;  ///< east, north
  ReadReport notes_;
  BuiltCity result_;
};

}  // namespace

BuiltCity build_city(const MapData& map, const Terrain* terrain, const BuildOptions& options,
                     const std::function<void(std::size_t, std::size_t)>& progress) {
  options.validate();
  return Builder(map, terrain, options, progress).run();
}

}  // namespace canyon::buildings
