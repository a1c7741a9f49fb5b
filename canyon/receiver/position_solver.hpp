#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/positioning/position_filter.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/relative/rtk_filter.hpp"

namespace canyon::receiver {

/// An epoch's measurements as solvers take them.
struct Solvable {
  std::vector<positioning::Measurement> codes, corrected;
  std::vector<relative::SignalMeasurement> of_signals;  ///< for the filter of phases alone
};

/// A receiver's position from the measurements of its epochs: the epoch's alone, the position filter, and
/// the filter of phases with a base. Remembers the latest corrections and the filters' state.
class PositionSolver {
 public:
  /// @param options, models must outlive this
  PositionSolver(const ReceiverOptions& options, const OwnModels& models);

  /// Forgets the corrections and the state of the filters.
  void restart();
  /// Takes the corrections that came with an epoch. @param sky the receiver's ephemerides
  void take(const EpochContext& context, const orbit::Sky& sky);
  /// Corrections of pseudoranges that may be used at a time; null: none.
  [[nodiscard]] const CodeCorrections* corrections(geodesy::GpsTime receiver_time) const;
  /// Whether Solvable::of_signals is needed.
  [[nodiscard]] bool uses_phases() const { return rtk_.has_value(); }
  /// The position of an epoch: of its corrected measurements where they have a solution, else of all.
  [[nodiscard]] positioning::Fix solve(geodesy::GpsTime receiver_time, const Solvable& measured,
                                       const orbit::Sky& sky,
                                       const std::map<gnss::System, gnss::Klobuchar>& klobuchar);
  /// The solution of an epoch whose antenna receives nothing.
  [[nodiscard]] const positioning::Fix& without_signal();
  /// The latest epoch's solution by its measurements alone.
  [[nodiscard]] const positioning::Fix& of_epoch() const { return of_epoch_; }

 private:
  [[nodiscard]] positioning::Fix solve_alone(geodesy::GpsTime receiver_time,
                                             const std::vector<positioning::Measurement>& measurements,
                                             const orbit::Sky& sky,
                                             const std::map<gnss::System, gnss::Klobuchar>& klobuchar);

  const ReceiverOptions& options_;
  const OwnModels& models_;
  positioning::FixOptions fix_;
  positioning::Fix of_epoch_;
  std::vector<positioning::RangedSatellite> ranged_;     ///< of the latest solve_alone()
  Eigen::Vector3d last_ecef_ = Eigen::Vector3d::Zero();  ///< of the last epoch alone, where the next begins
  CodeCorrections corrections_;
  std::optional<positioning::PositionFilter> filter_;
  std::optional<relative::RtkFilter> rtk_;
};

}  // namespace canyon::receiver
