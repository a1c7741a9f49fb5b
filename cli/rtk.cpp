#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/rtklib_solutions.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/rtcm/rtcm_file.hpp"
#include "canyon/receiver/rtk/recorded_pair.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using positioning::FixKind;

struct RtkArguments {
  std::string rover, base, base_position, truth, truth_format, out;
  std::vector<std::string> signals;
  simulation::SkyConfig sky;
  rtk::PairOptions options;
  bool quiet = false;
};

/// A file of observations: RINEX, or RTCM 3.
struct Recording {
  rinex::RinexObservations rinex;
  rtk::RecordedEpochs rtcm;

  [[nodiscard]] GpsTime first() const {
    return rtcm.empty() ? rinex.epochs.front().receiver_time : rtcm.front()->receiver_time;
  }
  [[nodiscard]] GpsTime last() const {
    return rtcm.empty() ? rinex.epochs.back().receiver_time : rtcm.back()->receiver_time;
  }
  [[nodiscard]] rtk::RecordedEpochs epochs(const orbit::Sky& sky) const {
    return rtcm.empty() ? rtk::recorded_epochs(rinex.epochs, sky) : rtcm;
  }
};

bool is_rtcm(const std::string& path) {
  return file_kind(std::filesystem::path(path)) == FileKind::Rtcm;
}

/// @param around a time within half a week of the recording, which is missing in RTCM
/// @param near a position within 50 km of an antenna without a reported position, ECEF [m]; or zeros
Recording read(const std::string& path, const RtkArguments& arguments, const gnss::NavigationData& navigation,
               GpsTime around, bool needs_position, const Eigen::Vector3d& near) {
  const std::set<gnss::System>& systems = arguments.sky.systems;
  Recording recording;
  if (!is_rtcm(path)) {
    rinex::ObservationOptions wanted;
    wanted.all_signals = true;
    wanted.systems = systems;
    recording.rinex = rinex::read_observations(path, wanted);
    print_report(recording.rinex.report.all(), "canyon check " + path);
    return recording;
  }
  const auto channel = [&](gnss::SatelliteId id) -> std::optional<int> {
    const auto of = std::find_if(navigation.glonass.begin(), navigation.glonass.end(),
                                 [&](const gnss::GlonassEphemeris& e) { return e.id == id; });
    return of == navigation.glonass.end() ? std::nullopt : std::optional(of->channel);
  };
  orbit::BroadcastOptions known;
  known.allow_stale = arguments.sky.allow_stale;
  const auto ranges = rtcm::range_table(std::make_shared<orbit::BroadcastSky>(navigation, known), near);
  const rtcm::RtcmCorrections corrections =
      rtcm::read_rtcm_corrections(path, around, channel, needs_position, ranges);
  ReadReport report;
  for (const std::string& line : corrections.status.warnings())
    report.add_line(ReadReport::Level::Loss, fmt::format("{}: {}", path, line));
  print_report(report, "canyon check " + path);
  for (const auto& epoch : corrections.epochs) {
    rtk::Corrections wanted = *epoch;
    std::erase_if(wanted.observations, [&](const rtk::SignalMeasurement& seen) {
      return systems.count(seen.measurement.id.system) == 0;
    });
    recording.rtcm.push_back(std::make_shared<const rtk::Corrections>(std::move(wanted)));
  }
  return recording;
}

/// The position of the base's antenna: as given, else from the file.
Eigen::Vector3d base_position_ecef(const RtkArguments& arguments, const Recording& base) {
  if (!arguments.base_position.empty())
    return geodesy::ecef_from_geodetic(parse_position(arguments.base_position, "--base-position"));
  if (!base.rtcm.empty()) return base.rtcm.front()->station_ecef;
  std::vector<Eigen::Vector3d> points;
  for (const rinex::ObservationEpoch& epoch : base.rinex.epochs) {
    const auto position = epoch.header ? epoch.header->antenna_ecef() : std::nullopt;
    if (position && (points.empty() || points.back() != *position)) points.push_back(*position);
  }
  if (points.empty()) {
    throw InputError(arguments.base, 0, "the header has no position of the base's antenna",
                     "give --base-position LATITUDE,LONGITUDE,HEIGHT");
  }
  const Geodetic at = geodesy::geodetic_from_ecef(points.front());
  print_warnings({fmt::format(
      "the base is at the position in its file's header, {:.9f},{:.9f},{:.4f}{}: errors of it are errors of "
      "the rover; give a surveyed position by --base-position",
      geodesy::degrees(at.latitude_rad), geodesy::degrees(at.longitude_rad), at.height_m,
      points.size() > 1 ? fmt::format(", then at {} more by later records", points.size() - 1) : "")});
  return points.front();
}

/// Signals by their names, separated by commas or blanks.
std::vector<std::string> signals_of(const std::vector<std::string>& texts) {
  std::vector<std::string> signals;
  const std::vector<std::string_view> known = gnss::signal_names();
  for (std::string text : texts) {
    std::replace(text.begin(), text.end(), ',', ' ');
    for (const std::string_view name : split_blanks(text)) {
      if (std::find(known.begin(), known.end(), name) == known.end())
        throw unknown_name("signal", name, {known.begin(), known.end()});
      signals.emplace_back(name);
    }
  }
  return signals;
}

/// The rover's true position: fixed, or along a trajectory, which covers a part of the recording.
std::function<std::optional<Geodetic>(geodesy::GpsTime)> read_truth(const RtkArguments& arguments,
                                                                    geodesy::GpsTime start,
                                                                    geodesy::GpsTime end) {
  if (arguments.truth.empty()) return [](geodesy::GpsTime) { return std::nullopt; };
  if (parse_numbers(arguments.truth).size() == 3) {
    const Geodetic geodetic = parse_position(arguments.truth, "--truth");
    return [geodetic](geodesy::GpsTime) { return std::optional(geodetic); };
  }
  check_trajectory_format(arguments.truth_format);
  const auto file = simulation::read_trajectory_file(arguments.truth, arguments.truth_format, start);
  print_report(file.report, "canyon check " + arguments.truth);
  const auto lasts = [](GpsTime from, GpsTime to) {
    return fmt::format("{} to {}", geodesy::format_gpst(from, 0), geodesy::format_gpst(to, 0));
  };
  const std::string about =
      fmt::format("lasts from {}, the rover's observations from {}",
                  lasts(file.trajectory.begin(), file.trajectory.end()), lasts(start, end));
  if (file.trajectory.begin() > end || file.trajectory.end() < start)
    throw InputError(arguments.truth, 0, about, "give the true positions of the same time");
  if (file.trajectory.begin() - start > 1 || end - file.trajectory.end() > 1)
    print_warnings({fmt::format("{} {}: errors are of the epochs in both", arguments.truth, about)});
  return [path = file.trajectory](geodesy::GpsTime time) -> std::optional<Geodetic> {
    if (time < path.begin() || time > path.end()) return std::nullopt;
    return path.at(time).position;
  };
}

/// Errors of one kind of fix [m].
struct Errors {
  std::size_t count = 0;
  std::vector<double> horizontal, vertical;
};

void print_kinds(const std::vector<rtk::PairEpoch>& epochs,
                 const std::function<std::optional<Geodetic>(geodesy::GpsTime)>& truth) {
  constexpr std::array kKinds{FixKind::Fixed, FixKind::Float, FixKind::Differential, FixKind::Single,
                              FixKind::None};
  std::map<FixKind, Errors> by_kind;
  for (const rtk::PairEpoch& epoch : epochs) {
    Errors& errors = by_kind[epoch.fix.kind()];
    ++errors.count;
    if (!epoch.fix.solved()) continue;
    const auto position = truth(epoch.receiver_time);
    if (!position) continue;
    const Eigen::Vector3d error = geodesy::enu_from_ecef_rotation(*position) *
                                  (epoch.fix.position_ecef - geodesy::ecef_from_geodetic(*position));
    errors.horizontal.push_back(error.head<2>().norm());
    errors.vertical.push_back(std::abs(error.z()));
  }
  std::vector<TextRow> rows;
  for (const FixKind kind : kKinds) {
    const Errors& errors = by_kind[kind];
    if (errors.count == 0) continue;
    const auto metric = [](const std::vector<double>& values, double p) {
      const std::optional<double> at = quantile(values, p);
      return at ? fmt::format("{:.4f}", *at) : std::string("-");
    };
    rows.push_back({std::string(gnss::name(kind)), std::to_string(errors.count),
                    fmt::format("{:.1f}", 100.0 * static_cast<double>(errors.count) /
                                              static_cast<double>(epochs.size())),
                    metric(errors.horizontal, 0.5), metric(errors.horizontal, 0.95),
                    metric(errors.vertical, 0.5), metric(errors.vertical, 0.95)});
  }
  print_table({"fix", "epochs", "[%]", "horizontal p50 [m]", "p95 [m]", "vertical p50 [m]", "p95 [m]"}, rows);
}

/// Prints the satellites whose Dopplers were excluded from the velocities.
void print_excluded(const std::vector<rtk::PairEpoch>& epochs) {
  std::map<gnss::SatelliteId, std::size_t> counts;
  for (const rtk::PairEpoch& epoch : epochs)
    for (const gnss::SatelliteId id : epoch.fix.excluded) ++counts[id];
  if (counts.empty()) return;
  std::string list;
  for (const auto& [id, count] : counts)
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", gnss::to_string(id), count);
  print_warnings({"Dopplers that contradict those of the other satellites are left out; epochs: " + list});
}

int run_rtk(const RtkArguments& arguments) {
  const std::vector<std::string> signals = signals_of(arguments.options.signals);
  std::optional<OutputFile> out;
  if (!arguments.out.empty()) out.emplace(arguments.out);
  const gnss::NavigationData navigation =
      rinex::read_rinex_navigation(arguments.sky.navigation, arguments.sky.systems);
  const Eigen::Vector3d given =
      arguments.base_position.empty()
          ? Eigen::Vector3d::Zero().eval()
          : geodesy::ecef_from_geodetic(parse_position(arguments.base_position, "--base-position"));
  // A rover's RTCM may need the position of the base.
  Recording rover;
  const bool rover_first = !is_rtcm(arguments.rover);
  if (rover_first) rover = read(arguments.rover, arguments, navigation, {}, false, given);
  const auto base_file = read(arguments.base, arguments, navigation,
                              rover_first ? rover.first() : middle_time(navigation), given.isZero(), given);
  const Eigen::Vector3d point = base_position_ecef(arguments, base_file);
  if (!rover_first)
    rover = read(arguments.rover, arguments, navigation, middle_time(navigation), false, point);
  const GpsTime first = rover.first();
  const simulation::BuiltSky sky =
      simulation::build_sky(arguments.sky, first, rover.last(), geodesy::geodetic_from_ecef(point));
  print_report(sky.report, "canyon check of the navigation files");
  rtk::RecordedEpochs base = base_file.epochs(*sky.sky);
  if (!arguments.base_position.empty()) {
    for (auto& epoch : base) {
      rtk::Corrections there = *epoch;
      there.station_ecef = point;
      epoch = std::make_shared<const rtk::Corrections>(std::move(there));
    }
  }
  if (const std::size_t lost =
          std::erase_if(base, [](const auto& epoch) { return !epoch->station_ecef.allFinite(); });
      lost > 0)
    print_warnings({fmt::format(
        "{}: {} epochs without a position of the antenna in the file, or with a moving one; left out",
        arguments.base, lost)});
  receiver::CodeCorrections station{{}};
  positioning::FixOptions models;
  models.correct_troposphere = true;
  models.correct_ionosphere = !sky.navigation.klobuchar.empty();
  for (const auto& epoch : base) station.take(*epoch, *sky.sky, models, sky.navigation.klobuchar);
  if (const auto warning = receiver::wrong_station_warning(station.station_offset_m()))
    print_warnings({*warning});
  const auto truth = read_truth(arguments, first, rover.last());

  std::vector<rtk::PairEpoch> epochs;
  {
    ProgressLine progress("epochs", arguments.quiet);
    rtk::PairOptions options = arguments.options;
    options.signals = signals;
    options.fix.correct_troposphere = true;
    epochs = rtk::solve_pair(rover.epochs(*sky.sky), base, *sky.sky, sky.navigation.klobuchar, options,
                             progress.callback());
  }
  print_excluded(epochs);
  print_kinds(epochs, truth);
  const auto fixed = std::find_if(epochs.begin(), epochs.end(), [](const rtk::PairEpoch& epoch) {
    return epoch.fix.kind() == FixKind::Fixed;
  });
  if (fixed != epochs.end()) {
    const positioning::Baseline& baseline = *fixed->fix.baseline;
    fmt::print("\nfirst fixed after {:.1f} s; {} satellites; baseline {:.3f} m\n",
               fixed->receiver_time - first, fixed->fix.used.size(), baseline.length_m());
  }
  if (out) {
    out->write(encoding::rtklib_solutions(epochs, "canyon " CANYON_VERSION));
    out->commit();
    fmt::print("{} written\n", arguments.out);
  }
  return kOk;
}

}  // namespace

void add_rtk(Command& app) {
  Command& command =
      app.add_command("rtk", "compute float and fixed RTK positions of a recorded rover and base");
  command.footer =
      "canyon rtk rover.obs base.obs --nav base.nav --base-position 35.134707705,136.977577939,104.853";
  RtkArguments& arguments = command.run_with(run_rtk);
  rtk::PairOptions& options = arguments.options;
  command
      .add_option(
          "rover", arguments.rover, "ROVER",
          "observations of the rover: RINEX 2, 3, 4, RTCM 3, or a log of Android's GnssLogger (.gz too)")
      .required();
  command.add_option("base", arguments.base, "BASE", "observations of the base, in the same formats")
      .required();
  add_field(command, "--nav", arguments.sky, "navigation", "").required();
  command.add_option("--base-position", arguments.base_position, "LAT,LON,HEIGHT",
                     "antenna of the base, degrees and metres (from its file)");
  command.add_option("--truth", arguments.truth, "POSITION|FILE",
                     "true position of the rover: LAT,LON,HEIGHT, or a trajectory; errors are printed");
  command.add_option("--format", arguments.truth_format, "F",
                     "format of the trajectory (detected from its content)");
  add_field(command, "--systems", arguments.sky, "systems");
  command
      .add_option("--signals", options.signals, "NAME",
                  "signals to use, separated by commas, or by repeating the option: L1CA,L2C,E1,E5b; `canyon "
                  "profiles signals` lists all")
      .repeated();
  add_field(command, "--mask", options.fix, "elevation_mask_deg");
  add_field(command, "--integers", options.rtk, "integers");
  add_field(command, "--ratio", options.rtk, "ratio");
  add_field(command, "--fix-glonass", options.rtk, "fix_glonass");
  command.add_option("--max-age", options.max_age_s, "S", "older base epochs are not used [s] (60)")
      .within(0, 3600);
  add_field(command, "--allow-stale", arguments.sky, "allow_stale", nullptr, true);
  command.add_option("--out", arguments.out, "FILE", "write the solutions as RTKLIB's .pos").writes();
  command.add_flag("--quiet", arguments.quiet, "no progress");
}

}  // namespace canyon::cli
