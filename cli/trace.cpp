#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/epoch_values.hpp"
#include "canyon/signal/path_strength.hpp"
#include "canyon/simulation/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/site.hpp"

namespace canyon::cli {
namespace {

struct Arguments {
  SiteArguments site;
  bool json = false;
};

std::string kind_text(const propagation::Path& path) {
  if (path.order == 2) return "reflected twice";
  if (path.kind == propagation::PathKind::Direct && path.foliage_depth_m > 0) {
    return "direct through leaves";
  }
  return std::string(propagation::name(path.kind));
}
/// How much weaker a path leaves the antenna than the unobstructed line of sight would; infinite where
/// nothing is left of it.
double loss_db(const propagation::Path& path, const orbit::LineOfSight& line,
               const tracking::SignalOptions& signal) {
  const std::complex<double> amplitude = signal::path_amplitude(
      path, line.elevation_rad, line.state.carrier_frequency_hz, signal.antenna, signal.strength);
  return -20 * std::log10(std::abs(amplitude)) + 0.0;
}
std::string triple(const Eigen::Vector3d& point) {
  return fmt::format("{:.1f}, {:.1f}, {:.1f}", point.x(), point.y(), point.z());
}
std::string angle(double rad) {
  return fmt::format("{:.1f}", geodesy::degrees(rad));
}

int run(const Arguments& arguments) {
  const Site site(arguments.site);
  const simulation::Environment& environment = site.environment();
  const geodesy::GpsTime time = site.time();
  const Eigen::Vector3d antenna = site.antenna(time);
  const propagation::Propagator propagator = site.make_propagator();
  const propagation::Arrival arrival = environment.arrival(time, antenna, propagator);
  const geodesy::Geodetic place = environment.city().frame.geodetic_from_local(antenna);
  const tracking::SignalOptions& signal = site.receiver_config().options.signal;

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
      nlohmann::json entry{{"sat", gnss::to_string(view.line.id)},
                           {"azimuth_deg", geodesy::degrees(view.line.azimuth_rad)},
                           {"elevation_deg", geodesy::degrees(view.line.elevation_rad)},
                           {"range_m", view.line.range_m},
                           {"visibility", std::string(propagation::name(view.paths.visibility))},
                           {"paths", nlohmann::json::array()}};
      for (const propagation::Path& path : view.paths.paths) {
        nlohmann::json one{{"kind", std::string(propagation::name(path.kind))},
                           {"order", path.order},
                           {"excess_path_m", path.excess_m}};
        if (signal.enabled) {
          const double loss = loss_db(path, view.line, signal);
          one["loss_db"] = std::isfinite(loss) ? nlohmann::json(loss) : nlohmann::json(nullptr);
        }
        if (path.foliage_depth_m > 0) one["foliage_depth_m"] = path.foliage_depth_m;
        if (path.kind != propagation::PathKind::Direct) {
          one["point_enu_m"] = {path.point.x(), path.point.y(), path.point.z()};
        }
        if (path.kind == propagation::PathKind::Reflected) {
          one["incidence_deg"] = geodesy::degrees(path.incidence_rad());
        }
        if (path.kind == propagation::PathKind::Reflected || path.kind == propagation::PathKind::Diffuse) {
          one["instance"] = path.instance;
          one["triangle"] = path.triangle;
        }
        if (path.kind == propagation::PathKind::Diffracted && path.edge_nu) {
          one["edge_nu"] = *path.edge_nu;
        }
        if (path.kind == propagation::PathKind::Diffuse) one["scattered_power"] = path.scattered_power;
        if (path.order == 2) {
          one["far_point_enu_m"] = {path.far_point.x(), path.far_point.y(), path.far_point.z()};
          one["far_incidence_deg"] = geodesy::degrees(path.far_incidence_rad());
          one["far_instance"] = path.far_instance;
          one["far_triangle"] = path.far_triangle;
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
    std::vector<std::string> row{gnss::to_string(view.line.id),
                                 fmt::format("{:.1f}", geodesy::degrees(view.line.azimuth_rad)),
                                 fmt::format("{:.1f}", geodesy::degrees(view.line.elevation_rad)),
                                 std::string(propagation::name(view.paths.visibility))};
    if (view.paths.paths.empty()) {
      row.insert(row.end(), signal.enabled ? 5 : 4, "-");
      rows.push_back(row);
    }
    for (const propagation::Path& path : view.paths.paths) {
      std::vector<std::string> line = row;
      line.push_back(kind_text(path));
      line.push_back(fmt::format("{:.2f}", path.excess_m));
      if (signal.enabled) line.push_back(fmt::format("{:.1f}", loss_db(path, view.line, signal)));
      line.push_back(path.kind == propagation::PathKind::Direct ? "-" : triple(path.point));
      line.push_back(path.kind == propagation::PathKind::Reflected ? angle(path.incidence_rad()) : "-");
      rows.push_back(std::move(line));
      row = {"", "", "", ""};
      if (path.order == 2) {
        std::vector<std::string> before{"", "", "", "", "  before that", ""};
        if (signal.enabled) before.emplace_back();
        before.push_back(triple(path.far_point));
        before.push_back(angle(path.far_incidence_rad()));
        rows.push_back(std::move(before));
      }
    }
  }
  std::vector<std::string> head{"sat",        "azimuth [deg]", "elevation [deg]",
                                "visibility", "path",          "excess [m]"};
  if (signal.enabled) head.push_back("loss [dB]");
  head.insert(head.end(), {"point (ENU) [m]", "incidence [deg]"});
  print_table(head, rows);
  return kOk;
}

}  // namespace

void add_trace(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("trace", "every path of every satellite at one place and time");
  add_site_options(*command, arguments->site);
  command->add_flag("--json", arguments->json, "print JSON");
  command->footer(
      "Without --at or --enu the antenna is where the scenario's trajectory has it at that time.\n"
      "Where the receiver has a signal model (signal.enabled), `loss` is how much weaker than the "
      "unobstructed\n"
      "line of sight each path leaves its antenna.");
  command->callback([arguments, &action] { action = [arguments] { return run(*arguments); }; });
}

}  // namespace canyon::cli
