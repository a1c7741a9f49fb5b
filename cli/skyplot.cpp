#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/drawing/views/skyplot.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/progress.hpp"
#include "cli/site.hpp"

namespace canyon::cli {
namespace {

namespace fs = std::filesystem;

struct SkyplotArguments {
  SiteArguments site;
  std::string out;
  std::string frames;
  drawing::SkyplotOptions options;
  double trail_min = 0;
  std::optional<int> width_px;
  double every_s = 1;
  std::string first;
  std::string last;
  int threads = 0;
  bool quiet = false;
};

constexpr int kPictureWidth_px = 1980, kFrameWidth_px = 990;

drawing::PictureFormat format_of(const std::string& file) {
  const std::string ending = lower_case(fs::path(file).extension().string());
  if (ending == ".png") return drawing::PictureFormat::Png;
  if (ending == ".svg") return drawing::PictureFormat::Svg;
  throw InputError(fmt::format("-o '{}': a sky plot is a .png or a .svg", file),
                   "give such a name, or --frames DIR for a picture of each second of the drive");
}

/// An instant, or seconds from the beginning of the drive; `otherwise` if nothing is given.
geodesy::GpsTime moment(const std::string& text, geodesy::GpsTime begin, geodesy::GpsTime otherwise) {
  if (text.empty()) return otherwise;
  const std::optional<double> seconds = parse_double(text);
  if (!seconds) return parse_instant(text);
  if (!(std::abs(*seconds) <= 1e8)) throw InputError(fmt::format("'{}' is not a time", text), "give seconds");
  return begin + *seconds;
}

std::string where(const Site& site, geodesy::GpsTime t) {
  const Eigen::Vector3d at = site.antenna(t);
  return fmt::format("east {}, north {}, up {} m at {}", encoding::fixed(at.x(), 1),
                     encoding::fixed(at.y(), 1), encoding::fixed(at.z(), 1), geodesy::format_gpst(t, 0));
}

std::string no_signal_in(raytrace::Containment containment) {
  return containment == raytrace::Containment::InsideBuilding ? "inside a building: no signal there"
                                                              : "under the terrain: no signal there";
}

int draw_one(const SkyplotArguments& arguments, Site& site) {
  const geodesy::GpsTime time = site.time();
  site.cover(time - arguments.options.trail_s, time);
  const Eigen::Vector3d antenna = site.antenna(time);
  const raytrace::Containment containment = site.environment().scene().containment(antenna);
  if (containment != raytrace::Containment::Free)
    print_warnings({fmt::format("the antenna ({}) is {}", where(site, time), no_signal_in(containment))});
  const auto begin = std::chrono::steady_clock::now();
  const std::string bytes = drawing::draw_skyplot(site.environment(), site.make_propagator(), time, antenna,
                                                  arguments.options, &site.receiver_config().options);
  const double wall_s = seconds_since(begin);
  write_file(arguments.out, bytes);
  if (!arguments.quiet)
    fmt::print(stderr, "sky at {}: {} ({:.2f} s)\n", where(site, time), arguments.out, wall_s);
  return kOk;
}

constexpr std::size_t kMaxFrames = 999'999;

/// Pictures of an earlier, longer run would be part of the same film.
int draw_frames(const SkyplotArguments& arguments, Site& site, ResultFiles& files) {
  const geodesy::GpsTime begin = site.begin(), end = site.end();
  const geodesy::GpsTime first = moment(arguments.first, begin, begin);
  const geodesy::GpsTime last = moment(arguments.last, begin, end);
  if (last < first) {
    throw InputError(fmt::format("--last {} is before --first {}", geodesy::format_gpst(last, 0),
                                 geodesy::format_gpst(first, 0)),
                     fmt::format("the drive lasts from {} to {}", geodesy::format_gpst(begin, 0),
                                 geodesy::format_gpst(end, 0)));
  }
  site.cover(first - arguments.options.trail_s, last);
  site.check_time(first, "--first");
  site.check_time(last, "--last");
  // A frame at `last` too, if a step is on it to about a nanosecond.
  const double steps = std::floor((last - first) / arguments.every_s + 1e-6);
  if (steps >= static_cast<double>(kMaxFrames)) {
    throw InputError(fmt::format("--every {:g} gives {:.0f} frames", arguments.every_s, steps + 1),
                     fmt::format("use a longer step: at most {} frames are numbered", kMaxFrames));
  }
  const auto count = static_cast<std::size_t>(steps) + 1;
  const auto time_of = [&](std::size_t i) { return first + arguments.every_s * static_cast<double>(i); };
  const propagation::Propagator propagator = site.make_propagator();
  const std::atomic<bool>& stop = catch_interrupts();
  const auto wall_begin = std::chrono::steady_clock::now();
  std::size_t written = 0;
  {
    ProgressLine progress("drawing", arguments.quiet);
    const auto threads = static_cast<std::size_t>(simulation::threads_of(arguments.threads));
    simulation::for_each_in_order<std::string>(
        count, threads, arguments.threads, [&] { return !stop.load(); },
        [&](std::size_t i) {
          return drawing::draw_skyplot(site.environment(), propagator, time_of(i), site.antenna(time_of(i)),
                                       arguments.options, &site.receiver_config().options);
        },
        [&](std::size_t i, const std::string& bytes) {
          write_file(fs::path(arguments.frames) / fmt::format("frame_{:06}.png", i + 1), bytes);
          progress.update(++written, count);
        });
  }
  const double wall_s = seconds_since(wall_begin);
  std::map<raytrace::Containment, std::size_t> containments;
  for (std::size_t i = 0; i < written; ++i)
    ++containments[site.environment().scene().containment(site.antenna(time_of(i)))];
  for (const auto& [containment, frames] : containments) {
    if (containment == raytrace::Containment::Free) continue;
    print_warnings(
        {fmt::format("{} of {} frames have the antenna {}", frames, written, no_signal_in(containment))});
  }
  if (written < count) {
    fmt::print(stderr, "canyon: interrupted: {} of {} frames finished and written to {}\n", written, count,
               arguments.frames);
    return kInterrupted;
  }
  files.finish();
  if (!arguments.quiet) {
    fmt::print(stderr, "{} frames in {:.2f} s ({:.3f} s each) in {}\n", written, wall_s,
               wall_s / static_cast<double>(written), arguments.frames);
  }
  return kOk;
}

int run_skyplot(const SkyplotArguments& given) {
  SkyplotArguments arguments = given;
  if (arguments.out.empty() == arguments.frames.empty()) {
    throw InputError("there is no file or folder for the picture",
                     "give -o FILE.png, -o FILE.svg or --frames DIR");
  }
  const bool frames = !arguments.frames.empty();
  if (!frames) arguments.options.sheet.format = format_of(arguments.out);
  arguments.options.sheet.width_px = arguments.width_px.value_or(frames ? kFrameWidth_px : kPictureWidth_px);
  if (!(arguments.trail_min >= 0 && arguments.trail_min <= 1440)) {
    throw InputError(fmt::format("--trails {:g} is out of range", arguments.trail_min),
                     "give 0 to 1440 minutes");
  }
  arguments.options.trail_s = 60 * arguments.trail_min;
  arguments.options.validate();
  if (!(arguments.every_s >= 0.001 && arguments.every_s <= 86'400)) {
    throw InputError(fmt::format("--every {:g} is out of range", arguments.every_s),
                     "give 0.001 to 86400 seconds");
  }
  // A read-only folder is found before the city is loaded.
  std::optional<ResultFiles> files;
  if (frames)
    files.emplace(arguments.frames, "skyplot");
  else
    const OutputFile probe(arguments.out);
  Site site(arguments.site);
  const receiver::ReceiverOptions& receiver = site.receiver_config().options;
  arguments.options.receiver = receiver.name;
  arguments.options.elevation_mask_rad = std::max(0.0, receiver.fix.elevation_mask_rad);
  return frames ? draw_frames(arguments, site, *files) : draw_one(arguments, site);
}

constexpr const char* kSkyplotFooter =
    R"(Without --at or --enu the antenna is on the scenario's trajectory at that time.

Satellites: LOS green disc, LOS+multipath ringed blue disc, NLOS orange triangle, blocked cross.
--style sky      a map of the sky: zenith in the middle, north up, east to the RIGHT, silhouette in grey
--style fisheye  the view of an upward camera: north up, east to the LEFT; diamonds: directions of reflected
                 signals with their excess path; squares: directions of diffracted signals; pale dots:
                 directions of scattered signals

Examples:
  canyon skyplot examples/synthetic_drive.yaml -o sky.png --time 2026-06-01T08:01:00Z --trails 60
  canyon skyplot examples/synthetic_drive.yaml -o up.svg --style fisheye --enu 0,20,1.5
  canyon skyplot examples/synthetic_drive.yaml --frames out/film --style fisheye --every 0.5
  ffmpeg -framerate 25 -i out/film/frame_%06d.png -pix_fmt yuv420p film.mp4)";

}  // namespace

void add_skyplot(Command& app) {
  Command& command = app.add_command(
      "skyplot", "draw the sky over a position, with satellites and buildings, or frames along a drive");
  SkyplotArguments& arguments = command.run_with(run_skyplot);
  add_site_options(command, arguments.site);
  command.add_option("-o,--out", arguments.out, "FILE", "the picture: FILE.png or FILE.svg").writes();
  command
      .add_option("--frames", arguments.frames, "DIR", "instead: frame_000001.png and so on along the drive")
      .excludes("--out")
      .excludes("--time");
  add_field(command, "--style", arguments.options, "style");
  add_field(command, "--projection", arguments.options, "projection");
  command.add_option("--trails", arguments.trail_min, "MINUTES",
                     "draw the satellites' tracks of the last minutes at this position [0, 1440] (0)");
  command.add_option("--width", arguments.width_px, "PX",
                     fmt::format("of a PNG [200, 4000] ({}; {} for frames); the height is 836/990 of it",
                                 kPictureWidth_px, kFrameWidth_px));
  command.add_option("--every", arguments.every_s, "SECONDS", "time between frames [0.001, 86400] (1)")
      .needs("--frames");
  command
      .add_option("--first", arguments.first, "T",
                  "first frame: a time, or seconds since the drive's beginning (its beginning)")
      .needs("--frames");
  command
      .add_option("--last", arguments.last, "T",
                  "last frame: a time, or seconds since the drive's beginning (its end)")
      .needs("--frames");
  add_threads(command, arguments.threads, "for frames; 0: one for each core (0)");
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
  command.footer = kSkyplotFooter;
}

}  // namespace canyon::cli
