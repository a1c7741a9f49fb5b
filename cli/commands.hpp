#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
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
[[nodiscard]] ExitCode exit_code(const Error& error);

/// Runs `work` and returns its result. If it throws and there are several processes, prints the error as
/// main() does and ends all of them: the others would wait for this one forever.
[[nodiscard]] int guarded(const heatmap::MpiProcesses& processes, const std::function<int()>& work);

/// Returns work(). If Ctrl-C ends it (Interrupted), prints what was not done.
[[nodiscard]] int unless_interrupted(const std::function<int()>& work,
                                     const char* undone = "nothing was written");

/// Each adds a command to the program, or to its argument's command.
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
void add_iq(Command& app);
void add_heatmap_query(Command& heatmap);
void add_rtk(Command& app);
void add_study(Command& app);
void add_bench(Command& app);
void add_view(Command& app);
void add_completion(Command& app);
/// @param version printed in the pages
void add_manual(Command& app, const std::string& version);

/// "22.3,114.17,10" -> position (degrees, degrees, optional metres). InputError with the option's name.
[[nodiscard]] geodesy::Geodetic parse_position(const std::string& text, const std::string& option);
/// The numbers of a list, "1,2.5,-3"; empty unless every piece is one.
[[nodiscard]] std::vector<double> parse_numbers(const std::string& text);
/// Throws InputError with --format unless simulation::trajectory_formats() contains it.
void check_trajectory_format(const std::string& format);
/// The time of the middle one of the ephemerides, since some receivers also write old ones; {} without any.
[[nodiscard]] geodesy::GpsTime middle_time(const gnss::NavigationData& navigation);
void add_threads(Command& command, int& threads, const std::string& about = "0: one for each core (0)");
/// Adds --fixed-unknowns, a list of names for unknowns::unknowns_of().
Option& add_fixed_unknowns(Command& command, std::string& known);
/// Warns if 90 % intervals of so few samples hold less (caution_of_few()). @param option that describes it
void warn_of_few_samples(std::size_t count, std::string_view option);
/// Warns on standard error if an instant has no time zone.
void warn_of_no_zone(std::string_view instant);
/// An instant, by geodesy::parse_simulated_time(); warns on standard error if it has no time zone.
[[nodiscard]] geodesy::GpsTime parse_instant(std::string_view text);

/// Returns work(). Prefixes the option's name to an InputError that names no file.
template <typename Work>
auto for_option(const std::string& option, const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    if (!error.file().empty()) throw;
    throw InputError(option + ": " + error.problem(), error.hint());
  }
}

/// Prints text_table() to standard output.
void print_table(const TextRow& head, const std::vector<TextRow>& rows);

/// Writes "warning: ..." lines to standard error.
void print_warnings(const std::vector<std::string>& warnings);
/// Prints what the readers lost or guessed, also with --quiet: the first five lines, and where the rest is.
/// @param where "canyon check FILE", or the report in the folder of the results @param prefix of each line
void print_report(const ReadReport& report, const std::string& where, const std::string& prefix = {});
/// The whole report: {"level": "loss", "text": "..."} of each.
[[nodiscard]] Json report_json(const ReadReport& report);
/// report_json() of all print_report() calls of this command: the key `report` of its JSON.
[[nodiscard]] Json printed_reports();

}  // namespace canyon::cli
