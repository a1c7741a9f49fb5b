#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "canyon/analysis/heatmap/kernels/bins.hpp"
#include "canyon/analysis/heatmap/kernels/shadows.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::heatmap {

/// Which cells of a horizontal plane are inside buildings, by the vote of level rays of
/// RayScene::containment(), but for all cells at once.
///
/// The plane cuts the walls of all buildings in directed segments, fronts to their right. The number of
/// segments that a level ray crosses, counter-clockwise minus clockwise, is containment()'s count of walls
/// hit from behind minus those hit from the front. Along the grid's rows it is computed by scan lines.
/// Rotating the ray by an angle changes it only if the ray passes an end of a chain of segments, by one for
/// each: mostly walls close, there is no end, and all directions agree (the winding number). So the seven
/// votes of a cell are one count, corrected for the few visible ends. Const, thread-safe after construction.
class Interiors {
 public:
  /// @param mesh valid by city::check_mesh(); its triangles are copied
  explicit Interiors(const city::Mesh& mesh);

  /// Only for cells with wanted[i] != 0: inside[i] = 1 if most of the seven level rays are inside, else 0. A
  /// roof above is not checked. Returns false, without a result, if so many chains end in the plane that rays
  /// are cheaper. Coordinates of walls are exact to rounding (1e-9 m); cells nearer to a wall may be on
  /// either side.
  [[nodiscard]] bool find(const CellPlane& plane, std::span<const std::uint8_t> wanted,
                          std::span<std::uint8_t> inside) const;
  /// Ends of chains in a plane, each counted as often as segments end there without a successor.
  [[nodiscard]] std::size_t open_ends(double z) const;

  /// Cells on a surface of any kind that the plane cuts, within `distance_m` of it; ascending. Rays ignore
  /// these surfaces at their origin, rasterised shadows do not.
  [[nodiscard]] std::vector<std::uint32_t> on_surfaces(const CellPlane& plane, double distance_m) const;

 private:
  struct End {
    double x = 0, y = 0;
    int begins = 0;  ///< chains that begin here minus those that end
  };
  [[nodiscard]] std::vector<End> ends(double z) const;
  template <class Call>
  void for_each_segment(const CellPlane& plane, double margin_m, const Call& call) const;
  void count_rows(const CellPlane& plane, std::vector<std::int32_t>& crossings) const;

  /// Triangles by bands of north coordinate, so that a tile checks those that its rows may cross. A triangle
  /// is in every band that it touches.
  struct Triangle {
    std::array<std::array<double, 3>, 3> corner;
    bool building = true;
  };
  std::vector<Triangle> triangles_;
  double south_m_ = 0, band_m_ = 1;
  Bins bands_;
  /// Edges with different numbers of triangles in either direction; upwards.
  struct OpenEdge {
    std::array<double, 3> low, high;
    int upwards = 0;  ///< number of upward minus downward runs
  };
  std::vector<OpenEdge> open_edges_;
};

}  // namespace canyon::heatmap
