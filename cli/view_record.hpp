#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "cli/arguments.hpp"

namespace canyon::cli {

/// The film of `canyon view --record`; a headless Chromium renders it from the page.
struct RecordArguments {
  std::string file;  ///< empty: no film
  std::string size = "1280x720";
  double seconds = 10;  ///< of the film
  int fps = 10;
  int quality = 75;                       ///< of WebP, in per cent
  std::string camera;                     ///< empty: chosen by the page
  std::optional<double> from_s, until_s;  ///< of the run
};
void add_record_options(Command& command, RecordArguments& arguments);

/// Checks before any work that the film can be made: InputError for an unknown ending or missing programs.
void check_record(const RecordArguments& arguments, const std::filesystem::path& page);

/// Films an exported page. @param viewer the page as built, next to the code that films it. Throws InputError
/// if Chromium or the encoder fails.
void record_page(const RecordArguments& arguments, const std::filesystem::path& viewer,
                 const std::filesystem::path& exported, const std::filesystem::path& folder, bool quiet);

}  // namespace canyon::cli
