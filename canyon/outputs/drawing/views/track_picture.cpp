#include "canyon/outputs/drawing/views/track_picture.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::drawing {
namespace {

constexpr double kTrackMargin = 0.1;
constexpr double kSmallestExtent_m = 60;
constexpr double kSlimmest = 0.5;
constexpr double kOffMapTail = 0.02;
constexpr double kMinReach_m = 100;
constexpr double kMaxMapWidth = 1000;
constexpr double kMaxMapHeight = 860;
constexpr double kTrackLegendWidth = 206;
constexpr double kDotRadius = 3.2;
/// More dots are thinned to one per cell of 1.5 units; the worst is kept.
constexpr std::size_t kManyDots = 5000;

/// Roofs of one building at one height.
struct Roof {
  double height_m = 0;
  std::vector<std::array<Eigen::Vector2d, 3>> triangles;
  Outlines outline;
};

bool overlaps(const city::Box& extent, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return low.x() <= extent.max.x() && high.x() >= extent.min.x() && low.y() <= extent.max.y() &&
         high.y() >= extent.min.y();
}

/// An edge of a roof in space, independent of its direction.
using RoofEdge = std::array<double, 6>;

RoofEdge edge_between(const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
  const RoofEdge one{p.x(), p.y(), p.z(), q.x(), q.y(), q.z()};
  const RoofEdge other{q.x(), q.y(), q.z(), p.x(), p.y(), p.z()};
  return std::min(one, other);
}

/// Upward-facing triangles of one building, by height in whole metres: flat roofs are one group. Outlines are
/// the edges in space of only one triangle: eaves and steps, but not the ridges of a sloped roof.
std::vector<Roof> roofs_of(const city::Mesh& mesh, const city::Object& object, const city::Box& extent) {
  std::map<long, Roof> levels;
  std::map<RoofEdge, std::pair<int, long>> edges;  // uses, level
  for (std::uint32_t k = 0; k < object.triangle_count; ++k) {
    const auto& t = mesh.triangles[object.first_triangle + k];
    const std::array<Eigen::Vector3d, 3> p{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    if ((p[1] - p[0]).cross(p[2] - p[0]).z() <= 0) continue;
    if (!overlaps(extent, p[0].cwiseMin(p[1]).cwiseMin(p[2]), p[0].cwiseMax(p[1]).cwiseMax(p[2]))) continue;
    const double height = (p[0].z() + p[1].z() + p[2].z()) / 3;
    const long level = std::lround(height);
    Roof& roof = levels[level];
    roof.height_m = roof.triangles.empty() ? height : std::max(roof.height_m, height);
    roof.triangles.push_back({p[0].head<2>(), p[1].head<2>(), p[2].head<2>()});
    for (std::size_t i = 0; i < 3; ++i) {
      auto& [uses, at] = edges[edge_between(p[i], p[(i + 1) % 3])];
      ++uses;
      at = level;
    }
  }
  for (const auto& [edge, use] : edges)
    if (use.first == 1) levels[use.second].outline.push_back({{edge[0], edge[1]}, {edge[3], edge[4]}});
  std::vector<Roof> roofs;
  roofs.reserve(levels.size());
  for (auto& level : levels) roofs.push_back(std::move(level.second));
  return roofs;
}

/// All roofs in the extent, lowest first.
std::vector<Roof> roofs_of(const city::Mesh& mesh, const city::Box& extent) {
  std::vector<Roof> roofs;
  for (const city::Object& object : mesh.objects) {
    if (object.surface != city::Surface::Building) continue;
    for (Roof& roof : roofs_of(mesh, object, extent)) roofs.push_back(std::move(roof));
  }
  std::stable_sort(roofs.begin(), roofs.end(),
                   [](const Roof& a, const Roof& b) { return a.height_m < b.height_m; });
  return roofs;
}

/// Roof colours: more contrast between 10 m and 50 m than between 210 m and 250 m.
Colour roof_colour(double height_m, double highest_m) {
  return mix(kLowRoof, kHighRoof, std::sqrt(std::max(0.0, height_m) / std::max(highest_m, 1.0)));
}

void draw_no_fix_mark(Canvas& canvas, const Point& at) {
  canvas.circle(at, 4.2, kPaper, Stroke{kNoFix, 1.6});
}

void draw_off_map_arrow(Canvas& canvas, const Rect& area, const Point& target, const Colour& colour) {
  const Point c = area.centre();
  const double dx = target.x - c.x;
  const double dy = target.y - c.y;
  // The line is from the centre towards the fix, up to the rim.
  const double inset = 3;
  const double s = std::min(dx != 0 ? (0.5 * area.width - inset) / std::abs(dx) : 1e300,
                            dy != 0 ? (0.5 * area.height - inset) / std::abs(dy) : 1e300);
  const Point tip{c.x + s * dx, c.y + s * dy};
  const double length = std::hypot(dx, dy);
  const double ux = dx / length;
  const double uy = dy / length;
  const Point base{tip.x - 11 * ux, tip.y - 11 * uy};
  canvas.polygons({{tip, {base.x - 5 * uy, base.y + 5 * ux}, {base.x + 5 * uy, base.y - 5 * ux}}}, colour,
                  Stroke{kInk.with_alpha(0.75), 0.7});
}

/// A label at the track's end that marks the begin or end of the run.
void draw_end_label(Canvas& canvas, const Rect& area, const Point& at, const std::string& word) {
  canvas.circle(at, 4.5, kInk, Stroke{kPaper, 1.5});
  const bool left = at.x > area.right() - 120;
  canvas.text({at.x + (left ? -9 : 9), at.y}, word,
              {.size = 12.5,
               .bold = true,
               .align = left ? Align::Right : Align::Left,
               .level = TextLevel::Middle,
               .halo = 2.5});
}

class TrackMap {
 public:
  explicit TrackMap(const TrackDrawing& drawing) : drawing_(drawing), extent_(map_extent(drawing.points)) {
    std::vector<double> errors;
    for (const TrackPoint& p : drawing.points)
      if (p.fix) errors.push_back(p.error_m);
    fixes_ = drawing.epochs - drawing.without_fix;
    median_ = drawing.error_m.quantile(0.5).value_or(0);
    p95_ = drawing.error_m.quantile(0.95).value_or(0);
    worst_ = drawing.error_m.quantile(1).value_or(0);
    scale_ = make_scale(std::move(errors), kOffMapTail);
    const Eigen::Vector3d size = extent_.max - extent_.min;
    const double units = std::min(kMaxMapWidth / size.x(), kMaxMapHeight / size.y());
    area_ = {76, 78, units * size.x(), units * size.y()};
  }

  [[nodiscard]] double width() const { return area_.right() + kTrackLegendWidth; }
  [[nodiscard]] double height() const { return std::max(area_.bottom(), area_.y + 520) + 48; }

  void draw(Canvas& canvas) {
    draw_title(canvas, area_.x, drawing_.title, drawing_.subtitle);
    canvas.rectangle(area_, kGround);
    double highest = 0;
    canvas.clipped(area_, [&] {
      if (drawing_.mesh != nullptr) highest = draw_buildings(canvas, area_, *drawing_.mesh, extent_);
      draw_truth(canvas);
      draw_points_without_fix(canvas);
      draw_fixes(canvas);
      draw_ends(canvas);
      draw_scale_bar(canvas, area_, extent_);
      draw_north_arrow(canvas, area_);
    });
    canvas.rectangle(area_, {}, Stroke{kFaintInk, 1});
    draw_frame_ticks(canvas, area_, extent_);
    draw_legend(canvas, highest);
  }

 private:
  [[nodiscard]] Point map_pixel(const Eigen::Vector2d& p) const { return map_point(area_, extent_, p); }
  [[nodiscard]] Colour error_colour(double error_m) const { return viridis(scale_.at(error_m)); }

  void draw_truth(Canvas& canvas) {
    std::vector<Point> line;
    for (const TrackPoint& p : drawing_.points) {
      const Point at = map_pixel(p.truth);
      if (line.empty() || std::hypot(at.x - line.back().x, at.y - line.back().y) > 0.4) line.push_back(at);
    }
    canvas.polyline(line, {kPaper.with_alpha(0.9), 4.5});
    canvas.polyline(line, {kInk, 1.6});
  }

  void draw_ends(Canvas& canvas) {
    const Point start = map_pixel(drawing_.points.front().truth);
    const Point end = map_pixel(drawing_.points.back().truth);
    if (std::hypot(end.x - start.x, end.y - start.y) < 18) {  // a round trip, or standstill
      draw_end_label(canvas, area_, start, drawing_.points.size() > 1 ? "start and end" : "start");
      return;
    }
    draw_end_label(canvas, area_, start, "start");
    draw_end_label(canvas, area_, end, "end");
  }

  void draw_points_without_fix(Canvas& canvas) {
    Point last{-1e9, -1e9};
    for (const TrackPoint& p : drawing_.points) {
      if (p.fix) continue;
      const Point at = map_pixel(p.truth);
      if (std::hypot(at.x - last.x, at.y - last.y) < 7) continue;
      draw_no_fix_mark(canvas, at);
      last = at;
    }
  }

  void draw_fixes(Canvas& canvas) {
    // Large errors are drawn on top, since they matter most.
    std::vector<const TrackPoint*> dots;
    for (const TrackPoint& p : drawing_.points)
      if (p.fix) dots.push_back(&p);
    std::stable_sort(dots.begin(), dots.end(),
                     [](const TrackPoint* a, const TrackPoint* b) { return a->error_m > b->error_m; });
    if (dots.size() > kManyDots) dots = thinned(dots);
    for (auto dot = dots.rbegin(); dot != dots.rend(); ++dot) {
      const Point at = map_pixel(*(*dot)->fix);
      const Colour colour = error_colour((*dot)->error_m);
      if (area_.contains(at)) {
        canvas.circle(at, kDotRadius, colour, Stroke{kInk.with_alpha(0.75), 0.6});
      } else {
        ++off_map_;
        draw_off_map_arrow(canvas, area_, at, colour);
      }
    }
  }

  [[nodiscard]] std::vector<const TrackPoint*> thinned(const std::vector<const TrackPoint*>& dots) const {
    std::map<std::pair<long, long>, const TrackPoint*> cells;
    std::vector<const TrackPoint*> kept;
    for (const TrackPoint* dot : dots) {
      const Point at = map_pixel(*dot->fix);
      if (cells.emplace(std::make_pair(std::lround(at.x / 1.5), std::lround(at.y / 1.5)), dot).second)
        kept.push_back(dot);
    }
    return kept;
  }

  void draw_legend(Canvas& canvas, double highest_roof_m) {
    const double x = area_.right() + 28;
    double y = area_.y + 22;
    if (fixes_ > 0)
      y = draw_colour_bar(canvas, {x, y, 16, 170}, "Horizontal error [m]", scale_, viridis) + 34;
    const auto entry = [&](const std::function<void(Point)>& mark, const std::string& label) {
      mark({x + 8, y});
      canvas.text({x + 26, y}, label, {.size = 11.5, .level = TextLevel::Middle});
      y += 21;
    };
    entry([&](Point p) { canvas.polyline({{p.x - 9, p.y}, {p.x + 9, p.y}}, {kInk, 1.8}); }, "true track");
    if (fixes_ > 0)
      entry([&](Point p) { canvas.circle(p, kDotRadius + 0.6, viridis(0.45), Stroke{kInk, 0.6}); }, "fix");
    if (drawing_.without_fix > 0)
      entry([&](Point p) { draw_no_fix_mark(canvas, p); }, fmt::format("no fix ({})", drawing_.without_fix));
    if (off_map_ > 0) {
      entry(
          [&](Point p) {
            canvas.polygons({{{p.x + 6, p.y}, {p.x - 5, p.y - 5}, {p.x - 5, p.y + 5}}}, viridis(0.9),
                            Stroke{kInk, 0.7});
          },
          fmt::format("fix off the map ({})", off_map_));
    }
    if (highest_roof_m > 0) {
      Scale heights;
      heights.high = highest_roof_m;
      heights.ticks = linear_ticks(0, highest_roof_m, 3);
      y = draw_colour_bar(canvas, {x, y + 26, 16, 70}, "Roof height [m]", heights,
                          [&](double t) { return roof_colour(t * highest_roof_m, highest_roof_m); }) +
          22;
    }
    y += 12;
    const auto line = [&](const std::string& name, const std::string& value) {
      canvas.text({x, y}, name, {.size = 11.5, .colour = kFaintInk});
      canvas.text({x + 142, y}, value, {.size = 11.5, .align = Align::Right});
      y += 18;
    };
    const std::size_t all = drawing_.epochs;
    line("epochs", fmt::format("{}", all));
    line("with fix", fmt::format("{:.1f} %", 100.0 * static_cast<double>(fixes_) / static_cast<double>(all)));
    if (fixes_ > 0) {
      line("median error", length_label(median_));
      line("95 % below", length_label(p95_));
      line("largest", length_label(worst_));
    }
  }

  /// Three digits suffice in a picture, and values below 1 mm are not significant.
  static std::string length_label(double metres) {
    if (metres < 1e-3) return "below 1 mm";
    const double unit = std::pow(10, std::floor(std::log10(metres)) - 2);
    return fmt::format("{:g} m", std::round(metres / unit) * unit);
  }

  const TrackDrawing& drawing_;
  city::Box extent_;
  Rect area_;
  Scale scale_;
  std::size_t fixes_ = 0;
  std::size_t off_map_ = 0;
  double median_ = 0;
  double p95_ = 0;
  double worst_ = 0;
};

}  // namespace

Point map_point(const Rect& area, const city::Box& extent, const Eigen::Vector2d& east_north) {
  return {
      area.x + area.width * (east_north.x() - extent.min.x()) / (extent.max.x() - extent.min.x()),
      area.bottom() - area.height * (east_north.y() - extent.min.y()) / (extent.max.y() - extent.min.y())};
}

city::Box map_extent(const std::vector<TrackPoint>& points) {
  city::Box box;
  const auto extend = [&box](const Eigen::Vector2d& p) { city::extend(box, {p.x(), p.y(), 0}); };
  std::vector<double> errors;
  for (const TrackPoint& p : points) {
    extend(p.truth);
    if (p.fix && std::isfinite(p.error_m)) errors.push_back(p.error_m);
  }
  if (!errors.empty()) {
    // Outliers must not shrink the track to a dot.
    const double farthest = std::min(*quantile(errors, 1 - kOffMapTail),
                                     std::max(kMinReach_m, (box.max - box.min).head<2>().norm()));
    for (const TrackPoint& p : points)
      if (p.fix && p.error_m <= farthest) extend(*p.fix);
  }
  const Eigen::Vector3d centre = 0.5 * (box.min + box.max);
  Eigen::Vector3d size = (1 + 2 * kTrackMargin) * (box.max - box.min);
  size.x() = std::max({size.x(), kSmallestExtent_m, kSlimmest * size.y()});
  size.y() = std::max({size.y(), kSmallestExtent_m, kSlimmest * size.x()});
  return {centre - 0.5 * size, centre + 0.5 * size};
}

Outlines building_outlines(const city::Mesh& mesh, const city::Box& extent) {
  Outlines outlines;
  for (const Roof& roof : roofs_of(mesh, extent))
    outlines.insert(outlines.end(), roof.outline.begin(), roof.outline.end());
  return outlines;
}

double draw_buildings(Canvas& canvas, const Rect& area, const city::Mesh& mesh, const city::Box& extent) {
  const std::vector<Roof> roofs = roofs_of(mesh, extent);
  const double highest = roofs.empty() ? 0 : roofs.back().height_m;
  for (const Roof& roof : roofs) {
    std::vector<std::vector<Point>> rings;
    for (const auto& t : roof.triangles) {
      rings.push_back(
          {map_point(area, extent, t[0]), map_point(area, extent, t[1]), map_point(area, extent, t[2])});
    }
    const Colour fill = roof_colour(roof.height_m, highest);
    canvas.polygons(rings, fill);
    std::vector<std::pair<Point, Point>> outline;
    for (const auto& [from, to] : roof.outline)
      outline.emplace_back(map_point(area, extent, from), map_point(area, extent, to));
    canvas.segments(outline, {mix(fill, kInk, 0.28), 0.7});
  }
  return highest;
}

Picture draw_track(const TrackDrawing& drawing) {
  const auto draw = [&drawing](Canvas& canvas) { TrackMap(drawing).draw(canvas); };
  const TrackMap size(drawing);
  return render(size.width(), size.height(), draw);
}

void draw_frame_ticks(Canvas& canvas, const Rect& area, const city::Box& extent) {
  const TextStyle below{.size = 10.5, .colour = kFaintInk, .align = Align::Centre, .level = TextLevel::Top};
  TextStyle neighbour = below, upright = below;
  neighbour.align = Align::Right;
  neighbour.level = TextLevel::Middle;
  upright.angle_rad = -0.5 * geodesy::kPi;
  for (const double east : linear_ticks(extent.min.x(), extent.max.x(), 8)) {
    const double x = map_point(area, extent, {east, extent.min.y()}).x;
    canvas.segments({{{x, area.bottom()}, {x, area.bottom() + 4}}}, {kFaintInk, 0.8});
    canvas.text({x, area.bottom() + 8}, fmt::format("{:.0f}", east), below);
  }
  for (const double north : linear_ticks(extent.min.y(), extent.max.y(), 7)) {
    const double y = map_point(area, extent, {extent.min.x(), north}).y;
    canvas.segments({{{area.x - 4, y}, {area.x, y}}}, {kFaintInk, 0.8});
    canvas.text({area.x - 7, y}, fmt::format("{:.0f}", north), neighbour);
  }
  canvas.text({area.centre().x, area.bottom() + 26}, "east of the city's origin [m]", below);
  canvas.text({area.x - 48, area.centre().y}, "north of the city's origin [m]", upright);
}

void draw_scale_bar(Canvas& canvas, const Rect& area, const city::Box& extent) {
  const double units_per_metre = area.width / (extent.max.x() - extent.min.x());
  const double length_m = nice_floor(0.22 * area.width / units_per_metre);
  const double length = length_m * units_per_metre;
  const Rect box{area.x + 14, area.bottom() - 42, length + 24, 30};
  canvas.rectangle(box, kPaper.with_alpha(0.85));
  const double y = box.bottom() - 8;
  canvas.polyline(
      {{box.x + 12, y - 5}, {box.x + 12, y}, {box.x + 12 + length, y}, {box.x + 12 + length, y - 5}},
      {kInk, 1.6});
  canvas.text({box.x + 12 + 0.5 * length, y - 5},
              length_m >= 1000 ? fmt::format("{:g} km", length_m / 1000) : fmt::format("{:g} m", length_m),
              {.size = 11.5, .align = Align::Centre});
}

void draw_north_arrow(Canvas& canvas, const Rect& area) {
  const Point tip{area.right() - 30, area.y + 16};
  canvas.circle({tip.x, tip.y + 20}, 27, kPaper.with_alpha(0.85));
  canvas.polygons({{tip, {tip.x + 7, tip.y + 24}, {tip.x, tip.y + 19}, {tip.x - 7, tip.y + 24}}}, kInk);
  canvas.text({tip.x, tip.y + 38}, "N", {.size = 12, .bold = true, .align = Align::Centre});
}

double draw_colour_bar(Canvas& canvas, const Rect& bar, const std::string& label, const Scale& scale,
                       const std::function<Colour(double)>& colour) {
  canvas.text({bar.x, bar.y - 10}, label, {.size = 12, .bold = true});
  const int steps = static_cast<int>(bar.height);
  for (int i = 0; i < steps; ++i)
    canvas.rectangle({bar.x, bar.bottom() - i - 1.0, bar.width, 1.3}, colour((i + 0.5) / steps));
  canvas.rectangle(bar, {}, Stroke{kFaintInk, 0.8});
  for (const double tick : scale.ticks) {
    const double y = bar.bottom() - bar.height * scale.at(tick);
    canvas.segments({{{bar.right(), y}, {bar.right() + 4, y}}}, {kFaintInk, 0.8});
    canvas.text({bar.right() + 8, y}, tick_label(tick), {.size = 11, .level = TextLevel::Middle});
  }
  return bar.bottom();
}

}  // namespace canyon::drawing
