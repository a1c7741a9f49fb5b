#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/receiver/receiver.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/receiver_surroundings.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/heatmap/cells/cell_solver.hpp"

namespace canyon::heatmap {

/// Seed of the receiver of one draw at a time: the same at all cells.
[[nodiscard]] std::uint64_t seed_of(const DrawOptions& draws, geodesy::GpsTime time, int draw);

/// Errors from space of draws 0 to count - 1 at a time, each by its seed_of(). @param errors null: none
[[nodiscard]] std::vector<errors::SpaceErrors> space_of_draws(const errors::SpaceErrors* errors,
                                                              const DrawOptions& draws, geodesy::GpsTime time,
                                                              int count,
                                                              std::span<const gnss::SatelliteId> satellites);

/// The receivers of all draws of a map, which are run: at every place draw d of a time has the same seed, so
/// that maps are smooth and do not depend on tiles. They have run before (SignalLockOptions::warm_start) and
/// are at rest. Const, thread-safe.
class ReceiverDraws {
 public:
  /// The environment and the propagator must outlive it.
  ReceiverDraws(const simulation::Environment& environment, const propagation::Propagator& propagator,
                const simulation::ReceiverConfig& receiver, const DrawOptions& draws);

  [[nodiscard]] const receiver::ReceiverOptions& options() const { return options_; }
  [[nodiscard]] const simulation::Environment& environment() const { return *environment_; }
  [[nodiscard]] int count() const { return draws_.draws; }
  [[nodiscard]] std::uint64_t seed(geodesy::GpsTime time, int draw) const {
    return seed_of(draws_, time, draw);
  }
  /// Errors from space of the first draws.
  [[nodiscard]] std::vector<errors::SpaceErrors> space(geodesy::GpsTime time, int count) const {
    return space_of_draws(environment_->errors().get(), draws_, time, count,
                          environment_->sky().satellites());
  }

  /// The disturbances that a receiver at a place meets. Each draw has a street of its own
  /// (ReceiverConfig::streets), as an antenna in one of its lanes sees it; its height over the road is that
  /// over the terrain.
  [[nodiscard]] std::vector<disturbance::DisturbanceSource> disturbances_at(
      const Eigen::Vector3d& place) const;
  /// The disturbances but the street.
  [[nodiscard]] const std::vector<disturbance::DisturbanceSource>& disturbances() const {
    return disturbances_;
  }
  /// The receivers of all draws of a time at a place.
  [[nodiscard]] std::vector<std::unique_ptr<receiver::Receiver>> receivers_at(
      geodesy::GpsTime time, const Eigen::Vector3d& place) const;

  /// An epoch at a place, before receivers disturb it.
  struct Scene {
    propagation::Antenna antenna;
    propagation::Arrival arrival;
  };
  [[nodiscard]] Scene look(geodesy::GpsTime now, const Eigen::Vector3d& place,
                           const Eigen::Vector3d& place_ecef) const;
  /// @param space of each draw; empty: the epoch has no errors from space
  receiver::ReceiverEpoch observe(receiver::Receiver& receiver, const Scene& scene,
                                  std::span<const errors::SpaceErrors> space, std::size_t draw,
                                  const relative::Corrections* corrections = nullptr) const;

 private:
  const simulation::Environment* environment_;
  const propagation::Propagator* propagator_;
  receiver::ReceiverOptions options_;
  std::vector<disturbance::DisturbanceSource> disturbances_;
  std::optional<disturbance::StreetsOptions> streets_;
  DrawOptions draws_;
};

}  // namespace canyon::heatmap
