#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/run_receiver.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/heatmap/cells/cell_solver.hpp"
#include "canyon/studies/heatmap/cells/cell_values.hpp"

namespace canyon::heatmap {

/// Seed of the receiver of one draw at a time: the same at all cells.
[[nodiscard]] std::uint64_t seed_of(const DrawOptions& draws, geodesy::GpsTime time, int draw);

/// Errors from space of draws 0 to count - 1 at a time, each by its seed_of(); empty where the environment
/// has none.
[[nodiscard]] std::vector<errors::SpaceErrors> space_of_draws(const simulation::Environment& environment,
                                                              const DrawOptions& draws, geodesy::GpsTime time,
                                                              int count,
                                                              std::span<const gnss::SatelliteId> satellites);

/// The receivers of all draws of a map, which are run: at every place draw d of a time has the same seed, so
/// that maps are smooth and do not depend on tiles. They have run before (SignalLockOptions::warm_start) and
/// are at rest. Const, thread-safe.
class ReceiverDraws {
 public:
  /// The environment and the propagator must outlive it. Throws InputError for options that do not
  /// validate().
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
    return space_of_draws(*environment_, draws_, time, count, environment_->sky().satellites());
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
      geodesy::GpsTime time, const Eigen::Vector3d& place, const receiver::ReceiverOptions& options) const;

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

/// Layers of a tile by a receiver::Receiver for each cell and draw: for whatever needs CellMethod::Run.
/// Signals are those of simulation::Environment::arrival() at each cell. Const, thread-safe.
///
/// Values without noise are those of draw 0 of a receiver without errors from space that states C/N0 without
/// noise, whose satellites have no constant of their own and no shadow by what the map lacks and an empty
/// street, with the noise taken out of its pseudoranges (its mean stays) and solved by
/// positioning::solve_fix(): weights are what the receiver believes. Availability of signals with strength is
/// the share of draws that have a fix.
class CellReceivers final : public CellSolver {
 public:
  /// As ReceiverDraws. Throws InputError for limits that do not validate().
  CellReceivers(const simulation::Environment& environment, const propagation::Propagator& propagator,
                const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
                const LimitOptions& limits = {});

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& stop) const override;

 private:
  void solve_without_noise(const ReceiverDraws::Scene& scene, CellValues& values) const;
  /// @param space of each draw, or empty
  void draw(const ReceiverDraws::Scene& scene, std::span<const errors::SpaceErrors> space, bool statistics,
            CellValues& values) const;

  ReceiverDraws receivers_;
  LimitOptions limits_;
};

/// Layers of RTK: in each cell the receiver of each draw stands still, has tracked for long
/// (SignalLockOptions::warm_start) and knows all ephemerides. From the time of the map on it measures once a
/// second, with the corrections of a base, for LimitOptions::rtk_s. Satellites and paths move meanwhile. The
/// base measures the same sky: draw d of it and of every cell has the same errors from space. Corrections
/// come as relative::CorrectionOptions say. Const, thread-safe.
///
/// Some thousand times slower than one look: each second is traced, and each draw has a filter of its own.
class CellRtk final : public CellSolver {
 public:
  /// As ReceiverDraws. @param base with a fixed place, settled. Throws InputError for too many epochs of it.
  CellRtk(const simulation::Environment& environment, const propagation::Propagator& propagator,
          const simulation::ReceiverConfig& receiver, const simulation::ReceiverConfig& base,
          const DrawOptions& draws, const LimitOptions& limits);
  CellRtk(const CellRtk&) = delete;
  CellRtk& operator=(const CellRtk&) = delete;

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& stop) const override;

 private:
  using Corrections = std::shared_ptr<const relative::Corrections>;
  /// [second][draw]; null where the base measured nothing.
  [[nodiscard]] std::vector<std::vector<Corrections>> corrections(
      geodesy::GpsTime time, std::span<const errors::SpaceErrors> space) const;
  void solve_cell(geodesy::GpsTime time, const Eigen::Vector3d& place,
                  std::span<const errors::SpaceErrors> space, std::span<const std::vector<Corrections>> sent,
                  CellValues& values) const;

  propagation::Propagator base_propagator_;
  ReceiverDraws rovers_, bases_;
  geodesy::Geodetic base_place_;
  LimitOptions limits_;
};

}  // namespace canyon::heatmap
