#include <fmt/format.h>

#include <unistd.h>
#include <cstdio>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/outputs/live/session.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::cli {
namespace {

struct LiveArguments : RunArguments {
  std::vector<std::string> poses;
  Changes<simulation::PoseSourceOptions> pose_source;
  std::vector<std::string> streams;
  Changes<simulation::LiveOptions> live;
  bool by_stamps = false;
};

simulation::Scenario read_live_scenario(const LiveArguments& arguments) {
  simulation::Scenario scenario = read_scenario(arguments, {false});
  simulation::LiveOptions live = scenario.live.value_or(simulation::LiveOptions{});
  if (!arguments.poses.empty()) live.poses.clear();
  for (const std::string& from : arguments.poses) {
    simulation::PoseSourceOptions& source = live.poses.emplace_back();
    source.from = from;
    make(arguments.pose_source, source);
  }
  for (const std::string& text : arguments.streams) live.streams.push_back(encoding::parse_stream(text));
  make(arguments.live, live);
  if (arguments.by_stamps) live.clock = simulation::LiveClock::Stamps;
  scenario.live = std::move(live);
  return scenario;
}

std::string metrics_line(const live::SessionMetrics& metrics) {
  std::string line =
      fmt::format("{:8.1f} s  {} epochs, {} with a fix", metrics.host_s, metrics.epochs, metrics.fixes);
  if (metrics.no_truth > 0) line += fmt::format(", {} without truth", metrics.no_truth);
  if (metrics.missed > 0) line += fmt::format(", {} missed", metrics.missed);
  if (!metrics.no_fix.empty()) line += fmt::format("; now no fix: {}", metrics.no_fix);
  if (metrics.poses > 0) line += fmt::format("; {} poses", metrics.poses);
  if (metrics.latency.count() > 0) {
    line += fmt::format("; pose to bytes {:.1f} ms (median), {:.1f} ms (99 %), {:.1f} ms (most)",
                        *metrics.latency.quantile(0.5) * 1e3, *metrics.latency.quantile(0.99) * 1e3,
                        metrics.latency.greatest() * 1e3);
  }
  return line;
}

int run_live(const LiveArguments& arguments) {
  simulation::Scenario scenario = read_live_scenario(arguments);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  bool sampled = false;  // a line that the next one overwrites
  const auto note = [&](const std::string& text) {
    if (arguments.quiet) return;
    fmt::print(stderr, "{}{}\n", std::exchange(sampled, false) ? "\n" : "", hide_passwords(text));
  };
  auto scene = std::make_shared<simulation::CityScene>(simulation::load_city(scenario));
  const city::CitySummary summary = city::summarize(scene->city);
  note(fmt::format("city        {}: {} buildings", scene->city.name, summary.buildings));
  ReadReport report = scene->city.notes;
  report.add_line(ReadReport::Level::Guess, scenario.warnings);
  print_report(report, "canyon check " + arguments.scenario);
  live::Session session(scenario, std::move(scene));
  note(fmt::format("live        {} {}, an epoch every {} s from {}", scenario.receivers.size(),
                   scenario.receivers.size() == 1 ? "receiver" : "receivers", session.interval_s(),
                   geodesy::format_gpst(session.start(), 0)));
  for (const auto& source : session.scenario().live->poses) note("poses       from " + source.from);
  for (const auto& stream : session.scenario().live->streams) {
    note(fmt::format("stream      {}{}{} to {}", stream.receiver, stream.receiver.empty() ? "" : "/",
                     stream.format, stream.address));
  }

  const std::atomic<bool>& stop = catch_interrupts();
  int quiet_seconds = 0;
  live::SessionOptions options;
  options.stop = &stop;
  options.note = note;
  options.warn = [&](const std::string& text) {
    if (std::exchange(sampled, false)) fmt::print(stderr, "\n");
    print_warnings({text});
  };
  options.progress = [&](const live::SessionMetrics& metrics) {
    if (arguments.quiet) return;
    if (terminal) {
      fmt::print(stderr, "\r\033[K{}", metrics_line(metrics));
      sampled = true;
    } else if (++quiet_seconds % 10 == 0) {
      note(metrics_line(metrics));
    }
  };
  const live::SessionMetrics metrics = session.run({}, options);
  note("ended       " + metrics_line(metrics));
  return stop ? kInterrupted : kOk;
}

}  // namespace

void add_live(Command& app) {
  Command& command =
      app.add_command("live", "simulate receivers in real time: poses in, receiver messages out");
  LiveArguments& arguments = command.run_with(run_live);
  add_scenario_file(command, arguments.scenario, "scenario file (YAML) with a key 'live'");
  command
      .add_option("--poses", arguments.poses, "FROM",
                  "source of poses, instead of live.poses: trajectory, file:LOG, stdin:, "
                  "udp-listen://127.0.0.1:PORT, tcp-connect://HOST:PORT, serial:DEVICE@BAUD")
      .repeated();
  add_change(command, "--pose-format", arguments.pose_source, "format");
  command
      .add_option("--stream", arguments.streams, "STREAM",
                  fmt::format("added to live.streams: [RECEIVER/]FORMAT=ADDRESS. Addresses: {}; options "
                              "follow them: ?rate_hz=5&latency_s=0.1&jitter_s=0.02",
                              transport::address_forms()))
      .repeated();
  add_change(command, "--control", arguments.live, "control");
  add_switch(command, "--changes", arguments.live, "changes");
  add_change(command, "--speed", arguments.live, "speed");
  command.add_flag("--stamps", arguments.by_stamps,
                   "use the poses' time stamps as the clock instead of real time");
  add_run_field(command, "--duration", arguments, "duration_s");
  add_run_field(command, "--seed", arguments, "seed");
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
  command.footer = "docs/live.md explains poses, streams and commands.";
}

}  // namespace canyon::cli
