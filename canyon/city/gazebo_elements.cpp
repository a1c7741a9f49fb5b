#include "canyon/city/gazebo_elements.hpp"

#include <fmt/format.h>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <optional>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/meshes/geos.hpp"

namespace canyon::city::sdf {

std::string attribute(const Element& element, const char* name) {
  const char* value = element.Attribute(name);
  return value == nullptr ? "" : value;
}

std::string text_of(const Element& element) {
  const char* text = element.GetText();
  return text == nullptr ? "" : std::string(trim(text));
}

std::string child_text(const Element& element, const char* child) {
  const Element* found = element.FirstChildElement(child);
  return found == nullptr ? "" : text_of(*found);
}

bool is_true(std::string_view word) {
  return word == "true" || word == "1";
}

std::vector<double> numbers(const SdfFile& source, const Element& element, std::size_t count,
                            double largest) {
  const std::string text = text_of(element);
  std::vector<double> values;
  for (const std::string_view word : split_blanks(text)) {
    const std::optional<double> value = parse_double(word);
    if (!value || std::abs(*value) > largest) {
      throw source.error(element, fmt::format("<{}> has '{}'", element.Name(), word),
                         fmt::format("give numbers within +-{}", largest));
    }
    values.push_back(*value);
  }
  if (values.size() != count) {
    throw source.error(
        element, fmt::format("<{}> has {} numbers instead of {}", element.Name(), values.size(), count));
  }
  return values;
}

using Eigen::Affine3d;
using Eigen::AngleAxisd;
using Eigen::Vector3d;

namespace {

namespace geos = meshes::geos;

geos::Geometry closed_line(const Polyline& polyline) {
  std::vector<double> numbers;
  for (const Eigen::Vector2d& point : polyline) numbers.insert(numbers.end(), {point.x(), point.y()});
  if (polyline.front() != polyline.back()) numbers.insert(numbers.end(), {numbers[0], numbers[1]});
  return geos::Geometry(GEOSGeom_createLineString_r(
      geos::context(), GEOSCoordSeq_copyFromBuffer_r(geos::context(), numbers.data(),
                                                     static_cast<unsigned>(numbers.size() / 2), 0, 0)));
}

/// The area within an odd number of closed paths.
std::vector<meshes::Polygon2> area_within(const std::vector<Polyline>& polylines) {
  std::vector<geos::Geometry> lines;
  for (const Polyline& polyline : polylines) lines.push_back(closed_line(polyline));
  const geos::Geometry all = geos::collection(std::move(lines));
  if (!all) return {};
  const geos::Geometry crossed(GEOSNode_r(geos::context(), all.get()));  // points where paths cross
  if (!crossed) return {};
  return geos::polygons(geos::Geometry(GEOSBuildArea_r(geos::context(), crossed.get())).get());
}

/// Adds the closed surface between z = 0 and `height` above a polygon.
void add_extrusion(const meshes::Polygon2& polygon, double height, MeshNode& node) {
  const auto first = static_cast<std::uint32_t>(node.vertices.size());
  const auto add_ring = [&](const std::vector<meshes::Point2>& ring) {
    const auto begin = static_cast<std::uint32_t>(node.vertices.size());
    const auto size = static_cast<std::uint32_t>(ring.size());
    for (const meshes::Point2& at : ring) {
      node.vertices.emplace_back(at.x(), at.y(), 0);
      node.vertices.emplace_back(at.x(), at.y(), height);
    }
    for (std::uint32_t i = 0; i < size; ++i) {
      const std::uint32_t a = begin + 2 * i, b = begin + 2 * ((i + 1) % size);
      node.triangles.push_back({a, b, b + 1});
      node.triangles.push_back({a, b + 1, a + 1});
    }
  };
  add_ring(polygon.outer);
  for (const auto& hole : polygon.holes) add_ring(hole);
  for (const auto& [a, b, c] : meshes::triangulate(polygon)) {
    node.triangles.push_back({first + 2 * a, first + 2 * c, first + 2 * b});
    node.triangles.push_back({first + 2 * a + 1, first + 2 * b + 1, first + 2 * c + 1});
  }
}

/// SDF's polylines extruded from 0 to `height` [m], an Extrude without a simulator: a closed surface around
/// the area inside an odd number of the closed paths, so that a path inside another is its hole. Empty if the
/// paths enclose no area.
std::optional<MeshNode> extruded_polylines(const std::string& name, const std::vector<Polyline>& polylines,
                                           double height) {
  MeshNode node{name, {}, {}, {}};
  for (const meshes::Polygon2& polygon : area_within(polylines)) add_extrusion(polygon, height, node);
  if (node.triangles.empty()) return std::nullopt;
  return node;
}

constexpr double kMaxSize_m = 1e6;

/// Numbers of a shape's child [m].
std::vector<double> child_numbers(const SdfFile& source, const Element& shape, const char* child,
                                  std::size_t count) {
  const Element* element = shape.FirstChildElement(child);
  if (element == nullptr) throw source.error(shape, fmt::format("<{}> without <{}>", shape.Name(), child));
  return numbers(source, *element, count, kMaxSize_m);
}

constexpr double kMaxPose_m = 1e6;
constexpr std::size_t kDeepestName = 16;

/// The frame named by an element's <pose>; empty for its parent. Before SDF 1.7 the attribute is `frame`.
std::string relative_to(const Element& element) {
  const Element* const pose = element.FirstChildElement("pose");
  if (pose == nullptr) return {};
  const std::string name = attribute(*pose, "relative_to");
  return name.empty() ? attribute(*pose, "frame") : name;
}

}  // namespace

bool add_primitive(const SdfFile& source, const Element& shape, LinkShapes& shapes,
                   const LinkShapes::ShapePose& location) {
  const auto length = [&](const char* child) { return child_numbers(source, shape, child, 1)[0]; };
  const auto lengths = [&](const char* child) {
    const std::vector<double> s = child_numbers(source, shape, child, 3);
    return Eigen::Vector3d(s[0], s[1], s[2]);
  };
  const std::string_view kind = shape.Name();
  if (kind == "box") {
    shapes.solid(location, "a box", box_mesh(lengths("size")));
  } else if (kind == "ellipsoid") {
    shapes.solid(location, "an ellipsoid", ellipsoid_mesh(lengths("radii")));
  } else if (kind == "capsule") {
    shapes.solid(location, "a capsule", capsule_mesh(length("radius"), length("length")));
  } else if (kind == "cone") {
    shapes.solid(location, "a cone", cone_mesh(length("radius"), length("length")));
  } else if (kind == "cylinder") {
    shapes.solid(location, "a cylinder", cylinder_mesh(length("radius"), length("length")));
  } else if (kind == "sphere") {
    shapes.solid(location, "a sphere", sphere_mesh(length("radius")));
  } else if (kind == "plane") {
    // SDF's defaults.
    const bool has_size = shape.FirstChildElement("size") != nullptr;
    const std::vector<double> s = has_size ? child_numbers(source, shape, "size", 2) : std::vector{1.0, 1.0};
    shapes.plane(location,
                 shape.FirstChildElement("normal") != nullptr ? lengths("normal") : Eigen::Vector3d::UnitZ(),
                 {s[0], s[1]});
  } else {
    return false;
  }
  return true;
}

bool add_polylines(const SdfFile& source, const Element& geometry, LinkShapes& shapes,
                   const LinkShapes::ShapePose& location) {
  const Element* const first = geometry.FirstChildElement("polyline");
  if (first == nullptr) return false;
  std::vector<Polyline> polylines;
  for (const Element* e = first; e != nullptr; e = e->NextSiblingElement("polyline")) {
    Polyline& path = polylines.emplace_back();
    for (const Element* p = e->FirstChildElement("point"); p != nullptr; p = p->NextSiblingElement("point")) {
      const std::vector<double> at = numbers(source, *p, 2, kMaxSize_m);
      path.emplace_back(at[0], at[1]);
    }
  }
  // GEOS needs time proportional to the square of the number of paths.
  constexpr std::size_t kMaxPaths = 500;
  if (polylines.size() > kMaxPaths)
    throw source.error(*first, fmt::format("{} <polyline> of a geometry", polylines.size()),
                       fmt::format("give {} at most, the others in geometries of their own", kMaxPaths));
  if (geos::is_tangled(polylines))
    throw source.error(*first, "<polyline> whose sides cross thousands of times",
                       "give the corners in order along the outline");
  shapes.polylines(location, polylines, child_numbers(source, *first, "height", 1)[0], extruded_polylines);
  return true;
}

Affine3d Frames::numbers_of(const SdfFile& source, const Element& element) {
  const Element* const pose = element.FirstChildElement("pose");
  Affine3d result = Affine3d::Identity();
  if (pose == nullptr) return result;
  if (attribute(*pose, "rotation_format") == "quat_xyzw") {
    const std::vector<double> v = numbers(source, *pose, 7, kMaxPose_m);
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (!(q.norm() > 1e-6)) throw source.error(*pose, "quaternion of length 0");
    result.translate(Vector3d(v[0], v[1], v[2]));
    result.rotate(q.normalized());
    return result;
  }
  if (text_of(*pose).empty()) return result;
  const std::vector<double> v = numbers(source, *pose, 6, kMaxPose_m);
  const double unit = is_true(attribute(*pose, "degrees")) ? geodesy::radians(1) : 1;
  result.translate(Vector3d(v[0], v[1], v[2]));
  // SDF: roll about x, then pitch about y, then yaw about z, all about fixed axes.
  result.rotate(AngleAxisd(v[5] * unit, Vector3d::UnitZ()) * AngleAxisd(v[4] * unit, Vector3d::UnitY()) *
                AngleAxisd(v[3] * unit, Vector3d::UnitX()));
  return result;
}

std::string Frames::name_of(const Scope& scope, const Element& child) const {
  if (std::string_view(child.Name()) != "include") return attribute(child, "name");
  std::string name = child_text(child, "name");
  if (!name.empty()) return name;
  const Scope model = open_(*scope.source, child);
  return model.element == nullptr ? std::string() : attribute(*model.element, "name");
}

Affine3d Frames::named(const Scope& scope, std::string_view name, const Element& user, std::size_t depth) {
  if (name.empty() || name == "__model__" || name == "world" || name == "__root__")
    return Affine3d::Identity();
  const std::size_t colons = name.find("::");
  const std::string_view first = name.substr(0, colons);
  std::string known;
  for (const Element* e = scope.element->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string_view kind = e->Name();
    if (kind != "link" && kind != "model" && kind != "frame" && kind != "joint" && kind != "include")
      continue;
    const std::string own = name_of(scope, *e);
    if (own != first) {
      if (known.size() < 100) known += fmt::format("{}'{}'", known.empty() ? "" : ", ", own);
      continue;
    }
    Affine3d pose = child_pose(scope, *e);
    if (colons == std::string_view::npos) return pose;
    const Scope inner = kind == "include" ? open_(*scope.source, *e) : Scope{scope.source, e};
    if (inner.element == nullptr || depth > kDeepestName) break;
    return pose * named(inner, name.substr(colons + 2), user, depth + 1);
  }
  throw scope.source->error(user, fmt::format("a pose is relative to '{}', which does not exist", name),
                            known.empty() ? std::string("name a frame of the same world or model")
                                          : fmt::format("there are {}", known));
}

Affine3d Frames::base_of(const Scope& scope, const Element& child) {
  const std::string relative = relative_to(child);
  if (!relative.empty()) return named(scope, relative, child, 0);
  const std::string_view kind = child.Name();
  if (kind == "joint") return named(scope, child_text(child, "child"), child, 0);
  if (kind == "frame") return named(scope, attribute(child, "attached_to"), child, 0);
  return Affine3d::Identity();
}

Affine3d Frames::resolved(const Scope& scope, const Element& child) {
  const std::string_view kind = child.Name();
  if (kind != "include" && kind != "model") return base_of(scope, child) * numbers_of(*scope.source, child);
  const Scope model = kind == "include" ? open_(*scope.source, child) : Scope{scope.source, &child};
  // A pose of the include replaces the model's own.
  const bool own = kind == "model" || child.FirstChildElement("pose") != nullptr || model.element == nullptr;
  Affine3d pose = own ? base_of(scope, child) * numbers_of(*scope.source, child)
                      : numbers_of(*model.source, *model.element);
  if (model.element == nullptr) return pose;
  std::string containment = kind == "include" ? child_text(child, "placement_frame") : std::string();
  if (containment.empty()) containment = attribute(*model.element, "placement_frame");
  return containment.empty() ? pose : pose * named(model, containment, *model.element, 0).inverse();
}

Affine3d Frames::child_pose(const Scope& scope, const Element& child) {
  const auto begin = std::find(open_frames_.begin(), open_frames_.end(), &child);
  if (begin != open_frames_.end()) {
    std::string circle;
    for (auto at = begin; at != open_frames_.end(); ++at)
      circle += fmt::format("'{}' to ", attribute(**at, "name"));
    throw scope.source->error(
        child,
        fmt::format("poses are relative to each other in a circle: {}'{}'", circle, attribute(child, "name")),
        "make one of them relative to the model or world");
  }
  constexpr std::size_t kDeepest = 200;
  if (open_frames_.size() >= kDeepest)
    throw scope.source->error(child,
                              fmt::format("poses are relative to each other more than {} deep", kDeepest),
                              "give poses relative to the model or world");
  open_frames_.push_back(&child);
  // An error aborts the import, and destroys this object.
  Affine3d pose = resolved(scope, child);
  open_frames_.pop_back();
  return pose;
}

Affine3d Frames::shape_pose(const Scope& model, const Element& link, const Element& shape) {
  const std::string relative = relative_to(shape);
  const Affine3d base = relative.empty() ? child_pose(model, link) : named(model, relative, shape, 0);
  return base * numbers_of(*model.source, shape);
}

}  // namespace canyon::city::sdf
