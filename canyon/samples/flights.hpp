#pragma once

#include <complex>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/samples/generator.hpp"
#include "canyon/samples/waveform.hpp"
#include "canyon/tracking/channel.hpp"

// From what arrives at epochs to what arrives between them.

namespace canyon::samples {

/// Paths keep their amplitude, phase and rates for so long.
inline constexpr double kBlock_s = 1e-3;

/// a + b s + c s^2 + d s^3 over [0, 1].
struct Cubic {
  double a = 0, b = 0, c = 0, d = 0;
  [[nodiscard]] double at(double s) const { return a + s * (b + s * (c + s * d)); }
};

/// A path from epoch to epoch.
struct Flight {
  Cubic code_m, carrier_m;
  std::complex<double> from, to;            ///< amplitudes over the noise
  std::vector<std::complex<float>> fading;  ///< of each kBlock_s; empty: none
};
/// What arrives from epoch to epoch.
struct Segment {
  double begin_s = 0, length_s = 0;  ///< by the receiver's clock, since the whole second
  struct Of {
    const Waveform* waveform;
    double carrier_hz;
    std::vector<Flight> flights;
  };
  std::vector<Of> signals;
  std::vector<tracking::ReceivedWave> waves;  ///< jammers, by power over the noise
};

/// Follows the paths of all signals that a front end carries.
class Flights {
 public:
  /// @param made_hz rate of the samples that are made: amplitudes are over their noise
  /// Throws InputError where the options are out of range, and where signals have no strength.
  Flights(const receiver::ReceiverOptions& options, std::uint64_t seed,
          const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end,
          double made_hz);
  ~Flights();

  /// From the epoch before to this one; empty at the first one. Waveforms have the symbols of the whole
  /// segment, and stay where they are.
  [[nodiscard]] std::optional<Segment> next(const simulation::Epoch& epoch);
  /// The receiver's clock at the last epoch, since zero().
  [[nodiscard]] double reading_s() const;
  /// The whole second that readings count from. Precondition: next() was called.
  [[nodiscard]] geodesy::GpsTime zero() const;
  [[nodiscard]] const Generator::Contents& contents() const;
  /// Of what is random in samples.
  [[nodiscard]] std::uint64_t noise_key() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::samples
