#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/samples/mixer.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::samples {

/// Baseband samples at one antenna, computed from its arrivals epoch by epoch.
///
/// A sample is taken each 1 / rate_hz of the receiver's clock, from its reading at the first epoch on. At an
/// epoch, each path's code delay and carrier phase are those that receiver::Receiver measures there without
/// its noise: P = r + excess + c (bias - satellite clock + group delay) + ionosphere + troposphere + orbit
/// error + bias of the receiver. The phase is -P / wavelength with the sign of the ionosphere reversed, plus
/// the phase of the path's own strength (signal::path_amplitude()), tracking::PathPhases and the view's phase
/// offset, without a group delay and an ambiguity. Between two epochs each path is followed by its kind and
/// reflector: delay and phase are cubics by their values and rates at both ends, the part of the atmosphere
/// is linear, amplitudes are linear. A path that appears or disappears between epochs follows the tangent of
/// its delay. Diffuse paths within a tenth of a chip are one wave with their total power, mean delay and mean
/// Doppler shift; it fades as a Gauss-Markov process with the coherence of tracking::PathFades.
///
/// Strength: C/N0 of the components of Signal::code as in tracking::ChannelModel; noise has the deviation 1
/// in each part. Real samples are sqrt(2) times the real part of complex ones, and noise of deviation 1,
/// which is that of the frequencies (0, rate_hz / 2): the image is assumed to be rejected.
///
/// With a bandwidth, signals, jammers and noise are computed at kOversampling times the rate, filtered by
/// low_pass(), whose delay is removed, and decimated; the noise still has the deviation 1. The first samples,
/// half the length of the filter, lack the signal before them. Jammers are waves with their spectrum and
/// their power over the noise at each epoch; each sweep of a chirp has another phase. Strong jammers reduce
/// the gain of the signals as in tracking::ChannelModel::gain_under_interference(), and keep their own power.
/// Steps and drifts of the receiver's clock by faults are not in the samples.
///
/// The bytes depend only on options, seed and epochs, not on threads.
class Generator {
 public:
  /// @param threads 0: as many as cores
  /// Throws InputError if the front end or the receiver's options are out of range, and if its signals have
  /// no strength (SignalOptions::enabled).
  Generator(const receiver::ReceiverOptions& options, std::uint64_t seed,
            const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end,
            int threads = 0);
  ~Generator();
  Generator(Generator&&) noexcept;
  Generator& operator=(Generator&&) noexcept;

  /// Receives the samples between the previous epoch and this one, in order; none at the first epoch. Epochs
  /// need an arrival, and follow each other in time.
  using BlockHandler = std::function<void(const SampleBlock& block, std::size_t samples)>;
  void next(const simulation::Epoch& epoch, const BlockHandler& take);

  /// Reading of the receiver's clock at the first sample. Valid after the first epoch.
  [[nodiscard]] geodesy::GpsTime begin() const;
  /// Contents of the samples so far.
  struct Contents {
    std::map<std::string, std::size_t> satellites;  ///< by "GPS L1CA", maximum over epochs
    std::size_t max_paths = 0;                      ///< maximum at an epoch, of all satellites and signals
    std::vector<std::string> without_message;       ///< "G05 L5": its symbols are all 0
  };
  [[nodiscard]] Contents contents() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::samples
