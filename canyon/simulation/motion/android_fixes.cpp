#include "canyon/simulation/motion/android_fixes.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/rinex/android_log.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"

namespace canyon::simulation {
namespace {

enum FixColumn : std::size_t { Provider, Latitude, Longitude, Altitude, UnixMillis, Mock };
constexpr std::string_view kFixColumns =
    "Provider LatitudeDegrees|Latitude LongitudeDegrees|Longitude AltitudeMeters|Altitude "
    "UnixTimeMillis|(UTC)TimeInMs|utcTimeMillis MockLocation";

/// Best first, with the names that versions of the app have.
constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kProviders{
    {{"GPS", " gps "}, {"fused", " flp fused "}, {"network", " nlp network "}}};

std::optional<std::size_t> provider_of(std::string_view text) {
  for (std::size_t i = 0; i < kProviders.size(); ++i) {
    if (!text.empty() && kProviders[i].second.find(" " + lower_case(text) + " ") != std::string_view::npos)
      return i;
  }
  return std::nullopt;
}

/// Empty where the line has no usable time or place. @param height_m where it has none
std::optional<RecordedPoint> point_of(const rinex::AndroidLog& log, std::optional<double> height_m) {
  const auto latitude_deg = log.number(Latitude), longitude_deg = log.number(Longitude);
  const auto unix_ms = log.integer(UnixMillis);
  if (!is_missing_height(log.text(Altitude))) height_m = log.number(Altitude);
  if (!latitude_deg || !longitude_deg || !unix_ms || !height_m) return std::nullopt;
  constexpr long long kLatest_ms = 9'000'000'000'000;  // the year 2255
  if (*unix_ms <= 0 || *unix_ms > kLatest_ms || std::abs(*height_m) > 1e6) return std::nullopt;
  if (std::abs(*latitude_deg) > 90 || std::abs(*longitude_deg) > 180) return std::nullopt;
  return RecordedPoint{geodesy::gps_from_unix(*unix_ms * 1'000'000),
                       geodesy::Geodetic::from_degrees(*latitude_deg, *longitude_deg, *height_m),
                       log.file().line()};
}

}  // namespace

TrajectoryFile read_android_fixes(const std::filesystem::path& path, const HeightReading& heights) {
  std::array<RecordedPoints, kProviders.size()> points;
  RecordNotes notes(path);
  rinex::AndroidLog log(TextFile::streamed(path), "Fix", kFixColumns);
  while (log.next()) {
    const auto provider = provider_of(log.text(Provider));
    if (!provider) {
      notes.skip(log.file().line(), "fix of a provider that is not known");
      continue;
    }
    if (log.text(Mock) == "1" || lower_case(log.text(Mock)) == "true")
      notes.skip(log.file().line(), "fix that another app has made (mock location)", "it is taken");
    RecordedPoints& of = points[*provider];
    std::optional<double> instead_m;
    if (!heights.needed) instead_m = of.empty() ? 0 : of.back().place.height_m;
    if (const auto point = point_of(log, instead_m)) {
      of.push_back(*point);
    } else {
      notes.bad(log.file().line(),
                "a fix whose time, latitude, longitude or altitude is missing or not valid");
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].empty()) continue;
    notes.require_most(points[0].size() + points[1].size() + points[2].size());
    if (i > 0) notes.say(0, fmt::format("it has no fix of GPS: those of {} are taken", kProviders[i].first));
    if (log.file().cut_warning()) notes.say(*log.file().cut_warning());
    return recorded_trajectory(std::move(points[i]), true, std::move(notes));
  }
  notes.require_most(0);
  throw InputError(
      path, 0, fmt::format("has no usable line of 'Fix' (it has {})", rinex::android_log_kinds_text(path)),
      "switch fixes (locations) on in the app");
}

}  // namespace canyon::simulation
