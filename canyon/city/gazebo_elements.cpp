#include "canyon/city/gazebo_elements.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <optional>

#include "canyon/base/text.hpp"
#include "canyon/city/extruded_polylines.hpp"

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

std::vector<double> numbers(const Source& source, const Element& element, std::size_t count, double largest) {
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

namespace {

constexpr double kLargestSize_m = 1e6;

/// Numbers of a shape's child [m].
std::vector<double> child_numbers(const Source& source, const Element& shape, const char* child,
                                  std::size_t count) {
  const Element* element = shape.FirstChildElement(child);
  if (element == nullptr) throw source.error(shape, fmt::format("<{}> without <{}>", shape.Name(), child));
  return numbers(source, *element, count, kLargestSize_m);
}

}  // namespace

bool add_primitive(const Source& source, const Element& shape, LinkShapes& shapes,
                   const LinkShapes::Place& place) {
  const auto length = [&](const char* child) { return child_numbers(source, shape, child, 1)[0]; };
  const auto lengths = [&](const char* child) {
    const std::vector<double> s = child_numbers(source, shape, child, 3);
    return Eigen::Vector3d(s[0], s[1], s[2]);
  };
  const std::string_view kind = shape.Name();
  if (kind == "box") {
    shapes.box(place, lengths("size"));
  } else if (kind == "ellipsoid") {
    shapes.ellipsoid(place, lengths("radii"));
  } else if (kind == "capsule") {
    shapes.capsule(place, length("radius"), length("length"));
  } else if (kind == "cone") {
    shapes.cone(place, length("radius"), length("length"));
  } else if (kind == "cylinder") {
    shapes.cylinder(place, length("radius"), length("length"));
  } else if (kind == "sphere") {
    shapes.sphere(place, length("radius"));
  } else if (kind == "plane") {
    // SDF's defaults.
    const bool has_size = shape.FirstChildElement("size") != nullptr;
    const std::vector<double> s = has_size ? child_numbers(source, shape, "size", 2) : std::vector{1.0, 1.0};
    shapes.plane(place,
                 shape.FirstChildElement("normal") != nullptr ? lengths("normal") : Eigen::Vector3d::UnitZ(),
                 {s[0], s[1]});
  } else {
    return false;
  }
  return true;
}

bool add_polylines(const Source& source, const Element& geometry, LinkShapes& shapes,
                   const LinkShapes::Place& place) {
  const Element* const first = geometry.FirstChildElement("polyline");
  if (first == nullptr) return false;
  std::vector<Polyline> polylines;
  for (const Element* e = first; e != nullptr; e = e->NextSiblingElement("polyline")) {
    Polyline& path = polylines.emplace_back();
    for (const Element* p = e->FirstChildElement("point"); p != nullptr; p = p->NextSiblingElement("point")) {
      const std::vector<double> at = numbers(source, *p, 2, kLargestSize_m);
      path.emplace_back(at[0], at[1]);
    }
  }
  shapes.polylines(place, polylines, child_numbers(source, *first, "height", 1)[0], extruded_polylines);
  return true;
}

}  // namespace canyon::city::sdf
