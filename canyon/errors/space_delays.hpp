#pragma once

namespace canyon::errors {

/// Errors from space in a satellite's signals at one place and instant.
struct SpaceDelays {
  /// Error of the satellite's broadcast orbit and clock, in code and phase alike [m].
  double orbit_clock_m = 0;
  /// The true ionosphere: delay of a code at 1575.42 MHz [m], of others by f^-2, an advance of phases. 0
  /// where no broadcast model is known.
  double ionosphere_m = 0;
  double troposphere_m = 0;  ///< the true delay [m]
};

}  // namespace canyon::errors
