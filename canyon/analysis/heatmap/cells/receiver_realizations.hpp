#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/analysis/heatmap/cells/cell_solver.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_surroundings.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::heatmap {

/// Seed of the receiver of one realization at a time: the same at all cells.
[[nodiscard]] std::uint64_t seed_of(const MonteCarloOptions& monte_carlo, geodesy::GpsTime time, int draw);

/// Range errors of realizations 0 to count - 1 at a time, each by its seed_of(). @param errors null: none
[[nodiscard]] std::vector<sky::RangeErrorModel> range_errors_by_sample(
    const sky::RangeErrorModel* errors, const MonteCarloOptions& monte_carlo, geodesy::GpsTime time,
    int count, std::span<const gnss::SatelliteId> satellites);

/// The receivers of all realizations of a map, in time steps: at every point, realization d of a time has the
/// same seed, so that maps are smooth and do not depend on tiles. They have run before
/// (SignalLockOptions::warm_start) and are at rest. Const, thread-safe.
class ReceiverRealizations {
 public:
  /// The environment and the propagator must outlive it.
  ReceiverRealizations(const simulation::Environment& environment, const propagation::Propagator& propagator,
                       const simulation::ReceiverConfig& receiver, const MonteCarloOptions& monte_carlo);

  [[nodiscard]] const receiver::ReceiverOptions& options() const { return options_; }
  [[nodiscard]] const simulation::Environment& environment() const { return *environment_; }
  [[nodiscard]] int count() const { return samples_.samples; }
  [[nodiscard]] std::uint64_t seed(geodesy::GpsTime time, int draw) const {
    return seed_of(samples_, time, draw);
  }
  /// Range errors of the first realizations.
  [[nodiscard]] std::vector<sky::RangeErrorModel> space(geodesy::GpsTime time, int count) const {
    return range_errors_by_sample(environment_->errors().get(), samples_, time, count,
                                  environment_->sky().satellites());
  }

  /// Disturbances of a receiver at a point. Each realization has its own street (ReceiverConfig::streets),
  /// seen by an antenna in one of its lanes; its height over the road is that over the terrain.
  [[nodiscard]] std::vector<disturbance::DisturbanceSource> disturbances_at(
      const Eigen::Vector3d& point) const;
  /// The disturbances without the street.
  [[nodiscard]] const std::vector<disturbance::DisturbanceSource>& disturbances() const {
    return disturbances_;
  }
  /// The receivers of all realizations of a time at a point.
  [[nodiscard]] std::vector<std::unique_ptr<receiver::Receiver>> receivers_at(
      geodesy::GpsTime time, const Eigen::Vector3d& point) const;

  /// An epoch at a point, before receivers disturb it.
  struct Scene {
    propagation::Antenna antenna;
    propagation::Arrival arrival;
  };
  [[nodiscard]] Scene scene_at(geodesy::GpsTime now, const Eigen::Vector3d& point,
                               const Eigen::Vector3d& antenna_position_ecef) const;
  /// @param space by realization; empty: the epoch has no range errors
  receiver::ReceiverEpoch observe(receiver::Receiver& receiver, const Scene& scene,
                                  std::span<const sky::RangeErrorModel> space, std::size_t draw,
                                  const rtk::Corrections* corrections = nullptr) const;

 private:
  const simulation::Environment* environment_;
  const propagation::Propagator* propagator_;
  receiver::ReceiverOptions options_;
  std::vector<disturbance::DisturbanceSource> disturbances_;
  std::optional<disturbance::StreetsOptions> streets_;
  MonteCarloOptions samples_;
};

}  // namespace canyon::heatmap
