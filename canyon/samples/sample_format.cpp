#include "canyon/samples/sample_format.hpp"

#include <fmt/format.h>

#include <utility>

namespace canyon::samples {
namespace {

struct FormatRow {
  std::string_view sigmf;
  std::size_t bits;
  double largest;
};
constexpr FormatRow kFormats[]{
    {"i8", 8, 127}, {"i16_le", 16, 32767}, {"f32_le", 32, 1}, {"u8", 2, 3}, {"u8", 1, 1}};
const FormatRow& row(Format format) {
  return kFormats[static_cast<std::size_t>(format)];
}

unsigned two_bits(float value) {
  constexpr float kThreshold = 2;
  if (value < 0) return value < -kThreshold ? 2 : 3;
  return value > kThreshold ? 1 : 0;
}
unsigned one_bit(float value) {
  return value < 0 ? 1 : 0;
}

}  // namespace

std::size_t bits(Format format) {
  return row(format).bits;
}

double largest(Format format) {
  return row(format).largest;
}

std::string sigmf_type(Format format, bool real) {
  return fmt::format("{}{}", real || packed(format) ? 'r' : 'c', row(format).sigmf);
}

void Encoder::encode(const Block& block, std::size_t samples, float gain, std::string& bytes) {
  const auto whole = [&](auto of) {
    using Value = decltype(of);
    bytes.resize((real_ ? 1 : 2) * samples * sizeof(Value));
    auto* out = reinterpret_cast<Value*>(bytes.data());
    if (real_) {
      quantise(block.re.data(), samples, gain, out);
    } else {
      quantise(block, samples, gain, out);
    }
  };
  const auto pack = [&](auto code, unsigned size) {
    bytes.clear();
    bytes.reserve(samples * size / 4 + 1);
    const auto put = [&](float value) {
      kept_ |= code(value * gain) << kept_bits_;
      kept_bits_ += size;
      if (kept_bits_ < 8) return;
      bytes.push_back(static_cast<char>(kept_));
      kept_ = kept_bits_ = 0;
    };
    for (std::size_t n = 0; n < samples; ++n) {
      put(block.re[n]);
      if (!real_) put(block.im[n]);
    }
  };
  switch (format_) {
    case Format::Int8:
      return whole(std::int8_t{});
    case Format::Int16:
      return whole(std::int16_t{});
    case Format::Float32:
      return whole(float{});
    case Format::TwoBit:
      return pack(two_bits, 2);
    case Format::OneBit:
      return pack(one_bit, 1);
  }
}

void Encoder::finish(std::string& bytes) {
  bytes.clear();
  if (std::exchange(kept_bits_, 0) > 0) bytes.push_back(static_cast<char>(std::exchange(kept_, 0)));
}

}  // namespace canyon::samples
