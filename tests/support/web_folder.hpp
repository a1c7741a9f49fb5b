#pragma once

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace canyon::test {

/// An HTTP server on 127.0.0.1 for files by their paths; 404 for all others. Each connection has a thread,
/// so that a file that stalls holds up no other. The file named "stall" is never sent.
class WebFolder {
 public:
  struct File {
    std::string body;
    std::string status = "200 OK";
    std::string headers = {};  ///< each with \r\n
  };

  explicit WebFolder(std::map<std::string, File> files) : files_(std::move(files)) {
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
    thread_ = std::thread([this] { serve(); });
  }
  ~WebFolder() {
    close(stop_[1]);  // all that waits wakes up
    thread_.join();
    for (std::thread& each : connections_) each.join();
    close(listener_);
    close(stop_[0]);
  }
  WebFolder(const WebFolder&) = delete;
  WebFolder& operator=(const WebFolder&) = delete;

  [[nodiscard]] std::string url(const std::string& path) const {
    return fmt::format("http://127.0.0.1:{}{}", port_, path);
  }
  /// Paths with queries, in the order in which they came.
  [[nodiscard]] std::vector<std::string> requests() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return requests_;
  }

 private:
  static constexpr int kPatience_ms = 20'000;  // so that no test hangs

  [[nodiscard]] bool readable(int file) const {
    pollfd waits[2] = {{file, POLLIN, 0}, {stop_[0], POLLIN, 0}};
    return poll(waits, 2, kPatience_ms) > 0 && waits[1].revents == 0;
  }

  void serve() {
    while (readable(listener_)) {
      const int client = accept(listener_, nullptr, nullptr);
      if (client < 0) return;
      connections_.emplace_back([this, client] {
        converse(client);
        close(client);
      });
    }
  }

  void converse(int client) {
    std::string request;
    char buffer[4096];
    while (readable(client)) {
      const ssize_t n = recv(client, buffer, sizeof buffer, 0);
      if (n <= 0) return;
      request.append(buffer, static_cast<std::size_t>(n));
      for (std::size_t end = request.find("\r\n\r\n"); end != std::string::npos;
           end = request.find("\r\n\r\n")) {
        const std::string target = request.substr(4, request.find(' ', 4) - 4);
        request.erase(0, end + 4);
        {
          const std::lock_guard<std::mutex> lock(mutex_);
          requests_.push_back(target);
        }
        const std::string path = target.substr(0, target.find('?'));
        if (path.find("stall") != std::string::npos) {
          (void)readable(client);
          return;
        }
        const auto found = files_.find(path);
        const File file = found != files_.end() ? found->second : File{"no", "404 Not Found", ""};
        answer(client, fmt::format("HTTP/1.1 {}\r\nContent-Length: {}\r\n{}\r\n{}", file.status,
                                   file.body.size(), file.headers, file.body));
      }
    }
  }

  static void answer(int client, const std::string& bytes) {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t n = send(client, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n <= 0) return;
      sent += static_cast<std::size_t>(n);
    }
  }

  std::map<std::string, File> files_;
  int listener_ = -1;
  int stop_[2] = {-1, -1};
  int port_ = 0;
  mutable std::mutex mutex_;
  std::vector<std::string> requests_;
  std::vector<std::thread> connections_;
  std::thread thread_;
};

}  // namespace canyon::test
