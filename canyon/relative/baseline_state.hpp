#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/signals.hpp"

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
  /// The state without ambiguities: what codes see.
  [[nodiscard]] BaselineState without_ambiguities() const;
  /// Takes what `other`, a part of this that has taken observations since without_ambiguities(), knows of
  /// position, velocity, zenith delay and ionosphere.
  void learn(const BaselineState& other);
  /// Takes it, into the lower triangle of `p` alone: call mirror() behind the last of several.
  void take(const SparseRow& row, double value, double variance);
  /// The lower triangle of `p` into the upper one.
  void mirror();

 private:
  Eigen::VectorXd gain_;  // kept for its memory
};

}  // namespace canyon::relative
