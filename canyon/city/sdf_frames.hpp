#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <string_view>
#include <vector>

#include "canyon/city/gazebo_elements.hpp"

namespace canyon::city::sdf {

/// Poses of SDF files, of which each may be relative to another frame (SDFormat specification, "Pose Frame
/// Semantics" 1.7 and later).
class Frames {
 public:
  /// A world, a model, or <sdf> itself: names of frames count in it.
  struct Scope {
    const Source* source = nullptr;
    const Element* element = nullptr;
  };
  /// Finds the model of an <include>; its element is null where there is none.
  using Open = std::function<Scope(const Source& source, const Element& include)>;

  explicit Frames(Open open) : open_(std::move(open)) {}

  /// The pose of a link, model, include, frame or joint of a scope, in the scope's own frame. Throws
  /// InputError for a name that is not there, for frames that are relative to each other in a circle, and for
  /// numbers that are not a pose.
  [[nodiscard]] Eigen::Affine3d of_child(const Scope& scope, const Element& child);
  /// The same of a collision or visual of a link of a model.
  [[nodiscard]] Eigen::Affine3d of_shape(const Scope& model, const Element& link, const Element& shape);
  /// The numbers of an element's <pose>, whatever they are relative to; the identity without one.
  [[nodiscard]] static Eigen::Affine3d numbers_of(const Source& source, const Element& element);

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
