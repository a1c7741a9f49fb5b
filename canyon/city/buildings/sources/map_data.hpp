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

/// Longitude and latitude [deg], WGS 84, in x and y. Longitudes of one map are within 180 deg of each other,
/// so on the antimeridian they may be beyond +-180.
using LonLat = Eigen::Vector2d;

/// The longitude [deg] plus a multiple of 360 deg that is within 180 deg of `other`.
[[nodiscard]] double longitude_near(double longitude, double other);

/// A closed ring without the repeated last point; orientation as in the map.
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

/// Metres in a unit of length: a lower-case word of maps, models or rasters, or a code of EPSG or UCUM. Feet
/// are international (0.3048 m exactly) except those of the US survey (1200/3937 m exactly; NIST SP 811,
/// appendix B.6). Empty for others.
[[nodiscard]] std::optional<double> metres_of_unit(std::string_view unit);

using TagMap = std::map<std::string, std::string>;
/// The value of a tag without blanks around it; empty if there is none.
[[nodiscard]] std::string_view tag(const TagMap& tags, const char* key);

/// Whether an end date ("1990", "2031-05", "20310501", "31.12.2031", "~2031", "2030s"; OSM wiki,
/// "Key:end_date") is not after 2026-12-01; a year alone counts from its beginning. This day is fixed, so
/// that a map gives the same city on any day. "before 2031" has ended. Empty without a year from 1000 on.
[[nodiscard]] std::optional<bool> has_ended(std::string_view date);

/// One object of a map with its tags, before it is interpreted.
struct MapFeature {
  std::string id;  ///< for messages: "way/123", "relation/9", "node/4", the id of a city model's object
  FeatureKind kind = FeatureKind::Building;
  TagMap tags;
  std::vector<MapPolygon> polygons;  ///< Building, Part, Wood
  std::vector<LonLat> line;          ///< TreeRow, Passage: at least two points; Tree: one
  std::vector<MapSurface> surfaces;  ///< of a city model: used instead of polygons and tags
  /// Ellipsoidal height of the base of a tree [m], if the city model has it.
  std::optional<double> base_m;
  /// id of the building (or type=building relation) that this part or outline belongs to, if known.
  std::string belongs_to;

  /// The bounds of its outer rings, line and surfaces [deg]; empty without these.
  [[nodiscard]] Eigen::AlignedBox2d bounds() const;
  /// Adds a multiple of 360 deg to its longitudes, to move its middle near `longitude` [deg].
  void bring_near(double longitude);
};

/// The features of map files that a city is built from, merged over files without duplicates, in a fixed
/// order (by kind of OSM object and id).
struct MapData {
  std::string source;  ///< file names, joined by ", "
  std::vector<MapFeature> features;
  /// Roads and railways in tunnels, under roofs and on bridges: of FeatureKind::Passage. Not in `bounds`.
  std::vector<MapFeature> passages;
  ReadReport notes;  ///< omissions and guesses, by kind with ids, and the contents of city models
  std::size_t foliage_left_out = 0;  ///< trees, tree rows and woods, because foliage is not enabled
  Eigen::AlignedBox2d bounds;        ///< of all features [deg]
  std::vector<MapSurface> relief;    ///< of city models: the triangles of the ground
  /// Ellipsoidal height of mean sea level at the bounds' centre [m], if the file has a height reference.
  std::optional<double> geoid_undulation_m;
};

/// West, south, east, north [deg]; west > east for a box across the antimeridian (RFC 7946, 5.2).
struct LonLatBox {
  double west = -180, south = -90, east = 180, north = 90;
  /// Throws InputError with the bound; a box across the antimeridian is at most 180 deg wide.
  void validate() const;
  /// The same box with west < east, which may be beyond 180.
  [[nodiscard]] LonLatBox unwrapped() const;
  [[nodiscard]] double middle_longitude() const;
};

}  // namespace canyon::buildings
