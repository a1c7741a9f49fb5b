#include "canyon/drawing/views/city_render.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "canyon/city/boxes.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/drawing/light.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::drawing {
namespace {

using Eigen::Vector3d;

/// Samples of the grid of ground and roof heights along its longer side.
constexpr int kGridCells = 448;
constexpr double kSmallestCell_m = 0.5;
/// Ground that is drawn around a city which brings none, as a share of its size.
constexpr double kGroundMargin = 0.12;

/// Share of the light on open level ground that comes from the sky; the rest is the sun's.
constexpr double kSky = 0.54;
/// Distances within which surfaces hide the sky of a place: walls close by, and whole blocks.
constexpr double kNear_m = 7, kFar_m = 30;
/// Ground fades out between these shares of the city's size beyond its bounds.
constexpr double kFadeBegin = 0.06, kFadeEnd = 0.5;
/// Darkening of a pixel on the edge of a surface, so that neighbours of one colour stay apart.
constexpr double kEdgeInk = 0.10;

/// Numbers on a regular grid over the plane, read bilinearly; beyond the rim the rim's value holds.
class Grid {
 public:
  Grid() = default;
  Grid(const Eigen::Vector2d& low, const Eigen::Vector2d& high) : low_(low) {
    const Eigen::Vector2d size = high - low;
    cell_ = std::max(size.maxCoeff() / kGridCells, kSmallestCell_m);
    nx_ = static_cast<int>(std::ceil(size.x() / cell_)) + 1;
    ny_ = static_cast<int>(std::ceil(size.y() / cell_)) + 1;
    values_.assign(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_), 0);
  }

  [[nodiscard]] int rows() const { return ny_; }
  [[nodiscard]] int columns() const { return nx_; }
  [[nodiscard]] double cell() const { return cell_; }
  [[nodiscard]] Eigen::Vector2d place(int column, int row) const {
    return low_ + cell_ * Eigen::Vector2d(column, row);
  }
  float& value(int column, int row) { return values_[index(column, row)]; }
  [[nodiscard]] float value(int column, int row) const { return values_[index(column, row)]; }
  [[nodiscard]] std::vector<float>& values() { return values_; }

  [[nodiscard]] double at(double x, double y) const {
    const double u = std::clamp((x - low_.x()) / cell_, 0.0, nx_ - 1.0);
    const double v = std::clamp((y - low_.y()) / cell_, 0.0, ny_ - 1.0);
    const int i = std::min(static_cast<int>(u), nx_ - 2), j = std::min(static_cast<int>(v), ny_ - 2);
    const double a = u - i, b = v - j;
    return (1 - b) * ((1 - a) * value(i, j) + a * value(i + 1, j)) +
           b * ((1 - a) * value(i, j + 1) + a * value(i + 1, j + 1));
  }

  /// Three running means in both directions: nearly a Gaussian bell of about `radius_m`.
  [[nodiscard]] Grid blurred(double radius_m) const {
    Grid result = *this;
    const int reach = std::max(1, static_cast<int>(std::lround(radius_m / cell_)));
    for (int pass = 0; pass < 3; ++pass) {
      result.blur_lines(ny_, nx_, static_cast<std::size_t>(nx_), 1, reach);
      result.blur_lines(nx_, ny_, 1, static_cast<std::size_t>(nx_), reach);
    }
    return result;
  }

 private:
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(column);
  }
  void blur_lines(int lines, int length, std::size_t line_step, std::size_t step, int reach) {
    std::vector<double> sums(static_cast<std::size_t>(length) + 1);
    for (int k = 0; k < lines; ++k) {
      float* line = values_.data() + static_cast<std::size_t>(k) * line_step;
      for (int i = 0; i < length; ++i) {
        sums[static_cast<std::size_t>(i) + 1] =
            sums[static_cast<std::size_t>(i)] + static_cast<double>(line[static_cast<std::size_t>(i) * step]);
      }
      for (int i = 0; i < length; ++i) {
        const int from = std::max(0, i - reach), to = std::min(length, i + reach + 1);
        line[static_cast<std::size_t>(i) * step] = static_cast<float>(
            (sums[static_cast<std::size_t>(to)] - sums[static_cast<std::size_t>(from)]) / (to - from));
      }
    }
  }

  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double cell_ = 1;
  int nx_ = 2, ny_ = 2;
  std::vector<float> values_ = std::vector<float>(4, 0);
};

bool has_surface(const city::Mesh& mesh, city::Surface surface) {
  return std::any_of(mesh.objects.begin(), mesh.objects.end(), [surface](const city::Object& object) {
    return object.surface == surface && object.triangle_count > 0;
  });
}

/// Vertices of one kind of objects; of all objects where there are none of that kind.
std::vector<Vector3d> vertices_of(const city::Mesh& mesh, city::Surface surface) {
  const bool all = !has_surface(mesh, surface);
  std::vector<bool> used(mesh.vertices.size());
  for (const city::Object& object : mesh.objects) {
    if (!all && object.surface != surface) continue;
    for (std::uint32_t k = 0; k < object.triangle_count; ++k) {
      for (const std::uint32_t v : mesh.triangles[object.first_triangle + k]) used[v] = true;
    }
  }
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) points.push_back(mesh.vertices[i]);
  }
  return points;
}

city::Box box_of(const std::vector<Vector3d>& points) {
  city::Box box;
  for (const Vector3d& p : points) extend(box, p);
  return box;
}

/// The mesh with a flat ground where it has none.
city::Mesh with_ground(const city::Mesh& mesh) {
  city::Mesh grounded = mesh;
  if (has_surface(mesh, city::Surface::Terrain)) return grounded;
  const city::Box box = box_of(vertices_of(mesh, city::Surface::Building));
  const double margin = kGroundMargin * (box.max - box.min).norm() + 1;
  const double w = box.min.x() - margin, e = box.max.x() + margin;
  const double s = box.min.y() - margin, n = box.max.y() + margin, z = box.min.z();
  city::append_object(grounded, "ground", city::Surface::Terrain, city::Material::Ground,
                      {{w, s, z}, {e, s, z}, {e, n, z}, {w, n, z}}, {{0, 1, 2}, {0, 2, 3}});
  return grounded;
}

}  // namespace

double HeightColours::at(double height_m) const {
  return std::pow(std::clamp(height_m / highest_m, 0.0, 1.0), exponent);
}

Colour HeightColours::colour(double at) {
  return viridis(at);
}

struct CityRenderer::Impl {
  explicit Impl(const city::Mesh& of);

  /// The surface that a ray met, in enough detail to distinguish neighbours.
  struct Sample {
    Light light;
    Vector3d normal = Vector3d::Zero();
    double range_m = std::numeric_limits<double>::infinity();
    std::uint32_t object = kNothing;
    bool lit = false;
  };
  static constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

  [[nodiscard]] Sample shade(const raytrace::Ray& ray, double down, const Style& style,
                             const Vector3d& to_sun) const;
  [[nodiscard]] Light paint(const raytrace::Hit& hit, const Vector3d& p, const Style& style) const;
  /// Share of the sky that is seen from a place, roughly.
  [[nodiscard]] double open_sky(const Vector3d& p) const;
  /// Horizontal distance of a place from the bounds; 0 within.
  [[nodiscard]] double outside_m(const Vector3d& p) const {
    const Eigen::Vector2d q = p.head<2>();
    return (bounds.min.head<2>() - q).cwiseMax(q - bounds.max.head<2>()).cwiseMax(0.0).norm();
  }
  [[nodiscard]] static bool crease(const Sample& a, const Sample& b) {
    if (a.object == kNothing || b.object == kNothing) return false;
    return a.object != b.object || a.normal.dot(b.normal) < 0.9;
  }
  [[nodiscard]] static bool differ(const Sample& a, const Sample& b);
  void survey();
  void grade();

  city::Mesh mesh;
  std::vector<std::uint32_t> object_of;  ///< by triangle
  raytrace::RayScene scene;
  city::Box bounds;  ///< of what must be shown
  std::vector<Vector3d> essential;
  Grid ground, roofs_near, roofs_far;
  HeightColours heights;
  std::array<Light, 1024> height_light;
};

CityRenderer::Impl::Impl(const city::Mesh& of)
    : mesh(with_ground(of)), object_of(objects_by_triangle(mesh)), scene(mesh) {
  essential = vertices_of(of, city::Surface::Building);
  bounds = box_of(essential);
  survey();
  grade();
  for (std::size_t i = 0; i < height_light.size(); ++i) {
    height_light[i] = linear(HeightColours::colour(static_cast<double>(i) / (height_light.size() - 1.0)));
  }
}

/// Heights of the ground and of the buildings on it, on a grid.
void CityRenderer::Impl::survey() {
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(2 * kFar_m);
  ground = Grid(bounds.min.head<2>() - margin, bounds.max.head<2>() + margin);
  Grid roofs = ground;
  std::vector<char> known(ground.values().size());
  const double top = box_of(mesh.vertices).max.z() + 10;
  for_rows(ground.rows(), [&](int row) {
    for (int column = 0; column < ground.columns(); ++column) {
      const Eigen::Vector2d at = ground.place(column, row);
      const auto terrain = scene.terrain_height(at.x(), at.y());
      known[static_cast<std::size_t>(row) * static_cast<std::size_t>(ground.columns()) +
            static_cast<std::size_t>(column)] = terrain.has_value() ? 1 : 0;
      const auto hit = scene.cast({{at.x(), at.y(), top}, {0, 0, -1}});
      ground.value(column, row) = static_cast<float>(terrain.value_or(0));
      roofs.value(column, row) =
          hit ? static_cast<float>(top - hit->range_m) : std::numeric_limits<float>::quiet_NaN();
    }
  });
  // Where there is no ground, its mean stands in.
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known[i] == 0) continue;
    sum += static_cast<double>(ground.values()[i]);
    ++count;
  }
  const auto mean = static_cast<float>(count > 0 ? sum / static_cast<double>(count) : bounds.min.z());
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known[i] == 0) ground.values()[i] = mean;
    if (std::isnan(roofs.values()[i])) roofs.values()[i] = ground.values()[i];
  }
  roofs_near = roofs.blurred(0.5 * kNear_m);
  roofs_far = roofs.blurred(0.5 * kFar_m);
}

/// The scale of heights: linear where buildings are alike; where a few stand out the median roof still gets a
/// fair share of it.
void CityRenderer::Impl::grade() {
  std::vector<double> tops;
  for (const city::Object& object : mesh.objects) {
    if (object.surface != city::Surface::Building) continue;
    double top = 0;
    for (std::uint32_t k = 0; k < object.triangle_count; ++k) {
      for (const std::uint32_t v : mesh.triangles[object.first_triangle + k]) {
        const Vector3d& p = mesh.vertices[v];
        top = std::max(top, p.z() - ground.at(p.x(), p.y()));
      }
    }
    tops.push_back(top);
  }
  if (tops.empty()) return;
  const auto middle = tops.begin() + static_cast<std::ptrdiff_t>(tops.size() / 2);
  std::nth_element(tops.begin(), middle, tops.end());
  const double median = *middle;
  heights.highest_m = std::max(1.0, *std::max_element(tops.begin(), tops.end()));
  if (median > 0 && median < heights.highest_m) {
    heights.exponent = std::clamp(std::log(0.4) / std::log(median / heights.highest_m), 0.35, 1.0);
  }
}

double CityRenderer::Impl::open_sky(const Vector3d& p) const {
  const double near = std::max(0.0, roofs_near.at(p.x(), p.y()) - p.z()) / kNear_m;
  const double far = std::max(0.0, roofs_far.at(p.x(), p.y()) - p.z()) / kFar_m;
  return 1 / ((1 + 0.35 * near / (1 + 0.3 * near)) * (1 + 0.8 * far / (1 + 0.45 * far)));
}

Light CityRenderer::Impl::paint(const raytrace::Hit& hit, const Vector3d& p, const Style& style) const {
  const city::Object& object = mesh.objects[object_of[hit.triangle]];
  if (!hit.front && style.mark_back_faces) return linear(kBackFace);
  if (object.surface == city::Surface::Terrain) return linear(kBareGround);
  if (object.surface == city::Surface::Foliage) return linear(kFoliage);
  if (object.surface == city::Surface::Vehicle) return linear(kVehicle);
  if (!style.colour_by_height) return linear(colour_of(mesh.materials[hit.triangle]));
  const double at = heights.at(p.z() - ground.at(p.x(), p.y()));
  return height_light[static_cast<std::size_t>(std::lround(at * (height_light.size() - 1.0)))];
}

CityRenderer::Impl::Sample CityRenderer::Impl::shade(const raytrace::Ray& ray, double down,
                                                     const Style& style, const Vector3d& to_sun) const {
  Sample sample;
  const auto hit = scene.cast(ray);
  static const Light above = linear(rgb(0xE3EBF2)), below = linear(rgb(0xFAFBFB));
  static const Light paper = linear(kPaper);
  Light background = paper;
  if (style.scenery) {
    background = above * (1 - down);
    background += below * down;
  }
  if (!hit) {
    sample.light = background;
    return sample;
  }
  const Vector3d p = ray.origin + hit->range_m * ray.direction;
  sample.normal = hit->front ? hit->normal : -hit->normal;
  sample.range_m = hit->range_m;
  sample.object = object_of[hit->triangle];
  const double lambert = sample.normal.dot(to_sun);
  if (lambert > 0) {
    sample.lit = !scene.occluded({p + scene.surface_offset_m(p) * sample.normal, to_sun});
  }
  // Level ground in the sun under an open sky has exactly its own colour, so that roofs match the legend.
  const double sky = kSky * open_sky(p) * (0.5 + 0.5 * sample.normal.z() + 0.15 * (1 - sample.normal.z()));
  const double sun = sample.lit ? (1 - kSky) * lambert / to_sun.z() : 0;
  sample.light = paint(*hit, p, style) * (sky + sun);
  if (style.scenery && mesh.objects[sample.object].surface == city::Surface::Terrain) {
    const double beyond = outside_m(p) / (bounds.max - bounds.min).head<2>().norm();
    const double t = std::clamp((beyond - kFadeBegin) / (kFadeEnd - kFadeBegin), 0.0, 1.0);
    const double faded = t * t * (3 - 2 * t);
    sample.light = sample.light * (1 - faded);
    sample.light += background * faded;
  }
  return sample;
}

bool CityRenderer::Impl::differ(const Sample& a, const Sample& b) {
  if (a.object != b.object || a.lit != b.lit) return true;
  return a.object != kNothing && a.normal.dot(b.normal) < 0.97;
}

CityRenderer::CityRenderer(const city::Mesh& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
CityRenderer::~CityRenderer() = default;

const HeightColours& CityRenderer::heights() const {
  return impl_->heights;
}

const std::vector<Vector3d>& CityRenderer::essential_points() const {
  return impl_->essential;
}

double CityRenderer::ground_height(double x, double y) const {
  return impl_->ground.at(x, y);
}

RgbImage CityRenderer::render(const CityCamera& camera, int width, int height, const Style& style) const {
  const Vector3d to_sun = geodesy::enu_from_azimuth_elevation(style.sun.azimuth_rad, style.sun.elevation_rad);
  const auto w = static_cast<std::size_t>(width);
  std::vector<Impl::Sample> first(w * static_cast<std::size_t>(height));
  for_rows(height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      first[static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x)] =
          impl_->shade(camera.ray(x + 0.5, y + 0.5), (y + 0.5) / height, style, to_sun);
    }
  });
  RgbImage image{width, height, std::vector<std::uint32_t>(first.size())};
  for_rows(height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x);
      const bool edge = (x > 0 && Impl::differ(first[i], first[i - 1])) ||
                        (x + 1 < width && Impl::differ(first[i], first[i + 1])) ||
                        (y > 0 && Impl::differ(first[i], first[i - w])) ||
                        (y + 1 < height && Impl::differ(first[i], first[i + w]));
      Light light = first[i].light;
      if (edge) {
        light = {};
        for (const auto& [dx, dy] : kRooks) {
          light += impl_->shade(camera.ray(x + dx, y + dy), (y + dy) / height, style, to_sun).light *
                   (1.0 / kRooks.size());
        }
        // Each edge once: by the pixel above it or to its left.
        if ((x + 1 < width && Impl::crease(first[i], first[i + 1])) ||
            (y + 1 < height && Impl::crease(first[i], first[i + w]))) {
          light = light * (1 - kEdgeInk);
        }
      }
      image.pixels[i] = pixel_of(light);
    }
  });
  return image;
}

Colour colour_of(city::Material material) {
  const auto [r, g, b] = city::material_colour(material);
  return {r, g, b};
}

}  // namespace canyon::drawing
