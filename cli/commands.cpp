#include "cli/commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "canyon/analysis/heatmap/engine/mpi.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/unknowns/unknowns.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {

ExitCode exit_code(const Error& error) {
  return dynamic_cast<const OutputError*>(&error) == nullptr ? kBadInput : kFailure;
}

int guarded(const heatmap::MpiProcesses& processes, const std::function<int()>& work) {
  if (processes.ranks() == 1) return work();
  try {
    return work();
  } catch (const Error& error) {
    fmt::print(stderr, "canyon: {}\n", error.what());
    std::fflush(stderr);
    processes.abort(exit_code(error));
  } catch (const std::exception& error) {
    fmt::print(stderr, "canyon: internal error on rank {}: {}\n", processes.rank(), error.what());
    std::fflush(stderr);
    processes.abort(kFailure);
  }
}

int unless_interrupted(const std::function<int()>& work, const char* undone) {
  try {
    return work();
  } catch (const Interrupted&) {
    fmt::print(stderr, "canyon: interrupted: {}\n", undone);
    return kInterrupted;
  }
}

geodesy::Geodetic parse_position(const std::string& text, const std::string& option) {
  const std::vector<double> values = parse_numbers(text);
  if (values.size() != 3) {
    throw InputError(fmt::format("{} '{}' is not a position", option, text),
                     "give LATITUDE,LONGITUDE,HEIGHT in degrees and metres, e.g. 22.3,114.17,10");
  }
  const geodesy::Geodetic position = geodesy::Geodetic::from_degrees(values[0], values[1], values[2]);
  geodesy::check_geodetic(position, option.c_str());
  return position;
}

geodesy::GpsTime middle_time(const gnss::NavigationData& navigation) {
  std::vector<geodesy::GpsTime> times;
  for (const auto& ephemeris : navigation.kepler) times.push_back(ephemeris.toe);
  for (const auto& ephemeris : navigation.glonass) times.push_back(ephemeris.toe);
  if (times.empty()) return {};
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

std::vector<double> parse_numbers(const std::string& text) {
  std::vector<double> values;
  for (const std::string_view piece : split(text, ',')) {
    const std::optional<double> value = parse_double(piece);
    if (!value) return {};
    values.push_back(*value);
  }
  return values;
}

void check_trajectory_format(const std::string& format) {
  const std::vector<std::string>& known = simulation::trajectory_formats();
  if (format.empty() || std::find(known.begin(), known.end(), format) != known.end()) return;
  throw InputError(fmt::format("--format '{}' is unknown", format),
                   fmt::format("give {}", fmt::join(known, ", ")));
}

void add_threads(Command& command, int& threads, const std::string& about) {
  command.add_option("--threads", threads, "N", about).within(0, simulation::kMaxThreads);
}

void warn_of_few_samples(std::size_t count, std::string_view option) {
  if (const auto caution = caution_of_few(count, "samples"))
    print_warnings({fmt::format("{}: give {} {}", *caution, option, kMinCountFor90)});
}

Option& add_fixed_unknowns(Command& command, std::string& known) {
  return command
      .add_option("--fixed-unknowns", known, "LIST",
                  fmt::format("unknowns that are not sampled, of {}", fmt::join(unknowns::names(), ", ")))
      .formerly("--known");
}

void warn_of_no_zone(std::string_view instant) {
  if (geodesy::names_time_scale(instant)) return;
  print_warnings({fmt::format("{} has no time zone and is taken as UTC; append Z", trim(instant))});
}

geodesy::GpsTime parse_instant(std::string_view text) {
  const geodesy::GpsTime time = geodesy::parse_simulated_time(text);
  warn_of_no_zone(text);
  return time;
}

void print_table(const TextRow& head, const std::vector<TextRow>& rows) {
  fmt::print("{}", text_table(head, rows));
}

void print_warnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) fmt::print(stderr, "warning: {}\n", hide_passwords(warning));
}

namespace {

ReadReport printed;

}  // namespace

void print_report(const ReadReport& report, const std::string& where, const std::string& prefix) {
  for (const std::string& line : report.shown(where)) print_warnings({prefix + line});
  printed.append(report);
}

Json printed_reports() {
  return report_json(printed);
}

Json report_json(const ReadReport& report) {
  Json all = Json::array();
  for (const auto& [level, text] : report.entries())
    all.push_back({{"level", ReadReport::name(level)}, {"text", hide_passwords(text)}});
  return all;
}

}  // namespace canyon::cli
