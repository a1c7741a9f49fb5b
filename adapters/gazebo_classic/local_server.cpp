#include "adapters/gazebo_classic/local_server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "canyon/base/input_error.hpp"

namespace canyon::gazebo_classic {
namespace {

constexpr int kSystemBuffer = static_cast<int>(LocalServer::kMaxBacklog);

std::string words(int error) {
  return std::generic_category().message(error);
}

bool would_block(int error) {
  return error == EAGAIN || error == EWOULDBLOCK;
}

void set_option(int fd, int level, int option, int value) {
  setsockopt(fd, level, option, &value, sizeof value);
}

FileDescriptor listen_on(int port) {
  if (port < 1 || port > 65535) {
    throw InputError(fmt::format("port {} does not exist", port), "take one of 1024 to 65535");
  }
  FileDescriptor listener(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  // A world that is loaded again finds its port although the last one's connections still end.
  set_option(listener.get(), SOL_SOCKET, SO_REUSEADDR, 1);
  if (listener.get() < 0 ||
      bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listener.get(), static_cast<int>(LocalServer::kMaxClients)) != 0) {
    const int error = errno;
    throw InputError(fmt::format("port {} of 127.0.0.1 cannot be had: {}", port, words(error)),
                     error == EACCES ? "take one of 1024 to 65535"
                                     : "give each receiver a port of its own that no other program uses");
  }
  return listener;
}

}  // namespace

FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) close(fd_);
}

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

LocalServer::LocalServer(int port) : listener_(listen_on(port)) {}
LocalServer::~LocalServer() = default;

void LocalServer::serve() {
  std::erase_if(clients_, [](Client& client) { return !listen_to(client) || !flush(client); });
  accept_clients();
}

void LocalServer::accept_clients() {
  // At most as many in one call as may be held, so that one who connects in a loop cannot keep us here.
  for (std::size_t i = 0; i < kMaxClients; ++i) {
    FileDescriptor socket(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.get() < 0) return;
    if (clients_.size() == kMaxClients) {
      const auto silent =
          std::find_if(clients_.begin(), clients_.end(), [](const Client& client) { return client.silent; });
      if (silent != clients_.end()) clients_.erase(silent);
    }
    if (clients_.size() == kMaxClients) {
      if (!full_)
        notes_.push_back(fmt::format("more than {} clients: the rest are turned away", kMaxClients));
      full_ = true;
      continue;
    }
    full_ = false;
    // An epoch goes out at once; what a client leaves unread does not grow to the system's megabytes.
    set_option(socket.get(), IPPROTO_TCP, TCP_NODELAY, 1);
    set_option(socket.get(), SOL_SOCKET, SO_SNDBUF, kSystemBuffer);
    clients_.push_back({std::move(socket), {}, false});
  }
}

void LocalServer::send(std::string_view text) {
  std::erase_if(clients_, [&](Client& client) {
    if (client.backlog.size() + text.size() > kMaxBacklog) {
      notes_.push_back("a client that does not read is dropped");
      return true;
    }
    client.backlog += text;
    return !flush(client);
  });
}

bool LocalServer::flush(Client& client) {
  std::size_t sent = 0;
  while (sent < client.backlog.size()) {
    const ssize_t n = ::send(client.socket.get(), client.backlog.data() + sent, client.backlog.size() - sent,
                             MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && !would_block(errno)) return false;
    if (n <= 0) break;
    sent += static_cast<std::size_t>(n);
  }
  client.backlog.erase(0, sent);
  return true;
}

bool LocalServer::listen_to(Client& client) {
  std::array<char, 4096> heard;
  // Bounded, so that one who talks without end cannot keep us here.
  for (int i = 0; i < 16; ++i) {
    const ssize_t n = recv(client.socket.get(), heard.data(), heard.size(), MSG_DONTWAIT);
    if (n > 0 || (n < 0 && errno == EINTR)) continue;
    if (n < 0) return would_block(errno);
    // It has no more to say but may still read (`nc` whose input has ended); a send finds out.
    client.silent = true;
    return true;
  }
  return true;
}

std::vector<std::string> LocalServer::take_notes() {
  return std::exchange(notes_, {});
}

}  // namespace canyon::gazebo_classic
