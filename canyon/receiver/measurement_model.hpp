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

/// Values of an epoch common to all of its satellites.
struct EpochState {
  geodesy::GpsTime time;
  ClockReading clock;
  tracking::AntennaMotion motion;
  geodesy::Geodetic position;
  const std::map<gnss::System, gnss::Klobuchar>* klobuchar = nullptr;
  ShiftedAntenna before, after;  ///< by half a second, if the signals have delays of the atmosphere
};

/// The observation equation: pseudoranges, Dopplers and carrier phases of tracked signals, with the
/// receiver's own noise and delays, whose states it stores for each signal.
class MeasurementModel {
 public:
  /// @param options must outlive this
  MeasurementModel(const ReceiverOptions& options, std::uint64_t seed);

  /// Sets the antenna's position of an epoch, and the inputs of the atmosphere's rates.
  void set_geometry(EpochState& at, const Eigen::Vector3d& antenna_ecef) const;
  /// The measurement of a tracked signal; sets the terms of its pseudorange in `observation`.
  /// @param reception of its channel; null if signals have no strength
  /// @param loops errors of its channel's loops
  /// @param drifting whether the mean of the noise is in drift mode (NoiseOptions::drifts())
  [[nodiscard]] positioning::Measurement measure(const EpochState& at, const propagation::SatelliteView& view,
                                                 const tracking::Reception* reception,
                                                 const tracking::LoopErrors& loops, bool drifting,
                                                 SignalObservation& observation);

  /// Ionosphere correction of the fix for a code at 1575.42 MHz [m].
  [[nodiscard]] double ionosphere_model_m(const EpochState& at, const orbit::LineOfSight& line) const;

 private:
  /// Noise of one satellite's pseudorange and Doppler that does not depend on its strength.
  struct SignalNoise {
    tracking::OuProcess code;
    RandomStream doppler;
    double drifted_mean_m;  ///< added to the mean in drift mode
    geodesy::GpsTime last;
  };
  /// State of a signal's bias drift.
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
