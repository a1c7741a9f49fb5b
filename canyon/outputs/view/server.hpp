#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace canyon::view {

/// Limits of a server; a request that exceeds them is rejected without effect on other clients.
struct ServerOptions {
  int port = 0;  ///< of 127.0.0.1; 0: a free one
  /// Connections at a time. A further one replaces the longest idle one, or is closed if none is.
  std::size_t max_clients = 48;          ///< >= 1
  std::size_t max_header_bytes = 8192;   ///< of an HTTP request; it has no body
  std::size_t max_message_bytes = 4096;  ///< of a WebSocket message to the server
  /// Messages queued for a slow WebSocket client, >= 2; the oldest are dropped if there are more.
  std::size_t max_queued = 64;
  /// Time-out for receiving a request, for sending a response, and for a WebSocket client's reply to a ping.
  std::chrono::milliseconds timeout{20'000};
};

/// The contents of a server.
struct ServedSite {
  std::string page;              ///< HTML, under "/"
  std::filesystem::path folder;  ///< its plain files under "/view/NAME"; nothing below it, and no links
  /// Returns the response to a WebSocket message; called on a separate thread, one message at a time. If the
  /// function or the response is empty, nothing is sent.
  std::function<std::string(const std::string& message)> handle_message = {};
};

/// HTTP and WebSocket for pages of this machine: 127.0.0.1 only, and only requests whose Host (and Origin, if
/// given) is this server, so that other pages in the user's browser cannot read it. Runs on its own thread
/// from construction to destruction.
class Server {
 public:
  /// Throws InputError if the port cannot be opened.
  explicit Server(ServedSite site, const ServerOptions& options = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] int port() const;
  /// "http://127.0.0.1:PORT/"
  [[nodiscard]] std::string address() const;
  /// Sets the messages that each WebSocket client gets first, also later clients. From any thread.
  void greet(std::vector<std::string> messages);
  /// Sends a message to every WebSocket client. Returns at once; a client that does not read loses the oldest
  /// messages. From any thread.
  void send(std::string message);
  /// Waits until all messages are sent; false if clients do not receive them within `maximum`.
  bool flush(std::chrono::milliseconds maximum);
  /// Present connections, and messages dropped since the beginning. From any thread.
  [[nodiscard]] std::size_t clients() const;
  [[nodiscard]] std::size_t dropped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::view
