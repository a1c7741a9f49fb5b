#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/paths/propagation/paths.hpp"

namespace canyon::disturbance {

/// Knowledge of a receiver that begins anew: all; time and place, no ephemerides; nothing.
enum class RestartKind : std::uint8_t { Hot, Warm, Cold };

/// A receiver that begins anew.
struct Restart {
  geodesy::GpsTime at;  ///< one instant is one restart
  RestartKind kind = RestartKind::Cold;
  std::optional<double> search_s{};     ///< from a signal's presence to its first measurement; empty: its own
  std::optional<double> ephemeris_s{};  ///< a satellite is tracked for so long before its use; empty: its own
};

/// Kinds of fix that a receiver may be made to state: the first of positioning::FixKind.
enum class StatedFix : std::uint8_t { None, Single, Differential, Float, Fixed };

/// A fix that a receiver states in place of its own. Vectors are east, north, up.
struct ForcedFix {
  StatedFix kind = StatedFix::None;
  Eigen::Vector3d error_m = Eigen::Vector3d::Zero(), sigma_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_error_mps = Eigen::Vector3d::Zero(), velocity_sigma_mps = Eigen::Vector3d::Zero();
};

/// What a receiver states instead of its fix, for tests of what follows it.
struct FixEdit {
  /// It reports the fix that it had then, the last one until then; none where it had none yet.
  std::optional<geodesy::GpsTime> of;
  bool first = false;                                  ///< the first one from then on instead
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< east, north, up, added
  std::optional<StatedFix> kind;
  std::optional<double> sigma_m;  ///< of each axis; 0: it states none
  double sigma_factor = 1;        ///< of all deviations that it states
  bool without_satellites = false, dropped = false;
  std::optional<double>
      after_outage_s;  ///< it holds so long after 2 s or more without a fix, at no other time
};

/// Events of a receiver itself at one epoch, whatever arrives at its antenna.
struct ReceiverEvents {
  /// Offsets of the oscillator, added to the receiver's own clock [s, s/s].
  double clock_bias_s = 0, clock_drift = 0;
  /// Errors of the date that the firmware states: GPS weeks, and seconds of UTC.
  int weeks_off = 0, utc_off_s = 0;
  std::optional<Restart> restart{};
  std::optional<ForcedFix> forced{};
  std::vector<FixEdit> fix_edits{};
  /// Faults, active or to come, may still ask for the fixes from here on (FixEdit::of); empty: for none.
  std::optional<geodesy::GpsTime> fixes_from{};
  std::vector<std::string> faults{};  ///< names of those at work (FaultTimeline)
};

/// An effect that no map and no orbit knows: traffic, foliage, jamming, spoofing, a restart. It stands
/// between what arrives at one antenna and its receiver, offline and live alike, and may have memory. It
/// overrides apply(), happen() or both.
class Disturbance {
 public:
  virtual ~Disturbance() = default;
  Disturbance() = default;
  Disturbance(const Disturbance&) = delete;
  Disturbance& operator=(const Disturbance&) = delete;

  /// Changes what arrives at one epoch; called once for each, in order of time. It may
  /// - weaken a path (Path::amplitude_factor), delay it (excess_m, never below 0 but on a spoofer's), take it
  /// out, or
  ///   add one;
  /// - take a satellite's view out, or add one (sorted by id at the end);
  /// - add what interferes (Arrival::interference): each signal's noise follows from its spectrum.
  /// Order of paths and Visibility are made anew behind the last disturbance. Where arrival.placement is not
  /// Free no path arrives.
  virtual void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& /*arrival*/) {}
  /// Reports events of the receiver itself at this epoch; called right behind apply(). Clock and date: add to
  /// the values of others. The last of several restarts, and of forced fixes, at one epoch counts.
  virtual void happen(const propagation::Antenna& /*antenna*/, ReceiverEvents& /*events*/) {}
};

/// Maker of one receiver's disturbance, in its state before the first epoch.
struct DisturbanceSource {
  /// Stands for all that `make` depends on but its arguments: "jammer at 114.18, 22.3, 10 W". Sources of one
  /// name are taken as the same where heat maps are stored.
  std::string name;
  /// @param seed of the run; @param receiver name: random streams are RandomStream(seed, receiver + "/..."),
  /// and so do not depend on what else runs.
  std::function<std::unique_ptr<Disturbance>(std::uint64_t seed, const std::string& receiver)> make;
};

}  // namespace canyon::disturbance
