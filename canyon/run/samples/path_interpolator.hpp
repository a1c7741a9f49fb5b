#pragma once

#include <complex>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/run/samples/generator.hpp"
#include "canyon/run/samples/mixer.hpp"
#include "canyon/run/samples/spreading_codes.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::samples {

/// One signal of a satellite as it is sent: spreading codes, secondary codes, subcarriers and symbols of all
/// components. Slots are equal parts of a chip within which nothing changes, counted from a whole second
/// of the satellite's clock.
class Waveform {
 public:
  /// @param zero a whole second of GPST
  Waveform(gnss::SatelliteId id, const gnss::Signal& signal, geodesy::GpsTime zero);

  /// Whether the satellite sends no known code.
  [[nodiscard]] bool empty() const { return parts_.empty(); }
  [[nodiscard]] double slot_rate_hz() const { return slot_rate_hz_; }
  /// Power of all components over that of those that Signal::code names, what link budgets are for [1], >= 1.
  [[nodiscard]] double power_over_tracked() const { return power_over_tracked_; }

  /// Makes the symbols of [from_s, to_s] after `zero`, and forgets earlier ones. Those that no message has
  /// are +1. @return whether all are messages' that have data
  bool read_symbols(const gnss::NavigationData& navigation, double from_s, double to_s);
  /// Slots [first, first + count), of amplitude 1 where the components' powers add to 1. read_symbols() was
  /// called for them. @param slots replaced; it keeps its memory
  void send(std::int64_t first, std::size_t count, Slots& slots) const;

 private:
  struct Part {
    Component component;
    double re = 1, im = 0;        ///< amplitude
    std::vector<float> patterns;  ///< of the subcarrier, one a row, for chip modulo rows
    std::int64_t rows = 1;
  };
  struct Symbols {
    double start_s = 0, symbol_s = 0;
    std::vector<std::int8_t> values;
    [[nodiscard]] double end_s() const { return start_s + symbol_s * static_cast<double>(values.size()); }
  };
  [[nodiscard]] int symbol_at(double seconds) const;
  void send(const Part& part, std::int64_t first, std::size_t count, float amplitude, float* out) const;

  gnss::SatelliteId id_;
  const gnss::Signal* signal_;
  geodesy::GpsTime zero_;
  std::int64_t second_ = 0;  ///< of the system's week, at zero
  std::int64_t slots_per_chip_ = 1;
  double slot_rate_hz_ = 0, power_over_tracked_ = 1;
  bool complex_ = false;
  std::vector<Part> parts_;
  std::vector<Symbols> symbols_;
};

/// Paths keep their amplitude, phase and rates for so long.
inline constexpr double kBlock_s = 1e-3;

/// a + b s + c s^2 + d s^3 over [0, 1].
struct Cubic {
  double a = 0, b = 0, c = 0, d = 0;
  [[nodiscard]] double at(double s) const { return a + s * (b + s * (c + s * d)); }
};

/// A path from epoch to epoch.
struct InterpolatedPath {
  Cubic code_m, carrier_m;
  std::complex<double> from, to;            ///< amplitudes over the noise
  std::vector<std::complex<float>> fading;  ///< of each kBlock_s; empty: none
};
/// The signals that arrive from epoch to epoch.
struct Segment {
  double begin_s = 0, length_s = 0;  ///< by the receiver's clock, since the whole second
  struct Signal {
    const Waveform* waveform;
    double carrier_hz;
    std::vector<InterpolatedPath> paths;
  };
  std::vector<Signal> signals;
  std::vector<tracking::ReceivedWave> waves;  ///< jammers, by power over the noise
};

/// Interpolates the paths of all signals that a front end carries between epochs.
class PathInterpolator {
 public:
  virtual ~PathInterpolator() = default;
  /// From the epoch before to this one; empty at the first one. Waveforms have the symbols of the whole
  /// segment, and stay where they are.
  [[nodiscard]] virtual std::optional<Segment> next(const simulation::Epoch& epoch) = 0;
  /// The receiver's clock at the last epoch, since zero().
  [[nodiscard]] virtual double reading_s() const = 0;
  /// The whole second that readings count from. Precondition: next() was called.
  [[nodiscard]] virtual geodesy::GpsTime zero() const = 0;
  [[nodiscard]] virtual const Generator::Contents& contents() const = 0;
  /// Key of the samples' random streams.
  [[nodiscard]] virtual std::uint64_t noise_key() const = 0;
};
/// @param made_hz rate of the samples that are made: amplitudes are over their noise
/// Throws InputError where the options are out of range, and where signals have no strength.
[[nodiscard]] std::unique_ptr<PathInterpolator> make_path_interpolator(
    const receiver::ReceiverOptions& options, std::uint64_t seed,
    const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end, double made_hz);

}  // namespace canyon::samples
