#pragma once

#include <cstdint>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/simulation/samples/mixer.hpp"
#include "canyon/simulation/samples/spreading_codes.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::samples {

/// The transmitted signal of a satellite: spreading codes, secondary codes, subcarriers and symbols of all
/// components. Slots are equal parts of a chip with a constant signal, counted from `zero`, a whole second
/// of the satellite's clock.
class Waveform {
 public:
  /// @param zero a whole second of GPST
  Waveform(gnss::SatelliteId id, const gnss::Signal& signal, geodesy::GpsTime zero);

  /// Whether no code of the satellite is known.
  [[nodiscard]] bool empty() const { return parts_.empty(); }
  [[nodiscard]] double slot_rate_hz() const { return slot_rate_hz_; }
  /// Power of all components over that of those in Signal::code, to which link budgets refer [1], >= 1.
  [[nodiscard]] double power_over_tracked() const { return power_over_tracked_; }

  /// Computes the symbols of [from_s, to_s] after `zero`, and discards earlier ones. Symbols without a
  /// message are +1.
  /// @return whether all data symbols are from messages
  bool read_symbols(const gnss::NavigationData& navigation, double from_s, double to_s);
  /// Slots [first, first + count), of amplitude 1 if the components' powers add to 1. Precondition:
  /// read_symbols() was called for them. @param slots replaced; its memory is reused
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

}  // namespace canyon::samples
