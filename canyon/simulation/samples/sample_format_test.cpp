#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numeric>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/simulation/samples/sample_file.hpp"
#include "canyon/simulation/samples/spreading_codes.hpp"

namespace canyon::samples::sample_format_test {
namespace {

SampleBlock block_of(std::vector<float> re, std::vector<float> im) {
  SampleBlock block;
  block.re = std::move(re);
  block.im = std::move(im);
  return block;
}
std::vector<unsigned> numbers(const std::string& bytes) {
  return {reinterpret_cast<const unsigned char*>(bytes.data()),
          reinterpret_cast<const unsigned char*>(bytes.data()) + bytes.size()};
}

TEST(SampleFormat, TwoBitsFillBytesFromTheLowestOn) {
  // -3, -1, 1, 3 are 10, 11, 00, 01.
  const SampleBlock block = block_of({-2.5F, 0.5F, 1.9F}, {-0.1F, 2.1F, -7.0F});
  std::string bytes;
  SampleEncoder complex(Format::TwoBit, false);
  complex.encode(block, 3, 1, bytes);
  EXPECT_EQ(numbers(bytes), (std::vector<unsigned>{0b01'00'11'10}));
  complex.encode(block, 1, 1, bytes);  // the last sample of the previous call, and this one's
  EXPECT_EQ(numbers(bytes), (std::vector<unsigned>{0b11'10'10'00}));
  complex.finish(bytes);
  EXPECT_EQ(bytes, "");
  SampleEncoder real(Format::TwoBit, true);
  real.encode(block, 3, 1, bytes);
  EXPECT_EQ(bytes, "");
  real.finish(bytes);
  EXPECT_EQ(numbers(bytes), (std::vector<unsigned>{0b00'00'00'10}));
  real.finish(bytes);
  EXPECT_EQ(bytes, "");
}

TEST(SampleFormat, OneBitIsTheSign) {
  const SampleBlock block = block_of({-2.5F, 0.5F, 1.9F, -1, -1}, {-0.1F, 2.1F, -7.0F, 1, 1});
  std::string bytes;
  SampleEncoder encoder(Format::OneBit, false);
  encoder.encode(block, 5, 1, bytes);
  EXPECT_EQ(numbers(bytes), (std::vector<unsigned>{0b0'1'1'0'0'0'1'1}));
  encoder.finish(bytes);
  EXPECT_EQ(numbers(bytes), (std::vector<unsigned>{0b01}));
}

TEST(SampleFormat, WholeValuesAreOfOnePartOrTwo) {
  const SampleBlock block = block_of({1.6F, -300}, {-2.4F, 0.4F});
  std::string bytes;
  SampleEncoder(Format::Int8, false).encode(block, 2, 1, bytes);
  EXPECT_EQ(numbers(bytes), (std::vector<unsigned>{2, 254, 129, 0}));
  SampleEncoder(Format::Int8, true).encode(block, 2, 1, bytes);
  EXPECT_EQ(numbers(bytes), (std::vector<unsigned>{2, 129}));
  SampleEncoder(Format::Int16, true).encode(block, 2, 1, bytes);
  EXPECT_EQ(bytes.size(), 4U);
  SampleEncoder(Format::Float32, true).encode(block, 2, 1, bytes);
  EXPECT_EQ(bytes.size(), 8U);
}

TEST(SampleFormat, SigMfHasTheTypeOfPackedBytes) {
  EXPECT_EQ(sigmf_type(Format::Int8, true), "ri8");
  EXPECT_EQ(sigmf_type(Format::Int16, false), "ci16_le");
  EXPECT_EQ(sigmf_type(Format::Float32, true), "rf32_le");
  EXPECT_EQ(sigmf_type(Format::TwoBit, false), "ru8");
}

/// The values that a reader gets from the file.
std::vector<float> decoded(Format format, const std::string& bytes) {
  std::vector<float> values;
  const auto size = static_cast<unsigned>(bits(format));
  for (const unsigned byte : numbers(bytes)) {
    for (unsigned shift = 0; shift < 8; shift += size) {
      const unsigned code = byte >> shift;
      const unsigned two = code & 3U;
      values.push_back(size == 1
                           ? ((code & 1U) != 0 ? -1.F : 1.F)
                           : (two < 2 ? 2 * static_cast<float>(two) + 1 : 2 * static_cast<float>(two) - 7));
    }
  }
  return values;
}

/// A correlator's loss by a format [dB]: a C/A code on a carrier at 11 MHz / 9, in noise of deviation 1.
double loss_db(Format format, bool real, float gain) {
  const std::vector<std::int8_t> chips =
      components({gnss::System::GPS, 7}, gnss::signals_of(gnss::System::GPS)[0]).at(0).chips;
  constexpr std::size_t kSamples = 65'472, kBlocks = 300;
  constexpr double kAmplitude = 0.12, kRotations = 0.3055;
  Slots code;
  for (std::size_t i = 0; i <= 17 * 1023; ++i) code.re.push_back(static_cast<float>(chips[i % 1023]));
  SampleEncoder encoder(format, real);
  std::string bytes;
  double exact = 0, exact_power = 0, found = 0, power_found = 0;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    SampleBlock signal, block;
    signal.clear(kSamples);
    add_path(code, {0.3, 0.25575, 0.37 * static_cast<double>(b), kRotations, kAmplitude}, signal);
    block = signal;
    add_noise(1 + b, block);
    encoder.encode(block, kSamples, gain, bytes);
    const std::vector<float> values = decoded(format, bytes);
    EXPECT_EQ(values.size(), (real ? 1 : 2) * kSamples);
    for (std::size_t n = 0; n < kSamples; ++n) {
      const auto add = [&](float replica, float received, float written) {
        exact += replica * received;
        exact_power += received * received;
        found += replica * written;
        power_found += written * written;
      };
      add(signal.re[n], block.re[n], values[real ? n : 2 * n]);
      if (!real) add(signal.im[n], block.im[n], values[2 * n + 1]);
    }
  }
  return 10 * std::log10(exact * exact / exact_power / (found * found / power_found));
}

// J. H. Van Vleck and D. Middleton, Proc. IEEE 54(1), 1966: pi / 2. J. Max, IRE Trans. IT-6, 1960; A. R.
// Thompson, J. M. Moran, G. W. Swenson, Interferometry and Synthesis in Radio Astronomy, 8.3: four levels 1
// and 3 with the threshold at 0.996 deviations keep 0.881.
TEST(SampleFormat, CorrelatorsLoseWhatTheorySays) {
  for (const bool real : {false, true}) {
    EXPECT_NEAR(loss_db(Format::OneBit, real, 1), 1.96, 0.06) << real;
    EXPECT_NEAR(loss_db(Format::TwoBit, real, 2), 0.55, 0.03) << real;
    // The threshold at half of a deviation, and at two: (1 + 2 exp(-v^2/2))^2 2 / pi / (1 + 8 P(|x| > v)).
    const auto theory_db = [](double v) {
      const double kept = std::pow(1 + 2 * std::exp(-v * v / 2), 2) * 2 / geodesy::kPi /
                          (1 + 8 * std::erfc(v / std::sqrt(2.0)));
      return -10 * std::log10(kept);
    };
    EXPECT_NEAR(theory_db(1), 0.55, 0.001);
    EXPECT_NEAR(loss_db(Format::TwoBit, real, 4), theory_db(0.5), 0.05) << real;
    EXPECT_NEAR(loss_db(Format::TwoBit, real, 1), theory_db(2), 0.05) << real;
  }
}

}  // namespace
}  // namespace canyon::samples::sample_format_test
