// Converts OSM objects to map features: outlines, multipolygons, building relations, foliage.
#include "canyon/city/buildings/sources/osm_reader.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

// After inlining, GCC assumes a user name of size 0 in libosmium's packed objects.
#if defined(__GNUC__) && __GNUC__ >= 11
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wstringop-overread"
#endif
#include <osmium/area/assembler.hpp>
#include <osmium/builder/osm_object_builder.hpp>
#include <osmium/memory/buffer.hpp>
#include <osmium/osm.hpp>
#if defined(__GNUC__) && __GNUC__ >= 11
#pragma GCC diagnostic pop
#endif

#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/osm_objects.hpp"
#include "canyon/city/meshes/geos.hpp"

namespace canyon::buildings {
namespace {

/// Members that bound a multipolygon, as ways with known positions, with their roles.
using RingMembers = std::vector<std::pair<const OsmWay*, std::string>>;

/// libosmium's positions are within +-180 deg; those of a map on the antimeridian are rotated by this angle
/// [deg] for libosmium.
double rotation_for_osmium(const RingMembers& members) {
  for (const auto& [way, role] : members)
    for (const LonLat& point : way->positions)
      if (std::abs(point.x()) > 180) return std::copysign(180, point.x());
  return 0;
}

MapRing ring_of(const osmium::NodeRefList& nodes, double rotation) {
  MapRing ring;
  ring.reserve(nodes.size());
  for (const osmium::NodeRef& node : nodes) ring.emplace_back(node.lon() + rotation, node.lat());
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  return ring;
}

/// libosmium's form of a way, required by the assembler.
std::size_t append_osm_way(osmium::memory::Buffer& buffer, OsmId id, const OsmWay& route, double rotation) {
  {
    osmium::builder::WayBuilder builder(buffer);
    builder.set_id(id);
    osmium::builder::WayNodeListBuilder nodes(builder);
    for (std::size_t i = 0; i < route.nodes.size(); ++i) {
      nodes.add_node_ref(osmium::NodeRef(
          route.nodes[i], osmium::Location(route.positions[i].x() - rotation, route.positions[i].y())));
    }
  }
  return buffer.commit();
}

std::vector<MapPolygon> polygons_of(const osmium::memory::Buffer& buffer, double rotation) {
  std::vector<MapPolygon> polygons;
  for (const auto& area : buffer.select<osmium::Area>()) {
    for (const auto& outer : area.outer_rings()) {
      MapPolygon polygon;
      polygon.outer = ring_of(outer, rotation);
      for (const auto& inner : area.inner_rings(outer)) polygon.inners.push_back(ring_of(inner, rotation));
      polygons.push_back(std::move(polygon));
    }
  }
  return polygons;
}

/// Even-odd rule.
bool inside(const LonLat& point, const MapRing& ring) {
  bool odd = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const LonLat& a = ring[i];
    const LonLat& b = ring[j];
    if ((a.y() > point.y()) != (b.y() > point.y()) &&
        point.x() < (b.x() - a.x()) * (point.y() - a.y()) / (b.y() - a.y()) + a.x())
      odd = !odd;
  }
  return odd;
}

/// The ring of a closed way, without the last point and repeated points. Empty if the way is not closed or
/// has fewer than three corners; `problem` gets the reason.
MapRing ring_of(const OsmWay& route, std::string& problem) {
  if (route.positions.size() < 2 || route.positions.front() != route.positions.back()) {
    problem = "outline not closed";
    return {};
  }
  MapRing ring;
  ring.reserve(route.positions.size());
  for (const LonLat& point : route.positions)
    if (ring.empty() || point != ring.back()) ring.push_back(point);
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  if (ring.size() < 3) {
    problem = "outline of fewer than three corners";
    return {};
  }
  return ring;
}

std::vector<MapPolygon> by_roles(const RingMembers& members) {
  std::vector<MapPolygon> polygons;
  for (const bool outer : {true, false}) {
    for (const auto& [way, role] : members) {
      if ((role != "inner") != outer) continue;
      std::string ignored;
      MapRing ring = ring_of(*way, ignored);
      if (ring.empty()) return {};
      if (outer) {
        polygons.push_back({std::move(ring), {}});
        continue;
      }
      const auto around =
          polygons.size() == 1
              ? polygons.begin()
              : std::find_if(polygons.begin(), polygons.end(),
                             [&](const MapPolygon& polygon) { return inside(ring.front(), polygon.outer); });
      if (around == polygons.end()) return {};
      around->inners.push_back(std::move(ring));
    }
  }
  return polygons;
}

/// Polygons of a multipolygon relation by libosmium's area assembler: open ways are joined, roles follow from
/// the geometry. If rings cross each other or themselves, closed member ways are used by their roles (for
/// repair()), with a `note`. Empty if neither works; `note` gets the reason.
std::vector<MapPolygon> assemble(OsmId id, const RingMembers& members, std::string& note) {
  osmium::memory::Buffer routes(4096, osmium::memory::Buffer::auto_grow::yes);
  std::vector<std::size_t> offsets;
  const double rotation = rotation_for_osmium(members);
  for (std::size_t i = 0; i < members.size(); ++i) {
    // The assembler uses a way once; ids only need to be different for different ways.
    const auto same = std::find_if(members.begin(), members.begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const auto& member) { return member.first == members[i].first; });
    if (same != members.begin() + static_cast<std::ptrdiff_t>(i))
      offsets.push_back(offsets[static_cast<std::size_t>(same - members.begin())]);
    else
      offsets.push_back(append_osm_way(routes, static_cast<OsmId>(i + 1), *members[i].first, rotation));
  }
  osmium::memory::Buffer relations(4096, osmium::memory::Buffer::auto_grow::yes);
  {
    osmium::builder::RelationBuilder builder(relations);
    builder.set_id(id);
    osmium::builder::RelationMemberListBuilder list(builder);
    for (std::size_t i = 0; i < members.size(); ++i)
      list.add_member(osmium::item_type::way, static_cast<OsmId>(i + 1), members[i].second.c_str());
  }
  relations.commit();
  std::vector<const osmium::Way*> pointers;
  for (const std::size_t offset : offsets) pointers.push_back(&routes.get<const osmium::Way>(offset));

  osmium::area::AssemblerConfig config;
  config.create_empty_areas = false;
  osmium::area::Assembler assembler(config);
  osmium::memory::Buffer areas(4096, osmium::memory::Buffer::auto_grow::yes);
  if (assembler(relations.get<const osmium::Relation>(0), pointers, areas)) {
    std::vector<MapPolygon> polygons = polygons_of(areas, rotation);
    if (!polygons.empty()) return polygons;
  }
  std::vector<MapPolygon> polygons = by_roles(members);
  note = polygons.empty() ? "rings that do not close or cross each other"
                          : "rings that cross or touch wrongly, read one by one";
  return polygons;
}

/// True if polygons, line and box have a point in common (borders included; degrees treated as planar).
bool touches(const MapFeature& feature, const LonLatBox& box) {
  namespace geos = meshes::geos;
  const geos::Geometry area = geos::polygon(
      {{box.west, box.south}, {box.east, box.south}, {box.east, box.north}, {box.west, box.north}});
  const auto meets = [&](const geos::Geometry& shape) {
    return shape && GEOSIntersects_r(geos::context(), area.get(), shape.get()) != 0;  // 2: GEOS error
  };
  return meets(geos::line(feature.line)) ||
         std::any_of(feature.polygons.begin(), feature.polygons.end(), [&](const MapPolygon& polygon) {
           return meets(geos::polygon(polygon.outer, polygon.inners));
         });
}

/// A feature, or an object that is counted as such but not built.
struct Candidate {
  MapFeature feature;
  std::string left_out;
};

class FeatureMaker {
  using Level = ReadReport::Level;

 public:
  FeatureMaker(OsmObjects objects, const OsmReadOptions& options)
      : objects_(std::move(objects)), options_(options) {}

  /// Nodes, ways, relations, each by id.
  MapData make() {
    read_building_relations();
    make_multipolygons();  // before ways, because they replace some
    make_osm_ways();
    std::vector<Candidate> all;
    for (auto& [id, tree] : objects_.trees) {
      Candidate candidate;
      candidate.feature.id = osm_name("node", id);
      candidate.feature.kind = FeatureKind::Tree;
      candidate.feature.tags = std::move(tree.tags);
      candidate.feature.line = {tree.position};
      all.push_back(std::move(candidate));
    }
    std::move(ways_.begin(), ways_.end(), std::back_inserter(all));
    std::move(multipolygons_.begin(), multipolygons_.end(), std::back_inserter(all));
    if (options_.box) keep_in_box(all);

    MapData map;
    for (Candidate& candidate : all) {
      if (!candidate.left_out.empty()) {
        const bool doubtful = candidate.left_out == kEnded || candidate.left_out == kBelow;
        notes_.add_counted(doubtful ? Level::Guess : Level::Remark, "{} left out, " + candidate.left_out,
                           candidate.feature.id);
        continue;
      }
      if (candidate.feature.kind == FeatureKind::Passage) {
        map.passages.push_back(std::move(candidate.feature));
        continue;
      }
      const Eigen::AlignedBox2d bounds = candidate.feature.bounds();
      constexpr double kMax_deg = 0.2;
      if (candidate.feature.kind == FeatureKind::Building && !bounds.isEmpty() &&
          bounds.sizes().maxCoeff() > kMax_deg) {
        notes_.add_counted(Level::Loss, "{} buildings of more than 20 km, left out: a corner is wrong",
                           candidate.feature.id);
        continue;
      }
      map.bounds.extend(bounds);
      map.features.push_back(std::move(candidate.feature));
    }
    notes_.append(objects_.notes);
    map.notes = std::move(notes_);
    map.foliage_left_out = objects_.foliage_left_out;
    return map;
  }

 private:
  /// Membership in a type=building relation.
  struct Membership {
    OsmId relation = 0;
    bool outline = false, part = false;
  };

  void read_building_relations() {
    for (const auto& [id, relation] : objects_.relations) {
      if (relation.multipolygon) continue;
      std::vector<std::string> missing;
      bool any = false;
      for (const OsmMember& member : relation.members) {
        const bool outline = member.role == "outline" || member.role == "outer";
        const bool part = member.role == "part";
        if (member.type == 'n' || (!outline && !part && !member.role.empty())) continue;
        const bool forward = member.type == 'w';
        const bool present =
            forward ? objects_.ways.count(member.ref) > 0 : objects_.relations.count(member.ref) > 0;
        if (!present) {
          missing.push_back(forward ? osm_name("way", member.ref) : osm_name("relation", member.ref));
          continue;
        }
        any = true;
        auto& memberships = forward ? osm_way_memberships_ : relation_memberships_;
        memberships.emplace(member.ref, Membership{id, outline, part});
      }
      if (any && !missing.empty()) {
        notes_.add_counted(
            Level::Loss, "{} building relations with members that are not in the map, built from the others",
            fmt::format("{} (without {})", osm_name("relation", id),
                        fmt::join(missing.begin(),
                                  missing.begin() + std::min<std::ptrdiff_t>(std::ssize(missing), 20), " ")));
      }
    }
  }

  /// Kind and tags of a member of a type=building relation: its role applies if its tags give no kind.
  void apply_membership(const std::map<OsmId, Membership>& memberships, OsmId id, OsmClass& kind,
                        TagMap& tags, std::string& belongs_to) const {
    const auto found = memberships.find(id);
    if (found == memberships.end()) return;
    const Membership& membership = found->second;
    if (!kind.kind && membership.outline) kind.kind = FeatureKind::Building;
    if (membership.part && (!kind.kind || *kind.kind == FeatureKind::Building)) kind.kind = FeatureKind::Part;
    if (!kind.kind || (*kind.kind != FeatureKind::Building && *kind.kind != FeatureKind::Part)) return;
    belongs_to = osm_name("relation", membership.relation);
    const OsmRelation& relation = objects_.relations.at(membership.relation);
    if (*kind.kind == FeatureKind::Building) {
      for (const auto& [key, value] : relation.tags)
        if (key != "type") tags.emplace(key, value);
    }
    if (kind.left_out.empty()) kind.left_out = relation.kind.left_out;
  }

  void make_multipolygons() {
    for (const auto& [id, relation] : objects_.relations)
      if (relation.multipolygon) make_multipolygon(id, relation);
  }

  void make_multipolygon(OsmId id, const OsmRelation& relation) {
    Candidate candidate;
    MapFeature& feature = candidate.feature;
    feature.id = osm_name("relation", id);
    feature.tags = relation.tags;
    feature.tags.erase("type");
    OsmClass kind = relation.kind;
    std::vector<std::pair<OsmId, const OsmMember*>> members;
    bool complete = true;
    for (const OsmMember& member : relation.members) {
      const bool rings = member.role.empty() || member.role == "outer" || member.role == "inner";
      if (member.type != 'w' || !rings) continue;
      const auto forward = objects_.ways.find(member.ref);
      complete = complete && forward != objects_.ways.end() && !forward->second.positions.empty();
      if (forward == objects_.ways.end()) continue;
      members.emplace_back(member.ref, &member);
      // Old style: the outer ways have the tags.
      if (member.role != "inner" && is_uninformative(relation.tags) && !kind.kind &&
          forward->second.kind.kind) {
        kind = forward->second.kind;
        feature.tags.insert(forward->second.tags.begin(), forward->second.tags.end());
      }
    }
    apply_membership(relation_memberships_, id, kind, feature.tags, feature.belongs_to);
    if (!kind.kind) return;
    feature.kind = *kind.kind;
    candidate.left_out = kind.left_out;
    if (feature.kind == FeatureKind::TreeRow || feature.kind == FeatureKind::Tree ||
        feature.kind == FeatureKind::Passage)
      return;
    if (!complete || members.empty()) {
      if (kind.left_out.empty())
        notes_.add_counted(Level::Loss, "{} multipolygons of which the map has only a part, left out",
                           feature.id);
      return;
    }
    // Several whole buildings in one relation: each way has more specific tags than the relation.
    const auto is_untagged = [&](const std::pair<OsmId, const OsmMember*>& member) {
      const OsmWay& forward = objects_.ways.at(member.first);
      std::string ignored;
      return member.second->role != "inner" && forward.kind.kind == feature.kind &&
             !ring_of(forward, ignored).empty();
    };
    if (members.size() > 1 && std::all_of(members.begin(), members.end(), is_untagged)) {
      for (const auto& [forward, member] : members)
        objects_.ways.at(forward).tags.insert(feature.tags.begin(), feature.tags.end());
      notes_.add_counted(Level::Remark, "{} multipolygons of whole buildings, read as these", feature.id);
      return;
    }
    RingMembers rings;
    for (const auto& [forward, member] : members)
      rings.emplace_back(&objects_.ways.at(forward), member->role);
    std::string note;
    feature.polygons = assemble(id, rings, note);
    if (!note.empty() && kind.left_out.empty()) {
      const bool lost = feature.polygons.empty();
      notes_.add_counted(lost ? Level::Loss : Level::Remark,
                         "{} multipolygons of " + note + (lost ? ", left out" : ""), feature.id);
    }
    if (feature.polygons.empty()) return;
    const bool one_outer = feature.polygons.size() == 1;
    for (const auto& [way_id, member] : members) {
      const OsmWay& forward = objects_.ways.at(way_id);
      if (member->role == "inner" || forward.kind.kind != feature.kind) continue;
      // A ring without a role may be an inner one, and another building.
      std::string ignored;
      const MapRing ring = ring_of(forward, ignored);
      if (member->role.empty() && !ring.empty() && is_inner(ring, feature.polygons)) continue;
      taken_over_.insert(way_id);
      if (one_outer) feature.tags.insert(forward.tags.begin(), forward.tags.end());
    }
    multipolygons_.push_back(std::move(candidate));
  }

  static bool is_inner(const MapRing& ring, const std::vector<MapPolygon>& polygons) {
    for (const MapPolygon& polygon : polygons) {
      for (const MapRing& inner : polygon.inners)
        if (std::find(inner.begin(), inner.end(), ring.front()) != inner.end() &&
            std::find(inner.begin(), inner.end(), ring[1]) != inner.end())
          return true;
    }
    return false;
  }

  void make_osm_ways() {
    for (auto& [id, forward] : objects_.ways) {
      if (taken_over_.count(id) > 0) continue;
      Candidate candidate;
      MapFeature& feature = candidate.feature;
      feature.id = osm_name("way", id);
      OsmClass kind = forward.kind;
      apply_membership(osm_way_memberships_, id, kind, forward.tags, feature.belongs_to);
      if (!kind.kind || *kind.kind == FeatureKind::Tree) continue;
      feature.kind = *kind.kind;
      candidate.left_out = kind.left_out;
      std::string problem;
      if (forward.nodes.empty()) {
        problem = "without nodes";
      } else if (forward.positions.empty()) {
        problem = "with nodes that are not in the map";
      } else if (feature.kind == FeatureKind::TreeRow || feature.kind == FeatureKind::Passage) {
        for (const LonLat& point : forward.positions)
          if (feature.line.empty() || point != feature.line.back()) feature.line.push_back(point);
        if (feature.line.size() < 2) problem = "of one point";
      } else {
        MapRing ring = ring_of(forward, problem);
        if (problem.empty()) feature.polygons.push_back({std::move(ring), {}});
      }
      if (!problem.empty()) {
        // Roads extend beyond every extract.
        if (kind.left_out.empty() && feature.kind != FeatureKind::Passage)
          notes_.add_counted(Level::Loss, "{} ways, " + problem + ", left out", feature.id);
        continue;
      }
      feature.tags = std::move(forward.tags);
      ways_.push_back(std::move(candidate));
    }
  }

  /// Keeps features that touch the box, and the parts of these buildings, so that no building is cut.
  void keep_in_box(std::vector<Candidate>& all) const {
    std::set<std::string> relations;
    const LonLatBox box = options_.box->unwrapped();
    const Eigen::AlignedBox2d bounds(LonLat(box.west, box.south), LonLat(box.east, box.north));
    std::vector<Eigen::AlignedBox2d> on_the_edge;
    std::vector<char> keep(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const MapFeature& feature = all[i].feature;
      keep[i] = touches(feature, box) ? 1 : 0;
      if (keep[i] == 0 || feature.kind != FeatureKind::Building) continue;
      if (!feature.belongs_to.empty()) relations.insert(feature.belongs_to);
      if (!bounds.contains(feature.bounds())) on_the_edge.push_back(feature.bounds());
    }
    std::vector<Candidate> kept;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const MapFeature& feature = all[i].feature;
      if (keep[i] == 0 && feature.kind == FeatureKind::Part) {
        const Eigen::AlignedBox2d own = feature.bounds();
        keep[i] = relations.count(feature.belongs_to) > 0 ||
                  std::any_of(on_the_edge.begin(), on_the_edge.end(),
                              [&](const Eigen::AlignedBox2d& building) { return building.intersects(own); });
      }
      if (keep[i] != 0) kept.push_back(std::move(all[i]));
    }
    all = std::move(kept);
  }

  OsmObjects objects_;
  const OsmReadOptions& options_;
  ReadReport notes_;
  std::map<OsmId, Membership> osm_way_memberships_, relation_memberships_;
  std::set<OsmId> taken_over_;  ///< ways replaced by a multipolygon
  std::vector<Candidate> ways_, multipolygons_;
};

}  // namespace

MapData read_osm(const std::vector<std::filesystem::path>& paths, const OsmReadOptions& options) {
  if (paths.empty()) throw InputError("no map file is given");
  if (options.box) options.box->validate();
  MapData map = FeatureMaker(read_osm_objects(paths, options), options).make();
  std::vector<std::string> names;
  for (const auto& path : paths) names.push_back(path.filename().string());
  map.source = fmt::format("{}", fmt::join(names, ", "));
  const bool building = std::any_of(map.features.begin(), map.features.end(), [](const MapFeature& feature) {
    return feature.kind == FeatureKind::Building || feature.kind == FeatureKind::Part;
  });
  if (!building) {
    std::string problem = options.box ? "has no building in the box" : "has no building";
    const std::vector<std::string> notes = map.notes.lines();
    if (!notes.empty()) problem += fmt::format(" ({})", fmt::join(notes, "; "));
    throw InputError(map.source, 0, problem,
                     options.box ? "widen the box, or check the order west,south,east,north"
                                 : "give an extract with closed ways tagged building");
  }
  return map;
}

}  // namespace canyon::buildings
