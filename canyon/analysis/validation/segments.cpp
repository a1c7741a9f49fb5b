#include "canyon/analysis/validation/segments.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::validation {
namespace {

using Eigen::Vector2d;

constexpr double kShortest_m = 50;
/// Shorter steps have no direction [m]: the noise of a truth with centimetre errors at standstill.
constexpr double kStep_m = 0.3;

/// The angle between two non-zero directions.
double angle_between(const Vector2d& a, const Vector2d& b) {
  return std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)));
}

struct Piece {
  std::size_t first = 0, count = 0;
  double length_m = 0;
  Vector2d step_sum = Vector2d::Zero();  ///< sum of its steps

  void join(const Piece& next) {
    count += next.count;
    length_m += next.length_m;
    step_sum += next.step_sum;
  }
};

/// Angle between two pieces to be joined; a piece without displacement fits any other.
double misfit(const Piece& a, const Piece& b) {
  if (a.step_sum.norm() < kStep_m || b.step_sum.norm() < kStep_m) return 0;
  return angle_between(a.step_sum, b.step_sum);
}

}  // namespace

std::vector<StreetSegment> street_segments(std::span<const Eigen::Vector3d> points) {
  if (points.empty()) return {};
  const double rotation = geodesy::radians(30);
  std::vector<Piece> pieces(1);
  pieces.back().count = 1;
  Vector2d since = points[0].head<2>();  // end of the last step with a direction
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vector2d step = points[i].head<2>() - since;
    if (step.norm() >= kStep_m) {
      since = points[i].head<2>();
      Piece& current = pieces.back();
      if (current.step_sum.norm() >= kStep_m && angle_between(current.step_sum, step) > rotation)
        pieces.push_back({i, 0, 0, Vector2d::Zero()});
      pieces.back().length_m += step.norm();
      pieces.back().step_sum += step;
    }
    ++pieces.back().count;
  }
  while (pieces.size() > 1) {
    const auto shortest = std::min_element(
        pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.length_m < b.length_m; });
    if (shortest->length_m >= kShortest_m) break;
    const bool has_next = shortest + 1 != pieces.end();
    const bool back = shortest != pieces.begin() &&
                      (!has_next || misfit(*(shortest - 1), *shortest) <= misfit(*shortest, *(shortest + 1)));
    const auto into = back ? shortest - 1 : shortest;
    into->join(*(into + 1));
    pieces.erase(into + 1);
  }
  std::vector<StreetSegment> segments;
  for (const Piece& piece : pieces) {
    StreetSegment segment;
    segment.first = piece.first;
    segment.count = piece.count;
    segment.length_m = piece.length_m;
    if (piece.step_sum.norm() >= kStep_m) {
      segment.heading_deg =
          geodesy::degrees(geodesy::azimuth_from_yaw(std::atan2(piece.step_sum.y(), piece.step_sum.x())));
    }
    segments.push_back(segment);
  }
  return segments;
}

}  // namespace canyon::validation
