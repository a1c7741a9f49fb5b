#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "canyon/paths/propagation/index/facets.hpp"

namespace canyon::propagation {

/// Convex parts of a set's facets, each able to prove that something is hidden from an antenna. Made once;
/// const members are thread-safe.
class Occluders {
 public:
  /// A cone with its apex at the antenna that ends at one convex polygon; what lies in it beyond the
  /// polygon's plane is hidden. Inner sides are planes through the antenna: normal . x >= 0, x from the
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

  /// Appends the regions behind the `count` facets of `facing` that take the most of the antenna's view (by
  /// area times cosine over squared distance). Polygons are made smaller by `margin_m` at their corners, so
  /// that rays that miss their edges by a rounding are not called hidden.
  void hidden_regions(const FacetSet& set, const FacingFacets& facing, const Eigen::Vector3d& antenna,
                      std::size_t count, double margin_m, Scratch& scratch, std::vector<Hidden>& out) const;

 private:
  /// FacetSet::convex_part() of a facet; its corners are computed again where they are needed.
  struct Part {
    Eigen::Vector3d centre;
    float area;
  };
  std::vector<Part> parts_;  ///< one per facet
};

/// hidden[i] = 1 where facet i of `facing` lies wholly in one of the regions. Never hides a facet with a
/// point outside all of them; `hidden` has the padded length.
void mark_hidden(const FacingFacets& facing, const std::vector<Occluders::Hidden>& regions,
                 std::vector<std::uint8_t>& hidden);

/// Whether a sphere about `centre` (from the antenna) lies wholly in one of the regions.
[[nodiscard]] bool is_hidden(const Eigen::Vector3d& centre, double radius,
                             const std::vector<Occluders::Hidden>& regions);

}  // namespace canyon::propagation
