#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/transport/transport.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/inertial/sensor_options.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/simulation/scenario/outputs.hpp"

namespace canyon::simulation {
class ReceiverRunner;
class Simulation;
}  // namespace canyon::simulation

namespace canyon::encoding {

class Device;

/// Properties of a file's or stream's receiver that its epochs do not have.
struct ReceiverDescription {
  std::string name;                                        ///< UTF-8
  std::set<gnss::System> systems = {};                     ///< that can occur; at least those of the epochs
  std::vector<std::string> tracks = {};                    ///< see receiver::ReceiverOptions
  std::map<gnss::SatelliteId, int> glonass_channels = {};  ///< frequency numbers
  double interval_s = 1;
  tracking::SignalOptions signal = {};   ///< `enabled`: signals have strength and phase
  bool rtk = false;                      ///< it computes a baseline from a base (Fix::baseline)
  bool dead_reckoning = false;           ///< it uses the vehicle's sensors (Fix::fusion)
  inertial::SensorOptions sensors = {};  ///< of the samples in its epochs (simulation::sensors_of())
  geodesy::GpsTime begin = {};           ///< of the run
  /// Antenna of a receiver that never moves, such as a base station's [m, ECEF].
  std::optional<Eigen::Vector3d> station_ecef = {};
  bool ephemerides = true;        ///< RTCM 3 carries them
  bool virtual_station = false;   ///< `station_ecef` and the epochs are computed by a network
  double elevation_mask_rad = 0;  ///< of its fix
  simulation::UbxGeneration ubx_generation = simulation::UbxGeneration::F9;
  std::vector<std::string> errors = {};  ///< of its signals: "ionosphere" ...
};

/// `begin` and `interval_s` are the host's; the rest comes from the receiver and its sky. A fixed receiver
/// must have its coordinates (FixedPosition::resolve()).
[[nodiscard]] ReceiverDescription describe_receiver(const simulation::ReceiverConfig& receiver,
                                                    const orbit::Sky& sky,
                                                    const gnss::NavigationData& navigation,
                                                    geodesy::GpsTime begin, double interval_s);
/// Describes a host's receiver, followed by its base (RunnerConfig::base()).
[[nodiscard]] std::vector<ReceiverDescription> describe_receivers(const simulation::ReceiverRunner& receiver,
                                                                  double interval_s);
/// Precondition: `receiver` is an index into simulation.scenario().receivers.
[[nodiscard]] ReceiverDescription describe_receiver(const simulation::Simulation& simulation,
                                                    std::size_t receiver);

/// Epochs of one receiver in, bytes out. Independent of the destination of the bytes. Formats whose receivers
/// have commands implement Device too.
class Encoder {
 public:
  using Correction = transport::Correction;

  virtual ~Encoder() = default;
  /// Bytes before the first epoch.
  [[nodiscard]] virtual std::string begin() { return {}; }
  /// Bytes of the next epoch in order of time; formats that need the whole run return nothing yet.
  [[nodiscard]] virtual std::string encode(const simulation::Epoch& epoch) = 0;
  using Put = std::function<void(std::string_view)>;
  /// Puts the bytes after the last epoch. Afterwards only correction() may be called.
  virtual void end(const Put& /*put*/) {}
  /// Returns the bytes of end() as one string.
  [[nodiscard]] std::string end() {
    std::string text;
    end([&text](std::string_view part) { text += part; });
    return text;
  }
  /// A part of the bytes that is known only after end(); empty: none.
  [[nodiscard]] virtual std::optional<Correction> correction() { return std::nullopt; }

  /// Whether it needs Epoch::sensors.
  [[nodiscard]] virtual bool uses_sensors() const { return false; }
  /// Bytes of samples that precede their epoch. From the first call on encode() leaves out Epoch::sensors.
  [[nodiscard]] virtual std::string encode_samples(const simulation::SensorBatch& /*samples*/) { return {}; }

  /// Number of the `bytes` of encode() that form one datagram; at least 1.
  [[nodiscard]] virtual std::size_t datagram(std::string_view bytes) const { return bytes.size(); }

  /// The part for links that receive bytes, owned by the encoder; null: the format has no commands.
  [[nodiscard]] virtual Device* device() { return nullptr; }
};

/// An output format of epochs; docs/outputs.md describes each. List: canyon/simulation/scenario/outputs.def.
struct Format {
  std::string_view name;  ///< in `canyon simulate --stream NAME=...` and under the scenario's `outputs:`
  std::string_view file;  ///< its name in the folder of results
  bool live;              ///< its bytes can be used before the last one is written
  std::string_view help;  ///< one line; empty: not in `outputs:`, for streams only
  std::unique_ptr<Encoder> (*make)(const ReceiverDescription&);
};
/// All of them, in the order of writing files.
[[nodiscard]] std::span<const Format> formats();
/// Throws InputError for an unknown name, with the closest known one.
[[nodiscard]] const Format& format_named(std::string_view name);

// The encoders behind formats(): encode_NAME() of each format in canyon/simulation/scenario/outputs.def.
#define CANYON_FORMAT(name, file, live, wanted, help) \
  [[nodiscard]] std::unique_ptr<Encoder> encode_##name(const ReceiverDescription& receiver);
#define CANYON_STREAM_FORMAT(name, file) CANYON_FORMAT(name, file, true, false, "")
#define CANYON_RUN_OUTPUT(name, wanted, help)
#include "canyon/simulation/scenario/outputs.def"

}  // namespace canyon::encoding
