#include "canyon/sky/rinex/navigation_record.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/rinex/fields.hpp"

namespace canyon::rinex {
namespace {

using geodesy::GpsTime;

constexpr std::size_t kFieldWidth = 19;  // D19.12
constexpr double kDay = 86'400;
constexpr double kWeek = 604'800;
// Both 9.999e8 and 0.9999e9 mean "unknown" in transmission times and in RINEX 3.05's GLONASS fields.
constexpr double kUnknown = 9e8;

/// Fields checked against the range of the ICD's field, rounded up.
class CheckedFields : public RecordFields {
 public:
  using RecordFields::RecordFields;

  /// `otherwise` if blank.
  [[nodiscard]] double optional(std::size_t i, double otherwise = 0) const {
    return at(i).value_or(otherwise);
  }
  [[nodiscard]] double optional(std::size_t i, const char* what, double bound) const {
    return in_range(optional(i), what, -bound, bound);
  }
  [[nodiscard]] double required(std::size_t i, const char* what, double bound) const {
    return required(i, what, -bound, bound);
  }
  [[nodiscard]] double required(std::size_t i, const char* what, double low, double high) const {
    const auto value = at(i);
    if (!value) throw DamagedRecord{fmt::format("{} is missing", what)};
    return in_range(*value, what, low, high);
  }
  /// A whole number within [low, high]; 0 if blank.
  [[nodiscard]] int integer(std::size_t i, const char* what, double low, double high) const {
    const double value = in_range(optional(i), what, low, high);
    if (value != std::floor(value))
      throw DamagedRecord{fmt::format("{} {} is not a whole number", what, value)};
    return static_cast<int>(value);
  }

 private:
  static double in_range(double value, const char* what, double low, double high) {
    if (value < low || value > high)
      throw DamagedRecord{fmt::format("{} {:g} is outside {:g} to {:g}", what, value, low, high)};
    return value;
  }
};

/// Fortran omits the letter of an exponent of three digits: "0.499063314480-269".
std::optional<double> parse_fortran(std::string_view text) {
  if (const auto value = parse_double(text)) return value;
  text = trim(text);
  const std::size_t sign = text.find_last_of("+-");
  if (sign == std::string_view::npos || sign == 0 || text[sign - 1] < '0' || text[sign - 1] > '9') return {};
  return parse_double(std::string(text.substr(0, sign)) + "e" + std::string(text.substr(sign)));
}

/// The state vector of a GLONASS or SBAS record.
/// @param largest limit of each component's position, velocity and acceleration [km, s]
template <typename Ephemeris>
void read_state(const CheckedFields& f, Ephemeris& e, const std::array<double, 3>& largest) {
  constexpr std::array<const char*, 3> kAxis{"X", "Y", "Z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t at = 3 + 4 * axis;
    const auto metres = [&](std::size_t i, const char* what) {
      return 1e3 * f.required(at + i, fmt::format("{} {}", what, kAxis[axis]).c_str(), largest[i]);
    };
    e.position_m[axis] = metres(0, "position");
    e.velocity_mps[axis] = metres(1, "velocity");
    e.acceleration_mps2[axis] = metres(2, "acceleration");
  }
  if (std::hypot(e.position_m[0], e.position_m[1], e.position_m[2]) < geodesy::kSemiMajorAxis)
    throw DamagedRecord{"the position is inside the Earth"};
}

/// The instant closest to `near` that has `seconds` in its cycle of `period` seconds (week or day).
GpsTime closest_in_cycle(GpsTime near, double seconds, std::int64_t period_s) {
  const std::int64_t period = period_s * GpsTime::kNanosecondsPerSecond;
  const std::int64_t phase = std::llround(std::fmod(seconds, static_cast<double>(period_s)) * 1e9);
  std::int64_t difference = (phase - near.nanoseconds() % period) % period;
  if (difference > period / 2) difference -= period;
  if (difference < -period / 2) difference += period;
  return near + std::chrono::nanoseconds(difference);
}

/// Whether the flags added to Bn in RINEX 3.05 and later (table A10, broadcast orbit 4) mark it as unfit:
/// status bits 7 and 8 are 01 for GLONASS-M and K, the only ones with l(3), bit 2 of the health flags. Bit 1
/// means that bit 0 is the almanac's Cn; a satellite that is out of order in Cn (0) must not be used for any
/// Bn (ICD GLONASS 5.1, table 5.1).
bool calls_unfit(const CheckedFields& f) {
  const double flags = f.optional(18), status = f.optional(15, 1 << 7);
  if (!(flags > 0 && flags < 8)) return false;
  const int bits = static_cast<int>(flags);
  const bool has_l3 = !(status >= 0 && status < 512) || (static_cast<int>(status) >> 7) == 1;
  return (has_l3 && (bits & 0b100) != 0) || (bits & 0b011) == 0b010;
}

}  // namespace

GpsTime parse_epoch(std::string_view line, RecordLayout layout) {
  const TimeColumns columns = layout == RecordLayout::kVersion2
                                  ? TimeColumns{{{2, 3}, {5, 3}, {8, 3}, {11, 3}, {14, 3}, {17, 5}}}
                                  : TimeColumns{{{4, 4}, {8, 3}, {11, 3}, {14, 3}, {17, 3}, {20, 3}}};
  if (const auto epoch = time_in(line, columns, "GPS")) return *epoch;
  const std::size_t begin = columns.front().begin, end = columns.back().begin + columns.back().width;
  throw DamagedRecord{
      fmt::format("the epoch '{}' is not a date and a time", column(line, begin, end - begin))};
}

std::optional<double> RecordFields::at(std::size_t i) const {
  // The epoch replaces the first line's first value.
  const std::size_t line = (i + 1) / 4, index = (i + 1) % 4;
  if (line >= lines_.size()) return std::nullopt;
  const std::size_t indent = layout_ == RecordLayout::kVersion2 ? 3 : 4;
  const std::string_view field = column(lines_[line], indent + index * kFieldWidth, kFieldWidth);
  if (trim(field).empty()) return std::nullopt;
  const auto value = parse_fortran(field);
  if (!value)
    throw DamagedRecord{fmt::format("'{}' in line {} of the record is not a number", trim(field), line + 1)};
  return value;
}

void require_indentation(const std::vector<std::string_view>& lines, RecordLayout layout) {
  const std::size_t indent = layout == RecordLayout::kVersion2 ? 3 : 4;
  for (std::size_t line = 1; line < lines.size(); ++line)
    if (!trim(column(lines[line], 0, indent)).empty())
      throw DamagedRecord{fmt::format("line {} of the record begins in its indentation", line + 1)};
}

std::pair<int, int> satellite_numbers(gnss::System system) {
  // GLONASS: 24 slots and spares; QZSS: PRN 193 to 202; SBAS: PRN 120 to 158.
  constexpr std::array<std::pair<int, int>, gnss::kAllSystems.size()> kNumbers{
      {{1, 32}, {1, 27}, {1, 36}, {1, 63}, {1, 10}, {20, 58}}};
  return kNumbers[static_cast<std::size_t>(system)];
}

std::size_t line_count(gnss::System system) {
  return system == gnss::System::GLONASS || system == gnss::System::SBAS ? 4 : 8;
}

gnss::KeplerEphemeris decode_kepler(gnss::SatelliteId id, const std::vector<std::string_view>& lines,
                                    RecordLayout layout, MessageName message) {
  const CheckedFields f(lines, layout);
  const GpsTime toc = parse_epoch(lines.front(), layout);  // on the system's scale until the end
  constexpr double kTwoPi = 2 * geodesy::kPi;

  gnss::KeplerEphemeris e;
  e.id = id;
  e.af0 = f.required(0, "clock bias af0", 0.07);
  e.af1 = f.required(1, "clock drift af1", 1e-7);
  e.af2 = f.required(2, "clock drift rate af2", 1e-12);
  e.iode = f.integer(3, "issue of data", 0, 4095);
  e.crs = f.required(4, "Crs", 1e4);
  e.mean_motion_difference = f.required(5, "delta n", 1e-6);
  e.mean_anomaly = f.required(6, "M0", kTwoPi);
  e.cuc = f.required(7, "Cuc", 1e-3);
  e.eccentricity = f.required(8, "eccentricity", 0, 0.5);
  e.cus = f.required(9, "Cus", 1e-3);
  e.sqrt_a = f.required(10, "square root of the semi-major axis", 2530, 8192);
  const double toes = f.required(11, "toe", 0, kWeek);  // some write the week's end so
  e.cic = f.required(12, "Cic", 1e-3);
  e.right_ascension = f.required(13, "OMEGA0", kTwoPi);
  e.cis = f.required(14, "Cis", 1e-3);
  e.inclination = f.required(15, "i0", kTwoPi / 2);
  e.crc = f.required(16, "Crc", 1e4);
  e.argument_of_perigee = f.required(17, "omega", kTwoPi);
  e.right_ascension_rate = f.required(18, "OMEGA DOT", 1e-5);
  e.inclination_rate = f.required(19, "IDOT", 1e-6);
  e.data_sources =
      f.integer(20, id.system == gnss::System::Galileo ? "data sources" : "codes on L2", 0, 65535);
  if (id.system != gnss::System::Galileo && id.system != gnss::System::BeiDou)
    e.l2p_flag = f.integer(22, "L2 P flag", 0, 9);
  e.accuracy_m = f.optional(23, "accuracy", 1e5);
  e.health = f.integer(24, "health", 0, 65535);
  e.group_delay[0] = f.optional(25, "group delay", 1e-6);
  const double transmission = f.optional(27, kUnknown);
  if (id.system == gnss::System::GPS || id.system == gnss::System::QZSS) {
    e.iodc = f.integer(26, "IODC", 0, 4095);
    e.fit_interval_h = f.optional(28, "fit interval", 255);
  } else {
    e.group_delay[1] = f.optional(26, "group delay", 1e-6);
    if (id.system == gnss::System::BeiDou) e.iodc = f.integer(28, "AODC", 0, 4095);
  }

  const GpsTime toe = closest_in_cycle(toc, toes, GpsTime::kSecondsPerWeek);
  constexpr double kMaxFit_s = 4 * 3600;
  if (std::abs(toe - toc) > kMaxFit_s)
    throw DamagedRecord{fmt::format("clock epoch and toe are {:.1f} h apart", std::abs(toe - toc) / 3600)};
  // Below 0 or beyond a week if the message was sent in a week adjacent to that of toe.
  GpsTime sent = toe;
  if (std::abs(transmission) < 2 * kWeek)
    sent = closest_in_cycle(toe, transmission, GpsTime::kSecondsPerWeek);

  if (message == MessageName::kInav && (e.data_sources & 0x300) == 0) e.data_sources |= 1 << 9;
  if (message == MessageName::kFnav && (e.data_sources & 0x300) == 0) e.data_sources |= 1 << 8;

  const std::chrono::seconds to_gpst(id.system == gnss::System::BeiDou ? geodesy::kBdtSecondsOffset : 0);
  e.toc = toc + to_gpst;
  e.toe = toe + to_gpst;
  e.transmission = sent + to_gpst;
  return e;
}

gnss::SignalDelays decode_signal_delays(gnss::SatelliteId id, const std::vector<std::string_view>& lines,
                                        std::string_view type) {
  const bool gps = id.system != gnss::System::BeiDou;
  const std::size_t needed = (gps && type == "CNAV") || type == "CNV3" ? 9 : 10;
  if (lines.size() != needed) {
    throw DamagedRecord{
        fmt::format("{} record of {} has {} lines instead of {}", type, to_string(id), lines.size(), needed)};
  }
  const CheckedFields f(lines, RecordLayout::kVersion3);
  gnss::SignalDelays delays;
  delays.id = id;
  delays.toc = parse_epoch(lines.front(), RecordLayout::kVersion3);
  if (!gps) delays.toc = delays.toc + std::chrono::seconds(geodesy::kBdtSecondsOffset);
  delays.group_delay_s.fill(std::numeric_limits<double>::infinity());
  constexpr double kMax_s = 1e-6;
  // Twelve or thirteen bits of 2^-34 or 2^-35 s; blank if the satellite sends "not known".
  const auto set = [&](std::string_view name, std::size_t tgd, std::optional<std::size_t> correction) {
    const bool blank = !f.at(tgd) || (correction && !f.at(*correction));
    const auto all = gnss::signals_of(id.system);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i].name != name) continue;
      delays.group_delay_s[i] =
          blank ? std::numeric_limits<double>::quiet_NaN()
                : f.required(tgd, "TGD", kMax_s) - (correction ? f.required(*correction, "ISC", kMax_s) : 0);
    }
  };
  if (gps) {
    set("L1CA", 25, 27);
    set("L2C", 25, 28);
    set("L5", 25, 30);                       // the pilot, Q5
    if (type == "CNV2") set("L1C", 25, 32);  // the pilot
  } else if (type == "CNV3") {
    set("B2b", 30, std::nullopt);
  } else {
    set("B1C", 29, std::nullopt);
    set("B2a", 30, std::nullopt);
  }
  return delays;
}

gnss::GlonassEphemeris decode_glonass(gnss::SatelliteId id, const std::vector<std::string_view>& lines,
                                      RecordLayout layout) {
  const CheckedFields f(lines, layout);
  const GpsTime utc = parse_epoch(lines.front(), layout);  // UTC, its date treated as GPST

  gnss::GlonassEphemeris e;
  e.id = id;
  e.clock_bias_s = f.required(0, "clock bias -TauN", 0.01);
  e.frequency_bias = f.required(1, "frequency bias GammaN", 1e-8);
  read_state(f, e, {3e4, 10, 1e-7});
  e.health = f.integer(6, "health", 0, 255);
  e.channel = f.integer(10, "frequency number", -7, 255);
  if (e.channel > 128) e.channel -= 256;  // some receivers write the byte unsigned
  if (e.channel < -7 || e.channel > 13)
    throw DamagedRecord{fmt::format("frequency number {} is outside -7 to 13", e.channel)};
  e.age_days = f.optional(14, "age of operation", 1000);
  // RINEX 3.05 and later, a fifth line: status, L2 minus L1 delay, accuracy index, health flags.
  if (std::abs(f.optional(16)) < kUnknown) e.group_delay_difference_s = f.optional(16, "group delay", 1e-6);
  if (e.health == 0 && calls_unfit(f)) e.health = 1;

  // MessageName frame time: seconds of the UTC day (RINEX 2) or week (RINEX 3); the day suffices, because a
  // message is sent within hours of its tb.
  GpsTime sent = utc;
  const double frame_time = f.optional(2, kUnknown);
  if (std::abs(frame_time) < 2 * kWeek)
    sent = closest_in_cycle(utc, frame_time, static_cast<std::int64_t>(kDay));
  // Leap seconds from Canyon's own table: a header may lack them, have BeiDou's count, or be years newer.
  e.toe = geodesy::gps_from_utc(geodesy::calendar_from_gps(utc));
  e.transmission = e.toe + std::chrono::nanoseconds(sent.nanoseconds() - utc.nanoseconds());
  return e;
}

gnss::SbasEphemeris decode_sbas(gnss::SatelliteId id, const std::vector<std::string_view>& lines,
                                RecordLayout layout) {
  const CheckedFields f(lines, layout);
  gnss::SbasEphemeris e;
  e.id = id;
  e.toe = e.transmission = parse_epoch(lines.front(), layout);
  // More than message 9 can represent (RTCA DO-229 A.4.4.11).
  e.clock_bias_s = f.required(0, "clock bias aGf0", 1e-5);
  e.clock_drift = f.required(1, "clock drift aGf1", 1e-8);
  read_state(f, e, {4.5e4, 1, 1e-4});
  e.health = f.integer(6, "health", 0, 255);
  e.accuracy_m = f.optional(10, "accuracy", 1e5);
  e.iodn = f.integer(14, "issue of data", 0, 255);
  const double sent = f.optional(2, kUnknown);
  if (std::abs(sent) < 2 * kWeek) e.transmission = closest_in_cycle(e.toe, sent, GpsTime::kSecondsPerWeek);
  return e;
}

}  // namespace canyon::rinex
