#include "canyon/city/building_samples.hpp"

#include <fmt/format.h>

#include <cmath>
#include <unordered_map>
#include <utility>

#include "canyon/base/random.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {
namespace {

std::vector<Building> parts_of(const Mesh& mesh, const Object& object) {
  TriangleIndices triangles(
      mesh.triangles.begin() + object.first_triangle,
      mesh.triangles.begin() + object.first_triangle + static_cast<std::ptrdiff_t>(object.triangle_count));
  weld(mesh.vertices, triangles);
  std::vector<Building> buildings;
  for (std::vector<std::uint32_t>& part : connected_components(triangles, mesh.vertices.size())) {
    for (std::uint32_t& triangle : part) triangle += object.first_triangle;
    buildings.push_back(
        {fmt::format("{}#{}", object.name, buildings.size() + 1), object.facades, std::move(part)});
  }
  return buildings;
}

}  // namespace

std::vector<Building> buildings_of(const Mesh& mesh) {
  std::vector<const Object*> objects;
  for (const Object& object : mesh.objects)
    if (object.surface == Surface::Building) objects.push_back(&object);
  if (objects.size() == 1) return parts_of(mesh, *objects.front());
  std::vector<Building> buildings;
  std::unordered_map<std::string, int> seen;
  for (const Object* object : objects) {
    Building building{object->name, object->facades, {}};
    const int number = ++seen[object->name];
    if (number > 1) building.key += fmt::format("#{}", number);
    for (std::uint32_t t = 0; t < object->triangle_count; ++t)
      building.triangles.push_back(object->first_triangle + t);
    buildings.push_back(std::move(building));
  }
  return buildings;
}

Box bounds_of(const Mesh& mesh, const Building& building) {
  Box box;
  for (const std::uint32_t triangle : building.triangles)
    for (const std::uint32_t vertex : mesh.triangles[triangle]) extend(box, mesh.vertices[vertex]);
  return box;
}

std::string raise_roofs(City& city, double mean_m, std::uint64_t seed) {
  if (mean_m == 0) return {};
  Mesh& mesh = city.mesh;
  std::vector<bool> raised(mesh.vertices.size());  // buildings may share vertices
  const std::vector<Building> buildings = buildings_of(mesh);
  double sum_m = 0;
  for (const Building& building : buildings) {
    RandomStream stream(seed, "roofs/" + building.key);
    const double up_m = -mean_m / 2 * (std::log(1 - stream.uniform()) + std::log(1 - stream.uniform()));
    const Box box = bounds_of(mesh, building);
    sum_m += up_m;
    for (const std::uint32_t triangle : building.triangles) {
      for (const std::uint32_t vertex : mesh.triangles[triangle]) {
        if (2 * mesh.vertices[vertex].z() < box.min.z() + box.max.z() || raised[vertex]) continue;
        raised[vertex] = true;
        mesh.vertices[vertex].z() += up_m;
      }
    }
  }
  if (buildings.empty()) return {};
  return fmt::format("roofs raised by {:.1f} m in the mean ({} buildings)",
                     sum_m / static_cast<double>(buildings.size()), buildings.size());
}

}  // namespace canyon::city
