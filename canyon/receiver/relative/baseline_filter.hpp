#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/relative/baseline_state.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/receiver/relative/observed_minus_computed.hpp"
#include "canyon/receiver/relative/recorded_pair.hpp"
#include "canyon/receiver/relative/rtk_filter.hpp"
#include "canyon/receiver/relative/whole_numbers.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::relative {

/// A satellite's signals are together; those of one signal, by their places among the differences.
using Groups = std::map<const gnss::Signal*, std::vector<std::size_t>>;

/// Differences of all signals that both measured; they refer to `rover`. `base` is in the order of before().
/// @param age_s of the base's epoch
[[nodiscard]] std::vector<Difference> differences_of(std::span<const ObservedMinusComputed> rover,
                                                     std::span<const ObservedMinusComputed> base,
                                                     double age_s);
/// Without signals of one satellite, which determine nothing but their clock.
[[nodiscard]] Groups groups_of(const std::vector<Difference>& differences);

/// A Kalman filter of one baseline: position, velocity, ambiguities and delays from differences of rover and
/// base, and whole numbers of cycles. RtkFilter's doc comment has the equations. Epochs in order of time;
/// copies go on alone.
class BaselineFilter {
 public:
  /// @param masks elevation and C/N0 masks @param max_age_s of a base's epoch that is used [s]. Throws
  /// InputError for options out of range.
  BaselineFilter(const RtkOptions& options, const positioning::FixOptions& masks, double max_age_s);
  /// The base's epoch, in the place of the one before. @param of_base its observations, as computed at its
  /// place
  void take(const Corrections& corrections, std::vector<ObservedMinusComputed> of_base);
  /// The answer of RtkFilter::update(), of this filter alone.
  [[nodiscard]] std::optional<positioning::Fix> update(geodesy::GpsTime receiver_time,
                                                       std::span<const SignalMeasurement> rover,
                                                       const orbit::Sky& sky, const positioning::Fix& alone);
  /// The next epoch begins from its fix without phases.
  void restart() { started_ = false; }
  /// Epochs up to the last one whose whole numbers were found one after the other.
  [[nodiscard]] int fixed_in_a_row() const { return fixed_in_a_row_; }
  [[nodiscard]] const RtkOptions& options() const { return options_; }
  [[nodiscard]] const positioning::FixOptions& masks() const { return masks_; }
  [[nodiscard]] double max_age_s() const { return max_age_s_; }

 private:
  /// Moves the filter to `to`, or starts it; false where it cannot start.
  bool go_to(geodesy::GpsTime to, const positioning::Fix& alone);
  /// The epoch's answer from there.
  [[nodiscard]] std::optional<positioning::Fix> solve(geodesy::GpsTime receiver_time,
                                                      std::span<const SignalMeasurement> rover,
                                                      const orbit::Sky& sky, const positioning::Fix& alone);
  /// A first-order process: towards 0, its variance towards what it was before anything was known.
  void decay(Eigen::Index at, double time_s, std::optional<gnss::SatelliteId> of);
  /// Moves the position by its estimated error, which is 0 then.
  void apply_position_error() {
    position_ += state_.x.segment<3>(BaselineState::kPosition);
    state_.x.segment<3>(BaselineState::kPosition).setZero();
  }
  /// Removes ambiguities of phases that slipped or were not measured for long.
  void remove_slipped();
  /// Removes ambiguities of satellites two of whose carriers moved apart.
  void compare_carriers();
  /// Deviations and states of ionosphere and troposphere for this baseline.
  void update_delays();
  [[nodiscard]] bool has_ionosphere() const { return ionosphere_sigma_m_ > 0; }

  // --- observations

  /// Differences of a group by the distance of their innovation from the median, which becomes the clock.
  std::vector<std::size_t> ordered(const std::vector<std::size_t>& group, bool phase);
  void take_codes();
  /// Movement of phases less codes from ambiguities since these started [m]: codes of some receivers
  /// jump by a millisecond and their phases do not. 0 where it is no more than what is not known of an
  /// ambiguity.
  [[nodiscard]] double code_jump_m(const std::vector<std::size_t>& group) const;
  void start_ambiguities(const std::vector<std::size_t>& group, double jump_m);
  void take_phases();
  void take_velocity(const positioning::Fix& alone);

  // --- the answer

  /// Factor on the covariance of a fixed position. For two antennas of a vehicle, which
  /// share all errors but those of loops and echoes: the mean square of residuals at the whole numbers, of
  /// the last epochs or of this one.
  double factor_of(const WholeNumbers& fixed);
  /// Covariance that the filter lacks while its position follows from codes: their echoes last, and average
  /// out as slowly as the ambiguities grow old.
  [[nodiscard]] Eigen::Matrix3d covariance_of_echoes() const;
  [[nodiscard]] std::optional<positioning::Dop> dop_of(const std::vector<gnss::SatelliteId>& used,
                                                       const Eigen::Matrix3d& enu) const;
  /// Position, accuracy, baseline and velocity into a fix whose satellites are known.
  void state_answer(const std::optional<WholeNumbers>& fixed, double age_s, positioning::Fix& fix);

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
  double fixed_squares_ = 0, fixed_redundant_ = 0;  // means of WholeNumbers'
  Eigen::Matrix3d code_covariance_ = Eigen::Matrix3d::Zero();  // of the codes of the epoch alone
  int fixed_in_a_row_ = 0;
  double ionosphere_sigma_m_ = 0, troposphere_sigma_m_ = 0;
  DopplerSlips doppler_slips_;

  Eigen::Vector3d base_place_ = Eigen::Vector3d::Zero();
  bool moving_ = false;
  geodesy::GpsTime base_time_;  // by its clock
  std::optional<int> station_;
  std::vector<ObservedMinusComputed> base_;

  // The epoch's own data.
  std::vector<Difference> differences_;
  Groups groups_;
};

}  // namespace canyon::relative
