#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/receiver/fix_input.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/positioning/fusion/dead_reckoning.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/receiver/relative/rtk_filter.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"
#include "canyon/sky/gnss/signal_groups.hpp"

namespace canyon::receiver {

/// Pseudorange noise, one OU process per satellite; and the paper's drifting mean. It stands for what is left
/// of orbits, clocks and atmosphere where no errors of space are simulated (errors::SpaceErrors).
struct NoiseOptions {
  /// Left out: on where no errors of space are.
  options::Switch enabled = true;
  tracking::OuOptions ou;
  double doppler_sigma_hz = 0.1;  ///< white, per measurement; >= 0
  /// The paper's mu drift mode: while the antenna is slower than 0.5 m/s or fewer than five satellites above
  /// the mask are in line of sight, each satellite's mean moves by a value drawn once per satellite from
  /// N(0, kDriftMuSigma_m), with the process's own time constant 1 / theta.
  bool drift_enabled = false;
  static constexpr double kDriftMuSigma_m = 2;
  /// Whether the means drift at an epoch. @param los satellites above the mask in line of sight
  [[nodiscard]] bool drifts(double speed_mps, int los) const;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, NoiseOptions& o);

/// The receiver's own delays of signals in its pseudoranges [m]; their common part belongs to its clock.
struct BiasOptions {
  /// Delays of groups of signals, [-1e4, 1e4]: inter-system ("GLONASS") and inter-frequency ones ("L5").
  gnss::GroupValues code_m;
  /// GLONASS: from one frequency channel to the next [m], [-100, 100]; some receivers differ by metres over
  /// the band.
  double glonass_channel_m = 0;
  /// Each system's signal drifts about its bias, a first-order process of this deviation [m], [0, 1000], and
  /// time constant [s], [1, 1e6].
  double drift_sigma_m = 0;
  double drift_time_s = 3600;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, BiasOptions& o);

/// White noise on the solved position and velocity, beside all other errors and in the stated covariances, as
/// simulators' own GNSS sensors have it. Each >= 0.
struct FixNoiseOptions {
  double horizontal_m = 0, vertical_m = 0;      ///< standard deviations: east and north each; up [m]
  double horizontal_mps = 0, vertical_mps = 0;  ///< likewise [m/s]
  [[nodiscard]] bool any() const { return horizontal_m + vertical_m + horizontal_mps + vertical_mps > 0; }
};
void visit(options::Visitor& v, FixNoiseOptions& o);

/// Checks by which a receiver notices spoofing (SpoofingCheck).
struct SpoofingCheckOptions {
  bool enabled = false;
  double gain_db = 1;  ///< [0.1, 30]
  /// Jump of place or clock [m], [1, 1e6]. Echoes that come and go in a street move a fix by tens of metres.
  double jump_m = 150;
  double hold_s = 30;  ///< [0, 1e5]
};
void visit(options::Visitor& v, SpoofingCheckOptions& o);

/// A receiver without a name.
inline constexpr std::string_view kReceiver = "receiver";

/// Standard deviation that receivers take errors from space to have [m]; assumed.
inline constexpr double kSpaceSigma_m = 1;

/// Systems that the radio of a receiver has at once near L1, where `tracks` is left out.
enum class AtOnce : std::uint8_t {
  All,
  GlonassOrBeiDou,  ///< one band beside 1575.42 MHz: B1I rests under a sky that has GLONASS (u-blox M8)
  BeiDouByB1C,      ///< likewise, and BeiDou's signal is B1C (u-blox M10)
};

struct ReceiverOptions : positioning::RangeOptions {
  std::string name{kReceiver};
  /// Names of gnss::signals_of(), of any system: these are tracked, of systems without any nothing. Empty: of
  /// each satellite its signal near L1.
  std::vector<std::string> tracks;
  /// Groups of signals that it does not track all the same: satellites that its firmware leaves out
  /// ("BeiDou-GEO").
  std::vector<std::string> leaves_out;
  /// Systems that the hardware receives at once near L1.
  AtOnce at_once = AtOnce::All;
  FixInputOptions fix_input;
  BiasOptions biases;
  /// Whether random draws depend on the receiver's name, beside seed and satellite. Left out: noise, clock
  /// and phases do, shadows and other disturbances do not, so that receivers meet the same streets. True:
  /// shadows do as well, for antennas on different vehicles. False: nothing does, and receivers that differ
  /// in a setting are compared under the same noise realization.
  options::Switch own_draws = true;
  NoiseOptions noise;
  FixNoiseOptions fix_noise;
  tracking::ClockOptions clock;
  SpoofingCheckOptions spoofing_check;
  tracking::SignalOptions signal;
  /// Position filter behind the fix; off: each epoch's fix stands alone, as in the paper.
  positioning::PositionFilterOptions filter;
  relative::CorrectionOptions corrections;
  /// Float and fixed solutions by carrier phases beside those of the corrections.
  relative::RtkOptions rtk;
  /// The vehicle's sensors behind all of it, where the receiver's driver has some (EpochContext::sensors).
  positioning::DeadReckoningOptions dead_reckoning;
  /// Errors that a receiver assumes in its codes beside those of its loops: the noise process where that is
  /// on; under errors of space kSpaceSigma_m that changes over an hour.
  [[nodiscard]] positioning::CodeNoise slow_error() const;
  /// The part that two receivers near each other have in common, a standard deviation [m].
  [[nodiscard]] double shared_error_m() const;
  /// Standard deviation that a pseudorange states beside that of its loop [m]; 0: none.
  [[nodiscard]] double stated_noise_m() const;
  /// Decides the options that are left out. @param space whether the environment has errors of space
  /// @param with_ionosphere whether these have an ionosphere
  void decide(bool space, bool with_ionosphere);
  /// Sets `tracks` or `leaves_out` to what `at_once` receives of these satellites; nothing where `tracks`
  /// says it. Throws InputError where `tracks` has no signal of any of the satellites.
  void choose_signals(std::span<const gnss::SatelliteId> sky);
  /// Throws InputError naming receiver and field that are out of range.
  void validate() const;
};
void visit(options::Visitor& v, ReceiverOptions& o);

/// Tracked signals of one system by ReceiverOptions::tracks, in the order of gnss::signals_of(); may be
/// empty.
[[nodiscard]] std::vector<const gnss::Signal*> tracked_signals(const std::vector<std::string>& tracks,
                                                               gnss::System system);

/// A program's models in the place of a receiver's own. Empty functions: the receiver's own. Called once an
/// epoch or more, in order of time, in the thread that calls Receiver::observe().
struct OwnModels {
  /// Instead of FixOptions::weights, for fix and position filter: standard deviation that a pseudorange is
  /// weighted by [m], > 0 (else InputError). @param elevation_rad true one of the satellite
  std::function<double(const positioning::Measurement& measurement, double elevation_rad)> sigma_m;
  /// Instead of positioning::solve_fix(), in front of the position filter; the arguments are those of
  /// solve_fix(), and so is what the fix must hold (positioning::fix_at() makes it of a place).
  std::function<positioning::Fix(geodesy::GpsTime receiver_time,
                                 const std::vector<positioning::Measurement>& measurements,
                                 const orbit::Sky& sky, const positioning::FixOptions& options,
                                 const std::map<gnss::System, gnss::Klobuchar>& klobuchar)>
      solve;
};

/// Makes the models of one receiver as they are before the first epoch; a run or a world that begins anew
/// makes them anew. @param seed of the run; @param receiver what sets its draws apart, as for
/// disturbance::DisturbanceSource
using ModelSource = std::function<OwnModels(std::uint64_t seed, const std::string& receiver)>;

}  // namespace canyon::receiver
