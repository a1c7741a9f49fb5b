#pragma once

#include <chrono>
#include <memory>
#include <string_view>

namespace canyon::transport {

/// A lossless byte stream to one reader: the writer waits for the reader.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Waits until a reader is connected.
  virtual void wait_for_reader() = 0;
  /// Waits for the reader. Throws OutputError if it is gone, or reads nothing for the sink's patience.
  virtual void write(std::string_view bytes) = 0;
  /// Ends the stream, and waits until the reader has received all of it, at most for the patience.
  virtual void finish() = 0;
};

/// How long a reader may read nothing before it is an error.
inline constexpr std::chrono::milliseconds kReaderPatience = std::chrono::seconds(30);

[[nodiscard]] bool is_byte_sink(std::string_view address);
/// Opens (canyon::io):
///   tcp://HOST:PORT          listens there for the first client
///   tcp-connect://HOST:PORT  connects to a reader that listens
///   zmq://HOST:PORT          ZeroMQ: a publisher for subscribers of all topics, bound there; each write()
///                            sends a message
/// HOST as for open_transport(). Throws InputError for another address and a port that cannot be opened,
/// OutputError if the reader cannot be reached.
[[nodiscard]] std::unique_ptr<ByteSink> open_byte_sink(std::string_view address,
                                                       std::chrono::milliseconds patience = kReaderPatience);

}  // namespace canyon::transport
