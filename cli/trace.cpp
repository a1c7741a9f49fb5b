// Declared in cli/commands.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/json.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/columns.hpp"
#include "canyon/output/epoch_values.hpp"
#include "canyon/signal/path_strength.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/tracking/channel.hpp"
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
  if (path.kind == propagation::PathKind::Direct && path.foliage_depth_m > 0) {
    return "direct through leaves";
  }
  return std::string(propagation::name(path.kind));
}

/// A signal that a satellite sends at the time.
struct SentSignal {
  const gnss::Signal* signal;
  double carrier_hz;
};
/// Signals that the receiver tracks, or all that its antenna receives if it tracks none of the satellite's
/// system.
std::vector<SentSignal> sent_signals(const orbit::LineOfSight& line, geodesy::GpsTime time,
                                     const receiver::ReceiverOptions& receiver) {
  std::vector<const gnss::Signal*> tracked;
  if (!receiver.tracks.empty()) tracked = receiver::tracked_signals(receiver.tracks, line.id.system);
  std::vector<SentSignal> sent;
  for (const gnss::Signal& signal : gnss::signals_of(line.id.system)) {
    const bool wanted =
        tracked.empty() || std::find(tracked.begin(), tracked.end(), &signal) != tracked.end();
    if (!wanted || !gnss::transmits(line.id, signal, time)) continue;
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
/// Its loss; infinite where nothing is left of the path.
double loss_db(const propagation::Path& path, const orbit::LineOfSight& line, double carrier_hz,
               const tracking::SignalOptions& signal) {
  return -20 * std::log10(std::abs(amplitude(path, line, carrier_hz, signal))) + 0.0;
}
Json numbers(const Eigen::Vector3d& point) {
  return Json::array({point.x(), point.y(), point.z()});
}

/// The columns of a table of results, from `first` on, of which the row has a value; `last` is the last one.
void put_columns(Json& to, output::TableKind kind, const output::Row& row, std::string_view first,
                 std::string_view last) {
  using Kind = output::Column::Kind;
  bool wanted = false;
  for (const output::Column& column : output::table(kind).columns) {
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

/// The satellite as tables of results have it, before a receiver measures anything.
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

int run_trace(const TraceArguments& arguments) {
  const Site site(arguments.site);
  const simulation::Environment& environment = site.environment();
  const geodesy::GpsTime time = site.time();
  const Eigen::Vector3d antenna = site.antenna(time);
  const propagation::Propagator propagator = site.make_propagator();
  const propagation::Arrival arrival = environment.arrival(time, antenna, propagator);
  const geodesy::Geodetic place = environment.city().frame.geodetic_from_local(antenna);
  const receiver::ReceiverOptions& receiver = site.receiver_config().options;
  const tracking::SignalOptions& signal = receiver.signal;

  if (arguments.json) {
    Json out;
    out["time_gpst"] = geodesy::format_gpst(time);
    out["latitude_deg"] = geodesy::degrees(place.latitude_rad);
    out["longitude_deg"] = geodesy::degrees(place.longitude_rad);
    out["height_m"] = place.height_m;
    out["enu_m"] = {antenna.x(), antenna.y(), antenna.z()};
    out["placement"] = std::string(output::placement_word(arrival.placement));
    out["satellites"] = Json::array();
    simulation::Epoch nothing;  // the columns of satellites and paths ask no more of it than its time
    nothing.observed.time = time;
    const tracking::ChannelModel model(signal, site.simulation().scenario().seed, receiver.name);
    for (const propagation::SatelliteView& view : arrival.views) {
      const std::vector<SentSignal> sent = sent_signals(view.line, time, receiver);
      const receiver::SatelliteObservation seen = observation_of(view);
      output::Row row{nothing, &seen, &seen};
      Json entry{{"range_m", view.line.range_m}, {"signals", Json::array()}, {"paths", Json::array()}};
      put_columns(entry, output::TableKind::Satellites, row, "sat", "visibility");
      for (const SentSignal& s : sent) {
        Json one{{"signal", std::string(s.signal->name)},
                 {"rinex_code", std::string(s.signal->code)},
                 {"carrier_hz", s.carrier_hz}};
        if (signal.enabled) {
          one["clear_cn0_dbhz"] = model.clear_cn0_dbhz(*s.signal, view.line.elevation_rad,
                                                       model.offset_db(view.line.id, *s.signal, time));
        }
        entry["signals"].push_back(std::move(one));
      }
      for (const propagation::Path& path : view.paths.paths) {
        row.path = &path;
        row.amplitude = 0;
        Json one = Json::object();
        if (signal.enabled) {
          const double carrier_hz = view.line.state.carrier_frequency_hz;
          row.amplitude = amplitude(path, view.line, carrier_hz, signal);
          Json& of_signals = one["signal_loss_db"] = Json::object();
          for (const SentSignal& s : sent) {
            of_signals[std::string(s.signal->name)] = loss_db(path, view.line, s.carrier_hz, signal);
          }
        }
        put_columns(one, output::TableKind::Paths, row, "kind", {});
        if (path.foliage_depth_m > 0) one["foliage_depth_m"] = path.foliage_depth_m;
        if (path.kind != propagation::PathKind::Direct) one["point_enu_m"] = numbers(path.point);
        if (path.kind == propagation::PathKind::Reflected || path.kind == propagation::PathKind::Diffuse) {
          one["instance"] = path.instance;
          one["triangle"] = path.triangle;
        }
        if (path.kind == propagation::PathKind::Diffracted && path.edge_nu) {
          one["edge_nu"] = *path.edge_nu;
        }
        if (path.kind == propagation::PathKind::Diffuse) one["scattered_power"] = path.scattered_power;
        if (path.order == 2) {
          one["far_point_enu_m"] = numbers(path.far_point);
          one["far_incidence_deg"] = geodesy::degrees(path.far_incidence_rad());
          one["far_instance"] = path.far_instance;
          one["far_triangle"] = path.far_triangle;
        }
        entry["paths"].push_back(std::move(one));
      }
      out["satellites"].push_back(std::move(entry));
    }
    fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
    return kOk;
  }

  fmt::print("{} at {:.7f}, {:.7f}, {:.2f} m (east {:.2f}, north {:.2f}, up {:.2f} m), {}\n\n",
             geodesy::format_gpst(time), geodesy::degrees(place.latitude_rad),
             geodesy::degrees(place.longitude_rad), place.height_m, antenna.x(), antenna.y(), antenna.z(),
             output::placement_word(arrival.placement));
  // One number a path, or with `tracks` one for each signal.
  const auto loss_text = [&](const propagation::Path& path, const orbit::LineOfSight& line) {
    if (receiver.tracks.empty()) {
      return fmt::format("{:.1f}", loss_db(path, line, line.state.carrier_frequency_hz, signal));
    }
    std::string text;
    for (const SentSignal& s : sent_signals(line, time, receiver)) {
      text += fmt::format("{}{} {:.1f}", text.empty() ? "" : ", ", s.signal->name,
                          loss_db(path, line, s.carrier_hz, signal));
    }
    return text;
  };
  std::vector<TextRow> rows;
  for (const propagation::SatelliteView& view : arrival.views) {
    TextRow row{gnss::to_string(view.line.id), fmt::format("{:.1f}", geodesy::degrees(view.line.azimuth_rad)),
                fmt::format("{:.1f}", geodesy::degrees(view.line.elevation_rad)),
                std::string(propagation::name(view.paths.visibility))};
    if (view.paths.paths.empty()) {
      row.insert(row.end(), signal.enabled ? 5 : 4, "-");
      rows.push_back(row);
    }
    for (const propagation::Path& path : view.paths.paths) {
      TextRow line = row;
      line.push_back(kind_text(path));
      line.push_back(fmt::format("{:.2f}", path.excess_m));
      if (signal.enabled) line.push_back(loss_text(path, view.line));
      line.push_back(path.kind == propagation::PathKind::Direct ? "-" : triple(path.point));
      line.push_back(path.kind == propagation::PathKind::Reflected ? angle(path.incidence_rad()) : "-");
      rows.push_back(std::move(line));
      row = {"", "", "", ""};
      if (path.order == 2) {
        TextRow before{"", "", "", "", "  before that", ""};
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

void add_trace(Command& app) {
  Command& command = app.add_command("trace", "list every path of every satellite at one place and time");
  TraceArguments& arguments = command.run_with(run_trace);
  add_site_options(command, arguments.site);
  command.add_flag("--json", arguments.json, "print JSON");
  command.footer =
      "Without --at or --enu the antenna is on the scenario's trajectory at that time.\n"
      "With a signal model (signal.enabled) `loss` is the loss of each path against the unobstructed line of "
      "sight,\n"
      "of the signal near L1 or of each signal in `tracks`. JSON has `signal_loss_db` of each signal and the "
      "C/N0 of\n"
      "the unobstructed line of sight (`clear_cn0_dbhz`).";
}

}  // namespace canyon::cli
