#pragma once

#include <chrono>
#include <memory>
#include <string_view>

namespace canyon::transport {

/// Bytes to one reader that loses none of them: a writer waits for its reader.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Waits until somebody reads.
  virtual void wait_for_reader() = 0;
  /// Waits for the reader. Throws OutputError where it is gone, or takes nothing for the sink's patience.
  virtual void write(std::string_view bytes) = 0;
  /// Ends the stream, and waits until the reader has all of it, for the patience at most.
  virtual void finish() = 0;
};

/// How long a reader may take nothing.
inline constexpr std::chrono::milliseconds kReaderPatience = std::chrono::seconds(30);

[[nodiscard]] bool is_byte_sink(std::string_view address);
/// Opens (canyon::io):
///   tcp://HOST:PORT          listens there for the first that connects
///   tcp-connect://HOST:PORT  connects to a reader that listens
///   zmq://HOST:PORT          ZeroMQ: a publisher for subscribers of all topics, bound there; each write()
///                            sends a message
/// HOST as for open_transport(). Throws InputError for another address and a port that cannot be opened,
/// OutputError where nobody answers.
[[nodiscard]] std::unique_ptr<ByteSink> open_byte_sink(std::string_view address,
                                                       std::chrono::milliseconds patience = kReaderPatience);

}  // namespace canyon::transport
