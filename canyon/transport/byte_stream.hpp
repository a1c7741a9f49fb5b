#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "canyon/transport/byte_sink.hpp"

namespace canyon::transport {

/// Bytes to one reader over TCP; later ones are refused.
///   tcp://HOST:PORT          listens there for the first that connects; HOST as for open_transport()
///   tcp-connect://HOST:PORT  connects to a reader that listens
class ByteStream final : public ByteSink {
 public:
  /// Listens, or connects. Throws InputError for another address and a port that cannot be had, OutputError
  /// where nobody answers. @param patience with a reader that takes nothing
  explicit ByteStream(std::string_view address, std::chrono::milliseconds patience = kReaderPatience);
  ~ByteStream() override;
  ByteStream(ByteStream&&) noexcept;
  ByteStream& operator=(ByteStream&&) noexcept;

  [[nodiscard]] static bool is_address(std::string_view text);
  void wait_for_reader() override;
  void write(std::string_view bytes) override;
  void finish() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::transport
