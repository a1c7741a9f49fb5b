#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::city {

/// How a mesh file lies on the Earth: v_enu = Rz(heading) * scale * v_file + offset, about `origin`.
struct MeshImportOptions {
  geodesy::Geodetic origin;
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< east, north, up
  double heading_rad = 0;                              ///< turns the mesh counter-clockwise seen from above
  double scale = 1;                                    ///< on top of the unit that the file declares; > 0
  std::optional<char>
      up_axis;  ///< 'Y' or 'Z' where the file's own word is wrong or missing (OBJ, STL, PLY: Z)
  /// Words that mark terrain in the name of a node or of one above it, upper or lower case: "Terrain_02",
  /// "cityGround" and "dem.001" do, "Underground" and "academy" do not.
  std::vector<std::string> terrain_names{"terrain", "ground", "dem"};
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, MeshImportOptions& o);

}  // namespace canyon::city
