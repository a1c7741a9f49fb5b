#include "canyon/base/mavlink/frames.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "canyon/base/arithmetic.hpp"

namespace canyon::mavlink {
namespace {

constexpr char kMagic1 = '\xFE', kMagic2 = '\xFD';
constexpr std::size_t kHeader1 = 6, kHeader2 = 10, kChecksum = 2, kSignature = 13;
constexpr unsigned kSigned = 1;  ///< incompatibility flag of a signed frame

unsigned byte_at(std::string_view bytes, std::size_t i) {
  return static_cast<unsigned char>(bytes[i]);
}

void put_bytes(std::string& to, std::uint64_t bits, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) to += static_cast<char>(bits >> (8 * i) & 0xFFU);
}

/// Little-endian.
std::uint64_t bytes_at(std::string_view from, std::size_t at, std::size_t bytes) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < bytes; ++i) bits |= std::uint64_t{byte_at(from, at + i)} << (8 * i);
  return bits;
}

struct Limits {
  double low, high;
};
Limits limits(Wire type) {
  const int bits = 8 * static_cast<int>(size_of(type));
  const bool is_signed = type == Wire::I8 || type == Wire::I16 || type == Wire::I32;
  const double top = std::ldexp(1.0, is_signed ? bits - 1 : bits);
  return {is_signed ? -top : 0, top - 1};
}

std::uint64_t bits_of(const WireField& field, double value) {
  if (field.type == Wire::F32) {
    const double count = std::isnan(value) && field.unknown ? *field.unknown : value / field.unit;
    // A double beyond float's range has no defined conversion to float.
    constexpr double kMax = std::numeric_limits<float>::max();
    const auto narrow = static_cast<float>(std::isfinite(count) ? std::clamp(count, -kMax, kMax) : count);
    return same_bytes<std::uint32_t>(narrow);
  }
  const Limits range = limits(field.type);
  double count = field.unknown.value_or(0);
  if (!std::isnan(value)) {
    count = std::round(
        std::clamp(value / field.unit, range.low, range.high - (field.unknown == range.high ? 1 : 0)));
  }
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(count));
}

double value_of(const WireField& field, std::uint64_t bits) {
  auto count = static_cast<double>(bits);
  if (field.type == Wire::F32) count = same_bytes<float>(static_cast<std::uint32_t>(bits));
  if (field.type == Wire::I8) count = static_cast<std::int8_t>(bits);
  if (field.type == Wire::I16) count = static_cast<std::int16_t>(bits);
  if (field.type == Wire::I32) count = static_cast<std::int32_t>(bits);
  return field.unknown == count ? kUnknown : count * field.unit;
}

void write(std::string& to, const WireField& field) {
  std::visit(
      [&](const auto* member) {
        for (std::size_t i = 0; i < field.count; ++i)
          if constexpr (std::is_same_v<decltype(member), const double*>)
            put_bytes(to, bits_of(field, member[i]), size_of(field.type));
          else
            put_bytes(to, static_cast<std::uint64_t>(member[i]), size_of(field.type));
      },
      field.member);
}

void read(std::string_view from, std::size_t at, const WireField& field) {
  std::visit(
      [&](auto* member) {
        using Member = std::remove_pointer_t<decltype(member)>;
        for (std::size_t i = 0; i < field.count; ++i) {
          const std::uint64_t bits = bytes_at(from, at + i * size_of(field.type), size_of(field.type));
          if constexpr (std::is_same_v<Member, double>)
            member[i] = value_of(field, bits);
          else
            member[i] = static_cast<Member>(bits);
        }
      },
      field.member);
}

/// Sorts larger elements first; extensions follow in their own order (mavlink.io, "Field Reordering").
std::vector<WireField> in_wire_order(Message& message) {
  WireFields fields;
  std::visit([&](auto& m) { m.visit(fields); }, message);
  std::vector<WireField> order(fields.all().begin(), fields.all().end());
  std::stable_sort(order.begin(), order.end(), [](const WireField& a, const WireField& b) {
    if (a.extension || b.extension) return a.extension < b.extension;
    return size_of(a.type) > size_of(b.type);
  });
  return order;
}

/// CRC_EXTRA (mavlink.io, "CRC_EXTRA Calculation").
template <typename M>
FrameLayout layout_of() {
  FrameLayout layout{M::kId, M::kName, 0, 0, 0};
  std::string signature = std::string(M::kName) + ' ';
  Message message = M{};
  for (const WireField& field : in_wire_order(message)) {
    layout.bytes += field.count * size_of(field.type);
    if (field.extension) continue;
    layout.base_bytes = layout.bytes;
    signature += std::string(name_of(field.type)) + ' ' + std::string(field.name) + ' ';
    if (field.array) signature += static_cast<char>(field.count);
  }
  const unsigned crc = crc16(signature);
  layout.crc_extra = static_cast<std::uint8_t>((crc ^ crc >> 8U) & 0xFFU);
  return layout;
}

template <std::size_t... I>
std::array<FrameLayout, sizeof...(I)> all_layouts(std::index_sequence<I...>) {
  return {layout_of<std::variant_alternative_t<I, Message>>()...};
}

template <std::size_t... I>
Message empty_message(std::size_t index, std::index_sequence<I...>) {
  Message message;
  ((index == I ? void(message.emplace<I>()) : void()), ...);
  return message;
}

/// A header at the beginning of `bytes`.
struct Header {
  Version version = Version::V2;
  std::size_t payload_at = 0, payload_bytes = 0, bytes = 0;
  std::uint8_t sequence = 0;
  Sender sender;
  std::size_t index = 0;  ///< of the message in layouts()
};

/// Empty if no readable frame begins here.
/// @param more set if further bytes are needed to decide
std::optional<Header> header(std::string_view bytes, bool& more) {
  const bool second = bytes[0] == kMagic2;
  const std::size_t header_bytes = second ? kHeader2 : kHeader1;
  more = bytes.size() < header_bytes;
  if (more) return std::nullopt;
  Header h;
  h.version = second ? Version::V2 : Version::V1;
  h.payload_at = header_bytes;
  h.payload_bytes = byte_at(bytes, 1);
  h.bytes = header_bytes + h.payload_bytes + kChecksum;
  if (second && byte_at(bytes, 2) != 0) {
    if (byte_at(bytes, 2) != kSigned) return std::nullopt;
    h.bytes += kSignature;
  }
  const std::size_t at = second ? 4 : 2;
  h.sequence = static_cast<std::uint8_t>(bytes[at]);
  h.sender = {static_cast<std::uint8_t>(bytes[at + 1]), static_cast<std::uint8_t>(bytes[at + 2])};
  const std::uint64_t id = bytes_at(bytes, at + 3, second ? 3 : 1);
  const auto& all = layouts();
  const auto found = std::find_if(all.begin(), all.end(), [&](const FrameLayout& l) { return l.id == id; });
  if (found == all.end()) return std::nullopt;
  // Some senders nevertheless put extensions into MAVLink 1.
  if (!second && (h.payload_bytes < found->base_bytes || h.payload_bytes > found->bytes)) return std::nullopt;
  h.index = static_cast<std::size_t>(found - all.begin());
  return h;
}

/// Missing trailing fields are zeros; fields added by a newer definition are skipped.
Message message_of(std::size_t index, std::string_view payload) {
  Message message = empty_message(index, std::make_index_sequence<std::variant_size_v<Message>>());
  std::string whole(payload);
  whole.resize(std::max(payload.size(), layouts()[index].bytes), '\0');
  std::size_t at = 0;
  for (const WireField& field : in_wire_order(message)) {
    read(whole, at, field);
    at += field.count * size_of(field.type);
  }
  return message;
}

constexpr std::size_t kPart = std::tuple_size_v<decltype(GpsRtcmData::data)>, kMaxParts = 4;

}  // namespace

std::size_t size_of(Wire type) {
  constexpr std::array<std::size_t, 8> kBytes{1, 1, 2, 2, 4, 4, 8, 4};
  return kBytes[static_cast<std::size_t>(type)];
}

std::string_view name_of(Wire type) {
  constexpr std::array<std::string_view, 8> kNames{"uint8_t",  "int8_t",  "uint16_t", "int16_t",
                                                   "uint32_t", "int32_t", "uint64_t", "float"};
  return kNames[static_cast<std::size_t>(type)];
}

const std::array<FrameLayout, std::variant_size_v<Message>>& layouts() {
  static const auto all = all_layouts(std::make_index_sequence<std::variant_size_v<Message>>());
  return all;
}

std::uint16_t crc16(std::string_view bytes, std::uint16_t crc) {
  for (const char c : bytes) {
    unsigned low = (static_cast<unsigned char>(c) ^ crc) & 0xFFU;
    low = (low ^ low << 4U) & 0xFFU;
    crc = static_cast<std::uint16_t>(crc >> 8U ^ low << 8U ^ low << 3U ^ low >> 4U);
  }
  return crc;
}

std::string encode(const Message& message, std::uint8_t sequence, Sender sender, Version version) {
  const FrameLayout& layout = layouts()[message.index()];
  const bool second = version == Version::V2;
  std::string payload;
  Message copy = message;
  for (const WireField& field : in_wire_order(copy))
    if (second || !field.extension) write(payload, field);
  if (second) payload.erase(std::max<std::size_t>(payload.find_last_not_of('\0') + 1, 1));
  std::string frame(1, second ? kMagic2 : kMagic1);
  put_bytes(frame, payload.size(), 1);
  if (second) put_bytes(frame, 0, 2);  // flags: none
  put_bytes(frame, sequence, 1);
  put_bytes(frame, sender.system, 1);
  put_bytes(frame, sender.component, 1);
  put_bytes(frame, layout.id, second ? 3 : 1);
  frame += payload;
  const std::uint16_t crc = crc16(std::string_view(frame).substr(1));
  put_bytes(frame, crc16({reinterpret_cast<const char*>(&layout.crc_extra), 1}, crc), kChecksum);
  return frame;
}

std::size_t frame_bytes(std::string_view bytes) {
  return (bytes[0] == kMagic2 ? kHeader2 : kHeader1) + byte_at(bytes, 1) + kChecksum;
}

void MavlinkParser::receive(std::string_view bytes, const std::function<void(const Frame&)>& each) {
  constexpr std::size_t kStep = 512;  // limits the buffer to little more than a frame for any input
  while (!bytes.empty()) {
    held_ += bytes.substr(0, kStep);
    bytes.remove_prefix(std::min(kStep, bytes.size()));
    const std::string_view all = held_;
    std::size_t at = 0;
    while (true) {
      constexpr std::array<char, 2> kMagics{kMagic1, kMagic2};
      const std::size_t begin = std::min(all.find_first_of({kMagics.data(), kMagics.size()}, at), all.size());
      passed_over_ += begin - at;
      at = begin;
      if (at == all.size()) break;
      const std::string_view rest = all.substr(at);
      bool more = false;
      const std::optional<Header> h = header(rest, more);
      if (more || (h && rest.size() < h->bytes)) break;
      const std::size_t after = h ? h->payload_at + h->payload_bytes : 0;
      if (!h || bytes_at(rest, after, kChecksum) !=
                    crc16({reinterpret_cast<const char*>(&layouts()[h->index].crc_extra), 1},
                          crc16(rest.substr(1, after - 1)))) {
        ++at;
        ++passed_over_;
        continue;
      }
      each({h->version, h->sequence, h->sender,
            message_of(h->index, rest.substr(h->payload_at, h->payload_bytes))});
      at += h->bytes;
    }
    held_.erase(0, at);
  }
}

std::vector<GpsRtcmData> rtcm_data(std::string_view message, std::uint8_t number) {
  const bool divided = message.size() > kPart && message.size() <= kMaxParts * kPart;
  std::vector<GpsRtcmData> parts;
  const auto add = [&](std::string_view bytes) {
    GpsRtcmData& part = parts.emplace_back();
    part.flags = static_cast<std::uint8_t>(number << 3U | (divided ? (parts.size() - 1) << 1U | 1U : 0U));
    part.length = static_cast<std::uint8_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), part.data.begin());
  };
  for (std::size_t at = 0; at < message.size(); at += kPart) add(message.substr(at, kPart));
  // The end is marked by a part that is not full, or by the fourth part.
  if (divided && message.size() % kPart == 0 && parts.size() < kMaxParts) add({});
  return parts;
}

}  // namespace canyon::mavlink
