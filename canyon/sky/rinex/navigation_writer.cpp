#include "canyon/sky/rinex/navigation_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"

// RINEX 3.04, tables A5 to A16. Values have 13 significant digits: values read from RINEX are restored
// exactly, a computed orbit (nominal constellations) within 0.1 mm and 1e-15 s of the original.
namespace canyon::rinex {
namespace {

using geodesy::GpsTime;

/// D19.12.
std::string field(double value, gnss::SatelliteId id) {
  if (!std::isfinite(value) || std::abs(value) > 9e98)
    throw InputError(fmt::format("an ephemeris of {} has {}, invalid in RINEX", to_string(id), value));
  if (std::abs(value) < 1e-99) value = std::copysign(0.0, value);  // no space for a third exponent digit
  return fmt::format("{:19.12E}", value);
}

/// D12.4.
std::string short_field(double value) {
  return fmt::format("{:12.4E}", value);
}

std::string header_line(std::string_view content, std::string_view label) {
  return fmt::format("{:<60.60}{:<20}\n", content, label);
}

std::string epoch(gnss::SatelliteId id, const geodesy::CalendarTime& c) {
  if (c.nanosecond != 0 || c.second == 60) {
    throw InputError(fmt::format(
        "RINEX needs whole seconds, but an ephemeris of {} has another reference time", to_string(id)));
  }
  return fmt::format("{} {:04d} {:02d} {:02d} {:02d} {:02d} {:02d}", to_string(id), c.year, c.month, c.day,
                     c.hour, c.minute, c.second);
}

std::string format_record(const gnss::KeplerEphemeris& e) {
  const bool beidou = e.id.system == gnss::System::BeiDou, galileo = e.id.system == gnss::System::Galileo;
  const std::chrono::seconds offset(beidou ? geodesy::kBdtSecondsOffset : 0);
  const GpsTime toe = e.toe - offset;
  const int week = toe.week();
  // May be below 0 or beyond a week: it counts from the week of the record.
  const double sent = static_cast<double>((e.transmission - offset).nanoseconds() -
                                          GpsTime::kNanosecondsPerWeek * std::int64_t{week}) *
                      1e-9;
  std::string text = epoch(e.id, geodesy::calendar_from_gps(e.toc - offset));
  const auto line = [&](std::initializer_list<double> values) {
    for (const double value : values) text += field(value, e.id);
    text += "\n";
  };
  line({e.af0, e.af1, e.af2});
  const auto next = [&](std::initializer_list<double> values) {
    text += "    ";
    line(values);
  };
  next({static_cast<double>(e.iode), e.crs, e.mean_motion_difference, e.mean_anomaly});
  next({e.cuc, e.eccentricity, e.cus, e.sqrt_a});
  next({toe.seconds_of_week(), e.cic, e.right_ascension, e.cis});
  next({e.inclination, e.crc, e.argument_of_perigee, e.right_ascension_rate});
  next({e.inclination_rate, static_cast<double>(e.data_sources),
        static_cast<double>(beidou ? week - geodesy::kBdtWeekOffset : week),
        static_cast<double>(e.l2p_flag)});
  next({e.accuracy_m, static_cast<double>(e.health), e.group_delay[0],
        beidou || galileo ? e.group_delay[1] : static_cast<double>(e.iodc)});
  if (galileo)
    next({sent});
  else
    next({sent, beidou ? static_cast<double>(e.iodc) : e.fit_interval_h});
  return text;
}

/// A record of a state vector.
/// @param clock the first line; @param last the last value of each other line
template <typename Ephemeris>
std::string format_state(const Ephemeris& e, const geodesy::CalendarTime& reference,
                         const std::array<double, 3>& clock, const std::array<double, 3>& last) {
  std::string text = epoch(e.id, reference);
  for (const double value : clock) text += field(value, e.id);
  text += "\n";
  for (std::size_t i = 0; i < 3; ++i) {
    text += "    ";
    for (const double value :
         {e.position_m[i] / 1e3, e.velocity_mps[i] / 1e3, e.acceleration_mps2[i] / 1e3, last[i]})
      text += field(value, e.id);
    text += "\n";
  }
  return text;
}

std::string format_record(const gnss::GlonassEphemeris& e) {
  const geodesy::CalendarTime utc = geodesy::utc_from_gps(e.toe);
  // Seconds of the UTC week.
  const GpsTime toe_utc = geodesy::gps_from_calendar(utc);
  const double sent = (toe_utc + std::chrono::nanoseconds(e.transmission.nanoseconds() - e.toe.nanoseconds()))
                          .seconds_of_week();
  return format_state(e, utc, {e.clock_bias_s, e.frequency_bias, sent},
                      {static_cast<double>(e.health), static_cast<double>(e.channel), e.age_days});
}

std::string format_record(const gnss::SbasEphemeris& e) {
  return format_state(e, geodesy::calendar_from_gps(e.toe),
                      {e.clock_bias_s, e.clock_drift, e.transmission.seconds_of_week()},
                      {static_cast<double>(e.health), e.accuracy_m, static_cast<double>(e.iodn)});
}

}  // namespace

std::string format_rinex_navigation(const gnss::NavigationData& data) {
  std::string text = header_line("     3.04           N: GNSS NAV DATA    M: MIXED", "RINEX VERSION / TYPE");
  // No date, so that the same sky gives the same bytes.
  text += header_line("Canyon", "PGM / RUN BY / DATE");
  if (data.galileo_nequick) {
    std::string line = "GAL  ";
    for (const double a : *data.galileo_nequick) line += short_field(a);
    text += header_line(line + short_field(0), "IONOSPHERIC CORR");
  }
  for (const auto& [system, k] : data.klobuchar) {
    const char* key = system == gnss::System::GPS ? "GPS" : system == gnss::System::BeiDou ? "BDS" : "QZS";
    for (const bool alpha : {true, false}) {
      std::string line = fmt::format("{}{} ", key, alpha ? 'A' : 'B');
      for (const double value : alpha ? k.alpha : k.beta) line += short_field(value);
      text += header_line(line, "IONOSPHERIC CORR");
    }
  }
  if (data.leap_seconds) text += header_line(fmt::format("{:6d}", *data.leap_seconds), "LEAP SECONDS");
  text += header_line("", "END OF HEADER");

  std::vector<std::pair<std::tuple<gnss::SatelliteId, GpsTime, GpsTime>, std::string>> records;
  for (const gnss::KeplerEphemeris& e : data.kepler)
    records.emplace_back(std::make_tuple(e.id, e.toe, e.transmission), format_record(e));
  for (const gnss::GlonassEphemeris& e : data.glonass)
    records.emplace_back(std::make_tuple(e.id, e.toe, e.transmission), format_record(e));
  for (const gnss::SbasEphemeris& e : data.sbas)
    records.emplace_back(std::make_tuple(e.id, e.toe, e.transmission), format_record(e));
  std::stable_sort(records.begin(), records.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& record : records) text += record.second;
  return text;
}

void write_rinex_navigation(const std::filesystem::path& path, const gnss::NavigationData& data) {
  const std::string text = format_rinex_navigation(data);
  write_file(path, text);
}

}  // namespace canyon::rinex
