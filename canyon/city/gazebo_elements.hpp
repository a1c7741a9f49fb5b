#pragma once

#include <tinyxml2.h>
#include <Eigen/Geometry>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/city/link_shapes.hpp"

namespace canyon::city::sdf {

/// Elements of SDF files.
using Element = tinyxml2::XMLElement;

/// One SDF file; elements stay valid as long as it lives.
struct SdfFile {
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
[[nodiscard]] std::vector<double> numbers(const SdfFile& source, const Element& element, std::size_t count,
                                          double largest);

/// Adds a shape without a file; false for any other.
bool add_primitive(const SdfFile& source, const Element& shape, LinkShapes& shapes,
                   const LinkShapes::Place& place);

/// Adds the polylines of a geometry, extruded to the height of the first; false where it has none.
bool add_polylines(const SdfFile& source, const Element& geometry, LinkShapes& shapes,
                   const LinkShapes::Place& place);

/// Poses of SDF files, of which each may be relative to another frame (SDFormat specification, "Pose Frame
/// Semantics" 1.7 and later).
class Frames {
 public:
  /// A world, a model, or <sdf> itself: names of frames count in it.
  struct Scope {
    const SdfFile* source = nullptr;
    const Element* element = nullptr;
  };
  /// Finds the model of an <include>; its element is null where there is none.
  using Open = std::function<Scope(const SdfFile& source, const Element& include)>;

  explicit Frames(Open open) : open_(std::move(open)) {}

  /// The pose of a link, model, include, frame or joint of a scope, in the scope's own frame. Throws
  /// InputError for a name that is not there, for frames that are relative to each other in a circle, and for
  /// numbers that are not a pose.
  [[nodiscard]] Eigen::Affine3d of_child(const Scope& scope, const Element& child);
  /// The same of a collision or visual of a link of a model.
  [[nodiscard]] Eigen::Affine3d of_shape(const Scope& model, const Element& link, const Element& shape);
  /// The numbers of an element's <pose>, whatever they are relative to; the identity without one.
  [[nodiscard]] static Eigen::Affine3d numbers_of(const SdfFile& source, const Element& element);

 private:
  [[nodiscard]] Eigen::Affine3d named(const Scope& scope, std::string_view name, const Element& user,
                                      std::size_t depth);
  [[nodiscard]] Eigen::Affine3d resolved(const Scope& scope, const Element& child);
  /// The frame that a child's pose is relative to, in the scope's.
  [[nodiscard]] Eigen::Affine3d base_of(const Scope& scope, const Element& child);
  [[nodiscard]] std::string name_of(const Scope& scope, const Element& child) const;

  Open open_;
  std::vector<const Element*> open_frames_;  ///< those whose poses are being found
};

}  // namespace canyon::city::sdf
