#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::gazebo_classic {

/// A closed-on-destruction file descriptor.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

/// Sends one stream of text to whoever connects to a TCP port of 127.0.0.1. It has no thread and never waits:
/// the system takes connections at any time, and each call of serve() and send() does what can be done at
/// once. What clients say is thrown away.
class LocalServer {
 public:
  /// Clients at a time; more are turned away.
  static constexpr std::size_t kMaxClients = 16;
  /// Bytes kept for a client that does not read as fast as they come, beside the system's own buffers (about
  /// as much again); who falls behind further is dropped. Ten seconds of NMEA at 10 Hz.
  static constexpr std::size_t kMaxBacklog = 256 * 1024;

  /// Listens. Throws InputError for a port outside 1 to 65535, and where the system refuses it (in use,
  /// reserved).
  explicit LocalServer(int port);
  ~LocalServer();

  /// Takes new clients, lets go of those that left, and sends on what was kept for the others.
  void serve();
  /// `text` to every client, whole or, for one that is dropped, cut.
  void send(std::string_view text);
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }

  /// What there is to say since the last call, one line each: clients dropped or turned away.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  struct Client {
    FileDescriptor socket;
    std::string backlog;
    bool silent = false;  ///< it closed its side; the first to go where there is no room
  };
  void accept_clients();
  /// False where the client is gone.
  [[nodiscard]] static bool flush(Client& client);
  [[nodiscard]] static bool listen_to(Client& client);

  FileDescriptor listener_;
  std::vector<Client> clients_;
  std::vector<std::string> notes_;
  bool full_ = false;  ///< said so already
};

}  // namespace canyon::gazebo_classic
