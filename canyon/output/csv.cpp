#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>

#include "canyon/city/mesh_marks.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/output/epoch_values.hpp"
#include "canyon/output/formats.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/path_loss.hpp"
#include "canyon/output/phase_arcs.hpp"
#include "canyon/output/sinks.hpp"

namespace canyon::output {
namespace {

using geodesy::degrees;

/// One line of cells; a cell that is not known stays empty.
class Row {
 public:
  Row& add(std::string_view text) {
    if (started_) text_ += ',';
    started_ = true;
    text_ += text;
    return *this;
  }
  Row& add(double value, int decimals) { return add(fixed(value, decimals)); }
  Row& add(std::int64_t value) { return add(fmt::format_int(value).c_str()); }
  Row& add(const std::optional<double>& value, int decimals) {
    return add(value ? fixed(*value, decimals) : std::string());
  }
  Row& add_vector(const Eigen::Vector3d& v, int decimals) {
    for (int i = 0; i < 3; ++i) add(v[i], decimals);
    return *this;
  }
  Row& add_nothing(int cells) {
    for (int i = 0; i < cells; ++i) add("");
    return *this;
  }
  /// Degrees with 10 decimals (0.01 mm), height with 4.
  Row& add_position(const geodesy::Geodetic& p) {
    return add(degrees(p.latitude_rad), 10).add(degrees(p.longitude_rad), 10).add(p.height_m, 4);
  }
  [[nodiscard]] std::string line() && { return std::move(text_ += '\n'); }

 private:
  std::string text_;
  bool started_ = false;
};

std::string header(const std::vector<std::string>& columns) {
  Row row;
  for (const auto& column : columns) row.add(column);
  return std::move(row).line();
}

/// A cell of any text (RFC 4180).
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string cell = "\"";
  for (const char c : text) {
    if (c == '"') cell += c;
    cell += c;
  }
  return cell + '"';
}

class EpochsCsv final : public Encoder {
 public:
  std::string begin() override { return header(epochs_csv_columns()); }
  std::string encode(const simulation::Epoch& epoch) override {
    const receiver::ReceiverEpoch& seen = epoch.observed;
    const positioning::Fix& fix = seen.fix;
    Row row;
    row.add(seen.time.week()).add(seconds_of_week(seen.time)).add_position(epoch.truth.position);
    row.add(status_word(fix));
    if (fix.solved()) {
      row.add_position(fix.position).add_vector(epoch.error_enu_m, 4);
    } else {
      row.add_nothing(6);
    }
    if (fix.solved() && fix.dop) {
      const positioning::Dop& d = *fix.dop;
      for (const double dop : {d.gdop, d.pdop, d.hdop, d.vdop, d.tdop}) row.add(dop, 4);
      row.add(positioning::name(positioning::rate_dop(d.pdop)));
    } else {
      row.add_nothing(6);
    }
    row.add(seen.visible).add(seen.blocked).add(static_cast<std::int64_t>(used_count(fix)));

    row.add(fix.solved() ? std::string_view() : positioning::reason(fix.status));
    row.add(placement_word(epoch.placement)).add_vector(epoch.truth.velocity_enu_mps, 4);
    if (fix.solved() && fix.velocity_enu_mps) {
      row.add_vector(*fix.velocity_enu_mps, 4);
    } else {
      row.add_nothing(3);
    }
    if (fix.solved()) {
      row.add_vector(fix.covariance_enu.diagonal().cwiseSqrt(), 4);
      row.add(fix.covariance_enu(0, 1), 6).add(fix.covariance_enu(0, 2), 6).add(fix.covariance_enu(1, 2), 6);
    } else {
      row.add_nothing(6);
    }
    for (const gnss::System system : gnss::kConstellations) {
      const auto bias = fix.clock_bias_s.find(system);
      const bool known = fix.solved() && bias != fix.clock_bias_s.end();
      row.add(known ? fixed(bias->second, 13) : std::string());
    }
    row.add(static_cast<std::int64_t>(fix.excluded.size()));
    row.add(!fix.consistent ? "" : *fix.consistent ? "1" : "0");
    row.add(quoted(fault_names(epoch.faults)));
    return std::move(row).line();
  }
};

class SatellitesCsv final : public Encoder {
 public:
  std::string begin() override { return header(satellites_csv_columns()); }
  std::string encode(const simulation::Epoch& epoch) override {
    std::string lines;
    const receiver::ReceiverEpoch& seen = epoch.observed;
    const positioning::Fix& fix = seen.fix;
    const std::string tow = seconds_of_week(seen.time);
    for (const receiver::SatelliteObservation& satellite : seen.satellites) {
      Row row;
      row.add(seen.time.week()).add(tow).add(gnss::to_string(satellite.id));
      row.add(wrapped_azimuth_deg(satellite.azimuth_rad, 6), 6).add(degrees(satellite.elevation_rad), 6);
      row.add(propagation::name(satellite.visibility));
      row.add(has_tracked_excess(satellite) ? fixed(satellite.excess_m, 4) : std::string());
      if (satellite.measurement) {
        row.add(satellite.measurement->pseudorange_m, 4);
        row.add(satellite.pseudorange_error_m, 4).add(satellite.noise_m, 4);
      } else {
        row.add_nothing(3);
      }
      row.add(satellite.used ? "1" : "0").add(satellite.above_mask ? "1" : "0");
      if (satellite.measurement) {
        const positioning::Measurement& m = *satellite.measurement;
        row.add(m.doppler_hz, 4);
        row.add(m.carrier_frequency_hz, 0).add(m.sigma_m, 4);
      } else {
        row.add_nothing(3);
      }
      const auto used = std::lower_bound(fix.used.begin(), fix.used.end(), satellite.id);
      const auto index = static_cast<std::size_t>(used - fix.used.begin());
      const bool known =
          fix.solved() && used != fix.used.end() && *used == satellite.id && index < fix.residuals_m.size();
      row.add(known ? fixed(fix.residuals_m[index], 4) : std::string());
      add_signal(row, satellite, seen.time);
      const bool excluded =
          std::find(fix.excluded.begin(), fix.excluded.end(), satellite.id) != fix.excluded.end();
      row.add(excluded ? "1" : "0");
      lines += std::move(row).line();
    }
    return lines;
  }

 private:
  /// Strength, lock and phase.
  void add_signal(Row& row, const receiver::SatelliteObservation& satellite, geodesy::GpsTime time) {
    const auto& m = satellite.measurement;
    row.add(m ? m->cn0_dbhz : std::nullopt, 2).add(satellite.cn0_dbhz, 2);
    row.add(tracking::name(satellite.lock));
    const auto link = m ? arcs_.next(*m) : std::nullopt;
    if (!link) {
      row.add_nothing(3);
      return;
    }
    row.add(m->carrier_phase_cycles, 4).add(time - *m->phase_since, 3).add(link->slip ? "1" : "0");
  }

  PhaseArcs arcs_;
};

class SignalsCsv final : public Encoder {
 public:
  std::string begin() override { return header(signals_csv_columns()); }
  std::string encode(const simulation::Epoch& epoch) override {
    std::string lines;
    const std::string tow = seconds_of_week(epoch.observed.time);
    for (const receiver::SatelliteObservation& satellite : epoch.observed.satellites) {
      const auto add = [&](const receiver::SignalObservation& seen) {
        Row row;
        row.add(epoch.observed.time.week()).add(tow).add(gnss::to_string(satellite.id));
        add_signal(row, seen,
                   seen.signal != nullptr ? *seen.signal : gnss::signals_of(satellite.id.system).front(),
                   epoch.observed.time, satellite.estimated_ionosphere_m);
        lines += std::move(row).line();
      };
      add(satellite);
      for (const receiver::SignalObservation& signal : satellite.more) add(signal);
    }
    return lines;
  }

 private:
  void add_signal(Row& row, const receiver::SignalObservation& seen, const gnss::Signal& signal,
                  geodesy::GpsTime time, std::optional<double> ionosphere_l1_m) {
    const auto& m = seen.measurement;
    row.add(signal.name).add(signal.code);
    row.add(m ? fixed(m->carrier_frequency_hz, 0) : std::string());
    row.add(tracking::name(seen.lock)).add(seen.cn0_dbhz, 2).add(m ? m->cn0_dbhz : std::nullopt, 2);
    row.add(seen.lock == tracking::LockState::Tracking ? fixed(seen.excess_m, 4) : std::string());
    if (!m) {
      row.add_nothing(12);
      return;
    }
    row.add(m->pseudorange_m, 4).add(seen.pseudorange_error_m, 4).add(seen.noise_m, 4).add(m->sigma_m, 4);
    if (ionosphere_l1_m) *ionosphere_l1_m *= std::pow(gnss::kL1_hz / m->carrier_frequency_hz, 2);
    row.add(seen.ionosphere_m, 4).add(ionosphere_l1_m, 4).add(seen.troposphere_m, 4).add(seen.bias_m, 4);
    row.add(m->doppler_hz, 4);
    const auto link = arcs_.next(*m, gnss::index_of(signal));
    if (!link) {
      row.add_nothing(3);
      return;
    }
    row.add(m->carrier_phase_cycles, 4).add(time - *m->phase_since, 3).add(link->slip ? "1" : "0");
  }

  PhaseArcs arcs_;
};

class PathsCsv final : public Encoder {
 public:
  explicit PathsCsv(const ReceiverDescription& receiver) : signal_(receiver.signal) {}

  std::string begin() override { return header(paths_csv_columns()); }
  std::string encode(const simulation::Epoch& epoch) override {
    std::string lines;
    const std::string tow = seconds_of_week(epoch.observed.time);
    for_each_view(
        epoch.observed, epoch.arrival,
        [&](const receiver::SatelliteObservation& satellite, const propagation::SatelliteView& view) {
          std::int64_t number = 0;
          for (const propagation::Path& path : view.paths.paths) {
            Row row;
            row.add(epoch.observed.time.week()).add(tow);
            row.add(gnss::to_string(satellite.id)).add(number++);
            add_path(row, path, first_signal_amplitude(satellite, view, path, signal_));
            lines += std::move(row).line();
          }
        });
    return lines;
  }

 private:
  static void add_path(Row& row, const propagation::Path& path, std::complex<double> amplitude) {
    row.add(propagation::name(path.kind)).add(static_cast<std::int64_t>(path.order)).add(path.excess_m, 4);
    if (amplitude != 0.0) {
      row.add(-20 * std::log10(std::abs(amplitude)), 2).add(degrees(std::arg(amplitude)), 1);
    } else {
      row.add_nothing(2);
    }
    if (path.kind == propagation::PathKind::Direct) {
      row.add_nothing(9);
      return;
    }
    row.add(fmt::format("{:016x}", path.reflector));
    const auto material = [&path](int incidence) {
      return city::material_name(path.incidences[static_cast<std::size_t>(incidence)].material);
    };
    row.add(path.incidence_count > 0 ? material(path.incidence_count - 1) : "").add_vector(path.point, 3);
    if (path.order < 2) {
      row.add_nothing(4);
    } else {
      row.add(material(0)).add_vector(path.far_point, 3);
    }
  }

  tracking::SignalOptions signal_;
};

}  // namespace

const std::vector<std::string>& paths_csv_columns() {
  static const std::vector<std::string> columns{"gps_week",
                                                "gps_tow",
                                                "sat",
                                                "path",
                                                "kind",
                                                "order",
                                                "excess_path_m",
                                                "loss_db",
                                                "phase_deg",
                                                "reflector",
                                                "material",
                                                "point_east_m",
                                                "point_north_m",
                                                "point_up_m",
                                                "far_material",
                                                "far_point_east_m",
                                                "far_point_north_m",
                                                "far_point_up_m"};
  return columns;
}

const std::vector<std::string>& signals_csv_columns() {
  static const std::vector<std::string> columns{"gps_week",      "gps_tow",
                                                "sat",           "signal",
                                                "rinex_code",    "carrier_frequency_hz",
                                                "lock",          "true_cn0_dbhz",
                                                "cn0_dbhz",      "excess_path_m",
                                                "pseudorange_m", "pseudorange_error_m",
                                                "noise_m",       "sigma_m",
                                                "ionosphere_m",  "estimated_ionosphere_m",
                                                "troposphere_m", "bias_m",
                                                "doppler_hz",    "carrier_phase_cycles",
                                                "phase_lock_s",  "cycle_slip"};
  return columns;
}

const std::vector<std::string>& epochs_csv_columns() {
  static const std::vector<std::string> columns{
      "gps_week", "gps_tow", "true_latitude_deg", "true_longitude_deg", "true_height_m", "status",
      "fix_latitude_deg", "fix_longitude_deg", "fix_height_m", "error_east_m", "error_north_m", "error_up_m",
      "gdop", "pdop", "hdop", "vdop", "tdop", "rating", "visible", "blocked", "used",
      // Behind the agreed ones.
      "reason", "placement", "true_velocity_east_mps", "true_velocity_north_mps", "true_velocity_up_mps",
      "fix_velocity_east_mps", "fix_velocity_north_mps", "fix_velocity_up_mps", "sigma_east_m",
      "sigma_north_m", "sigma_up_m", "covariance_east_north_m2", "covariance_east_up_m2",
      "covariance_north_up_m2", "clock_gps_s", "clock_glonass_s", "clock_galileo_s", "clock_beidou_s",
      "clock_qzss_s", "excluded", "consistent", "faults"};
  return columns;
}

const std::vector<std::string>& satellites_csv_columns() {
  static const std::vector<std::string> columns{
      "gps_week", "gps_tow", "sat", "azimuth_deg", "elevation_deg", "visibility", "excess_path_m",
      "pseudorange_m", "pseudorange_error_m", "noise_m", "used",
      // Behind the agreed ones.
      "above_mask", "doppler_hz", "carrier_frequency_hz", "sigma_m", "residual_m", "cn0_dbhz",
      "true_cn0_dbhz", "lock", "carrier_phase_cycles", "phase_lock_s", "cycle_slip", "excluded"};
  return columns;
}

std::unique_ptr<Encoder> encode_epochs_csv(const ReceiverDescription&) {
  return std::make_unique<EpochsCsv>();
}

std::unique_ptr<Encoder> encode_signals_csv(const ReceiverDescription&) {
  return std::make_unique<SignalsCsv>();
}

std::unique_ptr<Encoder> encode_paths_csv(const ReceiverDescription& receiver) {
  return std::make_unique<PathsCsv>(receiver);
}

std::unique_ptr<Encoder> encode_satellites_csv(const ReceiverDescription&) {
  return std::make_unique<SatellitesCsv>();
}

}  // namespace canyon::output
