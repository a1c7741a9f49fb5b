#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/outputs/encoding/ubx/configuration.hpp"
#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "canyon/paths/disturbance/faults/receiver_faults.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::encoding::ubx {

/// Responses of a device to polls.
class Outputs {
 public:
  virtual ~Outputs() = default;
  /// The payload of a message that can be polled, of the last epoch; empty if there is none.
  [[nodiscard]] virtual std::optional<std::string> output(MessageId id,
                                                          const Configuration& settings) const = 0;
};

/// Takes commands of one connection, returns the responses, and stores the settings. CFG messages are
/// acknowledged (ACK-ACK) or rejected (ACK-NAK); the response to a poll of another message is that message,
/// or none (UBX-13003221, 31.3; UBX-22008968, 3.4). `$PUBX,41` sets port and rate as CFG-PRT does.
class UbxCommands {
 public:
  /// Responses of one call are cut off after this number of bytes, like a full send buffer.
  static constexpr std::size_t kMaxResponse = 64 << 10;

  /// @param factory settings from the start; @param systems reported as enabled by CFG-GNSS
  UbxCommands(Generation generation, const Configuration& factory, const std::set<gnss::System>& systems,
              const Outputs& outputs);

  [[nodiscard]] std::string receive(std::string_view bytes);
  /// The first command that changed a setting, "CFG 0x8A"; empty: none so far.
  [[nodiscard]] const std::string& first() const { return first_; }
  [[nodiscard]] std::optional<int> take_baud();
  /// The restart requested by CFG-RST since the last call.
  [[nodiscard]] std::optional<disturbance::RestartKind> take_restart() {
    return std::exchange(restart_, std::nullopt);
  }

  [[nodiscard]] const Configuration& configuration() const { return settings_.current; }
  /// The interval of navigation solutions [ms].
  [[nodiscard]] std::int64_t interval_ms() const;
  /// False between CFG-RST's controlled stop and start.
  [[nodiscard]] bool running() const { return running_; }

 private:
  enum class Reply : std::uint8_t { Acknowledge, Refuse, Silent };

  void note_change(std::string command);
  void take(MessageId id, std::string_view payload, std::string& response);
  Reply configure(std::uint8_t id, std::string_view payload, std::string& response);
  Reply message_rate(std::string_view payload, std::string& response);
  Reply port(std::string_view payload, std::string& response);
  Reply block(MessageId id, std::string_view payload, std::string& response);
  Reply save(std::string_view payload);
  Reply restart(std::string_view payload);
  Reply set_values(std::string_view payload);
  Reply get_values(std::string_view payload, std::string& response);
  Reply delete_values(std::string_view payload);
  void take_line(std::string_view sentence);
  bool set_port(int port, std::uint64_t baud, std::uint64_t in, std::uint64_t out);

  Generation generation_;
  const Outputs& outputs_;
  /// The present settings, the saved settings (kept over a restart), and the factory settings.
  struct {
    Configuration current, saved, factory;
  } settings_;
  std::string systems_;  ///< CFG-GNSS
  UbxParser parser_;
  std::string first_;
  bool running_ = true;
  std::optional<disturbance::RestartKind> restart_;
  std::uint64_t reported_baud_;
};

}  // namespace canyon::encoding::ubx
