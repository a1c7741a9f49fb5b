#include "canyon/city/sdf_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "canyon/geodesy/constants.hpp"

namespace canyon::city::sdf {

using Eigen::Affine3d;
using Eigen::AngleAxisd;
using Eigen::Vector3d;

namespace {

constexpr double kLargestPose_m = 1e6;
constexpr std::size_t kDeepestName = 16;

bool is_frame(std::string_view kind) {
  return kind == "link" || kind == "model" || kind == "frame" || kind == "joint" || kind == "include";
}

/// The frame that an element's <pose> names; empty for its parent. Before SDF 1.7 its attribute is `frame`.
std::string relative_to(const Element& element) {
  const Element* const pose = element.FirstChildElement("pose");
  if (pose == nullptr) return {};
  const std::string name = attribute(*pose, "relative_to");
  return name.empty() ? attribute(*pose, "frame") : name;
}

}  // namespace

Affine3d Frames::numbers_of(const Source& source, const Element& element) {
  const Element* const pose = element.FirstChildElement("pose");
  Affine3d result = Affine3d::Identity();
  if (pose == nullptr) return result;
  if (attribute(*pose, "rotation_format") == "quat_xyzw") {
    const std::vector<double> v = numbers(source, *pose, 7, kLargestPose_m);
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (!(q.norm() > 1e-6)) throw source.error(*pose, "quaternion of length 0");
    result.translate(Vector3d(v[0], v[1], v[2]));
    result.rotate(q.normalized());
    return result;
  }
  if (text_of(*pose).empty()) return result;
  const std::vector<double> v = numbers(source, *pose, 6, kLargestPose_m);
  const double unit = is_true(attribute(*pose, "degrees")) ? geodesy::radians(1) : 1;
  result.translate(Vector3d(v[0], v[1], v[2]));
  // SDF: roll about x, then pitch about y, then yaw about z, all of fixed axes.
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
    if (!is_frame(e->Name())) continue;
    const std::string own = name_of(scope, *e);
    if (own != first) {
      if (known.size() < 100) known += fmt::format("{}'{}'", known.empty() ? "" : ", ", own);
      continue;
    }
    Affine3d pose = of_child(scope, *e);
    if (colons == std::string_view::npos) return pose;
    const std::string_view kind = e->Name();
    const Scope inner = kind == "include" ? open_(*scope.source, *e) : Scope{scope.source, e};
    if (inner.element == nullptr || depth > kDeepestName) break;
    return pose * named(inner, name.substr(colons + 2), user, depth + 1);
  }
  throw scope.source->error(user, fmt::format("a pose is relative to '{}', which is not there", name),
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
  // A pose of the include takes the place of the model's own.
  const bool own = kind == "model" || child.FirstChildElement("pose") != nullptr || model.element == nullptr;
  Affine3d pose = own ? base_of(scope, child) * numbers_of(*scope.source, child)
                      : numbers_of(*model.source, *model.element);
  if (model.element == nullptr) return pose;
  std::string placement = kind == "include" ? child_text(child, "placement_frame") : std::string();
  if (placement.empty()) placement = attribute(*model.element, "placement_frame");
  return placement.empty() ? pose : pose * named(model, placement, *model.element, 0).inverse();
}

Affine3d Frames::of_child(const Scope& scope, const Element& child) {
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
  // An error leaves the import, and with it this object.
  Affine3d pose = resolved(scope, child);
  open_frames_.pop_back();
  return pose;
}

Affine3d Frames::of_shape(const Scope& model, const Element& link, const Element& shape) {
  const std::string relative = relative_to(shape);
  const Affine3d base = relative.empty() ? of_child(model, link) : named(model, relative, shape, 0);
  return base * numbers_of(*model.source, shape);
}

}  // namespace canyon::city::sdf
