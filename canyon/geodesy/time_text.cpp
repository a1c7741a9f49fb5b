#include "canyon/geodesy/time_text.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::geodesy {

bool names_time_scale(std::string_view text) {
  constexpr std::string_view kDate = "2019-04-28";
  text = trim(text);
  return text.size() > kDate.size() && text.find_first_of("ZUG+-", kDate.size()) != std::string_view::npos;
}

GpsTime parse_simulated_time(std::string_view text) {
  text = trim(text);
  const InputError out_of_range(fmt::format("the time '{}' is out of range", text),
                                "times run from 1980-01-06 to 2171-08-31, the GPS weeks 0 to 9999");
  // Checks the year before parse_time(), which has bounds of its own.
  const std::optional<long long> year = parse_integer(column(text, 0, 4));
  if (column(text, 4, 1) == "-" && year && (*year < 1980 || *year > 2171)) throw out_of_range;
  const GpsTime t = parse_time(text);
  if (t < GpsTime{} || t.week() > 9999) throw out_of_range;
  return t;
}

}  // namespace canyon::geodesy
