#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/studies/heatmap/kernels/bins.hpp"
#include "canyon/studies/heatmap/kernels/shadows.hpp"

namespace canyon::heatmap {

/// Which cells of a horizontal plane lie within buildings, as the level rays of RayScene::placement() vote,
/// but for all cells at once.
///
/// The plane cuts the walls of all buildings in directed segments, fronts to their right. How many of them a
/// level ray crosses, counter-clockwise less clockwise, is placement()'s count of walls met from behind less
/// those met from the front. Along the grid's rows it follows by scan lines. Turning the ray by an angle
/// changes it only where an end of a chain of segments is passed, by one for each: where walls close, as
/// mostly, there is none, and all directions agree (the winding number). So the seven votes of a cell are one
/// count, corrected by the few ends in sight.
/// Const, thread-safe after construction.
class Interiors {
 public:
  /// @param mesh as city::check_mesh() demands; its triangles are copied
  explicit Interiors(const city::Mesh& mesh);

  /// Only for cells with wanted[i] != 0: inside[i] = 1 where most of the seven level rays say so, else 0.
  /// A roof above is not looked for. False, with nothing done, where so many chains end
  /// in the plane that rays are cheaper. Coordinates of walls are exact to rounding (1e-9 m); cells nearer to
  /// a wall may fall to either side.
  [[nodiscard]] bool find(const CellPlane& plane, std::span<const std::uint8_t> wanted,
                          std::span<std::uint8_t> inside) const;
  /// Ends of chains in a plane, each counted as often as segments end there without going on.
  [[nodiscard]] std::size_t open_ends(double z) const;

  /// Cells that lie on a surface of any kind that the plane cuts, within `distance_m` of it; ascending. Rays
  /// leave these surfaces out at their origin, and drawn shadows do not.
  [[nodiscard]] std::vector<std::uint32_t> on_surfaces(const CellPlane& plane, double distance_m) const;

 private:
  struct End {
    double x = 0, y = 0;
    int begins = 0;  ///< chains that begin here less those that end
  };
  [[nodiscard]] std::vector<End> ends(double z) const;
  template <class Call>
  void for_each_segment(const CellPlane& plane, double margin_m, const Call& call) const;
  void count_rows(const CellPlane& plane, std::vector<std::int32_t>& crossings) const;

  /// Triangles by bands of north coordinate, so that a tile looks at those that its rows may cross. A
  /// triangle stands in every band it touches.
  struct Triangle {
    std::array<std::array<double, 3>, 3> corner;
    bool building = true;
  };
  std::vector<Triangle> triangles_;
  double south_m_ = 0, band_m_ = 1;
  Bins bands_;
  /// Edges that more triangles run along in one direction than in the other; upwards.
  struct OpenEdge {
    std::array<double, 3> low, high;
    int upwards = 0;  ///< runs upwards less runs downwards
  };
  std::vector<OpenEdge> open_edges_;
};

}  // namespace canyon::heatmap
