#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/relative/observed_minus_computed.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::relative {

/// A number that the filter estimates beside position, velocity and clock.
struct BaselineSlot {
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
  std::vector<BaselineSlot> slots;

  [[nodiscard]] static Eigen::Index index(std::size_t slot) {
    return kFirstSlot + static_cast<Eigen::Index>(slot);
  }
  /// The place of a satellite's ambiguity, or with a null signal of its ionosphere.
  [[nodiscard]] std::optional<std::size_t> find(gnss::SatelliteId id, const gnss::Signal* signal) const;
  /// How a difference depends on the state. @param ionosphere whether its delays are states
  [[nodiscard]] SparseRow row_of(const Difference& d, bool phase, bool ionosphere) const;
  /// A new slot, independent of everything else. Returns its place.
  std::size_t add(const BaselineSlot& slot, double value, double variance);
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

}  // namespace canyon::relative
