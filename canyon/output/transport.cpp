#include "canyon/output/transport.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>  // which some of Boost.Asio's headers lack

#include <boost/asio.hpp>
#include <cerrno>
#include <chrono>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"

namespace canyon::output {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;

constexpr auto kPatience = std::chrono::seconds(2);

bool would_block(const error_code& error) {
  return error == asio::error::would_block || error == asio::error::try_again;
}

/// Calls return at once, and programs that this one starts do not inherit it.
template <class Device>
void make_our_own(Device& device) {
  device.non_blocking(true);
  fcntl(device.native_handle(), F_SETFD, FD_CLOEXEC);
}

/// Sends what a device takes at once of its backlog; false where the device is gone.
template <class Device>
bool flush(Device& device, std::string& backlog) {
  error_code error;
  std::size_t sent = 0;
  while (!error && sent < backlog.size()) {
    sent += device.write_some(asio::buffer(backlog.data() + sent, backlog.size() - sent), error);
  }
  backlog.erase(0, sent);
  return !error || would_block(error);
}

class File final : public Transport {
 public:
  explicit File(const std::string& path) : file_(path) {}
  void send(std::string_view bytes) override { file_.write(bytes); }
  void finish(const std::optional<Encoder::Correction>& correction) override {
    if (correction) file_.overwrite(correction->offset, correction->bytes);
    file_.commit();
  }

 private:
  OutputFile file_;
};

class Udp final : public Transport {
 public:
  Udp(const std::string& host, const std::string& port) {
    error_code error;
    const auto found = udp::resolver(io_).resolve(udp::v4(), host, port, error);
    if (!error) socket_.connect(*found.begin(), error);
    if (error) {
      throw InputError(fmt::format("nothing can be sent to '{}': {}", host, error.message()),
                       "write udp://HOST:PORT with a host that this machine knows");
    }
    make_our_own(socket_);
  }
  /// Cut behind lines where one datagram does not hold all. What the system does not take is lost, as
  /// datagrams may be.
  void send(std::string_view bytes) override {
    while (!bytes.empty()) {
      std::size_t size = std::min(bytes.size(), kLargestDatagram);
      if (size < bytes.size()) {
        const std::size_t line = bytes.rfind('\n', size - 1);
        if (line != std::string_view::npos) size = line + 1;
      }
      error_code lost;
      socket_.send(asio::buffer(bytes.data(), size), 0, lost);
      bytes.remove_prefix(size);
    }
  }
  void finish(const std::optional<Encoder::Correction>&) override {}

 private:
  asio::io_context io_;
  udp::socket socket_{io_};
};

/// A terminal device: pseudo-terminal or serial port.
class Terminal final : public Transport {
 public:
  [[nodiscard]] static std::unique_ptr<Transport> pseudo() {
    auto terminal = std::make_unique<Terminal>();
    const int master = posix_openpt(O_RDWR | O_NOCTTY);
    std::array<char, 256> name{};
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 ||
        ptsname_r(master, name.data(), name.size()) != 0) {
      const int error = errno;
      if (master >= 0) close(master);
      throw InputError("this machine gives no pseudo-terminal: " + error_text(error));
    }
    terminal->device_.assign(master);
    make_our_own(terminal->device_);
    // Open at both ends, so that readers may come and go; raw, so that bytes pass as they are.
    terminal->other_end_.assign(open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
    termios settings{};
    tcgetattr(terminal->other_end_.native_handle(), &settings);
    cfmakeraw(&settings);
    tcsetattr(terminal->other_end_.native_handle(), TCSANOW, &settings);
    terminal->notes_.push_back(fmt::format("the pseudo-terminal is {}", name.data()));
    return terminal;
  }

  [[nodiscard]] static std::unique_ptr<Transport> serial(const std::string& device, int baud) {
    auto terminal = std::make_unique<Terminal>();
    asio::serial_port port(terminal->io_);
    error_code error;
    port.open(device, error);
    if (!error) port.set_option(asio::serial_port::baud_rate(static_cast<unsigned>(baud)), error);
    if (error) {
      throw InputError(
          fmt::format("the serial port '{}' cannot be opened at {} baud: {}", device, baud, error.message()),
          "check its name, your rights (group dialout) and the baud rate");
    }
    // Asio's serial ports only know calls that wait.
    terminal->device_.assign(fcntl(port.native_handle(), F_DUPFD_CLOEXEC, 0));
    make_our_own(terminal->device_);
    return terminal;
  }

  void send(std::string_view bytes) override {
    if (backlog_.size() + bytes.size() > kMaxBacklog) {
      if (!std::exchange(behind_, true)) notes_.emplace_back("nobody reads: bytes are thrown away");
      backlog_.clear();
    }
    backlog_ += bytes;
    serve();
  }
  void serve() override {
    if (!flush(device_, backlog_)) backlog_.clear();
    if (backlog_.empty()) behind_ = false;
  }
  void finish(const std::optional<Encoder::Correction>&) override {
    asio::async_write(device_, asio::buffer(backlog_), [](const error_code&, std::size_t) {});
    io_.run_for(kPatience);
    device_.close();
  }
  [[nodiscard]] std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

 private:
  static std::string error_text(int error) {
    return error_code(error, asio::error::get_system_category()).message();
  }

  asio::io_context io_;
  asio::posix::stream_descriptor device_{io_}, other_end_{io_};
  std::string backlog_;
  std::vector<std::string> notes_;
  bool behind_ = false;  ///< said so already
};

tcp::acceptor listen_on(asio::io_context& io, int port) {
  if (port < 1 || port > 65535) {
    throw InputError(fmt::format("port {} does not exist", port), "take one of 1024 to 65535");
  }
  tcp::acceptor acceptor(io, tcp::v4());
  error_code error;
  // A world that is loaded again finds its port although the last one's connections still end.
  acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) {
    acceptor.bind({asio::ip::address_v4::loopback(), static_cast<unsigned short>(port)}, error);
  }
  if (!error) acceptor.listen(static_cast<int>(TcpServer::kMaxClients), error);
  if (error) {
    throw InputError(fmt::format("port {} of 127.0.0.1 cannot be had: {}", port, error.message()),
                     error == asio::error::access_denied
                         ? "take one of 1024 to 65535"
                         : "give each receiver a port of its own that no other program uses");
  }
  make_our_own(acceptor);
  return acceptor;
}

struct Client {
  tcp::socket socket;
  std::string backlog;
  bool silent = false;  ///< it closed its side; the first to go where there is no room

  /// False where it is gone.
  [[nodiscard]] bool listen() {
    std::array<char, 4096> heard;
    // Bounded, so that one who talks without end cannot keep us here.
    for (int i = 0; i < 16; ++i) {
      error_code error;
      socket.read_some(asio::buffer(heard), error);
      if (!error) continue;
      // It has no more to say but may still read (`nc` whose input has ended); a send finds out.
      if (error == asio::error::eof) silent = true;
      return silent || would_block(error);
    }
    return true;
  }
};

/// "127.0.0.1:2947" as host and port.
std::pair<std::string, std::string> host_and_port(std::string_view rest, std::string_view address) {
  const std::size_t colon = rest.rfind(':');
  const auto port = colon == std::string_view::npos ? std::nullopt : parse_integer(rest.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535 || colon == 0) {
    throw InputError(fmt::format("'{}' has no host and port", address),
                     "write HOST:PORT, such as 127.0.0.1:2947, with a port of 1 to 65535");
  }
  return {std::string(rest.substr(0, colon)), std::to_string(*port)};
}

/// What follows `start` in `text`; empty for other texts.
std::optional<std::string_view> behind(std::string_view text, std::string_view start) {
  if (text.substr(0, start.size()) != start) return std::nullopt;
  return text.substr(start.size());
}

}  // namespace

struct TcpServer::Impl {
  asio::io_context io;
  tcp::acceptor acceptor;
  std::vector<Client> clients;
  std::string first;  ///< what every client gets first
  std::vector<std::string> notes;
  bool full = false;  ///< said so already

  explicit Impl(int port) : acceptor(listen_on(io, port)) {}

  void accept_clients() {
    // At most as many in one call as may be held, so that one who connects in a loop cannot keep us here.
    for (std::size_t i = 0; i < kMaxClients; ++i) {
      tcp::socket socket(io);
      error_code error;
      acceptor.accept(socket, error);
      if (error) return;
      if (clients.size() == kMaxClients) {
        const auto silent =
            std::find_if(clients.begin(), clients.end(), [](const Client& client) { return client.silent; });
        if (silent != clients.end()) clients.erase(silent);
      }
      if (clients.size() == kMaxClients) {
        if (!full)
          notes.push_back(fmt::format("more than {} clients: the rest are turned away", kMaxClients));
        full = true;
        continue;
      }
      full = false;
      make_our_own(socket);
      // An epoch goes out at once; what a client leaves unread does not grow to the system's megabytes.
      socket.set_option(tcp::no_delay(true), error);
      socket.set_option(asio::socket_base::send_buffer_size(static_cast<int>(kMaxBacklog)), error);
      Client client{std::move(socket), first};
      if (flush(client.socket, client.backlog)) clients.push_back(std::move(client));
    }
  }
};

TcpServer::TcpServer(int port) : impl_(std::make_unique<Impl>(port)) {}
TcpServer::~TcpServer() = default;

std::size_t TcpServer::clients() const {
  return impl_->clients.size();
}

void TcpServer::serve() {
  std::erase_if(impl_->clients,
                [](Client& client) { return !client.listen() || !flush(client.socket, client.backlog); });
  impl_->accept_clients();
}

void TcpServer::begin(std::string_view bytes) {
  impl_->first = bytes;
}

void TcpServer::send(std::string_view bytes) {
  std::erase_if(impl_->clients, [&](Client& client) {
    if (client.backlog.size() + bytes.size() > kMaxBacklog) {
      impl_->notes.emplace_back("a client that does not read is dropped");
      return true;
    }
    client.backlog += bytes;
    return !flush(client.socket, client.backlog);
  });
}

void TcpServer::finish(const std::optional<Encoder::Correction>&) {
  serve();
  for (Client& client : impl_->clients) {
    asio::async_write(client.socket, asio::buffer(client.backlog), [](const error_code&, std::size_t) {});
  }
  impl_->io.run_for(kPatience);
  impl_->clients.clear();
}

std::vector<std::string> TcpServer::take_notes() {
  return std::exchange(impl_->notes, {});
}

bool is_file_address(std::string_view address) {
  return behind(address, "file:").has_value();
}

std::unique_ptr<Transport> open_transport(std::string_view address) {
  if (const auto path = behind(address, "file:"); path && !path->empty()) {
    return std::make_unique<File>(std::string(*path));
  }
  if (const auto rest = behind(address, "tcp://")) {
    const auto [host, port] = host_and_port(*rest, address);
    if (host != "127.0.0.1" && host != "localhost") {
      throw InputError(fmt::format("'{}': Canyon serves 127.0.0.1 only", address),
                       fmt::format("write tcp://127.0.0.1:{}", port));
    }
    return std::make_unique<TcpServer>(static_cast<int>(*parse_integer(port)));
  }
  if (const auto rest = behind(address, "udp://")) {
    const auto [host, port] = host_and_port(*rest, address);
    return std::make_unique<Udp>(host, port);
  }
  if (address == "pty:") return Terminal::pseudo();
  if (const auto rest = behind(address, "serial:")) {
    const std::size_t at = rest->rfind('@');
    const auto baud = at == std::string_view::npos ? std::nullopt : parse_integer(rest->substr(at + 1));
    if (!baud || *baud < 1 || *baud > 4'000'000 || at == 0) {
      throw InputError(fmt::format("'{}' has no device and baud rate", address),
                       "write serial:DEVICE@BAUD, such as serial:/dev/ttyUSB0@115200");
    }
    return Terminal::serial(std::string(rest->substr(0, at)), static_cast<int>(*baud));
  }
  throw InputError(fmt::format("'{}' is no address", address),
                   "write file:PATH, tcp://127.0.0.1:PORT, udp://HOST:PORT, pty: or serial:DEVICE@BAUD");
}

}  // namespace canyon::output
