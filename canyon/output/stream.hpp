#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/output/encoder.hpp"
#include "canyon/output/transport.hpp"

namespace canyon::output {

/// Epochs of one receiver through an encoder into a transport.
class EncodedStream final : public simulation::EpochSink {
 public:
  /// Sends the format's first bytes. Throws as Transport::send() does.
  EncodedStream(std::unique_ptr<Encoder> encoder, std::unique_ptr<Transport> transport, std::size_t receiver);

  /// Epochs of other receivers are passed over.
  void write(const simulation::Epoch& epoch) override;
  /// The first call ends the stream; later ones do nothing.
  void finish() override;
  /// For the time between two epochs; write() does it as well.
  void serve() { transport_->serve(); }
  [[nodiscard]] std::vector<std::string> take_notes() { return transport_->take_notes(); }

 private:
  std::unique_ptr<Encoder> encoder_;
  std::unique_ptr<Transport> transport_;
  std::size_t receiver_;
  bool finished_ = false;
};

/// "nmea=tcp://127.0.0.1:2947", or with several receivers "rover/nmea=...".
struct StreamRequest {
  std::string receiver;  ///< empty: the only one
  std::string format;
  std::string address;
};
/// Throws InputError for what is no request.
[[nodiscard]] StreamRequest parse_stream(std::string_view text);

/// Throws InputError for an unknown format, an address that cannot be opened, and a format that says nothing
/// before its end anywhere but in a file.
[[nodiscard]] std::unique_ptr<EncodedStream> open_stream(const StreamRequest& request, std::size_t receiver,
                                                         const ReceiverDescription& description);
/// Of a simulation's receiver. Throws InputError also for an unknown receiver, and for none with several.
[[nodiscard]] std::unique_ptr<EncodedStream> open_stream(const StreamRequest& request,
                                                         const simulation::Simulation& simulation);
/// A file of a format: open_stream() with "file:".
[[nodiscard]] std::unique_ptr<EncodedStream> open_file(std::string_view format,
                                                       const std::filesystem::path& path,
                                                       std::size_t receiver,
                                                       const ReceiverDescription& description = {});

/// Holds a run back to the wall clock: write() returns when as much real time has passed since the first
/// epoch as lies between the two. Give it to Simulation::run() in front of other sinks. While it waits it
/// calls `meanwhile` every 50 ms or sooner; it stops waiting where `stop` (null: never) is set.
class RealTimePacer final : public simulation::EpochSink {
 public:
  explicit RealTimePacer(const std::atomic<bool>* stop, std::function<void()> meanwhile = {})
      : stop_(stop), meanwhile_(std::move(meanwhile)) {}
  void write(const simulation::Epoch& epoch) override;
  void finish() override {}

 private:
  struct Start {
    geodesy::GpsTime epoch;
    std::chrono::steady_clock::time_point wall;
  };
  const std::atomic<bool>* stop_;
  std::function<void()> meanwhile_;
  std::optional<Start> start_;
};

}  // namespace canyon::output
