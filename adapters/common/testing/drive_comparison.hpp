#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/text.hpp"
#include "gnss.pb.h"

// A drive in a simulator compared with the same drive in `canyon simulate`, which wrote satellites.csv.

namespace canyon::test {

/// A satellite at an instant, as in satellites.csv of `canyon simulate`.
struct ObservedDrive {
  std::string visibility;
  double excess_m = 0;
};
using Key = std::pair<std::int64_t, std::string>;  // time of week [ms], satellite

inline std::map<Key, ObservedDrive> read_satellites(const std::filesystem::path& file) {
  std::map<Key, ObservedDrive> seen;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    const auto fields = split(line, ',');
    const double tow = parse_double(fields.at(1)).value();
    ObservedDrive& satellite = seen[{std::llround(tow * 1e3), std::string(fields.at(2))}];
    satellite.visibility = fields.at(5);
    satellite.excess_m = parse_double(fields.at(6)).value_or(0);
  }
  return seen;
}

inline const char* word(msgs::GnssSatellite::Visibility visibility) {
  switch (visibility) {
    case msgs::GnssSatellite::LOS:
      return "LOS";
    case msgs::GnssSatellite::LOS_MULTIPATH:
      return "LOS+multipath";
    case msgs::GnssSatellite::NLOS:
      return "NLOS";
    default:
      return "blocked";
  }
}

/// Every satellite of every whole second has the same visibility, and NLOS the same excess path within
/// `tolerance_m`. `folder` is a prepared city's, `messages` those of `seconds`.
inline void expect_drive(const std::string& city, const std::filesystem::path& folder, int seconds,
                         const std::vector<msgs::GnssReceiver>& messages, double tolerance_m) {
  const std::map<Key, ObservedDrive> expected = read_satellites(folder / "satellites.csv");
  std::size_t compared = 0, epochs = 0, other_visibility = 0, reflected = 0;
  double largest_m = 0;
  for (const msgs::GnssReceiver& message : messages) {
    const auto tow_ms = (message.gps_time_of_week_ns() + 500'000) / 1'000'000;
    if (message.sim_time_ns() % 1'000'000'000 != 0) continue;
    ++epochs;
    for (const msgs::GnssSatellite& satellite : message.satellites()) {
      const auto found = expected.find({tow_ms, satellite.id()});
      ASSERT_NE(found, expected.end()) << satellite.id() << " at " << tow_ms;
      ++compared;
      if (found->second.visibility != word(satellite.visibility())) {
        ++other_visibility;
        ADD_FAILURE() << fmt::format("{} at {} ms: {} in the simulator, {} in canyon simulate",
                                     satellite.id(), tow_ms, word(satellite.visibility()),
                                     found->second.visibility);
        continue;
      }
      if (satellite.visibility() != msgs::GnssSatellite::NLOS) continue;
      ++reflected;
      largest_m = std::max(largest_m, std::abs(satellite.excess_m() - found->second.excess_m));
    }
  }
  EXPECT_GE(epochs, static_cast<std::size_t>(seconds));
  EXPECT_GT(reflected, static_cast<std::size_t>(seconds) / 2);
  EXPECT_EQ(other_visibility, 0U);
  EXPECT_LT(largest_m, tolerance_m);
  fmt::print("{}: {} epochs, {} satellites, {} of other visibility; {} NLOS, excess within {:.2g} m\n", city,
             epochs, compared, other_visibility, reflected, largest_m);
}

}  // namespace canyon::test
