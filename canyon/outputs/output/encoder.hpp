#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/transport/transport.hpp"
#include "canyon/paths/disturbance/faults/receiver_faults.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"
#include "canyon/run/inertial/sensor_options.hpp"
#include "canyon/run/scenario/outputs.hpp"
#include "canyon/run/simulator.hpp"

namespace canyon::simulation {
class LiveReceiver;
}

namespace canyon::output {

/// The receiver of a file or stream, beyond its epochs.
struct ReceiverDescription {
  std::string name;                                        ///< UTF-8
  std::set<gnss::System> systems = {};                     ///< that may occur; at least those of the epochs
  std::vector<std::string> tracks = {};                    ///< as receiver::ReceiverOptions has them
  std::map<gnss::SatelliteId, int> glonass_channels = {};  ///< frequency numbers
  double interval_s = 1;
  tracking::SignalOptions signal = {};   ///< `enabled`: signals have strength and phase
  bool rtk = false;                      ///< it computes a baseline from a base (Fix::baseline)
  bool dead_reckoning = false;           ///< it has the vehicle's sensors (Fix::fusion)
  inertial::SensorOptions sensors = {};  ///< whose samples its epochs have (simulation::sensors_of())
  geodesy::GpsTime begin = {};           ///< of the run
  /// Antenna of a receiver that never moves, such as a base station's [m, ECEF].
  std::optional<Eigen::Vector3d> station_ecef = {};
  bool ephemerides = true;        ///< RTCM 3 carries them
  bool virtual_station = false;   ///< a network computes `station_ecef` and the epochs
  double elevation_mask_rad = 0;  ///< of its fix
  simulation::UbxGeneration ubx_generation = simulation::UbxGeneration::F9;
  std::vector<std::string> errors = {};  ///< that its signals carry: "ionosphere" ...
};

/// `begin` and `interval_s` are the host's; the rest comes from the receiver and its sky. A fixed place has
/// its coordinates (FixedPlace::settle()).
[[nodiscard]] ReceiverDescription describe_receiver(const simulation::ReceiverConfig& receiver,
                                                    const orbit::Sky& sky,
                                                    const gnss::NavigationData& navigation,
                                                    geodesy::GpsTime begin, double interval_s);
/// Describes a host's receiver and, behind it, its base (LiveConfig::base()).
[[nodiscard]] std::vector<ReceiverDescription> describe_receivers(const simulation::LiveReceiver& receiver,
                                                                  double interval_s);
/// Precondition: `receiver` is an index into simulation.scenario().receivers.
[[nodiscard]] ReceiverDescription describe_receiver(const simulation::Simulation& simulation,
                                                    std::size_t receiver);

/// Epochs of one receiver in, bytes out. Does not depend on where the bytes go.
class Encoder {
 public:
  using Correction = transport::Correction;

  virtual ~Encoder() = default;
  /// Bytes in front of the first epoch.
  [[nodiscard]] virtual std::string begin() { return {}; }
  /// Bytes of the next epoch in order of time; formats that need the whole run return nothing yet.
  [[nodiscard]] virtual std::string encode(const simulation::Epoch& epoch) = 0;
  using Put = std::function<void(std::string_view)>;
  /// Puts the bytes behind the last epoch. Nothing is called afterwards but correction().
  virtual void end(const Put& /*put*/) {}
  /// The same bytes at once.
  [[nodiscard]] std::string end() {
    std::string text;
    end([&text](std::string_view part) { text += part; });
    return text;
  }
  [[nodiscard]] virtual std::optional<Correction> correction() { return std::nullopt; }

  /// Whether it needs Epoch::sensors.
  [[nodiscard]] virtual bool uses_sensors() const { return false; }
  /// Bytes of samples before their epoch comes. From the first call on encode() leaves out Epoch::sensors.
  [[nodiscard]] virtual std::string encode_samples(const simulation::SensorBatch& /*samples*/) { return {}; }

  /// Number of the `bytes` of encode() that make a datagram, where there are datagrams; at least 1.
  [[nodiscard]] virtual std::size_t datagram(std::string_view bytes) const { return bytes.size(); }

  /// Bytes that came from the other end, cut anywhere; returns what is to be answered at once.
  /// @param reader tells those at the other end apart, where there are several
  [[nodiscard]] virtual std::string receive(std::uint64_t /*reader*/, std::string_view /*bytes*/) {
    return {};
  }
  /// The bytes of encode()'s last epoch, which still lives, for a reader whose commands have set what it
  /// gets; empty: it gets those of encode(), as reader 0 does, whose commands set these.
  [[nodiscard]] virtual std::optional<std::string> encode_own(std::uint64_t /*reader*/) { return {}; }
  /// The command by which a reader was the first time to set what it gets, since the last call; empty: none.
  [[nodiscard]] std::string take_first_command() { return std::exchange(first_command_, {}); }
  /// The rate that the other end asked for since the last call, in use behind the answer [baud].
  [[nodiscard]] std::optional<int> take_baud() { return std::exchange(baud_, {}); }
  /// Epochs of a base that the other end gave the receiver as RTCM 3 since the last call.
  [[nodiscard]] virtual std::vector<std::shared_ptr<const relative::Corrections>> take_corrections() {
    return {};
  }
  /// The restart that the other end asked for since the last call. The caller restarts it.
  [[nodiscard]] std::optional<disturbance::RestartKind> take_restart() { return std::exchange(restart_, {}); }

 protected:
  /// Notes what a reader's commands ask for. @param first by these bytes, for the first time
  template <typename Commands>
  void note(Commands& commands, bool first) {
    if (first) first_command_ = commands.first();
    if (const auto baud = commands.take_baud()) baud_ = baud;
    if (const auto restart = commands.take_restart()) restart_ = restart;
  }

 private:
  std::string first_command_;
  std::optional<int> baud_;
  std::optional<disturbance::RestartKind> restart_;
};

/// A way to write epochs down; docs/outputs.md describes each. canyon/run/scenario/outputs.def has
/// all.
struct Format {
  std::string_view name;  ///< in `canyon simulate --stream NAME=...` and under the scenario's `outputs:`
  std::string_view file;  ///< its name in the folder of results
  bool live;              ///< its bytes say something before the last one is there
  std::string_view help;  ///< one line; empty: `outputs:` does not have it, and it is for streams alone
  std::unique_ptr<Encoder> (*make)(const ReceiverDescription&);
};
/// All of them, in the order in which files are made.
[[nodiscard]] std::span<const Format> formats();
/// Throws InputError for an unknown name, with the closest known one.
[[nodiscard]] const Format& format_named(std::string_view name);

// The encoders behind formats(): encode_NAME() of each format in canyon/run/scenario/outputs.def.
#define CANYON_FORMAT(name, file, live, wanted, help) \
  [[nodiscard]] std::unique_ptr<Encoder> encode_##name(const ReceiverDescription& receiver);
#define CANYON_STREAM_FORMAT(name, file) CANYON_FORMAT(name, file, true, false, "")
#define CANYON_RUN_OUTPUT(name, wanted, help)
#include "canyon/run/scenario/outputs.def"

}  // namespace canyon::output
