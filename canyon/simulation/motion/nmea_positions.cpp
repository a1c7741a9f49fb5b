#include "canyon/simulation/motion/nmea_positions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;

double nmea_number(const TextFile& file, std::string_view text, std::string_view what) {
  const std::optional<double> value = parse_double(text);
  if (!value) throw file.error(fmt::format("the {} '{}' is not a number", what, text));
  return *value;
}

/// Throws where a side is neither of two letters.
void check_side(const TextFile& file, std::string_view side, std::string_view letters,
                std::string_view what) {
  if (side.size() == 1 && letters.find(side[0]) != std::string_view::npos) return;
  throw file.error(fmt::format("the {}'s side '{}' is neither {} nor {}", what, side, letters[0], letters[1]),
                   "a decimal comma makes two fields of one: write points");
}

double nmea_angle_deg(const TextFile& file, std::string_view value_text, std::string_view side,
                      std::string_view positive_negative, double limit_deg, std::string_view what) {
  const double value = nmea_number(file, value_text, what);
  const double degrees = std::trunc(value / 100);
  const double minutes = value - 100 * degrees;
  const double angle = degrees + minutes / 60;
  // Without a digit of degrees they are degrees alone, which some programs write: 48.1 would be 0 deg 48.1'.
  const bool no_degrees = value != 0 && limit_deg == 90 && value_text.find('.') < 3;
  if (value < 0 || minutes >= 60 || angle > limit_deg || no_degrees) {
    throw file.error(fmt::format("the {} '{}' is not ddmm.mmmm", what, value_text),
                     "NMEA has degrees and minutes in one number: 4807.038 is 48 deg 7.038'");
  }
  check_side(file, side, positive_negative, what);
  return side[0] == positive_negative[0] ? angle : -angle;
}

/// GGA's quality; of other sentences that of their modes, each of a system: 0 for none.
long long quality_of(const TextFile& file, const NmeaPositionKind& kind, const NmeaSentence& sentence) {
  if (kind.name == "GGA") {
    const std::string_view text = sentence.field(6);
    const auto quality = parse_integer(text);
    if (!quality && !text.empty())
      throw file.error(fmt::format("the quality '{}' is not a number", text), "GGA has 0 to 8");
    return quality.value_or(0);
  }
  const std::string_view mode = sentence.field(kind.mode);
  if (kind.status != 0 && is_void(sentence.field(kind.status), mode)) return 0;
  if (kind.status != 0 && mode.empty()) return 1;  // before version 2.3
  if (mode.find_first_of("ADFPR") != std::string_view::npos) return 1;
  const std::size_t unmeasured = std::string_view("EMS").find(mode.empty() ? ' ' : mode.front());
  return unmeasured == std::string_view::npos ? 0 : 6 + static_cast<long long>(unmeasured);
}

}  // namespace

bool is_void(std::string_view status, std::string_view mode) {
  return (status != "A" && status != "D") || mode == "N";
}

std::int64_t nmea_time_of_day(const TextFile& file, std::string_view text) {
  const auto hour = parse_integer(column(text, 0, 2));
  const auto minute = parse_integer(column(text, 2, 2));
  const auto second = parse_double(column(text, 4, text.size()));
  const bool digits =
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) || c == '.'; });
  if (!digits || !hour || !minute || !second || *hour > 23 || *minute > 59 || *second >= 61) {
    throw file.error(fmt::format("the time '{}' is not hhmmss.ss", text));
  }
  return (*hour * 3600 + *minute * 60) * GpsTime::kNanosecondsPerSecond + std::llround(*second * 1e9);
}

NmeaPosition read_position(const TextFile& file, const NmeaPositionKind& kind, const NmeaSentence& sentence) {
  NmeaPosition result;
  result.checked = sentence.checked;
  result.line = file.line();
  result.quality = quality_of(file, kind, sentence);
  const auto field = [&](std::size_t i) { return i == 0 ? std::string_view() : sentence.field(i); };
  const std::string_view time = field(kind.time), latitude = field(kind.latitude);
  result.fix = result.quality != 0 && !latitude.empty() && !time.empty();
  if (!result.fix) {
    if (const std::string_view side = field(kind.latitude + 1); !side.empty())
      check_side(file, side, "NS", "latitude");
    return result;
  }
  result.no_satellites = parse_integer(field(kind.satellites)) == 0;
  constexpr double kNoDilution = 50;
  result.diluted = parse_double(field(kind.dilution)).value_or(0) >= kNoDilution;
  result.altitude = !is_missing_height(field(kind.altitude));
  result.separation = !is_missing(field(kind.separation));
  for (const std::size_t unit : {std::size_t{10}, std::size_t{12}}) {
    if (kind.name != "GGA" || field(unit).empty() || lower_case(field(unit)) == "m") continue;
    throw file.error(fmt::format("the unit '{}' of a height is not M", field(unit)), "GGA has metres");
  }
  double height_m = result.altitude ? nmea_number(file, field(kind.altitude), "altitude") : 0;
  result.zero_altitude = result.altitude && height_m == 0;
  if (result.separation) {
    const double separation_m = nmea_number(file, field(kind.separation), "geoid separation");
    result.zero_separation = separation_m == 0;
    height_m += separation_m;
  }
  const double latitude_deg = nmea_angle_deg(file, latitude, field(kind.latitude + 1), "NS", 90, "latitude");
  const double longitude_deg =
      nmea_angle_deg(file, field(kind.latitude + 2), field(kind.latitude + 3), "EW", 180, "longitude");
  constexpr std::size_t kDegreesAlone = 3;
  result.short_longitude = longitude_deg != 0 && field(kind.latitude + 2).find('.') <= kDegreesAlone;
  result.place = Geodetic::from_degrees(latitude_deg, longitude_deg, height_m);
  result.time_of_day_ns = nmea_time_of_day(file, time);
  return result;
}

}  // namespace canyon::simulation
