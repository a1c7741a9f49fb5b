#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <utility>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/propagation/arrival.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::simulation {

/// Number of the interval of time that an instant is in: PropagationOptions::retrace_interval_s > 0, from
/// 1980 on.
[[nodiscard]] std::int64_t retrace_interval(const propagation::PropagationOptions& options,
                                            geodesy::GpsTime time);

/// The paths of one epoch, for the epochs that follow nearby.
struct SharedPaths {
  std::int64_t interval = 0;  ///< retrace_interval()
  Eigen::Vector3d antenna_enu;
  propagation::TracedPlace place;
};

/// Arrivals at an antenna, epoch after epoch: far paths are those of the first epoch in each interval of
/// time, and of each epoch that is too far from the last one with paths of its own
/// (propagation::PropagationOptions::retrace_interval_s).
class RetracedAntenna {
 public:
  explicit RetracedAntenna(propagation::Propagator propagator);

  /// An epoch and the paths that it shares; null where the propagator has no far paths.
  struct Epoch {
    geodesy::GpsTime time;
    Eigen::Vector3d antenna_enu;
    std::shared_ptr<SharedPaths> paths;
    bool first = true;  ///< the paths are found at this epoch
  };
  /// The next epoch. Not thread-safe.
  [[nodiscard]] Epoch next(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu);
  /// Its arrival. Thread-safe; the epoch that finds the paths comes before those that share them.
  /// @param environment which the propagator belongs to
  [[nodiscard]] propagation::Arrival arrival(const Environment& environment, const Epoch& epoch) const;
  /// Both.
  [[nodiscard]] propagation::Arrival arrival(const Environment& environment, geodesy::GpsTime time,
                                             const Eigen::Vector3d& antenna_enu) {
    return arrival(environment, next(time, antenna_enu));
  }
  /// The next epoch has paths of its own.
  void forget() { paths_.reset(); }

 private:
  propagation::Propagator propagator_;
  bool keeps_paths_;
  std::shared_ptr<SharedPaths> paths_;
};

}  // namespace canyon::simulation
