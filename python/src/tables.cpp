#include <fmt/format.h>

#include <limits>
#include <optional>
#include <span>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/output/epoch_values.hpp"
#include "python/src/arrays.hpp"
#include "python/src/epochs.hpp"
#include "python/src/settings.hpp"

// Tables of epochs as columns. A column is one line: its name as docs/outputs.md has it, unit, CF standard
// name, and where its value comes from.

namespace canyon::python {
namespace {

using geodesy::degrees;
using receiver::SatelliteObservation;
using receiver::SignalObservation;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// What a row is of. Members beyond the table's own are null.
struct Row {
  const KeptEpoch* kept = nullptr;
  const SatelliteObservation* satellite = nullptr;
  const SignalObservation* signal = nullptr;
  const propagation::SatelliteView* view = nullptr;
  const propagation::Path* path = nullptr;

  [[nodiscard]] const simulation::Epoch& epoch() const { return kept->epoch; }
  [[nodiscard]] const positioning::Fix& fix() const { return kept->epoch.observed.fix; }
  [[nodiscard]] double measured(double (*value)(const positioning::Measurement&)) const {
    return signal->measurement ? value(*signal->measurement) : kNan;
  }
};

enum class Kind { Number, Integer, Time, Text };
struct Column {
  const char* name;
  const char* unit;
  const char* standard_name;  ///< of the CF conventions; empty: none fits
  Kind kind;
  double (*number)(const Row&);
  std::int64_t (*integer)(const Row&);
  std::string (*text)(const Row&);
};
using Number = double (*)(const Row&);
using Integer = std::int64_t (*)(const Row&);
using Text = std::string (*)(const Row&);

constexpr Column number(const char* name, const char* unit, Number value, const char* standard_name = "") {
  return {name, unit, standard_name, Kind::Number, value, nullptr, nullptr};
}
constexpr Column integer(const char* name, const char* unit, Integer value) {
  return {name, unit, "", Kind::Integer, nullptr, value, nullptr};
}
constexpr Column text(const char* name, Text value) {
  return {name, "", "", Kind::Text, nullptr, nullptr, value};
}

double solved(const Row& row, double value) {
  return row.fix().solved() ? value : kNan;
}
double dop(const Row& row, double positioning::Dop::*value) {
  return row.fix().solved() && row.fix().dop ? (*row.fix().dop).*value : kNan;
}
std::string satellite_name(const Row& row) {
  return gnss::to_string(row.satellite != nullptr ? row.satellite->id : row.view->line.id);
}
std::int64_t is_listed(const std::vector<gnss::SatelliteId>& list, gnss::SatelliteId id) {
  return std::find(list.begin(), list.end(), id) != list.end() ? 1 : 0;
}

const Column kTime{"time",     "",      "time",
                   Kind::Time, nullptr, [](const Row& r) { return unix_ns(r.epoch().observed.time); },
                   nullptr};

const std::vector<Column>& epoch_columns() {
  static const std::vector<Column> columns{
      kTime,
      number(
          "true_latitude_deg", "degrees_north",
          [](const Row& r) { return degrees(r.epoch().truth.position.latitude_rad); }, "latitude"),
      number(
          "true_longitude_deg", "degrees_east",
          [](const Row& r) { return degrees(r.epoch().truth.position.longitude_rad); }, "longitude"),
      number(
          "true_height_m", "m", [](const Row& r) { return r.epoch().truth.position.height_m; },
          "height_above_reference_ellipsoid"),
      text("status", [](const Row& r) { return std::string(output::status_word(r.fix())); }),
      number(
          "fix_latitude_deg", "degrees_north",
          [](const Row& r) { return solved(r, degrees(r.fix().position.latitude_rad)); }, "latitude"),
      number(
          "fix_longitude_deg", "degrees_east",
          [](const Row& r) { return solved(r, degrees(r.fix().position.longitude_rad)); }, "longitude"),
      number(
          "fix_height_m", "m", [](const Row& r) { return solved(r, r.fix().position.height_m); },
          "height_above_reference_ellipsoid"),
      number("error_east_m", "m", [](const Row& r) { return r.epoch().error_enu_m.x(); }),
      number("error_north_m", "m", [](const Row& r) { return r.epoch().error_enu_m.y(); }),
      number("error_up_m", "m", [](const Row& r) { return r.epoch().error_enu_m.z(); }),
      number("error_horizontal_m", "m",
             [](const Row& r) { return output::horizontal_m(r.epoch().error_enu_m); }),
      number("gdop", "1", [](const Row& r) { return dop(r, &positioning::Dop::gdop); }),
      number("pdop", "1", [](const Row& r) { return dop(r, &positioning::Dop::pdop); }),
      number("hdop", "1", [](const Row& r) { return dop(r, &positioning::Dop::hdop); }),
      number("vdop", "1", [](const Row& r) { return dop(r, &positioning::Dop::vdop); }),
      number("tdop", "1", [](const Row& r) { return dop(r, &positioning::Dop::tdop); }),
      integer("visible", "1", [](const Row& r) -> std::int64_t { return r.epoch().observed.visible; }),
      integer("blocked", "1", [](const Row& r) -> std::int64_t { return r.epoch().observed.blocked; }),
      integer("used", "1",
              [](const Row& r) { return static_cast<std::int64_t>(output::used_count(r.fix())); }),
      text("reason",
           [](const Row& r) {
             return r.fix().solved() ? std::string() : std::string(positioning::reason(r.fix().status));
           }),
      text("placement",
           [](const Row& r) { return std::string(output::placement_word(r.epoch().placement)); }),
      number("true_velocity_east_mps", "m s-1",
             [](const Row& r) { return r.epoch().truth.velocity_enu_mps.x(); }),
      number("true_velocity_north_mps", "m s-1",
             [](const Row& r) { return r.epoch().truth.velocity_enu_mps.y(); }),
      number("true_velocity_up_mps", "m s-1",
             [](const Row& r) { return r.epoch().truth.velocity_enu_mps.z(); }),
      number("sigma_east_m", "m",
             [](const Row& r) { return solved(r, std::sqrt(r.fix().covariance_enu(0, 0))); }),
      number("sigma_north_m", "m",
             [](const Row& r) { return solved(r, std::sqrt(r.fix().covariance_enu(1, 1))); }),
      number("sigma_up_m", "m",
             [](const Row& r) { return solved(r, std::sqrt(r.fix().covariance_enu(2, 2))); }),
      number("clock_bias_s", "s", [](const Row& r) { return r.epoch().observed.clock_bias_s; }),
      integer("excluded", "1",
              [](const Row& r) { return static_cast<std::int64_t>(r.fix().excluded.size()); }),
      text("faults", [](const Row& r) { return output::fault_names(r.epoch().faults); })};
  return columns;
}

const std::vector<Column>& satellite_columns() {
  static const std::vector<Column> columns{
      kTime,
      text("sat", &satellite_name),
      number(
          "azimuth_deg", "degree", [](const Row& r) { return degrees(r.satellite->azimuth_rad); },
          "platform_azimuth_angle"),
      number("elevation_deg", "degree", [](const Row& r) { return degrees(r.satellite->elevation_rad); }),
      text("visibility",
           [](const Row& r) { return std::string(propagation::name(r.satellite->visibility)); }),
      number("excess_path_m", "m",
             [](const Row& r) {
               return output::has_tracked_excess(*r.satellite) ? r.satellite->excess_m : kNan;
             }),
      number("pseudorange_m", "m",
             [](const Row& r) { return r.measured([](const auto& m) { return m.pseudorange_m; }); }),
      number("pseudorange_error_m", "m",
             [](const Row& r) { return r.signal->measurement ? r.signal->pseudorange_error_m : kNan; }),
      number("noise_m", "m", [](const Row& r) { return r.signal->measurement ? r.signal->noise_m : kNan; }),
      number("sigma_m", "m",
             [](const Row& r) { return r.measured([](const auto& m) { return m.sigma_m; }); }),
      integer("used", "1", [](const Row& r) -> std::int64_t { return r.satellite->used ? 1 : 0; }),
      integer("above_mask", "1",
              [](const Row& r) -> std::int64_t { return r.satellite->above_mask ? 1 : 0; }),
      integer("excluded", "1", [](const Row& r) { return is_listed(r.fix().excluded, r.satellite->id); }),
      number(
          "doppler_hz", "Hz",
          [](const Row& r) { return r.measured([](const auto& m) { return m.doppler_hz.value_or(kNan); }); }),
      number("carrier_frequency_hz", "Hz",
             [](const Row& r) { return r.measured([](const auto& m) { return m.carrier_frequency_hz; }); }),
      number(
          "cn0_dbhz", "dB",
          [](const Row& r) { return r.measured([](const auto& m) { return m.cn0_dbhz.value_or(kNan); }); }),
      number("true_cn0_dbhz", "dB", [](const Row& r) { return r.signal->cn0_dbhz.value_or(kNan); }),
      text("lock", [](const Row& r) { return std::string(tracking::name(r.signal->lock)); }),
      number("carrier_phase_cycles", "1", [](const Row& r) {
        return r.measured([](const auto& m) { return m.carrier_phase_cycles.value_or(kNan); });
      })};
  return columns;
}

const std::vector<Column>& signal_columns() {
  static const std::vector<Column> columns = [] {
    std::vector<Column> list{
        kTime, text("sat", &satellite_name),
        text("signal",
             [](const Row& r) {
               return r.signal->signal != nullptr ? std::string(r.signal->signal->name) : std::string();
             }),
        text("rinex_code", [](const Row& r) {
          return r.signal->signal != nullptr ? std::string(r.signal->signal->code) : std::string();
        })};
    // Columns of the satellite's first signal serve each signal alike.
    for (const Column& column : satellite_columns()) {
      static constexpr std::array kShared{
          "pseudorange_m", "pseudorange_error_m",  "noise_m",  "sigma_m",
          "doppler_hz",    "carrier_frequency_hz", "cn0_dbhz", "true_cn0_dbhz",
          "lock",          "carrier_phase_cycles"};
      if (std::find(kShared.begin(), kShared.end(), std::string_view(column.name)) != kShared.end())
        list.push_back(column);
    }
    list.push_back(number("excess_path_m", "m", [](const Row& r) {
      return r.signal->lock == tracking::LockState::Tracking ? r.signal->excess_m : kNan;
    }));
    list.push_back(number("ionosphere_m", "m", [](const Row& r) {
      return r.signal->measurement ? r.signal->ionosphere_m : kNan;
    }));
    list.push_back(number("troposphere_m", "m", [](const Row& r) {
      return r.signal->measurement ? r.signal->troposphere_m : kNan;
    }));
    list.push_back(
        number("bias_m", "m", [](const Row& r) { return r.signal->measurement ? r.signal->bias_m : kNan; }));
    return list;
  }();
  return columns;
}

const std::vector<Column>& path_columns() {
  static const std::vector<Column> columns{
      kTime,
      text("sat", &satellite_name),
      text("kind", [](const Row& r) { return std::string(propagation::name(r.path->kind)); }),
      integer("order", "1", [](const Row& r) -> std::int64_t { return r.path->order; }),
      number("excess_path_m", "m", [](const Row& r) { return r.path->excess_m; }),
      number("arrival_east", "1", [](const Row& r) { return r.path->arrival.x(); }),
      number("arrival_north", "1", [](const Row& r) { return r.path->arrival.y(); }),
      number("arrival_up", "1", [](const Row& r) { return r.path->arrival.z(); }),
      number("point_east_m", "m",
             [](const Row& r) {
               return r.path->kind == propagation::PathKind::Direct ? kNan : r.path->point.x();
             }),
      number("point_north_m", "m",
             [](const Row& r) {
               return r.path->kind == propagation::PathKind::Direct ? kNan : r.path->point.y();
             }),
      number("point_up_m", "m",
             [](const Row& r) {
               return r.path->kind == propagation::PathKind::Direct ? kNan : r.path->point.z();
             }),
      number("incidence_deg", "degree", [](const Row& r) {
        return r.path->incidence_count > 0 ? degrees(r.path->incidence_rad()) : kNan;
      })};
  return columns;
}

struct Table {
  const char* name;
  const std::vector<Column>& (*columns)();
  void (*rows)(const KeptEpoch&, std::vector<Row>&);
};
constexpr std::array<Table, 4> kTables{
    {{"epochs", &epoch_columns, [](const KeptEpoch& e, std::vector<Row>& rows) { rows.push_back({&e}); }},
     {"satellites", &satellite_columns,
      [](const KeptEpoch& e, std::vector<Row>& rows) {
        for (const SatelliteObservation& s : e.epoch.observed.satellites) rows.push_back({&e, &s, &s});
      }},
     {"signals", &signal_columns,
      [](const KeptEpoch& e, std::vector<Row>& rows) {
        for (const SatelliteObservation& s : e.epoch.observed.satellites) {
          rows.push_back({&e, &s, &s});
          for (const SignalObservation& more : s.more) rows.push_back({&e, &s, &more});
        }
      }},
     {"paths", &path_columns, [](const KeptEpoch& e, std::vector<Row>& rows) {
        if (!e.arrival) return;
        for (const propagation::SatelliteView& view : e.arrival->views) {
          for (const propagation::Path& path : view.paths.paths)
            rows.push_back({&e, nullptr, nullptr, &view, &path});
        }
      }}}};

const Table& table_named(const std::string& name) {
  std::vector<std::string> known;
  for (const Table& table : kTables) {
    if (table.name == name) return table;
    known.emplace_back(table.name);
  }
  throw InputError(fmt::format("there is no table '{}'", name),
                   fmt::format("known are {}", fmt::join(known, ", ")));
}

/// Texts of few different values become a fixed-width array of UTF-32, as NumPy has it.
py::object texts(const std::vector<Row>& rows, Text value) {
  std::vector<std::string> all;
  all.reserve(rows.size());
  std::size_t width = 1;
  for (const Row& row : rows) {
    all.push_back(value(row));
    width = std::max(width, all.back().size());
  }
  py::array array(py::dtype(fmt::format("U{}", width)),
                  std::vector<py::ssize_t>{static_cast<py::ssize_t>(all.size())});
  auto* out = static_cast<char32_t*>(array.mutable_data());
  std::fill(out, out + all.size() * width, U'\0');
  for (std::size_t i = 0; i < all.size(); ++i) {
    // Fault names alone may have other letters than ASCII.
    const py::str decoded(all[i]);
    const py::ssize_t length = PyUnicode_GetLength(decoded.ptr());
    for (py::ssize_t k = 0; k < length; ++k) {
      out[i * width + static_cast<std::size_t>(k)] =
          static_cast<char32_t>(PyUnicode_ReadChar(decoded.ptr(), k));
    }
  }
  return array;
}

py::object column_of(const Column& column, const std::vector<Row>& rows) {
  if (column.kind == Kind::Text) return texts(rows, column.text);
  if (column.kind == Kind::Number) {
    std::vector<double> values;
    values.reserve(rows.size());
    for (const Row& row : rows) values.push_back(column.number(row));
    return owning_array(std::move(values));
  }
  std::vector<std::int64_t> values;
  values.reserve(rows.size());
  for (const Row& row : rows) values.push_back(column.integer(row));
  return column.kind == Kind::Time ? datetimes(std::move(values)) : owning_array(std::move(values));
}

}  // namespace

py::dict table_of(const std::vector<EpochPtr>& epochs, const std::string& name) {
  const Table& table = table_named(name);
  std::vector<Row> rows;
  for (const EpochPtr& epoch : epochs) table.rows(*epoch, rows);
  py::dict columns;
  for (const Column& column : table.columns()) columns[column.name] = column_of(column, rows);
  return columns;
}

/// Column name to (unit, CF standard name).
py::dict columns_of(const std::string& name) {
  py::dict about;
  for (const Column& column : table_named(name).columns()) {
    about[column.name] = py::make_tuple(column.unit, column.standard_name);
  }
  return about;
}

}  // namespace canyon::python
