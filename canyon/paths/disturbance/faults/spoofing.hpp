#pragma once

#include <optional>
#include <string>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/disturbance/faults/fault.hpp"
#include "canyon/paths/disturbance/faults/transmitter.hpp"

namespace canyon::disturbance {

/// Course of a spoofer's pull-off: after a hold, position and time accelerate to a speed, and stop at an
/// offset.
struct PullOffOptions {
  double hold_s = 10;            ///< [0, 1e5]
  double rate_mps = 1;           ///< (0, 1e4]
  double acceleration_mps2 = 0;  ///< to the rate, [0, 1e3]; 0: at once
  /// The offsets at its end [m], [-1e6, 1e6]: of the position, and of the time (a common delay of all codes).
  double east_m = 0, north_m = 0, up_m = 0, clock_m = 0;

  /// Distance [m] and speed [m/s] `seconds` after its begin. @param target_m >= 0
  struct Progress {
    double travelled_m = 0, speed_mps = 0;
  };
  [[nodiscard]] Progress progress(double seconds, double target_m) const;
};
void visit(options::Visitor& v, PullOffOptions& o);

/// A transmitter of counterfeit satellite signals.
struct SpoofingOptions {
  enum class Kind : std::uint8_t { Simulated, Meaconing };
  enum class Carrier : std::uint8_t {
    FollowsCode,  ///< Doppler matches the change of the code's delay
    Held,         ///< stays at the true signals' during the code's pull-off ("frequency lock")
  };
  TransmitterOptions transmitter;
  Kind kind = Kind::Simulated;
  /// Simulated: the position that the copies show; not given: the antenna's own position, with codes and
  /// carriers aligned. Meaconing: the position of the receiving antenna; not given: the transmitter's.
  CourseOptions shows;
  PullOffOptions pull_off;
  Carrier carrier = Carrier::FollowsCode;
  /// Delay of all codes [s], [-0.01, 0.01]; Meaconing: the delay of the repeater, 0 or above.
  double delay_s = 0;
  /// Power of each signal over the true one's in a clear line of sight, before the receiver's antenna [dB],
  /// [-50, 80], with a free path from the transmitter.
  double advantage_db = 3;
  /// Instead of it: each signal's isotropically radiated power on the beam's axis [dBm], [-200, 60].
  std::optional<double> power_dbm;
  /// Power begins at ramp_from_db below its final value, and rises evenly in dB for ramp_s [s], [0, 1e5].
  double ramp_s = 0;
  double ramp_from_db = 20;
  SatelliteSet satellites;  ///< that it copies
  /// Names of gnss::signals_of(); empty: each system's signal near L1.
  std::vector<std::string> signals;
  /// Satellites below this elevation at the shown position are not sent [deg], [0, 90].
  double mask_deg = 5;

  [[nodiscard]] bool aligned() const { return kind == Kind::Simulated && !shows.given(); }
  /// Throws InputError naming the field that is missing or out of range.
  void validate() const;
};
void visit(options::Visitor& v, SpoofingOptions& o);

/// Adds a path of kind Transmitted to each copied satellite. Adds satellites that the antenna does not see,
/// and adds the copies as interference to all other satellites. The receiver's loops (tracking::Channel)
/// decide which of two signals of one code they track. Receivers without signal strength ignore the copies.
class Spoofing : public Disturbance {
 public:
  /// Throws InputError if options do not validate().
  Spoofing(const SpoofingOptions& options, FaultContext context);
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  struct Scene;
  struct Copy;
  [[nodiscard]] std::optional<Copy> copy(gnss::SatelliteId id, const Scene& scene, double dt_s) const;
  [[nodiscard]] bool sends(gnss::SatelliteId id) const;

  SpoofingOptions options_;
  FaultContext context_;
  Transmitter transmitter_;
  std::optional<Course> shown_;
  std::vector<gnss::SatelliteId> all_;
  std::vector<const gnss::Signal*> signals_;
};

}  // namespace canyon::disturbance
