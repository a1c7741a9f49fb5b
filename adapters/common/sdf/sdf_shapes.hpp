#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <sdf/Geometry.hh>
#include <sdf/Material.hh>
#include <string>
#include <vector>

#include "canyon/city/link_shapes.hpp"

// Shapes of links described by sdformat's classes (12 and newer).

namespace canyon::adapters {

using city::HeightGrid;
using city::LinkShapes;
using city::MeshFile;
using city::MeshNode;
using city::Polyline;

/// Reads and makes shapes with the host's functions. File names are as in SDF: `uri` may be
/// relative to `sdf_file` (sdf::Mesh::FilePath()), which may be empty. Empty results: not found or
/// unreadable; an InputError has the reason.
class ShapeFiles {
 public:
  virtual ~ShapeFiles() = default;
  [[nodiscard]] virtual std::optional<MeshFile> mesh(const std::string& uri, const std::string& sdf_file) = 0;
  /// See Extrude.
  [[nodiscard]] virtual std::optional<MeshNode> extrude(const std::string& name,
                                                        const std::vector<Polyline>& polylines,
                                                        double height) = 0;
  /// Heights scaled to `size_z` [m], the third number of SDF's <size>. HeightGrid's size and position may
  /// stay empty: they are taken from the geometry.
  [[nodiscard]] virtual std::optional<HeightGrid> heights(const std::string& uri, const std::string& sdf_file,
                                                          double size_z) = 0;
};

/// Adds the geometry of a collision or visual to its link. Without `files` (null) shapes that need them are
/// left out with a note.
void add_shape(LinkShapes& link, const LinkShapes::ShapePose& location, const sdf::Geometry& geometry,
               ShapeFiles* files);

/// A visual's material, by its script's name, else its diffuse colour (material_by_colour()); null: Unknown.
[[nodiscard]] city::Material material_of(const sdf::Material* material);

/// Changes if the kind, size, scale, mesh or pose of a shape changes. Ignores contents of files.
[[nodiscard]] std::uint64_t fingerprint(const sdf::Geometry& geometry,
                                        const Eigen::Isometry3d& link_from_shape);

}  // namespace canyon::adapters
