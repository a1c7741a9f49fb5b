#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "canyon/propagation/index/direction_bins.hpp"
#include "canyon/propagation/index/facets.hpp"

namespace canyon::propagation {

/// Directions that an antenna reaches by way of one mirror: rays from its image (the apex) through the mirror
/// (the window), bounded by a cone. In the frame of the facets that are asked for.
struct Beam {
  Eigen::Vector3d apex, axis;  ///< axis: unit
  double cosine, sine;         ///< of the half-angle, at most 90 deg
  Eigen::Vector3d window;      ///< unit, normal of the window's plane, along the rays
  double window_m;             ///< distance of that plane from the apex, > 0
  double reach_m;              ///< from the apex
};

/// The cone from `apex` about the facet's bounds, through the facet. `apex` is behind the facet (its front is
/// where the rays go) by `height_m` > 0.
[[nodiscard]] Beam make_beam(const Facet& facet, const Eigen::Vector3d& apex, double height_m,
                             double reach_m);

/// The facets of one set in spheres, for finding those that a beam may meet from their front. Structure of
/// arrays in floats about the set's centre. Made once; const members are thread-safe.
class BeamIndex {
 public:
  /// Blocks of facets (FacetSet::kBlock) about an antenna.
  struct Blocks {
    std::vector<std::uint32_t> block;  ///< not padded
    std::vector<float> x, y, z, radius;
    std::vector<std::uint8_t> marks;
  };

  BeamIndex() = default;
  explicit BeamIndex(const FacetSet& set);

  /// Of a sphere about all facets, in the set's frame. Nothing: radius 0.
  [[nodiscard]] const Eigen::Vector3d& centre() const { return centre_; }
  [[nodiscard]] double radius() const { return radius_; }

  /// The blocks that begin within `reach_m` of the antenna.
  void gather(const Eigen::Vector3d& antenna, double reach_m, Blocks& out) const;

  /// A facet and the directions (of one group of the bins) from which it may reflect into a beam.
  struct Match {
    std::uint32_t facet;
    std::uint32_t group;
    std::uint64_t directions;  ///< a bit each, never 0
  };

  /// Facets in `blocks` that may reflect from one of the directions, against the rays of the beam: their
  /// sphere meets the beam beyond its window and within its reach, the apex sees their front, and the
  /// direction lies, mirrored in the facet, in the narrower of the beam's cone and that about their sphere.
  /// Never misses one; those that only come close may be among them.
  /// @param bins directions in the outer frame
  /// @param outer_from_set turns this set's frame into that; null: they are the same
  void find(const Beam& beam, Blocks& blocks, const DirectionBins& bins,
            const Eigen::Isometry3d* outer_from_set, std::vector<Match>& out) const;

 private:
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double radius_ = 0;
  // Padded to whole blocks with facets that match nothing (radius -1e30).
  std::vector<float> x_, y_, z_, sphere_;  ///< centre and radius of each facet's sphere
  std::vector<float> normal_x_, normal_y_, normal_z_, offset_;
  std::vector<float> block_x_, block_y_, block_z_, block_radius_;
};

}  // namespace canyon::propagation
