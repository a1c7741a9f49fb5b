#pragma once

#include <gz/math/SphericalCoordinates.hh>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "adapters/common/sdf/sdf_shapes.hpp"

namespace canyon::adapters::gz_sim {

/// Mesh files, extrusions and heightmaps, read with Gazebo's readers and found in the folders of its physics.
class GzShapeFiles : public ShapeFiles {
 public:
  /// The world's position, for elevation rasters (DEM); empty: none.
  void set_world_origin(std::optional<gz::math::SphericalCoordinates> origin) { origin_ = std::move(origin); }

  [[nodiscard]] std::optional<MeshFile> mesh(const std::string& uri, const std::string& sdf_file) override;
  [[nodiscard]] std::optional<MeshNode> extrude(const std::string& name,
                                                const std::vector<Polyline>& polylines,
                                                double height) override;
  [[nodiscard]] std::optional<HeightGrid> heights(const std::string& uri, const std::string& sdf_file,
                                                  double size_z) override;

 private:
  std::optional<gz::math::SphericalCoordinates> origin_;
};

}  // namespace canyon::adapters::gz_sim
