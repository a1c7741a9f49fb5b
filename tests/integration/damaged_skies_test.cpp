#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <tuple>

#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/orbit/broadcast_sky.hpp"
#include "canyon/orbit/navigation_review.hpp"
#include "canyon/orbit/precise_sky.hpp"
#include "canyon/rinex/observation_reader.hpp"
#include "tests/support/damages.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

// Parts of recorded files with a byte left out or a line twice: ephemerides, precise orbits, observations.
// They give the same data within noise, a remark or an error.
namespace canyon::damaged_skies_test {
namespace {

using test::Damages;
using test::Outcome;

constexpr double kNoise_m = 30;

/// Lines of a file that `take` wants.
template <typename Take>
std::string lines_of(const std::filesystem::path& path, const Take& take) {
  TextFile file = TextFile::streamed(path);
  std::string text;
  while (const auto line = file.next_line())
    if (take(*line)) text += std::string(*line) + "\n";
  return text;
}

/// Places of satellites and readings of their clocks, every quarter of an hour.
using States = std::map<std::pair<gnss::SatelliteId, int>, Eigen::Vector4d>;
States states(const orbit::Sky& sky, geodesy::GpsTime begin, int count) {
  States all;
  for (int step = 0; step < count; ++step) {
    for (const gnss::SatelliteId id : sky.satellites()) {
      if (const auto state = sky.state(id, begin + 900.0 * step)) {
        all[{id, step}] << state->position_m, state->clock_bias_s * geodesy::kSpeedOfLight;
      }
    }
  }
  return all;
}

/// Vectors by keys, in metres; `what` names them.
template <typename Vectors>
Damages::Judgement compared(const Vectors& sound, const Vectors& now, bool said,
                            const char* what = "states") {
  double off_m = 0;
  std::size_t missing = now.size() > sound.size() ? now.size() - sound.size() : 0;
  for (const auto& [key, value] : sound) {
    const auto found = now.find(key);
    if (found == now.end()) {
      ++missing;
    } else {
      off_m = std::max(off_m, (found->second - value).template lpNorm<Eigen::Infinity>());
    }
  }
  if (missing == 0 && off_m < 1e-3) return {Outcome::Same, {}};
  if (said) return {Outcome::Said, {}};
  if (missing == 0 && off_m < kNoise_m) return {Outcome::Noise, {}};
  return {Outcome::Same, fmt::format("off by {:.0f} m, {} {} more or less", off_m, missing, what)};
}

/// A navigation file's header and the records of one satellite, which begin so.
std::string records_of(const std::filesystem::path& path, std::string_view satellite, int lines) {
  int left = 0;
  bool header = true;
  return lines_of(path, [&](std::string_view line) {
    if (!header && line.starts_with(satellite)) left = lines;
    const bool take = header || left > 0;
    header = header && line.find("END OF HEADER") == std::string_view::npos;
    --left;
    return take;
  });
}

/// @param begin of a day
void check_ephemerides(const std::string& name, const std::string& text, const char* begin_text,
                       std::size_t least) {
  const test::TemporaryFolder folder;
  const auto read = [&](const std::string& bytes) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return orbit::read_navigation({folder / name});
  };
  const auto begin = geodesy::parse_time(begin_text);
  const gnss::NavigationData whole = read(text);
  const States sound = states(orbit::BroadcastSky(whole), begin, 96);
  ASSERT_GE(sound.size(), least);
  const test::DamageCounts counts = Damages(name, text, 7).run([&](const std::string& bytes) {
    const gnss::NavigationData data = read(bytes);
    return compared(sound, states(orbit::BroadcastSky(data), begin, 96),
                    data.warnings.size() > whole.warnings.size());
  });
  EXPECT_EQ(counts.silent.size(), 0U) << testing::PrintToString(counts.silent);
  EXPECT_GT(counts.said, 100);
}

TEST(DamagedSkies, EphemeridesDoNotChangeSilently) {
  CANYON_SHARED_DATA(path, "orbits/brdc3050.12n");
  check_ephemerides("brdc3050.12n", records_of(path, " 1", 8), "2012-10-31T00:00:00 GPST", 90);
}

TEST(DamagedSkies, EphemeridesOfGlonassDoNotChangeSilently) {
  CANYON_SHARED_DATA(path, "berlin-potsdamer-platz/brdc1580.16g");
  check_ephemerides("brdc1580.16g", records_of(path, " 1 ", 4), "2016-06-06T00:00:00 GPST", 90);
}

TEST(DamagedSkies, EphemeridesOfBeiDouDoNotChangeSilently) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/hksc1180.19b");
  check_ephemerides("hksc1180.19b", records_of(path, "C11", 8), "2019-04-28T00:00:00 GPST", 20);
}

/// An SP3 file's first sixteen epochs of two satellites.
void check_precise_orbits(const std::filesystem::path& path, const std::set<std::string>& satellites,
                          const char* begin_text) {
  int epochs = 0;
  const std::string text = lines_of(path, [&](std::string_view line) {
    if (line.substr(0, 1) == "*") ++epochs;
    if (line.starts_with("EOF")) return true;
    return epochs <= 16 && (line[0] != 'P' || satellites.count(std::string(line.substr(1, 3))) > 0);
  });
  const auto read = [](const std::string& bytes) {
    return orbit::PreciseSky(TextFile::from_string(bytes, "a.sp3"));
  };
  const auto begin = geodesy::parse_time(begin_text);
  const orbit::PreciseSky whole = read(text);
  const States sound = states(whole, begin, 16);
  ASSERT_GE(sound.size(), 10U);
  const std::string name = path.filename().string();
  const test::DamageCounts counts = Damages(name, text, 5).run([&](const std::string& bytes) {
    const orbit::PreciseSky sky = read(bytes);
    return compared(sound, states(sky, begin, 16), sky.warnings().size() > whole.warnings().size());
  });
  EXPECT_EQ(counts.silent.size(), 0U) << testing::PrintToString(counts.silent);
}

TEST(DamagedSkies, PreciseOrbitsDoNotChangeSilently) {
  CANYON_SHARED_DATA(path, "orbits/GRG0MGXFIN_20201770000_01D_15M_ORB.SP3.gz");
  check_precise_orbits(path, {"G01", "E05"}, "2020-06-25T00:00:00 GPST");
}

TEST(DamagedSkies, PreciseOrbitsOf5MinutesDoNotChangeSilently) {
  CANYON_SHARED_DATA(path, "berlin-potsdamer-platz/gbm19001.sp3");
  check_precise_orbits(path, {"G01", "R05"}, "2016-06-06T00:00:00 GPST");
}

using Ranges = std::map<std::tuple<geodesy::GpsTime, gnss::SatelliteId, std::string>, Eigen::Vector2d>;
Ranges ranges(const rinex::RinexObservations& file) {
  Ranges all;
  for (const auto& epoch : file.epochs) {
    for (const auto& signal : epoch.signals) {
      constexpr double kWavelength_m = 0.19;
      all[{epoch.receiver_time, signal.id, signal.code.data()}] << signal.pseudorange_m.value_or(0),
          kWavelength_m * signal.carrier_phase_cycles.value_or(0);
    }
  }
  return all;
}

/// An observation file's first eight epochs of a few satellites.
void check_observations(const std::filesystem::path& path, const std::set<std::string>& satellites,
                        std::size_t silent) {
  int epochs = 0;
  bool header = true;
  std::string text = lines_of(path, [&](std::string_view line) {
    if (header) {
      header = line.find("END OF HEADER") == std::string_view::npos;
      return true;
    }
    if (line[0] == '>') ++epochs;
    return epochs <= 8 && (line[0] == '>' || satellites.count(std::string(line.substr(0, 3))) > 0);
  });
  for (std::size_t at = text.find("\n>"); at != std::string::npos; at = text.find("\n>", at + 1)) {
    const std::size_t end = text.find("\n>", at + 1);
    const auto rows = std::count(
        text.begin() + static_cast<std::ptrdiff_t>(at) + 1,
        end == std::string::npos ? text.end() - 1 : text.begin() + static_cast<std::ptrdiff_t>(end), '\n');
    text.replace(at + 33, 3, fmt::format("{:3d}", rows));
  }
  const test::TemporaryFolder folder;
  rinex::ObservationOptions options;
  options.all_signals = true;
  const auto read = [&](const std::string& bytes) {
    std::ofstream(folder / "a.obs", std::ios::binary) << bytes;
    return rinex::read_rinex_observations(folder / "a.obs", options);
  };
  const rinex::RinexObservations whole = read(text);
  const Ranges sound = ranges(whole);
  ASSERT_GT(sound.size(), 20U);
  const test::DamageCounts counts =
      Damages(path.filename().string(), text, 7).run([&](const std::string& bytes) -> Damages::Judgement {
        const rinex::RinexObservations file = read(bytes);
        return compared(sound, ranges(file), file.report.warnings().size() > whole.report.warnings().size(),
                        "signals");
      });
  // The first numbers of a file do not say yet in which columns its numbers stand.
  EXPECT_LE(counts.silent.size(), silent) << testing::PrintToString(counts.silent);
}

TEST(DamagedSkies, ObservationsDoNotChangeSilently) {
  CANYON_SHARED_DATA(path, "rtk-nagoya-20240624/base.obs");
  check_observations(path, {"G05", "E09"}, 2);
}

TEST(DamagedSkies, ObservationsOfACarDoNotChangeSilently) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/COM3_190428_124409.obs");
  check_observations(path, {"G 2", "G 6", "G17", "G 5"}, 2);
}

TEST(DamagedSkies, ObservationsOfAPhoneDoNotChangeSilently) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20210517/20210517.light-urban.tste.google.pixel4.obs");
  check_observations(path, {"E26", "G 1", "G 8", "G 9"}, 2);
}

}  // namespace
}  // namespace canyon::damaged_skies_test
