#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace canyon::buildings {

/// Longitude and latitude [deg], WGS 84, in x and y.
using LonLat = Eigen::Vector2d;

/// A closed ring without the repeated last point; any orientation, as the map has it.
using MapRing = std::vector<LonLat>;

struct MapPolygon {
  MapRing outer;
  std::vector<MapRing> inners;
};

enum class FeatureKind : std::uint8_t {
  Building,  ///< outline of a building
  Part,      ///< building:part
  Wood,      ///< natural=wood, landuse=forest: an area of foliage
  TreeRow,   ///< natural=tree_row: a line of foliage
  Tree,      ///< natural=tree: a point of foliage
};

/// A ready-made closed or open surface (CityJSON): vertices as lon, lat [deg], ellipsoidal height [m].
struct MapSurface {
  std::vector<Eigen::Vector3d> outer;
  std::vector<std::vector<Eigen::Vector3d>> inners;
  std::string semantic;  ///< "RoofSurface", "WallSurface", "GroundSurface", or empty
};

/// One thing on a map with its tags, before anything is decided about it.
struct MapFeature {
  std::string id;  ///< for people: "way/123", "relation/9", "node/4", a CityJSON object's key
  FeatureKind kind = FeatureKind::Building;
  std::map<std::string, std::string> tags;
  std::vector<MapPolygon> polygons;  ///< Building, Part, Wood
  std::vector<LonLat> line;          ///< TreeRow: at least two points; Tree: one
  std::vector<MapSurface> surfaces;  ///< CityJSON: used instead of polygons and tags
  /// id of the building (or type=building relation) that this part, or outline, belongs to, where the map
  /// says so.
  std::string belongs_to;
};

/// The features of map files that a city is built from, merged over files: in a fixed order (by kind of OSM
/// object and id), each once.
struct MapData {
  std::string source;  ///< file names, joined by ", "
  std::vector<MapFeature> features;
  std::vector<std::string> warnings;  ///< one line each, with ids; repeated kinds are counted
  std::size_t foliage_left_out = 0;   ///< trees, tree rows and woods that were not asked for
  /// Bounds of all features [deg]; min > max when there is none.
  LonLat min = LonLat::Constant(1e9);
  LonLat max = LonLat::Constant(-1e9);
  /// Ellipsoidal height of mean sea level in the middle of the bounds [m], where the file says what its
  /// heights are above.
  std::optional<double> geoid_undulation_m;
};

/// West, south, east, north [deg].
struct LonLatBox {
  double west = -180, south = -90, east = 180, north = 90;
  /// Throws InputError naming the bound; boxes across the antimeridian (west > east) are refused with the
  /// cure to build the two sides apart.
  void validate() const;
};

}  // namespace canyon::buildings
