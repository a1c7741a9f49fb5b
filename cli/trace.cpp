#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/encoding/columns.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/site.hpp"

namespace canyon::cli {
namespace {

struct TraceArguments {
  SiteArguments site;
  bool json = false;
};

std::string kind_text(const propagation::Path& path) {
  if (path.order == 2) return "reflected twice";
  if (path.kind == propagation::PathKind::Direct && path.foliage_depth_m > 0) return "direct through leaves";
  return std::string(propagation::name(path.kind));
}

/// A signal that a satellite sends at this time.
struct SentSignal {
  const gnss::Signal* signal;
  double carrier_hz;
};
/// Signals that the receiver tracks; if none of the satellite's system, all that its antenna receives.
std::vector<SentSignal> sent_signals(const orbit::LineOfSight& line, geodesy::GpsTime time,
                                     const receiver::ReceiverOptions& receiver) {
  std::vector<const gnss::Signal*> tracked;
  if (!receiver.tracks.empty()) tracked = receiver::tracked_signals(receiver.tracks, line.id.system);
  std::vector<SentSignal> sent;
  for (const gnss::Signal& signal : gnss::signals_of(line.id.system)) {
    const bool wanted =
        tracked.empty() || std::find(tracked.begin(), tracked.end(), &signal) != tracked.end();
    if (!wanted || !signal.only_recorded.empty() || !gnss::transmits(line.id, signal, time)) continue;
    if (!receiver.signal.antenna.receives(signal::band_of(signal.carrier_hz))) continue;
    sent.push_back({&signal, gnss::carrier_hz(signal, line.state.carrier_frequency_hz)});
  }
  return sent;
}

/// A path's amplitude at the antenna's output over that of the unobstructed line of sight.
std::complex<double> amplitude(const propagation::Path& path, const orbit::LineOfSight& line,
                               double carrier_hz, const tracking::SignalOptions& signal) {
  return signal::path_amplitude(path, line.elevation_rad, carrier_hz, signal.antenna, signal.strength);
}
/// Its loss; infinite if nothing of the path is left.
double loss_db(const propagation::Path& path, const orbit::LineOfSight& line, double carrier_hz,
               const tracking::SignalOptions& signal) {
  return -20 * std::log10(std::abs(amplitude(path, line, carrier_hz, signal))) + 0.0;
}
Json numbers(const Eigen::Vector3d& point) {
  return Json::array({point.x(), point.y(), point.z()});
}

/// The columns of a table of results, from `first` to `last`, for which the row has a value.
void put_columns(Json& to, encoding::TableKind kind, const encoding::Row& row, std::string_view first,
                 std::string_view last) {
  using Kind = encoding::Column::Kind;
  bool wanted = false;
  for (const encoding::Column& column : encoding::table(kind).columns) {
    wanted |= first == column.name;
    if (!wanted) continue;
    if (column.kind == Kind::Number) {
      if (const double value = column.number(row); !std::isnan(value)) to[column.name] = value;
    } else if (column.kind == Kind::Text) {
      if (std::string text = column.text(row); !text.empty()) to[column.name] = std::move(text);
    } else if (column.kind == Kind::Word) {
      if (const std::int64_t i = column.integer(row); i >= 0) to[column.name] = std::string(column.word(i));
    } else {
      to[column.name] = column.integer(row);
    }
    if (last == column.name) return;
  }
}

/// The satellite as in tables of results, before a receiver measures anything.
receiver::SatelliteObservation observation_of(const propagation::SatelliteView& view) {
  receiver::SatelliteObservation seen;
  seen.id = view.line.id;
  seen.azimuth_rad = view.line.azimuth_rad;
  seen.elevation_rad = view.line.elevation_rad;
  seen.visibility = view.paths.visibility;
  return seen;
}

std::string triple(const Eigen::Vector3d& point) {
  return fmt::format("{:.1f}, {:.1f}, {:.1f}", point.x(), point.y(), point.z());
}
std::string angle(double rad) {
  return fmt::format("{:.1f}", geodesy::degrees(rad));
}

/// All paths that arrive at the site's antenna at its time.
struct Look {
  explicit Look(const Site& of)
      : site(of),
        time(of.time()),
        antenna(of.antenna(time)),
        position(of.environment().city().frame.geodetic_from_local(antenna)),
        arrival(of.environment().arrival(time, antenna, of.make_propagator())),
        receiver(of.receiver_config().options),
        signal(receiver.signal) {}

  const Site& site;
  geodesy::GpsTime time;
  Eigen::Vector3d antenna;
  geodesy::Geodetic position;
  propagation::Arrival arrival;
  const receiver::ReceiverOptions& receiver;
  const tracking::SignalOptions& signal;
};

/// @param row of the path's satellite; the path is added
Json path_json(const Look& look_angles, const propagation::SatelliteView& view, const propagation::Path& path,
               const std::vector<SentSignal>& sent, encoding::Row& row) {
  using propagation::PathKind;
  row.path = &path;
  row.amplitude = 0;
  Json json = Json::object();
  if (look_angles.signal.enabled) {
    row.amplitude = amplitude(path, view.line, view.line.state.carrier_frequency_hz, look_angles.signal);
    Json& signal_entries = json["signal_loss_db"] = Json::object();
    for (const SentSignal& s : sent)
      signal_entries[std::string(s.signal->name)] =
          loss_db(path, view.line, s.carrier_hz, look_angles.signal);
  }
  put_columns(json, encoding::TableKind::Paths, row, "kind", {});
  if (path.foliage_depth_m > 0) json["foliage_depth_m"] = path.foliage_depth_m;
  if (path.kind != PathKind::Direct) json["point_enu_m"] = numbers(path.point);
  if (path.kind == PathKind::Reflected || path.kind == PathKind::Diffuse) {
    json["instance"] = path.instance;
    json["triangle"] = path.triangle;
  }
  if (path.kind == PathKind::Diffracted && path.edge_nu) json["edge_nu"] = *path.edge_nu;
  if (path.kind == PathKind::Diffuse) json["scattered_power"] = path.scattered_power;
  if (path.order == 2) {
    json["far_point_enu_m"] = numbers(path.far_point);
    json["far_incidence_deg"] = geodesy::degrees(path.far_incidence_rad());
    json["far_instance"] = path.far_instance;
    json["far_triangle"] = path.far_triangle;
  }
  return json;
}

Json satellite_json(const Look& look_angles, const propagation::SatelliteView& view,
                    const tracking::ChannelModel& model) {
  simulation::Epoch nothing;  // the columns of satellites and paths need only its time
  nothing.observed.time = look_angles.time;
  const std::vector<SentSignal> sent = sent_signals(view.line, look_angles.time, look_angles.receiver);
  const receiver::SatelliteObservation seen = observation_of(view);
  encoding::Row row{nothing, &seen, &seen};
  Json json{{"range_m", view.line.range_m}, {"signals", Json::array()}, {"paths", Json::array()}};
  put_columns(json, encoding::TableKind::Satellites, row, "sat", "visibility");
  for (const SentSignal& s : sent) {
    Json one{{"signal", std::string(s.signal->name)},
             {"rinex_code", std::string(s.signal->code)},
             {"carrier_hz", s.carrier_hz}};
    if (look_angles.signal.enabled) {
      one["clear_cn0_dbhz"] = model.clear_cn0_dbhz(
          *s.signal, view.line.elevation_rad, model.offset_db(view.line.id, *s.signal, look_angles.time));
    }
    json["signals"].push_back(std::move(one));
  }
  for (const propagation::Path& path : view.paths.paths)
    json["paths"].push_back(path_json(look_angles, view, path, sent, row));
  return json;
}

void print_json(const Look& look_angles) {
  Json out{{"time_gpst", geodesy::format_gpst(look_angles.time)},
           {"latitude_deg", geodesy::degrees(look_angles.position.latitude_rad)},
           {"longitude_deg", geodesy::degrees(look_angles.position.longitude_rad)},
           {"height_m", look_angles.position.height_m},
           {"enu_m", numbers(look_angles.antenna)},
           {"placement", std::string(encoding::containment_word(look_angles.arrival.containment))},
           {"report", printed_reports()},
           {"satellites", Json::array()}};
  const tracking::ChannelModel model(look_angles.signal, look_angles.site.simulation().scenario().seed,
                                     look_angles.receiver.name);
  for (const propagation::SatelliteView& view : look_angles.arrival.views)
    out["satellites"].push_back(satellite_json(look_angles, view, model));
  fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
}

/// One number per path, or with `tracks` one for each signal.
std::string loss_text(const Look& look_angles, const propagation::Path& path,
                      const orbit::LineOfSight& line) {
  if (look_angles.receiver.tracks.empty())
    return fmt::format("{:.1f}", loss_db(path, line, line.state.carrier_frequency_hz, look_angles.signal));
  std::string text;
  for (const SentSignal& s : sent_signals(line, look_angles.time, look_angles.receiver)) {
    text += fmt::format("{}{} {:.1f}", text.empty() ? "" : ", ", s.signal->name,
                        loss_db(path, line, s.carrier_hz, look_angles.signal));
  }
  return text;
}

/// A line for each path of a satellite, and one for each earlier reflection of the path.
void add_rows(const Look& look_angles, const propagation::SatelliteView& view, std::vector<TextRow>& rows) {
  const bool strength = look_angles.signal.enabled;
  TextRow row{gnss::to_string(view.line.id), angle(view.line.azimuth_rad), angle(view.line.elevation_rad),
              std::string(propagation::name(view.paths.visibility))};
  if (view.paths.paths.empty()) {
    row.insert(row.end(), strength ? 5 : 4, "-");
    rows.push_back(row);
  }
  for (const propagation::Path& path : view.paths.paths) {
    TextRow& line = rows.emplace_back(std::exchange(row, {"", "", "", ""}));
    line.insert(line.end(), {kind_text(path), fmt::format("{:.2f}", path.excess_m)});
    if (strength) line.push_back(loss_text(look_angles, path, view.line));
    line.push_back(path.kind == propagation::PathKind::Direct ? "-" : triple(path.point));
    line.push_back(path.kind == propagation::PathKind::Reflected ? angle(path.incidence_rad()) : "-");
    if (path.order != 2) continue;
    TextRow& before = rows.emplace_back(TextRow{"", "", "", "", "  before that", ""});
    if (strength) before.emplace_back();
    before.insert(before.end(), {triple(path.far_point), angle(path.far_incidence_rad())});
  }
}

int run_trace(const TraceArguments& arguments) {
  const Site site(arguments.site);
  const Look look_angles(site);
  if (arguments.json) {
    print_json(look_angles);
    return kOk;
  }
  fmt::print("{} at {:.7f}, {:.7f}, {:.2f} m (east {:.2f}, north {:.2f}, up {:.2f} m), {}\n\n",
             geodesy::format_gpst(look_angles.time), geodesy::degrees(look_angles.position.latitude_rad),
             geodesy::degrees(look_angles.position.longitude_rad), look_angles.position.height_m,
             look_angles.antenna.x(), look_angles.antenna.y(), look_angles.antenna.z(),
             encoding::containment_word(look_angles.arrival.containment));
  TextRow head{"sat", "azimuth [deg]", "elevation [deg]", "visibility", "path", "excess [m]"};
  if (look_angles.signal.enabled) head.emplace_back("loss [dB]");
  head.insert(head.end(), {"point (ENU) [m]", "incidence [deg]"});
  std::vector<TextRow> rows;
  for (const propagation::SatelliteView& view : look_angles.arrival.views) add_rows(look_angles, view, rows);
  print_table(head, rows);
  return kOk;
}

}  // namespace

void add_trace(Command& app) {
  Command& command = app.add_command("trace", "list every path of every satellite at one position and time");
  TraceArguments& arguments = command.run_with(run_trace);
  add_site_options(command, arguments.site);
  command.add_flag("--json", arguments.json, "print JSON");
  command.footer =
      "Without --at or --enu the antenna is on the scenario's trajectory at that time.\n"
      "With a signal model (signal.enabled) `loss` is the loss of each path relative to the unobstructed "
      "line of sight,\n"
      "of the signal near L1 or of each signal in `tracks`. JSON has `signal_loss_db` of each signal and the "
      "C/N0 of\nthe unobstructed line of sight (`clear_cn0_dbhz`).";
}

}  // namespace canyon::cli
