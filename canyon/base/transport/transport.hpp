#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Bytes to and from anywhere, whatever they mean.
namespace canyon::transport {

/// Bytes known only at the end that replace earlier ones, from byte `offset` of all that was sent.
struct Correction {
  std::size_t offset = 0;
  std::string bytes;
};

/// Bytes from somebody at the other end.
struct Received {
  std::uint64_t reader = 0;  ///< tells those at the other end apart; 0: there is one
  std::string bytes;         ///< cut anywhere, but datagrams are whole
  bool whole = false;        ///< a datagram: what it says ends with it
};

/// A description of the stream, for readers that ask before they read.
struct StreamDescription {
  std::string name;                                   ///< of the receiver, UTF-8
  std::string format;                                 ///< "RTCM 3.3"
  std::string systems;                                ///< "GPS+Galileo"
  std::optional<double> latitude_deg, longitude_deg;  ///< of an antenna that stands for good
  bool wants_position = false;                        ///< each reader gets its own, for its GGA sentences
};

inline constexpr std::size_t kLargestDatagram = 1400;  ///< bytes that are sent; within an Ethernet frame
/// Bytes kept for a reader that does not read as fast as they come, beside the system's own buffers (about as
/// much again). Ten seconds of NMEA at 10 Hz.
inline constexpr std::size_t kMaxBacklog = std::size_t{256} * 1024;
/// Bytes that are kept of what was said until take_received(); more are thrown away.
inline constexpr std::size_t kMostReceived = std::size_t{64} * 1024;
/// Readers of one transport at a time.
inline constexpr std::size_t kMaxClients = 16;

/// Sends bytes to peers, and receives theirs. Everything but finish() returns at once: a reader that
/// is too slow loses bytes or its connection, and the caller goes on. A lost peer (a client, a serial port)
/// is reported once, and taken up again when it is back.
class Transport {
 public:
  virtual ~Transport() = default;
  /// Bytes that every reader gets first, also one that comes later. At most once, before send().
  virtual void begin(std::string_view bytes) { send(bytes); }
  /// An NTRIP caster puts it in its source table; others ignore it.
  virtual void describe(const StreamDescription& /*stream*/) {}
  /// The bytes of one epoch, to all. Files throw InputError where the disk does not take them.
  virtual void send(std::string_view bytes) = 0;
  /// Those at the other end now: 0, or where there may be several, numbers from 1.
  [[nodiscard]] virtual std::vector<std::uint64_t> readers() const { return {0}; }
  /// Sends to one that sent something; ignored where it is gone.
  virtual void answer(std::uint64_t /*reader*/, std::string_view bytes) { send(bytes); }
  /// Works between two epochs: takes new readers, sends kept bytes, listens.
  virtual void serve() {}
  /// The bytes that were received until the last serve().
  [[nodiscard]] virtual std::vector<Received> take_received() { return {}; }
  /// Sets the rate of a serial port or a pseudo-terminal, behind the bytes sent so far; others ignore it.
  virtual void set_baud(int /*baud*/) {}
  /// Adds the descriptors that become readable when there is something for serve() to do; they hold until its
  /// next call.
  virtual void add_handles(std::vector<int>& /*handles*/) const {}
  /// Whether nothing more can come: the standard input has ended.
  [[nodiscard]] virtual bool ended() const { return false; }
  /// After the last byte. A file appears under its name, corrected; other transports leave a correction out,
  /// and give readers that are behind up to two seconds; one of a pseudo-terminal that has read nothing for
  /// half a second gets none.
  virtual void finish(const std::optional<Correction>& correction) = 0;
  /// Notes since the last call, one line each: readers dropped, a pseudo-terminal's name.
  [[nodiscard]] virtual std::vector<std::string> take_notes() { return {}; }
};

/// Opens an address:
///   file:PATH                      a file that appears whole at finish(); what a killed process had sent
///                                  stays under another name, which the next to open the file says
///   tcp://HOST:PORT                a server for up to kMaxClients clients; one more takes the place of the
///                                  one that waits longest for an answer or since one; HOST is 127.0.0.1, or
///                                  an address of this machine (0.0.0.0: all of them), which take_notes()
///                                  then says; a client that begins as HTTP does, such as a page of a
///                                  browser, is dropped
///   tcp-connect://HOST:PORT        a client that connects, and again every second where the server is gone
///   udp://HOST:PORT                datagrams of up to kLargestDatagram bytes that end with a line
///   udp-listen://HOST:PORT         a port that waits for datagrams, and sends to those who sent some within
///                                  10 s, the latest kMaxClients of them; HOST as for tcp://
///   pty:, pty:PATH, pty:PATH@BAUD  a pseudo-terminal; take_notes() has its name, and PATH becomes a link to
///                                  it; with a baud rate bytes pass as on such a line (BAUD / 10 a second),
///                                  and what does not fit is left out
///   serial:/dev/ttyX@BAUD          a serial port, 8N1; tried again every second where it was unplugged
///   ntrip-caster://[USER:PASSWORD@]HOST:PORT/MOUNT
///                                  an NTRIP caster, revisions 1 and 2, with a mount point; several of one
///                                  HOST:PORT share the caster. take_received() has what clients send: their
///                                  GGA sentences. HOST as for tcp://
///   ntrip://[USER:PASSWORD@]HOST:PORT/MOUNT, ntrip-source://USER:PASSWORD@HOST:PORT/MOUNT
///                                  NtripClient: what a caster sends, or a stream to one
///   stdin:                         what comes on the standard input; nothing can be sent there
/// Throws InputError for a text that is not an address, and where it cannot be opened.
[[nodiscard]] std::unique_ptr<Transport> open_transport(std::string_view address);
/// A file of results that appears whole at finish(), or not at all. Throws as OutputFile does.
[[nodiscard]] std::unique_ptr<Transport> open_result(const std::filesystem::path& path);
/// Whether an address names a file: only there a format may wait for the end.
[[nodiscard]] bool is_file_address(std::string_view address);
/// Whether a stream can only be received from an address.
[[nodiscard]] bool is_input_address(std::string_view address);
/// The forms that open_transport() knows, for messages and help.
[[nodiscard]] const char* address_forms();

}  // namespace canyon::transport
