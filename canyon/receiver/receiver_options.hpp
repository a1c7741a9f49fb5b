#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/base/options/switch.hpp"
#include "canyon/receiver/fix_input.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/positioning/fusion/dead_reckoning.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/receiver/rtk/rtk_filter.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"
#include "canyon/sky/gnss/signal_groups.hpp"

namespace canyon::receiver {

/// Pseudorange noise, one OU process per satellite; and the paper's drifting mean. It represents the residual
/// errors of orbits, clocks and atmosphere if no errors in space are simulated (sky::RangeErrorModel).
struct NoiseOptions {
  /// Default: on if there are no errors in space.
  options::Switch enabled = true;
  tracking::OuOptions ou;
  double doppler_sigma_hz = 0.1;  ///< white, per measurement; >= 0
  /// The paper's mu drift mode: while the antenna is slower than 0.5 m/s, or fewer than five satellites above
  /// the mask are in line of sight, each satellite's mean moves to a value sampled once per satellite from
  /// N(0, kDriftMuSigma_m), with the process's own time constant 1 / theta.
  bool drift_enabled = false;
  static constexpr double kDriftMuSigma_m = 2;
  /// Whether the means drift at an epoch. @param los satellites above the mask in line of sight
  [[nodiscard]] bool drifts(double speed_mps, int los) const;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, NoiseOptions& o);

/// The receiver's own delays of signals in its pseudoranges [m]; their common part is in its clock.
struct BiasOptions {
  /// Delays of groups of signals, [-1e4, 1e4]: inter-system ("GLONASS") and inter-frequency ones ("L5").
  gnss::GroupValues code_m;
  /// GLONASS: increment per frequency channel [m], [-100, 100]; in some receivers metres over the band.
  double glonass_channel_m = 0;
  /// Drift of each system's signal around its bias: a first-order process of this deviation [m], [0, 1000],
  /// and time constant [s], [1, 1e6].
  double drift_sigma_m = 0;
  double drift_time_s = 3600;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, BiasOptions& o);

/// White noise on the solved position and velocity, in addition to all other errors and included in the
/// reported covariances, as in the GNSS sensors of simulators. Each >= 0.
struct FixNoiseOptions {
  double horizontal_m = 0, vertical_m = 0;      ///< standard deviations: east and north each; up [m]
  double horizontal_mps = 0, vertical_mps = 0;  ///< likewise [m/s]
  [[nodiscard]] bool any() const { return horizontal_m + vertical_m + horizontal_mps + vertical_mps > 0; }
};
void visit(options::Visitor& v, FixNoiseOptions& o);

/// Checks for spoofing in a receiver (SpoofingCheck).
struct SpoofingCheckOptions {
  bool enabled = false;
  double gain_db = 1;  ///< [0.1, 30]
  /// Jump of position or clock [m], [1, 1e6]. Changing echoes in a street move a fix by tens of metres.
  double jump_m = 150;
  double hold_s = 30;  ///< [0, 1e5]
};
void visit(options::Visitor& v, SpoofingCheckOptions& o);

/// A receiver without a name.
inline constexpr std::string_view kReceiver = "receiver";

/// Standard deviation that receivers assume for errors in space [m]; assumed.
inline constexpr double kSpaceSigma_m = 1;

/// Systems that the receiver's radio can receive concurrently near L1, if `tracks` is not given.
enum class AtOnce : std::uint8_t {
  All,
  GlonassOrBeiDou,  ///< one band besides 1575.42 MHz: no B1I if the sky has GLONASS (u-blox M8)
  BeiDouByB1C,      ///< likewise, and BeiDou's signal is B1C (u-blox M10)
};

struct ReceiverOptions : positioning::RangeOptions {
  std::string name{kReceiver};
  /// Names of gnss::signals_of(), of any system, to track; systems without any are not tracked. Empty: of
  /// each satellite its signal near L1.
  std::vector<std::string> tracks;
  /// Groups of signals excluded from tracking: satellites that the firmware ignores ("BeiDou-GEO").
  std::vector<std::string> leaves_out;
  /// Systems that the hardware receives concurrently near L1.
  AtOnce at_once = AtOnce::All;
  FixInputOptions fix_input;
  BiasOptions biases;
  /// Whether random realizations depend on the receiver's name, in addition to seed and satellite. Default:
  /// noise, clock and phases do; shadows and other disturbances do not, so that receivers get the same
  /// streets. True: shadows do as well, for antennas on different vehicles. False: nothing does, to compare
  /// receivers with different settings under the same noise.
  options::Switch independent_noise = true;
  NoiseOptions noise;
  FixNoiseOptions fix_noise;
  tracking::ClockOptions clock;
  SpoofingCheckOptions spoofing_check;
  tracking::SignalOptions signal;
  /// Position filter after the fix; off: independent fixes of single epochs, as in the paper.
  positioning::PositionFilterOptions filter;
  rtk::CorrectionOptions corrections;
  /// Float and fixed solutions by carrier phases, in addition to those of the corrections.
  rtk::RtkOptions rtk;
  /// Fusion with the vehicle's sensors, if the receiver's driver has some (EpochContext::sensors).
  positioning::DeadReckoningOptions dead_reckoning;
  /// Errors that a receiver assumes in its codes in addition to those of its loops: the noise process if it
  /// is on; with errors in space kSpaceSigma_m that changes over an hour.
  [[nodiscard]] positioning::CodeNoise slow_error() const;
  /// The part common to two receivers near each other, a standard deviation [m].
  [[nodiscard]] double shared_error_m() const;
  /// Standard deviation that a pseudorange reports in addition to that of its loop [m]; 0: none.
  [[nodiscard]] double reported_noise_m() const;
  /// Sets the options that are not given. @param space whether the environment has errors in space
  /// @param with_ionosphere whether these have an ionosphere
  void decide(bool space, bool with_ionosphere);
  /// Sets `tracks` or `exclude_signals` to the signals of these satellites that `concurrent_systems`
  /// receives; no change if `tracks` is given. Throws InputError if `tracks` has none of their signals.
  void choose_signals(std::span<const gnss::SatelliteId> sky);
  /// Throws InputError naming receiver and field that are out of range.
  void validate() const;
};
void visit(options::Visitor& v, ReceiverOptions& o);

/// Tracked signals of a system by ReceiverOptions::tracks, in the order of gnss::signals_of(); may be empty.
[[nodiscard]] std::vector<const gnss::Signal*> tracked_signals(const std::vector<std::string>& tracks,
                                                               gnss::System system);

/// User models that replace a receiver's own. Empty functions: the receiver's own. Called one or more times
/// per epoch, in order of time, in the thread that calls Receiver::observe().
struct UserModels {
  /// Replaces FixOptions::weights, for fix and position filter: standard deviation of a pseudorange's weight
  /// [m], > 0 (else InputError). @param elevation_rad the satellite's true elevation
  std::function<double(const positioning::Measurement& measurement, double elevation_rad)> sigma_m;
  /// Replaces positioning::solve_fix(), before the position filter. Arguments and required contents of the
  /// fix are those of solve_fix() (positioning::fix_at() makes it from a position).
  std::function<positioning::Fix(geodesy::GpsTime receiver_time,
                                 const std::vector<positioning::Measurement>& measurements,
                                 const orbit::Sky& sky, const positioning::FixOptions& options,
                                 const std::map<gnss::System, gnss::Klobuchar>& klobuchar)>
      solve;
};

/// Creates the models of one receiver in their state before the first epoch; called again when a run or a
/// world restarts. @param seed of the run; @param receiver makes its random streams distinct, as for
/// disturbance::DisturbanceSource
using ModelSource = std::function<UserModels(std::uint64_t seed, const std::string& receiver)>;

}  // namespace canyon::receiver
