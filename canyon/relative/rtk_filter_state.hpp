#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "canyon/relative/baseline_state.hpp"
#include "canyon/relative/differences.hpp"
#include "canyon/relative/doppler_slips.hpp"
#include "canyon/relative/integer_least_squares.hpp"
#include "canyon/relative/rtk_filter.hpp"

namespace canyon::relative {

/// Weight of an epoch in the mean square of innovations.
inline constexpr double kSquaresWeight = 0.1;

/// One of RtkFilter's filters. An epoch goes through the steps of update(): rtk_filter.cpp has the epoch and
/// its answer, rtk_observations.cpp codes, phases and velocity, rtk_integers.cpp whole numbers.
struct RtkFilter::State {
  State(const RtkOptions& rtk, const positioning::FixOptions& fix, double longest_s)
      : options(rtk), masks(fix), max_age_s(longest_s) {
    options.validate();
  }
  void take(const Corrections& corrections, std::vector<ObservedMinusComputed> of_base);
  [[nodiscard]] std::optional<positioning::Fix> update(geodesy::GpsTime receiver_time,
                                                       std::span<const SignalMeasurement> rover,
                                                       const orbit::Sky& sky, const positioning::Fix& alone);

  // --- the epoch

  /// Moves the filter to `time`, or starts it; false where it cannot start.
  bool go_to(geodesy::GpsTime to, const positioning::Fix& alone);
  /// A first-order process: towards 0, its variance towards what it was before anything was known.
  void decay(Eigen::Index at, double time_s, std::optional<gnss::SatelliteId> of);
  /// The position's error into the position.
  void apply_position_error() {
    position += state.x.segment<3>(BaselineState::kPosition);
    state.x.segment<3>(BaselineState::kPosition).setZero();
  }
  /// Removes ambiguities of phases that slipped or were not measured for long.
  void remove_slipped();
  /// Removes ambiguities of satellites two of whose carriers moved apart.
  void compare_carriers();
  /// Deviations and states of ionosphere and troposphere for this baseline.
  void update_delays();

  // --- observations

  [[nodiscard]] SparseRow row_of(const BaselineState& of, const Difference& d, bool phase) const;
  /// Differences of a group by the distance of their innovation from the median, which becomes the clock.
  std::vector<std::size_t> ordered(BaselineState& of, const std::vector<std::size_t>& group,
                                   bool phase) const;
  void take_codes();
  /// How far phases less codes have moved from ambiguities since these started [m]: codes of some receivers
  /// jump by a millisecond and their phases do not. 0 where it is no more than what is not known of an
  /// ambiguity.
  [[nodiscard]] double code_jump_m(const std::vector<std::size_t>& group) const;
  void start_ambiguities(const std::vector<std::size_t>& group, double jump_m);
  void take_phases();
  void take_velocity(const positioning::Fix& alone);

  // --- whole numbers

  /// What a search for whole numbers found.
  struct Fixed {
    Eigen::Vector3d position_error = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double ratio = 0;
    bool accepted = false;
    double squares = 0;  // of residuals over their deviations, a sum
    int redundant = 0;   // how many of them
  };
  /// Sum of squares of phases' residuals at a state, each signal's clock estimated, over their variances.
  [[nodiscard]] double squares_of_residuals(std::span<const std::size_t> among,
                                            const Eigen::VectorXd& x) const;
  /// What the covariance of a fixed position is to be multiplied by. Of two antennas of a vehicle, which
  /// share all errors but those of loops and echoes: the mean square of residuals at the whole numbers, of
  /// the last epochs or of this one.
  double factor_of(const Fixed& fixed);
  /// Candidates by certainty of their phase, best first.
  [[nodiscard]] std::vector<std::size_t> candidates() const;
  /// Differences of two ambiguities of a signal, those of the less certain satellites first.
  struct Pairs {
    std::vector<std::size_t> among;   // differences; the last one of each signal is its reference
    std::vector<std::size_t> before;  // of each difference, how many pairs are of those before it
    std::vector<std::pair<Eigen::Index, Eigen::Index>> states;  // an ambiguity's and its reference's
    std::vector<std::pair<Slot*, Slot*>> slots;                 // likewise
    Eigen::VectorXd real;
    Eigen::MatrixXd covariance;
  };
  /// The last part of Pairs.
  struct Set {
    std::size_t begin = 0;  // its first difference
    std::size_t pairs = 0;
  };
  Pairs pairs_of(std::vector<std::size_t> among);
  /// Whether whole numbers are those of the last fixed position, as far as that had them, and that is most.
  [[nodiscard]] static bool are_kept(std::span<const std::pair<Slot*, Slot*>> slots,
                                     const Eigen::VectorXd& whole);
  void keep(std::span<const std::pair<Slot*, Slot*>> slots, const Eigen::VectorXd& whole);
  /// Among all; where that fails without GLONASS, as biases that are stated wrongly spoil it.
  std::optional<Fixed> find_integers();
  /// Among these, best first; where that fails among the more certain ones. Empty where they are too few.
  std::optional<Fixed> find_among(std::vector<std::size_t> among);
  /// What whole numbers of a set say.
  Fixed answer(const Pairs& pairs, const Set& set, const std::optional<IntegerSolution>& found);
  /// The answer at whole numbers that are accepted.
  void fix_at(const Pairs& pairs, const Set& set, const Eigen::VectorXd& whole, Fixed& fixed);

  // --- the answer

  /// What the filter's covariance lacks while its position follows from codes: their echoes last, and average
  /// out as slowly as the ambiguities grow old.
  [[nodiscard]] Eigen::Matrix3d covariance_of_echoes() const;
  [[nodiscard]] std::optional<positioning::Dop> dop_of(const std::vector<gnss::SatelliteId>& used,
                                                       const Eigen::Matrix3d& enu) const;
  /// Position, accuracy, baseline and velocity into a fix whose satellites are known.
  void state_answer(const std::optional<Fixed>& fixed, double age_s, positioning::Fix& fix);

  RtkOptions options;
  positioning::FixOptions masks;
  double max_age_s;
  bool started = false, astray = false;
  std::optional<geodesy::GpsTime> astray_since;
  geodesy::GpsTime time;
  double dt_s = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  BaselineState state;
  double squares = 1;                             // mean of normalised innovations' squares, of phases
  double code_squares = 1;                        // and of codes, 1 or more
  double fixed_squares = 0, fixed_redundant = 0;  // means of Fixed's
  Eigen::Matrix3d code_covariance = Eigen::Matrix3d::Zero();  // of the codes of the epoch alone
  int fixed_in_a_row = 0;
  double ionosphere_sigma_m = 0, troposphere_sigma_m = 0;
  DopplerSlips doppler_slips;

  Eigen::Vector3d base_place = Eigen::Vector3d::Zero();
  bool moving = false;
  geodesy::GpsTime base_time;  // by its clock
  std::optional<int> station;
  std::vector<ObservedMinusComputed> base;

  // Of the epoch in hand.
  std::vector<Difference> differences;
  Groups groups;
};

}  // namespace canyon::relative
