#include "canyon/outputs/drawing/views/sky_render.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"

namespace canyon::drawing {

namespace {

using Eigen::Vector3d;

/// Linear light by colour; may exceed 1 until converted to a pixel.
struct Light {
  float r = 0, g = 0, b = 0;

  Light& operator+=(const Light& o) {
    r += o.r;
    g += o.g;
    b += o.b;
    return *this;
  }
};

Light operator*(const Light& l, double s) {
  const auto f = static_cast<float>(s);
  return {l.r * f, l.g * f, l.b * f};
}

/// The mean of two colours with the weights 1 - t and t, t in [0, 1].
Light mix(const Light& from, const Light& to, double t) {
  Light sum = from * (1 - t);
  sum += to * t;
  return sum;
}

/// sRGB (IEC 61966-2-1) to linear light.
Light linear(const Colour& c) {
  const auto decode = [](double v) {
    return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  };
  return {decode(c.r), decode(c.g), decode(c.b)};
}

/// Linear light to an sRGB pixel 0xRRGGBB, clamped.
std::uint32_t pixel_of(const Light& l) {
  const auto encode = [](float v) {
    const float x = std::clamp(v, 0.0F, 1.0F);
    const float s = x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
    return static_cast<std::uint32_t>(std::lround(255 * s));
  };
  return encode(l.r) << 16U | encode(l.g) << 8U | encode(l.b);
}

/// Sub-pixel sample points, one in each row and column of an 8 x 8 grid (n-rooks): near-horizontal edges are
/// as smooth as near-vertical ones.
constexpr std::array<std::array<double, 2>, 8> kRooks{{{0.0625, 0.4375},
                                                       {0.1875, 0.8125},
                                                       {0.3125, 0.1875},
                                                       {0.4375, 0.6875},
                                                       {0.5625, 0.0625},
                                                       {0.6875, 0.5625},
                                                       {0.8125, 0.9375},
                                                       {0.9375, 0.3125}}};

/// Calls work(row) for each of `rows` rows of pixels, on all cores.
void for_rows(int rows, const std::function<void(int)>& work) {
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 4), [&work](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row) work(row);
  });
}

/// The object of each triangle.
std::vector<std::uint32_t> objects_by_triangle(const city::Mesh& mesh) {
  std::vector<std::uint32_t> objects(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.objects.size(); ++i) {
    std::fill_n(objects.begin() + mesh.objects[i].first_triangle, mesh.objects[i].triangle_count,
                static_cast<std::uint32_t>(i));
  }
  return objects;
}

constexpr std::uint32_t kNothing = 0xFFFFFFFFU;
/// Distance over which surfaces fade, maximum fading, and height over which streets become lighter upwards.
constexpr double kHaze_m = 450, kMaxHaze = 0.6, kStreetDepth_m = 14;
/// Darkening of a wall's line, and of the edge between two surfaces.
constexpr double kLineInk = 0.22, kSkyEdgeInk = 0.16;
/// Lines fade if a pixel covers this fraction of their spacing.
constexpr double kFinestLines = 0.2;

struct Palette {
  Light zenith = linear(rgb(0x8FBBE3)), horizon = linear(rgb(0xE8F1F8));
  Light haze = linear(rgb(0xB4C2D0)), paper = linear(kPaper);
  Light wall = linear(kSkyWall), shadow = linear(rgb(0x7A8396));
  Light ground = linear(rgb(0xA9A48F)), foliage = linear(rgb(0x86AE72)), vehicle = linear(rgb(0x5B6672));
};

/// The surface hit by a ray, as needed to distinguish neighbours. Floats save memory: one surface per pixel.
struct Sample {
  Light light;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float height_m = 0;  ///< above the antenna
  std::uint32_t object = kNothing;
};

class Renderer {
 public:
  Renderer(const raytrace::RayScene& scene, const city::Mesh& mesh, const Vector3d& antenna,
           const SkyLens& lens)
      : scene_(scene), mesh_(mesh), antenna_(antenna), lens_(lens), object_of_(objects_by_triangle(mesh)) {}

  /// Fraction of a pixel in the disc, by the pixel's centre.
  [[nodiscard]] double coverage(double x, double y) const {
    return std::clamp(lens_.radius - std::hypot(x - lens_.centre.x, y - lens_.centre.y) + 0.5, 0.0, 1.0);
  }
  [[nodiscard]] const Palette& palette() const { return palette_; }

  [[nodiscard]] Sample shade(double x, double y) const {
    Sample sample;
    const geodesy::AzimuthElevation direction = on_disc(x, y);
    raytrace::Ray ray;
    ray.origin = antenna_;
    ray.direction = geodesy::enu_from_azimuth_elevation(direction.azimuth_rad, direction.elevation_rad);
    const auto hit = scene_.cast(ray);
    if (!hit) {
      const double low = 1 - std::sin(direction.elevation_rad);
      sample.light = mix(palette_.zenith, palette_.horizon, low * (2 - low));
      return sample;
    }
    const Vector3d normal = hit->front ? hit->normal : -hit->normal;
    const double height_m = hit->range_m * ray.direction.z();
    sample.normal = normal.cast<float>();
    sample.height_m = static_cast<float>(height_m);
    sample.object = hit->instance == 0 ? object_of_[hit->triangle]
                                       : static_cast<std::uint32_t>(mesh_.objects.size()) + hit->instance;
    // Wrapped lighting: faces turned away from the light still differ by their angle.
    const double lit = std::pow(0.5 + 0.5 * normal.dot(to_light_), 1.3);
    const double depth = 0.64 + 0.36 * (1 - std::exp(-std::max(0.0, height_m) / kStreetDepth_m));
    const double haze = kMaxHaze * (1 - std::exp(-hit->range_m / kHaze_m));
    Light surface = mix(palette_.shadow, palette_.wall, std::clamp(lit, 0.0, 1.0));
    const city::Surface kind = surface_of(*hit);
    if (kind == city::Surface::Terrain) surface = palette_.ground * (0.5 + 0.5 * lit);
    if (kind == city::Surface::Foliage) surface = palette_.foliage * (0.5 + 0.5 * lit);
    if (kind == city::Surface::Vehicle) surface = palette_.vehicle * (0.5 + 0.5 * lit);
    sample.light = mix(surface * depth, palette_.haze, haze);
    return sample;
  }

 private:
  /// Pixels on the rim with their centre outside use directions along the horizon.
  [[nodiscard]] geodesy::AzimuthElevation on_disc(double x, double y) const {
    if (const auto direction = lens_.direction({x, y})) return *direction;
    const double dx = lens_.looking_up ? lens_.centre.x - x : x - lens_.centre.x;
    return {std::atan2(dx, lens_.centre.y - y), 0};
  }

  [[nodiscard]] city::Surface surface_of(const raytrace::Hit& hit) const {
    if (hit.instance == 0) return mesh_.objects[object_of_[hit.triangle]].surface;
    for (const raytrace::PosedInstance& posed : scene_.posed_instances())
      if (posed.id == hit.instance) return posed.mesh->surface_of(hit.triangle);
    return city::Surface::Vehicle;
  }

  const raytrace::RayScene& scene_;
  const city::Mesh& mesh_;
  Vector3d antenna_;
  SkyLens lens_;
  std::vector<std::uint32_t> object_of_;  ///< by triangle
  Palette palette_;
  Vector3d to_light_ = geodesy::enu_from_azimuth_elevation(geodesy::radians(222), geodesy::radians(38));
};

bool differ(const Sample& a, const Sample& b) {
  if (a.object != b.object) return true;
  return a.object != kNothing && a.normal.dot(b.normal) < 0.97F;
}

bool crease(const Sample& a, const Sample& b) {
  return a.object != kNothing && b.object != kNothing && differ(a, b);
}

/// Strength, [0, 1], of the line at the nearest multiple of kWallLines_m in a pixel at `height_m`, over which
/// heights change by `span_m`.
double line_fraction(double height_m, double span_m) {
  if (!(span_m > 0)) return 0;
  const double away_px = std::abs(height_m - kWallLines_m * std::round(height_m / kWallLines_m)) / span_m;
  const double fine = std::clamp(1 - span_m / (kFinestLines * kWallLines_m), 0.0, 1.0);
  return fine * std::clamp(1 - away_px, 0.0, 1.0);
}

}  // namespace

RgbImage render_sky(const raytrace::RayScene& scene, const city::Mesh& mesh, const Vector3d& antenna_enu,
                    const SkyLens& lens, int width, int height) {
  const Renderer renderer(scene, mesh, antenna_enu, lens);
  const auto w = static_cast<std::size_t>(width);
  std::vector<Sample> first(w * static_cast<std::size_t>(height));
  for_rows(height, [&](int y) {
    for (int x = 0; x < width; ++x)
      if (renderer.coverage(x + 0.5, y + 0.5) > 0)
        first[static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x)] =
            renderer.shade(x + 0.5, y + 0.5);
  });
  RgbImage image{width, height, std::vector<std::uint32_t>(first.size())};
  const std::uint32_t paper = pixel_of(renderer.palette().paper);
  for_rows(height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x);
      const double coverage = renderer.coverage(x + 0.5, y + 0.5);
      if (coverage <= 0) {
        image.pixels[i] = paper;
        continue;
      }
      const Sample& here = first[i];
      const Sample& left = first[x > 0 ? i - 1 : i];
      const Sample& right = first[x + 1 < width ? i + 1 : i];
      const Sample& above = first[y > 0 ? i - w : i];
      const Sample& below = first[y + 1 < height ? i + w : i];
      Light light = here.light;
      // Neighbours outside the rim are empty; the rim's line covers this.
      if (differ(here, left) || differ(here, right) || differ(here, above) || differ(here, below)) {
        light = {};
        for (const auto& [dx, dy] : kRooks)
          light += renderer.shade(x + dx, y + dy).light * (1.0 / kRooks.size());
        // Each edge once: by the pixel above it or to its left.
        if (crease(here, right) || crease(here, below)) light = light * (1 - kSkyEdgeInk);
      } else if (here.object != kNothing) {
        const auto span = static_cast<double>(
            0.5F * std::hypot(right.height_m - left.height_m, below.height_m - above.height_m));
        light = light * (1 - kLineInk * line_fraction(static_cast<double>(here.height_m), span));
      }
      image.pixels[i] = pixel_of(mix(renderer.palette().paper, light, coverage));
    }
  });
  return image;
}

std::string_view name(SkyProjection projection) {
  return projection == SkyProjection::Equidistant ? "equidistant" : "stereographic";
}

double SkyLens::reach(double elevation_rad) const {
  const double zenith_angle = 0.5 * geodesy::kPi - elevation_rad;
  return projection == SkyProjection::Equidistant ? zenith_angle / (0.5 * geodesy::kPi)
                                                  : std::tan(0.5 * zenith_angle);
}

Point SkyLens::point(double azimuth_rad, double elevation_rad) const {
  const double r = radius * reach(elevation_rad);
  const double east = r * std::sin(azimuth_rad);
  return {centre.x + (looking_up ? -east : east), centre.y - r * std::cos(azimuth_rad)};
}

std::optional<geodesy::AzimuthElevation> SkyLens::direction(const Point& at) const {
  const double x = (looking_up ? centre.x - at.x : at.x - centre.x) / radius;
  const double y = (centre.y - at.y) / radius;
  const double r = std::hypot(x, y);
  if (!(r <= 1)) return std::nullopt;
  const double zenith_angle =
      projection == SkyProjection::Equidistant ? r * 0.5 * geodesy::kPi : 2 * std::atan(r);
  const double azimuth = std::atan2(x, y);
  return geodesy::AzimuthElevation{azimuth < 0 ? azimuth + 2 * geodesy::kPi : azimuth,
                                   0.5 * geodesy::kPi - zenith_angle};
}

}  // namespace canyon::drawing
