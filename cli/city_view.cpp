#include <fmt/format.h>

#include <memory>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/drawing/views/city_picture.hpp"
#include "canyon/simulation/load_city.hpp"
#include "cli/city_commands.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

struct Arguments {
  std::string input;
  std::string out;
  std::string size;
  bool materials = false;
  bool quiet = false;
  drawing::CityPictureOptions picture;
};

int run(const Arguments& arguments) {
  drawing::CityPictureOptions picture = arguments.picture;
  if (!arguments.size.empty()) {
    const std::vector<std::string_view> pieces = split(arguments.size, 'x');
    const auto width = parse_integer(pieces.front()), height = parse_integer(pieces.back());
    if (pieces.size() != 2 || !width || !height || *width < 1 || *height < 1 || *width > 100'000 ||
        *height > 100'000) {
      throw InputError(fmt::format("--size '{}' is not WIDTHxHEIGHT", arguments.size),
                       "give pixels, e.g. 1600x1000");
    }
    picture.width_px = static_cast<int>(*width);
    picture.height_px = static_cast<int>(*height);
  }
  picture.colour_by_height = !arguments.materials;
  picture.validate();
  if (std::filesystem::path(arguments.out).extension() != ".png") {
    throw InputError(fmt::format("-o '{}' is not a .png", arguments.out), "pictures are PNG files");
  }
  Progress progress("building the city", arguments.quiet);
  const buildings::BuiltCity loaded = simulation::load_city_with_report(
      city_config(arguments.input, ""),
      [&progress](std::size_t done, std::size_t total) { progress.update(done, total); });
  drawing::draw_city(loaded.city, arguments.out, picture);
  return kOk;
}

}  // namespace

void add_city_view(CLI::App& city, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* view = city.add_subcommand("view", "draw a picture of a city");
  view->add_option("city", arguments->input, "any file that 'canyon city info' reads, or a scenario")
      ->type_name("CITY")
      ->required();
  view->add_option("-o,--out", arguments->out, "the picture")->type_name("PNG")->required();
  view->add_option("--angle", arguments->picture.elevation_deg,
                   fmt::format("of the viewer above the horizon; 90 is a map ({:g})",
                               arguments->picture.elevation_deg))
      ->type_name("DEG");
  view->add_option(
          "--azimuth", arguments->picture.azimuth_deg,
          fmt::format("compass direction in which the viewer stands ({:g})", arguments->picture.azimuth_deg))
      ->type_name("DEG");
  view->add_option(
          "--size", arguments->size,
          fmt::format("in pixels ({}x{})", arguments->picture.width_px, arguments->picture.height_px))
      ->type_name("WxH");
  view->add_option("--title", arguments->picture.title, "instead of the city's name")->type_name("TEXT");
  view->add_option("--credit", arguments->picture.credit, "small, at the lower right: who made the map")
      ->type_name("TEXT");
  view->add_flag("--materials", arguments->materials, "colours by material instead of height");
  view->add_flag("--quiet", arguments->quiet, "print errors only");
  view->callback([arguments, &action] { action = [arguments] { return run(*arguments); }; });
}

}  // namespace canyon::cli
