#pragma once

#include <string>
#include <vector>

#include "canyon/gnss/signals.hpp"
#include "canyon/options/fwd.hpp"
#include "canyon/positioning/positioning_options.hpp"
#include "canyon/tracking/clock.hpp"
#include "canyon/tracking/noise.hpp"
#include "canyon/tracking/signal_options.hpp"

namespace canyon::receiver {

/// Pseudorange noise, one OU process per satellite; and the paper's drifting mean.
struct NoiseOptions {
  bool enabled = true;
  tracking::OuOptions ou;
  double doppler_sigma_hz = 0.1;  ///< white, per measurement; >= 0
  /// The paper's mu drift mode: while the antenna is slower than drift_below_speed_mps or fewer than
  /// drift_below_los satellites above the mask are in line of sight, each satellite's mean moves by a value
  /// drawn once per satellite from N(0, drift_mu_sigma_m), with the process's own time constant 1 / theta.
  bool drift_enabled = false;
  double drift_below_speed_mps = 0.5;  ///< >= 0
  int drift_below_los = 5;             ///< >= 0
  double drift_mu_sigma_m = 2;         ///< >= 0
  /// Whether the means drift at an epoch. @param los satellites above the mask in line of sight
  [[nodiscard]] bool drifts(double speed_mps, int los) const;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
/// Its fields.
void visit(options::Visitor& v, NoiseOptions& o);

/// Which pseudoranges go into the fix.
enum class Combination {
  First,           ///< of each satellite's first signal
  IonosphereFree,  ///< of the first and the one farthest from it in frequency; without a second, the first
                   ///< where FixOptions::correct_ionosphere has a model for it, else none
};

struct ReceiverOptions {
  std::string name = "receiver";
  /// Names of gnss::signals_of(), of any system: these are tracked, of systems without any nothing. Empty: of
  /// each satellite its signal near L1.
  std::vector<std::string> tracks;
  Combination combination = Combination::First;
  /// Everything random hangs on seed and satellite, so that receivers that differ in a setting are compared
  /// under the same luck. True: on the name as well, for antennas whose errors must not be alike (a base
  /// station beside a rover).
  bool own_draws = false;
  positioning::FixOptions fix;
  NoiseOptions noise;
  tracking::ClockOptions clock;
  tracking::SignalOptions signal;
  /// Position filter behind the fix; off: each epoch's fix stands alone, as in the paper.
  positioning::PositionFilterOptions filter;
  bool ionosphere = false;  ///< delays are in the signal (the fix corrects them where FixOptions says so)
  bool troposphere = false;
  /// Throws InputError naming receiver and field that are out of range.
  void validate() const;
};
/// Its fields.
void visit(options::Visitor& v, ReceiverOptions& o);

/// What ReceiverOptions::tracks says of one system, in the order of gnss::signals_of(); may be empty.
[[nodiscard]] std::vector<const gnss::Signal*> tracked_signals(const std::vector<std::string>& tracks,
                                                               gnss::System system);

}  // namespace canyon::receiver
