#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/receiver/rtcm/frames.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

// Messages of RTCM 3, written field by field.

namespace canyon::rtcm {

inline const geodesy::GpsTime kTime = geodesy::GpsTime::from_week(2320, 116'400);

inline gnss::SatelliteId satellite(const char* name) {
  return *gnss::parse_satellite(name);
}

/// One signal of a message.
struct Cell {
  gnss::SatelliteId id;
  std::string_view code;  ///< RINEX
  double range_m = 0;
  std::optional<double> phase_m, rate_mps;
  double lock_s = 0, cn0_dbhz = 0;
  bool half_cycle = false;
  int extended = 15;  ///< DF419
};

inline std::uint64_t field(double value, double step, int width) {
  return static_cast<std::uint64_t>(broadcast::field_value(value, step, width, true));
}
inline std::uint64_t none(int width) {
  return std::uint64_t{1} << (width - 1);
}

inline std::uint64_t time_field(gnss::System system, geodesy::GpsTime time) {
  if (system == gnss::System::BeiDou) time = time - std::chrono::seconds(14);
  if (system != gnss::System::GLONASS)
    return static_cast<std::uint64_t>(time.nanosecond_of_week() / 1'000'000);
  const geodesy::GpsTime moscow =
      time - std::chrono::seconds(geodesy::leap_seconds(time)) + std::chrono::hours(3);
  const auto ms = static_cast<std::uint64_t>(moscow.nanosecond_of_week() / 1'000'000);
  return ms / 86'400'000 << 27 | ms % 86'400'000;
}

/// MSM`kind` (4 to 7) of a system's cells, grouped by satellite.
inline broadcast::Bits msm(gnss::System system, int kind, geodesy::GpsTime time,
                           const std::vector<Cell>& cells, bool more = false, int station = 7) {
  const bool fine = kind >= 6, rates = kind % 2 == 1;
  std::map<int, std::map<int, const Cell*>> table;  // by index of satellite and signal
  std::set<int> signals;
  for (const Cell& cell : cells) {
    int signal = 1;
    while (rinex_code(system, signal) != cell.code) ++signal;
    signals.insert(signal);
    table[mask_number(cell.id)][signal] = &cell;
  }
  const auto index = std::find(kMsmSystems.begin(), kMsmSystems.end(), system) - kMsmSystems.begin();
  broadcast::Bits bits;
  bits.put(static_cast<std::uint64_t>(1070 + 10 * index + kind), 12)
      .put(static_cast<std::uint64_t>(station), 12);
  bits.put(time_field(system, time), 30).put(more ? 1 : 0, 1).put(0, 18);
  for (int slot = 1; slot <= 64; ++slot) bits.put(table.count(slot), 1);
  for (int signal = 1; signal <= 32; ++signal) bits.put(signals.count(signal), 1);
  struct Row {
    const Cell* cell;
    std::int64_t rough;  ///< [1/1024 ms]
    double rate;
  };
  std::vector<Row> satellite_rows, cell_rows;
  for (const auto& [slot, row] : table) {
    const Cell* first = row.begin()->second;
    satellite_rows.push_back({first, std::llround(first->range_m / kMillisecond_m * 1024),
                              std::round(first->rate_mps.value_or(0))});
    for (const int signal : signals) {
      bits.put(row.count(signal), 1);
      if (row.count(signal) > 0)
        cell_rows.push_back({row.at(signal), satellite_rows.back().rough, satellite_rows.back().rate});
    }
  }
  for (const Row& r : satellite_rows) bits.put(static_cast<std::uint64_t>(r.rough / 1024), 8);
  if (rates) {
    for (const Row& r : satellite_rows) bits.put(static_cast<std::uint64_t>(r.cell->extended), 4);
  }
  for (const Row& r : satellite_rows) bits.put(static_cast<std::uint64_t>(r.rough % 1024), 10);
  if (rates) {
    for (const Row& r : satellite_rows) bits.put(r.cell->rate_mps ? field(r.rate, 1, 14) : none(14), 14);
  }
  const auto fraction = [](const Row& r, double metres) {
    return metres / kMillisecond_m - static_cast<double>(r.rough) / 1024;
  };
  for (const Row& r : cell_rows) {
    bits.put(field(fraction(r, r.cell->range_m), fine ? 0x1p-29 : 0x1p-24, fine ? 20 : 15), fine ? 20 : 15);
  }
  for (const Row& r : cell_rows) {
    const int width = fine ? 24 : 22;
    bits.put(
        r.cell->phase_m ? field(fraction(r, *r.cell->phase_m), fine ? 0x1p-31 : 0x1p-29, width) : none(width),
        width);
  }
  for (const Row& r : cell_rows) {
    int indicator = lock_time_indicator(r.cell->lock_s, true);
    if (!fine) {
      for (indicator = 0; indicator < 15 && min_lock_ms(indicator + 1, false) <= 1e3 * r.cell->lock_s;)
        ++indicator;
    }
    bits.put(static_cast<std::uint64_t>(indicator), fine ? 10 : 4);
  }
  for (const Row& r : cell_rows) bits.put(r.cell->half_cycle ? 1 : 0, 1);
  for (const Row& r : cell_rows) bits.positive(r.cell->cn0_dbhz, fine ? 0x1p-4 : 1, fine ? 10 : 6);
  if (rates) {
    for (const Row& r : cell_rows)
      bits.put(r.cell->rate_mps ? field(*r.cell->rate_mps - r.rate, 1e-4, 15) : none(15), 15);
  }
  return bits;
}

inline const Eigen::Vector3d kPosition(-3817680.7270, 3562839.5216, 3650159.2407);

inline broadcast::Bits station_message(const Eigen::Vector3d& ecef = kPosition, int station = 7,
                                       std::optional<double> height_m = {}) {
  broadcast::Bits bits;
  bits.put(height_m ? 1006 : 1005, 12).put(static_cast<std::uint64_t>(station), 12).put(0, 10);
  bits.number(ecef.x(), 1e-4, 38).put(0, 2).number(ecef.y(), 1e-4, 38).put(0, 2);
  bits.number(ecef.z(), 1e-4, 38);
  if (height_m) bits.positive(*height_m, 1e-4, 16);
  return bits;
}

inline Cell some_cell(const char* id, std::string_view code, double lock_s = 100) {
  return {satellite(id), code, 22e6, 22e6 + 3, -500.25, lock_s, 45, false, 15};
}

}  // namespace canyon::rtcm
