#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/transport/link.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/simulation/receiver_runner.hpp"

namespace canyon::live {

/// The report of a host's receiver about one update.
struct ReceiverReport {
  std::int64_t sim_time_ns = 0;  ///< time of the host's clock
  /// Null, with `reason`, if there is no epoch because the truth is missing (pose_topic silent or too old).
  const simulation::ReceiverRunner::Step* step = nullptr;
  const simulation::ReceiverRunner::Step* base = nullptr;  ///< the epoch of its own base; null: none
  std::string reason;
  Eigen::Vector3d antenna_world_m = Eigen::Vector3d::Zero();                ///< in the host's world frame
  Eigen::Quaterniond link_attitude_world = Eigen::Quaterniond::Identity();  ///< world from link
  double world_yaw_from_enu_rad = 0;  ///< yaw in the world frame = yaw in ENU + this
  /// One range [m] per ray, as of the paper's ray sensor: direct and mirror ray of each satellite of
  /// step->arrival.views in turn; infinite for no ray. Empty if no scan is published.
  std::vector<double> scan_ranges_m;
  double scan_max_range_m = 0;
  double compute_s = 0;  ///< real time to compute the epoch
};

/// An output of a host. Called from one thread at a time, the simulation's or one that the simulation waits
/// for, so calls must be short. If it throws, HostedReceiver logs the error and removes the publisher.
class EpochPublisher {
 public:
  virtual ~EpochPublisher() = default;
  virtual void publish(const ReceiverReport& report) = 0;
  /// An update of the world without an epoch, at this time of the host's clock: responds to drivers at the
  /// other end of a line and sends delayed bytes that are due.
  virtual void serve(std::int64_t /*sim_time_ns*/) {}
  /// The world was reset or time jumped back.
  virtual void reset() {}
  /// Notes since the last call, one line each.
  [[nodiscard]] virtual std::vector<std::string> take_notes() { return {}; }
};

/// Opens the link of a host's own kind of address, such as a topic; null: the engine opens the address.
using LinkOpener = std::function<std::shared_ptr<transport::Link>(const encoding::StreamRequest& request)>;

/// Epochs in any of the engine's formats over any of its transports: "nmea=tcp://127.0.0.1:10110" (see
/// encoding::parse_stream() and transport::open_transport()). Files are complete when it is destroyed.
/// Updates without an epoch send nothing: readers treat a silent receiver as lost. Latencies are in time of
/// the host's clock.
/// @param setting the setting of the stream, for messages: "nmea_port"
/// @param receivers the host's receiver, the default of a stream without a name, and its base, if any:
/// "base/rtcm=tcp://127.0.0.1:2102"
/// @param open tried first
/// @param device gets the corrections and restarts that a driver sends to the host's receiver over its line;
/// null: none. It outlives the publisher. Throws InputError with `setting` if the stream fails to open.
[[nodiscard]] std::unique_ptr<EpochPublisher> make_stream_publisher(
    const std::string& setting, std::string_view stream,
    const std::vector<encoding::ReceiverDescription>& receivers, const LinkOpener& open = {},
    simulation::ReceiverRunner* device = nullptr);

/// `stream` with `{model}` replaced by a model's name and `{number}` by the number at the name's end (0 if it
/// has none), so that one setting serves several vehicles: for x500_1 "ubx=pty:/tmp/gps{number}" is
/// "ubx=pty:/tmp/gps1". Throws InputError, which names `setting`, for other names in braces.
[[nodiscard]] std::string stream_of_model(const std::string& setting, const std::string& stream,
                                          const std::string& model);

/// Logs warnings of a sky that several receivers share once. Thread-safe.
class SkyWarnings {
 public:
  /// Logs a receiver's warnings. @param log gets each line not yet logged of its sky
  void take(simulation::ReceiverRunner& receiver,
            const std::function<void(const std::string& line, bool is_sky_warning)>& log);

 private:
  std::mutex mutex_;
  std::set<std::string> logged_;
};

/// Writes a line to a host's console.
enum class Severity { Warning, Error };
using LogFunction = std::function<void(Severity tone, const std::string& line)>;

}  // namespace canyon::live
