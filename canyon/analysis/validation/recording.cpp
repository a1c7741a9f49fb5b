#include "canyon/analysis/validation/recording.hpp"

// A recording and its truth, joined with a scenario's sky and city.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::validation {
namespace {

using geodesy::format_gpst;
using geodesy::GpsTime;

/// Whether a recording has pseudoranges of a system by its signal near L1, and its other signals.
struct RecordedSystem {
  bool first = false;
  std::set<const gnss::Signal*> others;
};

/// Removes the systems that are not in `wanted`, and those without a signal near L1, which the clock and the
/// fixes need: they would be compared with a receiver that tracks that signal. Returns a warning for each of
/// the latter.
std::vector<std::string> keep_systems(const std::set<gnss::System>& wanted,
                                      std::vector<rinex::ObservationEpoch>& epochs) {
  std::map<gnss::System, RecordedSystem> found;
  for (const rinex::ObservationEpoch& epoch : epochs) {
    for (const rinex::ObservedSignal& s : epoch.signals) {
      if (!s.pseudorange_m || wanted.count(s.id.system) == 0) continue;
      if (s.first())
        found[s.id.system].first = true;
      else
        found[s.id.system].others.insert(s.signal);
    }
  }
  std::vector<std::string> warnings;
  const bool any =
      std::any_of(found.begin(), found.end(), [](const auto& each) { return each.second.first; });
  for (const auto& [system, recorded] : found) {
    if (recorded.first || !any) continue;
    std::vector<std::string> names;
    for (const gnss::Signal* signal : recorded.others) names.emplace_back(signal->name);
    std::sort(names.begin(), names.end());
    warnings.push_back(
        fmt::format("{} is recorded by {} without {}, which the comparison needs: it is left out",
                    gnss::name(system), fmt::join(names, ", "), gnss::signals_of(system).front().name));
  }
  for (rinex::ObservationEpoch& epoch : epochs) {
    std::erase_if(epoch.signals, [&](const rinex::ObservedSignal& s) {
      const auto at = found.find(s.id.system);
      return wanted.count(s.id.system) == 0 || (any && at != found.end() && !at->second.first);
    });
  }
  return warnings;
}

/// The error if no observation of a recording is left.
InputError nothing_left(const std::filesystem::path& obs, const std::filesystem::path& truth,
                        const rinex::RinexObservations& recorded, const simulation::Trajectory& path,
                        const PseudorangeResiduals& residuals) {
  const GpsTime first = recorded.epochs.front().receiver_time;
  const GpsTime last = recorded.epochs.back().receiver_time;
  if (residuals.epochs_outside_truth > 0) {
    return {obs, 0,
            fmt::format("none of its epochs ({} to {}) is in the truth {} ({} to {})", format_gpst(first, 0),
                        format_gpst(last, 0), truth.filename().string(), format_gpst(path.begin(), 0),
                        format_gpst(path.end(), 0)),
            recorded.report.warnings().empty()
                ? "give the truth of the same drive; times of CSV files are UTC unless marked GPST"
                : recorded.report.warnings().front()};
  }
  if (!residuals.without_ephemeris.empty()) {
    return {obs, 0,
            fmt::format("none of its {} satellites has an ephemeris between {} and {}",
                        residuals.without_ephemeris.size(), format_gpst(first, 0), format_gpst(last, 0)),
            "give navigation files of that day and of the recorded systems in the scenario's sky"};
  }
  const auto near_l1 = [](const rinex::ObservationEpoch& epoch) {
    return std::any_of(epoch.signals.begin(), epoch.signals.end(),
                       [](const rinex::ObservedSignal& s) { return s.first(); });
  };
  if (std::none_of(recorded.epochs.begin(), recorded.epochs.end(), near_l1)) {
    return {obs, 0, "it has no signal near L1, which the receiver's clock needs",
            "record one of each system: L1 C/A, E1, B1I or G1"};
  }
  return {obs, 0, "it has no pseudorange of a satellite above the horizon",
          "check that truth and navigation files belong to the recording"};
}

/// The recorded signals of an epoch's residuals, one for each, as input of a solver.
std::vector<positioning::Measurement> measurements_of(const PseudorangeResiduals& residuals,
                                                      const ResidualEpoch& epoch,
                                                      const rinex::ObservationEpoch& recorded,
                                                      const orbit::Sky& sky) {
  std::vector<positioning::Measurement> measurements;
  measurements.reserve(epoch.count);
  for (const PseudorangeResidual& o : residuals.of(epoch)) {
    positioning::Measurement m;
    m.id = o.id;
    m.pseudorange_m = o.pseudorange_m;
    m.cn0_dbhz = o.cn0_dbhz;
    // The state has a GLONASS satellite's channel.
    const auto state = sky.state(o.id, epoch.reception);
    m.carrier_frequency_hz = state ? state->carrier_frequency_hz : gnss::l1_frequency_hz(o.id.system);
    const auto signal =
        std::find_if(recorded.signals.begin(), recorded.signals.end(),
                     [&o](const rinex::ObservedSignal& s) { return s.id == o.id && s.first(); });
    if (signal != recorded.signals.end()) m.doppler_hz = signal->doppler_hz;
    measurements.push_back(m);
  }
  return measurements;
}

/// The middle of values; they are reordered. Precondition: some.
double middle(std::vector<double>& values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// A warning if the pseudoranges put the antenna far from the truth, from up to two hundred epochs: by their
/// median, which streets shift by tens of metres, or by a constant time offset along the route.
std::optional<std::string> truth_warning(const Recording& recording, const orbit::Sky& sky,
                                         const std::map<gnss::System, gnss::Klobuchar>& klobuchar) {
  constexpr double kFar_m = 100, kHigh_m = 150, kLate_s = 5, kMoves_mps = 2;
  constexpr std::size_t kEpochs = 200, kMin = 10;
  positioning::FixOptions options;
  options.correct_ionosphere = recording.ionosphere && !klobuchar.empty();
  options.correct_troposphere = recording.troposphere;
  const std::vector<ResidualEpoch>& epochs = recording.residuals.epochs;
  const std::size_t step = std::max<std::size_t>(1, epochs.size() / kEpochs);
  std::array<std::vector<double>, 3> off;
  std::vector<double> late_s, before_m, after_m;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> moving;  // difference and velocity
  for (std::size_t e = 0; e < epochs.size(); e += step) {
    const positioning::Fix fix =
        positioning::solve_fix(epochs[e].receiver_time, recording.measurements[e], sky, options, klobuchar);
    if (!fix.solved()) continue;
    const Eigen::Vector3d d =
        geodesy::enu_from_ecef_rotation(epochs[e].antenna) * (fix.position_ecef - epochs[e].antenna_ecef);
    for (std::size_t axis = 0; axis < 3; ++axis) off.at(axis).push_back(d[static_cast<Eigen::Index>(axis)]);
    const Eigen::Vector3d& v = recording.antennas[e].velocity_enu_mps;
    if (!(v.norm() > kMoves_mps)) continue;
    late_s.push_back(v.dot(d) / v.squaredNorm());
    moving.emplace_back(d, v);
  }
  if (off[0].size() < kMin) return std::nullopt;
  const double count = static_cast<double>(off[0].size());
  const double east_m = middle(off[0]), north_m = middle(off[1]), up_m = middle(off[2]);
  if (std::hypot(east_m, north_m) > kFar_m || std::abs(up_m) > kHigh_m) {
    return fmt::format(
        "the pseudoranges put the antenna {:.0f} m east, {:.0f} m north and {:.0f} m above the truth (middle "
        "of {} epochs): check the truth's columns, datum, heights and time scale; all metrics include it",
        east_m, north_m, up_m, count);
  }
  if (late_s.size() < kMin) return std::nullopt;
  const double late = middle(late_s);
  for (const auto& [d, v] : moving) {
    before_m.push_back(d.head<2>().norm());
    after_m.push_back((d - late * v).head<2>().norm());
  }
  if (!(std::abs(late) > kLate_s) || !(middle(after_m) < 0.6 * middle(before_m))) return std::nullopt;
  return fmt::format(
      "the pseudoranges put the antenna where the truth is {:.1f} s {} (middle of {} epochs): check the "
      "truth's time scale, UTC or GPST, which are 18 s apart since 2017; all metrics include it",
      std::abs(late), late > 0 ? "later" : "earlier", late_s.size());
}

/// Errors of the positions that the recorded receiver itself reported.
void add_reported_fixes(const std::filesystem::path& nmea, const simulation::Trajectory& truth,
                        const Eigen::Vector3d& lever_arm_m, const simulation::HeightReading& heights,
                        Recording& recording) {
  simulation::RecordedPath own =
      simulation::read_recorded_path(nmea, "nmea", recording.residuals.epochs.front().reception, heights);
  simulation::drop_unordered(own);
  for (const auto& [time, position, line] : own.points) {
    if (!truth.covers(time)) continue;
    const geodesy::Geodetic antenna = simulation::mounted_antenna(truth.at(time), lever_arm_m).position;
    recording.reported_fixes.push_back(
        {time, geodesy::enu_from_ecef_rotation(antenna) *
                   (geodesy::ecef_from_geodetic(position) - geodesy::ecef_from_geodetic(antenna))});
  }
  if (recording.reported_fixes.empty()) {
    throw InputError(
        nmea, 0,
        fmt::format("none of its {} fixes ({} to {}) is in the truth", own.points.size(),
                    format_gpst(own.points.front().time, 0), format_gpst(own.points.back().time, 0)),
        "give the recorded receiver's own output during the recording");
  }
  const std::vector<std::string> warnings = own.report.warnings();
  recording.warnings.insert(recording.warnings.end(), warnings.begin(), warnings.end());
}

}  // namespace

Recording read_recording(const simulation::Scenario& scenario, const simulation::Environment& environment,
                         const std::filesystem::path& obs, const std::filesystem::path& truth,
                         const std::string& truth_format, const RecordingOptions& options) {
  rinex::ObservationOptions wanted;
  wanted.all_signals = true;
  return join_recording(scenario, environment, obs, rinex::read_observations(obs, wanted), truth,
                        truth_format, options);
}

Recording join_recording(const simulation::Scenario& scenario, const simulation::Environment& environment,
                         const std::filesystem::path& obs, rinex::RinexObservations recorded,
                         const std::filesystem::path& truth, const std::string& truth_format,
                         const RecordingOptions& options) {
  if (scenario.receivers.empty()) throw InputError(scenario.file, 0, "the scenario has no receiver");
  Recording recording;
  recording.ionosphere = options.ionosphere;
  recording.troposphere = options.troposphere;

  std::set<gnss::System> systems;
  for (const gnss::SatelliteId id : environment.sky().satellites()) systems.insert(id.system);
  std::vector<std::string> left_out_systems = keep_systems(systems, recorded.epochs);
  recording.warnings = recorded.report.warnings();
  recording.warnings.insert(recording.warnings.end(), left_out_systems.begin(), left_out_systems.end());

  // NMEA has times of day: the recording has the date.
  const GpsTime first = recorded.epochs.front().receiver_time, last = recorded.epochs.back().receiver_time;
  const bool file = !truth.empty();
  const bool is_time_of_day =
      file && (truth_format.empty() ? simulation::trajectory_format_of(truth) : truth_format) == "nmea";
  const GpsTime start = scenario.start.value_or(is_time_of_day ? first : GpsTime{});
  const double geoid_m = environment.city().geoid_undulation_m;
  const simulation::TrajectoryConfig& route = scenario.trajectory;
  if (!file && route.waypoints.size() != 1) throw InputError("there is neither a truth nor a position");
  simulation::TrajectoryFile path =
      file ? simulation::read_trajectory_file(
                 truth, truth_format, start, {!route.height_above_terrain_m, geoid_m},
                 truth == route.file ? route.columns : simulation::TrajectoryColumns{})
           : simulation::TrajectoryFile{
                 simulation::Trajectory::fixed(
                     first - 1,
                     route.local_waypoints.empty()
                         ? route.waypoints.front()
                         : environment.city().frame.geodetic_from_local(route.local_waypoints.front().second),
                     last - first + 2),
                 true,
                 {}};
  for (std::string& line : path.report.warnings()) recording.warnings.push_back(std::move(line));

  const Eigen::Vector3d& lever_arm_m = scenario.receivers.front().lever_arm_m;
  ResidualOptions residual_options;
  residual_options.ionosphere = options.ionosphere;
  residual_options.troposphere = options.troposphere;
  residual_options.lever_arm_m = lever_arm_m;
  recording.residuals = pseudorange_residuals(recorded.epochs, path.trajectory, environment.sky(),
                                              environment.klobuchar(), residual_options);
  const PseudorangeResiduals& residuals = recording.residuals;
  if (residuals.epochs.empty()) throw nothing_left(obs, truth, recorded, path.trajectory, residuals);
  const std::vector<std::string> left_out = residuals.warnings();
  recording.warnings.insert(recording.warnings.end(), left_out.begin(), left_out.end());

  const geodesy::LocalFrame& frame = environment.city().frame;
  const std::optional<double>& height_m = scenario.trajectory.height_above_terrain_m;
  if (height_m) recording.antenna_above_terrain_m = *height_m + lever_arm_m.z();
  for (const ResidualEpoch& epoch : residuals.epochs) {
    simulation::Pose pose = path.trajectory.at(epoch.reception);
    if (height_m && !simulation::clamp_to_terrain(pose, environment.city(), environment.scene(), *height_m)) {
      throw InputError(
          scenario.file, 0,
          fmt::format("height_above_terrain_m: there is no terrain at latitude {:.6f}, longitude {:.6f} ({})",
                      geodesy::degrees(pose.position.latitude_rad),
                      geodesy::degrees(pose.position.longitude_rad), format_gpst(pose.time, 3)),
          "use a city with terrain there, or leave the key out");
    }
    pose = simulation::mounted_antenna(pose, lever_arm_m);
    Recording::AntennaTrack location;
    location.enu_m = frame.local_from_geodetic(pose.position);
    location.velocity_enu_mps =
        frame.ecef_from_local_rotation().transpose() *
        (geodesy::enu_from_ecef_rotation(pose.position).transpose() * pose.velocity_enu_mps);
    recording.antennas.push_back(location);
    recording.measurements.push_back(
        measurements_of(residuals, epoch, recorded.epochs[epoch.recorded], environment.sky()));
  }
  if (auto warning = truth_warning(recording, environment.sky(), environment.klobuchar()))
    recording.warnings.push_back(*std::move(warning));
  if (options.nmea)
    add_reported_fixes(*options.nmea, path.trajectory, lever_arm_m, {true, geoid_m}, recording);
  return recording;
}

Eigen::Vector3d Registration::point_in_map(const Eigen::Vector3d& enu) const {
  const Eigen::Vector2d moved =
      Eigen::Rotation2Dd(-heading_rad) * (enu.head<2>() - pivot - Eigen::Vector2d(east_m, north_m)) + pivot;
  return {moved.x(), moved.y(), enu.z()};
}

Eigen::Vector3d Registration::direction_in_city(const Eigen::Vector3d& enu) const {
  const Eigen::Vector2d rotated = Eigen::Rotation2Dd(-heading_rad) * enu.head<2>();
  return {rotated.x(), rotated.y(), enu.z()};
}

Registration Registration::then(double more_east_m, double more_north_m, double more_heading_rad,
                                const Eigen::Vector2d& about) const {
  const Eigen::Vector2d offset =
      Eigen::Rotation2Dd(more_heading_rad) * (pivot + Eigen::Vector2d(east_m, north_m) - about) + about +
      Eigen::Vector2d(more_east_m, more_north_m) - pivot;
  return {offset.x(), offset.y(), heading_rad + more_heading_rad, pivot};
}

Eigen::Vector3d Recording::point_in_map(const raytrace::RayScene& scene, const Registration& moved,
                                        std::size_t epoch) const {
  Eigen::Vector3d point = moved.point_in_map(antennas[epoch].enu_m);
  if (antenna_above_terrain_m) {
    // Beyond the map's edge, the height of the unmoved city is used.
    if (const auto terrain = scene.terrain_height(point.x(), point.y()))
      point.z() = *terrain + *antenna_above_terrain_m;
  }
  return point;
}

}  // namespace canyon::validation
