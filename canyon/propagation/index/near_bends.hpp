#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "canyon/propagation/index/edges.hpp"
#include "canyon/propagation/index/stay.hpp"

namespace canyon::propagation {

/// Remembers during a Stay which edges may bend which satellites. Never misses one that mark_diffracting()
/// marks; what is found must be verified, so that results do not depend on it. Of one set of edges and one
/// reach; its memory is that of the edges in one antenna's view.
class NearBends {
 public:
  /// Makes it hold for an antenna. @param near memory of the caller, replaced
  void hold(const EdgeSet& set, const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
            double reach_m, double clearance_m, NearEdges& near);
  /// Edges of the same set that may bend a satellite by at most `max_excess_m`; valid until the next call.
  [[nodiscard]] std::span<const std::uint32_t> of(const EdgeSet& set, std::uint32_t satellite,
                                                  double max_excess_m);

 private:
  /// An edge as it is seen from everywhere in the stay.
  struct Seen {
    std::uint32_t edge;
    Eigen::Vector3d foot;  ///< as in NearEdges
    double distance_m, low, high;
    double root_m;  ///< by how much the root of its excess may change [sqrt(m)]
  };
  struct Found {
    double max_excess_m = -1;
    std::vector<std::uint32_t> edges;
  };
  void see(const EdgeSet& set, double reach_m, double clearance_m, NearEdges& near);

  Stay stay_;
  std::vector<Seen> seen_;
  std::vector<Found> found_;  ///< by satellite
};

}  // namespace canyon::propagation
