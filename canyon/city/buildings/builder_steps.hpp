#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/shape.hpp"
#include "canyon/city/buildings/sources/terrain.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::buildings {

/// Converts map positions to mesh coordinates, and returns the height of the ground there.
class MapFrame {
 public:
  /// Without a terrain the ground has the origin's ellipsoidal height everywhere. `terrain` must outlive this
  /// object. Throws InputError for an origin outside WGS 84's bounds.
  MapFrame(const geodesy::Geodetic& origin, const Terrain* terrain) : frame_(origin), terrain_(terrain) {}

  [[nodiscard]] const geodesy::LocalFrame& frame() const { return frame_; }

  /// East, north, up [m] of longitude, latitude [deg] and ellipsoidal height [m].
  [[nodiscard]] Eigen::Vector3d mesh_from_map(const LonLat& location, double height_m) const;
  /// Inverse: longitude, latitude [deg], ellipsoidal height [m].
  [[nodiscard]] Eigen::Vector3d map_from_mesh(const Eigen::Vector3d& point) const;

  /// Ellipsoidal height of the ground; empty if the terrain has none.
  [[nodiscard]] std::optional<double> ground_height_m(const LonLat& location) const;
  /// Mesh coordinates of the ground at a position; empty likewise.
  [[nodiscard]] std::optional<Eigen::Vector3d> ground(const LonLat& location) const;

 private:
  geodesy::LocalFrame frame_;
  const Terrain* terrain_;
};

/// The ground along a feature, in mesh coordinates [m].
struct Ground {
  double lowest_z = 0, mean_z = 0;  ///< over its points
  double lowest_height_m = 0;       ///< ellipsoidal, at the lowest point
};

/// The ground at the corners of the outer rings and, on a terrain, at points at most 10 m apart between them.
/// Empty if the terrain has no height for any of them.
[[nodiscard]] std::optional<Ground> ground_along(const std::vector<MapPolygon>& polygons,
                                                 const MapFrame& map_frame, bool terrain);

/// Appends the object "terrain" over `bounds` (east, north [m] in the frame about the origin): the terrain's
/// sheet, or without a terrain (nullptr) a sheet at the origin's ellipsoidal height with posts 500 m apart.
/// Throws InputError if the terrain does not cover `bounds`, or would have more than 25 million posts.
void append_ground(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Terrain* terrain,
                   const Eigen::AlignedBox2d& bounds, double terrain_spacing_m);

/// Counts a feature built from its own surfaces.
void count_surveyed(BuildReport& report, FeatureKind kind);

/// Counts the sources of height, roof and facade of something built from tags.
void count_guesses(BuildReport& report, const Shape& shape, bool facade_known);

/// Reports guesses about the city as a whole: most heights guessed, heights for building types that the map
/// lacks, buildings on a slope with level ground.
/// @param level the city has no terrain
void add_guesses(ReadReport& notes, const BuildReport& report, const MapData& map,
                 const HeightDefaults& heights, bool level);

/// Whether a tag names a known facade material.
[[nodiscard]] bool is_facade_known(const std::map<std::string, std::string>& tags);

/// A tag's length [m] if it is within [low, high]; else `otherwise`.
[[nodiscard]] double length_tag_m(const std::map<std::string, std::string>& tags, const char* key, double low,
                                  double high, double otherwise);

/// The tags of a map's features. Parts inherit from their buildings: height or levels if a part has neither,
/// materials of facade and roof, and the building's use.
class FeatureTags {
 public:
  /// Keeps references to both.
  FeatureTags(const MapData& map, const HeightDefaults& heights)
      : map_(map), heights_(heights), building_(map.features.size()) {}

  void set_building(std::size_t part, std::size_t building) { building_[part] = building; }

  /// @param inherited set to whether the height is the building's; may be null
  [[nodiscard]] std::map<std::string, std::string> of(std::size_t feature, bool* inherited = nullptr) const;
  /// shape_from_tags() of these tags.
  [[nodiscard]] Shape shape(std::size_t feature) const;
  [[nodiscard]] city::FacadeMix facades(std::size_t feature) const;

 private:
  const MapData& map_;
  const HeightDefaults& heights_;
  std::vector<std::optional<std::size_t>> building_;  ///< of parts
};

/// The kind of a feature in MapData::passages.
enum class PassageKind : std::uint8_t { Tunnel, Covered, Bridge };
[[nodiscard]] PassageKind passage_kind(const std::map<std::string, std::string>& tags);

/// Appends the solids of a passage, as objects of Surface::Building of concrete. A tunnel has a roof, two
/// walls and open ends; a covered way has a roof; a bridge has its deck.
/// Clear height below a roof: `maxheight` plus 0.3 m, else 5 m, 3 m over footways; below a bridge's deck:
/// `layer` (default 1) times 6 m. Widths: `width`, else 3.5 m for each of `lanes`, else 8 m, 3 m for footways
/// and 5 m for railways.
/// @param line in the city's frame, z the ground; at least two points
/// @param level the ground has one height: the passage is one piece, else it follows the ground in pieces of
/// 30 m at most
/// @return whether anything was appended
bool append_passage(city::Mesh& mesh, const std::string& id, const std::map<std::string, std::string>& tags,
                    const std::vector<Eigen::Vector3d>& line, bool level);

}  // namespace canyon::buildings
