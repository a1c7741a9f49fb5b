#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "canyon/base/random.hpp"
#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::receiver {

/// An epoch's values that all of its satellites share.
struct Instant {
  geodesy::GpsTime time;
  ClockReading clock;
  tracking::AntennaMotion motion;
  geodesy::Geodetic place;
  const std::map<gnss::System, gnss::Klobuchar>* klobuchar = nullptr;
  ShiftedAntenna before, after;  ///< by half a second, where the signals have delays of the atmosphere
};

/// The observation equation: pseudoranges, Dopplers and carrier phases of tracked signals, with the
/// receiver's own noise and delays; remembers both for each signal.
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

  /// What the fix takes off a code at 1575.42 MHz for the ionosphere [m].
  [[nodiscard]] double ionosphere_model_m(const Instant& at, const orbit::LineOfSight& line) const;

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

  const ReceiverOptions& options_;
  std::uint64_t seed_;
  double noise_sigma_m_, noise_doppler_sigma_hz_;
  std::map<std::pair<gnss::SatelliteId, std::size_t>, SignalNoise> noises_;  // and index_of() its signal
  std::map<const gnss::Signal*, Drift> drifts_;  // of biases; signals are gnss::signals_of()'s
};

}  // namespace canyon::receiver
