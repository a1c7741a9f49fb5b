#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Transport of bytes, independent of their meaning.
namespace canyon::transport {

/// Bytes that are known only at the end and replace earlier ones, from byte `offset` of all sent bytes.
struct Correction {
  std::size_t offset = 0;
  std::string bytes;
};

/// Bytes received from a peer.
struct Received {
  std::uint64_t reader = 0;  ///< identifies the peer; 0: there is only one
  std::string bytes;         ///< split anywhere, but datagrams are whole
  bool whole = false;        ///< a datagram: its last line ends with it
};

/// A description of the stream, for readers that request it before they read.
struct StreamDescription {
  std::string name;                                   ///< of the receiver, UTF-8
  std::string format;                                 ///< "RTCM 3.3"
  std::string systems;                                ///< "GPS+Galileo"
  std::optional<double> latitude_deg, longitude_deg;  ///< of a stationary antenna
  bool wants_position = false;  ///< each reader gets its own stream, for its GGA sentences
};

inline constexpr std::size_t kMaxDatagram = 1400;  ///< sent bytes; within an Ethernet frame
/// Bytes kept for a reader that is too slow, in addition to the system's own buffers (about the same size).
/// Ten seconds of NMEA at 10 Hz.
inline constexpr std::size_t kMaxBacklog = std::size_t{256} * 1024;
/// Received bytes kept until take_received(); more are discarded.
inline constexpr std::size_t kMaxReceived = std::size_t{64} * 1024;
/// Maximum number of readers of one transport.
inline constexpr std::size_t kMaxClients = 16;

/// Sends bytes to peers, and receives theirs. Everything but finish() returns at once: a reader that is too
/// slow loses bytes or its connection, and the caller continues. A lost peer (a client, a serial port) is
/// reported once, and reconnected when it is back.
class Transport {
 public:
  virtual ~Transport() = default;
  /// Bytes that every reader gets first, also a later one. At most once, before send().
  virtual void begin(std::string_view bytes) { send(bytes); }
  /// An NTRIP caster puts it in its source table; others ignore it.
  virtual void describe(const StreamDescription& /*stream*/) {}
  /// The bytes of one epoch, to all. Files throw OutputError if the bytes cannot be stored.
  virtual void send(std::string_view bytes) = 0;
  /// The peers now: 0 for transports with a single one, else numbers from 1.
  [[nodiscard]] virtual std::vector<std::uint64_t> readers() const { return {0}; }
  /// Sends to a peer that has sent bytes; ignored if it is gone.
  virtual void send_to(std::uint64_t /*reader*/, std::string_view bytes) { send(bytes); }
  /// Work between two epochs: accepts new readers, sends kept bytes, receives.
  virtual void serve() {}
  /// The bytes received until the last serve().
  [[nodiscard]] virtual std::vector<Received> take_received() { return {}; }
  /// Sets the rate of a serial port or a pseudo-terminal after the bytes sent so far; others ignore it.
  virtual void set_baud(int /*baud*/) {}
  /// Adds the descriptors that become readable when serve() has work to do; valid until its next call.
  virtual void add_handles(std::vector<int>& /*handles*/) const {}
  /// Whether no more bytes can arrive: the standard input has ended.
  [[nodiscard]] virtual bool ended() const { return false; }
  /// Call it after the last byte. A file is corrected and gets its final name. Other transports ignore the
  /// correction and give slow readers up to two seconds, but none to a reader of a pseudo-terminal that has
  /// read nothing for half a second.
  virtual void finish(const std::optional<Correction>& correction) = 0;
  /// Notes since the last call, one per line: readers dropped, a pseudo-terminal's name.
  [[nodiscard]] virtual std::vector<std::string> take_notes() { return {}; }
};

/// Opens an address:
///   file:PATH                      a file that appears complete at finish(); the data of a killed process
///                                  stay under another name, which the next writer of the file logs
///   tcp://HOST:PORT                a server for up to kMaxClients clients; one more replaces the one that
///                                  has waited longest for or since a reply; HOST is 127.0.0.1, or an
///                                  address of this machine (0.0.0.0: all of them), then logged in
///                                  take_notes(); a client that begins with HTTP, as a browser, is dropped
///   tcp-connect://HOST:PORT        a client; reconnects every second if the server is gone
///   udp://HOST:PORT                datagrams of up to kMaxDatagram bytes that end with a line
///   udp-listen://HOST:PORT         receives datagrams at a port, and sends to the senders of the last 10 s,
///                                  the latest kMaxClients of them; HOST as for tcp://
///   pty:, pty:PATH, pty:PATH@BAUD  a pseudo-terminal; take_notes() has its name, and PATH becomes a link to
///                                  it; a baud rate limits the throughput as on a serial line (BAUD / 10
///                                  bytes a second), and bytes in excess are dropped
///   serial:/dev/ttyX@BAUD          a serial port, 8N1; retried every second after it was unplugged
///   ntrip-caster://[USER:PASSWORD@]HOST:PORT/MOUNT
///                                  an NTRIP caster, revisions 1 and 2, with a mount point; several of one
///                                  HOST:PORT share the caster. take_received() has the GGA sentences of
///                                  clients. HOST as for tcp://
///   ntrip://[USER:PASSWORD@]HOST:PORT/MOUNT, ntrip-source://USER:PASSWORD@HOST:PORT/MOUNT
///                                  NtripClient: receives from a caster, or sends a stream to one
///   stdin:                         reads the standard input; cannot send
/// Throws InputError for a text that is not an address, and if it cannot be opened.
[[nodiscard]] std::unique_ptr<Transport> open_transport(std::string_view address);
/// A file of results that is written completely at finish(), or not at all. Throws as OutputFile does.
[[nodiscard]] std::unique_ptr<Transport> open_result(const std::filesystem::path& path);
/// Whether an address names a file; only then may a format write parts at the end.
[[nodiscard]] bool is_file_address(std::string_view address);
/// Whether an address can only receive.
[[nodiscard]] bool is_input_address(std::string_view address);
/// The forms that open_transport() accepts, for messages and help.
[[nodiscard]] const char* address_forms();

}  // namespace canyon::transport
