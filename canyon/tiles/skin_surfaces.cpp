#include "canyon/tiles/skin_surfaces.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "canyon/city/mesh_topology.hpp"
#include "canyon/tiles/ground_model.hpp"
#include "canyon/tiles/planar_regions.hpp"

namespace canyon::tiles {
namespace {

constexpr double kWeld_m = 1e-3;
constexpr double kLow_m = 2, kWall_m = 3;
constexpr double kUpright = 0.5;  // |n_z| of walls is below it
constexpr double kLeastFoliage_m2 = 10;
/// A rough piece below the first area belongs to the wall or roof (of the second area and more) that it
/// adjoins most. A plane up to the second area that adjoins foliage most belongs to that foliage.
constexpr double kLeastFoliageAmidWalls_m2 = 150, kLargestPlaneAmidFoliage_m2 = 80;
constexpr double kRegionDistance_m = 0.3;

enum class SkinClass : std::uint8_t { Terrain, Building, Foliage, Rough };

/// Gives vertices within 1 mm or so one number: tiles that adjoin repeat their border.
void weld_near(const std::vector<Eigen::Vector3d>& vertices, city::TriangleIndices& triangles) {
  struct Hash {
    std::size_t operator()(const std::array<std::int64_t, 3>& key) const {
      return static_cast<std::size_t>(key[0] * 73856093 ^ key[1] * 19349663 ^ key[2] * 83492791);
    }
  };
  std::unordered_map<std::array<std::int64_t, 3>, std::uint32_t, Hash> first;
  std::vector<std::uint32_t> place(vertices.size());
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    std::array<std::int64_t, 3> key{};
    for (std::size_t i = 0; i < 3; ++i)
      key[i] = static_cast<std::int64_t>(std::llround(vertices[v][static_cast<Eigen::Index>(i)] / kWeld_m));
    place[v] = first.try_emplace(key, v).first->second;
  }
  for (auto& triangle : triangles) {
    for (std::uint32_t& v : triangle) v = place[v];
  }
}

double triangle_area(const std::vector<Eigen::Vector3d>& vertices, const std::array<std::uint32_t, 3>& t) {
  return (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).norm() / 2;
}

/// Green by the excess of green over the mean of red and blue, where colours are known.
enum class Green { Unknown, Yes, No };
Green green_of(const Eigen::Vector3f& colour) {
  if (!colour.allFinite()) return Green::Unknown;
  const float excess = colour.y() - (colour.x() + colour.z()) / 2;
  return excess > 0.04F ? Green::Yes : Green::No;
}

class SkinSplit {
 public:
  SkinSplit(const Skin& skin, const std::vector<Eigen::Vector3d>& vertices,
            const city::TriangleIndices& triangles, const PlanarRegions& regions)
      : skin_(skin),
        vertices_(vertices),
        triangles_(triangles),
        regions_(regions),
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

  void settle_rough() {
    const auto across = neighbours(triangles_);
    std::vector<bool> done(triangles_.size(), false);
    for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
      if (classes_[seed] != SkinClass::Rough || done[seed]) continue;
      std::vector<std::uint32_t> members{seed};
      done[seed] = true;
      double area = 0, by_building = 0, by_large_plane = 0, by_terrain = 0, green = 0, known = 0;
      for (std::size_t next = 0; next < members.size(); ++next) {
        const std::uint32_t t = members[next];
        const double own = triangle_area(vertices_, triangles_[t]);
        area += own;
        const Green colour = green_of(skin_.colours[triangles_[t][0]]);
        known += colour != Green::Unknown ? own : 0;
        green += colour == Green::Yes ? own : 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t other = across[t][k];
          if (other == kNoRegion) continue;
          const double edge = (vertices_[triangles_[t][k]] - vertices_[triangles_[t][(k + 1) % 3]]).norm();
          const bool built = classes_[other] == SkinClass::Building;
          by_building += built ? edge : 0;
          by_large_plane +=
              built && regions_.regions[regions_.of[other]].area_m2 >= kLargestPlaneAmidFoliage_m2 ? edge : 0;
          by_terrain += classes_[other] == SkinClass::Terrain ? edge : 0;
          if (classes_[other] != SkinClass::Rough || done[other]) continue;
          done[other] = true;
          members.push_back(other);
        }
      }
      const bool may_be_green = known < area / 2 || green > known / 2;
      SkinClass found = SkinClass::Building;
      const bool enclosed = area < kLeastFoliageAmidWalls_m2 && 2 * by_large_plane > by_building + by_terrain;
      if (area >= kLeastFoliage_m2 && !enclosed) {
        found = may_be_green ? SkinClass::Foliage : SkinClass::Building;
      } else if (by_terrain > by_building) {
        found = SkinClass::Terrain;
      }
      settled_.emplace_back(found, std::move(members));
    }
    for (const auto& [found, members] : settled_) {
      for (const std::uint32_t t : members) classes_[t] = found;
    }
  }

  void settle_planes_amid_foliage() {
    const auto across = neighbours(triangles_);
    struct Edges {
      double foliage = 0, other = 0;
    };
    std::vector<Edges> edges(regions_.regions.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const std::uint32_t region = regions_.of[t];
      if (region == kNoRegion || classes_[t] != SkinClass::Building) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t other = across[t][k];
        if (other == kNoRegion || regions_.of[other] == region) continue;
        const double edge = (vertices_[triangles_[t][k]] - vertices_[triangles_[t][(k + 1) % 3]]).norm();
        (classes_[other] == SkinClass::Foliage ? edges[region].foliage : edges[region].other) += edge;
      }
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
    const auto across = neighbours(triangles_);
    std::vector<bool> done(triangles_.size(), false);
    for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
      if (classes_[seed] != SkinClass::Foliage || done[seed]) continue;
      std::vector<std::uint32_t> members{seed};
      done[seed] = true;
      bool roof = false;
      for (std::size_t next = 0; next < members.size(); ++next) {
        const std::uint32_t t = members[next];
        roof = roof || (classes_[t] == SkinClass::Building && regions_.of[t] != kNoRegion &&
                        std::abs(regions_.regions[regions_.of[t]].normal.z()) >= kUpright);
        for (const std::uint32_t other : across[t]) {
          if (other == kNoRegion || done[other] || classes_[other] == SkinClass::Terrain) continue;
          done[other] = true;
          members.push_back(other);
        }
      }
      if (roof) continue;
      for (const std::uint32_t t : members) classes_[t] = SkinClass::Foliage;
    }
  }

  const Skin& skin_;
  const std::vector<Eigen::Vector3d>& vertices_;
  const city::TriangleIndices& triangles_;
  const PlanarRegions& regions_;
  GroundModel ground_;
  std::vector<SkinClass> classes_;
  std::vector<std::pair<SkinClass, std::vector<std::uint32_t>>> settled_;
};

/// Appends triangles with the vertices that they use.
void append_triangles(city::Mesh& mesh, std::string name, city::Surface surface, city::Material material,
                      const std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles) {
  std::unordered_map<std::uint32_t, std::uint32_t> place;
  std::vector<Eigen::Vector3d> used;
  city::TriangleIndices local = triangles;
  for (auto& triangle : local) {
    for (std::uint32_t& v : triangle) {
      const auto [found, added] = place.try_emplace(v, static_cast<std::uint32_t>(used.size()));
      if (added) used.push_back(vertices[v]);
      v = found->second;
    }
  }
  city::append_object(mesh, std::move(name), surface, material, used, local);
}

}  // namespace

SkinReport append_skin(const Skin& skin, double flatten_m, city::Mesh& mesh) {
  SkinReport report;
  report.triangles = skin.triangles.size();
  std::vector<Eigen::Vector3d> vertices = skin.vertices;
  LabelledTriangles left;
  for (const auto& triangle : skin.triangles) {
    if (!city::is_degenerate(vertices[triangle[0]], vertices[triangle[1]], vertices[triangle[2]]))
      left.triangles.push_back(triangle);
  }
  weld_near(vertices, left.triangles);
  left.triangles.erase(
      std::remove_if(left.triangles.begin(), left.triangles.end(),
                     [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }),
      left.triangles.end());
  if (left.triangles.empty()) return report;
  const PlanarRegions regions =
      find_regions(vertices, left.triangles, flatten_m > 0 ? flatten_m : kRegionDistance_m);
  const std::vector<SkinClass> classes = SkinSplit(skin, vertices, left.triangles, regions).classes();
  // A label keeps a region's class: those below the number of classes are of triangles in no region.
  for (std::size_t t = 0; t < left.triangles.size(); ++t) {
    const std::uint32_t own = regions.of[t] == kNoRegion ? 0 : regions.of[t] + 1;
    left.labels.push_back(own * 4 + static_cast<std::uint32_t>(classes[t]));
  }
  if (flatten_m > 0) {
    flatten_regions(vertices, left.triangles, regions, flatten_m);
    decimate(vertices, left, flatten_m);
  }
  report.triangles_left = left.triangles.size();

  std::array<city::TriangleIndices, 4> by_class;
  for (std::size_t t = 0; t < left.triangles.size(); ++t)
    by_class[left.labels[t] % 4].push_back(left.triangles[t]);
  const auto area_of = [&](SkinClass which) {
    double area = 0;
    for (const auto& triangle : by_class[static_cast<std::size_t>(which)])
      area += triangle_area(vertices, triangle);
    return area;
  };
  report.terrain_m2 = area_of(SkinClass::Terrain);
  report.building_m2 = area_of(SkinClass::Building);
  report.foliage_m2 = area_of(SkinClass::Foliage);
  const auto take = [&](SkinClass which) -> city::TriangleIndices& {
    return by_class[static_cast<std::size_t>(which)];
  };
  if (!take(SkinClass::Terrain).empty())
    append_triangles(mesh, "terrain", city::Surface::Terrain, city::Material::Ground, vertices,
                     take(SkinClass::Terrain));
  const city::TriangleIndices& built = take(SkinClass::Building);
  for (const auto& component : city::connected_components(built, vertices.size())) {
    city::TriangleIndices triangles;
    for (const std::uint32_t t : component) triangles.push_back(built[t]);
    append_triangles(mesh, fmt::format("building_{}", ++report.buildings), city::Surface::Building,
                     city::Material::Unknown, vertices, triangles);
  }
  if (!take(SkinClass::Foliage).empty())
    append_triangles(mesh, "foliage", city::Surface::Foliage, city::Material::Foliage, vertices,
                     take(SkinClass::Foliage));
  return report;
}

std::vector<std::string> SkinReport::lines(double flatten_m) const {
  std::vector<std::string> out;
  out.push_back(
      fmt::format("a skin without names, split by shape and colour (guessed): {:.0f} m^2 terrain, {:.0f} m^2 "
                  "of {} buildings, {:.0f} m^2 foliage",
                  terrain_m2, building_m2, buildings, foliage_m2));
  if (flatten_m > 0)
    out.push_back(fmt::format("the skin's {} triangles became {} (flatten_m {:g})", triangles, triangles_left,
                              flatten_m));
  return out;
}

}  // namespace canyon::tiles
