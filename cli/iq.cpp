#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "canyon/base/transport/byte_sink.hpp"
#include "canyon/simulation/samples/sample_file.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::cli {
namespace {

struct IqArguments : RunArguments {
  std::string out;
  std::vector<std::string> receivers;
  Changes<samples::SampleOptions> samples;
  bool no_noise = false;
};

/// The receivers of --receiver, else the only one.
std::vector<std::size_t> chosen_receivers(const IqArguments& arguments,
                                          const simulation::Scenario& scenario) {
  std::vector<std::size_t> chosen;
  for (const std::string& name : arguments.receivers)
    chosen.push_back(for_option("--receiver", [&] { return simulation::find_receiver(scenario, name); }));
  if (!chosen.empty()) return chosen;
  if (scenario.receivers.size() > 1) {
    throw InputError(fmt::format("the scenario has {} receivers", scenario.receivers.size()),
                     fmt::format("give --receiver, which may be repeated: {}",
                                 fmt::join(simulation::receiver_names(scenario.receivers), ", ")));
  }
  return {0};
}

/// "drive.iq" for a receiver if there are several: "drive.car.iq".
std::filesystem::path path_of(const IqArguments& arguments, const std::string& receiver) {
  std::filesystem::path out = arguments.out;
  if (arguments.receivers.size() <= 1) return out;
  if (out == "-" || transport::is_byte_sink(arguments.out)) {
    throw InputError(fmt::format("--out {} can have one receiver", arguments.out),
                     "give a file, or one --receiver");
  }
  return out.parent_path() / (out.stem().string() + "." + receiver + out.extension().string());
}

int run_iq(const IqArguments& arguments) {
  simulation::Scenario scenario = read_scenario(arguments);
  make(arguments.samples, scenario.samples);
  if (arguments.no_noise) scenario.samples.noise = false;
  scenario.samples.validate();
  const std::vector<std::size_t> receivers = chosen_receivers(arguments, scenario);
  const auto simulation = make_ready(scenario, arguments.scenario).simulation;
  std::shared_ptr<transport::ByteSink> to;
  if (transport::is_byte_sink(arguments.out)) to = transport::open_byte_sink(arguments.out);
  std::vector<std::unique_ptr<samples::SampleFile>> files;
  std::vector<simulation::EpochSink*> sinks;
  for (const std::size_t receiver : receivers) {
    const auto path = path_of(arguments, scenario.receivers[receiver].options.name);
    for (auto& file : samples::make_sample_files(*simulation, receiver, path, arguments.threads, to)) {
      note(arguments.quiet, file->about());
      sinks.push_back(file.get());
      files.push_back(std::move(file));
    }
  }

  if (to) {
    note(arguments.quiet, fmt::format("waiting for a reader of {}", arguments.out));
    to->wait_for_reader();
  }
  const simulation::RunResult result = run(*simulation, sinks, arguments, "samples");
  for (const auto& file : files) {
    const samples::Generator::Contents contents = file->contents();
    std::vector<std::string> counts;
    for (const auto& [name, count] : contents.satellites) counts.push_back(fmt::format("{} {}", count, name));
    note(arguments.quiet,
         fmt::format("{} samples: {}; up to {} paths", file->samples(),
                     counts.empty() ? "no signal" : fmt::format("{}", fmt::join(counts, ", ")),
                     contents.max_paths));
  }
  if (result.interrupted) {
    fmt::print(stderr, "canyon: interrupted: {} of {} epochs finished and written\n", result.epochs,
               result.planned);
    return kInterrupted;
  }
  note(arguments.quiet, fmt::format("{:.1f} s in {:.1f} s, {:.2f} times real time", result.simulated_s,
                                    result.wall_s, result.simulated_s / std::max(result.wall_s, 1e-9)));
  return kOk;
}

}  // namespace

void add_iq(Command& app) {
  Command& command =
      app.add_command("iq", "write the signal at the antenna as samples, for software receivers");
  command.footer =
      "canyon iq drive.yaml --out drive.iq --band L1 --rate 4e6 --format int8\n"
      "The scenario's samples: has the defaults of the options below.\n"
      "docs/iq.md plays the file to GNSS-SDR. Do not transmit a file of samples.";
  IqArguments& arguments = command.run_with(run_iq);
  add_scenario_file(command, arguments.scenario);
  command
      .add_option(
          "-o,--out", arguments.out, "FILE",
          "file for the samples (real and imaginary parts alternate) and FILE.sigmf-meta; - or a FIFO: a "
          "pipe; tcp://127.0.0.1:PORT waits for a reader, tcp-connect://HOST:PORT connects to one; "
          "zmq://127.0.0.1:PORT publishes to a subscriber of ZeroMQ")
      .required()
      .writes();
  const auto add = [&](const char* flag, const char* name) -> Option& {
    return add_change(command, flag, arguments.samples, name);
  };
  add("--band", "bands");
  add("--rate", "rate_hz");
  add("--intermediate-hz", "intermediate_hz").formerly("--if");
  add("--bandwidth", "bandwidth_hz");
  add_switch(command, "--real", arguments.samples, "real_valued");
  add("--format", "format");
  add("--noise-level", "noise_level");
  command.add_flag("--no-noise", arguments.no_noise, "no noise of the front end");
  command
      .add_option("--receiver", arguments.receivers, "NAME",
                  "one of the scenario's receivers; may be repeated")
      .repeated();
  add_run_options(command, arguments);
}

}  // namespace canyon::cli
