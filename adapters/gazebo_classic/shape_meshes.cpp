#include "adapters/gazebo_classic/shape_meshes.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <boost/pointer_cast.hpp>
#include <cmath>
#include <fstream>
#include <gazebo/common/CommonIface.hh>
#include <gazebo/common/Exception.hh>
#include <gazebo/common/Material.hh>
#include <gazebo/common/Mesh.hh>
#include <gazebo/common/MeshManager.hh>
#include <gazebo/msgs/msgs.hh>
#include <gazebo/physics/Collision.hh>
#include <gazebo/physics/HeightmapShape.hh>
#include <gazebo/physics/Link.hh>
#include <gazebo/physics/Shape.hh>
#include <iterator>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/mesh_names.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "canyon/city/primitive_meshes.hpp"

namespace canyon::adapters::gazebo_classic {

using Eigen::Affine3d;
using Eigen::Vector3d;
using gazebo::msgs::Geometry;
using gazebo::physics::Base;
using gazebo::physics::HeightmapShape;

namespace {

/// Triangles of one object to be.
struct Soup {
  std::vector<Vector3d> vertices;
  city::TriangleIndices triangles;
  std::vector<city::Material> materials;  ///< one per triangle

  void add(const std::vector<Vector3d>& points, const city::TriangleIndices& corners,
           city::Material material) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), points.begin(), points.end());
    for (const auto& [a, b, c] : corners) triangles.push_back({first + a, first + b, first + c});
    materials.resize(triangles.size(), material);
  }
};

bool names_terrain(const std::string& name) {
  return city::split_surface(name).surface == city::Surface::Terrain;
}

Vector3d vector(const gazebo::msgs::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

bool is_extent(double length) {
  return std::isfinite(length) && length > 0;
}

/// Turns each connected part so that front sides look outwards; upwards where it is terrain.
void orient(Soup& soup, bool terrain) {
  const auto components = city::connected_components(soup.triangles, soup.vertices.size());
  for (const std::vector<std::uint32_t>& component : components) {
    city::TriangleIndices part;
    part.reserve(component.size());
    for (const std::uint32_t t : component) part.push_back(soup.triangles[t]);
    city::orient_outwards(soup.vertices, part);
    if (terrain) {
      double up = 0;
      for (const auto& [a, b, c] : part) {
        up += (soup.vertices[b] - soup.vertices[a]).cross(soup.vertices[c] - soup.vertices[a]).z();
      }
      if (up < 0) {
        for (auto& triangle : part) std::swap(triangle[1], triangle[2]);
      }
    }
    for (std::size_t i = 0; i < component.size(); ++i) soup.triangles[component[i]] = part[i];
  }
}

/// By the diffuse colour, which Canyon's own files give each material; Gazebo keeps no names of materials.
city::Material material_by_colour(const gazebo::common::Material* material) {
  if (material == nullptr) return city::Material::Unknown;
  const ignition::math::Color colour = material->Diffuse();
  for (int m = 0; m <= static_cast<int>(city::Material::Foliage); ++m) {
    const auto [r, g, b] = city::material_colour(static_cast<city::Material>(m));
    constexpr double kTolerance = 2e-3;
    if (std::abs(colour.R() - r) < kTolerance && std::abs(colour.G() - g) < kTolerance &&
        std::abs(colour.B() - b) < kTolerance) {
      return static_cast<city::Material>(m);
    }
  }
  return city::Material::Unknown;
}

/// Vertices and triangles of a submesh; nothing where it holds lines, points or strips.
bool read_submesh(const gazebo::common::SubMesh& submesh, std::vector<Vector3d>& vertices,
                  city::TriangleIndices& triangles) {
  if (submesh.GetPrimitiveType() != gazebo::common::SubMesh::TRIANGLES) return false;
  vertices.clear();
  triangles.clear();
  const unsigned count = submesh.GetVertexCount();
  vertices.reserve(count);
  for (unsigned v = 0; v < count; ++v) vertices.push_back(eigen(submesh.Vertex(v)));
  triangles.reserve(submesh.GetIndexCount() / 3);
  for (unsigned i = 0; i + 2 < submesh.GetIndexCount(); i += 3) {
    const std::array<std::uint32_t, 3> triangle{submesh.GetIndex(i), submesh.GetIndex(i + 1),
                                                submesh.GetIndex(i + 2)};
    if (std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) { return v < count; })) {
      triangles.push_back(triangle);
    }
  }
  return true;
}

/// The middle of a submesh's bounds, which Gazebo's <center> brings to the origin.
Vector3d middle_of(const std::vector<Vector3d>& vertices) {
  if (vertices.empty()) return Vector3d::Zero();
  Vector3d low = vertices.front(), high = vertices.front();
  for (const Vector3d& v : vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  return 0.5 * (low + high);
}

boost::shared_ptr<HeightmapShape> heightmap_of(const gazebo::physics::Collision& collision) {
  const gazebo::physics::ShapePtr shape = collision.GetShape();
  return shape && shape->HasType(Base::HEIGHTMAP_SHAPE) ? boost::dynamic_pointer_cast<HeightmapShape>(shape)
                                                        : nullptr;
}

/// Rays of sensors are collisions to Gazebo, but nothing that stands there.
bool is_thing(const gazebo::physics::Collision& collision) {
  const gazebo::physics::ShapePtr shape = collision.GetShape();
  return shape && !collision.HasType(Base::SENSOR_COLLISION) && !shape->HasType(Base::RAY_SHAPE) &&
         !shape->HasType(Base::MULTIRAY_SHAPE);
}

/// Gazebo scales a visual in its SDF; the message stays as it was loaded.
Geometry geometry_of(const gazebo::physics::Link& link, const gazebo::msgs::Visual& visual) {
  // GetSDF() is not const, but changes nothing.
  const sdf::ElementPtr sdf = const_cast<gazebo::physics::Link&>(link).GetSDF();
  const std::string scope = link.GetScopedName() + "::";
  for (sdf::ElementPtr e = sdf->HasElement("visual") ? sdf->GetElement("visual") : nullptr; e;
       e = e->GetNextElement("visual")) {
    if (scope + e->Get<std::string>("name") == visual.name() && e->HasElement("geometry")) {
      return gazebo::msgs::GeometryFromSDF(e->GetElement("geometry"));
    }
  }
  return visual.geometry();
}

/// Whether Gazebo may be given a mesh file to read: its reader of COLLADA crashes on what is none or was cut
/// off, and a server has not looked at visuals before.
bool is_safe(const std::string& file) {
  if (!lower_case(file).ends_with(".dae")) return true;
  std::ifstream in(file, std::ios::binary);
  std::string head(4096, '\0'), tail(256, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  in.clear();
  in.seekg(0, std::ios::end);
  in.seekg(-std::min<std::streamoff>(in.tellg(), static_cast<std::streamoff>(tail.size())), std::ios::end);
  in.read(tail.data(), static_cast<std::streamsize>(tail.size()));
  return head.find("<COLLADA") != std::string::npos && tail.find("</COLLADA>") != std::string::npos;
}

const char* kind_of(const Geometry& geometry) {
  switch (geometry.type()) {
    case Geometry::IMAGE:
      return "image";
    case Geometry::TRIANGLE_FAN:
      return "triangle fan";
    case Geometry::LINE_STRIP:
      return "line strip";
    default:
      return "unknown";
  }
}

}  // namespace

/// Where a shape goes and what it is called.
struct ShapeMeshes::Target {
  city::Mesh& mesh;
  std::vector<std::string>& notes;
  std::string name;
  Affine3d link_from_shape;
  city::Material material = city::Material::Unknown;

  void note(std::string_view what) const { notes.push_back(fmt::format("'{}' {}", name, what)); }

  /// Takes `soup` (in the frame of `link_from_soup`) as one object.
  void append(const std::string& object, city::Surface surface, Soup soup, const Affine3d& link_from_soup,
              bool orient_it) const {
    for (Vector3d& v : soup.vertices) v = link_from_soup * v;
    if (link_from_soup.linear().determinant() < 0) {
      for (auto& triangle : soup.triangles) std::swap(triangle[1], triangle[2]);
    }
    std::size_t kept = 0;
    for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
      const auto& [a, b, c] = soup.triangles[t];
      for (const std::uint32_t v : {a, b, c}) {
        if (!(soup.vertices[v].norm() <= kLargestShape_m)) {
          note(fmt::format("is left out: it reaches farther than {:.0f} km from its link",
                           kLargestShape_m / 1e3));
          return;
        }
      }
      if (city::is_degenerate(soup.vertices[a], soup.vertices[b], soup.vertices[c])) continue;
      soup.materials[kept] = soup.materials[t];
      soup.triangles[kept++] = soup.triangles[t];
    }
    soup.triangles.resize(kept);
    soup.materials.resize(kept);
    city::weld(soup.vertices, soup.triangles);
    if (orient_it) orient(soup, surface == city::Surface::Terrain);
    const std::size_t first = mesh.materials.size();
    city::append_object(mesh, object, surface, city::Material::Unknown, soup.vertices, soup.triangles);
    std::copy(soup.materials.begin(), soup.materials.end(),
              mesh.materials.begin() + static_cast<std::ptrdiff_t>(first));
  }

  void append(const city::TriangleSet& set) const {
    const bool terrain = names_terrain(name);
    Soup soup;
    soup.add(set.vertices, set.triangles, terrain ? city::Material::Ground : material);
    append(name, terrain ? city::Surface::Terrain : city::Surface::Building, std::move(soup), link_from_shape,
           false);
  }
};

ShapeMeshes::ShapeMeshes(bool visual, std::string physics_engine)
    : visual_(visual), physics_engine_(std::move(physics_engine)) {}

city::Mesh ShapeMeshes::link_mesh(const gazebo::physics::Link& link, std::vector<std::string>& notes) {
  city::Mesh mesh;
  if (visual_) {
    for (const auto& [id, visual] : link.Visuals()) {
      if (!visual.has_geometry()) continue;
      Target target{mesh, notes, visual.name(),
                    visual.has_pose() ? Affine3d(eigen(gazebo::msgs::ConvertIgn(visual.pose())))
                                      : Affine3d::Identity()};
      target.material = city::material_from_name(visual.material().script().name());
      const Geometry geometry = geometry_of(link, visual);
      // A server keeps heights only for collisions; the two are one terrain as a rule.
      boost::shared_ptr<HeightmapShape> heightmap;
      if (geometry.type() == Geometry::HEIGHTMAP) {
        for (const gazebo::physics::CollisionPtr& collision : link.GetCollisions()) {
          if (!heightmap) heightmap = heightmap_of(*collision);
        }
        if (!heightmap) {
          target.note(
              "is left out: a heightmap has heights in a server only as a collision of the same link");
          continue;
        }
      }
      take(target, geometry, heightmap.get());
    }
    return mesh;
  }
  for (const gazebo::physics::CollisionPtr& collision : link.GetCollisions()) {
    if (!is_thing(*collision)) continue;
    Target target{mesh, notes, collision->GetScopedName(), eigen(collision->RelativePose())};
    const auto heightmap = heightmap_of(*collision);
    Geometry geometry;
    if (!heightmap) collision->GetShape()->FillMsg(geometry);
    take(target, geometry, heightmap.get());
  }
  return mesh;
}

void ShapeMeshes::take(Target& target, const Geometry& geometry, const HeightmapShape* heightmap) {
  // Gazebo's readers of files throw.
  try {
    if (heightmap != nullptr) return add_heightmap(target, *heightmap);
    add(target, geometry);
  } catch (const gazebo::common::Exception& e) {
    target.note(fmt::format("is left out: {}", e.GetErrorStr()));
  } catch (const InputError& e) {
    target.note(fmt::format("is left out: {}", e.what()));
  }
}

void ShapeMeshes::add(Target& target, const Geometry& geometry) {
  switch (geometry.type()) {
    case Geometry::BOX: {
      const Vector3d size = vector(geometry.box().size());
      if (!is_extent(size.minCoeff()) || !size.allFinite())
        return target.note("is left out: a box without extent");
      return target.append(city::box_mesh(size));
    }
    case Geometry::CYLINDER: {
      const double radius = geometry.cylinder().radius(), length = geometry.cylinder().length();
      if (!is_extent(radius) || !is_extent(length)) {
        return target.note("is left out: a cylinder without extent");
      }
      return target.append(city::cylinder_mesh(radius, length));
    }
    case Geometry::SPHERE: {
      if (!is_extent(geometry.sphere().radius())) return target.note("is left out: a sphere without extent");
      return target.append(city::sphere_mesh(geometry.sphere().radius()));
    }
    case Geometry::PLANE: {
      const Vector3d normal = vector(geometry.plane().normal());
      Eigen::Vector2d size(geometry.plane().size().x(), geometry.plane().size().y());
      if (!normal.allFinite() || !(normal.norm() > 1e-6)) {
        return target.note("is left out: a plane with a normal of length 0");
      }
      if (!(size.minCoeff() > 0)) return target.note("is left out: a plane without extent");
      if (size.maxCoeff() > kLargestPlane_m) {
        size = size.cwiseMin(kLargestPlane_m);
        target.note(fmt::format("is a plane cut to {:.0f} km about its origin", kLargestPlane_m / 1e3));
      }
      return target.append(city::plane_mesh(normal.normalized(), size));
    }
    case Geometry::MESH:
      return add_mesh_file(target, geometry);
    case Geometry::POLYLINE:
      return add_polyline(target, geometry);
    case Geometry::EMPTY:
      return;
    default:
      return target.note(fmt::format("is left out: rays do not meet <{}> geometry", kind_of(geometry)));
  }
}

void ShapeMeshes::add_mesh_file(Target& target, const Geometry& geometry) {
  const auto& description = geometry.mesh();
  const std::string& uri = description.filename();
  auto& manager = *gazebo::common::MeshManager::Instance();
  const std::string file = gazebo::common::find_file(uri);
  const gazebo::common::Mesh* mesh = manager.GetMesh(uri);
  if (mesh == nullptr && !file.empty() && manager.IsValidFilename(file) && is_safe(file)) {
    mesh = manager.Load(file);
  }
  if (mesh == nullptr) {
    return target.note(fmt::format("is left out: its mesh '{}' is not found or cannot be read", uri));
  }
  const Vector3d scale = description.has_scale() ? vector(description.scale()) : Vector3d::Ones();
  if (!scale.allFinite() || !(scale.cwiseAbs().minCoeff() > 0)) {
    return target.note("is left out: a mesh with a scale of 0");
  }
  const Affine3d link_from_mesh = target.link_from_shape * Eigen::Scaling(scale);
  const auto [found, added] = marked_.try_emplace(file, false);
  if (added && !file.empty()) found->second = city::has_mesh_mark(file);
  const bool marked = found->second;

  // As Gazebo: a submesh that is not there leaves the whole mesh.
  const gazebo::common::SubMesh* only = nullptr;
  if (!description.submesh().empty() && description.submesh() != "__default__") {
    only = mesh->GetSubMesh(description.submesh());
    if (only == nullptr) {
      target.note(fmt::format("names submesh '{}', which its mesh does not have: the whole mesh is taken",
                              description.submesh()));
    }
  }
  const bool terrain = !marked && names_terrain(target.name);
  std::vector<Vector3d> vertices;
  city::TriangleIndices triangles;
  std::size_t other = 0, taken = 0;
  for (unsigned i = 0; i < mesh->GetSubMeshCount();) {
    // A node of several materials comes as several submeshes of its name.
    const std::string node_name = mesh->GetSubMesh(i)->GetName();
    Soup soup;
    for (; i < mesh->GetSubMeshCount() && mesh->GetSubMesh(i)->GetName() == node_name; ++i) {
      const gazebo::common::SubMesh& submesh = *mesh->GetSubMesh(i);
      if (only != nullptr && only != &submesh) continue;
      if (!read_submesh(submesh, vertices, triangles)) {
        ++other;
        continue;
      }
      if (only != nullptr && description.center_submesh()) {
        const Vector3d middle = middle_of(vertices);
        for (Vector3d& v : vertices) v -= middle;
      }
      const city::Material material =
          marked ? material_by_colour(mesh->GetMaterial(static_cast<int>(submesh.GetMaterialIndex())))
                 : target.material;
      soup.add(vertices, triangles, material);
    }
    if (soup.triangles.empty()) continue;
    ++taken;
    const city::NodeName node = city::read_node_name(node_name);
    const city::Surface surface = terrain ? city::Surface::Terrain : node.surface;
    if (!marked && surface == city::Surface::Terrain) {
      soup.materials.assign(soup.materials.size(), city::Material::Ground);
    }
    target.append(marked ? node.name : fmt::format("{}::{}", target.name, node.name), surface,
                  std::move(soup), link_from_mesh, !marked);
  }
  if (other > 0) target.note(fmt::format("has {} submeshes without triangles, which are left out", other));
  if (taken == 0) target.note("is left out: its mesh holds no triangle");
}

void ShapeMeshes::add_polyline(Target& target, const Geometry& geometry) {
  std::vector<std::vector<ignition::math::Vector2d>> paths;
  std::string key;
  const double height = geometry.polyline_size() > 0 ? geometry.polyline(0).height() : 0;
  bool sound = is_extent(height);
  fmt::format_to(std::back_inserter(key), "{}", height);
  for (const auto& polyline : geometry.polyline()) {
    std::vector<ignition::math::Vector2d> path;
    for (const auto& point : polyline.point()) {
      sound = sound && std::isfinite(point.x()) && std::isfinite(point.y());
      path.emplace_back(point.x(), point.y());
      fmt::format_to(std::back_inserter(key), " {} {}", point.x(), point.y());
    }
    sound = sound && path.size() >= 3;
    key += ';';
    paths.push_back(std::move(path));
  }
  if (!sound) return target.note("is left out: a polyline without height or with fewer than three points");
  // Gazebo's own extrusion, so that holes are what Gazebo makes of them. Equal polylines share a mesh.
  const std::string name = fmt::format("canyon_polyline_{:016x}", fnv1a(key));
  auto& manager = *gazebo::common::MeshManager::Instance();
  if (!manager.HasMesh(name)) manager.CreateExtrudedPolyline(name, paths, height);
  const gazebo::common::Mesh* mesh = manager.HasMesh(name) ? manager.GetMesh(name) : nullptr;
  std::vector<Vector3d> vertices;
  city::TriangleIndices triangles;
  if (mesh == nullptr || mesh->GetSubMeshCount() == 0 ||
      !read_submesh(*mesh->GetSubMesh(0), vertices, triangles)) {
    return target.note("is left out: Gazebo cannot extrude its polyline");
  }
  const bool terrain = names_terrain(target.name);
  Soup soup;
  soup.add(vertices, triangles, terrain ? city::Material::Ground : target.material);
  target.append(target.name, terrain ? city::Surface::Terrain : city::Surface::Building, std::move(soup),
                target.link_from_shape, true);
}

void ShapeMeshes::add_heightmap(Target& target, const HeightmapShape& shape) const {
  const int columns = shape.VertexCount().X(), rows = shape.VertexCount().Y();
  const ignition::math::Vector3d size = shape.Size();
  if (columns < 2 || rows < 2 || !is_extent(size.X()) || !is_extent(size.Y())) {
    return target.note("is left out: a heightmap without extent");
  }
  int stride = 1;  // divides both sides, so that the last row and column are kept
  const auto divides = [&](int n) { return (columns - 1) % n == 0 && (rows - 1) % n == 0; };
  for (int n = 2; n < std::min(columns, rows) && (std::max(columns, rows) - 1) / stride >= kFinestHeightmap;
       ++n) {
    if (divides(n)) stride = n;
  }
  if (stride > 1) {
    target.note(
        fmt::format("is a heightmap of {} x {} heights, of which each {}th is taken", columns, rows, stride));
  }
  // Row 0 is the picture's upper edge, which ODE leaves in the north; the other engines have it turned.
  const double first_row_y = physics_engine_ == "ode" ? 0.5 * size.Y() : -0.5 * size.Y();
  Soup soup;
  const int wide = (columns - 1) / stride + 1, high = (rows - 1) / stride + 1;
  soup.vertices.reserve(static_cast<std::size_t>(wide) * static_cast<std::size_t>(high));
  for (int row = 0; row < high; ++row) {
    for (int column = 0; column < wide; ++column) {
      soup.vertices.emplace_back((static_cast<double>(column) / (wide - 1) - 0.5) * size.X(),
                                 first_row_y * (1 - 2 * static_cast<double>(row) / (high - 1)),
                                 static_cast<double>(shape.GetHeight(column * stride, row * stride)));
    }
  }
  // Each cell is cut as ODE does, from the next column to the next row.
  for (int row = 0; row + 1 < high; ++row) {
    for (int column = 0; column + 1 < wide; ++column) {
      const auto here = static_cast<std::uint32_t>(row * wide + column);
      const std::uint32_t below = here + static_cast<std::uint32_t>(wide);
      soup.triangles.push_back({here, below, here + 1});
      soup.triangles.push_back({below + 1, here + 1, below});
    }
  }
  if (first_row_y < 0) {
    for (auto& triangle : soup.triangles) std::swap(triangle[1], triangle[2]);
  }
  soup.materials.assign(soup.triangles.size(), city::Material::Ground);
  Affine3d link_from_map = target.link_from_shape;
  link_from_map.translate(eigen(shape.Pos()));
  target.append(target.name, city::Surface::Terrain, std::move(soup), link_from_map, false);
}

std::uint64_t ShapeMeshes::fingerprint(const gazebo::physics::Link& link) const {
  std::string text;
  const auto add_numbers = [&text](std::initializer_list<double> numbers) {
    for (const double number : numbers) text.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  if (visual_) {
    for (const auto& [id, visual] : link.Visuals()) {
      if (!visual.has_geometry()) continue;
      visual.geometry().AppendPartialToString(&text);
      if (visual.has_pose()) visual.pose().AppendPartialToString(&text);
      text += '|';
    }
    return fnv1a(text);
  }
  Geometry geometry;
  for (const gazebo::physics::CollisionPtr& collision : link.GetCollisions()) {
    if (!is_thing(*collision)) continue;
    const ignition::math::Pose3d pose = collision->RelativePose();
    add_numbers({pose.Pos().X(), pose.Pos().Y(), pose.Pos().Z(), pose.Rot().W(), pose.Rot().X(),
                 pose.Rot().Y(), pose.Rot().Z()});
    if (const auto heightmap = heightmap_of(*collision)) {
      const ignition::math::Vector3d size = heightmap->Size(), pos = heightmap->Pos();
      add_numbers({size.X(), size.Y(), size.Z(), pos.X(), pos.Y(), pos.Z()});
    } else {
      geometry.Clear();
      collision->GetShape()->FillMsg(geometry);
      geometry.AppendPartialToString(&text);
    }
    text += '|';
  }
  return fnv1a(text);
}

}  // namespace canyon::adapters::gazebo_classic
