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

/// Triangles that form one surface of ground, trees and houses, as from photogrammetry: those without
/// features, without a word for a surface, and with textures or colours [m, z up].
struct PhotoMesh {
  std::vector<Eigen::Vector3d> vertices;
  city::TriangleIndices triangles;
};

/// Collects the contents of tiles as objects of a mesh, and as a skin.
///
/// A feature of a batch or property table is one object; other triangles are one object for each connected
/// part. Its surface follows from the first word found in: the feature's kind, its name, the name of the
/// node, of the material. Without a word, a feature is a building; so are other triangles, except flat sheets
/// that face up over half of the tile (terrain). Materials follow words in their names.
class TileMesh {
 public:
  /// @param to_enu from the tile's frame @param name of the tile's file, for features without a name. Throws
  /// InputError, and adds nothing, for vertices that are not finite or more than 500 km away.
  void add(const TileContent& content, const Eigen::Matrix4d& to_enu, const std::string& name);

  [[nodiscard]] city::Mesh& mesh() { return mesh_; }
  [[nodiscard]] PhotoMesh& skin() { return skin_; }
  [[nodiscard]] std::size_t triangles() const { return read_; }
  /// The decisions taken, one line each.
  [[nodiscard]] std::vector<std::string> notes() const;

 private:
  struct Part;
  void add_part(Part& part, const city::Box& tile);
  void add_to_skin(const Part& part);
  void add_object(const std::string& name, city::Surface surface, city::Material material, Part& part);

  city::Mesh mesh_;
  PhotoMesh skin_;
  std::size_t read_ = 0, degenerate_ = 0, rotated_ = 0, open_ = 0;
  std::array<std::size_t, 4> by_word_{};  ///< objects by surface
  std::size_t sheets_ = 0, guessed_ = 0;
};

/// Splits a skin into terrain, buildings and foliage, simplifies it to fewer and flat facets, and appends it
/// to a mesh. Returns notes.
///
/// Terrain is less than 2 m above the ground (GroundModel). Above it, planar regions of at least 3 m^2 are
/// buildings, as are walls that reach down to the ground; rough areas of 10 m^2 and more are foliage, unless
/// large planes enclose them. Smaller rough pieces join their neighbours: chimneys, dormers, parapets. Small
/// planes amid foliage, and pieces with foliage and no roof, are foliage: sides of crowns and hedges.
[[nodiscard]] std::vector<std::string> append_skin(const PhotoMesh& skin, city::Mesh& mesh);

}  // namespace canyon::tiles
