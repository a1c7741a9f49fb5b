#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/options/fwd.hpp"

namespace canyon::samples {

/// Encoding of a part of a sample (Encoder has the bits).
enum class SampleFormat : std::uint8_t { Int8, Int16, Float32, TwoBit, OneBit };
/// "int8", "int16", "float32", "2bit", "1bit".
[[nodiscard]] std::string_view name(SampleFormat format);

/// The carrier [Hz] of a band: "L1", "L2", "L5", "E5", or the name of a signal (E1, E5a, B1I, G1, ...).
/// InputError for another name.
[[nodiscard]] double band_centre_hz(std::string_view band);

/// `samples:` of a scenario: front end and files of the samples that `outputs: {samples: true}` and `canyon
/// iq` write for each receiver.
struct SampleOptions {
  std::vector<std::string> bands{"L1"};  ///< one file each: names of band_centre_hz()
  double rate_hz = 4e6;                  ///< samples per second of the receiver's clock, [1e6, 200e6]
  double intermediate_hz = 0;            ///< frequency to which the centre is converted
  double bandwidth_hz = 0;               ///< two-sided, of a filter before the converter; 0: none
  bool real = false;                     ///< samples of one part
  bool noise = true;                     ///< the front end's noise
  SampleFormat format = SampleFormat::Int8;
  /// Standard deviation of the noise in each part over the largest value [1], (0, 1]; for float32 over 1.
  /// Empty: 0.25; 2/3 for 2 bits, with the threshold at one deviation. Not allowed for 1 bit.
  std::optional<double> noise_level;

  /// Throws InputError for values out of range, unknown bands, and a noise level for 1 bit.
  void validate() const;
};
void visit(options::Visitor& v, SampleOptions& o);

}  // namespace canyon::samples
