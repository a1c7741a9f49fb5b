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

/// One SDF file; elements are valid during its lifetime.
struct SdfFile {
  std::filesystem::path path;
  tinyxml2::XMLDocument document;

  [[nodiscard]] InputError error(const Element& at, std::string_view problem,
                                 std::string_view hint = {}) const {
    return InputError(path, at.GetLineNum(), problem, hint);
  }
};

/// The texts of an attribute, of an element and of its child; empty if there is none.
[[nodiscard]] std::string attribute(const Element& element, const char* name);
[[nodiscard]] std::string text_of(const Element& element);
[[nodiscard]] std::string child_text(const Element& element, const char* child);
[[nodiscard]] bool is_true(std::string_view word);

/// Exactly `count` numbers of at most `largest`; throws InputError otherwise.
[[nodiscard]] std::vector<double> numbers(const SdfFile& source, const Element& element, std::size_t count,
                                          double largest);

/// Adds a shape that needs no file; false for any other.
bool add_primitive(const SdfFile& source, const Element& shape, LinkShapes& shapes,
                   const LinkShapes::ShapePose& location);

/// Adds the polylines of a geometry, extruded to the height of the first; false if it has none.
bool add_polylines(const SdfFile& source, const Element& geometry, LinkShapes& shapes,
                   const LinkShapes::ShapePose& location);

/// Poses of SDF files; each may be relative to another frame (SDFormat specification, "Pose Frame Semantics"
/// 1.7 and later).
class Frames {
 public:
  /// A world, a model, or <sdf> itself: the scope of frame names.
  struct Scope {
    const SdfFile* source = nullptr;
    const Element* element = nullptr;
  };
  /// Opens the model of an <include>; its element is null if there is none.
  using Open = std::function<Scope(const SdfFile& source, const Element& include)>;

  explicit Frames(Open open) : open_(std::move(open)) {}

  /// The pose of a link, model, include, frame or joint of a scope, in the scope's own frame. Throws
  /// InputError for an unknown name, for a cycle of frames, and for numbers that are not a pose.
  [[nodiscard]] Eigen::Affine3d child_pose(const Scope& scope, const Element& child);
  /// The same for a collision or visual of a link of a model.
  [[nodiscard]] Eigen::Affine3d shape_pose(const Scope& model, const Element& link, const Element& shape);
  /// The numbers of an element's <pose>, ignoring relative_to; the identity without a pose.
  [[nodiscard]] static Eigen::Affine3d numbers_of(const SdfFile& source, const Element& element);

 private:
  [[nodiscard]] Eigen::Affine3d named(const Scope& scope, std::string_view name, const Element& user,
                                      std::size_t depth);
  [[nodiscard]] Eigen::Affine3d resolved(const Scope& scope, const Element& child);
  /// The frame that a child's pose is relative to, in the scope's frame.
  [[nodiscard]] Eigen::Affine3d base_of(const Scope& scope, const Element& child);
  [[nodiscard]] std::string name_of(const Scope& scope, const Element& child) const;

  Open open_;
  std::vector<const Element*> open_frames_;  ///< frames whose poses are being resolved
};

}  // namespace canyon::city::sdf
