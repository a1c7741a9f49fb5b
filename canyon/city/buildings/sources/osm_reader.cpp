// OSM objects to map features: outlines, multipolygons, building relations, foliage.
#include "canyon/city/buildings/sources/osm_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/osm_objects.hpp"
#include "canyon/city/buildings/sources/osm_rings.hpp"

namespace canyon::buildings {
namespace {

/// A feature, or something of a feature's kind that is counted but not built.
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
    make_multipolygons();  // before ways, since they take some over
    make_ways();
    std::vector<Candidate> all;
    for (auto& [id, tree] : objects_.trees) {
      Candidate candidate;
      candidate.feature.id = osm_name("node", id);
      candidate.feature.kind = FeatureKind::Tree;
      candidate.feature.tags = std::move(tree.tags);
      candidate.feature.line = {tree.place};
      all.push_back(std::move(candidate));
    }
    std::move(ways_.begin(), ways_.end(), std::back_inserter(all));
    std::move(multipolygons_.begin(), multipolygons_.end(), std::back_inserter(all));
    if (options_.box) keep_in_box(all);

    MapData map;
    for (Candidate& candidate : all) {
      if (!candidate.left_out.empty()) {
        notes_.tell(Level::Remark, "{} left out, " + candidate.left_out, candidate.feature.id);
        continue;
      }
      if (candidate.feature.kind == FeatureKind::Passage) {
        map.passages.push_back(std::move(candidate.feature));
        continue;
      }
      const Eigen::AlignedBox2d bounds = candidate.feature.bounds();
      constexpr double kLargest_deg = 0.2;
      if (candidate.feature.kind == FeatureKind::Building && !bounds.isEmpty() &&
          bounds.sizes().maxCoeff() > kLargest_deg) {
        notes_.tell(Level::Loss, "{} buildings of more than 20 km, left out: a corner is wrong",
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
        const bool way = member.type == 'w';
        const bool present =
            way ? objects_.ways.count(member.ref) > 0 : objects_.relations.count(member.ref) > 0;
        if (!present) {
          missing.push_back(way ? osm_name("way", member.ref) : osm_name("relation", member.ref));
          continue;
        }
        any = true;
        auto& memberships = way ? way_memberships_ : relation_memberships_;
        memberships.emplace(member.ref, Membership{id, outline, part});
      }
      if (any && !missing.empty()) {
        notes_.tell(
            Level::Loss, "{} building relations with members that are not in the map, built of the others",
            fmt::format("{} (without {})", osm_name("relation", id),
                        fmt::join(missing.begin(),
                                  missing.begin() + std::min<std::ptrdiff_t>(std::ssize(missing), 20), " ")));
      }
    }
  }

  /// Kind and tags of a member of a type=building relation: its role counts where its tags say nothing.
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
      for (const auto& [key, value] : relation.tags) {
        if (key != "type") tags.emplace(key, value);
      }
    }
    if (kind.left_out.empty()) kind.left_out = relation.kind.left_out;
  }

  void make_multipolygons() {
    for (const auto& [id, relation] : objects_.relations) {
      if (relation.multipolygon) make_multipolygon(id, relation);
    }
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
      const auto way = objects_.ways.find(member.ref);
      complete = complete && way != objects_.ways.end() && !way->second.places.empty();
      if (way == objects_.ways.end()) continue;
      members.emplace_back(member.ref, &member);
      // Old style: the outer ways carry the tags.
      if (member.role != "inner" && says_nothing(relation.tags) && !kind.kind && way->second.kind.kind) {
        kind = way->second.kind;
        feature.tags.insert(way->second.tags.begin(), way->second.tags.end());
      }
    }
    apply_membership(relation_memberships_, id, kind, feature.tags, feature.belongs_to);
    if (!kind.kind) return;
    feature.kind = *kind.kind;
    candidate.left_out = kind.left_out;
    if (feature.kind == FeatureKind::TreeRow || feature.kind == FeatureKind::Tree ||
        feature.kind == FeatureKind::Passage) {
      return;
    }
    if (!complete || members.empty()) {
      if (kind.left_out.empty())
        notes_.tell(Level::Loss, "{} multipolygons that the map holds in part only, left out", feature.id);
      return;
    }
    // Several whole buildings under one relation: each way says more of itself than the relation does.
    const auto stands_alone = [&](const std::pair<OsmId, const OsmMember*>& member) {
      const OsmWay& way = objects_.ways.at(member.first);
      std::string ignored;
      return member.second->role != "inner" && way.kind.kind == feature.kind &&
             !ring_of(way, ignored).empty();
    };
    if (members.size() > 1 && std::all_of(members.begin(), members.end(), stands_alone)) {
      for (const auto& [way, member] : members) {
        objects_.ways.at(way).tags.insert(feature.tags.begin(), feature.tags.end());
      }
      notes_.tell(Level::Remark, "{} multipolygons of whole buildings, read as these", feature.id);
      return;
    }
    RingMembers rings;
    for (const auto& [way, member] : members) rings.emplace_back(&objects_.ways.at(way), member->role);
    std::string note;
    feature.polygons = assemble(id, rings, note);
    if (!note.empty() && kind.left_out.empty()) {
      const bool lost = feature.polygons.empty();
      notes_.tell(lost ? Level::Loss : Level::Remark,
                  "{} multipolygons of " + note + (lost ? ", left out" : ""), feature.id);
    }
    if (feature.polygons.empty()) return;
    const bool one_outer = feature.polygons.size() == 1;
    for (const auto& [way_id, member] : members) {
      const OsmWay& way = objects_.ways.at(way_id);
      if (member->role == "inner" || way.kind.kind != feature.kind) continue;
      // A ring without a role may be an inner one, and another building.
      std::string ignored;
      const MapRing ring = ring_of(way, ignored);
      if (member->role.empty() && !ring.empty() && is_inner(ring, feature.polygons)) continue;
      taken_over_.insert(way_id);
      if (one_outer) feature.tags.insert(way.tags.begin(), way.tags.end());
    }
    multipolygons_.push_back(std::move(candidate));
  }

  static bool is_inner(const MapRing& ring, const std::vector<MapPolygon>& polygons) {
    for (const MapPolygon& polygon : polygons) {
      for (const MapRing& inner : polygon.inners) {
        if (std::find(inner.begin(), inner.end(), ring.front()) != inner.end() &&
            std::find(inner.begin(), inner.end(), ring[1]) != inner.end()) {
          return true;
        }
      }
    }
    return false;
  }

  void make_ways() {
    for (auto& [id, way] : objects_.ways) {
      if (taken_over_.count(id) > 0) continue;
      Candidate candidate;
      MapFeature& feature = candidate.feature;
      feature.id = osm_name("way", id);
      OsmClass kind = way.kind;
      apply_membership(way_memberships_, id, kind, way.tags, feature.belongs_to);
      if (!kind.kind || *kind.kind == FeatureKind::Tree) continue;
      feature.kind = *kind.kind;
      candidate.left_out = kind.left_out;
      std::string problem;
      if (way.nodes.empty()) {
        problem = "without nodes";
      } else if (way.places.empty()) {
        problem = "with nodes that are not in the map";
      } else if (feature.kind == FeatureKind::TreeRow || feature.kind == FeatureKind::Passage) {
        for (const LonLat& place : way.places) {
          if (feature.line.empty() || place != feature.line.back()) feature.line.push_back(place);
        }
        if (feature.line.size() < 2) problem = "of one point";
      } else {
        MapRing ring = ring_of(way, problem);
        if (problem.empty()) feature.polygons.push_back({std::move(ring), {}});
      }
      if (!problem.empty()) {
        // Roads run out of every extract.
        if (kind.left_out.empty() && feature.kind != FeatureKind::Passage)
          notes_.tell(Level::Loss, "{} ways, " + problem + ", left out", feature.id);
        continue;
      }
      feature.tags = std::move(way.tags);
      ways_.push_back(std::move(candidate));
    }
  }

  /// Keeps what touches the box, and the parts of buildings that do, so that no building is cut.
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
  std::map<OsmId, Membership> way_memberships_, relation_memberships_;
  std::set<OsmId> taken_over_;  ///< ways that a multipolygon stands for
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
    std::string problem = options.box ? "holds no building in the box" : "holds no building";
    const std::vector<std::string> notes = map.notes.lines();
    if (!notes.empty()) problem += fmt::format(" ({})", fmt::join(notes, "; "));
    throw InputError(map.source, 0, problem,
                     options.box ? "widen the box, or check the order west,south,east,north"
                                 : "give an extract with closed ways tagged building");
  }
  return map;
}

}  // namespace canyon::buildings
