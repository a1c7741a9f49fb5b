#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"

// State and equations of the position filter. Private to canyon/receiver/positioning.

namespace canyon::positioning {

/// States: ECEF position and velocity, clock drift [m/s], each constellation's clock [m].
inline constexpr int kPosition = 0;
inline constexpr int kVelocity = 3;
inline constexpr int kDrift = 6;
inline constexpr int kClock = 7;
inline constexpr int kStates = kClock + static_cast<int>(gnss::kConstellations.size());
using StateVector = Eigen::Matrix<double, kStates, 1>;
using StateMatrix = Eigen::Matrix<double, kStates, kStates>;

/// Standard deviation of states that are unknown at the start: position and clocks of the starting fix, which
/// its measurements then determine again. 1e-8 of the weight of a pseudorange of 1 m.
inline constexpr double kUnknown_m = 1e4;

/// Index of a system's clock in kConstellations.
inline std::size_t clock_index(gnss::System system) {
  return static_cast<std::size_t>(clock_system(system));
}
inline int clock_of(gnss::System system) {
  return kClock + static_cast<int>(clock_index(system));
}

/// A measurement's linear equation: innovation = gradient . error + noise.
struct FilterRow {
  StateVector gradient = StateVector::Zero();
  double innovation = 0;
  double sigma = 1;  ///< for the gain
  /// The satellite of a pseudorange; empty: a Doppler, whose errors are not correlated in time.
  std::optional<gnss::SatelliteId> satellite;
  double fraction = 1;  ///< Measurement::reported_sigma_ratio
};
/// An accepted row, and its gain.
struct AcceptedRow {
  FilterRow row;
  StateVector gain;
  std::size_t lasting = 0;   ///< index of a pseudorange's error in FilterState::lasting
  double lasting_sigma = 0;  ///< its deviation; both by report_accuracy()
};
/// Covariance of the state's error and the time-correlated error of a satellite's pseudorange, as multiples
/// of the latter's deviation.
struct CorrelatedError {
  gnss::SatelliteId satellite;
  StateVector covariance = StateVector::Zero();
  geodesy::GpsTime taken;  ///< when a pseudorange of the satellite last passed the gate
};

/// The clock of the pseudoranges relative to the drift of the Dopplers. Phones reset it at each epoch.
struct CodeClock {
  std::optional<gnss::System> of;  ///< the clock's system; empty: unknown
  double clock_m = 0;              ///< at the last epoch, by the median of the pseudoranges
  double rate_mps = 0;
  double mean_square_m2 = 0;
};

/// State of the filter at an instant.
struct FilterState {
  geodesy::GpsTime time;
  geodesy::GpsTime measured;  ///< when a measurement last passed the gate
  std::optional<geodesy::GpsTime> astray_since;
  std::array<std::optional<geodesy::GpsTime>, gnss::kConstellations.size()> system_astray_since;
  std::array<bool, gnss::kConstellations.size()> known{};  ///< the constellation has a clock
  StateVector x = StateVector::Zero();
  StateMatrix p = StateMatrix::Zero();  ///< for the gains: of white errors with the weights' variances
  /// Covariance of the state's error under these gains, with time-correlated errors as large as residuals.
  StateMatrix reported_covariance = StateMatrix::Zero();
  std::vector<CorrelatedError> lasting;
  /// Fraction of the motion's noise in `reported_covariance`: that of the latest pseudoranges' variances
  /// (FilterRow::fraction), because the gains are for the whole errors.
  double noise_fraction = 1;

  [[nodiscard]] Eigen::Vector3d position() const { return x.segment<3>(kPosition); }
  [[nodiscard]] Eigen::Vector3d velocity() const { return x.segment<3>(kVelocity); }
  [[nodiscard]] bool knows(gnss::System system) const { return known[clock_index(system)]; }
};

/// Scalar updates at one point of linearisation, by Joseph's form: P = (I - K h) P (I - K h)^T + K R K^T.
class Update {
 public:
  /// @param taken accepted rows; emptied, it keeps its capacity
  Update(FilterState& filter, std::vector<AcceptedRow>& taken) : state_(filter), taken_(taken) {
    taken.clear();
  }
  /// Continues from `start`, an update of another state that is otherwise equal.
  Update(FilterState& filter, std::vector<AcceptedRow>& taken, const Update& started)
      : state_(filter), correction_(started.correction_), taken_(taken) {
    taken = started.taken_;
  }

  /// Returns false without change if the innovation is beyond `gate_sigmas`.
  bool take(const FilterRow& row, double gate_sigmas);
  /// Replaces its result by that of `other`.
  void adopt(const Update& other) {
    state_.p = other.state_.p;
    state_.reported_covariance = other.state_.reported_covariance;
    correction_ = other.correction_;
    taken_ = other.taken_;
  }
  void finish() { state_.x += correction_; }

 private:
  FilterState& state_;
  StateVector correction_ = StateVector::Zero();
  std::vector<AcceptedRow>& taken_;
};

/// Updates FilterState::reported_covariance with the accepted rows: the covariance of an estimate whose gains
/// K come from another error model than the actual one (Gelb, Applied Optimal Estimation, 7.2; Schmidt's
/// consider states). A pseudorange's error has a white part and a time-correlated one, of deviations w and b;
/// C is the covariance of the state's error and the correlated part over b:
///   S - K m' - m K' + K K' (h' S h + w^2 + b^2 + 2 b h' C),  m = S h + b C,  then C - K h' C - K b.
/// @param excess variance of errors over that of the weights. With error_correlation_s all of it is
/// correlated; of corrected pseudoranges the part above 1: their noise is white.
void report_accuracy(FilterState& filter, std::span<AcceptedRow> taken, double excess,
                     const PositionFilterOptions& options);

/// One epoch's satellites relative to a position. Vectors keep their capacity from epoch to epoch.
struct FilterEpoch {
  struct Candidate {
    std::size_t index;  ///< of the satellite
    FilterRow row;      ///< of its pseudorange
  };
  geodesy::GpsTime time;
  std::vector<RangedSatellite> satellites;
  std::vector<bool> passed;           ///< one per satellite
  std::vector<Candidate> candidates;  ///< in the order of processing of pseudoranges
  std::vector<AcceptedRow> taken, accepted_if_rotated;
  FilterState rotated;
  std::vector<double> innovations;
};

/// Covariance [m^2/s^2, ECEF] of an unknown velocity.
[[nodiscard]] Eigen::Matrix3d unknown_velocity(const Eigen::Vector3d& position_ecef);

/// Over dt, white acceleration of density q adds q dt^3 / 3, q dt^2 / 2, q dt to position and velocity
/// (Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, eq. 6.2.2-4);
/// likewise drift to the clock, plus white frequency. Time-correlated errors are multiplied by exp(-dt /
/// error_correlation_s).
void predict(FilterState& filter, double dt, const PositionFilterOptions& options);

[[nodiscard]] FilterRow pseudorange_row(const FilterState& filter, const RangedSatellite& satellite);
[[nodiscard]] FilterRow doppler_row(const FilterState& filter, const RangedSatellite& satellite);

/// Handles clock steps `dt` seconds after the last epoch, and clocks of new constellations.
void update_clocks(FilterState& filter, CodeClock& own, FilterEpoch& epoch, double dt);

}  // namespace canyon::positioning
