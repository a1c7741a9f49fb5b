#pragma once

#include <complex>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/simulation/samples/generator.hpp"
#include "canyon/simulation/samples/mixer.hpp"
#include "canyon/simulation/samples/waveform.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::samples {

/// Interval over which a path keeps its amplitude, phase and rates.
inline constexpr double kBlock_s = 1e-3;

/// a + b s + c s^2 + d s^3 over [0, 1].
struct Cubic {
  double a = 0, b = 0, c = 0, d = 0;
  [[nodiscard]] double at(double s) const { return a + s * (b + s * (c + s * d)); }
};

/// A path from one epoch to the next.
struct InterpolatedPath {
  Cubic code_m, carrier_m;
  std::complex<double> from, to;            ///< amplitudes over the noise
  std::vector<std::complex<float>> fading;  ///< one per kBlock_s; empty: none
};
/// The signals that arrive from one epoch to the next.
struct SignalSegment {
  double begin_s = 0, length_s = 0;  ///< by the receiver's clock, since the whole second
  struct Signal {
    const Waveform* waveform;
    double carrier_hz;
    std::vector<InterpolatedPath> paths;
  };
  std::vector<Signal> signals;
  std::vector<tracking::ReceivedWave> waves;  ///< jammers, by power over the noise
};

/// Interpolates the paths of all signals in a front end's band between epochs.
class PathInterpolator {
 public:
  virtual ~PathInterpolator() = default;
  /// From the previous epoch to this one; empty at the first one. Waveforms have the symbols of the whole
  /// segment, and are not moved in memory.
  [[nodiscard]] virtual std::optional<SignalSegment> next(const simulation::Epoch& epoch) = 0;
  /// The receiver's clock at the last epoch, relative to zero().
  [[nodiscard]] virtual double reading_s() const = 0;
  /// The whole second that readings count from. Precondition: next() was called.
  [[nodiscard]] virtual geodesy::GpsTime zero() const = 0;
  [[nodiscard]] virtual const Generator::Contents& contents() const = 0;
  /// Key of the samples' random streams.
  [[nodiscard]] virtual std::uint64_t noise_key() const = 0;
};
/// @param made_hz rate of the computed samples: amplitudes are relative to their noise. Throws InputError if
/// the options are out of range, and if signals have no strength.
[[nodiscard]] std::unique_ptr<PathInterpolator> make_path_interpolator(
    const receiver::ReceiverOptions& options, std::uint64_t seed,
    const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end, double made_hz);

}  // namespace canyon::samples
