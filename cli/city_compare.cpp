// Declared in cli/city_commands.hpp.
#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/validation/city_agreement.hpp"
#include "cli/city_commands.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

using validation::CityAgreement;

struct CityCompareArguments {
  std::vector<std::string> inputs;
  std::string bbox;
  validation::CityAgreementOptions options;
  bool json = false;
  bool quiet = false;
};

/// A city with a place on the Earth. With a box, tilesets and folders of tiles are read about it alone.
city::City read_placed(const std::string& input, const CityCompareArguments& arguments) {
  simulation::CityConfig config = city_config(input);
  if (arguments.options.bbox_deg && !is_scenario(input)) {
    simulation::Scenario scenario;
    scenario.city = std::move(config);
    config = simulation::city_config(scenario, *arguments.options.bbox_deg);
  }
  const bool quiet = arguments.quiet || arguments.json;
  buildings::BuiltCity loaded = read_city(config, "reading the cities", quiet);
  if (!quiet) print_warnings(loaded.report.cautions);
  if (!loaded.placed) {
    throw InputError(input, 0, "has no origin on the Earth",
                     "build it first: canyon city build FILE --origin LAT,LON,HEIGHT -o city.canyon");
  }
  return std::move(loaded.city);
}

std::string percent(double share) {
  return fmt::format("{:.2f}", share * 100);
}

void print_tables(const CityAgreement& found, const std::vector<city::City>& cities,
                  const CityCompareArguments& arguments) {
  fmt::print(
      "{} places outdoors in all cities, {:g} m above the ground; {} directions of each, evenly over "
      "the sky above {:g} deg\n\n",
      found.places, arguments.options.height_m, arguments.options.directions, arguments.options.mask_deg);
  std::vector<TextRow> rows;
  for (std::size_t c = 0; c < cities.size(); ++c) {
    rows.push_back({std::string(1, static_cast<char>('A' + c)), cities[c].name,
                    std::to_string(cities[c].mesh.triangles.size()), percent(found.cities[c].inside),
                    percent(found.cities[c].open)});
  }
  TextTableStyle style;
  style.words = 2;
  fmt::print("{}\n", text_table({"", "city", "triangles", "indoors [%]", "open sky [%]"}, rows, style));
  rows.clear();
  for (const CityAgreement::OfPair& pair : found.pairs) {
    rows.push_back(
        {fmt::format("{} {}", static_cast<char>('A' + pair.first), static_cast<char>('A' + pair.second)),
         percent(pair.agree), percent(pair.agree_p05), percent(pair.hidden_by_both)});
  }
  style.words = 1;
  fmt::print("{}", text_table({"pair", "agreement [%]", "worst 5 % of places [%]", "hidden: by both [%]"},
                              rows, style));
}

void print_json(const CityAgreement& found, const CityCompareArguments& arguments) {
  Json out{{"places", found.places}};
  Json& cities = out["cities"] = Json::array();
  for (std::size_t c = 0; c < found.cities.size(); ++c) {
    cities.push_back(Json{{"input", arguments.inputs[c]},
                          {"indoors", found.cities[c].inside},
                          {"open_sky", found.cities[c].open}});
  }
  Json& pairs = out["pairs"] = Json::array();
  for (const CityAgreement::OfPair& pair : found.pairs) {
    pairs.push_back(Json{{"cities", {pair.first, pair.second}},
                         {"agreement", pair.agree},
                         {"agreement_p05", pair.agree_p05},
                         {"hidden_by_both", pair.hidden_by_both}});
  }
  fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
}

int run_city_compare(const CityCompareArguments& given) {
  CityCompareArguments arguments = given;
  constexpr std::size_t kMost = 26;
  if (arguments.inputs.size() < 2 || arguments.inputs.size() > kMost) {
    throw InputError(fmt::format("compares 2 to {} cities, not {}", kMost, arguments.inputs.size()),
                     "give cities of one place");
  }
  if (!arguments.bbox.empty()) arguments.options.bbox_deg = parse_bbox(arguments.bbox, "--bbox");
  std::vector<city::City> cities;
  for (const std::string& input : arguments.inputs) cities.push_back(read_placed(input, arguments));
  Progress progress("casting rays", arguments.quiet || arguments.json);
  const CityAgreement found = validation::compare_cities(cities, arguments.options, progress.callback());
  if (arguments.json) {
    print_json(found, arguments);
  } else {
    print_tables(found, cities, arguments);
  }
  return kOk;
}

}  // namespace

void add_city_compare(Command& city) {
  Command& compare =
      city.add_command("compare", "how far cities of one place agree about what hides the sky");
  CityCompareArguments& arguments = compare.run_with(run_city_compare);
  compare
      .add_option("cities", arguments.inputs, "CITY",
                  "two or more of any files that 'canyon city info' reads, of one district")
      .required();
  add_field(compare, "--places", arguments.options, "places");
  add_field(compare, "--directions", arguments.options, "directions");
  add_field(compare, "--mask", arguments.options, "mask_deg");
  add_field(compare, "--height", arguments.options, "height_m");
  compare.add_option("--bbox", arguments.bbox, "W,S,E,N", "where the places are drawn (degrees)");
  compare.add_flag("--json", arguments.json, "print JSON");
  compare.add_flag("--quiet", arguments.quiet, "print no warnings");
}

}  // namespace canyon::cli
