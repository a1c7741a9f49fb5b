#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/city/link_shapes.hpp"

/// Elements of SDF files.
namespace canyon::city::sdf {

using Element = tinyxml2::XMLElement;

/// One SDF file; elements stay valid as long as it lives.
struct Source {
  std::filesystem::path path;
  tinyxml2::XMLDocument document;

  [[nodiscard]] InputError error(const Element& at, std::string_view problem,
                                 std::string_view cure = {}) const {
    return InputError(path, at.GetLineNum(), problem, cure);
  }
};

/// The texts of an attribute, of an element and of its child; empty where there is none.
[[nodiscard]] std::string attribute(const Element& element, const char* name);
[[nodiscard]] std::string text_of(const Element& element);
[[nodiscard]] std::string child_text(const Element& element, const char* child);
[[nodiscard]] bool is_true(std::string_view word);

/// Exactly `count` numbers, each at most `largest`; throws InputError for others.
[[nodiscard]] std::vector<double> numbers(const Source& source, const Element& element, std::size_t count,
                                          double largest);

/// Adds a shape without a file; false for any other.
bool add_primitive(const Source& source, const Element& shape, LinkShapes& shapes,
                   const LinkShapes::Place& place);

/// Adds the polylines of a geometry, extruded to the height of the first; false where it has none.
bool add_polylines(const Source& source, const Element& geometry, LinkShapes& shapes,
                   const LinkShapes::Place& place);

}  // namespace canyon::city::sdf
