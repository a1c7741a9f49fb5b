#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/disturbance/faults/fault.hpp"
#include "canyon/paths/disturbance/shadowing_options.hpp"
#include "canyon/paths/propagation/propagation_options.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/inertial/sensor_options.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/city_config.hpp"
#include "canyon/simulation/scenario/live_options.hpp"
#include "canyon/simulation/scenario/outputs.hpp"
#include "canyon/simulation/scenario/sample_options.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::simulation {

/// Motion of a receiver in the cells of a heat map.
enum class Motion : std::uint8_t { Auto, Stationary, Driving, Flying };

/// `map:` of a scenario.
struct MapOptions {
  Motion motion = Motion::Auto;  ///< Auto: by the receiver and the altitude (heatmap::Heatmap)
  double pace_mps = 8;           ///< of Driving and Flying [m/s], [0.1, 300]

  [[nodiscard]] bool moves() const { return motion == Motion::Driving || motion == Motion::Flying; }
};
void visit(options::Visitor& v, MapOptions& o);

[[nodiscard]] std::string_view name(Motion motion);
/// "standing", "driving at 8 m/s".
[[nodiscard]] std::string describe(const MapOptions& options);

// Also available in this namespace.
using samples::band_centre_hz;
using samples::name;
using samples::SampleFormat;
using samples::SampleOptions;

/// `sky:` of a scenario. Exactly one source: navigation, sp3, frozen, or (default) nominal.
struct SkyConfig {
  std::vector<std::filesystem::path> navigation;
  std::vector<std::filesystem::path> sp3;
  bool nominal = false;
  std::vector<double> frozen_azimuth_rad;
  std::vector<double> frozen_elevation_rad;
  std::set<gnss::System> systems{gnss::kConstellations.begin(), gnss::kConstellations.end()};
  bool allow_stale = false;
  sky::RangeErrorOptions errors;

  /// Whether signals have range errors (satellite and atmosphere): by `errors`, else if the satellites'
  /// ephemerides are broadcast ones.
  [[nodiscard]] bool has_errors(bool broadcast) const {
    return errors.enabled || (broadcast && !errors.enabled.is_set());
  }
  [[nodiscard]] bool has_errors() const { return has_errors(nominal || !navigation.empty()); }
};

struct TrajectoryConfig {
  std::optional<std::filesystem::path> file;
  std::string format;         ///< of trajectory_formats(); empty: detected from the file's content
  TrajectoryColumns columns;  ///< of a CSV file
  std::vector<geodesy::Geodetic> waypoints;  ///< instead of a file
  /// Waypoints given by east, north, up [m] from the city's origin, with their indices in `waypoints`. If the
  /// origin is not known before the city's file is read, they are {} there until Simulation sets them.
  std::vector<std::pair<std::size_t, Eigen::Vector3d>> local_waypoints;
  /// A waypoint's own values, which replace those of the trajectory.
  struct Leg {
    std::optional<double> height_above_terrain_m;  ///< at the waypoint; between two the height is linear
    std::optional<double> speed_mps, hold_s;

    bool operator==(const Leg&) const = default;
  };
  std::vector<Leg> legs;  ///< one for each waypoint; empty: no waypoint has its own values
  double speed_mps = 10;
  double hold_s = 0;
  std::optional<double> acceleration_mps2;  ///< for corners and speed changes; empty: both are immediate
  Attitude attitude = Attitude::Level;
  std::optional<double> height_above_terrain_m;  ///< clamps to the terrain; empty: heights as given
};

/// The position of an antenna that does not move.
struct FixedPosition {
  geodesy::Geodetic position;
  /// East, north, up [m] from the city's origin, if the position was given so; resolve() converts it to
  /// `position`.
  std::optional<Eigen::Vector3d> local_m;

  void resolve(const geodesy::LocalFrame& city) {
    if (local_m) position = city.geodetic_from_local(*local_m);
  }
};

struct ReceiverConfig {
  receiver::ReceiverOptions options;
  /// The position of a base station's antenna, independent of trajectory and lever arm.
  std::optional<FixedPosition> fixed;
  propagation::PropagationOptions propagation;            ///< profile, then scenario, then receiver
  Eigen::Vector3d lever_arm_m = Eigen::Vector3d::Zero();  ///< forward, left, up from the reference point
  disturbance::StreetOptions streets;                     ///< one for all receivers of a scenario
  /// Disturbances of the calling program, applied in this order to the arrivals; scenario files cannot set
  /// them.
  std::vector<disturbance::DisturbanceSource> disturbances;
  receiver::ModelSource models;  ///< of the calling program, in place of the receiver's weights and position
};

/// A whole scenario, checked. Paths are absolute or relative to the working folder (already resolved relative
/// to the scenario's folder).
struct Scenario {
  std::filesystem::path file;
  CityConfig city;
  SkyConfig sky;
  TrajectoryConfig trajectory;
  std::optional<geodesy::GpsTime> start;  ///< empty: the trajectory file's first time
  std::optional<double> duration_s;       ///< empty: the whole trajectory
  std::optional<double> rate_hz;          ///< empty: the trajectory file's own rate (1 Hz for waypoints)
  std::vector<ReceiverConfig> receivers;  ///< at least one
  inertial::SensorOptions sensors;
  std::vector<disturbance::Fault> faults;  ///< their times count from `start`, or the trajectory's first
  std::uint64_t seed = 1;
  OutputConfig outputs;
  MapOptions map;                   ///< for `canyon heatmap`
  samples::SampleOptions samples;   ///< for the output `samples` and for `canyon iq`
  std::optional<LiveOptions> live;  ///< only used by `canyon live`
  /// Values of the file that may be mistakes, one line each.
  std::vector<std::string> warnings;
};

/// Index of the receiver of that name; 0 if `name` is empty. Throws InputError naming the known ones.
[[nodiscard]] std::size_t find_receiver(const Scenario& scenario, const std::string& name);

struct ScenarioReadOptions {
  /// `trajectory` is required. False: if it is absent, Scenario::trajectory has neither file nor waypoints
  /// (the caller supplies the truth).
  bool trajectory_needed = true;
};

/// Reads a scenario. Throws InputError with file and line for syntax, unknown keys (with the closest known
/// one), wrong types, values out of range, and missing files.
[[nodiscard]] Scenario read_scenario(const std::filesystem::path& path,
                                     const ScenarioReadOptions& options = {});
[[nodiscard]] Scenario parse_scenario(const std::string& text, const std::filesystem::path& name,
                                      const ScenarioReadOptions& options = {});

/// The effective scenario as YAML: profiles resolved, every default written out, files with absolute paths.
/// Reading it gives the same run, to the byte.
[[nodiscard]] std::string scenario_yaml(const Scenario& scenario);

using ScenarioKey = options::Key;
/// All keys: for help text, documentation and schema.
[[nodiscard]] const options::Description& scenario_description();
[[nodiscard]] const std::vector<ScenarioKey>& scenario_keys();

/// Fields as in the user's file. Readers check fields that depend on each other.
void visit(options::Visitor& v, SkyConfig& o);
/// All fields but name and profile.
void visit(options::Visitor& v, ReceiverConfig& o);
void visit(options::Visitor& v, OutputConfig& o);
void visit(options::Visitor& v, Scenario& o);
/// The fields of a scenario that command lines change: duration_s, rate_hz or interval_s, seed.
void visit_run(options::Visitor& v, Scenario& scenario);
/// A scenario whose trajectory may be absent (ScenarioReadOptions::trajectory_needed).
struct ScenarioOfAnyTrajectory {
  Scenario& scenario;
};
void visit(options::Visitor& v, ScenarioOfAnyTrajectory& o);

/// The receivers' names, in their order.
[[nodiscard]] inline std::vector<std::string> receiver_names(const std::vector<ReceiverConfig>& receivers) {
  std::vector<std::string> names;
  names.reserve(receivers.size());
  for (const ReceiverConfig& receiver : receivers) names.push_back(receiver.options.name);
  return names;
}

/// Throws InputError if receivers[index] cannot use the corrections that it names: no receiver of the run,
/// itself, a receiver without a fixed position, one that depends on it, or one with the same noise.
void check_corrections(const std::vector<ReceiverConfig>& receivers, std::size_t index);

/// Whether a receiver uses the measurements of a base.
[[nodiscard]] inline bool has_base(const receiver::ReceiverOptions& options) {
  return options.rtk.enabled || !options.corrections.from.empty();
}

/// The base of a receiver in the same run; empty: it uses no corrections, or those of a stream.
[[nodiscard]] std::optional<ReceiverConfig> base_of(const std::vector<ReceiverConfig>& receivers,
                                                    const ReceiverConfig& receiver);

/// The index of that base.
[[nodiscard]] std::optional<std::size_t> index_of_base(const std::vector<ReceiverConfig>& receivers,
                                                       const ReceiverConfig& receiver);

/// A scenario of a host that supplies city and motion. A host's scenario has one receiver, then the base in
/// the host's world, if any; the scenario of a run or session has all receivers.
struct RunnerConfig : Scenario {
  RunnerConfig() { receivers.resize(1); }
  explicit RunnerConfig(Scenario scenario) : Scenario(std::move(scenario)) {}

  /// `corrections.from` may name another receiver of the host's world.
  bool allow_external_base = false;
  /// The host supplies the samples of Scenario::sensors in each step (ReceiverRunner::observe()).
  bool with_sensors = false;

  [[nodiscard]] ReceiverConfig& receiver() { return receivers.front(); }
  [[nodiscard]] const ReceiverConfig& receiver() const { return receivers.front(); }
  /// Null: none.
  [[nodiscard]] const ReceiverConfig* base() const { return receivers.size() > 1 ? &receivers[1] : nullptr; }
};
/// The scenario's keys `sky`, `start`, `rate_hz`, `seed` and `geoid_undulation_m`, those of the receiver
/// without brackets, and `base` with `name`, `profile` and `fixed`.
void visit(options::Visitor& v, RunnerConfig& o);
/// A scenario as Simulation uses it, with this `start` and interval; its warnings were already reported.
[[nodiscard]] RunnerConfig live_config(const Scenario& scenario, geodesy::GpsTime start, double interval_s);

/// Reads YAML with the fields of a RunnerConfig and `faults`, whose times count from the host's time 0.
/// `name` appears in messages; Scenario::warnings has possible mistakes. Relative paths are relative to the
/// folder of `name`. Throws InputError as parse_scenario() does.
[[nodiscard]] RunnerConfig parse_live_config(const std::string& text, const std::filesystem::path& name);

/// `config` with the changes of a YAML or JSON text to a running receiver: any key of parse_live_config() but
/// `sky`, `start`, `name`, `base`, `corrections.from` and `faults`, nested ("clock: {bias_s: 1}") or with
/// dots ("clock.bias_s: 1"). Absent keys do not change. `profile` sets all keys of a receiver but name,
/// independent_noise, corrections.from, lever_arm and streets; other keys of the text override it. `name` of
/// the text as for parse_live_config(); if it is not empty, the text is a request from a client, and
/// `profile` names one of Canyon's, or a file in the folder of `name`. Throws InputError as
/// parse_live_config().
[[nodiscard]] RunnerConfig changed_live_config(const RunnerConfig& config, const std::string& text,
                                               const std::filesystem::path& name);
/// The keys that changed_live_config() accepts.
[[nodiscard]] const options::Description& running_description();
/// Their values, one line "clock.bias_s: 1" each, as changed_live_config() accepts them, without passwords
/// and without `profile`.
[[nodiscard]] std::string running_options(const RunnerConfig& config);

}  // namespace canyon::simulation
