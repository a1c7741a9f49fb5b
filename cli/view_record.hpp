#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "cli/arguments.hpp"

namespace canyon::cli {

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

}  // namespace canyon::cli
