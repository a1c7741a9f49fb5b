#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/propagation/paths.hpp"
#include "canyon/raytrace/ray_scene.hpp"
#include "canyon/receiver/fix.hpp"
#include "canyon/receiver/noise.hpp"

namespace canyon::receiver {

/// Pseudorange noise, one OU process per satellite; and the paper's drifting mean.
struct NoiseOptions {
  bool enabled = true;
  OuOptions ou;
  double doppler_sigma_hz = 0.1;  ///< white, per measurement; >= 0
  /// The paper's mu drift mode: while the antenna is slower than drift_below_speed_mps or fewer than
  /// drift_below_los satellites are in line of sight, each satellite's mean moves to a value drawn once per
  /// satellite from N(0, drift_mu_sigma_m).
  bool drift_enabled = false;
  double drift_below_speed_mps = 0.5;
  int drift_below_los = 5;
  double drift_mu_sigma_m = 2;
  void validate() const;
};

/// Receiver clock: bias' = drift, drift a random walk.
struct ClockOptions {
  double bias_s = 0;             ///< at the first epoch; |bias| <= 0.1 s
  double drift = 0;              ///< at the first epoch [s/s]; |drift| <= 1e-4
  double drift_walk = 0;         ///< [s/s/sqrt(s)], >= 0
  void validate() const;
};

struct ReceiverOptions {
  std::string name = "receiver";
  FixOptions fix;
  NoiseOptions noise;
  ClockOptions clock;
  bool ionosphere = false;   ///< delays are in the signal (the fix corrects them where FixOptions says so)
  bool troposphere = false;
  void validate() const;
};

/// One satellite at one epoch as the receiver saw it, with the truth behind it.
struct SatelliteObservation {
  orbit::SatelliteId id;
  double azimuth_rad = 0;    ///< true
  double elevation_rad = 0;  ///< true
  propagation::Visibility visibility = propagation::Visibility::Blocked;
  double excess_m = 0;       ///< of the tracked signal; 0 when blocked
  bool above_mask = false;
  /// Empty where nothing is received or the satellite lies below the mask.
  std::optional<Measurement> measurement;
  double noise_m = 0;              ///< OU value in the pseudorange; 0 without measurement
  double pseudorange_error_m = 0;  ///< excess + noise + atmosphere left uncorrected; 0 without measurement
  bool used = false;               ///< in the fix
};

struct ReceiverEpoch {
  geodesy::GpsTime time;           ///< true reception instant
  geodesy::GpsTime receiver_time;  ///< what the receiver's clock showed
  std::vector<SatelliteObservation> satellites;  ///< above the horizon, ascending
  Fix fix;
  int visible = 0;  ///< received, above the mask
  int blocked = 0;  ///< above the mask, nothing received
};

/// The part with memory: clock and noise of one antenna. Same options and seed, same numbers, whatever runs
/// beside it. Epochs must be given in order of time.
class Receiver {
 public:
  Receiver(ReceiverOptions options, std::uint64_t seed);
  ~Receiver();
  Receiver(Receiver&&) noexcept;
  Receiver& operator=(Receiver&&) noexcept;

  [[nodiscard]] const ReceiverOptions& options() const;

  /// @param views satellites above the horizon at `time`, as the environment answers
  /// @param ecef_from_enu rotation of the frame that the views' paths are given in
  /// @param sky used for the fix
  [[nodiscard]] ReceiverEpoch observe(geodesy::GpsTime time, const Eigen::Vector3d& antenna_ecef,
                                      const Eigen::Vector3d& antenna_velocity_ecef,
                                      std::span<const propagation::SatelliteView> views,
                                      const Eigen::Matrix3d& ecef_from_enu, raytrace::Placement placement,
                                      const orbit::Sky& sky,
                                      const std::map<orbit::System, orbit::Klobuchar>& klobuchar = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::receiver
