#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/words.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/commands.hpp"

namespace canyon::cli {
namespace {

struct Arguments {
  std::string scenario;
  std::string place;
  std::string enu;
  std::string time;
  std::string receiver;
  bool json = false;
};

std::string_view word(propagation::PathKind kind) {
  return kind == propagation::PathKind::Direct ? "direct" : "reflected";
}

std::size_t find_receiver(const simulation::Scenario& scenario, const std::string& name) {
  if (name.empty()) return 0;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < scenario.receivers.size(); ++i) {
    names.push_back(scenario.receivers[i].options.name);
    if (names.back() == name) return i;
  }
  throw InputError(fmt::format("--receiver: the scenario has no receiver '{}'", name),
                   fmt::format("it has {}", fmt::join(names, ", ")));
}

Eigen::Vector3d parse_enu(const std::string& text) {
  const std::vector<std::string_view> pieces = split(text, ',');
  Eigen::Vector3d enu = Eigen::Vector3d::Zero();
  bool good = pieces.size() == 3;
  for (std::size_t i = 0; good && i < 3; ++i) {
    const std::optional<double> value = parse_double(pieces[i]);
    good = value.has_value();
    if (good) enu[static_cast<Eigen::Index>(i)] = *value;
  }
  if (!good) {
    throw InputError(fmt::format("--enu '{}' is not a place", text),
                     "give EAST,NORTH,UP in metres, e.g. 10,-5,2");
  }
  return enu;
}

int run(const Arguments& arguments) {
  simulation::Scenario scenario = simulation::read_scenario(arguments.scenario);
  const std::size_t receiver = find_receiver(scenario, arguments.receiver);
  const simulation::Simulation simulation(scenario, simulation::load_city(scenario.city));
  print_warnings(simulation.warnings());
  const simulation::Environment& environment = simulation.environment();
  const geodesy::GpsTime time =
      arguments.time.empty() ? simulation.begin() : geodesy::parse_time(arguments.time);
  const geodesy::LocalFrame& frame = environment.city().frame;
  const Eigen::Vector3d antenna =
      !arguments.enu.empty() ? parse_enu(arguments.enu)
      : !arguments.place.empty()
          ? frame.local_from_geodetic(parse_place(arguments.place, "--at"))
          : frame.local_from_geodetic(simulation.antenna_pose(receiver, time).position);
  const propagation::Propagator propagator =
      environment.make_propagator(simulation.scenario().receivers[receiver].propagation);
  const simulation::Arrival arrival = environment.arrival(time, antenna, propagator);
  const geodesy::Geodetic place = frame.geodetic_from_local(antenna);

  if (arguments.json) {
    nlohmann::json out;
    out["time_gpst"] = geodesy::format_gpst(time);
    out["latitude_deg"] = geodesy::degrees(place.latitude_rad);
    out["longitude_deg"] = geodesy::degrees(place.longitude_rad);
    out["height_m"] = place.height_m;
    out["enu_m"] = {antenna.x(), antenna.y(), antenna.z()};
    out["placement"] = std::string(output::placement_word(arrival.placement));
    out["satellites"] = nlohmann::json::array();
    for (const propagation::SatelliteView& view : arrival.views) {
      nlohmann::json entry{{"sat", orbit::to_string(view.line.id)},
                           {"azimuth_deg", geodesy::degrees(view.line.azimuth_rad)},
                           {"elevation_deg", geodesy::degrees(view.line.elevation_rad)},
                           {"range_m", view.line.range_m},
                           {"visibility", std::string(propagation::name(view.paths.visibility))},
                           {"paths", nlohmann::json::array()}};
      for (const propagation::Path& path : view.paths.paths) {
        nlohmann::json one{{"kind", std::string(word(path.kind))}, {"excess_path_m", path.excess_m}};
        if (path.kind != propagation::PathKind::Direct) {
          one["point_enu_m"] = {path.point.x(), path.point.y(), path.point.z()};
          one["incidence_deg"] = geodesy::degrees(path.incidence_rad);
          one["instance"] = path.instance;
          one["triangle"] = path.triangle;
        }
        entry["paths"].push_back(std::move(one));
      }
      out["satellites"].push_back(std::move(entry));
    }
    fmt::print("{}\n", out.dump(2));
    return kOk;
  }

  fmt::print("{} at {:.7f}, {:.7f}, {:.2f} m (east {:.2f}, north {:.2f}, up {:.2f} m), {}\n\n",
             geodesy::format_gpst(time), geodesy::degrees(place.latitude_rad),
             geodesy::degrees(place.longitude_rad), place.height_m, antenna.x(), antenna.y(), antenna.z(),
             output::placement_word(arrival.placement));
  std::vector<std::vector<std::string>> rows;
  for (const propagation::SatelliteView& view : arrival.views) {
    std::vector<std::string> row{orbit::to_string(view.line.id),
                                 fmt::format("{:.1f}", geodesy::degrees(view.line.azimuth_rad)),
                                 fmt::format("{:.1f}", geodesy::degrees(view.line.elevation_rad)),
                                 std::string(propagation::name(view.paths.visibility))};
    if (view.paths.paths.empty()) {
      row.insert(row.end(), {"-", "-", "-", "-"});
      rows.push_back(row);
    }
    for (const propagation::Path& path : view.paths.paths) {
      std::vector<std::string> line = row;
      line.push_back(std::string(word(path.kind)));
      line.push_back(fmt::format("{:.2f}", path.excess_m));
      const bool direct = path.kind == propagation::PathKind::Direct;
      line.push_back(
          direct ? "-"
                 : fmt::format("{:.1f}, {:.1f}, {:.1f}", path.point.x(), path.point.y(), path.point.z()));
      line.push_back(direct ? "-" : fmt::format("{:.1f}", geodesy::degrees(path.incidence_rad)));
      rows.push_back(std::move(line));
      row = {"", "", "", ""};
    }
  }
  print_table({"sat", "azimuth [deg]", "elevation [deg]", "visibility", "path", "excess [m]",
               "point (ENU) [m]", "incidence [deg]"},
              rows);
  return kOk;
}

}  // namespace

void add_trace(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("trace", "every path of every satellite at one place and time");
  command->add_option("scenario", arguments->scenario, "scenario file: its city, sky and propagation")
      ->type_name("SCENARIO")
      ->required();
  CLI::Option* at = command->add_option("--at", arguments->place, "antenna (degrees, ellipsoidal metres)");
  at->type_name("LAT,LON,HEIGHT");
  command->add_option("--enu", arguments->enu, "antenna in the city's frame [m]")
      ->type_name("E,N,U")
      ->excludes(at);
  command
      ->add_option("--time", arguments->time,
                   "when (the scenario's first epoch); UTC, or with ' GPST' behind it")
      ->type_name("T");
  command->add_option("--receiver", arguments->receiver, "whose propagation and antenna (the first)")
      ->type_name("NAME");
  command->add_flag("--json", arguments->json, "print JSON");
  command->footer(
      "Without --at or --enu the antenna is where the scenario's trajectory has it at that time.");
  command->callback([arguments, &action] { action = [arguments] { return run(*arguments); }; });
}

}  // namespace canyon::cli
