#include "canyon/paths/propagation/index/facade_light.hpp"

#include <sys/mman.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/city.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint32_t kSideBit = 1U << 31;
/// Bits of the number of a direction: ring of elevation, azimuth in it.
constexpr std::uint32_t kAzimuthBits = 9, kDirectionBits = 17;
constexpr double kRings = 180;
constexpr double kDegree = geodesy::kPi / 180;
/// Cells that share a word of the table, and words of a cache line; words for each cell.
constexpr std::uint32_t kRow = 8, kLine = 8;
constexpr std::size_t kWordsPerCell = 4;
/// Lower bits of a word: the visibility bits of the row's cells, and the bits that mark known cells.
constexpr std::uint32_t kKnownShift = kRow, kKeyShift = 2 * kRow;

/// A convex polygon: a triangle cut by four lines.
struct Cut {
  std::array<Vector2d, 8> corner;
  std::size_t size = 0;

  /// Keeps the part with sign * (coordinate - bound) >= 0.
  void keep(int axis, double sign, double bound) {
    const Cut before = *this;
    size = 0;
    for (std::size_t i = 0; i < before.size; ++i) {
      const Vector2d &a = before.corner[i], &b = before.corner[(i + 1) % before.size];
      const double inside_a = sign * (a[axis] - bound), inside_b = sign * (b[axis] - bound);
      if (inside_a >= 0) corner[size++] = a;
      if ((inside_a < 0) != (inside_b < 0)) corner[size++] = a + inside_a / (inside_a - inside_b) * (b - a);
    }
  }
  [[nodiscard]] Vector2d centroid() const {
    Vector2d sum = Vector2d::Zero(), mean = Vector2d::Zero();
    double area = 0;
    for (std::size_t i = 0; i < size; ++i) {
      mean += corner[i] / static_cast<double>(size);
      if (i < 2) continue;
      const Vector2d a = corner[i - 1] - corner[0], b = corner[i] - corner[0];
      const double twice = a.x() * b.y() - a.y() * b.x();
      area += twice;
      sum += twice * (a + b) / 3;
    }
    return std::abs(area) > 1e-9 ? Vector2d(corner[0] + sum / area) : mean;
  }
};

}  // namespace

FacadeLight::FacadeLight(const raytrace::RayScene& scene, double cell_m) : scene_(&scene), cell_m_(cell_m) {
  const city::Mesh& mesh = scene.city();
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& v : mesh.vertices) bounds.extend(v);
  // Roundings of rays to float (RayScene::surface_offset_m()).
  lift_m_ = 5e-3 + (bounds.isEmpty() ? 0 : 1e-6 * bounds.diagonal().norm());
  while (!number_cells()) cell_m_ *= 2;
  const std::size_t wanted = kWordsPerCell * std::max<std::size_t>(first_.back(), 1024);
  const std::size_t words = std::min(std::bit_ceil(wanted), kMaxBytes / 8);
  words_mask_ = words - 1;
  // Large tables use pages of 2 MB, because accesses are random.
  const std::size_t bytes = 8 * words, page = std::min(bytes, std::size_t{2} << 20);
  words_.reset(static_cast<std::uint64_t*>(std::aligned_alloc(page, bytes)));
  if (!words_) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  madvise(words_.get(), bytes, MADV_HUGEPAGE);
#endif
  std::memset(words_.get(), 0, bytes);
}

bool FacadeLight::number_cells() {
  const city::Mesh& mesh = scene_->city();
  first_.assign(mesh.triangles.size() + 1, 0);
  std::uint64_t number = 0;
  for (const city::Object& object : mesh.objects) {
    const bool scatters =
        object.surface == city::Surface::Building || object.surface == city::Surface::Vehicle;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      const Squares of = squares(t);
      first_[t + 1] = scatters ? of.count[0] * of.count[1] : 0;
    }
  }
  for (std::uint32_t& first : first_) {
    number += first;
    first = static_cast<std::uint32_t>(std::min<std::uint64_t>(number, kSideBit));
  }
  return number < kSideBit;
}

std::array<const Vector3d*, 3> FacadeLight::corners(std::uint32_t triangle) const {
  const city::Mesh& mesh = scene_->city();
  const auto& of = mesh.triangles[triangle];
  return {&mesh.vertices[of[0]], &mesh.vertices[of[1]], &mesh.vertices[of[2]]};
}

FacadeLight::Squares FacadeLight::squares(std::uint32_t triangle) const {
  const auto [a, b, c] = corners(triangle);
  int maximum = 0;
  (*b - *a).cross(*c - *a).cwiseAbs().maxCoeff(&maximum);
  Squares result;
  result.axis = {maximum == 0 ? 1 : 0, maximum == 2 ? 1 : 2};
  for (std::size_t k = 0; k < 2; ++k) {
    const int axis = result.axis[k];
    const auto [low, high] = std::minmax({(*a)[axis], (*b)[axis], (*c)[axis]});
    result.low[static_cast<int>(k)] = low;
    result.count[k] = 1 + static_cast<std::uint32_t>((high - low) / cell_m_);
  }
  return result;
}

FacadeLight::Cell FacadeLight::cell(std::uint32_t triangle, const Vector3d& point, bool front) const {
  const Squares of = squares(triangle);
  std::array<std::uint32_t, 2> at;
  for (std::size_t k = 0; k < 2; ++k) {
    const double step = (point[of.axis[k]] - of.low[static_cast<int>(k)]) / cell_m_;
    at[k] = static_cast<std::uint32_t>(std::clamp(step, 0.0, static_cast<double>(of.count[k] - 1)));
  }
  Cell result;
  result.number = (first_[triangle] + at[1] * of.count[0] + at[0]) | (front ? 0 : kSideBit);
  return result;
}

FacadeLight::Direction FacadeLight::direction(const Vector3d& towards) {
  const double elevation = std::asin(std::clamp(towards.z(), -1.0, 1.0));
  const double ring = std::min(kRings - 1.0, std::floor(elevation / kDegree + kRings / 2));
  const double low = (ring + 0.5 - kRings / 2) * kDegree;
  const double azimuths = std::max(1.0, std::round(2 * kRings * std::cos(low)));
  const double cycles = std::atan2(towards.x(), towards.y()) / (2 * geodesy::kPi);
  const double azimuth = std::min(azimuths - 1, std::floor((cycles < 0 ? cycles + 1 : cycles) * azimuths));
  const double middle = 2 * geodesy::kPi * (azimuth + 0.5) / azimuths;
  Direction result;
  result.number = static_cast<std::uint32_t>(ring) << kAzimuthBits | static_cast<std::uint32_t>(azimuth);
  result.middle = {std::cos(low) * std::sin(middle), std::cos(low) * std::cos(middle), std::sin(low)};
  return result;
}

/// The middle of the part of the triangle in one square.
Vector3d FacadeLight::middle(std::uint32_t cell) const {
  const std::uint32_t number = cell & ~kSideBit;
  const auto triangle =
      static_cast<std::uint32_t>(std::upper_bound(first_.begin(), first_.end(), number) - first_.begin() - 1);
  const Squares of = squares(triangle);
  const auto [a, b, c] = corners(triangle);
  const auto flat = [&](const Vector3d& v) { return Vector2d(v[of.axis[0]], v[of.axis[1]]); };
  Cut cut;
  for (const Vector3d* corner : {a, b, c}) cut.corner[cut.size++] = flat(*corner);
  const std::uint32_t in_triangle = number - first_[triangle];
  const Vector2d square(in_triangle % of.count[0], in_triangle / of.count[0]);
  for (int axis = 0; axis < 2; ++axis) {
    cut.keep(axis, 1, of.low[axis] + square[axis] * cell_m_);
    cut.keep(axis, -1, of.low[axis] + (square[axis] + 1) * cell_m_);
  }
  const Vector3d normal = (*b - *a).cross(*c - *a).normalized() * ((cell & kSideBit) != 0 ? -1 : 1);
  Vector3d point = (*a + *b + *c) / 3;
  if (cut.size > 0) {
    const Vector2d at = cut.centroid();
    const int across = 3 - of.axis[0] - of.axis[1];
    point[of.axis[0]] = at.x();
    point[of.axis[1]] = at.y();
    if (normal[across] != 0) {
      const double off =
          normal[of.axis[0]] * (at.x() - (*a)[of.axis[0]]) + normal[of.axis[1]] * (at.y() - (*a)[of.axis[1]]);
      point[across] = (*a)[across] - off / normal[across];
    }
  }
  return point + lift_m_ * normal;
}

std::size_t FacadeLight::position_of(const Cell& cell, const Direction& direction) const {
  const std::uint64_t line =
      (std::uint64_t{cell.number / (kRow * kLine)} << kDirectionBits | direction.number) * kGolden64;
  return ((line >> 32) * kLine + cell.number / kRow % kLine) & words_mask_;
}

bool FacadeLight::sees(Cell& cell, const Direction& direction) const {
  const std::uint64_t key = std::uint64_t{cell.number / kRow} << kDirectionBits | direction.number;
  const std::uint64_t lit = std::uint64_t{1} << cell.number % kRow, known = lit << kKnownShift;
  const std::atomic_ref<std::uint64_t> word(words_[position_of(cell, direction)]);
  const std::uint64_t row = word.load(std::memory_order_relaxed);
  if (row >> kKeyShift == key && (row & known) != 0) return (row & lit) != 0;
  if (!cell.has_middle) cell.middle = middle(cell.number);
  cell.has_middle = true;
  const bool free = !scene_->occluded_by_city({cell.middle, direction.middle});
  // Results of another thread may be overwritten; they are then recomputed.
  const std::uint64_t others = row >> kKeyShift == key ? row : key << kKeyShift;
  word.store(others | known | (free ? lit : 0), std::memory_order_relaxed);
  return free;
}

}  // namespace canyon::propagation
