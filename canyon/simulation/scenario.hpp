#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "canyon/buildings/sources/map_options.hpp"
#include "canyon/city/facades.hpp"
#include "canyon/city/mesh_import_options.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/disturbance/disturbance.hpp"
#include "canyon/disturbance/faults/fault.hpp"
#include "canyon/disturbance/street_options.hpp"
#include "canyon/errors/space_errors.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/gnss/satellite_id.hpp"
#include "canyon/options/describe.hpp"
#include "canyon/propagation/propagation_options.hpp"
#include "canyon/receiver/own_models.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/live_options.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/outputs.hpp"
#include "canyon/simulation/sample_options.hpp"

namespace canyon::simulation {

/// What a city file is, by its name.
enum class CityFileKind : std::uint8_t {
  Mesh,    ///< .dae .obj .stl .gltf .glb .ply: needs an origin
  Canyon,  ///< .canyon
  Gazebo,  ///< .world .sdf, or a model's folder
  Map,     ///< .osm, .osm.gz, .osm.bz2, .osm.pbf; CityJSON: .json (.city.json), .jsonl is refused
};
/// Empty for a name that ends in none of these.
[[nodiscard]] std::optional<CityFileKind> city_file_kind(const std::filesystem::path& path);
/// For messages: the endings of city_file_kind().
[[nodiscard]] const char* city_file_endings();

/// Map files and what to make of them.
struct MapCityConfig {
  std::vector<std::filesystem::path> files;  ///< OpenStreetMap and CityJSON
  std::vector<std::filesystem::path> terrain;
  std::optional<std::array<double, 4>> bbox_deg;  ///< west, south, east, north
  buildings::BuildOptions build;  ///< its Grid::Utm is for files of other tools, not for simulation
};

/// By its name: CityJSON ends in .json.
[[nodiscard]] bool is_cityjson(const std::filesystem::path& path);

/// How well the place of a city is known. A run draws its own offset and heading by its seed (load_city()).
struct Georeference {
  double sigma_m = 0;            ///< standard deviation, eastwards and northwards each [m]; [0, 1000]
  double heading_sigma_rad = 0;  ///< standard deviation [rad], about the middle of the bounds; [0, pi/4]
};

/// `city:` of a scenario. Exactly one of mesh, file, map, synthetic, open is set.
struct CityConfig {
  std::optional<std::filesystem::path> mesh;
  city::MeshImportOptions import;             ///< with mesh
  std::optional<std::filesystem::path> file;  ///< Canyon's city file or a Gazebo world: has its own origin
  std::optional<MapCityConfig> map;
  std::optional<city::SyntheticCityOptions> synthetic;
  bool open = false;  ///< no buildings: open sky about `import.origin`
  /// Of any city: where mean sea level is, if not as the city's file says.
  buildings::TerrainOptions sea_level;
  city::FacadeOptions facades;
  Georeference georeference;

  /// The origin where it is known before anything is read; then it is `import.origin`.
  [[nodiscard]] bool origin_known() const { return !file && (!map || map->build.origin); }
};

/// `sky:` of a scenario. Exactly one source: navigation, sp3, frozen, or (default) nominal.
struct SkyConfig {
  std::vector<std::filesystem::path> navigation;
  std::optional<std::filesystem::path> sp3;
  bool nominal = false;
  std::vector<double> frozen_azimuth_rad;
  std::vector<double> frozen_elevation_rad;
  std::set<gnss::System> systems{gnss::kConstellations.begin(), gnss::kConstellations.end()};
  bool allow_stale = false;
  errors::SpaceErrorOptions errors;
};

struct TrajectoryConfig {
  std::optional<std::filesystem::path> file;
  std::string format = "csv";                ///< csv, urbannav, nmea
  std::vector<geodesy::Geodetic> waypoints;  ///< instead of a file
  /// Waypoints that were given by east, north, up [m] from the city's origin, with their numbers in
  /// `waypoints`. Where that origin is not known before the city's file is read they stand there as {}:
  /// Simulation puts all of these in place.
  std::vector<std::pair<std::size_t, Eigen::Vector3d>> local_waypoints;
  /// What a waypoint says of itself, instead of what holds for all.
  struct Leg {
    std::optional<double> height_above_terrain_m;  ///< at the waypoint; between two the height is linear
    std::optional<double> speed_mps, hold_s;

    bool operator==(const Leg&) const = default;
  };
  std::vector<Leg> legs;  ///< one for each waypoint; empty where none says anything
  double speed_mps = 10;
  double hold_s = 0;
  std::optional<double> acceleration_mps2;  ///< rounds corners and speeds; empty: both change at once
  Attitude attitude = Attitude::Level;
  std::optional<double> height_above_terrain_m;  ///< clamps; empty: heights as given
};

/// Where an antenna stands for good.
struct FixedPlace {
  geodesy::Geodetic place;
  /// East, north, up [m] from the city's origin, where it was given so: settle() makes `place` of it.
  std::optional<Eigen::Vector3d> local_m;

  void settle(const geodesy::LocalFrame& city) {
    if (local_m) place = city.geodetic_from_local(*local_m);
  }
};

struct ReceiverConfig {
  receiver::ReceiverOptions options;
  /// Of a base station's antenna: neither trajectory nor lever arm move it. Scenarios alone have it.
  std::optional<FixedPlace> fixed;
  propagation::PropagationOptions propagation;            ///< profile, then scenario, then receiver
  Eigen::Vector3d lever_arm_m = Eigen::Vector3d::Zero();  ///< forward, left, up from the reference point
  disturbance::StreetOptions streets;                     ///< one for all receivers of a scenario
  /// Of a program's own, between what arrives and this receiver, in this order; no scenario file names them.
  std::vector<disturbance::Source> disturbances;
  receiver::ModelSource models;  ///< likewise, in place of the receiver's own weights and position
};

/// A whole scenario, checked. Paths are absolute or relative to the working folder (already resolved against
/// the scenario's own).
struct Scenario {
  std::filesystem::path file;
  CityConfig city;
  SkyConfig sky;
  TrajectoryConfig trajectory;
  std::optional<geodesy::GpsTime> start;   ///< where empty: the trajectory file's first time
  std::optional<double> duration_s;        ///< empty: the whole trajectory
  std::optional<double> rate_hz;           ///< empty: the trajectory file's own rate (1 Hz for waypoints)
  std::vector<ReceiverConfig> receivers;   ///< at least one
  std::vector<disturbance::Fault> faults;  ///< their times count from `start`, or the trajectory's first
  std::uint64_t seed = 1;
  OutputConfig outputs;
  SampleOptions samples;            ///< of the output `samples`, and of `canyon iq`
  std::optional<LiveOptions> live;  ///< how `canyon live` runs it; others pass it over
  /// What the file says that may be meant otherwise, one line each.
  std::vector<std::string> warnings;
};

/// Index of the receiver of that name; of the first one where `name` is empty. Throws InputError naming those
/// that there are.
[[nodiscard]] std::size_t find_receiver(const Scenario& scenario, const std::string& name);

struct ScenarioReadOptions {
  /// `trajectory` must be there. False: where it is absent, Scenario::trajectory has neither file nor
  /// waypoints (the caller brings a truth of its own).
  bool trajectory_needed = true;
};

/// Reads a scenario. Throws InputError with file and line for syntax, unknown keys (with the closest known
/// one), wrong types, values out of range, and missing files.
[[nodiscard]] Scenario read_scenario(const std::filesystem::path& path,
                                     const ScenarioReadOptions& options = {});
[[nodiscard]] Scenario parse_scenario(const std::string& text, const std::filesystem::path& name,
                                      const ScenarioReadOptions& options = {});

/// The effective scenario as YAML: profiles resolved, every default written out, files by their whole paths.
/// Read back it gives the same run, to the byte.
[[nodiscard]] std::string scenario_yaml(const Scenario& scenario);

using ScenarioKey = options::Key;
/// Every key: for help text, documentation and schema.
[[nodiscard]] const options::Description& scenario_description();
[[nodiscard]] const std::vector<ScenarioKey>& scenario_keys();

/// Fields as users write them; where one depends on another, a reader checks that as well.
void visit(options::Visitor& v, Georeference& o);
void visit(options::Visitor& v, CityConfig& o);
void visit(options::Visitor& v, SkyConfig& o);
/// All but name and profile.
void visit(options::Visitor& v, ReceiverConfig& o);
void visit(options::Visitor& v, OutputConfig& o);
void visit(options::Visitor& v, Scenario& o);
/// A scenario whose trajectory may be absent (ScenarioReadOptions::trajectory_needed).
struct ScenarioOfAnyTrajectory {
  Scenario& scenario;
};
void visit(options::Visitor& v, ScenarioOfAnyTrajectory& o);

}  // namespace canyon::simulation
