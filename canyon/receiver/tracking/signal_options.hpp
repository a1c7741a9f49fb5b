#pragma once

#include <limits>
#include <optional>

#include "canyon/base/options/fwd.hpp"
#include "canyon/paths/disturbance/shadowing_options.hpp"
#include "canyon/paths/signal/antenna_pattern.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/receiver/tracking/code_tracking.hpp"
#include "canyon/receiver/tracking/loop_noise.hpp"
#include "canyon/receiver/tracking/signal_lock.hpp"
#include "canyon/sky/gnss/signal_groups.hpp"

namespace canyon::tracking {

/// Installation of the antenna: sets the loss by its environment in the link budget [dB], by calibrations of
/// recordings (docs/profiles.md).
enum class Installation { Nominal, Roof, RoofWithSplitter, Dashboard, Handheld, Drone };

/// Strength and tracking of signals. Off: every arriving signal is tracked at once, at the shortest path's
/// excess, and has no C/N0 (the paper's receiver).
struct SignalOptions {
  bool enabled = false;
  signal::AntennaPattern antenna = signal::patch_antenna();
  signal::LinkBudgetOptions link;
  Installation installation = Installation::Nominal;
  std::optional<double> installation_db;  ///< measured value, replaces that of the kind [dB], [-30, 30]
  /// Standard deviation [dB] of one installation around level_db(), random by seed and receiver; [0, 20].
  double installation_sigma_db = 0;
  /// Added to the link budget's C/N0 of groups of signals [dB], [-30, 30]: satellites differ from the minimum
  /// of their interface documents, and receivers between bands.
  gnss::GroupValues offset_db;
  /// Standard deviation [dB] of a constant of each satellite, random by seed: transmit powers differ by block
  /// and age. [0, 10].
  double satellite_sigma_db = 0;
  signal::StrengthOptions strength;
  /// Shadowing of the direct path by bodies that the map lacks (disturbance::DirectShadowing).
  disturbance::ShadowingOptions shadowing;
  /// Two-sided bandwidth [Hz] of the front end, an ideal filter, [1.023e6, 511e6]; infinite: none.
  double front_end_bandwidth_hz = std::numeric_limits<double>::infinity();
  /// The same for signals of 10.23 Mchip/s, whose front-end branch is wider [10.23e6, 511e6].
  double wide_front_end_bandwidth_hz = 20.46e6;
  /// Power of interference after the antenna, anywhere in its band, that compresses the gain of the stages
  /// before the filter by 1 dB [dBm], [-80, 20]; infinite: they are linear. Default: LNA and mixer of a GPS
  /// receiver (TI TRF5001, input 1 dB compression point); LNAs alone are 20 dB above it, and an active
  /// antenna adds its gain before it.
  double front_end_compression_dbm = -36;
  DllOptions dll;
  PllOptions pll;
  FllOptions fll;
  SignalLockOptions lock;  ///< driven by the true C/N0
  /// Phase is tracked at this C/N0 or above [dB-Hz], [0, 100]. Default: a loop of 15 Hz and 20 ms has 13 deg
  /// of noise there, and loses lock at 15 (Kaplan & Hegarty, 2nd ed. 2006, section 5.6.1.1).
  double phase_threshold_dbhz = 25;
  /// Standard deviation of the receiver's own C/N0 estimate [dB], white, [0, 10]. Lock and noise follow the
  /// true C/N0.
  double cn0_sigma_db = 0;
  /// Receivers report a mean of C/N0: time constant [s], [0, 100], of an exponential average of powers (A. J.
  /// Van Dierendonck, in Parkinson & Spilker 1996, chapter 8, averages over 1 s).
  double cn0_averaging_s = 0;
  /// C/N0 is reported in steps of this [dB], [0, 10]; u-blox: 1. 0: unrounded.
  double cn0_step_db = 0;
  /// Thermal noise of code, phase and Doppler from C/N0 (loop_noise.hpp).
  bool loop_noise = true;

  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, SignalOptions& o);

/// Level of the installation: added to the C/N0 of all signals [dB].
[[nodiscard]] double level_db(const SignalOptions& options);

/// A signal through the front end of these options.
[[nodiscard]] CorrelationOptions correlation_of(const gnss::Signal& signal, const SignalOptions& options);

}  // namespace canyon::tracking
