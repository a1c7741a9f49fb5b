#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "canyon/paths/propagation/index/antenna_cache.hpp"
#include "canyon/paths/propagation/index/direction_bins.hpp"
#include "canyon/paths/propagation/index/facets.hpp"

namespace canyon::propagation {

/// Directions that an antenna reaches over one mirror: rays from its image (the apex) through the mirror (the
/// window), bounded by a cone and by the planes through the apex and the sides of a rectangle around the
/// mirror. In the frame of the facets that are searched. With radius_m > 0 it contains the rays from the
/// images of all antennas around the apex's.
struct Beam {
  Eigen::Vector3d apex, axis;           ///< axis: unit
  double radius_m = 0;                  ///< of a ball around all these images
  double cosine, sine;                  ///< of the half-angle, at most 90 deg
  Eigen::Vector3d window;               ///< unit, normal of the window's plane, along the rays
  double window_m;                      ///< distance of that plane from the apex, > 0
  double reach_m;                       ///< from the apex
  std::array<Eigen::Vector3d, 4> side;  ///< unit, normals of the four planes, inwards
  std::array<double, 4> side_m{};       ///< smallest distances from the apex along these
  /// Range of z of the rays that pass the mirror, in the outer frame.
  double low_z = -1, high_z = 1;
};

/// From `apex` around the facet's bounds, through the facet. `apex` is behind the facet (rays leave on its
/// front) by `height_m` > 0. @param antennas of the beam, around the one whose image is `apex`; their extent
/// along the facet's normal is less than height_m
[[nodiscard]] Beam make_beam(const Facet& facet, const Eigen::Vector3d& apex, double height_m, double reach_m,
                             const Surroundings& antennas = {});

/// Search index of one set's facets, by their front and a beam. Built once; const members are thread-safe.
/// A tree of three levels: eight adjacent facets, eight of these groups, and a list of those. Boxes are
/// compared with the planes of the beam, eight at a time, in floats relative to the set's centre. A vertical
/// mirror does not change the z of a ray, and a level one changes its sign. Each of these kinds has a tree of
/// its own, in which only directions with a z of the beam are searched, and walls only up to the distance at
/// which the flattest of these rays is above their top.
class BeamIndex {
 public:
  /// Axis-aligned: centres and halves of sizes.
  struct Boxes {
    std::vector<float> x, y, z, half_x, half_y, half_z;

    [[nodiscard]] std::size_t size() const { return x.size(); }
    void clear();
    void append(const Eigen::Vector3d& low, const Eigen::Vector3d& high);
    void append(const Boxes& from, std::size_t i);
    /// Pads to whole groups of eight, with boxes that match nothing.
    void pad();
  };

  /// Trees, by the effect of their facets on the z of a ray.
  static constexpr std::size_t kWalls = 0, kLevel = 1, kSloped = 2, kTrees = 3;

  /// The highest levels of the trees near an antenna, and the memory of a search.
  struct Blocks {
    std::vector<std::uint32_t> block;  ///< padded in each tree
    Boxes boxes;
    std::array<std::size_t, kTrees> end;  ///< of each tree in these
    std::vector<std::uint32_t> groups, next;
    std::vector<std::uint8_t> marks;
  };

  BeamIndex() = default;
  explicit BeamIndex(const FacetSet& set);

  /// The sphere about all facets, in the set's frame; radius 0 without facets.
  [[nodiscard]] const Eigen::Vector3d& centre() const { return centre_; }
  [[nodiscard]] double radius() const { return radius_; }

  /// The blocks with a point within `reach_m` of the antenna.
  void gather(const Eigen::Vector3d& antenna, double reach_m, Blocks& out) const;

  /// A facet and the directions (of one group of the bins) that it may reflect into a beam.
  struct Match {
    std::uint32_t facet;
    std::uint32_t group;
    std::uint64_t directions;  ///< one bit each, never 0
  };

  /// Facets in `blocks` that may reflect one of the directions, against the rays of the beam: their bounds
  /// meet the beam beyond its window and within its reach, the apex sees their front, and the mirrored
  /// direction is in the narrower of the beam's cone and the cone of their bounding sphere. Never misses one;
  /// near misses may be included.
  /// @param bins directions in the outer frame
  /// @param outer_from_set rotates this set's frame into the outer one; null: the frames are equal
  /// @param spread also finds facets that reflect from within this chord of a direction
  void find(const Beam& beam, Blocks& blocks, const DirectionBins& bins,
            const Eigen::Isometry3d* outer_from_set, std::vector<Match>& out, double spread = 0) const;

 private:
  struct Query;
  void append(const FacetSet& set, std::vector<std::uint32_t> facets);
  void find(const Query& query, Blocks& blocks, std::size_t tree, std::vector<Match>& out) const;

  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double radius_ = 0;
  Boxes facets_, eights_, blocks_;          ///< each level padded to whole groups of the next
  std::array<std::size_t, kTrees> end_{};   ///< of each tree in blocks_
  std::vector<std::uint32_t> facet_;        ///< number in the set, of each of facets_
  std::vector<std::array<float, 5>> skin_;  ///< of each: normal, offset, radius of the sphere about the box
};

}  // namespace canyon::propagation
