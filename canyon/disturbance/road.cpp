#include "canyon/disturbance/road.hpp"

#include <algorithm>
#include <cassert>

namespace canyon::disturbance {
namespace {

// The direction between closer places is jitter.
constexpr double kStep_m = 3;
// The direction is that of the chord this far to both sides.
constexpr double kChord_m = 5;

}  // namespace

void Road::add(geodesy::GpsTime time, const Eigen::Vector2d& place) {
  if (!knots_.empty() && time <= knots_.back().time) return;
  if (vertices_.empty()) vertices_.push_back({0, place});
  const Vertex& last = vertices_.back();
  const double along_m = last.along_m + (place - last.place).norm();
  if (along_m - last.along_m >= kStep_m) vertices_.push_back({along_m, place});
  // A vehicle that stands keeps its place: jitter does not move what is around it back and forth.
  knots_.push_back({time, knots_.empty() ? along_m : std::max(along_m, knots_.back().along_m)});
}

void Road::clear() {
  vertices_.clear();
  knots_.clear();
  facing_.reset();
}

double Road::along_m(geodesy::GpsTime time) const {
  if (knots_.empty()) return 0;
  const auto after = std::lower_bound(knots_.begin(), knots_.end(), time,
                                      [](const Knot& knot, geodesy::GpsTime t) { return knot.time < t; });
  if (after == knots_.begin()) return knots_.front().along_m;
  if (after == knots_.end()) return knots_.back().along_m;
  const Knot &a = *(after - 1), &b = *after;
  return a.along_m + (b.along_m - a.along_m) * ((time - a.time) / (b.time - a.time));
}

Eigen::Vector2d Road::place(double along_m) const {
  auto b = std::lower_bound(vertices_.begin() + 1, vertices_.end() - 1, along_m,
                            [](const Vertex& vertex, double along) { return vertex.along_m < along; });
  const Vertex& a = *(b - 1);
  return a.place + (b->place - a.place) * ((along_m - a.along_m) / (b->along_m - a.along_m));
}

Road::Point Road::at(double along_m) const {
  assert(leads());
  Point point{place(along_m), {}};
  point.ahead = place(along_m + kChord_m) - place(along_m - kChord_m);
  // The vehicle turned round within the chord.
  if (point.ahead.norm() < 0.1 * kChord_m) point.ahead = place(along_m + 0.5) - place(along_m - 0.5);
  const double length = point.ahead.norm();
  point.ahead = length > 0 ? Eigen::Vector2d(point.ahead / length) : Eigen::Vector2d::UnitX();
  return point;
}

}  // namespace canyon::disturbance
