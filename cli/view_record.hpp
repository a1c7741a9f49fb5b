#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "cli/arguments.hpp"

namespace canyon::cli {

/// What `canyon view --record` films: what the page can do by itself, in a headless Chromium.
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

/// How a film of this name is made, before any work: throws InputError for a name of another ending, and
/// where what it takes is not on this machine.
void check_record(const RecordArguments& arguments, const std::filesystem::path& page);

/// Films an exported page. @param viewer the page as it was built, beside what films it
/// Throws InputError where Chromium or the encoder fails.
void record_page(const RecordArguments& arguments, const std::filesystem::path& viewer,
                 const std::filesystem::path& exported, const std::filesystem::path& folder, bool quiet);

}  // namespace canyon::cli
