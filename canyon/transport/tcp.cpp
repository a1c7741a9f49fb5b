#include "canyon/transport/tcp.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <cerrno>

#include "canyon/base/input_error.hpp"
#include "canyon/transport/devices.hpp"

namespace canyon::transport {

using asio::ip::tcp;

asio::ip::address_v4 listening_address(const HostPort& at) {
  if (at.host == "localhost") return asio::ip::address_v4::loopback();
  error_code error;
  auto address = asio::ip::make_address_v4(at.host, error);
  if (error) {
    throw InputError(fmt::format("'{}' is no address to listen at", at.host),
                     "write 127.0.0.1 for programs of this machine, or 0.0.0.0 for everybody");
  }
  return address;
}

void refuse_port(const HostPort& at, const error_code& error) {
  throw InputError(fmt::format("port {} of {} cannot be had: {}", at.port, at.host, error.message()),
                   error == asio::error::access_denied
                       ? "take one of 1024 to 65535"
                       : "give each receiver a port of its own that no other program uses");
}

namespace {

tcp::acceptor listen_on(asio::io_context& io, const HostPort& at) {
  if (at.port < 1 || at.port > 65535) {
    throw InputError(fmt::format("port {} does not exist", at.port), "take one of 1024 to 65535");
  }
  tcp::acceptor acceptor(io, tcp::v4());
  error_code error;
  // A world that is loaded again finds its port although the last one's connections still end.
  acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind({listening_address(at), static_cast<unsigned short>(at.port)}, error);
  if (!error) acceptor.listen(static_cast<int>(kMaxClients), error);
  if (error) refuse_port(at, error);
  make_our_own(acceptor);
  return acceptor;
}

/// An epoch goes out at once; what a reader leaves unread does not grow to the system's megabytes.
void set_up(tcp::socket& socket) {
  error_code error;
  socket.set_option(tcp::no_delay(true), error);
  socket.set_option(asio::socket_base::send_buffer_size(static_cast<int>(kMaxBacklog)), error);
}

struct Client {
  tcp::socket socket;
  std::uint64_t number;
  std::string backlog;
  /// It closed its side: it has no more to say but may still read (`nc` whose input has ended); a send finds
  /// out. The first to go where there is no room.
  bool silent = false;
};

}  // namespace

struct TcpServer::Impl {
  asio::io_context io;
  tcp::acceptor acceptor;
  std::vector<Client> clients;
  std::uint64_t accepted = 0;
  Inbox received;
  std::string first;  ///< what every client gets first
  std::vector<std::string> notes;
  bool full = false;  ///< said so already

  explicit Impl(const HostPort& at) : acceptor(listen_on(io, at)) {
    if (!listening_address(at).is_loopback()) {
      notes.push_back(fmt::format("port {} is open to other machines", at.port));
    }
  }

  /// Puts bytes behind a client's others; false where it has to go.
  bool push(Client& client, std::string_view bytes) {
    if (client.backlog.size() + bytes.size() > kMaxBacklog) {
      notes.emplace_back("a client that does not read is dropped");
      return false;
    }
    client.backlog += bytes;
    return flush(client.socket, client.backlog);
  }

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
      set_up(socket);
      Client client{std::move(socket), ++accepted, first};
      if (flush(client.socket, client.backlog)) clients.push_back(std::move(client));
    }
  }
};

TcpServer::TcpServer(int port, const std::string& host)
    : impl_(std::make_unique<Impl>(HostPort{host, port})) {}
TcpServer::~TcpServer() = default;

std::size_t TcpServer::clients() const {
  return impl_->clients.size();
}

void TcpServer::serve() {
  std::erase_if(impl_->clients, [this](Client& client) {
    const Line line = client.silent ? Line::Ended : listen(client.socket, client.number, impl_->received);
    client.silent = line == Line::Ended;
    return line == Line::Broken || !flush(client.socket, client.backlog);
  });
  impl_->accept_clients();
}

void TcpServer::begin(std::string_view bytes) {
  impl_->first = bytes;
}

void TcpServer::send(std::string_view bytes) {
  std::erase_if(impl_->clients, [&](Client& client) { return !impl_->push(client, bytes); });
}

void TcpServer::answer(std::uint64_t reader, std::string_view bytes) {
  std::erase_if(impl_->clients,
                [&](Client& client) { return client.number == reader && !impl_->push(client, bytes); });
}

std::vector<Received> TcpServer::take_received() {
  return impl_->received.take();
}

void TcpServer::add_handles(std::vector<int>& handles) const {
  handles.push_back(impl_->acceptor.native_handle());
  for (Client& client : impl_->clients) {
    if (!client.silent) handles.push_back(client.socket.native_handle());
  }
}

void TcpServer::finish(const std::optional<Correction>&) {
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

namespace {

class TcpClient final : public Transport {
 public:
  explicit TcpClient(const HostPort& to) : name_(fmt::format("{}:{}", to.host, to.port)) {
    error_code error;
    const auto found = tcp::resolver(io_).resolve(tcp::v4(), to.host, std::to_string(to.port), error);
    if (error) {
      throw InputError(fmt::format("'{}' is no host: {}", to.host, error.message()),
                       "write tcp-connect://HOST:PORT with a host that this machine knows");
    }
    server_ = found.begin()->endpoint();
    serve();
  }

  void begin(std::string_view bytes) override { first_ = bytes; }
  void send(std::string_view bytes) override {
    if (state_ == State::Away) return;
    if (backlog_.size() + bytes.size() > kMaxBacklog) {
      notes_.push_back(fmt::format("{} does not read: connected anew", name_));
      leave();
      return;
    }
    backlog_ += bytes;
    serve();
  }
  void serve() override {
    if (state_ == State::Away) connect();
    if (state_ == State::Connecting) see_whether_connected();
    if (state_ != State::Connected) return;
    if (listen(socket_, 0, received_) == Line::Open && flush(socket_, backlog_)) return;
    notes_.push_back(fmt::format("{} is gone: tried again every second", name_));
    leave();
  }
  [[nodiscard]] std::vector<Received> take_received() override { return received_.take(); }
  void add_handles(std::vector<int>& handles) const override {
    if (state_ == State::Connected) handles.push_back(const_cast<tcp::socket&>(socket_).native_handle());
  }
  void finish(const std::optional<Correction>&) override {
    if (state_ != State::Connected) return;
    asio::async_write(socket_, asio::buffer(backlog_), [](const error_code&, std::size_t) {});
    io_.run_for(kPatience);
  }
  [[nodiscard]] std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

 private:
  enum class State { Away, Connecting, Connected };
  using Clock = std::chrono::steady_clock;

  void connect() {
    if (Clock::now() < next_try_) return;
    next_try_ = Clock::now() + kRetry;
    socket_ = tcp::socket(io_, tcp::v4());
    make_our_own(socket_);
    set_up(socket_);
    // Asio's own call waits for non-blocking sockets too.
    if (::connect(socket_.native_handle(), server_.data(), static_cast<socklen_t>(server_.size())) == 0 ||
        errno == EINPROGRESS) {
      state_ = State::Connecting;
    } else {
      away();
    }
  }
  void see_whether_connected() {
    pollfd wait{socket_.native_handle(), POLLOUT, 0};
    if (poll(&wait, 1, 0) != 1) return;
    int failure = 0;
    socklen_t size = sizeof failure;
    getsockopt(socket_.native_handle(), SOL_SOCKET, SO_ERROR, &failure, &size);
    if (failure != 0) {
      away();
      return;
    }
    state_ = State::Connected;
    if (std::exchange(said_away_, false)) notes_.push_back(fmt::format("connected to {}", name_));
    backlog_ = first_;
  }
  void away() {
    if (!std::exchange(said_away_, true)) {
      notes_.push_back(fmt::format("{} does not answer: tried again every second", name_));
    }
    leave();
  }
  void leave() {
    error_code error;
    socket_.close(error);
    backlog_.clear();
    state_ = State::Away;
    said_away_ = true;
    next_try_ = Clock::now() + kRetry;
  }

  std::string name_;
  asio::io_context io_;
  tcp::endpoint server_;
  tcp::socket socket_{io_};
  State state_ = State::Away;
  Clock::time_point next_try_;
  Inbox received_;
  std::string first_, backlog_;
  std::vector<std::string> notes_;
  bool said_away_ = false;
};

}  // namespace

std::unique_ptr<Transport> make_tcp_server(const HostPort& at) {
  return std::make_unique<TcpServer>(at.port, at.host);
}
std::unique_ptr<Transport> make_tcp_client(const HostPort& to) {
  return std::make_unique<TcpClient>(to);
}

}  // namespace canyon::transport
