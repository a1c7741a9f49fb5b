#pragma once

#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/base/transport/link.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/simulation/correction_links.hpp"
#include "canyon/simulation/scenario/live_options.hpp"

namespace canyon::encoding {

/// A virtual reference station for each reader of a stream, at the position reported in its GGA sentences.
class VirtualStations {
 public:
  /// @param base of the base station from which all virtual stations are computed
  VirtualStations(const Format& format, ReceiverDescription base);

  /// Takes bytes from a reader, cut anywhere. Anything but GGA sentences with a fix is ignored.
  void receive(std::uint64_t reader, std::string_view bytes);
  /// The bytes of the base's epoch for a reader; empty: it has not reported a position.
  [[nodiscard]] std::optional<std::string> encode(std::uint64_t reader, const simulation::Epoch& epoch);

 private:
  struct Rover {
    transport::LineCutter lines{256};
    std::optional<Eigen::Vector3d> reported_ecef;
    simulation::VirtualStation station;
    std::unique_ptr<Encoder> encoder;
    Eigen::Vector3d antenna_position_ecef = Eigen::Vector3d::Zero();  ///< of `encoder`'s station
  };

  const Format* format_;
  ReceiverDescription base_;
  transport::Readers<Rover> rovers_;
};

using simulation::StreamOptions;
using simulation::StreamRequest;

/// "nmea=tcp://127.0.0.1:10110", with several receivers "rover/nmea=...", with options
/// "nmea=pty:?rate_hz=5&latency_s=0.1". Throws InputError for other texts.
[[nodiscard]] StreamRequest parse_stream(std::string_view text);

/// Sends epochs of one receiver through an encoder to an address.
class EncodedStream final : public simulation::EpochSink {
 public:
  using Clock = std::chrono::steady_clock;
  /// The clock of latencies: real time, or a simulator's time, which may be slower or faster.
  using ClockFunction = std::function<Clock::time_point()>;
  /// Sends the format's first bytes. Throws as Transport::send() does.
  /// @param stations bytes for each reader in addition to the encoder's bytes, which all get; empty: none
  EncodedStream(std::unique_ptr<Encoder> encoder, std::shared_ptr<transport::Link> link, std::size_t receiver,
                const StreamOptions& options = {}, std::optional<VirtualStations> stations = {},
                ClockFunction now = Clock::now);
  ~EncodedStream() override;
  EncodedStream(const EncodedStream&) = delete;
  EncodedStream& operator=(const EncodedStream&) = delete;

  /// Ignores epochs of other receivers, and epochs left out by rate_hz.
  void write(const simulation::Epoch& epoch) override;
  /// Samples of the receiver's sensors that precede their epoch.
  void write_samples(const simulation::SensorBatch& samples);
  /// The first call ends the stream and sends queued bytes at once; later calls do nothing. The transport is
  /// finished with the last stream of its link.
  void finish() override;
  [[nodiscard]] bool uses_sensors() const override { return encoder_->uses_sensors(); }
  /// Call it between two epochs; write() does it as well.
  void serve();
  /// The part of serve() for this stream alone, without the link.
  void send_due();
  /// Sends queued bytes at once.
  void send_waiting();
  /// The instant at which serve() has bytes to send next; empty: none are queued.
  [[nodiscard]] std::optional<Clock::time_point> next_due() const;
  [[nodiscard]] std::vector<std::string> take_notes() { return link_->take_notes(); }
  [[nodiscard]] std::size_t receiver() const { return receiver_; }
  /// The receiver at the other end of the link, with commands; null: the format has none.
  [[nodiscard]] Device* device() { return encoder_->device(); }

 private:
  struct Waiting {
    Clock::time_point due;
    std::string bytes;
    std::vector<std::uint64_t> readers;  ///< none: all
  };
  [[nodiscard]] bool wanted(geodesy::GpsTime time);
  /// The bytes of an epoch for each reader.
  [[nodiscard]] std::vector<Waiting> encode(const simulation::Epoch& epoch);
  /// Sends the pieces, or queues them for the configured latency.
  void enqueue(std::vector<Waiting> pieces);
  /// Sends datagrams one after the other, at the link's speed.
  void wait_one_by_one(const Waiting& what, Clock::time_point due);
  void send(const Waiting& what);

  std::unique_ptr<Encoder> encoder_;
  std::shared_ptr<transport::Link> link_;
  int listener_;
  std::size_t receiver_;
  StreamOptions options_;
  std::optional<VirtualStations> stations_;
  RandomStream delays_;
  ClockFunction now_;
  std::deque<Waiting> waiting_;
  std::optional<std::int64_t> sent_;  // number of the last epoch, in intervals of rate_hz
  bool finished_ = false;
};

/// Throws InputError for an unknown format, an address that cannot be opened, and a format without output
/// before its end, except in a file.
/// @param link shared with other streams; null: its own. A format with initial bytes for every reader needs
/// its own link (InputError)
[[nodiscard]] std::unique_ptr<EncodedStream> open_stream(
    const StreamRequest& request, std::size_t receiver, ReceiverDescription description,
    std::shared_ptr<transport::Link> link = nullptr,
    EncodedStream::ClockFunction now = EncodedStream::Clock::now);

/// Passes the data that the other end sent since the last call to a stream's receiver: the newest
/// corrections, and a restart, as a fault. Returns a line for the log if there was a restart.
[[nodiscard]] std::string apply_commands(EncodedStream& stream, simulation::ReceiverRunner& receiver);
/// Index in `names` of the receiver that a request names. Throws InputError for an unknown receiver, and
/// without a name if there are several.
[[nodiscard]] std::size_t find_receiver(const StreamRequest& request, const std::vector<std::string>& names);
/// Opens a stream for a simulation's receiver. Throws also for an unknown receiver, and without a name if
/// there are several.
[[nodiscard]] std::unique_ptr<EncodedStream> open_stream(const StreamRequest& request,
                                                         const simulation::Simulation& simulation);
/// A file of a format: open_stream() with "file:".
[[nodiscard]] std::unique_ptr<EncodedStream> open_file(std::string_view format,
                                                       const std::filesystem::path& path,
                                                       std::size_t receiver,
                                                       const ReceiverDescription& description = {});

/// Slows a run down to real time: write() returns when the epoch's time since the first epoch has passed in
/// real time. Pass it to Simulation::run() before other sinks. While waiting it calls `meanwhile` at least
/// every 50 ms; it stops waiting if `stop` (null: never) is set.
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

}  // namespace canyon::encoding
