#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/rtk/observed_minus_computed.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::rtk {

/// A state of the filter other than position, velocity and clock.
struct BaselineSlot {
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;  ///< of an ambiguity [cycles]; null: the ionosphere's difference [m]
  geodesy::GpsTime started, seen;
  std::optional<geodesy::GpsTime> rover_since, base_since;  ///< start of the phases' continuity
  bool half_cycle = false;
  int epochs = 0;      ///< number of epochs with its phase
  double phase_m = 0;  ///< difference of the phases at the previous epoch
  /// Its integer in the last fixed position, relative to a common origin of its signal's ambiguities.
  std::optional<double> whole{};
};

/// Rover minus base, of one signal.
struct Difference {
  const ObservedMinusComputed* rover = nullptr;
  double code_m = 0, phase_m = 0;
  double variance = 0;      // of the phase [m^2]; code's is that times the square of the ratio
  double age_variance = 0;  // of both [m^2]
  std::optional<geodesy::GpsTime> base_since;
  bool has_phase = false, half_cycle = false, aligned = true;
  // Set by the filter.
  std::optional<std::size_t> slot;
  bool used = false;      // phase
  bool trusted = false;   // within the gate
  double residual_m = 0;  // after the epoch

  [[nodiscard]] gnss::SatelliteId id() const { return rover->id; }
  /// Ratio of the ionosphere's delay at this carrier to that at L1.
  [[nodiscard]] double ionosphere_rate() const;
};

/// Gradient of an observation that is nonzero at few states.
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
  std::vector<BaselineSlot> slots;

  [[nodiscard]] static Eigen::Index index(std::size_t slot) {
    return kFirstSlot + static_cast<Eigen::Index>(slot);
  }
  /// Index of a satellite's ambiguity, or with a null signal of its ionosphere.
  [[nodiscard]] std::optional<std::size_t> find(gnss::SatelliteId id, const gnss::Signal* signal) const;
  /// Gradient of a difference by the state. @param ionosphere whether its delays are states
  [[nodiscard]] SparseRow row_of(const Difference& d, bool phase, bool ionosphere) const;
  /// Adds a slot, independent of all others. Returns its index.
  std::size_t add(const BaselineSlot& slot, double value, double variance);
  void remove(std::size_t slot);
  /// Makes a state independent of all others.
  void reset(Eigen::Index state, double value, double variance);
  /// Propagates position and velocity over dt_s [s], with white accelerations; the position error must be 0.
  void move(double dt_s, const Eigen::Matrix3d& acceleration_density_squared);

  /// Innovation of an observation of `value`, and its variance.
  struct Innovation {
    double value = 0, variance = 0;
    [[nodiscard]] double normalised() const;
  };
  /// Reads the lower triangle of `p`.
  [[nodiscard]] Innovation innovation(const SparseRow& row, double value, double variance) const;
  /// Applies it, to the lower triangle of `p` only: call mirror() after the last of several.
  void take(const SparseRow& row, double value, double variance);
  /// Copies the lower triangle of `p` to the upper one.
  void mirror();

 private:
  Eigen::VectorXd gain_;  // member to keep its capacity
};

}  // namespace canyon::rtk
