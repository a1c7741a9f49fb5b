#include "canyon/outputs/encoding/nmea.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/outputs/encoding/observations/fix_codes.hpp"

// NMEA 0183 v4.11. The standard is not free; sentences, talkers, system and signal identifiers are as in
// u-blox F9 HPG 1.32 Interface Description (UBX-22008968), chapter 2, and gpsd's "NMEA Revealed".

namespace canyon::encoding {
namespace {

using geodesy::degrees;
using gnss::System;

constexpr double kKnotsPerMps = 3600.0 / 1852.0;

struct SystemCodes {
  std::string_view talker;
  char system_id;
  char signal_id;           ///< L1 C/A, G1 C/A, E1, B1I, L1 C/A
  int first, last, offset;  ///< satellites with a number, and its offset from the PRN
};

/// The codes are in the order of System.
const SystemCodes& codes(System system) {
  static constexpr std::array<SystemCodes, gnss::kSystemCount> kCodes{{{"GP", '1', '1', 1, 32, 0},
                                                                       {"GL", '2', '1', 1, 32, 64},
                                                                       {"GA", '3', '7', 1, 36, 0},
                                                                       {"GB", '4', '1', 1, 63, 0},
                                                                       {"GQ", '5', '1', 1, 10, 0},
                                                                       {"GP", '1', '1', 20, 51, 13}}};
  return kCodes.at(static_cast<std::size_t>(system));
}

/// NMEA lists SBAS satellites as GPS.
System listed_with(System system) {
  return system == System::SBAS ? System::GPS : system;
}

/// A non-negative number with at least this number of digits.
void append_digits(std::string& text, long number, std::size_t digits) {
  const fmt::format_int written(number);
  text.append(digits - std::min(digits, written.size()), '0').append(written.data(), written.size());
}

/// Whether a system's sentences list a satellite.
bool lists(System system, gnss::SatelliteId id) {
  return listed_with(id.system) == system && nmea_satellite_number(id);
}

/// Talker of the sentences about the solution: the system's own if there is only one system, else GN.
std::string_view solution_talker(const receiver::ReceiverEpoch& seen) {
  std::set<System> systems;
  if (seen.fix.solved())
    for (const auto id : seen.fix.used) systems.insert(listed_with(id.system));
  else
    for (const auto& satellite : seen.satellites) systems.insert(listed_with(satellite.id.system));
  return systems.size() == 1 ? codes(*systems.begin()).talker : std::string_view("GN");
}

/// Date and time of day, UTC: hundredths of a second if exact, else milliseconds.
struct Clock {
  std::string time, date;
};
Clock utc_clock(geodesy::GpsTime t) {
  constexpr std::int64_t kMillisecond = 1'000'000;
  const geodesy::CalendarTime utc = geodesy::utc_from_gps(round_to(t, kMillisecond));
  const auto ms = static_cast<int>(utc.nanosecond / kMillisecond);
  const std::string fraction =
      ms % 10 == 0 ? fmt::format(FMT_COMPILE("{:02d}"), ms / 10) : fmt::format(FMT_COMPILE("{:03d}"), ms);
  return {fmt::format(FMT_COMPILE("{:02d}{:02d}{:02d}.{}"), utc.hour, utc.minute, utc.second, fraction),
          fmt::format(FMT_COMPILE("{:02d}{:02d}{:02d}"), utc.day, utc.month, utc.year % 100)};
}

/// Whole degrees and minutes with 6 decimals (rounding below 1 mm), and the hemisphere.
std::string angle_field(double angle_rad, int degree_digits, char positive, char negative) {
  constexpr std::int64_t kSteps = 1'000'000;  // of a minute
  const std::int64_t total = std::llround(std::abs(degrees(angle_rad)) * 60.0 * kSteps);
  const std::int64_t whole = total / (60 * kSteps);
  const std::int64_t rest = total % (60 * kSteps);
  return fmt::format(FMT_COMPILE("{:0{}d}{:02d}.{:06d},{}"), whole, degree_digits, rest / kSteps,
                     rest % kSteps, angle_rad < 0 && total != 0 ? negative : positive);
}

std::string position_fields(const positioning::Fix& fix) {
  if (!fix.solved()) return ",,,";
  return angle_field(fix.position.latitude_rad, 2, 'N', 'S') + ',' +
         angle_field(fix.position.longitude_rad, 3, 'E', 'W');
}

/// GGA's age of differential data and reference station (0000 to 4095).
std::string correction_fields(const positioning::Fix& fix) {
  if (!corrected(fix.kind())) return ",";
  return (fix.correction_age_s ? fixed(*fix.correction_age_s, 1) : "") + ',' +
         (fix.correction_station ? fmt::format("{:04d}", *fix.correction_station) : "");
}

std::string dop_field(const positioning::Fix& fix, double positioning::Dop::*member) {
  if (!fix.solved() || !fix.dop) return {};
  return fixed((*fix.dop).*member, 2);
}

std::string rmc(const receiver::ReceiverEpoch& seen, std::string_view talker, const Clock& clock) {
  const positioning::Fix& fix = seen.fix;
  std::string speed, course;
  if (fix.solved() && fix.velocity_enu_mps) {
    const double east = fix.velocity_enu_mps->x(), north = fix.velocity_enu_mps->y();
    speed = fixed(std::hypot(east, north) * kKnotsPerMps, 3);
    if (east != 0 || north != 0) course = fixed(wrapped_azimuth_deg(std::atan2(east, north), 2), 2);
  }
  // Navigational status V: Canyon reports no integrity.
  return nmea_sentence(fmt::format(FMT_COMPILE("{}RMC,{},{},{},{},{},{},,,{},V"), talker, clock.time,
                                   codes_of(fix.kind()).nmea_status, position_fields(fix), speed, course,
                                   clock.date, codes_of(fix.kind()).nmea_mode));
}

std::string gga(const simulation::Epoch& epoch, std::string_view talker, const Clock& clock) {
  const positioning::Fix& fix = epoch.observed.fix;
  // Rounded as written, so that the sum of both is the ellipsoidal height; 0 if sea level is unknown.
  const double separation_m = std::round(epoch.geoid_undulation_m * 1e3) / 1e3;
  const std::string height = fix.solved() ? fixed(fix.position.height_m - separation_m, 3) + ",M," +
                                                fixed(separation_m, separation_m == 0 ? 1 : 3) + ",M"
                                          : ",M,,M";
  return nmea_sentence(fmt::format(FMT_COMPILE("{}GGA,{},{},{},{:02d},{},{},{}"), talker, clock.time,
                                   position_fields(fix), codes_of(fix.kind()).gga_quality, used_count(fix),
                                   dop_field(fix, &positioning::Dop::hdop), height, correction_fields(fix)));
}

std::string gsa(const receiver::ReceiverEpoch& seen, std::string_view talker) {
  const positioning::Fix& fix = seen.fix;
  constexpr std::size_t kSlots = 12;
  const std::string dops = dop_field(fix, &positioning::Dop::pdop) + ',' +
                           dop_field(fix, &positioning::Dop::hdop) + ',' +
                           dop_field(fix, &positioning::Dop::vdop);
  const int mode = codes_of(fix.kind()).gsa_mode;
  if (!fix.measured()) return nmea_sentence(fmt::format("{}GSA,A,{},,,,,,,,,,,,,{},", talker, mode, dops));
  std::string text, body;
  for (const System system : gnss::kAllSystems) {
    const auto count_if = [&](const auto& which) {
      return std::count_if(fix.used.begin(), fix.used.end(), which);
    };
    if (count_if([&](auto id) { return listed_with(id.system) == system; }) == 0) continue;
    auto left = static_cast<std::size_t>(count_if([&](auto id) { return lists(system, id); }));
    // Readers add up the satellites of successive GN sentences, but use only the last of a system's own.
    if (left > kSlots) talker = "GN";
    auto next = fix.used.begin();
    do {
      body = fmt::format(FMT_COMPILE("{}GSA,A,{}"), talker, mode);
      for (std::size_t slot = 0; slot < kSlots; ++slot) {
        body += ',';
        if (left == 0) continue;
        while (!lists(system, *next)) ++next;
        append_digits(body, *nmea_satellite_number(*next++), 2);
        --left;
      }
      body += fmt::format(FMT_COMPILE(",{},{}"), dops, codes(system).system_id);
      text += nmea_sentence(body);
    } while (left > 0);
  }
  return text;
}

std::string gst(const receiver::ReceiverEpoch& seen, std::string_view talker, const Clock& clock) {
  const positioning::Fix& fix = seen.fix;
  if (!fix.solved()) return nmea_sentence(fmt::format("{}GST,{},,,,,,,", talker, clock.time));
  double variance = 0;
  std::size_t count = 0;
  for (const auto& satellite : seen.satellites) {
    if (!satellite.used || !satellite.measurement) continue;
    variance += satellite.measurement->sigma_m * satellite.measurement->sigma_m;
    ++count;
  }
  const std::string rms = count > 0 ? fixed(std::sqrt(variance / static_cast<double>(count)), 3) : "";
  // Error ellipse: eigenvalues of the horizontal covariance; its major axis from north, clockwise.
  const Eigen::Matrix3d& p = fix.covariance_enu;
  const double mean = 0.5 * (p(0, 0) + p(1, 1));
  const double spread = std::hypot(0.5 * (p(0, 0) - p(1, 1)), p(0, 1));
  double orientation = degrees(0.5 * std::atan2(2 * p(0, 1), p(1, 1) - p(0, 0)));
  if (orientation < 0) orientation += 180.0;
  return nmea_sentence(fmt::format(FMT_COMPILE("{}GST,{},{},{},{},{},{},{},{}"), talker, clock.time, rms,
                                   fixed(std::sqrt(mean + spread), 3),
                                   fixed(std::sqrt(std::max(0.0, mean - spread)), 3), fixed(orientation, 2),
                                   fixed(std::sqrt(p(1, 1)), 3), fixed(std::sqrt(p(0, 0)), 3),
                                   fixed(std::sqrt(p(2, 2)), 3)));
}

/// HDT and not THS: gpsd and ArduPilot read both, PX4 and nmea_navsat_driver HDT alone.
std::string hdt(const positioning::Fix& fix, std::string_view talker) {
  const std::optional<double> heading = heading_deg(fix, 2);
  return heading ? nmea_sentence(fmt::format("{}HDT,{},T", talker, fixed(*heading, 2))) : "";
}

std::string gsv(const receiver::ReceiverEpoch& seen) {
  constexpr std::size_t kPerSentence = 4;
  std::string text, body;
  for (const System system : gnss::kAllSystems) {
    const auto count = static_cast<std::size_t>(
        std::count_if(seen.satellites.begin(), seen.satellites.end(),
                      [&](const auto& satellite) { return lists(system, satellite.id); }));
    const std::size_t sentences = (count + kPerSentence - 1) / kPerSentence;
    auto next = seen.satellites.begin();
    for (std::size_t i = 0; i < sentences; ++i) {
      body = fmt::format(FMT_COMPILE("{}GSV,{},{},{:02d}"), codes(system).talker, sentences, i + 1, count);
      for (std::size_t k = i * kPerSentence; k < std::min(count, (i + 1) * kPerSentence); ++k, ++next) {
        while (!lists(system, next->id)) ++next;
        append_digits(body += ',', *nmea_satellite_number(next->id), 2);
        append_digits(body += ',', std::clamp(std::lround(degrees(next->elevation_rad)), 0L, 90L), 2);
        append_digits(body += ',', std::lround(wrapped_azimuth_deg(next->azimuth_rad, 0)), 3);
        body += ',';
        // Empty if nothing is tracked or signals have no strength.
        if (next->measurement && next->measurement->cn0_dbhz)
          append_digits(body, std::clamp(std::lround(*next->measurement->cn0_dbhz), 0L, 99L), 2);
      }
      body += {',', codes(system).signal_id};
      text += nmea_sentence(body);
    }
  }
  return text.empty() ? nmea_sentence("GPGSV,1,1,00,1") : text;
}

class Nmea final : public Encoder {
  std::string encode(const simulation::Epoch& epoch) override { return nmea_epoch(epoch); }
};

}  // namespace

std::string nmea_sentence(std::string_view body) {
  unsigned checksum = 0;
  for (const char c : body) checksum ^= static_cast<unsigned char>(c);
  return fmt::format(FMT_COMPILE("${}*{:02X}\r\n"), body, checksum);
}

std::optional<int> nmea_satellite_number(gnss::SatelliteId id) {
  const SystemCodes& system = codes(id.system);
  if (id.number < system.first || id.number > system.last) return std::nullopt;
  return id.number + system.offset;
}

std::string nmea_gga(const simulation::Epoch& epoch) {
  return gga(epoch, solution_talker(epoch.observed), utc_clock(epoch.observed.reported_utc()));
}

std::string nmea_epoch(const simulation::Epoch& epoch) {
  const receiver::ReceiverEpoch& seen = epoch.observed;
  const std::string_view talker = solution_talker(seen);
  const Clock clock = utc_clock(seen.reported_utc());
  return rmc(seen, talker, clock) + gga(epoch, talker, clock) + gsa(seen, talker) + gst(seen, talker, clock) +
         hdt(seen.fix, talker) + gsv(seen);
}

std::unique_ptr<Encoder> encode_nmea(const ReceiverDescription&) {
  return std::make_unique<Nmea>();
}

}  // namespace canyon::encoding
