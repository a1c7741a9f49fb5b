#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace canyon {

/// Builds the bytes of a binary message, numbers little-endian. A number that does not fit its field becomes
/// the nearest one that fits.
class Payload {
 public:
  /// The low bytes of a whole number, which may be negative.
  template <typename T>
  Payload& u1(T value) {
    return put(static_cast<std::uint64_t>(value), 1);
  }
  template <typename T>
  Payload& u2(T value) {
    return put(static_cast<std::uint64_t>(value), 2);
  }
  template <typename T>
  Payload& u4(T value) {
    return put(static_cast<std::uint64_t>(value), 4);
  }
  /// A number divided by `step`, rounded to the nearest; NaN is 0.
  Payload& unsigned_field(double value, double step, int bytes);
  Payload& signed_field(double value, double step, int bytes);
  Payload& r4(float value);
  Payload& r8(double value);
  Payload& zeros(std::size_t bytes);
  /// `size` bytes, filled with zeros.
  Payload& text(std::string_view text, std::size_t size);
  Payload& raw(std::string_view bytes);

  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  /// Low bytes, little-endian.
  Payload& put(std::uint64_t value, int bytes);
  std::string bytes_;
};

/// RFC 4648, section 4, padded.
[[nodiscard]] std::string base64(std::string_view bytes);
/// The decoded bytes; padding is optional. Empty if a character is not in the alphabet.
[[nodiscard]] std::optional<std::string> from_base64(std::string_view text);

}  // namespace canyon
