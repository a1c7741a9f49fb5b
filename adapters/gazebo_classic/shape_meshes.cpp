#include "adapters/gazebo_classic/shape_meshes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/pointer_cast.hpp>
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
#include <optional>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/link_shapes.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::adapters::gazebo_classic {

using city::HeightGrid;
using city::LinkShapes;
using city::MeshFile;
using city::MeshNode;
using city::MeshUse;
using city::Polyline;
using ShapePose = LinkShapes::ShapePose;
using gazebo::msgs::Geometry;
using gazebo::physics::Base;
using gazebo::physics::HeightmapShape;

namespace {

Eigen::Vector3d vector(const gazebo::msgs::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// The node has no triangles if the submesh has lines, points or strips.
MeshNode read_submesh(const gazebo::common::SubMesh& submesh) {
  MeshNode node{submesh.GetName(), {}, {}, {}};
  if (submesh.GetPrimitiveType() != gazebo::common::SubMesh::TRIANGLES) return node;
  node.vertices.reserve(submesh.GetVertexCount());
  for (unsigned v = 0; v < submesh.GetVertexCount(); ++v) node.vertices.push_back(eigen(submesh.Vertex(v)));
  node.triangles.reserve(submesh.GetIndexCount() / 3);
  for (unsigned i = 0; i + 2 < submesh.GetIndexCount(); i += 3)
    node.triangles.push_back({submesh.GetIndex(i), submesh.GetIndex(i + 1), submesh.GetIndex(i + 2)});
  return node;
}

boost::shared_ptr<HeightmapShape> heightmap_of(const gazebo::physics::Collision& collision) {
  const gazebo::physics::ShapePtr shape = collision.GetShape();
  return shape && shape->HasType(Base::HEIGHTMAP_SHAPE) ? boost::dynamic_pointer_cast<HeightmapShape>(shape)
                                                        : nullptr;
}

/// Whether rays can hit a collision. In Gazebo, rays of sensors are collisions too.
bool is_thing(const gazebo::physics::Collision& collision) {
  const gazebo::physics::ShapePtr shape = collision.GetShape();
  return shape && !collision.HasType(Base::SENSOR_COLLISION) && !shape->HasType(Base::RAY_SHAPE) &&
         !shape->HasType(Base::MULTIRAY_SHAPE);
}

/// Gazebo scales a visual in its SDF; the message is as loaded.
Geometry geometry_of(const gazebo::physics::Link& link, const gazebo::msgs::Visual& visual) {
  // GetSDF() is not const but has no side effects.
  const sdf::ElementPtr sdf = const_cast<gazebo::physics::Link&>(link).GetSDF();
  const std::string scope = link.GetScopedName() + "::";
  for (sdf::ElementPtr e = sdf->HasElement("visual") ? sdf->GetElement("visual") : nullptr; e;
       e = e->GetNextElement("visual"))
    if (scope + e->Get<std::string>("name") == visual.name() && e->HasElement("geometry"))
      return gazebo::msgs::GeometryFromSDF(e->GetElement("geometry"));
  return visual.geometry();
}

/// Whether Gazebo can read a mesh file. Its reader of COLLADA crashes on a file that is not COLLADA, and on
/// truncated files. Meshes of visuals are not checked before: a server does not read them.
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

void add_mesh_file(LinkShapes& shapes, const ShapePose& location, const gazebo::msgs::MeshGeom& geometry) {
  const std::string& uri = geometry.filename();
  auto& manager = *gazebo::common::MeshManager::Instance();
  const std::string path = gazebo::common::find_file(uri);
  const gazebo::common::Mesh* mesh = manager.GetMesh(uri);
  if (mesh == nullptr && !path.empty() && manager.IsValidFilename(path) && is_safe(path))
    mesh = manager.Load(path);
  if (mesh == nullptr)
    return shapes.leave_out(location, fmt::format("its mesh '{}' is not found or cannot be read", uri));
  MeshUse use;
  if (geometry.has_scale()) use.scale = vector(geometry.scale());
  if (geometry.submesh() != "__default__") use.submesh = geometry.submesh();
  use.center = geometry.center_submesh();
  // Gazebo shows only the first of several submeshes of the chosen name.
  const gazebo::common::SubMesh* only = use.submesh.empty() ? nullptr : mesh->GetSubMesh(use.submesh);
  MeshFile file{{}, !path.empty() && city::has_mesh_mark(path)};
  for (unsigned i = 0; i < mesh->GetSubMeshCount(); ++i) {
    const gazebo::common::SubMesh& submesh = *mesh->GetSubMesh(i);
    if (only != nullptr && only != &submesh) continue;
    MeshNode& node = file.nodes.emplace_back(read_submesh(submesh));
    if (const auto* material = mesh->GetMaterial(static_cast<int>(submesh.GetMaterialIndex()))) {
      const ignition::math::Color colour = material->Diffuse();
      node.colour = {colour.R(), colour.G(), colour.B()};
    }
  }
  shapes.mesh(location, file, use);
}

void add_polyline(LinkShapes& shapes, const ShapePose& location, const Geometry& geometry) {
  std::vector<Polyline> polylines;
  for (const auto& polyline : geometry.polyline()) {
    Polyline& path = polylines.emplace_back();
    for (const auto& point : polyline.point()) path.emplace_back(point.x(), point.y());
  }
  const auto extrude = [](const std::string& name, const std::vector<Polyline>& paths,
                          double height) -> std::optional<MeshNode> {
    std::vector<std::vector<ignition::math::Vector2d>> points;
    for (const Polyline& path : paths) {
      auto& to = points.emplace_back();
      for (const Eigen::Vector2d& point : path) to.emplace_back(point.x(), point.y());
    }
    auto& manager = *gazebo::common::MeshManager::Instance();
    if (!manager.HasMesh(name)) manager.CreateExtrudedPolyline(name, points, height);
    const gazebo::common::Mesh* mesh = manager.HasMesh(name) ? manager.GetMesh(name) : nullptr;
    if (mesh == nullptr || mesh->GetSubMeshCount() == 0) return std::nullopt;
    return read_submesh(*mesh->GetSubMesh(0));
  };
  shapes.polylines(location, polylines, geometry.polyline_size() > 0 ? geometry.polyline(0).height() : 0,
                   extrude);
}

void add(LinkShapes& shapes, const ShapePose& location, const Geometry& geometry) {
  switch (geometry.type()) {
    case Geometry::BOX:
      return shapes.solid(location, "a box", city::box_mesh(vector(geometry.box().size())));
    case Geometry::CYLINDER:
      return shapes.solid(location, "a cylinder",
                          city::cylinder_mesh(geometry.cylinder().radius(), geometry.cylinder().length()));
    case Geometry::SPHERE:
      return shapes.solid(location, "a sphere", city::sphere_mesh(geometry.sphere().radius()));
    case Geometry::PLANE:
      return shapes.plane(location, vector(geometry.plane().normal()),
                          {geometry.plane().size().x(), geometry.plane().size().y()});
    case Geometry::MESH:
      return add_mesh_file(shapes, location, geometry.mesh());
    case Geometry::POLYLINE:
      return add_polyline(shapes, location, geometry);
    case Geometry::EMPTY:
      return;
    default:
      return shapes.leave_out(location, fmt::format("rays cannot hit <{}> geometry", kind_of(geometry)));
  }
}

/// `heightmap` (null: none) instead of `geometry`.
void take(LinkShapes& shapes, const ShapePose& location, const Geometry& geometry,
          const HeightmapShape* heightmap, bool north_first) {
  // Gazebo's readers of files throw.
  try {
    if (heightmap == nullptr) return add(shapes, location, geometry);
    HeightGrid grid;
    grid.columns = heightmap->VertexCount().X();
    grid.rows = heightmap->VertexCount().Y();
    grid.height = [heightmap](int column, int row) {
      return static_cast<double>(heightmap->GetHeight(column, row));
    };
    grid.north_first = north_first;
    grid.size = eigen(heightmap->Size()).head<2>();
    grid.position = eigen(heightmap->Pos());
    shapes.heights(location, grid);
  } catch (const gazebo::common::Exception& e) {
    shapes.leave_out(location, e.GetErrorStr());
  } catch (const InputError& e) {
    shapes.leave_out(location, e.what());
  }
}

}  // namespace

ShapeMeshes::ShapeMeshes(bool visual, const std::string& physics_engine)
    : visual_(visual), north_first_(physics_engine == "ode") {}

city::Mesh ShapeMeshes::link_mesh(const gazebo::physics::Link& link, std::vector<std::string>& notes) const {
  LinkShapes shapes(notes);
  if (visual_) {
    for (const auto& [id, visual] : link.Visuals()) {
      if (!visual.has_geometry()) continue;
      ShapePose location{visual.name()};
      if (visual.has_pose()) location.link_from_shape = eigen(gazebo::msgs::ConvertIgn(visual.pose()));
      location.material = city::material_from_name(visual.material().script().name());
      const Geometry geometry = geometry_of(link, visual);
      // A server keeps heights only for collisions; both are usually the same terrain.
      boost::shared_ptr<HeightmapShape> heightmap;
      if (geometry.type() == Geometry::HEIGHTMAP) {
        for (const gazebo::physics::CollisionPtr& collision : link.GetCollisions())
          if (!heightmap) heightmap = heightmap_of(*collision);
        if (!heightmap) {
          shapes.leave_out(
              location,
              "in a server a heightmap has heights only if it is also a collision of the same link");
          continue;
        }
      }
      take(shapes, location, geometry, heightmap.get(), north_first_);
    }
    return shapes.take();
  }
  for (const gazebo::physics::CollisionPtr& collision : link.GetCollisions()) {
    if (!is_thing(*collision)) continue;
    const ShapePose location{collision->GetScopedName(), eigen(collision->RelativePose())};
    const auto heightmap = heightmap_of(*collision);
    Geometry geometry;
    if (!heightmap) collision->GetShape()->FillMsg(geometry);
    take(shapes, location, geometry, heightmap.get(), north_first_);
  }
  return shapes.take();
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
