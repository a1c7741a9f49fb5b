#pragma once

#include "canyon/transport/devices.hpp"

namespace canyon::transport {

/// Sends one stream to all clients of a TCP port, and receives from them. It has no thread and never waits:
/// the system takes connections at any time; serve() and send() do the part of the work that needs no
/// waiting. A client whose first line is HTTP's is dropped: the page of a foreign site in the user's browser
/// could send poses and commands in a request.
class TcpServer final : public Transport {
 public:
  /// Listens. Throws InputError for a port outside 1 to 65535, a host that is not an address of this machine,
  /// and where the system refuses the port (in use, reserved).
  /// @param most clients at a time @param http its clients speak HTTP
  explicit TcpServer(int port, const std::string& host = "127.0.0.1", std::size_t most = kMaxClients,
                     bool http = false);

  void begin(std::string_view bytes) override { first_ = bytes; }
  /// Sends to every client; a client that is dropped gets a part.
  void send(std::string_view bytes) override;
  void answer(std::uint64_t reader, std::string_view bytes) override;
  void serve() override;
  [[nodiscard]] std::vector<Received> take_received() override { return received_.take(); }
  void add_handles(std::vector<int>& handles) const override;
  void finish(const std::optional<Correction>& correction) override;
  [[nodiscard]] std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }
  /// The connected clients, without those that close() was called for.
  [[nodiscard]] std::vector<std::uint64_t> readers() const;
  /// Ends one client's stream behind the bytes sent so far; its further bytes are thrown away.
  void close(std::uint64_t reader);

 private:
  struct Client {
    asio::ip::tcp::socket socket;
    std::uint64_t number;
    std::string backlog;
    std::optional<std::string> first = {};  ///< that it said; empty: enough to know that it is not HTTP
    /// It closed its side but may still read (`nc` whose input has ended); a send finds out. It is the first
    /// to be dropped for a new client.
    bool silent = false;
    bool leaving = false;  ///< close() was called: it gets its backlog, then the end of the stream
  };
  bool push(Client& client, std::string_view bytes);
  Line hear(Client& client);
  void accept_clients();

  asio::io_context io_;
  asio::ip::tcp::acceptor acceptor_;
  std::size_t most_;
  bool http_;
  std::vector<Client> clients_;
  std::uint64_t accepted_ = 0;
  Inbox received_;
  std::string first_;  ///< every client gets it first
  std::vector<std::string> notes_;
  bool full_ = false, said_http_ = false;  ///< said so already
};

}  // namespace canyon::transport
