#include "canyon/city/tiles/tile_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"

namespace canyon::tiles {

/// Triangles with one name and kind, in ENU.
struct TileMesh::Part {
  std::string name;
  bool feature = false;
  std::optional<city::Surface> surface;  ///< that a word says
  city::Material material = city::Material::Unknown;
  bool pictured = false;
  std::vector<Eigen::Vector3d> vertices;
  city::TriangleIndices triangles;
};

namespace {

constexpr double kFarthest_m = 500e3;
/// A sheet has no face steeper than this: |n_z| at least cos(80 deg), as for mesh files.
constexpr double kSheetSlope = 0.17364817766693041;
constexpr double kSheetShare = 0.5;

std::string text_at(const std::vector<std::string>& texts, std::uint32_t index) {
  return index < texts.size() ? texts[index] : std::string();
}

/// Takes the triangles of one feature out of a primitive, or all where it has none.
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
  for (const std::string_view text : texts) {
    if (const auto surface = surface_by_word(text)) return surface;
  }
  return std::nullopt;
}

/// The vertices that triangles use; `triangles` then names these.
std::vector<Eigen::Vector3d> used_vertices(const std::vector<Eigen::Vector3d>& vertices,
                                           city::TriangleIndices& triangles) {
  std::vector<std::uint32_t> used;
  used.reserve(triangles.size() * 3);
  for (const auto& triangle : triangles) used.insert(used.end(), triangle.begin(), triangle.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (auto& triangle : triangles) {
    for (std::uint32_t& v : triangle)
      v = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin());
  }
  std::vector<Eigen::Vector3d> out;
  out.reserve(used.size());
  for (const std::uint32_t v : used) out.push_back(vertices[v]);
  return out;
}

}  // namespace

void TileMesh::add(const TileContent& content, const Eigen::Matrix4d& to_enu, const std::string& name) {
  std::size_t total = read_, vertices = skin_.vertices.size() + mesh_.vertices.size();
  for (const PlacedModel& placed : content.models) {
    for (const meshes::GltfPrimitive& primitive : placed.model.primitives) {
      total += primitive.triangles.size() * placed.placements.size();
      vertices += primitive.positions.size() * placed.placements.size();
    }
  }
  if (total > meshes::kMostTriangles || vertices > 3 * meshes::kMostTriangles) {
    throw InputError(fmt::format("with it the city has more than {} triangles", meshes::kMostTriangles),
                     "give a smaller bbox or a larger error_m");
  }
  std::vector<Part> parts;
  std::map<std::pair<const PlacedModel*, std::uint32_t>, std::size_t> of_feature;
  city::Box box;
  for (const PlacedModel& placed : content.models) {
    const bool one = placed.placements.size() == 1;
    std::size_t instance = 0;
    for (const Eigen::Matrix4d& placement : placed.placements) {
      ++instance;
      const Eigen::Matrix4d matrix = to_enu * placement;
      const bool mirrored = matrix.topLeftCorner<3, 3>().determinant() < 0;
      for (const meshes::GltfPrimitive& primitive : placed.model.primitives) {
        std::vector<Eigen::Vector3d> places;
        places.reserve(primitive.positions.size());
        for (const Eigen::Vector3d& v : primitive.positions) {
          places.emplace_back(matrix.topLeftCorner<3, 3>() * v + matrix.topRightCorner<3, 1>());
          if (!places.back().allFinite() || places.back().norm() > kFarthest_m) {
            throw InputError(places.back().allFinite()
                                 ? fmt::format("has vertices {:.0f} km from the middle of the area",
                                               places.back().norm() / 1000)
                                 : std::string("has coordinates that are not finite"));
          }
          extend(box, places.back());
        }
        for (auto& [id, triangles] : by_feature(primitive)) {
          Part part;
          part.feature = id.has_value();
          const auto table = primitive.table ? placed.tables.find(*primitive.table) : placed.tables.end();
          const FeatureNames& names = table != placed.tables.end() ? table->second : placed.batch;
          const std::string own = id ? text_at(names.name, *id) : std::string();
          const std::string kind = id ? text_at(names.kind, *id) : std::string();
          part.surface = surface_of_words({kind, own, primitive.node, primitive.material, name});
          part.material = city::material_from_name(primitive.material);
          part.pictured = primitive.pictured;
          if (id) {
            part.name = own.empty() ? fmt::format("{}#{}", name, *id) : own;
          } else {
            part.name = primitive.node.empty() ? name : fmt::format("{}/{}", name, primitive.node);
          }
          if (!one) part.name += fmt::format("@{}", instance);
          if (mirrored) {
            for (auto& triangle : triangles) std::swap(triangle[1], triangle[2]);
          }
          part.triangles = std::move(triangles);
          part.vertices = id ? used_vertices(places, part.triangles) : places;
          // A feature that several primitives show, one for each of its materials, is one object.
          if (id && one) {
            const auto [found, fresh] = of_feature.try_emplace({&placed, *id}, parts.size());
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
    if (sheet && plan_area(box) >= kSheetShare * plan_area(tile)) {
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
      const city::Orientation found = city::orient_outwards(part.vertices, triangles);
      turned_ += found.turned;
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
    lines.push_back(
        fmt::format("surfaces by words of names and classes: {} building, {} terrain, {} foliage, {} vehicle",
                    count(city::Surface::Building), count(city::Surface::Terrain),
                    count(city::Surface::Foliage), count(city::Surface::Vehicle)));
  }
  if (sheets_ > 0)
    lines.push_back(
        fmt::format("{} meshes are taken as terrain: sheets over half of their tile or more", sheets_));
  if (guessed_ > 0)
    lines.push_back(
        fmt::format("{} features and meshes without such a word are taken as buildings", guessed_));
  if (degenerate_ > 0)
    lines.push_back(fmt::format("{} degenerate triangles (area below 1e-8 m^2) dropped", degenerate_));
  if (turned_ > 0)
    lines.push_back(
        fmt::format("{} triangles turned to agree with their neighbours or to look outwards", turned_));
  if (open_ > 0)
    lines.push_back(fmt::format("{} parts of buildings are not closed (a missing floor aside)", open_));
  return lines;
}

}  // namespace canyon::tiles
