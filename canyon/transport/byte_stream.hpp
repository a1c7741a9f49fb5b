#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

namespace canyon::transport {

/// Bytes to one reader over TCP. Unlike a Transport it loses none: a writer waits for its reader.
///   tcp://HOST:PORT          listens there for the first that connects; HOST as for open_transport()
///   tcp-connect://HOST:PORT  connects to a reader that listens
class ByteStream {
 public:
  /// Listens, or connects. Throws InputError for another address and a port that cannot be had, OutputError
  /// where nobody answers. @param patience with a reader that takes nothing
  explicit ByteStream(std::string_view address,
                      std::chrono::milliseconds patience = std::chrono::seconds(30));
  ~ByteStream();
  ByteStream(ByteStream&&) noexcept;
  ByteStream& operator=(ByteStream&&) noexcept;

  [[nodiscard]] static bool is_address(std::string_view text);
  /// Until somebody has connected; later ones are refused.
  void wait_for_reader();
  /// Waits for the reader. Throws OutputError where it is gone, or takes nothing for `patience`.
  void write(std::string_view bytes);
  /// Ends the stream, and waits for the reader to close its side, for `patience` at most.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::transport
