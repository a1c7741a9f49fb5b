#include "cli/view_record.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/view/page.hpp"
#include "cli/program.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxSide = 3840;
constexpr double kMaxVideoFrames = 3600;

/// Whether the film is one file; false: a folder of frames.
bool is_one_file(const std::string& file) {
  const std::string ending = lower_case(fs::path(file).extension().string());
  if (ending.empty() || ending == ".webp") return !ending.empty();
  throw InputError(fmt::format("--record: '{}' is not the ending of a film", ending),
                   "give a .webp, or a folder for frames, which ffmpeg converts to other films");
}

std::string first_line(const fs::path& file) {
  const std::string text = view::read_bytes(file);
  const std::string line = text.substr(0, text.find('\n'));
  return line.empty() ? "no reason is given" : line;
}

std::pair<int, int> size_of(const std::string& text) {
  const std::vector<std::string_view> parts = split(text, 'x');
  const auto side = [](std::string_view part) { return parse_integer(part).value_or(0); };
  const long long width = side(parts.front()), height = side(parts.back());
  // Encoders halve the resolution of colours in both directions.
  const auto possible = [](long long px) { return px >= 320 && px <= kMaxSide && px % 2 == 0; };
  if (parts.size() != 2 || !possible(width) || !possible(height)) {
    throw InputError("--record-size is not a size: " + text,
                     fmt::format("give WIDTHxHEIGHT, even, from 320 to {}", kMaxSide));
  }
  return {static_cast<int>(width), static_cast<int>(height)};
}

fs::path script_of(const fs::path& page) {
  return page.parent_path().parent_path() / "record.mjs";
}

}  // namespace

void add_record_options(Command& command, RecordArguments& arguments) {
  command
      .add_option("--record", arguments.file, "FILM",
                  "a film of it: .webp, or a folder for PNG frames. Needs Node.js and Chromium")
      .writes();
  command.add_option("--record-size", arguments.size, "WxH", "size of the film (1280x720)").needs("--record");
  command.add_option("--record-seconds", arguments.seconds, "S", "length of the film (10)")
      .within(0.1, 600.0)
      .needs("--record");
  command.add_option("--record-fps", arguments.fps, {}, "pictures per second (10)")
      .within(1, 60)
      .needs("--record");
  command.add_option("--record-quality", arguments.quality, {}, "quality of .webp, in per cent (75)")
      .within(1, 100)
      .needs("--record");
  command.add_option("--record-camera", arguments.camera, {}, "free, follow, top or first")
      .one_of({"free", "follow", "top", "first"})
      .needs("--record");
  command.add_option("--record-from", arguments.from_s, "S", "first second of the run (its beginning)")
      .needs("--record");
  command.add_option("--record-until", arguments.until_s, "S", "last second of the run (its end)")
      .needs("--record");
}

void check_record(const RecordArguments& arguments, const fs::path& page) {
  (void)is_one_file(arguments.file);
  (void)size_of(arguments.size);
  if (!is_installed("node")) throw InputError("--record needs Node.js", "install it (Debian: nodejs)");
  std::error_code error;
  if (!fs::is_regular_file(script_of(page), error)) {
    throw InputError("--record needs the viewer's source folder next to its page",
                     "use the page that ./run view builds");
  }
}

void record_page(const RecordArguments& arguments, const fs::path& viewer, const fs::path& exported,
                 const fs::path& folder, bool quiet) {
  const bool one_file = is_one_file(arguments.file);
  const auto [width, height] = size_of(arguments.size);
  const int frames =
      static_cast<int>(std::clamp(std::round(arguments.seconds * arguments.fps), 1.0, kMaxVideoFrames));
  const fs::path pictures = one_file ? folder / "frames" : fs::path(arguments.file);
  make_output_folder(pictures);
  std::optional<FolderLock> lock;
  if (!one_file) lock.emplace(pictures);
  Json wanted{{"page", exported.string()},
              {"folder", pictures.string()},
              {"width", width},
              {"height", height},
              {"frames", frames},
              {"fps", arguments.fps},
              {"quality", arguments.quality}};
  if (!arguments.camera.empty()) wanted["camera"] = arguments.camera;
  if (arguments.from_s) wanted["from"] = *arguments.from_s;
  if (arguments.until_s) wanted["until"] = *arguments.until_s;
  const fs::path webp = folder / "film.webp";
  if (one_file) wanted["webp"] = webp.string();
  const fs::path complaints = folder / "complaints.txt";
  {
    ProgressLine progress("filming", quiet);
    const auto step = progress.callback();
    std::size_t done = 0;
    const int status =
        run_program({"node", script_of(viewer).string(), wanted.dump()},
                    {complaints, [&](std::string_view) { step(++done, static_cast<std::size_t>(frames)); }});
    if (status != 0) throw InputError("--record: " + first_line(complaints));
  }
  if (one_file) write_file(arguments.file, view::read_bytes(webp));
}

}  // namespace canyon::cli
