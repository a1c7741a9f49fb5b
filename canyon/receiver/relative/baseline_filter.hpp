#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/receiver/relative/integer_least_squares.hpp"
#include "canyon/receiver/relative/observed_minus_computed.hpp"
#include "canyon/receiver/relative/recorded_pair.hpp"
#include "canyon/receiver/relative/rtk_filter.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::relative {

/// A number that the filter estimates beside position, velocity and clock.
struct Slot {
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;  ///< of an ambiguity [cycles]; null: the ionosphere's difference [m]
  geodesy::GpsTime begun, seen;
  std::optional<geodesy::GpsTime> rover_since, base_since;  ///< since when the phases are continuous
  bool half_cycle = false;
  int epochs = 0;      ///< that its phase was taken
  double phase_m = 0;  ///< difference of the phases at the epoch before
  /// Its whole number in the last fixed position, from an origin that its signal's ambiguities share.
  std::optional<double> whole{};
};

/// Gradient of an observation that is not zero at few states.
struct SparseRow {
  std::array<std::pair<Eigen::Index, double>, 8> terms{};
  std::size_t count = 0;
  void add(Eigen::Index state, double gradient) { terms[count++] = {state, gradient}; }
};

/// State and covariance of RtkFilter: error of position, velocity, clock, zenith delay, then slots.
class BaselineState {
 public:
  static constexpr Eigen::Index kPosition = 0, kVelocity = 3, kClock = 6, kZenith = 7, kFirstSlot = 8;

  Eigen::VectorXd x = Eigen::VectorXd::Zero(kFirstSlot);
  Eigen::MatrixXd p = Eigen::MatrixXd::Zero(kFirstSlot, kFirstSlot);
  std::vector<Slot> slots;

  [[nodiscard]] static Eigen::Index index(std::size_t slot) {
    return kFirstSlot + static_cast<Eigen::Index>(slot);
  }
  /// The place of a satellite's ambiguity, or with a null signal of its ionosphere.
  [[nodiscard]] std::optional<std::size_t> find(gnss::SatelliteId id, const gnss::Signal* signal) const;
  /// A new slot, independent of everything else. Returns its place.
  std::size_t add(const Slot& slot, double value, double variance);
  void remove(std::size_t slot);
  /// Makes a state independent of everything else.
  void reset(Eigen::Index state, double value, double variance);
  /// Position and velocity over dt_s [s], with white accelerations; position error is 0 before.
  void move(double dt_s, const Eigen::Matrix3d& acceleration_density_squared);

  /// Innovation of an observation of `value`, and its variance.
  struct Innovation {
    double value = 0, variance = 0;
    [[nodiscard]] double normalised() const;
  };
  /// Reads the lower triangle of `p`.
  [[nodiscard]] Innovation innovation(const SparseRow& row, double value, double variance) const;
  /// Takes it, into the lower triangle of `p` alone: call mirror() behind the last of several.
  void take(const SparseRow& row, double value, double variance);
  /// The lower triangle of `p` into the upper one.
  void mirror();

 private:
  Eigen::VectorXd gain_;  // kept for its memory
};

/// Rover minus base, of one signal.
struct Difference {
  const ObservedMinusComputed* rover = nullptr;
  double code_m = 0, phase_m = 0;
  double variance = 0;      // of the phase [m^2]; code's is that times the square of the ratio
  double age_variance = 0;  // of both [m^2]
  std::optional<geodesy::GpsTime> base_since;
  bool has_phase = false, half_cycle = false, aligned = true;
  // The filter sets these.
  std::optional<std::size_t> slot;
  bool used = false;      // phase
  bool trusted = false;   // within the gate
  double residual_m = 0;  // after the epoch

  [[nodiscard]] gnss::SatelliteId id() const { return rover->id; }
  /// Ratio of the ionosphere's delay at this carrier to that at L1.
  [[nodiscard]] double ionosphere_rate() const;
};

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
///
/// baseline_filter.cpp has the epoch and its answer, rtk_observations.cpp codes, phases and velocity,
/// rtk_integers.cpp the whole numbers.
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

  // --- observations

  [[nodiscard]] SparseRow row_of(const Difference& d, bool phase) const;
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

  // --- whole numbers

  /// Result of a search for whole numbers.
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
  /// Factor on the covariance of a fixed position. For two antennas of a vehicle, which
  /// share all errors but those of loops and echoes: the mean square of residuals at the whole numbers, of
  /// the last epochs or of this one.
  double factor_of(const Fixed& fixed);
  /// Candidates by certainty of their phase, best first.
  [[nodiscard]] std::vector<std::size_t> candidates() const;
  /// Places of two ambiguities of a signal among the state's slots; the second is the signal's reference.
  using SlotPair = std::pair<std::size_t, std::size_t>;
  /// Differences of two ambiguities of a signal, those of the less certain satellites first.
  struct Pairs {
    std::vector<std::size_t> among;   // differences; the last one of each signal is its reference
    std::vector<std::size_t> before;  // of each difference, how many pairs are of those before it
    std::vector<SlotPair> slots;      // an ambiguity's and its reference's
    Eigen::VectorXd real;
    /// With what an error of the position by echoes of codes does to all ambiguities at once: the filter
    /// lacks it, so that it is sure of wrong numbers.
    Eigen::MatrixXd covariance;
    Eigen::Matrix3d echoes;      // covariance of that error
    Eigen::Matrix3Xd gradients;  // of the ambiguities by it [cycles/m]
  };
  /// The last part of Pairs.
  struct Set {
    std::size_t begin = 0;  // its first difference
    std::size_t pairs = 0;
  };
  /// Whole numbers of an epoch that pass, and that the epoch before did not find.
  struct Unconfirmed {
    std::vector<SlotPair> slots;
    Eigen::VectorXd whole;
  };
  Pairs pairs_of(std::vector<std::size_t> among);
  /// Error of a difference's ambiguity by that of the position [cycles/m].
  [[nodiscard]] Eigen::Vector3d cycles_of(std::size_t difference) const;
  /// Whether whole numbers are those of the last fixed position, as far as that had them, and that is most.
  [[nodiscard]] bool are_kept(std::span<const SlotPair> slots, const Eigen::VectorXd& whole) const;
  void keep(std::span<const SlotPair> slots, const Eigen::VectorXd& whole);
  /// The epoch's whole numbers. Those that wait for the next epoch's are kept for it.
  std::optional<Fixed> find_integers();
  /// Among all; where that fails without GLONASS, as biases that are stated wrongly spoil it.
  std::optional<Fixed> find_with_glonass_or_without();
  /// Among these, best first; where that fails among the more certain ones. Empty where they are too few.
  std::optional<Fixed> find_among(std::vector<std::size_t> among);
  /// Tests the whole numbers that were found of a set.
  Fixed answer(const Pairs& pairs, const Set& set, const std::optional<IntegerSolution>& found);
  /// The answer at whole numbers that are accepted.
  void fix_at(const Pairs& pairs, const Set& set, const Eigen::VectorXd& whole, Fixed& fixed);

  // --- the answer

  /// Covariance that the filter lacks while its position follows from codes: their echoes last, and average
  /// out as slowly as the ambiguities grow old.
  [[nodiscard]] Eigen::Matrix3d covariance_of_echoes() const;
  [[nodiscard]] std::optional<positioning::Dop> dop_of(const std::vector<gnss::SatelliteId>& used,
                                                       const Eigen::Matrix3d& enu) const;
  /// Position, accuracy, baseline and velocity into a fix whose satellites are known.
  void state_answer(const std::optional<Fixed>& fixed, double age_s, positioning::Fix& fix);

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
  double fixed_squares_ = 0, fixed_redundant_ = 0;  // means of Fixed's
  Eigen::Matrix3d code_covariance_ = Eigen::Matrix3d::Zero();  // of the codes of the epoch alone
  int fixed_in_a_row_ = 0;
  std::optional<Unconfirmed> unconfirmed_;
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
