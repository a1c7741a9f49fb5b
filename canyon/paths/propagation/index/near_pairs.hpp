#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "canyon/paths/propagation/index/antenna_cache.hpp"
#include "canyon/paths/propagation/index/beam_index.hpp"
#include "canyon/paths/propagation/index/direction_bins.hpp"
#include "canyon/paths/propagation/index/edges.hpp"
#include "canyon/paths/propagation/index/facets.hpp"

namespace canyon::propagation {

/// Cache, during a Stay, of the facets that may reflect satellites over a facet next to the antenna; each
/// facet is searched once. Never misses a facet that BeamIndex::find() needs. Results must be verified, so
/// that the cache does not change the paths. Of one set of facets and one reach; its memory is that of the
/// facets in one antenna's view.
class NearPairs {
 public:
  /// Updates the cache for an antenna.
  void hold(const FacetSet& set, const BeamIndex& beams, const Eigen::Vector3d& antenna,
            std::span<const Eigen::Vector3d> directions, double reach_m);
  /// Facets and directions behind a facet next to the antenna; empty if the facet is too near for the cache.
  /// Valid until the next call.
  struct Matches {
    bool held = false;
    std::span<const BeamIndex::Match> matches;
  };
  [[nodiscard]] Matches back_facets(std::uint32_t facet);

 private:
  /// Matches [begin, end).
  struct Entry {
    std::uint32_t facet = 0, begin = 0, end = 0;
  };

  const FacetSet* set_ = nullptr;
  const BeamIndex* beams_ = nullptr;
  double reach_m_ = 0;
  StationaryWindow stay_;
  DirectionBins bins_;
  BeamIndex::Blocks blocks_;
  std::vector<Entry> entries_;  ///< by facet
  std::vector<BeamIndex::Match> matches_, found_;
};

/// Cache, during a Stay, of the edges that may diffract each satellite. Never misses one that
/// mark_diffracting() marks. Results must be verified, so that the cache does not change the paths. Of one
/// set of edges and one reach; its memory is that of the edges in one antenna's view.
class NearBends {
 public:
  /// Updates the cache for an antenna.
  void hold(const EdgeSet& set, const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
            double reach_m, double clearance_m);
  /// Edges of that set that may diffract a satellite with at most `max_excess_m`; valid until the next call.
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t satellite, double max_excess_m);

 private:
  struct FoundPairs {
    double max_excess_m = -1;
    std::vector<std::uint32_t> edges;
  };
  void see(const EdgeSet& set, double reach_m, double clearance_m);

  StationaryWindow stay_;
  NearEdges near_;                 ///< for all antennas within the stay
  std::vector<float> root_m_;      ///< largest change of the root of an edge's excess [sqrt(m)]
  std::vector<FoundPairs> found_;  ///< by satellite
};

}  // namespace canyon::propagation
