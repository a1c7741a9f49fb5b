#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/outputs/encoding/device.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/ubx/configuration.hpp"
#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "tests/support/sample_signals.hpp"

namespace canyon::test {

using encoding::Encoder;
using encoding::ReceiverDescription;
using encoding::ubx::MessageId;
namespace ubx = encoding::ubx;

inline constexpr MessageId kAck = 0x0501, kNak = 0x0500;

/// A message of a UBX device, with its fields by offset.
struct Message {
  MessageId id = 0;
  std::string payload;

  [[nodiscard]] std::uint64_t u(std::size_t offset, std::size_t size) const {
    return ubx::number_at(payload, offset, size);
  }
  [[nodiscard]] float r4(std::size_t offset) const { return real<float>(offset); }
  [[nodiscard]] double r8(std::size_t offset) const { return real<double>(offset); }
  [[nodiscard]] std::int64_t i4(std::size_t offset) const { return static_cast<std::int32_t>(u(offset, 4)); }

 private:
  template <typename Real>
  [[nodiscard]] Real real(std::size_t offset) const {
    Real value = 0;
    std::memcpy(&value, payload.data() + offset, sizeof value);
    return value;
  }
};

inline std::vector<Message> split_frames(const std::string& bytes) {
  std::vector<Message> messages;
  std::size_t framed = 0;
  ubx::UbxParser parser;
  // Payloads longer than those of commands are identified by their length.
  for (std::string_view rest = bytes; rest.size() >= 8;) {
    const std::size_t length = ubx::number_at(rest, 4, 2);
    const auto id = static_cast<MessageId>(ubx::number_at(rest, 2, 1) << 8 | ubx::number_at(rest, 3, 1));
    messages.push_back({id, std::string(rest.substr(6, length))});
    EXPECT_EQ(ubx::frame(id, messages.back().payload), rest.substr(0, length + 8));
    framed += length + 8;
    rest.remove_prefix(length + 8);
  }
  EXPECT_EQ(framed, bytes.size());
  return messages;
}

inline std::vector<MessageId> ids(const std::vector<Message>& messages) {
  std::vector<MessageId> found;
  for (const Message& message : messages) found.push_back(message.id);
  return found;
}

/// A device of a receiver at 10 Hz, and its host.
class UbxDevice {
 public:
  explicit UbxDevice(ubx::Generation generation = ubx::Generation::F9, double interval_s = 0.1,
                     bool rtk = false, bool dead_reckoning = false) {
    ReceiverDescription receiver{"rover"};
    receiver.interval_s = interval_s;
    receiver.rtk = rtk;
    receiver.dead_reckoning = dead_reckoning;
    receiver.begin = sample_time();
    receiver.systems = {gnss::System::GPS, gnss::System::Galileo};
    receiver.glonass_channels = {{*gnss::parse_satellite("R01"), 1}, {*gnss::parse_satellite("R24"), -7}};
    receiver.ubx_generation = generation;
    encoder_ = encoding::encode_ubx(receiver);
  }
  std::vector<Message> encode(const simulation::Epoch& epoch) {
    return split_frames(encoder_->encode(epoch));
  }
  std::vector<Message> receive(const std::string& bytes) {
    return split_frames(encoder_->device()->receive(0, bytes));
  }
  std::vector<Message> send(MessageId id, const std::string& payload = {}) {
    return receive(ubx::frame(id, payload));
  }
  /// Sends a CFG message; returns whether it was acknowledged, after exactly `answers` other messages.
  bool accepts(MessageId id, const std::string& payload, std::size_t answers = 0) {
    const auto reply = send(id, payload);
    EXPECT_EQ(reply.size(), answers + 1) << std::hex << id;
    if (reply.empty()) return false;
    EXPECT_EQ(reply.back().u(0, 2), static_cast<std::uint64_t>((id & 0xFF) << 8 | id >> 8)) << std::hex << id;
    return reply.back().id == kAck;
  }
  std::optional<int> take_baud() { return encoder_->device()->take_baud(); }
  /// The number of each message in `count` epochs of the device's interval.
  std::map<MessageId, int> counts(int count, double interval_s = 0.1) {
    std::map<MessageId, int> found;
    for (int i = 0; i < count; ++i) {
      for (const Message& m :
           encode(sample_signal_epoch(sample_time() + interval_s * ++epochs_, sample_time()))) {
        ++found[m.id];
      }
    }
    return found;
  }

 private:
  std::unique_ptr<Encoder> encoder_;
  int epochs_ = -1;
};

inline const Message& find(const std::vector<Message>& messages, MessageId id) {
  static const Message none;
  for (const Message& message : messages) {
    if (message.id == id) return message;
  }
  ADD_FAILURE() << "no message " << std::hex << id;
  return none;
}

/// An epoch with a fix, and covariances of position and velocity.
inline simulation::Epoch ubx_epoch() {
  simulation::Epoch e = sample_signal_epoch(sample_time() + 0.125, sample_time());
  e.observed.fix.velocity_covariance_enu = Eigen::Vector3d(0.01, 0.04, 0.09).asDiagonal();
  return e;
}

/// Payload of CFG-VALSET.
inline std::string values(int layers, std::initializer_list<std::pair<std::uint32_t, std::uint64_t>> pairs) {
  Payload p;
  p.u1(0).u1(static_cast<std::uint64_t>(layers)).u2(0);
  for (const auto& [key, value] : pairs) {
    p.u4(key);
    for (int i = 0; i < ubx::value_size(key); ++i) p.u1(value >> (8 * i) & 0xFF);
  }
  return p.bytes();
}

}  // namespace canyon::test
