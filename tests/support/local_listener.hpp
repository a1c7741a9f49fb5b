#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

namespace canyon::test {

/// A port of 127.0.0.1 that accepts connections until stop(), which wakes up all waiting threads.
class LocalListener {
 public:
  /// @param patience_ms longest wait, so that no test hangs
  explicit LocalListener(int patience_ms) : patience_ms_(patience_ms) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (listener_ < 0 || bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        listen(listener_, 32) != 0 ||
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0 || pipe(stop_) != 0) {
      throw std::runtime_error("no local server");
    }
    port_ = ntohs(address.sin_port);
  }
  /// Call it after stop(), when no thread waits.
  ~LocalListener() {
    close(listener_);
    close(stop_[0]);
  }
  LocalListener(const LocalListener&) = delete;
  LocalListener& operator=(const LocalListener&) = delete;

  [[nodiscard]] int port() const { return port_; }
  /// Call once.
  void stop() const { close(stop_[1]); }
  /// False after stop(), or after the time-out.
  [[nodiscard]] bool readable(int file) const {
    pollfd waits[2] = {{file, POLLIN, 0}, {stop_[0], POLLIN, 0}};
    return poll(waits, 2, patience_ms_) > 0 && waits[1].revents == 0;
  }
  /// The next connection; -1 after stop(), or after the time-out. The caller closes it.
  [[nodiscard]] int next() const { return readable(listener_) ? accept(listener_, nullptr, nullptr) : -1; }

  /// Appends received bytes; false at the end of the stream, after stop(), or after the time-out.
  [[nodiscard]] bool receive(int client, std::string& text) const {
    char buffer[4096];
    if (!readable(client)) return false;
    const ssize_t n = recv(client, buffer, sizeof buffer, 0);
    if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
    return n > 0;
  }
  static void send_all(int client, const std::string& bytes) {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t n = send(client, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n <= 0) return;
      sent += static_cast<std::size_t>(n);
    }
  }

 private:
  int patience_ms_;
  int listener_ = -1;
  int stop_[2] = {-1, -1};
  int port_ = 0;
};

}  // namespace canyon::test
