#include "canyon/drawing/views/city_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/boxes.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/drawing/views/city_render.hpp"
#include "canyon/drawing/views/map_marks.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/options/values.hpp"

namespace canyon::drawing {
namespace {

using Eigen::Vector3d;

/// A unit of the canvas is a pixel of pictures between these sizes; letters grow with larger pictures, and
/// shrink with smaller ones.
constexpr double kLargeUnits = 1200, kSmallUnits = 800;
constexpr double kTitleHeight = 74, kLegendWidth = 132, kMargin = 26, kAxisRoom = 66, kAxisFoot = 58;

std::string_view wind(double azimuth_deg) {
  static constexpr std::array<std::string_view, 8> kWinds{"north", "north-east", "east", "south-east",
                                                          "south", "south-west", "west", "north-west"};
  const double turns = azimuth_deg / 360 - std::floor(azimuth_deg / 360);
  return kWinds[static_cast<std::size_t>(std::lround(8 * turns)) % 8];
}

std::string metres(double length_m) {
  return length_m >= 9.95 ? fmt::format("{:.0f} m", length_m) : fmt::format("{:.1f} m", length_m);
}

/// Ticks of the height scale that do not crowd: the ends and round numbers between, from the top.
std::vector<double> height_ticks(const HeightColours& heights, double bar_height) {
  static constexpr std::array kRound{1.0, 2.0, 5.0};
  std::vector<double> ticks;
  if (heights.exponent > 0.8) {
    ticks = linear_ticks(0, heights.highest_m, 6);
  } else {
    ticks = {0};
    for (double decade = 1; decade < heights.highest_m; decade *= 10) {
      for (const double r : kRound) {
        if (r * decade < heights.highest_m) ticks.push_back(r * decade);
      }
    }
  }
  // The highest roof has its own tick; the foot keeps its zero.
  const double room = 16 / bar_height;
  std::vector<double> kept{heights.highest_m};
  for (auto tick = ticks.rbegin(); tick != ticks.rend(); ++tick) {
    const bool crowded = heights.at(kept.back()) - heights.at(*tick) < room;
    if (*tick == 0 && crowded && kept.size() > 1) kept.pop_back();
    if (*tick == 0 || !crowded) kept.push_back(*tick);
  }
  return kept;
}

void draw_swatch(Canvas& canvas, const Point& at, const Colour& colour, const std::string& label) {
  canvas.rectangle({at.x, at.y - 7, 16, 14}, colour, Stroke{kFaintInk, 0.8});
  canvas.text({at.x + 24, at.y}, label, {.size = 11.5, .level = Level::Middle});
}

class CityPicture {
 public:
  CityPicture(const city::City& city, const CityPictureOptions& options)
      : city_(city), options_(options), renderer_(city.mesh), map_(options.elevation_deg >= 90) {
    const double pixels = std::max(options.width_px, options.height_px);
    scale_ = std::max(pixels / kLargeUnits, std::min(1.0, pixels / kSmallUnits));
    for (const city::Object& object : city.mesh.objects) {
      if (object.surface == city::Surface::Building) {
        ++buildings_;
        for (std::uint32_t k = 0; k < object.triangle_count; ++k) {
          materials_.insert(city.mesh.materials[object.first_triangle + k]);
        }
      }
      foliage_ = foliage_ || object.surface == city::Surface::Foliage;
    }
    shown_ = options.focus ? points_in(*options.focus) : renderer_.essential_points();
  }

  [[nodiscard]] std::string png() {
    return render_png(options_.width_px, options_.height_px, scale_, [this](Canvas& canvas) {
      if (map_) {
        draw_map(canvas);
      } else {
        draw_view(canvas);
      }
    });
  }

 private:
  /// Vertices in a focus, and its rim on the ground.
  [[nodiscard]] std::vector<Vector3d> points_in(const PictureFocus& focus) const {
    const Eigen::Vector2d middle(focus.east_m, focus.north_m);
    std::vector<Vector3d> points;
    for (const Vector3d& p : renderer_.essential_points()) {
      if ((p.head<2>() - middle).norm() <= focus.radius_m) points.push_back(p);
    }
    for (int k = 0; k < 36; ++k) {
      const double turn = geodesy::radians(10.0 * k);
      const double x = focus.east_m + focus.radius_m * std::sin(turn);
      const double y = focus.north_m + focus.radius_m * std::cos(turn);
      points.emplace_back(x, y, renderer_.ground_height(x, y));
    }
    return points;
  }

  void draw_map(Canvas& canvas) {
    city::Box box;
    for (const Vector3d& p : shown_) extend(box, p);
    const Rect room{kAxisRoom + 12, kTitleHeight, canvas.width() - kAxisRoom - 12 - kLegendWidth - 14,
                    canvas.height() - kTitleHeight - kAxisFoot};
    const Eigen::Vector2d margin = Eigen::Vector2d::Constant(0.03 * (box.max - box.min).head<2>().norm() + 1);
    Eigen::Vector2d size = (box.max - box.min).head<2>() + 2 * margin;
    const Eigen::Vector2d centre = 0.5 * (box.max + box.min).head<2>();
    // Whole pixels; a slim city gets ground beside it rather than a slim map.
    size.x() = std::max(size.x(), 0.5 * size.y());
    size.y() = std::max(size.y(), 0.5 * size.x());
    const double units_per_metre = std::min(room.width / size.x(), room.height / size.y());
    const int columns = std::max(1, static_cast<int>(size.x() * units_per_metre * scale_));
    const int rows = std::max(1, static_cast<int>(size.y() * units_per_metre * scale_));
    const auto whole = [this](double units) { return std::round(units * scale_) / scale_; };
    const Rect area{whole(room.x + 0.5 * (room.width - columns / scale_)), whole(room.y), columns / scale_,
                    rows / scale_};
    const double m_per_px = 1 / (units_per_metre * scale_);
    const Eigen::Vector2d half = 0.5 * m_per_px * Eigen::Vector2d(columns, rows);
    city::Box extent;
    extent.min << centre - half, box.min.z();
    extent.max << centre + half, box.max.z();

    const CityCamera camera({extent.min, extent.max},
                            {0, 0, static_cast<double>(columns), static_cast<double>(rows)}, columns,
                            {geodesy::kPi / 2, geodesy::kPi, 0});
    const RgbImage image = renderer_.render(camera, columns, rows, style(315));
    canvas.image(area, columns, rows, image.pixels);
    canvas.rectangle(area, {}, Stroke{kFaintInk, 1});
    draw_frame_ticks(canvas, area, extent);
    draw_title(canvas, area.x, title(), subtitle());
    const double bar = std::min(260.0, area.height - 130);
    draw_legend(canvas, {area.right() + 26, area.y + 18}, bar);
    // Both beside the map, where they hide nothing.
    draw_north_arrow(canvas, {area.right(), area.y + legend_height(bar) + 42, 74, 60});
    draw_scale_bar(canvas, {area.x - 26, area.y, area.width, area.height + 60}, extent);
    draw_credit(canvas);
  }

  void draw_view(Canvas& canvas) {
    const Rect inner{kMargin * scale_, (kTitleHeight + 6) * scale_,
                     (canvas.width() - kMargin - kLegendWidth) * scale_,
                     (canvas.height() - kTitleHeight - 6 - kMargin) * scale_};
    const CityCamera camera(shown_, inner, options_.width_px,
                            {geodesy::radians(options_.elevation_deg), geodesy::radians(options_.azimuth_deg),
                             geodesy::radians(options_.field_deg)});
    const RgbImage image =
        renderer_.render(camera, options_.width_px, options_.height_px, style(options_.azimuth_deg + 60));
    canvas.image({0, 0, canvas.width(), canvas.height()}, options_.width_px, options_.height_px,
                 image.pixels);
    draw_compass(canvas, {62, canvas.height() - 52});
    draw_panel(canvas);
    draw_credit(canvas);
  }

  /// Title and legend over the picture.
  void draw_panel(Canvas& canvas) {
    draw_title(canvas, kMargin, title(), subtitle(), 3);
    const double bar = std::min(260.0, 0.4 * canvas.height());
    const Rect panel{canvas.width() - kLegendWidth + 4, kTitleHeight + 4, kLegendWidth - 18,
                     legend_height(bar) + 38};
    canvas.rectangle(panel, kPaper.with_alpha(0.82));
    draw_legend(canvas, {panel.x + 14, panel.y + 32}, bar);
  }

  [[nodiscard]] double legend_height(double bar) const {
    const double height = options_.colour_by_height ? bar + 8 : 21.0 * static_cast<double>(materials_.size());
    return height + (foliage_ ? 24 : 0);
  }

  void draw_legend(Canvas& canvas, const Point& at, double bar) {
    double y = at.y;
    if (buildings_ > 0) {
      if (options_.colour_by_height) {
        const HeightColours& heights = renderer_.heights();
        y = draw_height_bar(canvas, {at.x, y, 16, bar}, heights) + 24;
      } else {
        canvas.text({at.x, y - 10}, "Material", {.size = 12, .bold = true});
        y += 8;
        for (const city::Material material : materials_) {
          draw_swatch(canvas, {at.x, y}, colour_of(material), std::string(city::material_name(material)));
          y += 21;
        }
      }
    }
    if (foliage_) draw_swatch(canvas, {at.x, y}, kFoliage, "foliage");
  }

  static double draw_height_bar(Canvas& canvas, const Rect& bar, const HeightColours& heights) {
    canvas.text({bar.x, bar.y - 12}, "Height [m]", {.size = 12, .bold = true});
    const int steps = static_cast<int>(2 * bar.height);
    for (int i = steps; i > 0; --i) {  // one over the other down to the foot: no seams
      const double height = bar.height * i / steps;
      canvas.rectangle({bar.x, bar.bottom() - height, bar.width, height},
                       HeightColours::colour((i - 0.5) / steps));
    }
    canvas.rectangle(bar, {}, Stroke{kFaintInk, 0.8});
    for (const double tick : height_ticks(heights, bar.height)) {
      const double y = bar.bottom() - bar.height * heights.at(tick);
      canvas.segments({{{bar.right(), y}, {bar.right() + 4, y}}}, {kFaintInk, 0.8});
      canvas.text({bar.right() + 8, y}, tick_label(tick < 10 ? tick : std::round(tick)),
                  {.size = 11, .level = Level::Middle});
    }
    return bar.bottom();
  }

  /// North as it lies on the ground before the viewer.
  void draw_compass(Canvas& canvas, const Point& at) const {
    const double squeeze = std::max(0.25, std::sin(geodesy::radians(options_.elevation_deg)));
    // Screen direction of a compass direction: straight up is away from the viewer.
    const auto on_ring = [&](double azimuth_deg, double radius) {
      const double turn = geodesy::radians(azimuth_deg - options_.azimuth_deg - 180);
      return Point{at.x + radius * std::sin(turn), at.y - squeeze * radius * std::cos(turn)};
    };
    std::vector<Point> disc, ring;
    for (int d = 0; d <= 360; d += 5) {
      disc.push_back(on_ring(d, 44));
      ring.push_back(on_ring(d, 30));
    }
    canvas.polygons({disc}, kPaper.with_alpha(0.75));
    canvas.polyline(ring, {kFaintInk, 1});
    const Point tip = on_ring(0, 30), left = on_ring(-135, 13), right = on_ring(135, 13);
    canvas.polygons({{tip, right, on_ring(180, 5), left}}, kInk);
    const Point letter = on_ring(0, 39);
    canvas.text(letter, "N",
                {.size = 12, .bold = true, .align = Align::Centre, .level = Level::Middle, .halo = 2});
  }

  void draw_credit(Canvas& canvas) const {
    if (options_.credit.empty()) return;
    canvas.text({canvas.width() - 12, canvas.height() - 10}, options_.credit,
                {.size = 10.5, .colour = kFaintInk, .align = Align::Right, .halo = 2});
  }

  [[nodiscard]] CityRenderer::Style style(double sun_azimuth_deg) const {
    return {{geodesy::radians(options_.sun_azimuth_deg.value_or(sun_azimuth_deg)),
             geodesy::radians(options_.sun_elevation_deg)},
            options_.colour_by_height,
            options_.mark_back_faces,
            !map_};
  }

  [[nodiscard]] std::string title() const { return options_.title.empty() ? city_.name : options_.title; }

  [[nodiscard]] std::string subtitle() const {
    std::string text = fmt::format("{} building{}", buildings_, buildings_ == 1 ? "" : "s");
    if (buildings_ > 0) text += ", up to " + metres(renderer_.heights().highest_m);
    if (map_) return text + ", from above";
    return text +
           fmt::format(", seen from the {} at {:g} deg", wind(options_.azimuth_deg), options_.elevation_deg);
  }

  const city::City& city_;
  const CityPictureOptions& options_;
  CityRenderer renderer_;
  bool map_;
  std::vector<Vector3d> shown_;  ///< what must lie within the frame
  double scale_ = 1;
  std::size_t buildings_ = 0;
  std::set<city::Material> materials_;
  bool foliage_ = false;
};

}  // namespace

void CityPictureOptions::validate() const {
  options::check(*this, "picture");
}

void visit(options::Visitor& v, CityPictureOptions& o) {
  v.integer({"width_px", "px", "of the picture"}, o.width_px, 320, 16384);
  v.integer({"height_px", "px", "of the picture"}, o.height_px, 240, 16384);
  v.number({"elevation_deg", "deg", "of the viewer above the horizon; 90 is a map"}, o.elevation_deg,
           {0, 90});
  v.number({"azimuth_deg", "deg", "compass direction in which the viewer is"}, o.azimuth_deg, {-360, 360});
  v.number({"field_deg", "deg", "opening angle; 0 draws with parallel rays"}, o.field_deg, {0, 90});
  if (o.focus) {
    v.section("focus", [&] {
      v.number({"east_m", "m", "middle of the part that fills the frame, east"}, o.focus->east_m,
               {-1e6, 1e6});
      v.number({"north_m", "m", "middle of that part, north"}, o.focus->north_m, {-1e6, 1e6});
      v.number({"radius_m", "m", "of that part"}, o.focus->radius_m, {1, 1e6});
    });
  }
  v.boolean({"colour_by_height", "", "false: by material"}, o.colour_by_height);
  v.boolean({"mark_back_faces", "", "surfaces seen from behind in magenta"}, o.mark_back_faces);
  v.text({"title", "", "of the picture", "the city's name"}, o.title);
  v.text({"credit", "", "small, at the lower right: who made the map"}, o.credit);
  v.number({"sun_azimuth_deg", "deg", "compass direction in which the sun is", "behind the viewer"},
           o.sun_azimuth_deg, {-360, 360});
  v.number({"sun_elevation_deg", "deg", "of the sun"}, o.sun_elevation_deg, {5, 90});
}

std::string city_png(const city::City& city, const CityPictureOptions& options) {
  options.validate();
  city::check_mesh(city.mesh, city.name);
  if (city.mesh.triangles.empty()) {
    throw InputError(fmt::format("city '{}' has no triangle to draw", city.name),
                     "an open field has no picture; choose a city with buildings or terrain");
  }
  return CityPicture(city, options).png();
}

void draw_city(const city::City& city, const std::filesystem::path& png, const CityPictureOptions& options) {
  options.validate();
  OutputFile file(png);
  file.write(city_png(city, options));
  file.commit();
}

}  // namespace canyon::drawing
