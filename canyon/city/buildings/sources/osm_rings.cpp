#include "canyon/city/buildings/sources/osm_rings.hpp"

#include <algorithm>
#include <cmath>
// GCC sees a user name of size 0 in libosmium's packed objects once all is inlined.
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

#include "canyon/city/meshes/geos.hpp"

namespace canyon::buildings {
namespace {

/// libosmium's places are within +-180 deg: those of a map on the antimeridian are handed to it turned by so
/// many degrees.
double turn_for_osmium(const RingMembers& members) {
  for (const auto& [way, role] : members)
    for (const LonLat& place : way->places)
      if (std::abs(place.x()) > 180) return std::copysign(180, place.x());
  return 0;
}

MapRing ring_of(const osmium::NodeRefList& nodes, double turn) {
  MapRing ring;
  ring.reserve(nodes.size());
  for (const osmium::NodeRef& node : nodes) ring.emplace_back(node.lon() + turn, node.lat());
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  return ring;
}

/// libosmium's form of a way: the assembler takes no other.
std::size_t append_way(osmium::memory::Buffer& buffer, OsmId id, const OsmWay& way, double turn) {
  {
    osmium::builder::WayBuilder builder(buffer);
    builder.set_id(id);
    osmium::builder::WayNodeListBuilder nodes(builder);
    for (std::size_t i = 0; i < way.nodes.size(); ++i) {
      nodes.add_node_ref(
          osmium::NodeRef(way.nodes[i], osmium::Location(way.places[i].x() - turn, way.places[i].y())));
    }
  }
  return buffer.commit();
}

std::vector<MapPolygon> polygons_of(const osmium::memory::Buffer& buffer, double turn) {
  std::vector<MapPolygon> polygons;
  for (const auto& area : buffer.select<osmium::Area>()) {
    for (const auto& outer : area.outer_rings()) {
      MapPolygon polygon;
      polygon.outer = ring_of(outer, turn);
      for (const auto& inner : area.inner_rings(outer)) polygon.inners.push_back(ring_of(inner, turn));
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
        point.x() < (b.x() - a.x()) * (point.y() - a.y()) / (b.y() - a.y()) + a.x()) {
      odd = !odd;
    }
  }
  return odd;
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

}  // namespace

MapRing ring_of(const OsmWay& way, std::string& problem) {
  if (way.places.size() < 2 || way.places.front() != way.places.back()) {
    problem = "outline not closed";
    return {};
  }
  MapRing ring;
  ring.reserve(way.places.size());
  for (const LonLat& place : way.places) {
    if (ring.empty() || place != ring.back()) ring.push_back(place);
  }
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  if (ring.size() < 3) {
    problem = "outline of fewer than three corners";
    return {};
  }
  return ring;
}

std::vector<MapPolygon> assemble(OsmId id, const RingMembers& members, std::string& note) {
  osmium::memory::Buffer ways(4096, osmium::memory::Buffer::auto_grow::yes);
  std::vector<std::size_t> offsets;
  const double turn = turn_for_osmium(members);
  for (std::size_t i = 0; i < members.size(); ++i) {
    // The assembler takes a way once; ids only need to differ as the ways do.
    const auto same = std::find_if(members.begin(), members.begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const auto& member) { return member.first == members[i].first; });
    if (same != members.begin() + static_cast<std::ptrdiff_t>(i)) {
      offsets.push_back(offsets[static_cast<std::size_t>(same - members.begin())]);
    } else {
      offsets.push_back(append_way(ways, static_cast<OsmId>(i + 1), *members[i].first, turn));
    }
  }
  osmium::memory::Buffer relations(4096, osmium::memory::Buffer::auto_grow::yes);
  {
    osmium::builder::RelationBuilder builder(relations);
    builder.set_id(id);
    osmium::builder::RelationMemberListBuilder list(builder);
    for (std::size_t i = 0; i < members.size(); ++i) {
      list.add_member(osmium::item_type::way, static_cast<OsmId>(i + 1), members[i].second.c_str());
    }
  }
  relations.commit();
  std::vector<const osmium::Way*> pointers;
  for (const std::size_t offset : offsets) pointers.push_back(&ways.get<const osmium::Way>(offset));

  osmium::area::AssemblerConfig config;
  config.create_empty_areas = false;
  osmium::area::Assembler assembler(config);
  osmium::memory::Buffer areas(4096, osmium::memory::Buffer::auto_grow::yes);
  if (assembler(relations.get<const osmium::Relation>(0), pointers, areas)) {
    std::vector<MapPolygon> polygons = polygons_of(areas, turn);
    if (!polygons.empty()) return polygons;
  }
  std::vector<MapPolygon> polygons = by_roles(members);
  note = polygons.empty() ? "rings that do not close or cross each other"
                          : "rings that cross or touch wrongly, taken one by one";
  return polygons;
}

bool touches(const MapFeature& feature, const LonLatBox& box) {
  namespace geos = meshes::geos;
  const geos::Geometry area = geos::polygon(
      {{box.west, box.south}, {box.east, box.south}, {box.east, box.north}, {box.west, box.north}});
  const auto meets = [&](const geos::Geometry& shape) {
    return shape && GEOSIntersects_r(geos::context(), area.get(), shape.get()) != 0;  // 2: GEOS does not know
  };
  return meets(geos::line(feature.line)) ||
         std::any_of(feature.polygons.begin(), feature.polygons.end(), [&](const MapPolygon& polygon) {
           return meets(geos::polygon(polygon.outer, polygon.inners));
         });
}

}  // namespace canyon::buildings
