#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/propagation/arrival.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::simulation {

/// Number of the interval of time that an instant is in: PropagationOptions::retrace_interval_s > 0, from
/// 1980 on.
[[nodiscard]] std::int64_t retrace_interval(const propagation::PropagationOptions& options,
                                            geodesy::GpsTime time);

/// Whether far paths that were found at one place serve at another in the same interval.
[[nodiscard]] bool is_near(const propagation::PropagationOptions& options, const Eigen::Vector3d& place_enu,
                           const Eigen::Vector3d& antenna_enu);

/// Arrivals at an antenna, epoch after epoch: far paths are those of the first epoch in each interval of
/// time, and of each epoch that is too far from the last one with paths of its own
/// (propagation::PropagationOptions::retrace_interval_s). Not thread-safe.
class RetracedAntenna {
 public:
  explicit RetracedAntenna(propagation::Propagator propagator) : propagator_(std::move(propagator)) {}

  /// @param environment which the propagator belongs to
  [[nodiscard]] propagation::Arrival arrival(const Environment& environment, geodesy::GpsTime time,
                                             const Eigen::Vector3d& antenna_enu);
  /// The next epoch has paths of its own.
  void forget() { kept_.reset(); }

 private:
  struct Kept {
    std::int64_t interval;
    Eigen::Vector3d antenna_enu;
    propagation::TracedPlace place;
  };
  propagation::Propagator propagator_;
  std::optional<Kept> kept_;
};

/// The same arrivals for a run whose epochs are made in any order by many threads.
class RetracedRun {
 public:
  using Places = std::function<Eigen::Vector3d(std::size_t receiver, std::size_t instant)>;
  using Instants = std::function<geodesy::GpsTime(std::size_t instant)>;

  /// The references must outlive it. @param propagators of each receiver @param count of the instants
  /// @param places of antennas in the city's frame
  RetracedRun(const Environment& environment, const std::vector<propagation::Propagator>& propagators,
              std::size_t count, Instants instants, Places places);
  ~RetracedRun();

  /// Thread-safe; each once.
  [[nodiscard]] propagation::Arrival arrival(std::size_t receiver, std::size_t instant);
  /// No epoch before this instant is asked for any more. Thread-safe.
  void forget_before(std::size_t instant);

 private:
  struct Interval;
  [[nodiscard]] std::shared_ptr<Interval> interval(std::size_t receiver, std::size_t instant);

  const Environment& environment_;
  const std::vector<propagation::Propagator>& propagators_;
  std::size_t count_;
  Instants instants_;
  Places places_;
  std::mutex mutex_;
  std::map<std::pair<std::size_t, std::size_t>, std::shared_ptr<Interval>> intervals_;  // by end, receiver
};

}  // namespace canyon::simulation
