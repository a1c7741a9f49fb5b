#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/rtk/ambiguity_search.hpp"
#include "canyon/receiver/rtk/baseline_state.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/receiver/rtk/observed_minus_computed.hpp"
#include "canyon/receiver/rtk/recorded_pair.hpp"
#include "canyon/receiver/rtk/rtk_filter.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::rtk {

/// Signals of a satellite are adjacent. For each signal, the indices of its differences.
using Groups = std::map<const gnss::Signal*, std::vector<std::size_t>>;

/// A Kalman filter of one baseline: position, velocity, ambiguities and delays from differences of rover and
/// base, and integer ambiguities (equations: RtkFilter). Epochs in order of time; copies are independent.
class BaselineFilter {
 public:
  /// @param masks elevation and C/N0 masks @param max_age_s largest age of the base's epoch [s]. Throws
  /// InputError for options out of range.
  BaselineFilter(const RtkOptions& options, const positioning::FixOptions& masks, double max_age_s);
  /// Replaces the base's epoch. @param base_measurements its observations, with values computed at its
  /// position
  void take(const Corrections& corrections, std::vector<ObservedMinusComputed> base_measurements);
  /// The result of RtkFilter::update(), for this filter alone.
  [[nodiscard]] std::optional<positioning::Fix> update(geodesy::GpsTime receiver_time,
                                                       std::span<const SignalMeasurement> rover,
                                                       const orbit::Sky& sky, const positioning::Fix& alone);
  /// The next epoch starts from its fix without phases.
  void restart() { started_ = false; }
  /// Number of successive epochs with fixed integers, up to the last one.
  [[nodiscard]] int consecutive_fixed_epochs() const { return fixed_in_a_row_; }
  [[nodiscard]] const RtkOptions& options() const { return options_; }
  [[nodiscard]] const positioning::FixOptions& masks() const { return masks_; }
  [[nodiscard]] double max_age_s() const { return max_age_s_; }

 private:
  /// Moves the filter to `to`, or starts it; returns false if it cannot start.
  bool go_to(geodesy::GpsTime to, const positioning::Fix& alone);
  /// The epoch's result from that state.
  [[nodiscard]] std::optional<positioning::Fix> solve(geodesy::GpsTime receiver_time,
                                                      std::span<const SignalMeasurement> rover,
                                                      const orbit::Sky& sky, const positioning::Fix& alone);
  /// First-order process: decays towards 0, and its variance towards the initial one.
  void decay(Eigen::Index at, double time_s, std::optional<gnss::SatelliteId> of);
  /// Moves the estimated position error into the position; the error is then 0.
  void apply_position_error() {
    position_ += state_.x.segment<3>(BaselineState::kPosition);
    state_.x.segment<3>(BaselineState::kPosition).setZero();
  }
  /// Removes ambiguities of phases that slipped or have not been measured for long.
  void remove_slipped();
  /// Removes ambiguities of satellites whose carriers moved apart.
  void compare_carriers();
  /// Sets deviations and states of ionosphere and troposphere for this baseline.
  void update_delays();
  [[nodiscard]] bool has_ionosphere() const { return ionosphere_sigma_m_ > 0; }

  // --- observations

  /// Differences of a group, sorted by distance of their innovation from the median, which becomes the clock.
  std::vector<std::size_t> ordered(const std::vector<std::size_t>& group, bool phase);
  void take_codes();
  /// Movement of phases minus codes since the start of their ambiguities [m]: codes of some receivers jump by
  /// a millisecond and their phases do not. 0 if it is within the uncertainty of an ambiguity.
  [[nodiscard]] double code_jump_m(const std::vector<std::size_t>& group) const;
  void start_ambiguities(const std::vector<std::size_t>& group, double jump_m);
  void take_phases();
  void take_velocity(const positioning::Fix& alone);

  // --- the result

  /// Factor on the covariance of a fixed position. For two antennas of a vehicle, which have all errors in
  /// common except those of loops and echoes: the mean square of residuals at the fixed integers, of the last
  /// epochs or of this one.
  double factor_of(const AmbiguitySolution& fixed);
  /// Covariance that the filter lacks while its position is determined by codes: their echoes are correlated,
  /// and average out only over the age of the ambiguities.
  [[nodiscard]] Eigen::Matrix3d covariance_of_echoes() const;
  [[nodiscard]] std::optional<positioning::Dop> dop_of(const std::vector<gnss::SatelliteId>& used,
                                                       const Eigen::Matrix3d& enu) const;
  /// Sets position, accuracy, baseline and velocity of a fix whose satellites are known.
  void state_answer(const std::optional<AmbiguitySolution>& fixed, double age_s, positioning::Fix& fix);

  RtkOptions options_;
  positioning::FixOptions masks_;
  double max_age_s_;
  bool started_ = false, astray_ = false;
  bool begins_ = false;  ///< the epoch's position is that of a fix without phases
  std::optional<geodesy::GpsTime> astray_since_;
  geodesy::GpsTime time_;
  double dt_s_ = 0;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  BaselineState state_;
  double squares_ = 1;                              // mean of normalised innovations' squares, of phases
  double code_squares_ = 1;                         // and of codes, 1 or more
  double fixed_squares_ = 0, fixed_redundant_ = 0;  // means of those of AmbiguitySolution
  Eigen::Matrix3d code_covariance_ = Eigen::Matrix3d::Zero();  // of the codes of the epoch alone
  int fixed_in_a_row_ = 0;
  double ionosphere_sigma_m_ = 0, troposphere_sigma_m_ = 0;
  DopplerSlips doppler_slips_;

  Eigen::Vector3d base_position_ = Eigen::Vector3d::Zero();
  bool moving_ = false;
  geodesy::GpsTime base_time_;  // by its clock
  std::optional<int> station_;
  std::vector<ObservedMinusComputed> base_;

  // The epoch's own data.
  std::vector<Difference> differences_;
  Groups groups_;
};

}  // namespace canyon::rtk
