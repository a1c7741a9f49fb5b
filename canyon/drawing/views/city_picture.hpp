#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "canyon/city/fwd.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::drawing {

/// A round part of a city, in its ENU frame.
struct PictureFocus {
  double east_m = 0;      ///< of its middle; [-1e6, 1e6]
  double north_m = 0;     ///< likewise
  double radius_m = 250;  ///< [1, 1e6]
};

struct CityPictureOptions {
  int width_px = 1600;   ///< [320, 16384]
  int height_px = 1000;  ///< [240, 16384]
  /// Elevation of the viewer above the horizon; [0, 90]. 90 draws a map: parallel rays, north up at any
  /// azimuth, axes in metres, scale bar and north arrow.
  double elevation_deg = 35;
  double azimuth_deg = 215;  ///< compass direction in which the viewer is; [-360, 360]
  /// Opening angle across the whole picture, [0, 90]; 0 draws with parallel rays. Maps always have parallel
  /// rays.
  double field_deg = 28;
  /// Part of the city that fills the frame, to its full height. Surroundings are drawn as far as they are
  /// in sight. Empty: the whole city.
  std::optional<PictureFocus> focus;
  bool colour_by_height = true;  ///< above the ground, by viridis; else by material
  bool mark_back_faces = true;   ///< surfaces seen from behind in magenta: something faces the wrong way
  std::string title;             ///< empty: the city's name
  std::string credit;            ///< small, at the lower right: who made the map
  /// Where the sun stands; empty: to the left behind the viewer's shoulder, on maps in the north-west as
  /// cartographers have it.
  std::optional<double> sun_azimuth_deg;  ///< compass; [-360, 360]
  double sun_elevation_deg = 48;          ///< [5, 90]
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, CityPictureOptions& o);

/// A picture of a city as the bytes of a PNG: cast shadows, a little sky light, heights above the ground in
/// colours with a legend in metres. All buildings (of the focus) lie within the frame. The same bytes on
/// any number of threads. A city without terrain gets a flat ground. Throws InputError as
/// CityPictureOptions::validate() and city::check_mesh() do, and for a city without triangles.
[[nodiscard]] std::string city_png(const city::City& city, const CityPictureOptions& options = {});

/// city_png() to a file, which appears whole or not at all. Throws InputError likewise, and where the file
/// cannot be written (found before the drawing). Part of canyon::io.
void draw_city(const city::City& city, const std::filesystem::path& png,
               const CityPictureOptions& options = {});

}  // namespace canyon::drawing
