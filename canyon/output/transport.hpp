#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/output/encoder.hpp"

namespace canyon::output {

/// Takes bytes to somebody. Everything but finish() returns at once: a reader that is too slow loses bytes or
/// its connection, and the caller goes on.
class Transport {
 public:
  virtual ~Transport() = default;
  /// Bytes that every reader gets first, also one that comes later. At most once, before send().
  virtual void begin(std::string_view bytes) { send(bytes); }
  /// The bytes of one epoch. Files throw InputError where the disk does not take them.
  virtual void send(std::string_view bytes) = 0;
  /// Does what can be done between two epochs: takes new readers and sends on what was kept.
  virtual void serve() {}
  /// After the last byte. A file appears under its name, corrected; other transports leave a correction out,
  /// and give readers that are behind up to two seconds.
  virtual void finish(const std::optional<Encoder::Correction>& correction) = 0;
  /// What there is to say since the last call, one line each: readers dropped, a pseudo-terminal's name.
  [[nodiscard]] virtual std::vector<std::string> take_notes() { return {}; }
};

/// Opens the way to an address:
///   file:PATH                      a file that appears whole at finish(), or not at all
///   tcp://127.0.0.1:PORT           a server for up to TcpServer::kMaxClients clients
///   udp://HOST:PORT                datagrams of up to kLargestDatagram bytes that end with a line
///   pty:                           a pseudo-terminal; take_notes() has its name
///   serial:/dev/ttyX@BAUD          a serial port, 8N1
/// Throws InputError for what is no address, and where it cannot be opened.
[[nodiscard]] std::unique_ptr<Transport> open_transport(std::string_view address);
/// Whether an address names a file: only there a format may wait for the end.
[[nodiscard]] bool is_file_address(std::string_view address);

inline constexpr std::size_t kLargestDatagram = 1400;  ///< bytes; within an Ethernet frame
/// Bytes kept for a reader that does not read as fast as they come, beside the system's own buffers (about as
/// much again). Ten seconds of NMEA at 10 Hz.
inline constexpr std::size_t kMaxBacklog = std::size_t{256} * 1024;

/// Sends one stream to whoever connects to a TCP port of 127.0.0.1. It has no thread and never waits: the
/// system takes connections at any time, and each call of serve() and send() does what can be done at once.
/// What clients say is thrown away.
class TcpServer final : public Transport {
 public:
  /// Clients at a time; more are turned away.
  static constexpr std::size_t kMaxClients = 16;

  /// Listens. Throws InputError for a port outside 1 to 65535, and where the system refuses it (in use,
  /// reserved).
  explicit TcpServer(int port);
  ~TcpServer() override;

  void begin(std::string_view bytes) override;
  /// To every client, whole or, for one that is dropped, cut.
  void send(std::string_view bytes) override;
  void serve() override;
  void finish(const std::optional<Encoder::Correction>& correction) override;
  [[nodiscard]] std::vector<std::string> take_notes() override;
  [[nodiscard]] std::size_t clients() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::output
