#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "canyon/receiver/receiver_options.hpp"
#include "canyon/run/epoch.hpp"
#include "canyon/run/samples/mixer.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::samples {

/// Samples of one antenna from what arrives there, epoch by epoch.
///
/// A sample is taken each 1 / rate_hz of the receiver's clock, from its reading at the first epoch on. At an
/// epoch each path's code delay and carrier phase are those that receiver::Receiver measures there without
/// its noise: P = r + excess + c (bias - satellite clock + group delay) + ionosphere + troposphere + orbit
/// error + bias of the receiver, and its phase -P / wavelength with the ionosphere's sign turned, the phase
/// of the path's own strength (signal::path_amplitude()), tracking::PathPhases and the view's turn, without a
/// group delay and an ambiguity. Between two epochs each path is followed by its kind and reflector: delay
/// and phase are cubics by their values and rates at both ends, what the atmosphere adds is linear,
/// amplitudes are linear. A path that is new, or gone, comes or goes within the epoch on the tangent of its
/// delay. Diffuse paths within a tenth of a chip are one wave of their power, with their mean delay and
/// Doppler shift, that fades as a Gauss-Markov process with the coherence of tracking::PathFades.
///
/// Strength: C/N0 as tracking::ChannelModel has it, of Signal::code's components; noise has the deviation 1
/// in each part. Real samples are sqrt(2) times the real part of complex ones and noise of deviation 1, which
/// is that of the frequencies (0, rate_hz / 2): the image is taken to be rejected.
///
/// With a bandwidth signals, jammers and noise are made at kOversampling times the rate, pass low_pass(),
/// whose delay is taken off, and are decimated; the noise still has the deviation 1. The first samples, as
/// many as half of the filter is long, lack what was before them. Jammers are waves of their spectrum and of
/// their power over the noise at each epoch, a chirp's sweeps each of another phase; strong ones take gain
/// from the signals as tracking::ChannelModel::gain_beside() has it, and keep their own power. Steps and
/// drifts of the receiver's clock by faults are not in the samples.
///
/// The bytes depend on options, seed and epochs alone, not on threads.
class Generator {
 public:
  /// @param threads 0: as many as cores
  /// Throws InputError where the front end or the receiver's options are out of range, and where its signals
  /// have no strength (SignalOptions::enabled).
  Generator(const receiver::ReceiverOptions& options, std::uint64_t seed,
            const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end,
            int threads = 0);
  ~Generator();
  Generator(Generator&&) noexcept;
  Generator& operator=(Generator&&) noexcept;

  /// The samples between the epoch before and this one, handed over in order; at the first epoch none.
  /// Epochs need an arrival, and follow each other in time.
  using Take = std::function<void(const SampleBlock& block, std::size_t samples)>;
  void next(const simulation::Epoch& epoch, const Take& take);

  /// Reading of the receiver's clock at the first sample. Valid behind the first epoch.
  [[nodiscard]] geodesy::GpsTime begin() const;
  /// Contents of the samples so far.
  struct Contents {
    std::map<std::string, std::size_t> satellites;  ///< by "GPS L1CA", most of an epoch
    std::size_t most_paths = 0;                     ///< of all satellites and signals at an epoch
    std::vector<std::string> without_message;       ///< "G05 L5": its symbols are all 0
  };
  [[nodiscard]] Contents contents() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::samples
