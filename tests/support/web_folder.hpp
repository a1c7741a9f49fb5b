#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/local_listener.hpp"

namespace canyon::test {

/// An HTTP server on 127.0.0.1 for files by their paths; 404 for all others. Each connection has a thread, so
/// that a stalled file does not block others. The file named "stall" is never sent.
class WebFolder {
 public:
  struct File {
    std::string body;
    std::string status = "200 OK";
    std::string headers = {};  ///< each with \r\n
  };

  explicit WebFolder(std::map<std::string, File> files) : files_(std::move(files)) {
    thread_ = std::thread([this] { serve(); });
  }
  ~WebFolder() {
    listener_.stop();
    thread_.join();
    for (std::thread& each : connections_) each.join();
  }
  WebFolder(const WebFolder&) = delete;
  WebFolder& operator=(const WebFolder&) = delete;

  [[nodiscard]] std::string url(const std::string& path) const {
    return fmt::format("http://127.0.0.1:{}{}", listener_.port(), path);
  }
  /// Paths with queries, in order of arrival.
  [[nodiscard]] std::vector<std::string> requests() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return requests_;
  }

 private:
  void serve() {
    for (int client = listener_.next(); client >= 0; client = listener_.next()) {
      connections_.emplace_back([this, client] {
        converse(client);
        close(client);
      });
    }
  }

  void converse(int client) {
    std::string request;
    while (listener_.receive(client, request)) {
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
          (void)listener_.readable(client);
          return;
        }
        const auto found = files_.find(path);
        const File file = found != files_.end() ? found->second : File{"no", "404 Not Found", ""};
        LocalListener::send_all(client, fmt::format("HTTP/1.1 {}\r\nContent-Length: {}\r\n{}\r\n{}",
                                                    file.status, file.body.size(), file.headers, file.body));
      }
    }
  }

  std::map<std::string, File> files_;
  LocalListener listener_{20'000};
  mutable std::mutex mutex_;
  std::vector<std::string> requests_;
  std::vector<std::thread> connections_;
  std::thread thread_;
};

}  // namespace canyon::test
