#pragma once

#include <fcntl.h>
#include <utility>  // which some of Boost.Asio's headers lack

#include <algorithm>
#include <array>
#include <boost/asio.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/transport/transport.hpp"

namespace canyon::transport {

// The transports that open_transport() creates, and their common parts.
namespace asio = boost::asio;
using boost::system::error_code;

constexpr auto kPatience = std::chrono::seconds(2);
constexpr auto kRetry = std::chrono::seconds(1);

inline bool would_block(const error_code& error) {
  return error == asio::error::would_block || error == asio::error::try_again;
}

/// Makes a device non-blocking, and closes it in child processes.
template <class Device>
void claim_terminal(Device& device) {
  device.non_blocking(true);
  fcntl(device.native_handle(), F_SETFD, FD_CLOEXEC);
}

/// Sends as much of a backlog as a device accepts without waiting; false if the device is gone.
template <class Device>
bool flush(Device& device, std::string& backlog) {
  error_code error;
  std::size_t sent = 0;
  while (!error && sent < backlog.size())
    sent += device.write_some(asio::buffer(backlog.data() + sent, backlog.size() - sent), error);
  backlog.erase(0, sent);
  return !error || would_block(error);
}

/// Stores the received bytes, up to kMaxReceived.
class Inbox {
 public:
  void add(std::uint64_t reader, std::string_view bytes) {
    if (size_ + bytes.size() > kMaxReceived) return;
    size_ += bytes.size();
    if (!whole_ && !received_.empty() && received_.back().reader == reader)
      received_.back().bytes += bytes;
    else
      received_.push_back({reader, std::string(bytes), whole_});
  }
  /// Keeps every piece separate.
  void keep_datagrams() { whole_ = true; }
  [[nodiscard]] std::vector<Received> take() {
    size_ = 0;
    return std::exchange(received_, {});
  }

 private:
  std::vector<Received> received_;
  std::size_t size_ = 0;
  bool whole_ = false;
};

/// A transport with a buffer of received bytes, and its notes.
class BufferedTransport : public Transport {
 public:
  [[nodiscard]] std::vector<Received> take_received() override { return received_.take(); }
  [[nodiscard]] std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }
  void finish(const std::optional<Correction>& /*correction*/) override {}

 protected:
  Inbox received_;
  std::vector<std::string> notes_;
};

enum class Line { Open, Ended, Broken };

/// Reads the available bytes; bounded, so that a peer that sends without end cannot block the caller.
template <class Device>
Line listen(Device& device, std::uint64_t reader, Inbox& inbox) {
  std::array<char, 4096> buffer;
  for (int i = 0; i < 16; ++i) {
    error_code error;
    const std::size_t size = device.read_some(asio::buffer(buffer), error);
    if (size > 0) inbox.add(reader, {buffer.data(), size});
    if (!error) continue;
    if (error == asio::error::eof) return Line::Ended;
    return would_block(error) ? Line::Open : Line::Broken;
  }
  return Line::Open;
}

struct HostPort {
  std::string host;
  int port;
};

struct NtripAddress {
  HostPort at;
  std::string user, password;  ///< both empty: the mount point is open
  std::string mount;           ///< only letters, digits and . _ - +

  /// The credentials after "Basic" in Authorization (RFC 7617); empty if the mount point is open.
  [[nodiscard]] std::string credentials() const;
};

/// A connection to a server, reconnected after a loss.
class TcpClient final : public BufferedTransport {
 public:
  using Clock = std::chrono::steady_clock;

  /// Resolves the host, which blocks on the system's resolver. The first serve() connects. The pause after a
  /// failure is `first_pause` and doubles with each further failure, up to `longest_pause`.
  /// Throws InputError for an unknown host.
  explicit TcpClient(const HostPort& to, Clock::duration first_pause = kRetry,
                     Clock::duration longest_pause = kRetry);

  /// Each connection sends these bytes first.
  void begin(std::string_view bytes) override { first_ = bytes; }
  void send(std::string_view bytes) override;
  void serve() override;
  void add_handles(std::vector<int>& handles) const override;
  void finish(const std::optional<Correction>& correction) override;

  /// Whether it is neither connected nor connecting.
  [[nodiscard]] bool away() const { return state_ == State::Away; }
  [[nodiscard]] std::uint64_t connections() const { return connections_; }  ///< made so far
  [[nodiscard]] std::uint64_t failures() const { return failures_; }        ///< to connect, so far
  /// Disconnects until the pause is over.
  void leave();
  /// After a good response: resets the pause to the first one.
  void reset_pause() { pause_ = first_pause_; }

 private:
  enum class State { Away, Connecting, Connected };
  static constexpr auto kMaxConnect = std::chrono::seconds(10);

  void connect();
  void see_whether_connected();
  void fail();

  std::string name_;
  asio::io_context io_;
  asio::ip::tcp::endpoint server_;
  asio::ip::tcp::socket socket_{io_};
  State state_ = State::Away;
  Clock::duration first_pause_, longest_pause_, pause_;
  Clock::time_point next_try_, given_up_;
  std::uint64_t connections_ = 0, failures_ = 0;
  std::string first_, backlog_;
  bool warned_away_ = false;
};

[[nodiscard]] std::unique_ptr<Transport> make_tcp_server(const HostPort& at);
[[nodiscard]] std::unique_ptr<Transport> make_tcp_client(const HostPort& to);
[[nodiscard]] std::unique_ptr<Transport> make_udp(const HostPort& to);
[[nodiscard]] std::unique_ptr<Transport> make_udp_listener(const HostPort& at);
/// @param link symbolic link to create; empty: none @param baud simulated baud rate; empty: no limit
[[nodiscard]] std::unique_ptr<Transport> make_pseudo_terminal(const std::string& link,
                                                              std::optional<int> baud);
[[nodiscard]] std::unique_ptr<Transport> make_serial(const std::string& device, int baud);
[[nodiscard]] std::unique_ptr<Transport> make_standard_input();
[[nodiscard]] std::unique_ptr<Transport> make_ntrip_mount(const NtripAddress& at);

/// "127.0.0.1:10110" as host and port. Throws InputErrorwith the whole address for anything else.
[[nodiscard]] HostPort host_and_port(std::string_view rest, std::string_view address);
/// "ntrip://USER:PASSWORD@HOST:PORT/MOUNT", by any scheme. Throws InputError for anything else.
[[nodiscard]] NtripAddress ntrip_address(std::string_view address);
/// The head of an HTTP message, with each line ended by CR LF (LF alone is accepted), and the number of bytes
/// consumed; empty: the head is incomplete.
[[nodiscard]] std::optional<std::pair<std::string, std::size_t>> http_head(std::string_view bytes);
/// Bytes as one chunk of HTTP/1.1; no bytes are the last chunk (RFC 9112, section 7.1).
[[nodiscard]] std::string http_chunk(std::string_view bytes);

/// An address to listen at. Throws InputError for a text that is not an IPv4 address.
[[nodiscard]] asio::ip::address_v4 listening_address(const HostPort& at);
/// The endpoint of a host; blocks on the system's resolver. Throws InputError for an unknown host.
[[nodiscard]] asio::ip::tcp::endpoint tcp_endpoint(const HostPort& to);
/// A non-blocking listening socket. Throws InputError as TcpServer() does.
[[nodiscard]] asio::ip::tcp::acceptor listen_on(asio::io_context& io, const HostPort& at);
/// "port 10110 of 127.0.0.1 cannot be opened: ..."
[[noreturn]] void refuse_port(const HostPort& at, const error_code& error);

/// Sends one stream to all clients of a TCP port, and receives from them. It has no thread and never waits:
/// the system accepts connections at any time; serve() and send() do the non-blocking part of the work. A
/// client whose first line is HTTP is dropped: a foreign web page in the user's browser could send poses and
/// commands in a request.
class TcpServer final : public BufferedTransport {
 public:
  /// Listens. Throws InputError for a port outside 1 to 65535, a host that is not an address of this machine,
  /// and if the system refuses the port (in use, reserved).
  /// @param most maximum number of clients @param http clients use HTTP
  explicit TcpServer(int port, const std::string& host = "127.0.0.1", std::size_t maximum = kMaxClients,
                     bool http = false);

  void begin(std::string_view bytes) override { first_ = bytes; }
  /// Sends to every client; a client that is dropped gets only a part.
  void send(std::string_view bytes) override;
  void send_to(std::uint64_t reader, std::string_view bytes) override;
  void serve() override;
  void add_handles(std::vector<int>& handles) const override;
  void finish(const std::optional<Correction>& correction) override;
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }
  /// The connected clients, without those that close() was called for.
  [[nodiscard]] std::vector<std::uint64_t> readers() const override;
  /// Ends one client's stream after the bytes sent so far; its further input is discarded.
  void close(std::uint64_t reader);

 private:
  struct Client {
    asio::ip::tcp::socket socket;
    std::uint64_t number;
    std::string backlog;
    std::optional<std::string> first = {};  ///< received start, to detect HTTP; empty: known not to be HTTP
    std::optional<std::chrono::steady_clock::time_point> answered = {};  ///< last reply; empty: never
    /// It closed its side but may still read (`nc` after the end of its input); a send finds out. Such a
    /// client is the first to be dropped for a new one.
    bool silent = false;
    bool leaving = false;  ///< close() was called: it gets its backlog, then the end of the stream
  };
  bool push(Client& client, std::string_view bytes);
  Line hear(Client& client);
  void accept_clients();
  /// Drops a client for a new one: a silent one, else the first that never got a reply, else the one with the
  /// oldest reply. Clients of HTTP that got a reply are in use and stay.
  bool make_room();

  asio::io_context io_;
  asio::ip::tcp::acceptor acceptor_;
  std::size_t max_;
  bool http_;
  std::vector<Client> clients_;
  std::uint64_t accepted_ = 0;
  std::string first_;                        ///< sent first to every client
  bool full_ = false, warned_http_ = false;  ///< already logged
};

}  // namespace canyon::transport
