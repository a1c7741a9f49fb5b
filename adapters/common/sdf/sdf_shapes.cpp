#include "adapters/common/sdf/sdf_shapes.hpp"

#include <fmt/format.h>

#include <initializer_list>
#include <sdf/Box.hh>
#include <sdf/Capsule.hh>
#include <sdf/Cylinder.hh>
#include <sdf/Ellipsoid.hh>
#include <sdf/Heightmap.hh>
#include <sdf/Mesh.hh>
#include <sdf/Plane.hh>
#include <sdf/Sphere.hh>
#if __has_include(<sdf/Cone.hh>)
#include <sdf/Cone.hh>
#define CANYON_SDF_HAS_CONE
#endif
#if __has_include(<sdf/Polyline.hh>)
#include <sdf/Polyline.hh>
#define CANYON_SDF_HAS_POLYLINE
#endif

#include "adapters/common/gazebo_math.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::adapters {

namespace {

/// Calls `visit` with the shape of a geometry, of any class; false if it has none, or one unknown to this
/// sdformat.
template <class Visit>
bool visit_shape(const sdf::Geometry& geometry, const Visit& visit) {
  const auto one = [&](const auto* shape) {
    if (shape != nullptr) visit(*shape);
    return shape != nullptr;
  };
  switch (geometry.Type()) {
    case sdf::GeometryType::BOX:
      return one(geometry.BoxShape());
    case sdf::GeometryType::CYLINDER:
      return one(geometry.CylinderShape());
    case sdf::GeometryType::PLANE:
      return one(geometry.PlaneShape());
    case sdf::GeometryType::SPHERE:
      return one(geometry.SphereShape());
    case sdf::GeometryType::MESH:
      return one(geometry.MeshShape());
    case sdf::GeometryType::HEIGHTMAP:
      return one(geometry.HeightmapShape());
    case sdf::GeometryType::CAPSULE:
      return one(geometry.CapsuleShape());
    case sdf::GeometryType::ELLIPSOID:
      return one(geometry.EllipsoidShape());
#ifdef CANYON_SDF_HAS_CONE
    case sdf::GeometryType::CONE:
      return one(geometry.ConeShape());
#endif
#ifdef CANYON_SDF_HAS_POLYLINE
    case sdf::GeometryType::POLYLINE:
      visit(geometry.PolylineShape());
      return true;
#endif
    default:
      return false;
  }
}

struct Adder {
  LinkShapes& link;
  const LinkShapes::ShapePose& pose;
  ShapeFiles* files;

  void solid(const char* what, const city::TriangleSet& set) const { link.solid(pose, what, set); }
  void operator()(const sdf::Box& b) const { solid("a box", city::box_mesh(eigen(b.Size()))); }
  void operator()(const sdf::Cylinder& c) const {
    solid("a cylinder", city::cylinder_mesh(c.Radius(), c.Length()));
  }
  void operator()(const sdf::Capsule& c) const {
    solid("a capsule", city::capsule_mesh(c.Radius(), c.Length()));
  }
  void operator()(const sdf::Sphere& s) const { solid("a sphere", city::sphere_mesh(s.Radius())); }
  void operator()(const sdf::Ellipsoid& e) const {
    solid("an ellipsoid", city::ellipsoid_mesh(eigen(e.Radii())));
  }
  void operator()(const sdf::Plane& plane) const {
    link.plane(pose, eigen(plane.Normal()), eigen(plane.Size()));
  }
#ifdef CANYON_SDF_HAS_CONE
  void operator()(const sdf::Cone& cone) const {
    solid("a cone", city::cone_mesh(cone.Radius(), cone.Length()));
  }
#endif
#ifdef CANYON_SDF_HAS_POLYLINE
  void operator()(const std::vector<sdf::Polyline>& shapes) const {
    std::vector<Polyline> polylines;
    for (const sdf::Polyline& shape : shapes) {
      Polyline& polyline = polylines.emplace_back();
      for (const auto& point : shape.Points()) polyline.push_back(eigen(point));
    }
    link.polylines(pose, polylines, shapes.empty() ? 0 : shapes.front().Height(),
                   [this](const auto& name, const auto& paths, double height) {
                     return files == nullptr ? std::nullopt : files->extrude(name, paths, height);
                   });
  }
#endif
  void operator()(const sdf::Mesh& mesh) const {
    const auto file = files == nullptr ? std::nullopt : files->mesh(mesh.Uri(), mesh.FilePath());
    if (!file)
      return link.leave_out(pose, fmt::format("its mesh '{}' is not found or cannot be read", mesh.Uri()));
    link.mesh(pose, *file, {eigen(mesh.Scale()), mesh.Submesh(), mesh.CenterSubmesh()});
  }
  void operator()(const sdf::Heightmap& map) const {
    auto grid = files == nullptr ? std::nullopt : files->heights(map.Uri(), map.FilePath(), map.Size().Z());
    if (!grid) {
      return link.leave_out(pose, fmt::format("its heights '{}' are not found or cannot be read", map.Uri()));
    }
    grid->size = eigen(map.Size()).head<2>();
    grid->position = eigen(map.Position());
    link.heights(pose, *grid);
  }
};

struct Describer {
  std::string& text;

  void numbers(std::initializer_list<double> values) const {
    for (const double value : values) text.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void vector(const Eigen::Vector3d& v) const { numbers({v.x(), v.y(), v.z()}); }
  void words(std::initializer_list<std::string> values) const {
    for (const std::string& value : values) (text += value) += '\0';
  }

  void operator()(const sdf::Box& box) const { vector(eigen(box.Size())); }
  void operator()(const sdf::Sphere& sphere) const { numbers({sphere.Radius()}); }
  void operator()(const sdf::Ellipsoid& e) const { vector(eigen(e.Radii())); }
  void operator()(const sdf::Plane& plane) const {
    vector(eigen(plane.Normal()));
    numbers({plane.Size().X(), plane.Size().Y()});
  }
  void operator()(const sdf::Mesh& mesh) const {
    words({mesh.Uri(), mesh.FilePath(), mesh.Submesh(), mesh.CenterSubmesh() ? "centre" : ""});
    vector(eigen(mesh.Scale()));
  }
  void operator()(const sdf::Heightmap& map) const {
    words({map.Uri(), map.FilePath()});
    vector(eigen(map.Size()));
    vector(eigen(map.Position()));
  }
#ifdef CANYON_SDF_HAS_POLYLINE
  void operator()(const std::vector<sdf::Polyline>& shapes) const {
    for (const sdf::Polyline& shape : shapes) {
      numbers({shape.Height(), static_cast<double>(shape.PointCount())});
      for (const auto& point : shape.Points()) numbers({point.X(), point.Y()});
    }
  }
#endif
  /// Cylinders, capsules, cones.
  template <class Round>
  void operator()(const Round& shape) const {
    numbers({shape.Radius(), shape.Length()});
  }
};

}  // namespace

void add_shape(LinkShapes& link, const LinkShapes::ShapePose& location, const sdf::Geometry& geometry,
               ShapeFiles* files) {
  if (geometry.Type() == sdf::GeometryType::EMPTY) return;
  try {
    if (!visit_shape(geometry, Adder{link, location, files}))
      link.leave_out(location, "rays cannot hit its geometry");
  } catch (const InputError& e) {
    link.leave_out(location, e.what());
  }
}

city::Material material_of(const sdf::Material* material) {
  if (material == nullptr) return city::Material::Unknown;
  const city::Material named = city::material_from_name(material->ScriptName());
  const auto colour = material->Diffuse();
  return named != city::Material::Unknown ? named
                                          : city::material_by_colour({colour.R(), colour.G(), colour.B()});
}

std::uint64_t fingerprint(const sdf::Geometry& geometry, const Eigen::Isometry3d& link_from_shape) {
  std::string text;
  const Describer describe{text};
  describe.numbers({static_cast<double>(geometry.Type())});
  for (const double number : link_from_shape.matrix().reshaped()) describe.numbers({number});
  visit_shape(geometry, describe);
  return fnv1a(text);
}

}  // namespace canyon::adapters
