#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "canyon/paths/propagation/index/facets.hpp"

namespace canyon::propagation {

/// Convex parts of a set's facets, each of which hides a region from an antenna. Built once; const members
/// are thread-safe.
class Occluders {
 public:
  /// A cone with its apex at the antenna and one convex polygon as its section. Everything inside it beyond
  /// the polygon's plane is hidden. Inner sides are planes through the antenna: normal . x >= 0, x from the
  /// antenna.
  struct Hidden {
    std::array<Eigen::Vector3f, 4> side;  ///< unit, inwards; a triangle has its last one twice
    Eigen::Vector3f normal;               ///< of the polygon, towards the antenna
    float height;                         ///< of the antenna over its plane
  };
  /// Memory of hidden_regions().
  struct Scratch {
    std::vector<std::pair<float, std::uint32_t>> largest;
  };

  Occluders() = default;
  explicit Occluders(const FacetSet& set);

  /// Appends the regions behind the `count` facets of `facing` that cover most of the antenna's view (by area
  /// times cosine over squared distance). Polygons are shrunk by `margin_m` at their corners, so that rays
  /// that miss their edges by a rounding are not counted as hidden.
  void hidden_regions(const FacetSet& set, const FacingFacets& facing, const Eigen::Vector3d& antenna,
                      std::size_t count, double margin_m, Scratch& scratch, std::vector<Hidden>& out) const;

 private:
  /// FacetSet::convex_part() of a facet; its corners are recomputed when needed.
  struct Part {
    Eigen::Vector3d centre;
    float area;
  };
  std::vector<Part> parts_;  ///< one per facet
};

/// hidden[i] = 1 if facet i of `facing` is completely in one of the regions. Never hides a facet with a point
/// outside all of them; `hidden` has the padded length.
void mark_hidden(const FacingFacets& facing, const std::vector<Occluders::Hidden>& regions,
                 std::vector<std::uint8_t>& hidden);

/// Whether a sphere around `centre` (from the antenna) is completely in one of the regions.
[[nodiscard]] bool is_hidden(const Eigen::Vector3d& centre, double radius,
                             const std::vector<Occluders::Hidden>& regions);

}  // namespace canyon::propagation
