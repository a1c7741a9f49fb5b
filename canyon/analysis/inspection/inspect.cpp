#include "canyon/analysis/inspection/inspect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/files/netcdf_file.hpp"
#include "canyon/analysis/heatmap/files/stored_map.hpp"
#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/raster.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/rtcm/rtcm_file.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/precise_sky.hpp"
#include "canyon/sky/rinex/android_log.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::inspection {
namespace {

using geodesy::GpsTime;

std::string span_text(GpsTime first, GpsTime last) {
  return fmt::format("{} to {} ({:.0f} s)", geodesy::format_gpst(first, 0), geodesy::format_gpst(last, 0),
                     last - first);
}

std::string position_text(const geodesy::Geodetic& position) {
  return fmt::format("{:.6f}, {:.6f} deg, {:.1f} m", geodesy::degrees(position.latitude_rad),
                     geodesy::degrees(position.longitude_rad), position.height_m);
}

/// "GPS 9, BeiDou 12".
std::string satellites_text(const std::set<gnss::SatelliteId>& satellites) {
  std::map<gnss::System, int> count;
  for (const gnss::SatelliteId id : satellites) ++count[id.system];
  std::vector<std::string> parts;
  parts.reserve(count.size());
  for (const auto& [system, n] : count) parts.push_back(fmt::format("{} {}", gnss::name(system), n));
  return fmt::format("{}", fmt::join(parts, ", "));
}

FileReport inspect_scenario(const std::filesystem::path& path) {
  const simulation::Scenario scenario = simulation::read_scenario(path, {false});
  FileReport report{"scenario", {}, {}, {"canyon simulate FILE --out DIR"}};
  city::City city = simulation::load_city(scenario);
  if (scenario.trajectory.file || !scenario.trajectory.waypoints.empty()) {
    report.notes = simulation::Simulation(scenario, std::move(city)).report();
  } else {
    report.notes = city.notes;
    report.notes.add_line(ReadReport::Level::Guess, scenario.warnings);
  }
  const std::vector<std::string> receivers = simulation::receiver_names(scenario.receivers);
  report.contents.emplace_back("receivers", fmt::format("{}", fmt::join(receivers, ", ")));
  if (scenario.start) report.contents.emplace_back("start", geodesy::format_gpst(*scenario.start, 0));
  report.contents.emplace_back("faults", fmt::format("{}", scenario.faults.size()));
  return report;
}

FileReport inspect_city(const std::filesystem::path& path) {
  const simulation::CityConfig config = simulation::city_config(path);
  const buildings::BuiltCity loaded = simulation::read_city(config);
  const city::City& city = loaded.city;
  const city::CitySummary summary = city::summarize(city);
  const char* kind = config.is<simulation::MeshCity>() ? "city (mesh)"
                     : config.is<tiles::TileOptions>() ? "city (3D Tiles)"
                                                       : "city";
  FileReport report{kind, {}, city.notes, {"city: in a scenario"}};
  report.contents.emplace_back("buildings", fmt::format("{}", summary.buildings));
  report.contents.emplace_back("triangles",
                               fmt::format("{} ({} terrain)", summary.triangles, summary.terrain_triangles));
  if (summary.triangles > 0) {
    const Eigen::Vector3d size = summary.bounds.max - summary.bounds.min;
    report.contents.emplace_back(
        "extent", fmt::format("{:.0f} m east-west, {:.0f} m north-south, {:.1f} to {:.1f} m high", size.x(),
                              size.y(), summary.bounds.min.z(), summary.bounds.max.z()));
    report.contents.emplace_back("highest roof", fmt::format("{:.1f} m", summary.highest_roof_m));
  }
  report.contents.emplace_back("origin", !loaded.is_georeferenced ? "not in the file: city.origin"
                                                                  : position_text(city.frame.origin()));
  return report;
}

/// Whether a file is a raster by its ending, and, for ambiguous endings, by its first bytes.
bool is_raster(const std::filesystem::path& path) {
  const std::string ending = lower_case(path.extension().string());
  constexpr std::string_view kEndings[] = {".tif", ".tiff", ".hgt", ".asc", ".vrt", ".dem",
                                           ".dt0", ".dt1",  ".dt2", ".img", ".bil"};
  if (std::find(std::begin(kEndings), std::end(kEndings), ending) == std::end(kEndings)) return false;
  if (ending != ".asc") return true;
  std::ifstream in(path);
  std::string word;
  in >> word;
  return lower_case(word) == "ncols" || lower_case(word) == "nrows";
}

FileReport inspect_raster(const std::filesystem::path& path) {
  buildings::TerrainOptions options;
  options.geoid_undulation_m = 0;  // the scenario sets the height reference
  const buildings::Raster raster(path, options);
  const buildings::RasterSummary summary = raster.summary();
  if (!summary.lowest_m)
    throw InputError(path, 0, "has no height within -500 to 9,000 m", "give a raster of heights");
  FileReport report{"height raster", {}, raster.notes(), {"city: {osm: MAP, terrain: FILE} in a scenario"}};
  report.contents.emplace_back(
      "posts", fmt::format("{} x {}, {:.3g} m apart", summary.columns, summary.rows, summary.spacing_m));
  report.contents.emplace_back(
      "heights", fmt::format("{:.1f} to {:.1f} m, as in the file", *summary.lowest_m, *summary.highest_m));
  if (summary.middle) {
    report.contents.emplace_back("middle",
                                 fmt::format("{:.6f}, {:.6f} deg", summary.middle->y(), summary.middle->x()));
  }
  if (summary.empty_fraction > 0) {
    report.notes.add_line(ReadReport::Level::Loss,
                          fmt::format("{:.1f} % of the posts have no height, or one beyond -500 to 9,000 m",
                                      100 * summary.empty_fraction));
  }
  return report;
}

/// The results of a study; empty for other files.
std::optional<FileReport> inspect_study(const std::filesystem::path& path) {
  const heatmap::NetcdfFile file = heatmap::NetcdfFile::open(path);
  std::optional<FileReport> report;
  file.first_in_child([&] {
    if (!file.text(NC_GLOBAL, "canyon_study_key")) return;
    report = {"results of a study of Canyon", {}, {}, {"programs that read NetCDF, such as xarray"}};
    report->contents.emplace_back("title", file.text(NC_GLOBAL, "title").value_or(""));
    for (const char* axis : {"run", "receiver"})
      report->contents.emplace_back(fmt::format("{}s", axis),
                                    fmt::format("{}", file.dimension(axis).value_or(0)));
  });
  return report;
}

FileReport inspect_map(const std::filesystem::path& path) {
  const heatmap::StoredMap map(path);
  FileReport report{"heat map of Canyon", {}, {}, {"canyon heatmap query FILE", "canyon view FILE"}};
  std::vector<std::string> layers;
  for (const heatmap::Layer layer : map.layers()) layers.emplace_back(heatmap::info(layer).name);
  report.contents.emplace_back("layers", fmt::format("{}", fmt::join(layers, ", ")));
  if (!map.times().empty())
    report.contents.emplace_back("time", span_text(map.times().front(), map.times().back()));
  report.contents.emplace_back("altitudes", fmt::format("{} m", fmt::join(map.altitudes_m(), ", ")));
  report.contents.emplace_back("receiver", map.motion());
  report.contents.emplace_back("origin", position_text(map.frame().origin()));
  return report;
}

FileReport inspect_observations(const std::filesystem::path& path) {
  rinex::ObservationOptions options;
  options.all_signals = true;
  const rinex::RinexObservations file = rinex::read_observations(path, options);
  std::set<gnss::SatelliteId> satellites;
  std::map<std::string, std::set<std::string>> signals;
  std::size_t judged = 0, multipath = 0;
  for (const rinex::ObservationEpoch& epoch : file.epochs) {
    for (const rinex::ObservedSignal& signal : epoch.signals) {
      satellites.insert(signal.id);
      signals[std::string(gnss::name(signal.id.system))].insert(signal.code.data());
      judged += signal.multipath ? 1 : 0;
      multipath += signal.multipath.value_or(false) ? 1 : 0;
    }
  }
  FileReport report{file.header.format + " observations",
                    {},
                    file.report.all(),
                    {"canyon validate SCENARIO --obs FILE", "canyon rtk FILE BASE"}};
  if (!file.epochs.empty()) {
    report.contents.emplace_back(
        "time", span_text(file.epochs.front().receiver_time, file.epochs.back().receiver_time));
  }
  report.contents.emplace_back("epochs", fmt::format("{}", file.epochs.size()));
  report.contents.emplace_back("satellites", satellites_text(satellites));
  std::vector<std::string> parts;
  parts.reserve(signals.size());
  for (const auto& [system, codes] : signals)
    parts.push_back(fmt::format("{} {}", system, fmt::join(codes, " ")));
  report.contents.emplace_back("signals", fmt::format("{}", fmt::join(parts, ", ")));
  if (judged > 0) {
    report.contents.emplace_back(
        "multipath", fmt::format("detected by the receiver itself in {} of {} classified observations",
                                 multipath, judged));
  }
  if (!file.header.receiver.empty()) report.contents.emplace_back("receiver", file.header.receiver);
  if (file.header.approximate_position_ecef) {
    report.contents.emplace_back(
        "position", position_text(geodesy::geodetic_from_ecef(*file.header.approximate_position_ecef)));
  }
  return report;
}

FileReport inspect_navigation(const std::filesystem::path& path) {
  const gnss::NavigationData data = rinex::read_rinex_navigation(path);
  std::set<gnss::SatelliteId> satellites;
  std::optional<GpsTime> first, last;
  std::size_t records = 0;
  const auto add = [&](gnss::SatelliteId id, GpsTime toe) {
    satellites.insert(id);
    first = first ? std::min(*first, toe) : toe;
    last = last ? std::max(*last, toe) : toe;
    ++records;
  };
  for (const auto& e : data.kepler) add(e.id, e.toe);
  for (const auto& e : data.glonass) add(e.id, e.toe);
  for (const auto& e : data.sbas) add(e.id, e.toe);
  std::set<std::tuple<gnss::SatelliteId, GpsTime, bool>> used;
  for (const auto& e : data.kepler) used.emplace(e.id, e.toe, gnss::is_galileo_fnav(e));
  FileReport report{"RINEX navigation (broadcast ephemerides)",
                    {},
                    data.report,
                    {"sky: {navigation: [FILE]} in a scenario", "canyon sky --nav FILE"}};
  if (first) report.contents.emplace_back("ephemerides", span_text(*first, *last));
  report.contents.emplace_back("records", fmt::format("{}", records));
  report.contents.emplace_back("satellites", satellites_text(satellites));
  if (used.size() < data.kepler.size()) {
    report.notes.add_line(
        ReadReport::Level::Remark,
        fmt::format("{} records are replaced by later messages for the same satellite and time",
                    data.kepler.size() - used.size()));
  }
  report.contents.emplace_back("ionosphere",
                               data.klobuchar.empty() ? "no coefficients" : "Klobuchar coefficients");
  if (data.galileo_nequick) {
    report.notes.add_line(
        ReadReport::Level::Remark,
        "coefficients of NeQuick-G are only kept for writing: Galileo's signals have Klobuchar's ionosphere "
        "with GPS's coefficients");
  }
  return report;
}

FileReport inspect_precise(const std::filesystem::path& path) {
  const orbit::PreciseSky sky(path);
  const std::vector<gnss::SatelliteId> ids = sky.satellites();
  return {"SP3 precise orbits",
          {{"time", span_text(sky.span().first, sky.span().second)},
           {"satellites", satellites_text({ids.begin(), ids.end()})}},
          sky.report(),
          {"sky: {sp3: [FILE]} in a scenario", "canyon sky --sp3 FILE"}};
}

FileReport inspect_rtcm(const std::filesystem::path& path) {
  const rtcm::RtcmCorrections file =
      rtcm::decode_rtcm_file(path, geodesy::gps_from_calendar({2026, 1, 1, 0, 0, 0, 0}), {}, false);
  std::set<gnss::SatelliteId> satellites = file.status.without_milliseconds;
  if (satellites.empty()) rtcm::require_epochs(path, file);
  FileReport report{"RTCM 3", {}, {}, {"canyon rtk ROVER FILE --nav NAVIGATION"}};
  for (const auto& epoch : file.epochs)
    for (const rtk::SignalMeasurement& seen : epoch->observations) satellites.insert(seen.measurement.id);
  std::vector<std::string> messages;
  for (const auto& [number, count] : file.status.messages)
    messages.push_back(fmt::format("{} ({})", number, count));
  report.contents.emplace_back("epochs", fmt::format("{} (the file has no date)", file.epochs.size()));
  report.contents.emplace_back("satellites", satellites_text(satellites));
  report.contents.emplace_back("messages", fmt::format("{}", fmt::join(messages, ", ")));
  const Eigen::Vector3d point =
      file.epochs.empty() ? Eigen::Vector3d::Zero().eval() : file.epochs.back()->station_ecef;
  if (!point.isZero())
    report.contents.emplace_back("station", position_text(geodesy::geodetic_from_ecef(point)));
  report.notes.add_line(ReadReport::Level::Loss, file.status.warnings());
  return report;
}

FileReport inspect_path(const std::filesystem::path& path, const std::string& format) {
  const GpsTime start = geodesy::gps_from_calendar({2026, 1, 1, 0, 0, 0, 0});
  ReadReport notes;
  const auto read = [&](bool heights) {
    simulation::HeightReading reading;
    reading.needed = heights;
    return simulation::read_recorded_path(path, format, start, reading);
  };
  const auto read_any = [&] {
    try {
      return read(true);
    } catch (const InputError&) {
      try {
        simulation::RecordedPath flat = read(false);
        notes.add_line(ReadReport::Level::Guess, "it has no heights: give trajectory.height_above_terrain_m");
        return flat;
      } catch (const InputError&) {
      }
      throw;
    }
  };
  simulation::RecordedPath recorded = read_any();
  const bool timed = recorded.timed, dated = recorded.is_dated;
  FileReport report{fmt::format("recorded path ({})", format),
                    {},
                    {},
                    {fmt::format("trajectory: {{file: FILE, format: {}{}}} in a scenario", format,
                                 timed ? "" : ", speed_mps: 10")}};
  const auto format_positions = [&](const geodesy::Geodetic& first, const geodesy::Geodetic& last) {
    report.contents.emplace_back("first point", position_text(first));
    report.contents.emplace_back("last point", position_text(last));
  };
  if (timed) {
    simulation::drop_unordered(recorded);
    const std::size_t count = recorded.points.size();
    const simulation::TrajectoryFile file = simulation::recorded_trajectory(std::move(recorded));
    const simulation::Trajectory& route = file.trajectory;
    report.uses.emplace_back("canyon validate SCENARIO --truth FILE");
    report.contents.emplace_back(
        "time", dated ? span_text(route.begin(), route.end())
                      : fmt::format("{:.0f} s, without a date", route.end() - route.begin()));
    report.contents.emplace_back(
        "points", dated ? fmt::format("{} points, {} to {}", count, geodesy::format_utc(route.begin(), 0),
                                      geodesy::format_utc(route.end(), 0))
                        : fmt::format("{} points", count));
    report.contents.emplace_back("interval", fmt::format("{:g} s", route.sample_interval_s()));
    report.contents.emplace_back("length", fmt::format("{:.0f} m", route.length_m()));
    format_positions(route.at(route.begin()).position, route.at(route.end()).position);
    recorded.report = file.report;
  } else {
    report.contents.emplace_back("points", fmt::format("{}, without times", recorded.points.size()));
    format_positions(recorded.points.front().position, recorded.points.back().position);
  }
  notes.append(recorded.report);
  report.notes = std::move(notes);
  return report;
}

/// A log of Android's GnssLogger: its observations, else its fixes, else its NMEA sentences.
FileReport inspect_android(const std::filesystem::path& path) {
  const std::map<std::string, std::size_t> kinds = rinex::android_log_kinds(path);
  const bool raw = kinds.count("Raw") > 0, fixes = kinds.count("Fix") > 0;
  FileReport report = raw || (!fixes && kinds.count("NMEA") == 0)
                          ? inspect_observations(path)
                          : inspect_path(path, fixes ? "gnsslogger" : "nmea");
  report.contents.emplace_back("lines", rinex::android_log_kinds_text(path));
  if (raw && fixes)
    report.uses.emplace_back("trajectory: {file: FILE, format: gnsslogger} in a scenario (its fixes)");
  return report;
}

}  // namespace

FileReport inspect_file(const std::filesystem::path& path) {
  if (is_scenario(path) && path.filename() != "metadata.yaml") return inspect_scenario(path);  // else a bag's
  if (path.extension() == ".nc") {
    auto study = inspect_study(path);
    return study ? *std::move(study) : inspect_map(path);
  }
  if (simulation::source_of_file(path)) return inspect_city(path);
  if (is_raster(path)) return inspect_raster(path);
  const FileKind kind = file_kind(path);
  switch (kind) {
    case FileKind::RinexObservation:
      return inspect_observations(path);
    case FileKind::RinexNavigation:
      return inspect_navigation(path);
    case FileKind::GnssLogger:
      return inspect_android(path);
    case FileKind::Sp3:
      return inspect_precise(path);
    case FileKind::Rtcm:
      return inspect_rtcm(path);
    case FileKind::Nmea:
    case FileKind::Gpx:
    case FileKind::Kml:
      return inspect_path(path, std::string(trajectory_format(kind)));
    case FileKind::Columns:
      return inspect_path(path, simulation::trajectory_format_of(path));
    default:
      break;
  }
  const InputError unknown(path, 0, "is not a known kind of file",
                           fmt::format("known are scenarios (.yaml), cities ({}), RINEX, SP3, RTCM 3, NMEA, "
                                       "GnssLogger, GPX, KML, CSV and heat maps (.nc)",
                                       simulation::city_file_endings()));
  throw explained(unknown, path, FileKind::Columns);
}

}  // namespace canyon::inspection
