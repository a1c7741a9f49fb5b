#include "canyon/simulation/scenario_sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;
using geodesy::radians;

std::string key_list(const std::vector<std::string>& keys) {
  std::string list;
  for (std::size_t i = 0; i < keys.size(); ++i)
    list += (i == 0 ? "" : i + 1 == keys.size() ? " or " : ", ") + keys[i];
  return list;
}

void read_frozen(YamlSection& section, SkyConfig& config) {
  const auto azimuths = section.numbers("satAzimuth", {-1e6, 1e6});
  const auto elevations = section.numbers("satElevation", {-1e6, 1e6});
  if (!azimuths || !elevations) {
    throw section.section_error("frozen needs satAzimuth and satElevation", "give lists of radians");
  }
  const auto in_radians = [&section](const char* key, const std::vector<double>& values, double low,
                                     double high) {
    for (const double value : values) {
      // 1.5708 means the zenith.
      if (value >= low - 1e-5 && value <= high + 1e-5) continue;
      throw section.error(key, fmt::format("{} is out of range", value),
                          fmt::format("it is in radians, from {:.6g} to {:.6g}; {} deg is {:.6f}", low, high,
                                      value, radians(value)));
    }
  };
  in_radians("satAzimuth", *azimuths, -2 * geodesy::kPi, 2 * geodesy::kPi);
  in_radians("satElevation", *elevations, 0, geodesy::kPi / 2);
  const auto count = section.integer("satNum", 1, 63);
  const auto length = count ? static_cast<std::size_t>(*count) : azimuths->size();
  if (azimuths->size() != elevations->size() || azimuths->size() != length) {
    throw section.error(count ? "satNum" : "satElevation",
                        fmt::format("{} azimuths and {} elevations for {} satellites", azimuths->size(),
                                    elevations->size(), length),
                        "give one of each for every satellite");
  }
  section.finish();
  config.frozen_azimuth_rad = *azimuths;
  config.frozen_elevation_rad = *elevations;
}

}  // namespace

// Which one of the alternatives is there; nothing where none is.
std::optional<std::string> only_one(const YamlSection& section, const std::vector<std::string>& keys) {
  std::optional<std::string> found;
  for (const std::string& key : keys) {
    if (!section.has(key)) continue;
    if (found)
      throw section.error(key, fmt::format("stands beside '{}'", *found), "keep one of " + key_list(keys));
    found = key;
  }
  return found;
}

double required(YamlSection& section, std::string_view key, const Range& range) {
  const auto value = section.number(key, range);
  if (!value) throw section.section_error(fmt::format("'{}' is missing", key));
  return *value;
}

SkyConfig read_sky(YamlSection& section) {
  SkyConfig config;
  const auto kind = only_one(section, {"navigation", "sp3", "nominal", "frozen"});
  if (kind == "navigation") {
    config.navigation = *section.existing_files("navigation");
  } else if (kind == "sp3") {
    config.sp3 = section.existing_file("sp3");
  } else if (kind == "frozen") {
    auto frozen = section.section("frozen");
    read_frozen(*frozen, config);
  } else {
    if (kind && !*section.boolean("nominal")) {
      throw section.error("nominal", "false, and no other source",
                          "give one of navigation, sp3, frozen, or nominal: true");
    }
    config.nominal = true;
  }
  if (kind != "frozen") {
    if (const auto names = section.texts("systems")) {
      config.systems.clear();
      for (const std::string& name : *names) {
        try {
          config.systems.insert(gnss::system_from_name(name));
        } catch (const InputError& e) {
          throw section.error("systems", e.problem(), e.cure());
        }
      }
    }
  }
  if (kind == "navigation") set(config.allow_stale, section.boolean("allow_stale"));
  section.finish();
  return config;
}

std::optional<GpsTime> read_start(YamlSection& root) {
  if (!root.has("start")) return std::nullopt;
  if (root.is_section("start")) {
    auto section = root.section("start");
    const auto week = section->integer("week", 0, 9999);
    if (!week) throw section->section_error("'week' is missing", "write start: {week: 2051, tow: 46701}");
    const double tow = required(*section, "tow", {0, 604800, false, true});
    section->finish();
    return GpsTime::from_week(static_cast<int>(*week), tow);
  }
  const auto text = root.text("start");
  try {
    return geodesy::parse_time(*text);
  } catch (const InputError& e) {
    throw root.error("start", e.problem(), e.cure());
  }
}

std::uint64_t read_seed(YamlSection& root) {
  const auto seed = root.integer("seed", 0, std::numeric_limits<std::int64_t>::max());
  return seed ? static_cast<std::uint64_t>(*seed) : 1;
}

// Names become folder names and NMEA has no quotes: letters, digits, '-', '_', '.', not first a dot.
void check_name(const YamlSection& section, const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  });
  if (!plain || name.front() == '.' || name.size() > 60) {
    throw section.error("name", fmt::format("'{}' cannot name a folder", name),
                        "use at most 60 letters, digits, '-', '_' and '.', a dot not first");
  }
}

}  // namespace canyon::simulation
