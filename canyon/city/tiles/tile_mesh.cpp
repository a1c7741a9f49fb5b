#include "canyon/city/tiles/tile_mesh.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"
#include "canyon/city/tiles/planar_regions.hpp"

namespace canyon::tiles {
namespace {

/// The ground below a skin: the lowest surface in each cell of a grid, without objects that are narrower than
/// 80 m and higher than it. A progressive morphological filter: the opening by a window that grows step by
/// step; a cell counts as an object if it is higher than the opened surface by more than the window's growth
/// at a slope of 0.3, and at most 3 m (after K. Zhang et al., IEEE TGRS 41(4), 2003).
class GroundModel {
 public:
  /// @param triangles of the skin; at least one
  GroundModel(const std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles);

  /// Height of the ground [m]; of the nearest cell with a height.
  [[nodiscard]] double height_m(const Eigen::Vector2d& point) const;

 private:
  void rasterize(const std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles);
  void filter();
  void fill();
  [[nodiscard]] std::vector<double> filtered(const std::vector<double>& values, std::size_t half,
                                             bool low) const;

  Eigen::Vector2d min_;
  double cell_m_ = 1;
  std::size_t columns_ = 1, rows_ = 1;
  std::vector<double> heights_;  ///< NaN: none yet
};

constexpr double kMaxCells = 4e6;
constexpr double kWidest_m = 40;  // half of the window
constexpr double kSlope = 0.3, kMinStep_m = 0.5, kMaxStep_m = 3;

GroundModel::GroundModel(const std::vector<Eigen::Vector3d>& vertices,
                         const city::TriangleIndices& triangles) {
  Eigen::AlignedBox2d bounds;
  for (const auto& triangle : triangles)
    for (const std::uint32_t v : triangle) bounds.extend(Eigen::Vector2d(vertices[v].head<2>()));
  min_ = bounds.min();
  const Eigen::Vector2d size = bounds.sizes();
  cell_m_ = std::max(1.0, std::sqrt(size.x() * size.y() / kMaxCells));
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
    const double step_m = std::min(kMaxStep_m, kSlope * (half_m - before_m) + kMinStep_m);
    for (std::size_t i = 0; i < heights_.size(); ++i)
      if (heights_[i] - opened[i] > step_m) heights_[i] = opened[i];
    before_m = half_m;
  }
}

/// Cells without a height get a neighbour's, ring by ring.
void GroundModel::fill() {
  std::vector<std::size_t> edge;
  for (std::size_t i = 0; i < heights_.size(); ++i)
    if (!std::isnan(heights_[i])) edge.push_back(i);
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

double GroundModel::height_m(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d at = (point - min_) / cell_m_;
  const auto clamp = [](double value, std::size_t size) {
    return static_cast<std::size_t>(std::clamp(value, 0.0, static_cast<double>(size - 1)));
  };
  return heights_[clamp(at.y(), rows_) * columns_ + clamp(at.x(), columns_)];
}

constexpr double kWeld_m = 1e-3;
constexpr double kLow_m = 2, kWall_m = 3;
constexpr double kUpright = 0.5;  // |n_z| of walls is smaller
constexpr double kMinFoliage_m2 = 10;
/// A rough piece below the first area joins the wall or roof (of at least the second area) with the longest
/// common border. A plane up to the second area with its longest border to foliage joins that foliage.
constexpr double kMinFoliageAmidWalls_m2 = 150, kMaxPlaneAmidFoliage_m2 = 80;
/// Maximum movement of the surface when planes replace it.
constexpr double kFlatten_m = 0.3;

enum class SkinClass : std::uint8_t { Terrain, Building, Foliage, Rough };

double triangle_area(const std::vector<Eigen::Vector3d>& vertices, const std::array<std::uint32_t, 3>& t) {
  return city::normal_of(vertices, t).norm() / 2;
}

class SkinSplit {
 public:
  SkinSplit(const std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles,
            const PlanarRegions& regions)
      : vertices_(vertices),
        triangles_(triangles),
        regions_(regions),
        across_(city::neighbours(triangles)),
        ground_(vertices, triangles) {}

  std::vector<SkinClass> classes() {
    classes_.assign(triangles_.size(), SkinClass::Rough);
    judge_regions();
    judge_the_rest();
    classify_rough();
    classify_planes_amid_foliage();
    classify_without_roof();
    return std::move(classes_);
  }

 private:
  [[nodiscard]] double above_ground(std::uint32_t v) const {
    return vertices_[v].z() - ground_.height_m(vertices_[v].head<2>());
  }
  [[nodiscard]] double mean_above_ground(std::size_t t) const {
    const auto& [a, b, c] = triangles_[t];
    const Eigen::Vector3d middle = (vertices_[a] + vertices_[b] + vertices_[c]) / 3;
    return middle.z() - ground_.height_m(middle.head<2>());
  }

  /// A region has one class.
  void judge_regions() {
    struct Sum {
      double area = 0, height = 0, highest = 0;
    };
    std::vector<Sum> sums(regions_.regions.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (regions_.of[t] == kNoRegion) continue;
      Sum& sum = sums[regions_.of[t]];
      const double area = triangle_area(vertices_, triangles_[t]);
      sum.area += area;
      sum.height += area * mean_above_ground(t);
      for (const std::uint32_t v : triangles_[t]) sum.highest = std::max(sum.highest, above_ground(v));
    }
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const std::uint32_t region = regions_.of[t];
      if (region == kNoRegion) continue;
      const Sum& sum = sums[region];
      const bool upright = std::abs(regions_.regions[region].normal.z()) < kUpright;
      const bool is_stationary = upright ? sum.highest > kWall_m : sum.height > kLow_m * sum.area;
      classes_[t] = is_stationary ? SkinClass::Building : SkinClass::Terrain;
    }
  }

  void judge_the_rest() {
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (regions_.of[t] == kNoRegion && mean_above_ground(t) < kLow_m) classes_[t] = SkinClass::Terrain;
  }

  /// Triangles for which `belongs` is true, in parts connected by edges.
  template <typename Belongs>
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> parts(const Belongs& belongs) const {
    std::vector<std::vector<std::uint32_t>> parts;
    std::vector<bool> done(triangles_.size(), false);
    for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
      if (done[seed] || !belongs(seed)) continue;
      std::vector<std::uint32_t>& members = parts.emplace_back(1, seed);
      done[seed] = true;
      for (std::size_t next = 0; next < members.size(); ++next) {
        for (const std::uint32_t other : across_[members[next]]) {
          if (other == city::kNoTriangle || done[other] || !belongs(other)) continue;
          done[other] = true;
          members.push_back(other);
        }
      }
    }
    return parts;
  }

  /// Calls edge(triangle across it, length [m]) for the edges of a triangle that have a neighbour.
  template <typename Edge>
  void each_edge(std::uint32_t t, const Edge& edge) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (across_[t][k] == city::kNoTriangle) continue;
      edge(across_[t][k], (vertices_[triangles_[t][k]] - vertices_[triangles_[t][(k + 1) % 3]]).norm());
    }
  }

  void classify_rough() {
    const std::vector<SkinClass> before = classes_;
    for (const auto& members : parts([&](std::uint32_t t) { return before[t] == SkinClass::Rough; })) {
      double area = 0, by_building = 0, by_large_plane = 0, by_terrain = 0;
      for (const std::uint32_t t : members) {
        area += triangle_area(vertices_, triangles_[t]);
        each_edge(t, [&](std::uint32_t other, double length) {
          const bool built = before[other] == SkinClass::Building;
          by_building += built ? length : 0;
          if (built && regions_.regions[regions_.of[other]].area_m2 >= kMaxPlaneAmidFoliage_m2)
            by_large_plane += length;
          by_terrain += before[other] == SkinClass::Terrain ? length : 0;
        });
      }
      SkinClass found = SkinClass::Building;
      const bool enclosed = area < kMinFoliageAmidWalls_m2 && 2 * by_large_plane > by_building + by_terrain;
      if (area >= kMinFoliage_m2 && !enclosed)
        found = SkinClass::Foliage;
      else if (by_terrain > by_building)
        found = SkinClass::Terrain;
      for (const std::uint32_t t : members) classes_[t] = found;
    }
  }

  void classify_planes_amid_foliage() {
    struct Edges {
      double foliage = 0, other = 0;
    };
    std::vector<Edges> edges(regions_.regions.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      const std::uint32_t region = regions_.of[t];
      if (region == kNoRegion || classes_[t] != SkinClass::Building) continue;
      each_edge(t, [&](std::uint32_t other, double length) {
        if (regions_.of[other] == region) return;
        (classes_[other] == SkinClass::Foliage ? edges[region].foliage : edges[region].other) += length;
      });
    }
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const std::uint32_t region = regions_.of[t];
      if (region == kNoRegion || classes_[t] != SkinClass::Building) continue;
      const bool amid = edges[region].foliage > edges[region].other;
      if (amid && regions_.regions[region].area_m2 < kMaxPlaneAmidFoliage_m2)
        classes_[t] = SkinClass::Foliage;
    }
  }

  /// The sides of a crown or a hedge may be planes; a piece with foliage and no roof is entirely foliage.
  void classify_without_roof() {
    const auto is_roof = [&](std::uint32_t t) {
      return classes_[t] == SkinClass::Building && regions_.of[t] != kNoRegion &&
             std::abs(regions_.regions[regions_.of[t]].normal.z()) >= kUpright;
    };
    const auto is_foliage = [&](std::uint32_t t) { return classes_[t] == SkinClass::Foliage; };
    for (const auto& members : parts([&](std::uint32_t t) { return classes_[t] != SkinClass::Terrain; })) {
      if (std::any_of(members.begin(), members.end(), is_roof)) continue;
      if (std::none_of(members.begin(), members.end(), is_foliage)) continue;
      for (const std::uint32_t t : members) classes_[t] = SkinClass::Foliage;
    }
  }

  const std::vector<Eigen::Vector3d>& vertices_;
  const city::TriangleIndices& triangles_;
  const PlanarRegions& regions_;
  std::vector<std::array<std::uint32_t, 3>> across_;
  GroundModel ground_;
  std::vector<SkinClass> classes_;
};

}  // namespace

/// Triangles with one name and kind, in ENU.
struct TileMesh::Part {
  std::string name;
  bool feature = false;
  std::optional<city::Surface> surface;  ///< given by a word
  city::Material material = city::Material::Unknown;
  bool pictured = false;
  std::vector<Eigen::Vector3d> vertices;
  city::TriangleIndices triangles;
};

namespace {

constexpr double kFarthest_m = 500e3;
/// A sheet has no face steeper than this: |n_z| at least cos(80 deg), as for mesh files.
constexpr double kSheetSlope = 0.17364817766693041;
constexpr double kSheetFraction = 0.5;

std::string text_at(const std::vector<std::string>& texts, std::uint32_t index) {
  return index < texts.size() ? texts[index] : std::string();
}

/// The triangles of a primitive by feature, or all if it has no features.
std::vector<std::pair<std::optional<std::uint32_t>, city::TriangleIndices>> by_feature(
    const meshes::GltfPrimitive& primitive) {
  std::vector<std::pair<std::optional<std::uint32_t>, city::TriangleIndices>> out;
  if (primitive.features.empty()) {
    out.emplace_back(std::nullopt, primitive.triangles);
    return out;
  }
  std::map<std::uint32_t, city::TriangleIndices> groups;
  for (const auto& triangle : primitive.triangles)
    groups[primitive.features[triangle[0]]].push_back(triangle);
  for (auto& [id, triangles] : groups) out.emplace_back(id, std::move(triangles));
  return out;
}

std::optional<city::Surface> surface_of_words(std::initializer_list<std::string_view> texts) {
  for (const std::string_view text : texts)
    if (const auto surface = surface_by_word(text)) return surface;
  return std::nullopt;
}

/// The vertices that triangles use; changes `triangles` to index these.
std::vector<Eigen::Vector3d> used_vertices(const std::vector<Eigen::Vector3d>& vertices,
                                           city::TriangleIndices& triangles) {
  std::vector<std::uint32_t> used;
  used.reserve(triangles.size() * 3);
  for (const auto& triangle : triangles) used.insert(used.end(), triangle.begin(), triangle.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (auto& triangle : triangles)
    for (std::uint32_t& v : triangle)
      v = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin());
  std::vector<Eigen::Vector3d> out;
  out.reserve(used.size());
  for (const std::uint32_t v : used) out.push_back(vertices[v]);
  return out;
}

}  // namespace

void TileMesh::add(const TileContent& content, const Eigen::Matrix4d& to_enu, const std::string& name) {
  std::size_t total = read_, vertices = skin_.vertices.size() + mesh_.vertices.size();
  for (const PosedModel& posed : content.models) {
    for (const meshes::GltfPrimitive& primitive : posed.model.primitives) {
      total += primitive.triangles.size() * posed.containments.size();
      vertices += primitive.positions.size() * posed.containments.size();
    }
  }
  if (total > meshes::kMaxTriangles || vertices > 3 * meshes::kMaxTriangles) {
    throw InputError(fmt::format("with it the city has more than {} triangles", meshes::kMaxTriangles),
                     "give a smaller bbox or a larger error_m");
  }
  std::vector<Part> parts;
  std::map<std::pair<const PosedModel*, std::uint32_t>, std::size_t> feature_index;
  city::Box box;
  for (const PosedModel& posed : content.models) {
    const bool one = posed.containments.size() == 1;
    std::size_t instance = 0;
    for (const Eigen::Matrix4d& containment : posed.containments) {
      ++instance;
      const Eigen::Matrix4d matrix = to_enu * containment;
      const bool mirrored = matrix.topLeftCorner<3, 3>().determinant() < 0;
      for (const meshes::GltfPrimitive& primitive : posed.model.primitives) {
        std::vector<Eigen::Vector3d> points;
        points.reserve(primitive.positions.size());
        for (const Eigen::Vector3d& v : primitive.positions) {
          points.emplace_back(matrix.topLeftCorner<3, 3>() * v + matrix.topRightCorner<3, 1>());
          if (!points.back().allFinite() || points.back().norm() > kFarthest_m) {
            throw InputError(points.back().allFinite()
                                 ? fmt::format("has vertices {:.0f} km from the middle of the area",
                                               points.back().norm() / 1000)
                                 : std::string("has coordinates that are not finite"));
          }
          extend(box, points.back());
        }
        for (auto& [id, triangles] : by_feature(primitive)) {
          Part part;
          part.feature = id.has_value();
          const auto table = primitive.table ? posed.tables.find(*primitive.table) : posed.tables.end();
          const FeatureNames& names = table != posed.tables.end() ? table->second : posed.batch;
          const std::string own = id ? text_at(names.name, *id) : std::string();
          const std::string kind = id ? text_at(names.kind, *id) : std::string();
          part.surface = surface_of_words({kind, own, primitive.node, primitive.material, name});
          part.material = city::material_from_name(primitive.material);
          part.pictured = primitive.pictured;
          if (id)
            part.name = own.empty() ? fmt::format("{}#{}", name, *id) : own;
          else
            part.name = primitive.node.empty() ? name : fmt::format("{}/{}", name, primitive.node);
          if (!one) part.name += fmt::format("@{}", instance);
          if (mirrored)
            for (auto& triangle : triangles) std::swap(triangle[1], triangle[2]);
          part.triangles = std::move(triangles);
          part.vertices = id ? used_vertices(points, part.triangles) : points;
          // A feature shown by several primitives, one for each of its materials, is one object.
          if (id && one) {
            const auto [found, fresh] = feature_index.try_emplace({&posed, *id}, parts.size());
            if (!fresh && parts[found->second].material == part.material) {
              Part& whole = parts[found->second];
              const auto shift = static_cast<std::uint32_t>(whole.vertices.size());
              whole.vertices.insert(whole.vertices.end(), part.vertices.begin(), part.vertices.end());
              for (const auto& [a, b, c] : part.triangles)
                whole.triangles.push_back({a + shift, b + shift, c + shift});
              continue;
            }
          }
          parts.push_back(std::move(part));
        }
      }
    }
  }
  for (Part& part : parts) {
    read_ += part.triangles.size();
    add_part(part, box);
  }
}

void TileMesh::add_part(Part& part, const city::Box& tile) {
  if (!part.feature && !part.surface && part.pictured) {
    add_to_skin(part);
    return;
  }
  if (part.surface) ++by_word_[static_cast<std::size_t>(*part.surface)];
  if (!part.surface && !part.feature) {
    city::Box box;
    bool sheet = true;
    for (const auto& triangle : part.triangles) {
      const Eigen::Vector3d normal = city::normal_of(part.vertices, triangle);
      sheet = sheet && std::abs(normal.z()) >= kSheetSlope * normal.norm();
      for (const std::uint32_t v : triangle) extend(box, part.vertices[v]);
    }
    if (sheet && plan_area(box) >= kSheetFraction * plan_area(tile)) {
      part.surface = city::Surface::Terrain;
      ++sheets_;
    }
  }
  if (!part.surface) ++guessed_;
  const city::Surface surface = part.surface.value_or(city::Surface::Building);
  city::Material material = part.material;
  if (material == city::Material::Unknown && surface == city::Surface::Terrain)
    material = city::Material::Ground;
  if (material == city::Material::Unknown && surface == city::Surface::Foliage)
    material = city::Material::Foliage;
  add_object(part.name, surface, material, part);
}

void TileMesh::add_to_skin(const Part& part) {
  const auto shift = static_cast<std::uint32_t>(skin_.vertices.size());
  skin_.vertices.insert(skin_.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const auto& [a, b, c] : part.triangles) skin_.triangles.push_back({a + shift, b + shift, c + shift});
}

void TileMesh::add_object(const std::string& name, city::Surface surface, city::Material material,
                          Part& part) {
  const auto degenerate = std::remove_if(part.triangles.begin(), part.triangles.end(), [&](const auto& t) {
    return city::is_degenerate(part.vertices[t[0]], part.vertices[t[1]], part.vertices[t[2]]);
  });
  degenerate_ += static_cast<std::size_t>(part.triangles.end() - degenerate);
  part.triangles.erase(degenerate, part.triangles.end());
  if (part.triangles.empty()) return;
  city::weld(part.vertices, part.triangles);
  const auto components = city::connected_components(part.triangles, part.vertices.size());
  std::size_t number = 0;
  city::TriangleIndices whole;
  for (const auto& component : components) {
    city::TriangleIndices triangles;
    triangles.reserve(component.size());
    for (const std::uint32_t t : component) triangles.push_back(part.triangles[t]);
    if (surface == city::Surface::Building) {
      const city::OrientedSolids found = city::orient_outwards(part.vertices, triangles);
      rotated_ += found.flipped_count;
      open_ += found.closed ? 0 : 1;
    }
    if (part.feature || components.size() == 1) {
      whole.insert(whole.end(), triangles.begin(), triangles.end());
      continue;
    }
    city::append_object(mesh_, fmt::format("{}_{}", name, ++number), surface, material, part.vertices,
                        triangles);
  }
  city::append_object(mesh_, name, surface, material, part.vertices, whole);
}

std::vector<std::string> TileMesh::notes() const {
  std::vector<std::string> lines;
  const auto count = [this](city::Surface surface) { return by_word_[static_cast<std::size_t>(surface)]; };
  const std::size_t named = by_word_[0] + by_word_[1] + by_word_[2] + by_word_[3];
  if (named > 0) {
    lines.push_back(fmt::format(
        "surfaces from words in names and classes: {} building, {} terrain, {} foliage, {} vehicle",
        count(city::Surface::Building), count(city::Surface::Terrain), count(city::Surface::Foliage),
        count(city::Surface::Vehicle)));
  }
  if (sheets_ > 0)
    lines.push_back(
        fmt::format("{} meshes are read as terrain: sheets over half of their tile or more", sheets_));
  if (guessed_ > 0)
    lines.push_back(
        fmt::format("{} features and meshes without such a word are read as buildings", guessed_));
  if (degenerate_ > 0)
    lines.push_back(fmt::format("{} degenerate triangles (area below 1e-8 m^2) dropped", degenerate_));
  if (rotated_ > 0)
    lines.push_back(
        fmt::format("{} triangles flipped to agree with their neighbours or to face outwards", rotated_));
  if (open_ > 0)
    lines.push_back(fmt::format("{} parts of buildings are not closed (a missing floor aside)", open_));
  return lines;
}

std::vector<std::string> append_skin(const PhotoMesh& skin, city::Mesh& mesh) {
  std::vector<Eigen::Vector3d> vertices = skin.vertices;
  LabelledTriangles left;
  for (const auto& triangle : skin.triangles)
    if (!city::is_degenerate(vertices[triangle[0]], vertices[triangle[1]], vertices[triangle[2]]))
      left.triangles.push_back(triangle);
  // Adjacent tiles repeat their border, to a millimetre or so.
  std::vector<Eigen::Vector3d> rounded;
  for (const Eigen::Vector3d& v : vertices) rounded.emplace_back((v / kWeld_m).array().round());
  city::weld(rounded, left.triangles);
  left.triangles.erase(
      std::remove_if(left.triangles.begin(), left.triangles.end(),
                     [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }),
      left.triangles.end());
  if (left.triangles.empty()) return {};
  const PlanarRegions regions = find_regions(vertices, left.triangles, kFlatten_m);
  const std::vector<SkinClass> classes = SkinSplit(vertices, left.triangles, regions).classes();
  // A label contains a region's class: labels below the number of classes are for triangles in no region.
  for (std::size_t t = 0; t < left.triangles.size(); ++t) {
    const std::uint32_t own = regions.of[t] == kNoRegion ? 0 : regions.of[t] + 1;
    left.labels.push_back(own * 4 + static_cast<std::uint32_t>(classes[t]));
  }
  flatten_regions(vertices, left.triangles, regions, kFlatten_m);
  decimate(vertices, left, kFlatten_m);

  std::array<city::TriangleIndices, 4> by_class;
  for (std::size_t t = 0; t < left.triangles.size(); ++t)
    by_class[left.labels[t] % 4].push_back(left.triangles[t]);
  const auto append = [&](const std::string& name, city::Surface surface, city::Material material,
                          const city::TriangleIndices& triangles) {
    city::append_object(mesh, name, surface, material, vertices, triangles);
  };
  const auto of = [&](SkinClass which) { return by_class[static_cast<std::size_t>(which)]; };
  append("terrain", city::Surface::Terrain, city::Material::Ground, of(SkinClass::Terrain));
  std::size_t buildings = 0;
  const city::TriangleIndices built = of(SkinClass::Building);
  for (const auto& component : city::connected_components(built, vertices.size())) {
    city::TriangleIndices triangles;
    for (const std::uint32_t t : component) triangles.push_back(built[t]);
    append(fmt::format("building_{}", ++buildings), city::Surface::Building, city::Material::Unknown,
           triangles);
  }
  append("foliage", city::Surface::Foliage, city::Material::Foliage, of(SkinClass::Foliage));
  return {fmt::format("a skin without names, split by shape (guessed): terrain, {} buildings, foliage",
                      buildings),
          fmt::format("the skin's {} triangles became {}: planes within {} m of them", skin.triangles.size(),
                      left.triangles.size(), kFlatten_m)};
}

}  // namespace canyon::tiles
