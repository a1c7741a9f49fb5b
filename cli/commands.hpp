#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/satellite_id.hpp"

namespace canyon::cli {

/// Exit codes of every command.
enum ExitCode : int { kOk = 0, kFailure = 1, kBadInput = 2, kInterrupted = 130 };

/// kBadInput; kFailure for what the machine refuses (OutputError).
[[nodiscard]] ExitCode exit_code(const InputError& error);

/// Each adds its subcommand to `app`; the chosen one leaves what to run in `action`, which returns an
/// ExitCode.
using Action = std::function<int()>;
void add_simulate(CLI::App& app, Action& action);
void add_live(CLI::App& app, Action& action);
void add_sky(CLI::App& app, Action& action);
void add_trace(CLI::App& app, Action& action);
void add_skyplot(CLI::App& app, Action& action);
void add_city(CLI::App& app, Action& action);
void add_profiles(CLI::App& app, Action& action);
void add_scenario(CLI::App& app, Action& action);
void add_faults(CLI::App& app, Action& action);
void add_validate(CLI::App& app, Action& action);
void add_calibrate(CLI::App& app, Action& action);
void add_heatmap(CLI::App& app, Action& action);
void add_study(CLI::App& app, Action& action);

/// "22.3,114.17,10" -> position (degrees, degrees, metres; the height may be left out). Throws InputError
/// naming the option.
[[nodiscard]] geodesy::Geodetic parse_place(const std::string& text, const std::string& option);
/// The numbers of a list, "1,2.5,-3"; empty unless every piece is one.
[[nodiscard]] std::vector<double> parse_numbers(const std::string& text);
/// Throws InputError, naming --format, unless simulation::trajectory_formats() has it.
void check_trajectory_format(const std::string& format);
/// Adds --threads.
void add_threads(CLI::App& command, int& threads, const std::string& about = "0: one for each core (0)");
/// Warns on standard error where an instant names no zone.
void warn_of_no_zone(std::string_view instant);
/// An instant as geodesy::parse_simulated_time() reads it; warns on standard error where it names no zone.
[[nodiscard]] geodesy::GpsTime parse_instant(std::string_view text);
/// "GPS,Galileo" -> set; throws InputError naming the known systems.
[[nodiscard]] std::set<gnss::System> parse_systems(const std::string& text);

/// What `work` returns; what it throws of no file gets the option's name in front.
template <typename Work>
auto for_option(const std::string& option, const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    if (!error.file().empty()) throw;
    throw InputError(option + ": " + error.problem(), error.cure());
  }
}

/// Prints rows under a header to standard output, columns aligned: numbers to the right, words to the left.
void print_table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);

/// Writes a file, whole or not at all. Throws as OutputFile does.
void write_file(const std::filesystem::path& path, const std::string& bytes);

/// Writes "warning: ..." lines to standard error.
void print_warnings(const std::vector<std::string>& warnings);

}  // namespace canyon::cli
