#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Remembers which cells of the city's facades see which directions of the sky past the static city.
///
/// Key: a cell and a direction of a grid of one degree. A cell is the part of one side of one triangle that
/// lies in one square of a grid of `cell_m` along the two axes that its normal is least along.
/// Value: whether a ray from the middle of the cell in the middle of the direction is free. It is a function
/// of the key alone, so that answers do not depend on who asked first, nor on the number of threads, nor on
/// what was forgotten. A ray is cast when a key is asked for that is not remembered.
/// Memory: 4 bytes for each triangle, and a table of 32 bytes for each cell, of at least 32 KB and at most
/// kMostBytes. Eight cells in a row share a word for each direction, and a line of the cache has 64 cells. A
/// new row takes the place of the one that stood at its place in the table. Const members are thread-safe: a
/// row, key and values, is one atomic word.
class FacadeLight {
 public:
  static constexpr double kCell_m = 3;
  static constexpr std::size_t kMostBytes = std::size_t{8} << 20;

  /// Covers the scene's static city; the scene must outlive it. @param cell_m > 0; doubled until all cells
  /// have numbers of 31 bits
  explicit FacadeLight(const raytrace::RayScene& scene, double cell_m = kCell_m);

  struct Cell {
    std::uint32_t number = 0;
    bool has_middle = false;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< off the triangle; set by sees() where it needs it
  };
  /// A direction of the grid.
  struct Direction {
    std::uint32_t number = 0;
    Eigen::Vector3d middle = Eigen::Vector3d::UnitZ();  ///< unit
  };
  /// The cell about a point of a triangle. @param front the side that the triangle's normal is on
  [[nodiscard]] Cell cell(std::uint32_t triangle, const Eigen::Vector3d& point, bool front) const;
  /// The direction of the grid about a unit vector.
  [[nodiscard]] static Direction direction(const Eigen::Vector3d& towards);
  /// Whether a cell sees a direction.
  [[nodiscard]] bool sees(Cell& cell, const Direction& direction) const;
  /// Has the cache bring what sees() will look at: the table is larger than it.
  void fetch(const Cell& cell, const Direction& direction) const {
    __builtin_prefetch(&words_[place_of(cell, direction)]);
  }

  /// Size of the table.
  [[nodiscard]] std::size_t table_bytes() const { return 8 * (words_mask_ + 1); }

 private:
  [[nodiscard]] std::size_t place_of(const Cell& cell, const Direction& direction) const;

  struct Free {
    void operator()(std::uint64_t* words) const { std::free(words); }
  };
  /// A triangle in squares.
  struct Squares {
    std::array<int, 2> axis;  ///< of x, y, z: those that the normal is least along
    Eigen::Vector2d low;
    std::array<std::uint32_t, 2> count;
  };
  [[nodiscard]] std::array<const Eigen::Vector3d*, 3> corners(std::uint32_t triangle) const;
  [[nodiscard]] Squares squares(std::uint32_t triangle) const;
  bool number_cells();
  [[nodiscard]] Eigen::Vector3d middle(std::uint32_t cell) const;

  const raytrace::RayScene* scene_;
  double cell_m_;
  double lift_m_;                     ///< of rays off the triangle
  std::vector<std::uint32_t> first_;  ///< cell of each triangle, and of what is behind the last one
  std::size_t words_mask_ = 0;
  std::unique_ptr<std::uint64_t[], Free> words_;  ///< used as atomics
};

}  // namespace canyon::propagation
