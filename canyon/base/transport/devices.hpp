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

// The transports behind open_transport(), and their common parts.
namespace asio = boost::asio;
using boost::system::error_code;

constexpr auto kPatience = std::chrono::seconds(2);
constexpr auto kRetry = std::chrono::seconds(1);

inline bool would_block(const error_code& error) {
  return error == asio::error::would_block || error == asio::error::try_again;
}

/// Makes its calls return at once, and keeps it from programs that this one starts.
template <class Device>
void make_our_own(Device& device) {
  device.non_blocking(true);
  fcntl(device.native_handle(), F_SETFD, FD_CLOEXEC);
}

/// Sends the part of a backlog that a device takes at once; false where the device is gone.
template <class Device>
bool flush(Device& device, std::string& backlog) {
  error_code error;
  std::size_t sent = 0;
  while (!error && sent < backlog.size())
    sent += device.write_some(asio::buffer(backlog.data() + sent, backlog.size() - sent), error);
  backlog.erase(0, sent);
  return !error || would_block(error);
}

/// Keeps the bytes that were received, up to kMostReceived.
class Inbox {
 public:
  void add(std::uint64_t reader, std::string_view bytes) {
    if (size_ + bytes.size() > kMostReceived) return;
    size_ += bytes.size();
    if (!whole_ && !received_.empty() && received_.back().reader == reader)
      received_.back().bytes += bytes;
    else
      received_.push_back({reader, std::string(bytes), whole_});
  }
  /// Every piece stays by itself.
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

/// A transport that keeps what was received, and its notes.
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

/// Reads the bytes that have come; bounded, so that an endless talker cannot hold the caller.
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
  std::string mount;           ///< letters, digits and . _ - + alone

  /// The credentials behind "Basic" in Authorization (RFC 7617); empty where the mount point is open.
  [[nodiscard]] std::string credentials() const;
};

/// A connection to a server, taken up again where it is lost.
class TcpClient final : public BufferedTransport {
 public:
  using Clock = std::chrono::steady_clock;

  /// Looks the host up, which waits for the system's resolver. The first serve() connects. After a failure it
  /// waits for `first_pause`, each further time twice as long, up to `longest_pause`.
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
  /// After a good answer: the next pause is the first one again.
  void reset_pause() { pause_ = first_pause_; }

 private:
  enum class State { Away, Connecting, Connected };
  static constexpr auto kLongestConnect = std::chrono::seconds(10);

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
  bool said_away_ = false;
};

[[nodiscard]] std::unique_ptr<Transport> make_tcp_server(const HostPort& at);
[[nodiscard]] std::unique_ptr<Transport> make_tcp_client(const HostPort& to);
[[nodiscard]] std::unique_ptr<Transport> make_udp(const HostPort& to);
[[nodiscard]] std::unique_ptr<Transport> make_udp_listener(const HostPort& at);
/// @param link becomes a link to it; empty: none @param baud of the line that it stands for; empty: no limit
[[nodiscard]] std::unique_ptr<Transport> make_pseudo_terminal(const std::string& link,
                                                              std::optional<int> baud);
[[nodiscard]] std::unique_ptr<Transport> make_serial(const std::string& device, int baud);
[[nodiscard]] std::unique_ptr<Transport> make_standard_input();
[[nodiscard]] std::unique_ptr<Transport> make_ntrip_mount(const NtripAddress& at);

/// "127.0.0.1:10110" as host and port. Throws InputError, naming the whole address, for anything else.
[[nodiscard]] HostPort host_and_port(std::string_view rest, std::string_view address);
/// "ntrip://USER:PASSWORD@HOST:PORT/MOUNT", by any scheme. Throws InputError for anything else.
[[nodiscard]] NtripAddress ntrip_address(std::string_view address);
/// The head of a message of HTTP with CR LF behind each line, whether its lines end so or with LF alone, and
/// the number of bytes that it took; empty: it is not whole yet.
[[nodiscard]] std::optional<std::pair<std::string, std::size_t>> http_head(std::string_view bytes);
/// Bytes as one chunk of HTTP/1.1; none are the last chunk (RFC 9112, section 7.1).
[[nodiscard]] std::string http_chunk(std::string_view bytes);

/// An address to listen at. Throws InputError for a text that is not an IPv4 address.
[[nodiscard]] asio::ip::address_v4 listening_address(const HostPort& at);
/// Where a host listens; looks it up, which waits for the system's resolver. Throws InputError for an unknown
/// host.
[[nodiscard]] asio::ip::tcp::endpoint tcp_endpoint(const HostPort& to);
/// Listens; its calls return at once. Throws InputError where TcpServer() does.
[[nodiscard]] asio::ip::tcp::acceptor listen_on(asio::io_context& io, const HostPort& at);
/// "port 10110 of 127.0.0.1 cannot be opened: ..."
[[noreturn]] void refuse_port(const HostPort& at, const error_code& error);

/// Sends one stream to all clients of a TCP port, and receives from them. It has no thread and never waits:
/// the system takes connections at any time; serve() and send() do the part of the work that needs no
/// waiting. A client whose first line is HTTP's is dropped: the page of a foreign site in the user's browser
/// could send poses and commands in a request.
class TcpServer final : public BufferedTransport {
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
  void add_handles(std::vector<int>& handles) const override;
  void finish(const std::optional<Correction>& correction) override;
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }
  /// The connected clients, without those that close() was called for.
  [[nodiscard]] std::vector<std::uint64_t> readers() const override;
  /// Ends one client's stream behind the bytes sent so far; its further bytes are thrown away.
  void close(std::uint64_t reader);

 private:
  struct Client {
    asio::ip::tcp::socket socket;
    std::uint64_t number;
    std::string backlog;
    std::optional<std::string> first = {};  ///< that it said; empty: enough to know that it is not HTTP
    std::optional<std::chrono::steady_clock::time_point> answered = {};  ///< the last time; empty: never
    /// It closed its side but may still read (`nc` whose input has ended); a send finds out. It is the first
    /// to be dropped for a new client.
    bool silent = false;
    bool leaving = false;  ///< close() was called: it gets its backlog, then the end of the stream
  };
  bool push(Client& client, std::string_view bytes);
  Line hear(Client& client);
  void accept_clients();
  /// Drops a client for a new one: one that ended, else the first that was never answered, else the one whose
  /// answer is the longest ago. Clients of HTTP that were answered are at work and stay.
  bool make_room();

  asio::io_context io_;
  asio::ip::tcp::acceptor acceptor_;
  std::size_t most_;
  bool http_;
  std::vector<Client> clients_;
  std::uint64_t accepted_ = 0;
  std::string first_;                      ///< every client gets it first
  bool full_ = false, said_http_ = false;  ///< said so already
};

}  // namespace canyon::transport
