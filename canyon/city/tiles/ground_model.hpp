#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "canyon/city/mesh_topology.hpp"

namespace canyon::tiles {

/// The ground below a skin: the lowest surface in each cell of a grid, less what stands out of it and is
/// narrower than 80 m. A progressive morphological filter: the opening by a window that grows step by step,
/// where a cell counts as an object if it stands out of the opened surface by more than the window's growth
/// allows for a slope of 0.3, and at most 3 m (after K. Zhang et al., IEEE TGRS 41(4), 2003).
class GroundModel {
 public:
  /// @param triangles of the skin; at least one
  GroundModel(const std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles);

  /// Height of the ground [m]; of the nearest cell that has one.
  [[nodiscard]] double height_m(const Eigen::Vector2d& place) const;

 private:
  void rasterize(const std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles);
  void filter();
  void fill();
  [[nodiscard]] std::vector<double> filtered(const std::vector<double>& values, std::size_t half,
                                             bool low) const;

  Eigen::Vector2d min_;
  double cell_m_ = 1;
  std::size_t columns_ = 1, rows_ = 1;
  std::vector<double> heights_;  ///< NaN: none yet
};

}  // namespace canyon::tiles
