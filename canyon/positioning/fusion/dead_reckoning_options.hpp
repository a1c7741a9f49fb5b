#pragma once

#include "canyon/options/fwd.hpp"

namespace canyon::positioning {

/// A receiver that goes on by the vehicle's inertial sensor and wheels (DeadReckoning).
struct DeadReckoningOptions {
  bool enabled = false;
  /// The vehicle moves along its own axis, as cars and trains do: it neither slides sideways nor leaves the
  /// road.
  bool non_holonomic = true;
  /// Standard deviations [m/s] of the speeds across, (0, 10].
  double sideways_mps = 0.1, upwards_mps = 0.1;
  /// Slower than this, the course says nothing of the heading [m/s], (0, 100].
  double alignment_speed_mps = 3;
  /// Fixes and velocities beyond so many standard deviations are left out [1], > 0.
  double gate_sigmas = 4;
  /// Errors of fixes last until the antenna has moved so far [m], (0, 1e5], or for so long [s], (0, 3600].
  double error_distance_m = 60, error_height_distance_m = 500, error_time_s = 60;
  /// Errors from space, which do not change in a drive: standard deviation of a range [m], [0, 100]. Stated
  /// accuracies of positions without corrections have them.
  double space_sigma_m = 2;
  /// After so long with fixes that all fail the test, the filter doubts itself [s], (0, 3600].
  double astray_s = 20;
  /// A position of a larger standard deviation (root of the sum of the three variances) [m] is none.
  double max_sigma_m = 100;

  void validate() const;
};
/// Its fields.
void visit(options::Visitor& v, DeadReckoningOptions& o);

}  // namespace canyon::positioning
