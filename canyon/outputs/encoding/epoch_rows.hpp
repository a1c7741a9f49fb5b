#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <span>

#include "canyon/outputs/encoding/view_tables.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"
#include "canyon/simulation/epoch.hpp"

namespace canyon::encoding {

/// Epochs of one receiver as rows of "canyon view 1" (docs/view-format.md).
class EpochRows {
 public:
  /// Position [m, ECEF] -> city's frame [m, east north up].
  using ToLocal = std::function<Eigen::Vector3d(const Eigen::Vector3d& ecef)>;

  /// @param signal of the receiver: the loss of a path is for its first signal
  /// @param paths_per_satellite maximum stored: the first (the direct one if it exists) and the strongest,
  /// without strength the shortest
  /// @param words texts of indices in the rows; several receivers may share them
  EpochRows(tracking::SignalOptions signal, std::size_t paths_per_satellite,
            std::shared_ptr<ViewWords> words = std::make_shared<ViewWords>());

  /// @param number of the epoch, @param time_s since the beginning of the view
  /// @param skyline row of the table skylines; -1: none
  /// @param satellites ascending; others are ignored. Rows refer to a satellite by its index there
  void add(const simulation::Epoch& epoch, std::size_t number, double time_s, int skyline,
           const ToLocal& local, std::span<const gnss::SatelliteId> satellites);

  /// Values that are not in an epoch. Positions are in the city's frame [m].
  struct ShownRow {
    double time_s = 0;  ///< since the beginning of the view
    int skyline = -1;
    Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d fix_m =
        Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< NaN: none
  };
  /// The parts of add(), for callers without complete epochs: an epoch without its satellites; a satellite by
  /// its `index` in the view's list; a path. `row` has the data for the table's columns.
  void add_epoch(const simulation::Epoch& epoch, const ShownRow& shown);
  void add_satellite(const Row& row, std::size_t number, std::size_t index, int flags, std::size_t paths);
  void add_path(const Row& row);

  /// Keeps the words.
  void clear();
  [[nodiscard]] ViewWords& words() { return *words_; }
  [[nodiscard]] const ViewWords& words() const { return *words_; }

  ViewRows epochs{kViewEpochs}, satellites{kViewSatellites}, paths{kViewPaths}, bodies{kViewBodies};

 private:
  std::size_t add_paths(Row row, const propagation::SatelliteView& view);

  tracking::SignalOptions signal_;
  std::size_t paths_per_satellite_;
  std::shared_ptr<ViewWords> words_;
};

}  // namespace canyon::encoding
