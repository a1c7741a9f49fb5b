#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/positioning/fix.hpp"
#include "canyon/positioning/position_filter.hpp"
#include "canyon/propagation/paths.hpp"
#include "canyon/raytrace/ray_scene.hpp"
#include "canyon/tracking/clock.hpp"
#include "canyon/tracking/noise.hpp"
#include "canyon/tracking/signal_lock.hpp"
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
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};

struct ReceiverOptions {
  std::string name = "receiver";
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

/// One satellite at one epoch as the receiver saw it, with the truth behind it.
struct SatelliteObservation {
  gnss::SatelliteId id;
  double azimuth_rad = 0;    ///< true
  double elevation_rad = 0;  ///< true
  propagation::Visibility visibility = propagation::Visibility::Blocked;
  /// Code delay by paths of the tracked signal [m]: with SignalOptions::enabled where the code loop rests
  /// (multipath error of a direct signal, either sign; detour of an NLOS one), else the shortest path's
  /// excess; 0 when blocked or not tracked.
  double excess_m = 0;
  /// True C/N0 at the correlator [dB-Hz], tracked or not; empty where nothing arrives or signals have no
  /// strength (SignalOptions::enabled off). What the receiver states of it is Measurement::cn0_dbhz.
  std::optional<double> cn0_dbhz;
  /// Of the channel; Tracking for everything received where signals have no strength.
  tracking::LockState lock = tracking::LockState::Searching;
  bool above_mask = false;
  /// Empty where the satellite is not tracked or lies below the elevation mask.
  std::optional<positioning::Measurement> measurement;
  double noise_m = 0;  ///< OU value and code loop noise in the pseudorange; 0 without measurement
  /// Excess + noise + atmosphere left uncorrected (in the signal less what the fix takes off; negative where
  /// it corrects what is not there); 0 without measurement.
  double pseudorange_error_m = 0;
  bool used = false;  ///< in the fix
};

struct ReceiverEpoch {
  geodesy::GpsTime time;  ///< true reception instant
  /// What the receiver's clock showed, to the nearest nanosecond; pseudoranges hold the exact reading (a
  /// satellite moves 2 micrometres in the difference).
  geodesy::GpsTime receiver_time;
  double clock_bias_s = 0;                       ///< of the receiver, true
  double clock_drift = 0;                        ///< of the receiver, true [s/s]
  std::vector<SatelliteObservation> satellites;  ///< above the horizon, ascending
  positioning::Fix fix;  ///< of this epoch's measurements; with a position filter the filter's answer
  int visible = 0;       ///< tracked, above the mask (at the true place)
  int blocked = 0;       ///< above the mask, not tracked
};

/// The part with memory: clock, noise and channels of one antenna, and its position filter. Same options and
/// seed, same numbers, whatever runs beside it. Epochs must be given in order of time.
///
/// P = r + excess + c (bias - (satellite clock - group delay)) + ionosphere + troposphere + noise, with r the
/// geometric range to the satellite at transmission, turned with the Earth (docs/receiver.md has every sign).
class Receiver {
 public:
  /// Throws InputError where options.validate() does.
  Receiver(ReceiverOptions options, std::uint64_t seed);
  ~Receiver();
  Receiver(Receiver&&) noexcept;
  Receiver& operator=(Receiver&&) noexcept;

  [[nodiscard]] const ReceiverOptions& options() const;

  /// @param time true reception instant, not before the last call's
  /// @param antenna_ecef [m], @param antenna_velocity_ecef [m/s], in the rotating frame
  /// @param views satellites above the horizon at `time`, as the environment answers
  /// @param ecef_from_enu rotation of the frame that the views' paths are given in
  /// @param placement anything but Free: nothing is received, status NoSignal
  /// @param sky used for the fix
  /// @param klobuchar needed where options().ionosphere or FixOptions::correct_ionosphere is on
  /// Throws InputError, naming the receiver, for a pose that is not finite, time running backwards, missing
  /// Klobuchar coefficients, and, with strength, code correlators too far apart for a satellite's signal.
  /// Paths then need what their strength depends on (Path::geometry, Path::reflector, Path::scattered_power).
  [[nodiscard]] ReceiverEpoch observe(geodesy::GpsTime time, const Eigen::Vector3d& antenna_ecef,
                                      const Eigen::Vector3d& antenna_velocity_ecef,
                                      std::span<const propagation::SatelliteView> views,
                                      const Eigen::Matrix3d& ecef_from_enu, raytrace::Placement placement,
                                      const orbit::Sky& sky,
                                      const std::map<gnss::System, gnss::Klobuchar>& klobuchar = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::receiver
