#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/server.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "cli/arguments.hpp"

namespace canyon::cli {

struct ServeOptions {
  int port = 0;       ///< 0: a free one
  bool open = false;  ///< in the user's browser
  bool quiet = false;
};

/// Serves a view until Ctrl-C, and returns the exit status. @param work that is done meanwhile; false where
/// Ctrl-C has ended it. Where it throws pages are sent the reason, and the exception goes on
int serve(view::Site site, const ServeOptions& options, const std::function<bool(view::Server&)>& work = {});

/// The view of `canyon view --live`.
struct LiveView {
  std::vector<std::string> addresses;            ///< of the hosts' streams "view"
  view::Header header;                           ///< of the city, whose mesh is in the folder already
  std::shared_ptr<simulation::CityScene> scene;  ///< the city
  /// The hosts' scenario, if known: pages put antennas by it.
  std::optional<simulation::Scenario> scenario = {};
  std::size_t paths_per_satellite = 12;
};
/// Serves what hosts send, in a city, until Ctrl-C.
void serve_live(LiveView view, const std::filesystem::path& folder, const ServeOptions& options);

/// The film of `canyon view --record`, which a headless Chromium makes of the page.
struct RecordArguments {
  std::string file;  ///< empty: nothing is filmed
  std::string size = "1280x720";
  double seconds = 10;  ///< of the film
  int fps = 10;
  int quality = 75;                       ///< of WebP, in per cent
  std::string camera;                     ///< empty: the page's own choice
  std::optional<double> from_s, until_s;  ///< of the run
};
/// Adds the options.
void add_record_options(Command& command, RecordArguments& arguments);

/// Checks before any work that the film can be made. Throws InputError for an unknown ending and for missing
/// programs.
void check_record(const RecordArguments& arguments, const std::filesystem::path& page);

/// Films an exported page. @param viewer the page as it was built, beside what films it
/// Throws InputError where Chromium or the encoder fails.
void record_page(const RecordArguments& arguments, const std::filesystem::path& viewer,
                 const std::filesystem::path& exported, const std::filesystem::path& folder, bool quiet);

/// Takes the output of a program that runs without the user's terminal.
struct ProgramOutput {
  std::filesystem::path complaints;            ///< a file for its standard error
  std::function<void(std::string_view)> line;  ///< called with each line that it prints
};

/// A program in the search path.
[[nodiscard]] bool is_installed(const std::string& program);

/// Runs a program to its end and returns its exit status, 128 where a signal ended it. Throws InputError
/// where it cannot be started. @param output empty: it has the terminal of this program
int run_program(const std::vector<std::string>& words, const ProgramOutput& output = {});

}  // namespace canyon::cli
