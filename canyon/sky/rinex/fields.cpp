#include "canyon/sky/rinex/fields.hpp"

#include <algorithm>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::rinex {
namespace {

using geodesy::GpsTime;

constexpr int kTaiBeforeGps_s = 19;
constexpr std::string_view kTimeSystems[] = {"GPS", "GAL", "QZS", "IRN", "BDT", "TAI", "UTC", "GLO"};

}  // namespace

bool is_time_system(std::string_view name) {
  return std::find(std::begin(kTimeSystems), std::end(kTimeSystems), name) != std::end(kTimeSystems);
}

std::optional<GpsTime> time_in(std::string_view line, const TimeColumns& columns,
                               std::string_view time_system) {
  std::array<int, 5> fields{};
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto value = parse_integer(column(line, columns[i].begin, columns[i].width));
    if (!value || *value < 0 || *value > 9999) return std::nullopt;
    fields[i] = static_cast<int>(*value);
  }
  auto& [year, month, day, hour, minute] = fields;
  if (year < 100) year += year < 80 ? 2000 : 1900;
  const auto seconds = parse_double(column(line, columns[5].begin, columns[5].width));
  // Converters that round print 60.0000000; a leap second of UTC is also 60.
  if (!seconds || !(*seconds >= 0 && *seconds < 61) || year < 1980 || year > 2200) return std::nullopt;
  geodesy::CalendarTime c;
  c.year = year, c.month = month, c.day = day, c.hour = hour, c.minute = minute, c.second = 0;
  try {
    if (time_system == "GLO" || time_system == "UTC") return geodesy::gps_from_utc(c) + *seconds;
    const int offset_s = time_system == "BDT"   ? geodesy::kBdtSecondsOffset
                         : time_system == "TAI" ? -kTaiBeforeGps_s
                                                : 0;
    return geodesy::gps_from_calendar(c) + *seconds + std::chrono::seconds(offset_s);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace canyon::rinex
