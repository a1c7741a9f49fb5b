// Declared in canyon/city/tiles/tile_mesh.hpp.
#include "canyon/city/tiles/tile_mesh.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/city/mesh_topology.hpp"
#include "canyon/city/tiles/skin_parts.hpp"

namespace canyon::tiles {
namespace {

constexpr double kWeld_m = 1e-3;
constexpr double kLow_m = 2, kWall_m = 3;
constexpr double kUpright = 0.5;  // |n_z| of walls is below it
constexpr double kLeastFoliage_m2 = 10;
/// A rough piece below the first area belongs to the wall or roof (of the second area and more) that it
/// adjoins most. A plane up to the second area that adjoins foliage most belongs to that foliage.
constexpr double kLeastFoliageAmidWalls_m2 = 150, kLargestPlaneAmidFoliage_m2 = 80;
/// The surface may move so far as planes take its place.
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
    settle_rough();
    settle_planes_amid_foliage();
    settle_without_roof();
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

  /// A region is of one class as a whole.
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
      const bool stands = upright ? sum.highest > kWall_m : sum.height > kLow_m * sum.area;
      classes_[t] = stands ? SkinClass::Building : SkinClass::Terrain;
    }
  }

  void judge_the_rest() {
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (regions_.of[t] == kNoRegion && mean_above_ground(t) < kLow_m) classes_[t] = SkinClass::Terrain;
    }
  }

  /// Triangles of which `belongs` is true, in parts that hang together by edges.
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

  /// Calls edge(triangle across it, length [m]) for the edges of a triangle that have one.
  template <typename Edge>
  void each_edge(std::uint32_t t, const Edge& edge) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (across_[t][k] == city::kNoTriangle) continue;
      edge(across_[t][k], (vertices_[triangles_[t][k]] - vertices_[triangles_[t][(k + 1) % 3]]).norm());
    }
  }

  void settle_rough() {
    const std::vector<SkinClass> before = classes_;
    for (const auto& members : parts([&](std::uint32_t t) { return before[t] == SkinClass::Rough; })) {
      double area = 0, by_building = 0, by_large_plane = 0, by_terrain = 0;
      for (const std::uint32_t t : members) {
        area += triangle_area(vertices_, triangles_[t]);
        each_edge(t, [&](std::uint32_t other, double length) {
          const bool built = before[other] == SkinClass::Building;
          by_building += built ? length : 0;
          if (built && regions_.regions[regions_.of[other]].area_m2 >= kLargestPlaneAmidFoliage_m2) {
            by_large_plane += length;
          }
          by_terrain += before[other] == SkinClass::Terrain ? length : 0;
        });
      }
      SkinClass found = SkinClass::Building;
      const bool enclosed = area < kLeastFoliageAmidWalls_m2 && 2 * by_large_plane > by_building + by_terrain;
      if (area >= kLeastFoliage_m2 && !enclosed) {
        found = SkinClass::Foliage;
      } else if (by_terrain > by_building) {
        found = SkinClass::Terrain;
      }
      for (const std::uint32_t t : members) classes_[t] = found;
    }
  }

  void settle_planes_amid_foliage() {
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
      if (amid && regions_.regions[region].area_m2 < kLargestPlaneAmidFoliage_m2)
        classes_[t] = SkinClass::Foliage;
    }
  }

  /// The sides of a crown or a hedge may be planes; what has foliage and no roof is foliage as a whole.
  void settle_without_roof() {
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

std::vector<std::string> append_skin(const Skin& skin, city::Mesh& mesh) {
  std::vector<Eigen::Vector3d> vertices = skin.vertices;
  LabelledTriangles left;
  for (const auto& triangle : skin.triangles) {
    if (!city::is_degenerate(vertices[triangle[0]], vertices[triangle[1]], vertices[triangle[2]]))
      left.triangles.push_back(triangle);
  }
  // Tiles that adjoin repeat their border, to a millimetre or so.
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
  // A label keeps a region's class: those below the number of classes are of triangles in no region.
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
