#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/positioning/position_filter.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/rtk/rtk_filter.hpp"

namespace canyon::receiver {

/// An epoch's measurements, as input of solvers.
struct SolverInput {
  std::vector<positioning::Measurement> codes, corrected;
  std::vector<rtk::SignalMeasurement> signal_entries;  ///< for the carrier-phase filter alone
};

/// A receiver's position from the measurements of its epochs: single-epoch fix, position filter, and
/// carrier-phase filter with a base. Stores the latest corrections and the filters' state.
class PositionSolver {
 public:
  /// @param options, models must outlive this
  PositionSolver(const ReceiverOptions& options, const UserModels& models);

  /// Resets the corrections and the state of the filters.
  void restart();
  /// Stores the corrections received with an epoch. @param sky the receiver's ephemerides
  void take(const EpochContext& context, const orbit::Sky& sky);
  /// Usable corrections of pseudoranges at a time; null: none.
  [[nodiscard]] const CodeCorrections* corrections(geodesy::GpsTime receiver_time) const;
  /// Whether SolverInput::signal_entries is needed.
  [[nodiscard]] bool uses_phases() const { return rtk_.has_value(); }
  /// The position of an epoch: of its corrected measurements if they have a solution, else of all.
  [[nodiscard]] positioning::Fix solve(geodesy::GpsTime receiver_time, const SolverInput& measured,
                                       const orbit::Sky& sky,
                                       const std::map<gnss::System, gnss::Klobuchar>& klobuchar);
  /// The solution of an epoch without any signal.
  [[nodiscard]] const positioning::Fix& without_signal();
  /// The latest epoch's solution by its measurements alone.
  [[nodiscard]] const positioning::Fix& epoch_fix() const { return epoch_fix_; }

 private:
  [[nodiscard]] positioning::Fix solve_alone(geodesy::GpsTime receiver_time,
                                             const std::vector<positioning::Measurement>& measurements,
                                             const orbit::Sky& sky,
                                             const std::map<gnss::System, gnss::Klobuchar>& klobuchar);

  const ReceiverOptions& options_;
  const UserModels& models_;
  positioning::FixOptions fix_;
  positioning::Fix epoch_fix_;
  std::vector<positioning::RangedSatellite> ranged_;     ///< of the latest solve_alone()
  Eigen::Vector3d last_ecef_ = Eigen::Vector3d::Zero();  ///< of the last single-epoch fix, start of the next
  CodeCorrections corrections_;
  std::optional<positioning::PositionFilter> filter_;
  std::optional<rtk::RtkFilter> rtk_;
};

}  // namespace canyon::receiver
