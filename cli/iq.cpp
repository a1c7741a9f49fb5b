#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "canyon/samples/sample_file.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/commands.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

struct IqArguments {
  std::string scenario, out, format = "int8";
  std::vector<std::string> bands, receivers;
  std::optional<double> centre_hz, intermediate_hz, duration_s, epoch_rate_hz, noise_level, agc_s,
      bandwidth_hz;
  std::optional<std::size_t> seed;
  double rate_hz = 4e6;
  int threads = 0;
  bool real = false, no_noise = false, quiet = false;
};

/// The receivers that are asked for, by their names; without any the only one.
std::vector<std::size_t> chosen_receivers(const IqArguments& arguments,
                                          const simulation::Scenario& scenario) {
  std::vector<std::string> names;
  for (const simulation::ReceiverConfig& receiver : scenario.receivers)
    names.push_back(receiver.options.name);
  std::vector<std::size_t> chosen;
  for (const std::string& name : arguments.receivers) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      throw InputError(fmt::format("--receiver '{}' is not in the scenario", name),
                       fmt::format("give {}", fmt::join(names, ", ")));
    }
    chosen.push_back(static_cast<std::size_t>(found - names.begin()));
  }
  if (!chosen.empty()) return chosen;
  if (names.size() > 1) {
    throw InputError(
        fmt::format("the scenario has {} receivers", names.size()),
        fmt::format("choose by --receiver, which may be given again: {}", fmt::join(names, ", ")));
  }
  return {0};
}

/// "drive.iq" of receiver and band where there are several: "drive.car.L5.iq".
std::filesystem::path path_of(const IqArguments& arguments, const std::string& receiver,
                              const std::string& band) {
  const std::filesystem::path out = arguments.out;
  if (arguments.receivers.size() <= 1 && arguments.bands.size() <= 1) return out;
  if (out == "-" || transport::ByteStream::is_address(arguments.out)) {
    throw InputError(fmt::format("--out {} takes one receiver and one band", arguments.out),
                     "give a file, or one --receiver and --band");
  }
  std::string name = out.stem().string();
  if (arguments.receivers.size() > 1) name += "." + receiver;
  if (arguments.bands.size() > 1) name += "." + band;
  return out.parent_path() / (name + out.extension().string());
}

simulation::Scenario read_iq_scenario(const IqArguments& arguments) {
  simulation::Scenario scenario = simulation::read_scenario(arguments.scenario);
  if (arguments.seed) scenario.seed = *arguments.seed;
  if (arguments.duration_s) scenario.duration_s = arguments.duration_s;
  if (arguments.epoch_rate_hz) scenario.rate_hz = arguments.epoch_rate_hz;
  return scenario;
}

int run_iq(const IqArguments& arguments) {
  if (arguments.real && !arguments.intermediate_hz) {
    throw InputError("--real needs an intermediate frequency",
                     fmt::format("give --if, e.g. --if {}: a quarter of the rate", arguments.rate_hz / 4));
  }
  const simulation::Scenario scenario = read_iq_scenario(arguments);
  const std::vector<std::size_t> receivers = chosen_receivers(arguments, scenario);
  std::vector<std::string> bands = arguments.bands;
  if (bands.empty()) bands = {arguments.centre_hz ? "" : "L1"};

  std::vector<std::string> warnings;
  city::City city = simulation::load_city(scenario, warnings);
  const simulation::Simulation simulation(scenario, std::move(city));
  if (!arguments.quiet) {
    print_warnings(warnings);
    print_warnings(simulation.warnings());
  }
  std::vector<std::unique_ptr<samples::SampleFile>> files;
  std::vector<simulation::EpochSink*> sinks;
  for (const std::size_t receiver : receivers) {
    for (const std::string& band : bands) {
      samples::SampleFileOptions options;
      options.receiver = receiver;
      options.path = path_of(arguments, scenario.receivers[receiver].options.name, band);
      options.front_end.centre_hz = band.empty() ? *arguments.centre_hz : samples::band_centre_hz(band);
      options.front_end.intermediate_hz = arguments.intermediate_hz.value_or(0);
      options.front_end.real = arguments.real;
      options.front_end.bandwidth_hz = arguments.bandwidth_hz.value_or(0);
      options.front_end.rate_hz = arguments.rate_hz;
      options.front_end.noise = !arguments.no_noise;
      options.format = samples::format_by_name(arguments.format);
      options.noise_level = arguments.noise_level;
      options.agc_s = arguments.agc_s.value_or(0);
      options.threads = arguments.threads;
      const samples::SampleFile& file =
          *files.emplace_back(std::make_unique<samples::SampleFile>(simulation, options));
      sinks.push_back(files.back().get());
      note(arguments.quiet,
           fmt::format(
               "{}: {:.3f} MHz{}, {} Msps {}{}, {:.3f} GB: {}", options.path.string(),
               options.front_end.centre_hz * 1e-6,
               arguments.intermediate_hz ? fmt::format(" at {} MHz", *arguments.intermediate_hz * 1e-6) : "",
               arguments.rate_hz * 1e-6, arguments.real ? "real " : "", arguments.format,
               static_cast<double>(file.expected_bytes()) * 1e-9, fmt::join(file.plan().carried, ", ")));
      if (arguments.quiet || file.plan().left_out.empty()) continue;
      print_warnings({fmt::format("left out, too wide for {} Msps: {}", arguments.rate_hz * 1e-6,
                                  fmt::join(file.plan().left_out, ", "))});
    }
  }

  if (transport::ByteStream::is_address(arguments.out)) {
    note(arguments.quiet, fmt::format("waiting for a reader of {}", arguments.out));
    files.front()->wait_for_reader();
  }
  const std::atomic<bool>& stop_requested = catch_interrupts();
  simulation::RunResult result;
  {
    Progress progress("samples", arguments.quiet);
    simulation::RunOptions options;
    options.threads = arguments.threads;
    options.stop = &stop_requested;
    options.block = 16;
    options.progress = progress.callback();
    result = simulation.run(sinks, options);
  }
  if (!arguments.quiet) print_warnings(result.warnings);
  for (const auto& file : files) {
    const samples::Generator::Contents contents = file->contents();
    std::vector<std::string> counts;
    for (const auto& [name, count] : contents.satellites) counts.push_back(fmt::format("{} {}", count, name));
    note(arguments.quiet,
         fmt::format("{} samples: {}; up to {} paths", file->samples(),
                     counts.empty() ? "no signal" : fmt::format("{}", fmt::join(counts, ", ")),
                     contents.most_paths));
    if (arguments.quiet) continue;
    if (!contents.without_message.empty()) {
      print_warnings({fmt::format("without symbols, since no message of theirs is known: {}",
                                  fmt::join(contents.without_message, ", "))});
    }
    constexpr double kMuch = 0.01;
    if (file->most_clipped() > kMuch) {
      print_warnings({fmt::format(
          "up to {:.0f} % of the samples are beyond the largest value: lower --noise-level or use --agc",
          100 * file->most_clipped())});
    }
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
      "docs/iq.md plays the file to GNSS-SDR. Do not transmit a file of samples.";
  IqArguments& arguments = command.run_with(run_iq);
  command.add_option("scenario", arguments.scenario, "SCENARIO", "scenario file (YAML)").required();
  command
      .add_option(
          "-o,--out", arguments.out, "FILE",
          "file for the samples (real and imaginary parts alternate) and FILE.sigmf-meta; - or a FIFO: a "
          "pipe; tcp://127.0.0.1:PORT waits for a reader, tcp-connect://HOST:PORT connects to one")
      .required();
  command
      .add_option("--band", arguments.bands, "BAND",
                  "band: L1, L2, L5, E5 or a signal's name (L1); several bands give several files")
      .repeated();
  command.add_option("--centre-hz", arguments.centre_hz, "HZ", "centre frequency instead of a band")
      .excludes("--band");
  command.add_option("--rate", arguments.rate_hz, "HZ", "samples per second (4e6)").within(1e6, 200e6);
  command.add_option("--if", arguments.intermediate_hz, "HZ",
                     "intermediate frequency: the band's centre is moved here (0)");
  command.add_option("--bandwidth", arguments.bandwidth_hz, "HZ",
                     "two-sided bandwidth of a filter before the converter (none)");
  command.add_flag("--real", arguments.real, "real samples, at an intermediate frequency (--if)");
  command.add_option("--format", arguments.format, "F", "int8, int16, float32, 2bit or 1bit (int8)")
      .one_of(samples::format_names());
  command.add_option("--noise-level", arguments.noise_level, "X",
                     "standard deviation of the noise, divided by the largest value (0.25; 2bit 0.67)");
  command.add_option(
      "--agc", arguments.agc_s, "S",
      "automatic gain control with this time constant: the received power is kept at the noise level");
  command.add_flag("--no-noise", arguments.no_noise, "no noise of the front end");
  command
      .add_option("--receiver", arguments.receivers, "NAME",
                  "one of the scenario's receivers; may be repeated")
      .repeated();
  command.add_option("--seed", arguments.seed, "N", "instead of the scenario's seed");
  command.add_option("--duration", arguments.duration_s, "S", "instead of the scenario's duration_s");
  command.add_option("--epoch-rate", arguments.epoch_rate_hz, "HZ",
                     "rate at which paths are traced, instead of the scenario's rate_hz");
  add_threads(command, arguments.threads);
  command.add_flag("--quiet", arguments.quiet, "print errors only");
}

}  // namespace canyon::cli
