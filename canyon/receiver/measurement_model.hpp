#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/signal_range.hpp"
#include "canyon/tracking/channel.hpp"

namespace canyon::receiver {

/// The antenna a time before or after an epoch.
struct Beside {
  double dt_s = 0;
  Eigen::Vector3d antenna_ecef = Eigen::Vector3d::Zero();
  geodesy::Geodetic place;
  Eigen::Matrix3d enu_from_ecef = Eigen::Matrix3d::Identity();
  double zenith_m = 0;  ///< delay in the troposphere
};

/// An epoch's values that all of its satellites share.
struct Instant {
  geodesy::GpsTime time;
  ClockReading clock;
  tracking::AntennaMotion motion;
  geodesy::Geodetic place;
  const std::map<gnss::System, gnss::Klobuchar>* klobuchar = nullptr;
  Beside before, after;  ///< by half a second, where the signals have delays of the atmosphere
};

/// Pseudoranges, Dopplers and carrier phases of tracked signals, with the receiver's own noise and delays;
/// remembers both for each signal.
class MeasurementModel {
 public:
  /// @param options must outlive this
  MeasurementModel(const ReceiverOptions& options, std::uint64_t seed);

  /// Sets the antenna's place of an epoch, and what the atmosphere's rates need.
  void place(Instant& at, const Eigen::Vector3d& antenna_ecef) const;
  /// The measurement of a tracked signal; sets the terms of its pseudorange in `observation`.
  /// @param reception of its channel; null where signals have no strength
  /// @param loops errors of its channel's loops
  /// @param drifting whether the noise has its mean of drift mode (NoiseOptions::drifts())
  [[nodiscard]] positioning::Measurement measure(const Instant& at, const propagation::SatelliteView& view,
                                                 const tracking::Reception* reception,
                                                 const tracking::LoopErrors& loops, bool drifting,
                                                 SignalObservation& observation);
  /// Delay of the receiver's models of the atmosphere [m].
  [[nodiscard]] static double atmosphere_m(const Instant& at, bool ionosphere, bool troposphere,
                                           const orbit::LineOfSight& line, double carrier_hz);

 private:
  /// Noise of one satellite's pseudorange and Doppler that does not come from its strength.
  struct SignalNoise {
    tracking::OuProcess code;
    RandomStream doppler;
    double drifted_mean_m;  ///< added to the mean in drift mode
    geodesy::GpsTime last;
  };
  /// How far a signal's bias has drifted.
  struct Drift {
    tracking::OuProcess process;
    geodesy::GpsTime last;
  };
  [[nodiscard]] SignalNoise& noise_of(gnss::SatelliteId id, const gnss::Signal& signal, geodesy::GpsTime now);
  [[nodiscard]] double bias_m(gnss::SatelliteId id, const gnss::Signal& signal, double carrier_hz,
                              geodesy::GpsTime now);
  [[nodiscard]] double atmosphere_rate_mps(const Instant& at, const orbit::LineOfSight& line,
                                           double carrier_hz) const;

  const ReceiverOptions& options_;
  std::uint64_t seed_;
  double noise_sigma_m_, noise_doppler_sigma_hz_;
  std::map<std::pair<gnss::SatelliteId, std::size_t>, SignalNoise> noises_;  // and index_of() its signal
  std::map<const gnss::Signal*, Drift> drifts_;  // of biases; signals are gnss::signals_of()'s
};

}  // namespace canyon::receiver
