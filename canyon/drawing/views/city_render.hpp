#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/drawing/views/city_camera.hpp"

namespace canyon::drawing {

/// Light of a picture.
struct Sun {
  double azimuth_rad = 0;    ///< compass
  double elevation_rad = 0;  ///< above the horizon, (0, pi/2]
};

/// Heights above the ground of the places that are drawn, and their colours.
struct HeightColours {
  double highest_m = 1;  ///< end of the scale
  double exponent = 1;   ///< (0, 1]; below 1 spends more colours on low buildings
  /// Position on the scale, 0 to 1, clamped.
  [[nodiscard]] double at(double height_m) const;
  [[nodiscard]] static Colour colour(double at);
};

/// A city made ready to be drawn by casting rays. Const members are thread-safe.
class CityRenderer {
 public:
  /// @param mesh with at least one triangle; must outlive the renderer. Without terrain a flat ground is put
  /// under it.
  explicit CityRenderer(const city::Mesh& mesh);
  ~CityRenderer();
  CityRenderer(const CityRenderer&) = delete;
  CityRenderer& operator=(const CityRenderer&) = delete;

  /// Height above the ground of all buildings, for the legend.
  [[nodiscard]] const HeightColours& heights() const;
  /// Points that a picture must show: the buildings' vertices, or all vertices where there is no building.
  [[nodiscard]] const std::vector<Eigen::Vector3d>& essential_points() const;

  /// z of the ground, on a grid; that of the nearest place surveyed where there is none.
  [[nodiscard]] double ground_height(double x, double y) const;

  struct Style {
    Sun sun;
    bool colour_by_height = true;  ///< else by material
    bool mark_back_faces = true;   ///< magenta where a surface shows its back
    bool scenery = true;           ///< a pale sky into which far ground fades; else plain paper
  };
  /// Casts a ray for each pixel, more where neighbours differ. Rows in parallel; the same pixels on any
  /// number of threads.
  [[nodiscard]] RgbImage render(const CityCamera& camera, int width, int height, const Style& style) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Colour of a material, for pictures whose colours do not mean heights.
[[nodiscard]] Colour colour_of(city::Material material);

inline constexpr Colour kBackFace = rgb(0xE5007D), kFoliage = rgb(0x86AE72), kBareGround = rgb(0xE9E6E0),
                        kVehicle = rgb(0x55606B);

}  // namespace canyon::drawing
