#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"
#include "canyon/simulation/scenario/outputs.hpp"

namespace canyon::simulation {

/// Differences between a stream and its run. Real receivers send 1 to 25 Hz, 50 to 200 ms late.
struct StreamOptions {
  std::optional<double> rate_hz;  ///< rate of the sent epochs, those at whole multiples; empty: all epochs
  double latency_s = 0;           ///< from epoch to bytes, mean
  double jitter_s = 0;            ///< standard deviation of the latency; epochs never overtake each other
  /// Speed of a slow link in the path, such as a telemetry radio, ten bits a byte [baud]: an epoch's messages
  /// arrive one after the other. Empty: all at once.
  std::optional<double> link_baud;
  bool ephemerides = true;  ///< RTCM 3 includes messages 1019, 1020, 1042, 1044 to 1046
  /// With rtcm, each client gets corrections for the position in its GGA sentences (VirtualStation).
  bool virtual_station = false;
  UbxGeneration generation = UbxGeneration::F9;  ///< of ubx
};
void visit(options::Visitor& v, StreamOptions& o);

/// Epochs of a receiver, sent in a format to an address.
struct StreamRequest {
  std::string receiver;  ///< empty: the only one
  std::string format;    ///< encoding::formats()
  std::string address;   ///< transport::open_transport()
  StreamOptions options;
};
void visit(options::Visitor& v, StreamRequest& o);

/// Encoding of poses.
enum class PoseFormat : std::uint8_t { Json, Binary, MAVLink };
/// Axes of the positions and velocities sent.
enum class WorldAxes : std::uint8_t { ENU, NED };
/// Axes of the body for attitudes and angular rates.
enum class BodyAxes : std::uint8_t { FLU, FRD };

/// The source of a vehicle's poses, and their meaning in the city.
struct PoseSourceOptions {
  /// "trajectory": the scenario's own; "file:PATH": a log; else an address on which to listen.
  std::string from = "trajectory";
  [[nodiscard]] bool is_trajectory() const { return from == "trajectory"; }
  PoseFormat format = PoseFormat::Json;
  std::string id;  ///< the vehicle's, if several send; empty: any sender. MAVLink: the system's number
  std::vector<std::string> receivers;  ///< on this vehicle; empty: all that no other source lists
  std::vector<std::string> messages;   ///< MAVLink messages to use; empty: those with the true pose
  WorldAxes axes = WorldAxes::ENU;
  BodyAxes body = BodyAxes::FLU;
  /// From the sender's frame (a room) to the city: origin + R(heading) * scale * position in the room.
  Eigen::Vector3d origin_enu_m = Eigen::Vector3d::Zero();
  double heading_rad = 0;  ///< direction of the room's first ENU axis, from east counter-clockwise
  double scale = 1;        ///< metres in the city for one in the room
  PoseTrackOptions track{0.5, 0.04, true};
};
void visit(options::Visitor& v, PoseSourceOptions& o);

/// The clock that determines when epochs are due.
enum class LiveClock : std::uint8_t {
  Wall,   ///< real time
  Stamps  ///< the time stamps of the poses: for a simulator slower or faster than real time
};

/// `live:` of a scenario.
struct LiveOptions {
  std::vector<PoseSourceOptions> poses;  ///< empty: the trajectory
  std::vector<StreamRequest> streams;
  LiveClock clock = LiveClock::Wall;
  double speed = 1;  ///< seconds of the trajectory or of logs per second of real time
  /// Maximum time for which epochs wait for a pose of their instant; then they extrapolate the last one [s].
  double wait_s = 0.02;
  /// The receivers' epochs are spread evenly over the interval, so that each is sent sooner.
  bool stagger = false;
  /// The run starts at the stamp of the first pose instead of 0 s, so that a restarted program continues at
  /// the vehicle's time.
  bool resume = false;
  std::string control;   ///< address for commands; empty: none
  bool changes = false;  ///< commands may change the simulation
};
void visit(options::Visitor& v, LiveOptions& o);

/// The field `start`: a text, or a week and its seconds. Warns about a time without a time zone.
void visit_start(options::Visitor& v, std::optional<geodesy::GpsTime>& start,
                 std::vector<std::string>* warnings = nullptr);

}  // namespace canyon::simulation
