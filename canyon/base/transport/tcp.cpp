#include "canyon/base/transport/devices.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <cerrno>

#include "canyon/base/input_error.hpp"

namespace canyon::transport {

using asio::ip::tcp;

asio::ip::address_v4 listening_address(const HostPort& at) {
  if (at.host == "localhost") return asio::ip::address_v4::loopback();
  error_code error;
  auto address = asio::ip::make_address_v4(at.host, error);
  if (error) {
    throw InputError(fmt::format("'{}' is not an address to listen at", at.host),
                     "write 127.0.0.1 for programs of this machine, or 0.0.0.0 for all");
  }
  return address;
}

void refuse_port(const HostPort& at, const error_code& error) {
  throw InputError(fmt::format("port {} of {} cannot be opened: {}", at.port, at.host, error.message()),
                   error == asio::error::access_denied
                       ? "use a port of 1024 to 65535"
                       : "give each receiver a different port that no other program uses");
}

tcp::endpoint tcp_endpoint(const HostPort& to) {
  asio::io_context io;
  error_code error;
  const auto found = tcp::resolver(io).resolve(tcp::v4(), to.host, std::to_string(to.port), error);
  if (error) {
    throw InputError(fmt::format("'{}' is not a known host: {}", to.host, error.message()),
                     "write HOST:PORT with a host that this machine can resolve");
  }
  return found.begin()->endpoint();
}

tcp::acceptor listen_on(asio::io_context& io, const HostPort& at) {
  if (at.port < 1 || at.port > 65535)
    throw InputError(fmt::format("port {} does not exist", at.port), "use a port of 1024 to 65535");
  tcp::acceptor acceptor(io, tcp::v4());
  error_code error;
  // A reloaded world can use its port although the last one's connections are still closing.
  acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind({listening_address(at), static_cast<unsigned short>(at.port)}, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) refuse_port(at, error);
  claim_terminal(acceptor);
  return acceptor;
}

namespace {

/// Sends an epoch at once, and keeps the system's buffer of unread bytes small.
void set_up(tcp::socket& socket) {
  error_code error;
  socket.set_option(tcp::no_delay(true), error);
  socket.set_option(asio::socket_base::send_buffer_size(static_cast<int>(kMaxBacklog)), error);
}

/// Whether a connection that begins so uses HTTP, "GET ", "OPTIONS "; empty: needs more bytes.
std::optional<bool> is_http(std::string_view first) {
  constexpr std::size_t kMaxMethod = 16;
  const std::size_t method = first.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ");
  if (method == std::string_view::npos && first.size() <= kMaxMethod) return std::nullopt;
  return method != 0 && method != std::string_view::npos && first[method] == ' ';
}

}  // namespace

TcpServer::TcpServer(int port, const std::string& host, std::size_t maximum, bool http)
    : acceptor_(listen_on(io_, {host, port})), max_(maximum), http_(http) {
  if (!listening_address({host, port}).is_loopback())
    notes_.push_back(fmt::format("port {} is open to other machines", port));
}

// Appends bytes to a client's backlog; false if it must be dropped.
bool TcpServer::push(Client& client, std::string_view bytes) {
  if (client.backlog.size() + bytes.size() > kMaxBacklog) {
    notes_.emplace_back("a client that does not read is dropped");
    return false;
  }
  client.backlog += bytes;
  return flush(client.socket, client.backlog);
}

// Reads a client's input; Broken if the client must be dropped.
Line TcpServer::hear(Client& client) {
  Inbox unused, begin;
  if (client.leaving) return listen(client.socket, client.number, unused);
  if (!client.first) return listen(client.socket, client.number, received_);
  const Line line = listen(client.socket, client.number, begin);
  for (const Received& piece : begin.take()) *client.first += piece.bytes;
  const std::optional<bool> is = is_http(*client.first);
  if (is.value_or(false)) {
    if (!std::exchange(warned_http_, true))
      notes_.emplace_back("warning: a client that speaks HTTP, such as a page of a browser, is dropped");
    return Line::Broken;
  }
  if (!is && line == Line::Open) return line;
  if (!client.first->empty()) received_.add(client.number, *client.first);
  client.first.reset();
  return line;
}

bool TcpServer::make_room() {
  const auto gone = std::find_if(clients_.begin(), clients_.end(), [](const Client& client) {
    return client.silent || (client.leaving && client.backlog.empty());
  });
  if (gone != clients_.end()) {
    clients_.erase(gone);
    return true;
  }
  auto idle = clients_.end();
  for (auto each = clients_.begin(); each != clients_.end(); ++each) {
    error_code error;
    const bool at_work = (http_ && each->answered) || each->socket.available(error) > 0;
    if (!at_work && (idle == clients_.end() || each->answered < idle->answered)) idle = each;
  }
  if (!std::exchange(full_, true))
    notes_.push_back(
        fmt::format("more than {} clients: idle ones are replaced, the others are rejected", max_));
  if (idle == clients_.end()) return false;
  clients_.erase(idle);
  return true;
}

void TcpServer::accept_clients() {
  // Bounded, so that a client that connects in a loop cannot block the caller.
  for (std::size_t i = 0; i < max_; ++i) {
    tcp::socket socket(io_);
    error_code error;
    acceptor_.accept(socket, error);
    if (error) return;
    if (clients_.size() == max_ && !make_room()) continue;
    claim_terminal(socket);
    set_up(socket);
    Client client{std::move(socket), ++accepted_, first_};
    if (!http_) client.first.emplace();
    if (flush(client.socket, client.backlog)) clients_.push_back(std::move(client));
  }
}

std::vector<std::uint64_t> TcpServer::readers() const {
  std::vector<std::uint64_t> numbers;
  for (const Client& client : clients_)
    if (!client.leaving) numbers.push_back(client.number);
  return numbers;
}

void TcpServer::close(std::uint64_t reader) {
  for (Client& client : clients_) client.leaving = client.leaving || client.number == reader;
}

void TcpServer::serve() {
  std::erase_if(clients_, [this](Client& client) {
    const Line line = client.silent ? Line::Ended : hear(client);
    client.silent = line == Line::Ended;
    if (line == Line::Broken || !flush(client.socket, client.backlog)) return true;
    if (!client.leaving || !client.backlog.empty()) return false;
    // Closing a socket with unread input drops bytes that the other end has not read yet.
    error_code error;
    client.socket.shutdown(tcp::socket::shutdown_send, error);
    return client.silent;
  });
  accept_clients();
}

void TcpServer::send(std::string_view bytes) {
  std::erase_if(clients_, [&](Client& client) { return !push(client, bytes); });
}

void TcpServer::send_to(std::uint64_t reader, std::string_view bytes) {
  std::erase_if(clients_, [&](Client& client) {
    if (client.number != reader) return false;
    client.answered = std::chrono::steady_clock::now();
    return !push(client, bytes);
  });
}

void TcpServer::add_handles(std::vector<int>& handles) const {
  auto& self = const_cast<TcpServer&>(*this);
  handles.push_back(self.acceptor_.native_handle());
  for (Client& client : self.clients_)
    if (!client.silent) handles.push_back(client.socket.native_handle());
}

void TcpServer::finish(const std::optional<Correction>&) {
  serve();
  for (Client& client : clients_)
    asio::async_write(client.socket, asio::buffer(client.backlog), [](const error_code&, std::size_t) {});
  io_.run_for(kPatience);
  clients_.clear();
}

TcpClient::TcpClient(const HostPort& to, Clock::duration first_pause, Clock::duration longest_pause)
    : name_(fmt::format("{}:{}", to.host, to.port)),
      server_(tcp_endpoint(to)),
      first_pause_(first_pause),
      longest_pause_(longest_pause),
      pause_(first_pause) {}

void TcpClient::send(std::string_view bytes) {
  if (state_ == State::Away) return;
  if (backlog_.size() + bytes.size() > kMaxBacklog) {
    notes_.push_back(fmt::format("{} does not read: reconnecting", name_));
    leave();
    return;
  }
  backlog_ += bytes;
  serve();
}

void TcpClient::serve() {
  if (state_ == State::Away) connect();
  if (state_ == State::Connecting) see_whether_connected();
  if (state_ != State::Connected) return;
  if (listen(socket_, 0, received_) == Line::Open && flush(socket_, backlog_)) return;
  notes_.push_back(fmt::format("{} is gone: retrying every second", name_));
  leave();
}

void TcpClient::add_handles(std::vector<int>& handles) const {
  if (state_ == State::Connected) handles.push_back(const_cast<tcp::socket&>(socket_).native_handle());
}

void TcpClient::finish(const std::optional<Correction>&) {
  if (state_ != State::Connected) return;
  asio::async_write(socket_, asio::buffer(backlog_), [](const error_code&, std::size_t) {});
  io_.run_for(kPatience);
}

void TcpClient::connect() {
  if (Clock::now() < next_try_) return;
  given_up_ = Clock::now() + kMaxConnect;
  socket_ = tcp::socket(io_, tcp::v4());
  claim_terminal(socket_);
  set_up(socket_);
  // Asio's own call waits even for non-blocking sockets.
  if (::connect(socket_.native_handle(), server_.data(), static_cast<socklen_t>(server_.size())) == 0 ||
      errno == EINPROGRESS)
    state_ = State::Connecting;
  else
    fail();
}

void TcpClient::see_whether_connected() {
  pollfd wait{socket_.native_handle(), POLLOUT, 0};
  int failure = 0;
  if (poll(&wait, 1, 0) == 1) {
    socklen_t size = sizeof failure;
    getsockopt(socket_.native_handle(), SOL_SOCKET, SO_ERROR, &failure, &size);
  } else if (Clock::now() < given_up_) {
    return;
  } else {
    failure = ETIMEDOUT;
  }
  if (failure != 0) {
    fail();
    return;
  }
  state_ = State::Connected;
  ++connections_;
  if (std::exchange(warned_away_, false)) notes_.push_back(fmt::format("connected to {}", name_));
  backlog_ = first_;
}

void TcpClient::fail() {
  if (!std::exchange(warned_away_, true))
    notes_.push_back(fmt::format("{} does not respond: retrying every second", name_));
  ++failures_;
  leave();
}

void TcpClient::leave() {
  error_code error;
  socket_.close(error);
  backlog_.clear();
  state_ = State::Away;
  warned_away_ = true;
  next_try_ = Clock::now() + pause_;
  pause_ = std::min(2 * pause_, longest_pause_);
}

std::unique_ptr<Transport> make_tcp_server(const HostPort& at) {
  return std::make_unique<TcpServer>(at.port, at.host);
}
std::unique_ptr<Transport> make_tcp_client(const HostPort& to) {
  auto client = std::make_unique<TcpClient>(to);
  client->serve();
  return client;
}

}  // namespace canyon::transport
