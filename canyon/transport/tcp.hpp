#pragma once

#include "canyon/transport/transport.hpp"

namespace canyon::transport {

/// Sends one stream to all clients of a TCP port, and receives from them. It has no thread and never waits:
/// the system takes connections at any time; serve() and send() do the part of the work that needs no
/// waiting.
class TcpServer final : public Transport {
 public:
  /// Listens. Throws InputError for a port outside 1 to 65535, a host that is not an address of this machine,
  /// and where the system refuses the port (in use, reserved).
  /// @param most clients at a time
  explicit TcpServer(int port, const std::string& host = "127.0.0.1", std::size_t most = kMaxClients);
  ~TcpServer() override;

  void begin(std::string_view bytes) override;
  /// Sends to every client; a client that is dropped gets a part.
  void send(std::string_view bytes) override;
  void answer(std::uint64_t reader, std::string_view bytes) override;
  void serve() override;
  [[nodiscard]] std::vector<Received> take_received() override;
  void add_handles(std::vector<int>& handles) const override;
  void finish(const std::optional<Correction>& correction) override;
  [[nodiscard]] std::vector<std::string> take_notes() override;
  [[nodiscard]] std::size_t clients() const;
  /// The connected clients, without those that close() was called for.
  [[nodiscard]] std::vector<std::uint64_t> readers() const;
  /// Ends one client's stream behind the bytes sent so far; its further bytes are thrown away.
  void close(std::uint64_t reader);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::transport
