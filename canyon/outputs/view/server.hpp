#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::view {

/// Bounds of a server; what exceeds them is refused and harms nobody else.
struct ServerOptions {
  int port = 0;  ///< of 127.0.0.1; 0: a free one
  /// Connections at a time. One more takes the place of the one that waits longest without a request; where
  /// all are at work it is closed at once.
  std::size_t most_clients = 48;          ///< >= 1
  std::size_t most_header_bytes = 8192;   ///< of an HTTP request; it has no body
  std::size_t most_message_bytes = 4096;  ///< of a WebSocket message to the server
  /// Messages that wait for a WebSocket client which reads too slowly, >= 2; of more the oldest are dropped.
  std::size_t most_waiting = 64;
  /// For a request to come whole, for an answer to be taken, for a WebSocket client to answer a ping.
  std::chrono::milliseconds timeout{20'000};
};

/// The contents of a server.
struct ServedSite {
  std::string page;              ///< HTML, under "/"
  std::filesystem::path folder;  ///< its plain files under "/view/NAME"; nothing below it, and no links
  /// Answers a WebSocket message with one of its own; called on a thread of its own, one message at a time.
  /// Empty, or an empty answer: nothing is sent.
  std::function<std::string(const std::string& message)> answer = {};
};

/// HTTP and WebSocket for pages of this machine: 127.0.0.1 alone, and only for requests whose Host (and
/// Origin, where given) is this very server, so that no foreign page in the user's browser reads along.
/// Works on a thread of its own from construction to destruction.
class Server {
 public:
  /// Throws InputError where the port cannot be opened.
  explicit Server(ServedSite site, const ServerOptions& options = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] int port() const;
  /// "http://127.0.0.1:PORT/"
  [[nodiscard]] std::string address() const;
  /// Sets the messages that each WebSocket client gets first, one that comes later as well. From any thread.
  void greet(std::vector<std::string> messages);
  /// A message to every WebSocket client. Returns at once; a client that does not read loses the oldest.
  /// From any thread.
  void send(std::string message);
  /// Waits until all messages are on their way; false where clients do not take them within `most`.
  bool flush(std::chrono::milliseconds most);
  /// Connections now, and messages that were dropped since the begin. From any thread.
  [[nodiscard]] std::size_t clients() const;
  [[nodiscard]] std::size_t dropped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::view
