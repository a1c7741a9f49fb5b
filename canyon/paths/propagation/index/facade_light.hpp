#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Cache of the directions of the sky that cells of the city's facades see past the static city.
/// Key: a cell and a direction of a grid of one degree. A cell is the part of one side of one triangle in one
/// square of a grid of `cell_m` along the two axes on which its normal has the smallest components. Value:
/// whether a ray from the middle of the cell in the middle of the direction is free. It is a function of the
/// key alone, so that results do not depend on the order of requests, the number of threads, or evicted
/// entries. A ray is cast if the requested key is not cached. Memory: 4 bytes for each triangle, and a table
/// of 32 bytes for each cell, of at least 32 KB and at most kMaxBytes. Eight cells in a row share a word for
/// each direction, and a cache line has 64 cells. A new row replaces the row with the same table index. Const
/// members are thread-safe: a row, key and values, is one atomic word.
class FacadeLight {
 public:
  static constexpr double kCell_m = 3;
  static constexpr std::size_t kMaxBytes = std::size_t{8} << 20;

  /// Covers the scene's static city; the scene must outlive it. @param cell_m > 0; doubled until the cell
  /// numbers fit in 31 bits
  explicit FacadeLight(const raytrace::RayScene& scene, double cell_m = kCell_m);

  struct Cell {
    std::uint32_t number = 0;
    bool has_middle = false;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< off the triangle; set by sees() if needed
  };
  /// A direction of the grid.
  struct Direction {
    std::uint32_t number = 0;
    Eigen::Vector3d middle = Eigen::Vector3d::UnitZ();  ///< unit
  };
  /// The cell of a point of a triangle. @param front the side of the triangle's normal
  [[nodiscard]] Cell cell(std::uint32_t triangle, const Eigen::Vector3d& point, bool front) const;
  /// The direction of the grid nearest to a unit vector.
  [[nodiscard]] static Direction direction(const Eigen::Vector3d& towards);
  /// Whether a cell sees a direction.
  [[nodiscard]] bool sees(Cell& cell, const Direction& direction) const;
  /// Prefetches the word that sees() will read: the table is larger than the processor's cache.
  void fetch(const Cell& cell, const Direction& direction) const {
    __builtin_prefetch(&words_[position_of(cell, direction)]);
  }

  /// Size of the table.
  [[nodiscard]] std::size_t table_bytes() const { return 8 * (words_mask_ + 1); }

 private:
  [[nodiscard]] std::size_t position_of(const Cell& cell, const Direction& direction) const;

  struct Free {
    void operator()(std::uint64_t* words) const { std::free(words); }
  };
  /// Grid of one triangle.
  struct Squares {
    std::array<int, 2> axis;  ///< of x, y, z: those with the smallest components of the normal
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
  std::vector<std::uint32_t> first_;  ///< cell of each triangle, and one past the last
  std::size_t words_mask_ = 0;
  std::unique_ptr<std::uint64_t[], Free> words_;  ///< used as atomics
};

}  // namespace canyon::propagation
