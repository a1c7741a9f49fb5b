#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace canyon::buildings {

/// A surface of a building in its frame [m].
struct LocalSurface {
  std::vector<Eigen::Vector3d> outer;
  std::vector<std::vector<Eigen::Vector3d>> inners;
  std::string semantic;
};

/// Repairs a surface whose rings cross themselves or each other, or touch along edges, by repair() in its
/// plane. The result may be empty.
[[nodiscard]] std::vector<LocalSurface> mended(const LocalSurface& surface);

/// Takes windows and doors (by their semantics) out of the surfaces that they lie in, so that nothing is
/// there twice: many files draw them on walls without a hole. They lie in a surface where they are within 5
/// cm of its plane and half of their area is inside. A surface may become several, or none.
void cut_openings(std::vector<LocalSurface>& surfaces);

}  // namespace canyon::buildings
