#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "canyon/city/tiles/tile_content.hpp"

namespace canyon::tiles {

/// Triangles that are one skin of ground, trees and houses, as photographs give it: those without features,
/// without a word for a surface, and with pictures or colours [m, z up].
struct Skin {
  std::vector<Eigen::Vector3d> vertices;
  city::TriangleIndices triangles;
};

/// Gathers the contents of tiles as objects of a mesh, and as a skin.
///
/// A feature of a batch or property table is one object; other triangles are one object for each connected
/// part. Its surface is what a word says of it: the feature's kind, its name, the name of the node, of the
/// material. Without a word, a feature is a building; so are other triangles, but flat sheets that look up
/// and extend over half of the tile, which are terrain. Materials follow words in materials' names.
class TileMesh {
 public:
  /// @param to_enu from the tile's frame @param name of the tile's file, for features without a name. Throws
  /// InputError, and adds nothing, for vertices that are not finite or more than 500 km away.
  void add(const TileContent& content, const Eigen::Matrix4d& to_enu, const std::string& name);

  [[nodiscard]] city::Mesh& mesh() { return mesh_; }
  [[nodiscard]] Skin& skin() { return skin_; }
  [[nodiscard]] std::size_t triangles() const { return read_; }
  /// The decisions that were taken, one line each.
  [[nodiscard]] std::vector<std::string> notes() const;

 private:
  struct Part;
  void add_part(Part& part, const city::Box& tile);
  void add_to_skin(const Part& part);
  void add_object(const std::string& name, city::Surface surface, city::Material material, Part& part);

  city::Mesh mesh_;
  Skin skin_;
  std::size_t read_ = 0, degenerate_ = 0, turned_ = 0, open_ = 0;
  std::array<std::size_t, 4> by_word_{};  ///< objects, by surface
  std::size_t sheets_ = 0, guessed_ = 0;
};

/// Splits a skin into terrain, buildings and foliage, makes it of fewer and flat facets, and appends it to a
/// mesh. Returns notes.
///
/// Terrain is what lies less than 2 m above the ground (GroundModel). Above it, planar regions of at least 3
/// m^2 are buildings, as are walls that reach down to the ground; what is rough over 10 m^2 and more is
/// foliage, unless large planes enclose it. Smaller rough pieces go with what they adjoin: chimneys, dormers,
/// parapets. Small planes amid foliage, and what has foliage and no roof, are foliage: sides of crowns and
/// hedges.
[[nodiscard]] std::vector<std::string> append_skin(const Skin& skin, city::Mesh& mesh);

}  // namespace canyon::tiles
