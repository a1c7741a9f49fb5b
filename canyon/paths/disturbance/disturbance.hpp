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
#include "canyon/sky/gnss/fix_kind.hpp"

namespace canyon::disturbance {

/// State that a receiver keeps in a restart: all; time and position, no ephemerides; nothing.
enum class RestartKind : std::uint8_t { Hot, Warm, Cold };

/// A restart of a receiver.
struct Restart {
  geodesy::GpsTime at;  ///< all entries with one instant are the same restart
  RestartKind kind = RestartKind::Cold;
  std::optional<double> search_s{};     ///< from a signal's presence to its first measurement; empty: default
  std::optional<double> ephemeris_s{};  ///< tracking time before the fix uses a satellite; empty: default
};

/// A fix that the receiver reports in place of its computed one. Vectors are east, north, up.
struct ForcedFix {
  gnss::FixKind kind = gnss::FixKind::None;  ///< None to Fixed
  Eigen::Vector3d error_m = Eigen::Vector3d::Zero(), sigma_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_error_mps = Eigen::Vector3d::Zero(), velocity_sigma_mps = Eigen::Vector3d::Zero();
};

/// Changes of the fix that the receiver reports, for tests of the software that uses the fix.
struct FixEdit {
  /// The receiver reports the last fix up to this time; none if it had no fix by then.
  std::optional<geodesy::GpsTime> of;
  bool first = false;                                  ///< report the first fix after that time instead
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< east, north, up, added
  std::optional<gnss::FixKind> kind;                   ///< Single to Fixed
  std::optional<double> sigma_m;                       ///< of each axis; 0: reports none
  double sigma_factor = 1;                             ///< of all reported standard deviations
  bool without_satellites = false, dropped = false;
  std::optional<double> after_outage_s;  ///< active only for this time after 2 s or more without a fix
};

/// Events inside a receiver at one epoch, independent of the signals at its antenna.
struct ReceiverEvents {
  /// Offsets of the oscillator, added to the receiver's own clock [s, s/s].
  double clock_bias_s = 0, clock_drift = 0;
  /// Errors of the date that the firmware reports: GPS weeks, and seconds of UTC.
  int weeks_off = 0, utc_off_s = 0;
  std::optional<Restart> restart{};
  /// The stage after the receiver uses these (receiver::FixFaults); a Receiver alone and heat maps do not.
  std::optional<ForcedFix> forced{};
  std::vector<FixEdit> fix_edits{};
  /// Active or future faults may use the fixes from this time on (FixEdit::of); empty: no fault does.
  std::optional<geodesy::GpsTime> fixes_from{};
  std::vector<std::string> faults{};  ///< names of the active faults (FaultTimeline)
};

/// An effect that is neither in the map nor in the orbits: traffic, foliage, jamming, spoofing, a restart. It
/// changes the signals between one antenna and its receiver, offline and live, and may have memory.
/// Subclasses override apply(), happen() or both.
class Disturbance {
 public:
  virtual ~Disturbance() = default;
  Disturbance() = default;
  Disturbance(const Disturbance&) = delete;
  Disturbance& operator=(const Disturbance&) = delete;

  /// Changes the arrival of one epoch; called once for each epoch, in order of time. It may
  /// - weaken a path (Path::amplitude_factor), delay it (excess_m, never below 0 except for a spoofer's),
  ///   remove it, or add one;
  /// - remove a satellite's view, or add one (sorted by id at the end);
  /// - add interference (Arrival::interference): each signal's noise follows from its spectrum.
  /// The order of paths and Visibility are recomputed after the last disturbance. No path arrives unless
  /// arrival.containment is Free.
  virtual void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& /*arrival*/) {}
  /// Reports events of the receiver itself at this epoch; called directly after apply(). Clock and date: add
  /// to the present values. If several restarts or forced fixes occur at one epoch, the last one counts.
  virtual void happen(const propagation::Antenna& /*antenna*/, ReceiverEvents& /*events*/) {}
};

/// Factory of one receiver's disturbance, in its state before the first epoch.
struct DisturbanceSource {
  /// Identifies everything that `make` depends on except its arguments: "jammer at 114.18, 22.3, 10 W". The
  /// cache of heat maps treats sources with equal names as equal.
  std::string name;
  /// @param seed of the run; @param receiver name: random streams are RandomStream(seed, receiver + "/..."),
  /// so they do not depend on other receivers and disturbances of the run.
  std::function<std::unique_ptr<Disturbance>(std::uint64_t seed, const std::string& receiver)> make;
};

}  // namespace canyon::disturbance
