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

/// Converts places on the map to mesh coordinates, and gives the height of the ground there.
class MapFrame {
 public:
  /// Without a terrain the ground has the origin's ellipsoidal height everywhere. `terrain` must outlive
  /// this. Throws InputError for an origin outside WGS 84's bounds.
  MapFrame(const geodesy::Geodetic& origin, const Terrain* terrain) : frame_(origin), terrain_(terrain) {}

  [[nodiscard]] const geodesy::LocalFrame& frame() const { return frame_; }

  /// East, north, up [m] of longitude, latitude [deg] and ellipsoidal height [m].
  [[nodiscard]] Eigen::Vector3d mesh_from_map(const LonLat& place, double height_m) const;
  /// Inverse: longitude, latitude [deg], ellipsoidal height [m].
  [[nodiscard]] Eigen::Vector3d map_from_mesh(const Eigen::Vector3d& point) const;

  /// Ellipsoidal height of the ground; empty where the terrain has none.
  [[nodiscard]] std::optional<double> ground_height_m(const LonLat& place) const;
  /// Mesh coordinates of the ground at a place; empty likewise.
  [[nodiscard]] std::optional<Eigen::Vector3d> ground(const LonLat& place) const;

 private:
  geodesy::LocalFrame frame_;
  const Terrain* terrain_;
};

/// The ground along a feature, in mesh coordinates [m].
struct Ground {
  double lowest_z = 0, mean_z = 0;  ///< over its points
  double lowest_height_m = 0;       ///< ellipsoidal, of the lowest one
};

/// The ground at the corners of the outer rings and, on a terrain, at points at most 10 m apart between them.
/// Empty where the terrain has no height for any of them.
[[nodiscard]] std::optional<Ground> ground_along(const std::vector<MapPolygon>& polygons,
                                                 const MapFrame& map_frame, bool terrain);

/// Appends the object "terrain" over `bounds` (east, north [m] in the frame about the origin): the
/// terrain's sheet, or without one (nullptr) a sheet at the origin's ellipsoidal height with posts 500 m
/// apart. Throws InputError where the terrain does not cover it, or would have more than 25 million posts.
void append_ground(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Terrain* terrain,
                   const Eigen::AlignedBox2d& bounds, double terrain_spacing_m);

/// Counts a feature that was built from surfaces of its own.
void count_surveyed(BuildReport& report, FeatureKind kind);

/// Counts where the height, roof and facade of something built from tags are from.
void count_guesses(BuildReport& report, const Shape& shape, bool facade_known);

/// Says what is guessed of the city as a whole: most heights, heights for types of buildings that the map
/// does not have, buildings of a slope on level ground.
/// @param level the city has no terrain
void add_guesses(ReadReport& notes, const BuildReport& report, const MapData& map,
                 const HeightDefaults& heights, bool level);

/// Whether a tag names a material of the facade that is known.
[[nodiscard]] bool is_facade_known(const std::map<std::string, std::string>& tags);

/// A tag's length [m] if it is within [low, high], else `otherwise`.
[[nodiscard]] double length_tag_m(const std::map<std::string, std::string>& tags, const char* key, double low,
                                  double high, double otherwise);

/// The tags of a map's features, with what parts take from their buildings: height or levels where a part has
/// neither, materials of facade and roof, and what a building is used for.
class FeatureTags {
 public:
  /// Both are kept by reference.
  FeatureTags(const MapData& map, const HeightDefaults& heights)
      : map_(map), heights_(heights), building_(map.features.size()) {}

  void set_building(std::size_t part, std::size_t building) { building_[part] = building; }

  /// @param inherited set to whether the height is the building's; may be null
  [[nodiscard]] std::map<std::string, std::string> of(std::size_t feature, bool* inherited = nullptr) const;
  /// shape_from_tags() of them.
  [[nodiscard]] Shape shape(std::size_t feature) const;
  [[nodiscard]] city::FacadeMix facades(std::size_t feature) const;

 private:
  const MapData& map_;
  const HeightDefaults& heights_;
  std::vector<std::optional<std::size_t>> building_;  ///< of parts
};

/// The kind of a way of MapData::passages.
enum class PassageKind : std::uint8_t { Tunnel, Covered, Bridge };
[[nodiscard]] PassageKind passage_kind(const std::map<std::string, std::string>& tags);

/// Appends the solids of a passage, as objects of Surface::Building of concrete: of a tunnel a roof and two
/// walls with open mouths, of a covered way a roof, of a bridge its deck.
///
/// The inner height of roofs is `maxheight` and 0.3 m more, else 5 m, 3 m over footways; of a bridge's deck
/// `layer` (1 without) times 6 m. Widths: `width`, else 3.5 m for each of `lanes`, else 8 m, 3 m of footways
/// and 5 m of railways.
/// @param line in the city's frame, z the ground; at least two points
/// @param level the ground has one height: the passage is one piece, else it follows the ground in pieces of
/// 30 m at most
/// @return whether there was anything to append
bool append_passage(city::Mesh& mesh, const std::string& id, const std::map<std::string, std::string>& tags,
                    const std::vector<Eigen::Vector3d>& line, bool level);

}  // namespace canyon::buildings
