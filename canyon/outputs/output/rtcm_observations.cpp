// Declared in canyon/outputs/output/rtcm.hpp.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/output/rtcm.hpp"
#include "canyon/receiver/rtcm/frames.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::output::rtcm {

using broadcast::Bits;
using canyon::rtcm::kMillisecond_m;
using canyon::rtcm::kMsmSystems;
using geodesy::GpsTime;
using gnss::System;

namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr std::size_t kMostCells = 64;
constexpr int kRoughSteps = 1024;   ///< of a millisecond: DF398
constexpr int kNoRoughRange = 255;  ///< ms, DF397

/// A signed field's value, or its mark for "none" (the most negative one) beyond its range.
std::int64_t or_none(double value, int width) {
  const std::int64_t none = -(std::int64_t{1} << (width - 1));
  const double whole = std::round(value);
  return std::abs(whole) < static_cast<double>(-none) ? static_cast<std::int64_t>(whole) : none;
}
std::int64_t none(int width) {
  return or_none(std::ldexp(1.0, width), width);
}

/// DF004, DF416 with DF034, DF248, DF427, DF428: 30 bits.
std::uint64_t epoch_time(System system, GpsTime tag) {
  if (system == System::BeiDou) tag = tag - std::chrono::seconds(geodesy::kBdtSecondsOffset);
  if (system != System::GLONASS)
    return static_cast<std::uint64_t>(tag.nanosecond_of_week() / kMillisecond_ns);
  geodesy::CalendarTime moscow = geodesy::glonass_from_gps(tag);
  moscow.second = std::min(moscow.second, 59);
  // Milliseconds of a week that begins on Sunday, as GPS's does.
  const std::int64_t ms = geodesy::gps_from_calendar(moscow).nanosecond_of_week() / kMillisecond_ns;
  constexpr std::int64_t kDay_ms = 86'400'000;
  return static_cast<std::uint64_t>(ms / kDay_ms) << 27 | static_cast<std::uint64_t>(ms % kDay_ms);
}

}  // namespace

struct Observations::Satellite {
  struct Cell {
    int signal = 0;  ///< in the mask
    double range_m = 0;
    std::optional<double> phase_range_m, rate_mps;
    double lock_s = 0, cn0_dbhz = 0;
  };
  int number = 0;          ///< in the mask
  unsigned extended = 0;   ///< DF419: of GLONASS the frequency channel
  std::int64_t rough = 0;  ///< range [1/1024 ms]
  std::int64_t rough_mps = none(14);
  std::vector<Cell> cells;  ///< by signal
};

std::vector<Observations::Satellite> Observations::satellites_of(const RawEpoch& raw, System system) const {
  std::vector<Satellite> satellites;
  for (auto o = raw.observations.begin(); o != raw.observations.end();) {
    const gnss::SatelliteId id = o->id;
    if (id.system != system) {
      ++o;
      continue;
    }
    Satellite satellite;
    satellite.number = canyon::rtcm::mask_number(id);
    for (; o != raw.observations.end() && o->id == id; ++o) {
      const positioning::Measurement& m = *o->measurement;
      const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
      Satellite::Cell cell;
      cell.signal = o->signal->msm;
      cell.range_m = o->pseudorange_m;
      if (o->carrier_phase_cycles) cell.phase_range_m = *o->carrier_phase_cycles * wavelength_m;
      cell.lock_s = o->locked_s;
      if (o->doppler_hz) cell.rate_mps = -*o->doppler_hz * wavelength_m;
      cell.cn0_dbhz = m.cn0_dbhz.value_or(0);
      if (cell.signal != 0) satellite.cells.push_back(cell);
    }
    if (satellite.cells.empty() || satellite.number == 0) continue;
    const auto [low, high] =
        std::minmax_element(satellite.cells.begin(), satellite.cells.end(),
                            [](const auto& a, const auto& b) { return a.range_m < b.range_m; });
    const double middle_ms = (low->range_m + high->range_m) / 2 / kMillisecond_m;
    if (!(middle_ms >= 0 && middle_ms < kNoRoughRange - 1)) continue;
    satellite.rough = std::llround(middle_ms * kRoughSteps);
    // Signals that came by different ways differ by more than fine rates hold: the middle leaves out the
    // fewest.
    double least_mps = HUGE_VAL, most_mps = -HUGE_VAL;
    for (const auto& cell : satellite.cells) {
      if (!cell.rate_mps) continue;
      least_mps = std::min(least_mps, *cell.rate_mps);
      most_mps = std::max(most_mps, *cell.rate_mps);
    }
    satellite.rough_mps = or_none((least_mps + most_mps) / 2, 14);
    std::sort(satellite.cells.begin(), satellite.cells.end(),
              [](const auto& a, const auto& b) { return a.signal < b.signal; });
    if (system == System::GLONASS) {
      const auto channel = glonass_channels_.find(id);
      const bool known = channel != glonass_channels_.end() && channel->second <= 6;
      satellite.extended = known ? static_cast<unsigned>(channel->second + 7) : 15;
    }
    satellites.push_back(std::move(satellite));
  }
  return satellites;
}

std::vector<Bits> Observations::messages(const receiver::ReceiverEpoch& seen, std::span<const int> numbers) {
  const RawEpoch raw = observations_.next(seen);
  const GpsTime tag = raw.tag;
  // A message holds 64 cells at most, counting those of signals that a satellite lacks.
  struct Part {
    int number;
    System system;
    std::set<int> signals;
    std::vector<Satellite> satellites;
  };
  std::vector<Part> parts;
  for (const int number : numbers) {
    const System system = kMsmSystems.at(static_cast<std::size_t>(number - 1070) / 10);
    std::set<int> signals;
    std::vector<Satellite> all = satellites_of(raw, system);
    for (const Satellite& satellite : all) {
      for (const auto& cell : satellite.cells) signals.insert(cell.signal);
    }
    const std::size_t room = signals.empty() ? 1 : kMostCells / signals.size();
    for (std::size_t i = 0; i < all.size(); i += room) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(i);
      const auto end = all.begin() + static_cast<std::ptrdiff_t>(std::min(i + room, all.size()));
      parts.push_back(
          {number, system, signals, {std::make_move_iterator(begin), std::make_move_iterator(end)}});
    }
  }

  std::vector<Bits> messages;
  for (const Part& part : parts) {
    const bool precise = part.number % 10 == 7;  // MSM7, else MSM4
    Bits bits;
    bits.put(static_cast<std::uint64_t>(part.number), 12).put(0, 12).put(epoch_time(part.system, tag), 30);
    bits.put(messages.size() + 1 < parts.size() ? 1 : 0, 1);  // more of this epoch follow
    bits.put(0,
             3 + 7 + 2 + 2 + 1 + 3);  // IODS, reserved, steering, external clock, smoothing and its interval
    std::uint64_t satellite_mask = 0, signal_mask = 0;
    for (const Satellite& satellite : part.satellites)
      satellite_mask |= std::uint64_t{1} << (64 - satellite.number);
    for (const int signal : part.signals) signal_mask |= std::uint64_t{1} << (32 - signal);
    bits.put(satellite_mask, 64).put(signal_mask, 32);
    for (const Satellite& satellite : part.satellites) {
      for (const int signal : part.signals) {
        const bool has = std::any_of(satellite.cells.begin(), satellite.cells.end(),
                                     [signal](const auto& cell) { return cell.signal == signal; });
        bits.put(has ? 1 : 0, 1);
      }
    }
    const auto each_satellite = [&](const auto& put) {
      for (const Satellite& satellite : part.satellites) put(satellite);
    };
    each_satellite(
        [&](const Satellite& s) { bits.put(static_cast<std::uint64_t>(s.rough / kRoughSteps), 8); });
    if (precise) each_satellite([&](const Satellite& s) { bits.put(s.extended, 4); });
    each_satellite(
        [&](const Satellite& s) { bits.put(static_cast<std::uint64_t>(s.rough % kRoughSteps), 10); });
    if (precise) each_satellite([&](const Satellite& s) { bits.count(s.rough_mps, 14); });
    const auto each_cell = [&](const auto& put) {
      for (const Satellite& satellite : part.satellites) {
        const double rough_m = static_cast<double>(satellite.rough) / kRoughSteps * kMillisecond_m;
        for (const auto& cell : satellite.cells) put(satellite, cell, rough_m);
      }
    };
    using Cell = Satellite::Cell;
    const int code_bits = precise ? 20 : 15, phase_bits = precise ? 24 : 22;
    each_cell([&](const Satellite&, const Cell& c, double rough_m) {
      const double fine_ms = (c.range_m - rough_m) / kMillisecond_m;
      bits.count(or_none(std::ldexp(fine_ms, precise ? 29 : 24), code_bits), code_bits);
    });
    each_cell([&](const Satellite&, const Cell& c, double rough_m) {
      const double fine_ms = (c.phase_range_m.value_or(HUGE_VAL) - rough_m) / kMillisecond_m;
      bits.count(or_none(std::ldexp(fine_ms, precise ? 31 : 29), phase_bits), phase_bits);
    });
    each_cell([&](const Satellite&, const Cell& c, double) {
      bits.put(static_cast<std::uint64_t>(canyon::rtcm::lock_time_indicator(c.lock_s, precise)),
               precise ? 10 : 4);
    });
    each_cell([&](const Satellite&, const Cell&, double) { bits.put(0, 1); });  // no half cycles
    each_cell([&](const Satellite&, const Cell& c, double) {
      bits.positive(c.cn0_dbhz, precise ? 1.0 / 16 : 1, precise ? 10 : 6);
    });
    if (precise) {
      each_cell([&](const Satellite& s, const Cell& c, double) {
        const bool has = c.rate_mps && s.rough_mps != none(14);
        bits.count(has ? or_none((*c.rate_mps - static_cast<double>(s.rough_mps)) * 1e4, 15) : none(15), 15);
      });
    }
    messages.push_back(std::move(bits));
  }
  return messages;
}

}  // namespace canyon::output::rtcm
