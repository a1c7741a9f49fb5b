#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <utility>

namespace canyon::test {

/// A connection to a port of 127.0.0.1 with a time-out of 20 s.
class LocalConnection {
 public:
  explicit LocalConnection(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("no connection");
    }
  }
  ~LocalConnection() {
    if (socket_ >= 0) close(socket_);
  }
  LocalConnection(LocalConnection&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}
  LocalConnection& operator=(LocalConnection&&) = delete;
  /// Reads at least one byte; empty at the end of the stream or after 20 s.
  std::string read_some(std::size_t maximum = 65536) {
    pollfd wait{socket_, POLLIN, 0};
    if (poll(&wait, 1, 20'000) != 1) return {};
    std::array<char, 65536> buffer;
    const ssize_t n = recv(socket_, buffer.data(), std::min(maximum, buffer.size()), 0);
    return n > 0 ? std::string(buffer.data(), static_cast<std::size_t>(n)) : std::string();
  }
  std::string read(std::size_t bytes) {
    std::string text;
    while (text.size() < bytes) {
      const std::string more = read_some(bytes - text.size());
      if (more.empty()) break;
      text += more;
    }
    return text;
  }
  [[nodiscard]] int handle() const { return socket_; }
  void send_text(const std::string& text) const { ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL); }
  void end_speech() const { shutdown(socket_, SHUT_WR); }
  /// Ends like a process killed with unread data: the peer gets a reset.
  void abort() {
    const linger now{1, 0};
    setsockopt(socket_, SOL_SOCKET, SO_LINGER, &now, sizeof now);
    close(std::exchange(socket_, -1));
  }

 private:
  int socket_;
};

}  // namespace canyon::test
