#pragma once

#include "canyon/transport/transport.hpp"

namespace canyon::transport {

/// Sends one stream to all clients of a TCP port, and receives from them. It has no thread and never waits:
/// the system takes connections at any time, and each call of serve() and send() does what can be done at
/// once.
class TcpServer final : public Transport {
 public:
  /// Listens. Throws InputError for a port outside 1 to 65535, what is no address of this machine, and where
  /// the system refuses it (in use, reserved).
  explicit TcpServer(int port, const std::string& host = "127.0.0.1");
  ~TcpServer() override;

  void begin(std::string_view bytes) override;
  /// To every client, whole or, for one that is dropped, cut.
  void send(std::string_view bytes) override;
  void answer(std::uint64_t reader, std::string_view bytes) override;
  void serve() override;
  [[nodiscard]] std::vector<Heard> take_heard() override;
  void add_handles(std::vector<int>& handles) const override;
  void finish(const std::optional<Correction>& correction) override;
  [[nodiscard]] std::vector<std::string> take_notes() override;
  [[nodiscard]] std::size_t clients() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::transport
