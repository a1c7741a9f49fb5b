// Declared in cli/city_commands.hpp.
#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/drawing/views/city_picture.hpp"
#include "cli/city_commands.hpp"
#include "cli/field_option.hpp"

namespace canyon::cli {
namespace {

struct CityViewArguments {
  std::string input;
  std::string out;
  std::string size;
  bool materials = false;
  bool quiet = false;
  CityArguments city;
  drawing::CityPictureOptions picture;
};

int run_city_view(const CityViewArguments& arguments) {
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
  const buildings::BuiltCity loaded =
      read_city(city_config(arguments.input, arguments.city), "building the city", arguments.quiet);
  if (!arguments.quiet) print_warnings(loaded.report.cautions);
  drawing::draw_city(loaded.city, arguments.out, picture);
  return kOk;
}

}  // namespace

void add_city_view(Command& city) {
  Command& view = city.add_command("view", "draw a picture of a city");
  CityViewArguments& arguments = view.run_with(run_city_view);
  view.add_option("city", arguments.input, "CITY", "any file that 'canyon city info' reads, or a scenario")
      .required();
  view.add_option("-o,--out", arguments.out, "PNG", "the picture").required();
  add_field(view, "--angle", arguments.picture, "elevation_deg");
  add_field(view, "--azimuth", arguments.picture, "azimuth_deg");
  view.add_option("--size", arguments.size, "WxH",
                  fmt::format("in pixels ({}x{})", arguments.picture.width_px, arguments.picture.height_px));
  add_field(view, "--title", arguments.picture, "title");
  add_field(view, "--credit", arguments.picture, "credit");
  add_city_options(view, arguments.city);
  view.add_flag("--materials", arguments.materials, "colours by material instead of height");
  view.add_flag("--quiet", arguments.quiet, "print errors only");
}

}  // namespace canyon::cli
