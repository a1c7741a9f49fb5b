#pragma once

#include <string>

#include "canyon/samples/mixer.hpp"
#include "canyon/samples/options/sample_options.hpp"

namespace canyon::samples {

/// How a part of a sample (real or imaginary) is written; integers and floats in the machine's byte order.
///
/// TwoBit: values -3, -1, 1, 3, with the threshold at 2; the two bits are the two's complement of (value - 1)
/// / 2, so that 00 is 1, 01 is 3, 10 is -3 and 11 is -1, and four values fill a byte from its lowest bits on,
/// as GNSS-SDR's Two_Bit_Packed_File_Signal_Source reads bytes. OneBit: values 1 (bit 0) and -1 (bit 1),
/// eight of them in a byte from its lowest bit on.
using Format = SampleFormat;
/// Bits of a part.
[[nodiscard]] std::size_t bits(Format format);
/// Whether parts of other samples share a byte, which SigMF has no data type for.
[[nodiscard]] inline bool packed(Format format) {
  return bits(format) < 8;
}
/// The largest value of a part; 1 of float32, which has none.
[[nodiscard]] double largest(Format format);
/// SigMF's data type; of packed formats that of their bytes.
[[nodiscard]] std::string sigmf_type(Format format, bool real);

/// Writes samples in a format: real and imaginary part in turn, or the real part alone.
class Encoder {
 public:
  Encoder(Format format, bool real) : format_(format), real_(real) {}
  /// The first samples of a block times `gain`, to the nearest value, beyond the largest one that one.
  /// @param bytes replaced; values that fill no whole byte are kept for the next call
  void encode(const Block& block, std::size_t samples, float gain, std::string& bytes);
  /// The bits that were kept, filled up with zero bits. @param bytes replaced
  void finish(std::string& bytes);

 private:
  Format format_;
  bool real_;
  unsigned kept_ = 0, kept_bits_ = 0;
};

}  // namespace canyon::samples
