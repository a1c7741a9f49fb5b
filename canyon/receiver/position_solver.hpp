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

/// Signs of spoofing in a receiver's own measurements; the truth is never used:
/// - its gain control gives way, but signals do not weaken with it, as they do amid noise (D. M. Akos,
///   Navigation 59(4), 2012): in a band, 10 log10(1 + interference / noise) is gain_db and more, and the mean
///   C/N0 is within half of that of its mean over a minute before;
/// - the fix's place, or clock, is off what its own velocity, or drift, says since the fix before, at most
///   5 s ago, by jump_m and more.
/// Interference beside a signal's main lobe but within the front end looks like the first; a slow pull-off
/// without much power shows in neither.
class SpoofingCheck {
 public:
  explicit SpoofingCheck(const SpoofingCheckOptions& options) : options_(options) {}

  /// Epochs in order of time. Each check counts for hold_s after it failed.
  [[nodiscard]] SpoofingState update(const ReceiverEpoch& epoch);

 private:
  struct Strength {
    double mean_dbhz = 0;
    geodesy::GpsTime time;
  };
  [[nodiscard]] bool gain_without_loss(const ReceiverEpoch& epoch);
  [[nodiscard]] bool jumped(const ReceiverEpoch& epoch) const;

  SpoofingCheckOptions options_;
  std::map<double, Strength> strengths_;  // by carrier
  std::optional<positioning::Fix> fix_;
  geodesy::GpsTime fix_time_;
  std::optional<geodesy::GpsTime> gain_failed_, jump_failed_;
};

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
                                             const std::map<gnss::System, gnss::Klobuchar>& klobuchar) const;

  const ReceiverOptions& options_;
  const OwnModels& models_;
  positioning::FixOptions fix_;
  positioning::Fix of_epoch_;
  Eigen::Vector3d last_ecef_ = Eigen::Vector3d::Zero();  ///< of the last epoch alone, where the next begins
  CodeCorrections corrections_;
  std::optional<positioning::PositionFilter> filter_;
  std::optional<relative::RtkFilter> rtk_;
};

}  // namespace canyon::receiver
