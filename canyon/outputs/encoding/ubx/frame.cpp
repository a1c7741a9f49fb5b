#include "canyon/outputs/encoding/ubx/frame.hpp"

#include <algorithm>
#include <cassert>

namespace canyon::encoding::ubx {
namespace {

constexpr char kSync1 = '\xB5', kSync2 = '\x62';

/// The two bytes of Fletcher's checksum over class, ID, length and payload.
std::string checksum(std::string_view bytes) {
  std::uint8_t a = 0, b = 0;
  for (const char c : bytes) {
    a = static_cast<std::uint8_t>(a + static_cast<std::uint8_t>(c));
    b = static_cast<std::uint8_t>(b + a);
  }
  return {static_cast<char>(a), static_cast<char>(b)};
}

/// A frame or line at the beginning of bytes, as searched by UbxParser.
struct FrameSearch {
  std::size_t length = 0;  ///< 0: incomplete
  bool good = false;       ///< else these bytes are skipped
};

FrameSearch find_frame(std::string_view bytes) {
  if (bytes.size() < 2) return {};
  if (bytes[1] != kSync2) return {1, false};
  if (bytes.size() < 6) return {};
  const std::size_t length = number_at(bytes, 4, 2);
  if (length > UbxParser::kMaxPayload) return {2, false};
  if (bytes.size() < length + 8) return {};
  if (checksum(bytes.substr(2, length + 4)) != bytes.substr(length + 6, 2)) return {2, false};
  return {length + 8, true};
}

/// "$...*hh": `$`, printable characters, CR LF or LF.
FrameSearch find_line(std::string_view bytes) {
  std::size_t end = 1;
  while (end < bytes.size() && bytes[end] >= 0x20 && bytes[end] <= 0x7E && end < UbxParser::kMaxLine) ++end;
  if (end == bytes.size() && end < UbxParser::kMaxLine) return {};
  if (end < 4 || bytes[end - 3] != '*') return {1, false};
  unsigned sum = 0;
  for (const char c : bytes.substr(1, end - 4)) sum ^= static_cast<unsigned char>(c);
  const auto digit = [](unsigned value) { return "0123456789ABCDEF"[value & 15]; };
  if (bytes[end - 2] != digit(sum >> 4) || bytes[end - 1] != digit(sum)) return {1, false};
  return {end, true};
}

}  // namespace

std::string frame(MessageId id, std::string_view payload) {
  assert(payload.size() <= 0xFFFF);
  const std::string body = Payload().u1(id >> 8).u1(id & 0xFF).u2(payload.size()).raw(payload).bytes();
  return std::string{kSync1, kSync2} + body + checksum(body);
}

std::uint64_t number_at(std::string_view bytes, std::size_t offset, std::size_t size) {
  assert(offset + size <= bytes.size());
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(bytes[offset + i]);
  return value;
}

void UbxParser::receive(std::string_view bytes, const Handlers& handlers) {
  // At most one frame is buffered, for any number of bytes at once.
  while (!bytes.empty()) {
    const std::size_t taken = std::min(bytes.size(), kMaxBytes);
    waiting_ += bytes.substr(0, taken);
    bytes.remove_prefix(taken);
    std::string_view rest = waiting_;
    while (!rest.empty()) {
      const std::size_t begin = rest.find_first_of(std::string_view{"\xB5$", 2});
      rest.remove_prefix(std::min(begin, rest.size()));
      if (rest.empty()) break;
      const bool is_frame = rest.front() == kSync1;
      const FrameSearch found = is_frame ? find_frame(rest) : find_line(rest);
      if (found.length == 0) break;
      if (found.good && is_frame) {
        const auto id = static_cast<MessageId>(number_at(rest, 2, 1) << 8 | number_at(rest, 3, 1));
        handlers.frame(id, rest.substr(6, found.length - 8));
      } else if (found.good) {
        handlers.line(rest.substr(1, found.length - 4));
      }
      rest.remove_prefix(found.length);
    }
    waiting_.erase(0, waiting_.size() - rest.size());
  }
}

}  // namespace canyon::encoding::ubx
