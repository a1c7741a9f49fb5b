#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <span>

#include "canyon/propagation/arrival.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/tracking/signal_options.hpp"
#include "canyon/view/tables/chunk.hpp"

namespace canyon::output {

/// Epochs of one receiver as rows of "canyon view 1" (docs/view-format.md).
class EpochRows {
 public:
  /// Place [m, ECEF] -> city's frame [m, east north up].
  using ToLocal = std::function<Eigen::Vector3d(const Eigen::Vector3d& ecef)>;

  /// @param signal of the receiver: the loss of a path is its first signal's
  /// @param paths_per_satellite kept at most: the first (the direct one where there is one) and the
  /// strongest, without strength the shortest
  EpochRows(tracking::SignalOptions signal, std::size_t paths_per_satellite);

  /// @param number of the epoch, @param time_s since the begin of the view
  /// @param skyline row of the table skylines; -1: none
  /// @param satellites ascending; others are passed over. Rows name a satellite by its place there
  void add(const simulation::Epoch& epoch, std::size_t number, double time_s, int skyline,
           const ToLocal& local, std::span<const gnss::SatelliteId> satellites);

  void clear();

  view::Rows epochs{view::kEpochs}, satellites{view::kSatellites}, paths{view::kPaths}, bodies{view::kBodies};

 private:
  void add_epoch(const simulation::Epoch& epoch, double time_s, int skyline, const ToLocal& local);
  void add_bodies(const std::vector<propagation::Body>& about, std::size_t number);
  std::size_t add_paths(const receiver::SatelliteObservation& satellite,
                        const propagation::SatelliteView& view);

  tracking::SignalOptions signal_;
  std::size_t paths_per_satellite_;
};

}  // namespace canyon::output
