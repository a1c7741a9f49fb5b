#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/base/text.hpp"
#include "cli/arguments.hpp"

namespace canyon::heatmap {
class MpiProcesses;
}
namespace canyon::gnss {
struct NavigationData;
}

namespace canyon::cli {

/// kFailure for an OutputError, else kBadInput.
[[nodiscard]] ExitCode exit_code(const InputError& error);

/// Runs `work` and returns its result. If it throws and there are several processes, prints the error as
/// main() does and ends all of them: the others would wait for this one for ever.
[[nodiscard]] int guarded(const heatmap::MpiProcesses& processes, const std::function<int()>& work);

/// Each adds a command to the program, or to the command that its argument names.
void add_demo(Command& app);
void add_new(Command& app);
void add_simulate(Command& app);
void add_live(Command& app);
void add_sky(Command& app);
void add_trace(Command& app);
void add_skyplot(Command& app);
void add_city(Command& app);
void add_check(Command& app);
void add_profiles(Command& app);
void add_scenario(Command& app);
void add_faults(Command& app);
void add_validate(Command& app);
void add_calibrate(Command& app);
void add_heatmap(Command& app);
void add_correlation(Command& app);
void add_iq(Command& app);
void add_heatmap_query(Command& heatmap);
void add_rtk(Command& app);
void add_study(Command& app);
void add_bench(Command& app);
void add_view(Command& app);
void add_completion(Command& app);
/// @param version what the pages name
void add_manual(Command& app, const std::string& version);

/// "22.3,114.17,10" -> position (degrees, degrees, metres; the height may be left out). Throws InputError
/// naming the option.
[[nodiscard]] geodesy::Geodetic parse_place(const std::string& text, const std::string& option);
/// The numbers of a list, "1,2.5,-3"; empty unless every piece is one.
[[nodiscard]] std::vector<double> parse_numbers(const std::string& text);
/// Throws InputError, naming --format, unless simulation::trajectory_formats() has it.
void check_trajectory_format(const std::string& format);
/// The time of the middle one of the ephemerides, since some receivers also write old ones; {} without any.
[[nodiscard]] geodesy::GpsTime middle_time(const gnss::NavigationData& navigation);
/// Adds --threads.
void add_threads(Command& command, int& threads, const std::string& about = "0: one for each core (0)");
/// Adds --known, a list of names for unknowns::unknowns_of().
Option& add_known(Command& command, std::string& known);
/// Warns where 90 % intervals of so many draws hold less (caution_of_few()). @param option that says more
void warn_of_few_draws(std::size_t count, std::string_view option);
/// Warns on standard error where an instant names no zone.
void warn_of_no_zone(std::string_view instant);
/// An instant as geodesy::parse_simulated_time() reads it; warns on standard error where it names no zone.
[[nodiscard]] geodesy::GpsTime parse_instant(std::string_view text);

/// Returns work(). Puts the option's name in front of an InputError that names no file.
template <typename Work>
auto for_option(const std::string& option, const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    if (!error.file().empty()) throw;
    throw InputError(option + ": " + error.problem(), error.cure());
  }
}

/// Prints text_table() to standard output.
void print_table(const TextRow& head, const std::vector<TextRow>& rows);

/// Writes "warning: ..." lines to standard error.
void print_warnings(const std::vector<std::string>& warnings);
/// Prints the losses and guesses of what was read, also with --quiet: the first five, and where the rest is.
/// @param where "canyon check FILE", or the report in the folder of the results
/// @param prefix of each line
void print_report(const ReadReport& report, const std::string& where, const std::string& prefix = {});
/// The whole report: {"level": "loss", "text": "..."} of each.
[[nodiscard]] Json report_json(const ReadReport& report);
/// report_json() of all that print_report() had in this command: the key `report` of its JSON.
[[nodiscard]] Json printed_reports();

}  // namespace canyon::cli
