#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"

namespace canyon::encoding {

/// A receiver with commands (Encoder::device()): bytes from clients in, responses out. Several clients may
/// use one link; each is identified by its `reader` (transport::Received::reader).
class Device {
 public:
  virtual ~Device() = default;
  /// Takes bytes from a client, cut anywhere; returns the bytes of an immediate response.
  [[nodiscard]] virtual std::string receive(std::uint64_t reader, std::string_view bytes) = 0;
  /// The bytes of Encoder::encode()'s last epoch, which must still exist, for a client that configured its
  /// own output. Empty: the client gets the bytes of encode(), as reader 0 does, whose commands configure
  /// encode().
  [[nodiscard]] virtual std::optional<std::string> encode_for_reader(std::uint64_t reader) = 0;
  /// Epochs of a base that clients sent as RTCM 3 since the last call.
  [[nodiscard]] virtual std::vector<std::shared_ptr<const rtk::Corrections>> take_corrections() = 0;

  /// The command by which a client first configured its own output, since the last call; empty: none.
  [[nodiscard]] std::string take_setup_command() { return std::exchange(first_command_, {}); }
  /// The rate that a client requested since the last call, to be used after the response [baud].
  [[nodiscard]] std::optional<int> take_baud() { return std::exchange(baud_, {}); }
  /// The restart that a client requested since the last call. The caller restarts the receiver.
  [[nodiscard]] std::optional<disturbance::RestartKind> take_restart() { return std::exchange(restart_, {}); }

 protected:
  /// Records a client's commands. @param first the client's first command, if in these bytes
  template <typename Commands>
  void note(Commands& commands, bool first) {
    if (first) first_command_ = commands.first();
    if (const auto baud = commands.take_baud()) baud_ = baud;
    if (const auto restart = commands.take_restart()) restart_ = restart;
  }

 private:
  std::string first_command_;
  std::optional<int> baud_;
  std::optional<disturbance::RestartKind> restart_;
};

}  // namespace canyon::encoding
