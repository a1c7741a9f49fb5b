#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/read_report.hpp"

namespace canyon::buildings {

/// Longitude and latitude [deg], WGS 84, in x and y. Longitudes of one map are within 180 deg of one another,
/// so that those of a map on the antimeridian may be beyond +-180.
using LonLat = Eigen::Vector2d;

/// The longitude [deg], give or take whole turns, that is within 180 deg of `other`.
[[nodiscard]] double longitude_near(double longitude, double other);

/// A closed ring without the repeated last point; any orientation, as the map has it.
using MapRing = std::vector<LonLat>;

struct MapPolygon {
  MapRing outer;
  std::vector<MapRing> inners;
};

enum class FeatureKind : std::uint8_t {
  Building,   ///< outline of a building
  Part,       ///< building:part
  Wood,       ///< natural=wood, landuse=forest: an area of foliage
  TreeRow,    ///< natural=tree_row: a line of foliage
  Tree,       ///< natural=tree: a point of foliage
  Passage,    ///< a road or railway with tunnel, covered or bridge; has a line
  Structure,  ///< of a city model: bridge, tunnel, installation, city furniture; has surfaces only
};

/// A ready-made closed or open surface of a city model: vertices as lon, lat [deg], ellipsoidal height [m].
struct MapSurface {
  std::vector<Eigen::Vector3d> outer;
  std::vector<std::vector<Eigen::Vector3d>> inners;
  /// "RoofSurface", "WallSurface", "GroundSurface", "ClosureSurface", "Window", "Door" ..., or empty.
  std::string semantic;
};

/// Metres in a unit of length: a word of maps, models or rasters, in small letters, or a code of EPSG or
/// UCUM. Feet are international (0.3048 m exactly) but for those of the US survey (1200/3937 m exactly; NIST
/// SP 811, appendix B.6). Empty for others.
[[nodiscard]] std::optional<double> metres_of_unit(std::string_view unit);

using TagMap = std::map<std::string, std::string>;
/// The value of a tag without blanks around it; empty where there is none.
[[nodiscard]] std::string_view tag(const TagMap& tags, const char* key);

/// Whether a date of an end ("1990", "2031-05", "20310501", "31.12.2031", "~2031", "2030s"; OSM wiki,
/// "Key:end_date") is not after 2026-12-01, or is one by its year alone. That day is fixed: a map gives the
/// same city on every day. "before 2031" has ended. Empty without a year from 1000 on.
[[nodiscard]] std::optional<bool> has_ended(std::string_view date);

/// One thing on a map with its tags, before anything is decided about it.
struct MapFeature {
  std::string id;  ///< for people: "way/123", "relation/9", "node/4", the id of a city model's object
  FeatureKind kind = FeatureKind::Building;
  TagMap tags;
  std::vector<MapPolygon> polygons;  ///< Building, Part, Wood
  std::vector<LonLat> line;          ///< TreeRow, Passage: at least two points; Tree: one
  std::vector<MapSurface> surfaces;  ///< of a city model: used instead of polygons and tags
  /// Ellipsoidal height of the foot of a tree [m], where a city model says it.
  std::optional<double> base_m;
  /// id of the building (or type=building relation) that this part, or outline, belongs to, where the map
  /// says so.
  std::string belongs_to;

  /// The bounds of its outer rings, its line and its surfaces [deg]; empty where it has none of these.
  [[nodiscard]] Eigen::AlignedBox2d bounds() const;
  /// Adds whole turns to its longitudes, which brings its middle near `longitude` [deg].
  void bring_near(double longitude);
};

/// The features of map files that a city is built from, merged over files: in a fixed order (by kind of OSM
/// object and id), each once.
struct MapData {
  std::string source;  ///< file names, joined by ", "
  std::vector<MapFeature> features;
  /// Roads and railways in tunnels, under roofs and on bridges: of FeatureKind::Passage. Not in `bounds`.
  std::vector<MapFeature> passages;
  ReadReport notes;  ///< what was left out or guessed, by kind with ids, and what city models hold
  std::size_t foliage_left_out = 0;  ///< trees, tree rows and woods that were not asked for
  Eigen::AlignedBox2d bounds;        ///< of all features [deg]
  std::vector<MapSurface> relief;    ///< of city models: the triangles of the ground
  /// Ellipsoidal height of mean sea level in the middle of the bounds [m], where the file says what its
  /// heights are above.
  std::optional<double> geoid_undulation_m;
};

/// West, south, east, north [deg]; west > east for a box across the antimeridian (RFC 7946, 5.2).
struct LonLatBox {
  double west = -180, south = -90, east = 180, north = 90;
  /// Throws InputError naming the bound; a box across the antimeridian is at most 180 deg wide.
  void validate() const;
  /// The same box with west < east, which may be beyond 180.
  [[nodiscard]] LonLatBox unwrapped() const;
  [[nodiscard]] double middle_longitude() const;
};

}  // namespace canyon::buildings
