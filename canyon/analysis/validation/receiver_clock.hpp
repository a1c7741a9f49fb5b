#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "canyon/analysis/validation/pseudorange_errors.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::validation {

/// Whether a satellite is in clear view of the antenna in the city. Called once for each observation in
/// order.
using ClearView = std::function<bool(const PseudorangeResidual&, const ResidualEpoch&)>;

struct ReceiverClockOptions {
  /// If fewer satellites than this are in clear view above `elevation_mask_rad`, the epoch's clock is
  /// estimated from all satellites. [1, 50].
  int min_clear = 1;
  /// Satellites below do not contribute to the clock [rad]. [0, pi/2).
  double elevation_mask_rad = 0.17453292519943295;  // 10 deg
  /// Relative weights, 1 / variance with variance = a + b 10^(-C/N0 / 10) (Kuusniemi, User-level reliability
  /// and quality monitoring in satellite-based personal navigation, Tampere University of Technology 2005: a
  /// = 10 m^2, b = 150^2 m^2 Hz for lightly degraded signals). Signals without C/N0 count as 30 dB-Hz. > 0,
  /// >= 0.
  double variance_floor_m2 = 10;
  double variance_scale_m2_hz = 22'500;
  /// Huber's constant, in standard deviations: larger residuals have weights of 1 / |residual| (Huber, Robust
  /// Statistics, 1981; 1.345 keeps 95 % efficiency on normal errors). [0.5, 10].
  double huber = 1.345;
  /// Pseudoranges farther than this from the median of their epoch [m] are not measurements (a wrong
  /// millisecond is 299,792 m): marked gross, not used for the clock. [1000, 100,000].
  double gross_m = 10'000;
};

struct PseudorangeError {
  /// Pseudorange error [m]: residual minus clock and inter-system bias. Positive: measured too long.
  double error_m = 0;
  bool clear = false;  ///< by ClearView
  bool gross = false;  ///< ReceiverClockOptions::gross_m
};

enum class ClockSource : std::uint8_t {
  Clear,  ///< satellites in clear view
  All,    ///< too few of these: all satellites; their common errors are hidden in the clock
  None,   ///< all are gross: errors are relative to their median
};

struct EpochClock {
  double bias_m = 0;  ///< c times the receiver's time tag minus GPS time, of the reference system
  ClockSource source = ClockSource::None;
  int clear = 0;  ///< satellites in clear view that contribute to it
};

struct PseudorangeErrors {
  std::vector<PseudorangeError> observations;  ///< one for each of PseudorangeResiduals::observations
  std::vector<EpochClock> clocks;              ///< one for each of PseudorangeResiduals::epochs
  gnss::System reference = gnss::System::GPS;  ///< with bias 0: the one with most satellites in clear view
  std::map<gnss::System, double> inter_system_bias_m;  ///< of all systems observed
  double scatter = 0;  ///< robust deviation of clear errors over that of the weights' variance (1.4826 MAD)
};

/// Step two: one clock for each epoch and one constant bias for each system over the run, minimising Huber's
/// function of the weighted errors of all satellites in clear view jointly (iteratively reweighted least
/// squares from medians; epochs' clocks eliminated). So an epoch with a single satellite in clear view, of
/// any system, has a clock. Gaps, changing sets of satellites and jumps of the clock have no effect, since
/// only the biases connect epochs. GLONASS's inter-frequency biases remain in its errors.
[[nodiscard]] PseudorangeErrors remove_receiver_clock(const PseudorangeResiduals& residuals,
                                                      const ClearView& clear_view,
                                                      const ReceiverClockOptions& options = {});

}  // namespace canyon::validation
