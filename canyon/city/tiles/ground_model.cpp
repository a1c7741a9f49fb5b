#include "canyon/city/tiles/ground_model.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace canyon::tiles {
namespace {

constexpr double kMostCells = 4e6;
constexpr double kWidest_m = 40;  // half of the window
constexpr double kSlope = 0.3, kLeastStep_m = 0.5, kLargestStep_m = 3;

}  // namespace

GroundModel::GroundModel(const std::vector<Eigen::Vector3d>& vertices,
                         const city::TriangleIndices& triangles) {
  Eigen::AlignedBox2d bounds;
  for (const auto& triangle : triangles) {
    for (const std::uint32_t v : triangle) bounds.extend(Eigen::Vector2d(vertices[v].head<2>()));
  }
  min_ = bounds.min();
  const Eigen::Vector2d size = bounds.sizes();
  cell_m_ = std::max(1.0, std::sqrt(size.x() * size.y() / kMostCells));
  cell_m_ = std::max(cell_m_, size.maxCoeff() / 50'000);
  columns_ = static_cast<std::size_t>(size.x() / cell_m_) + 1;
  rows_ = static_cast<std::size_t>(size.y() / cell_m_) + 1;
  heights_.assign(columns_ * rows_, std::numeric_limits<double>::quiet_NaN());
  rasterize(vertices, triangles);
  filter();
  fill();
}

void GroundModel::rasterize(const std::vector<Eigen::Vector3d>& vertices,
                            const city::TriangleIndices& triangles) {
  const auto put = [&](std::size_t column, std::size_t row, double height) {
    double& cell = heights_[row * columns_ + column];
    if (!(cell <= height)) cell = height;
  };
  for (const auto& [ia, ib, ic] : triangles) {
    const Eigen::Vector3d &a = vertices[ia], &b = vertices[ib], &c = vertices[ic];
    for (const Eigen::Vector3d* v : {&a, &b, &c}) {
      const Eigen::Vector2d at = (v->head<2>() - min_) / cell_m_;
      put(std::min(columns_ - 1, static_cast<std::size_t>(at.x())),
          std::min(rows_ - 1, static_cast<std::size_t>(at.y())), v->z());
    }
    const Eigen::Vector3d n = (b - a).cross(c - a);
    if (std::abs(n.z()) < 1e-3 * n.norm()) continue;
    const Eigen::Vector2d low = (a.head<2>().cwiseMin(b.head<2>()).cwiseMin(c.head<2>()) - min_) / cell_m_;
    const Eigen::Vector2d high = (a.head<2>().cwiseMax(b.head<2>()).cwiseMax(c.head<2>()) - min_) / cell_m_;
    for (auto row = static_cast<std::size_t>(low.y()); row < rows_ && static_cast<double>(row) <= high.y();
         ++row) {
      for (auto column = static_cast<std::size_t>(low.x());
           column < columns_ && static_cast<double>(column) <= high.x(); ++column) {
        const Eigen::Vector2d p = min_ + cell_m_ * Eigen::Vector2d(static_cast<double>(column) + 0.5,
                                                                   static_cast<double>(row) + 0.5);
        const auto side = [&p](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
          return (to.x() - from.x()) * (p.y() - from.y()) - (to.y() - from.y()) * (p.x() - from.x());
        };
        const double x = side(a, b), y = side(b, c), z = side(c, a);
        if ((x < 0 || y < 0 || z < 0) && (x > 0 || y > 0 || z > 0)) continue;
        put(column, row, a.z() - (n.x() * (p.x() - a.x()) + n.y() * (p.y() - a.y())) / n.z());
      }
    }
  }
}

/// The lowest (or highest) value within `half` cells along rows, then along columns; NaN counts as absent.
std::vector<double> GroundModel::filtered(const std::vector<double>& values, std::size_t half,
                                          bool low) const {
  const auto pass = [&](const std::vector<double>& in, std::size_t length, std::size_t lines,
                        std::size_t step, std::size_t line_step) {
    std::vector<double> out(in.size(), std::numeric_limits<double>::quiet_NaN());
    std::vector<std::size_t> queue(length);
    for (std::size_t line = 0; line < lines; ++line) {
      const std::size_t base = line * line_step;
      std::size_t head = 0, tail = 0, taken = 0;
      for (std::size_t i = 0; i < length; ++i) {
        for (; taken < length && taken <= i + half; ++taken) {
          const double value = in[base + taken * step];
          if (std::isnan(value)) continue;
          while (tail > head && (low ? in[base + queue[tail - 1] * step] >= value
                                     : in[base + queue[tail - 1] * step] <= value))
            --tail;
          queue[tail++] = taken;
        }
        while (tail > head && queue[head] + half < i) ++head;
        if (tail > head) out[base + i * step] = in[base + queue[head] * step];
      }
    }
    return out;
  };
  return pass(pass(values, columns_, rows_, 1, columns_), rows_, columns_, columns_, 1);
}

void GroundModel::filter() {
  double before_m = 0;
  for (double half_m = cell_m_; half_m <= kWidest_m; half_m = half_m * 2) {
    const auto half = static_cast<std::size_t>(std::ceil(half_m / cell_m_));
    const std::vector<double> opened = filtered(filtered(heights_, half, true), half, false);
    const double step_m = std::min(kLargestStep_m, kSlope * (half_m - before_m) + kLeastStep_m);
    for (std::size_t i = 0; i < heights_.size(); ++i) {
      if (heights_[i] - opened[i] > step_m) heights_[i] = opened[i];
    }
    before_m = half_m;
  }
}

/// Cells without a height take that of a neighbour, ring by ring.
void GroundModel::fill() {
  std::vector<std::size_t> edge;
  for (std::size_t i = 0; i < heights_.size(); ++i) {
    if (!std::isnan(heights_[i])) edge.push_back(i);
  }
  while (!edge.empty()) {
    std::vector<std::size_t> next;
    for (const std::size_t i : edge) {
      const std::size_t column = i % columns_, row = i / columns_;
      const auto spread = [&](bool inside, std::size_t to) {
        if (!inside || !std::isnan(heights_[to])) return;
        heights_[to] = heights_[i];
        next.push_back(to);
      };
      spread(column > 0, i - 1);
      spread(column + 1 < columns_, i + 1);
      spread(row > 0, i - columns_);
      spread(row + 1 < rows_, i + columns_);
    }
    edge = std::move(next);
  }
}

double GroundModel::height_m(const Eigen::Vector2d& place) const {
  const Eigen::Vector2d at = (place - min_) / cell_m_;
  const auto clamp = [](double value, std::size_t size) {
    return static_cast<std::size_t>(std::clamp(value, 0.0, static_cast<double>(size - 1)));
  };
  return heights_[clamp(at.y(), rows_) * columns_ + clamp(at.x(), columns_)];
}

}  // namespace canyon::tiles
