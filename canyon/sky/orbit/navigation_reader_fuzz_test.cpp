// Damaged files, seeded: for any bytes, the reader returns records or one InputError, and its records can be
// propagated and written.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "canyon/base/input_error.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/support/rinex_sample.hpp"

namespace canyon::orbit {
namespace {

std::string version4() {
  return "     4.00           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE\n"
         "                                                            END OF HEADER       \n"
         "> EPH G05 LNAV\n" +
         test::kG05 +
         "> ION G29 LNAV\n"
         "    2019 04 28 09 59 48 1.024454832077E-08 2.235174179077E-08-5.960464477539E-08\n"
         "    -1.192092895508E-07 9.625600000000E+04 1.310720000000E+05-6.553600000000E+04\n"
         "    -5.898240000000E+05 0.000000000000E+00\n"
         "> EPH R07 FDMA\n" +
         test::kR07 + "> EPH E11 INAV\n" + test::kE11 + "> EPH C03 D2\n" + test::kC03 + "> STO G26 LNAV\n" +
         "    x\n";
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1);
    lines.push_back(text.substr(at, end + 1 - at));
    at = end + 1;
  }
  return lines;
}

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(seed) {}

  std::string operator()(std::string text) {
    const std::size_t strokes = 1 + below(6);
    for (std::size_t i = 0; i < strokes && !text.empty(); ++i) {
      switch (below(7)) {
        case 0:
          text[below(text.size())] = static_cast<char>(below(256));
          break;  // any byte
        case 1:
          text[below(text.size())] = "0123456789+-.eD \n>GRECJ"[below(24)];
          break;
        case 2:
          text.resize(below(text.size()));
          break;  // cut short
        case 3:
          text.erase(below(text.size()), 1 + below(30));
          break;
        case 4:
          text.insert(below(text.size()), std::string(1 + below(30), " \n\t09\0e"[below(7)]));
          break;
        default: {
          std::vector<std::string> lines = lines_of(text);
          const std::size_t line = below(lines.size());
          if (below(2) == 0) {
            lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(line));
          } else {
            std::swap(lines[line], lines[below(lines.size())]);
          }
          text.clear();
          for (const std::string& l : lines) text += l;
        }
      }
    }
    return text;
  }

 private:
  std::size_t below(std::size_t n) { return random_() % n; }

  std::mt19937 random_;
};

TEST(RinexNavigationFuzz, DamagedFilesEndInRecordsOrOneError) {
  const std::string seeds[] = {test::kRinex3Sample, test::kVersion2, version4()};
  int read = 0, refused = 0, warned = 0;
  for (unsigned seed = 0; seed < 6000; ++seed) {
    const std::string text = Mutator(seed)(seeds[seed % 3]);
    try {
      const gnss::NavigationData data = rinex::read_rinex_navigation(TextFile::from_string(text, "fuzz.rnx"));
      ++read;
      warned += data.report.lines().empty() ? 0 : 1;
      ASSERT_FALSE(data.empty());
      BroadcastOptions options;
      options.allow_stale = options.allow_unhealthy = true;
      const BroadcastSky sky(data, options);
      for (const gnss::SatelliteId id : sky.satellites()) {
        const auto state = sky.state(id, sky.span().second);
        ASSERT_TRUE(state && state->position_m.allFinite() && state->velocity_mps.allFinite() &&
                    std::isfinite(state->clock_bias_s))
            << "seed " << seed;
        ASSERT_FALSE(sky.source(id, sky.span().first).empty());
      }
      const std::string written = rinex::format_rinex_navigation(data);
      const gnss::NavigationData back =
          rinex::read_rinex_navigation(TextFile::from_string(written, "again.rnx"));
      ASSERT_EQ(back.kepler.size(), data.kepler.size()) << "seed " << seed;
      ASSERT_EQ(back.glonass.size(), data.glonass.size()) << "seed " << seed;
      ASSERT_EQ(rinex::format_rinex_navigation(back), written) << "seed " << seed;
    } catch (const InputError& error) {
      ++refused;
      ASSERT_FALSE(std::string(error.what()).empty());
    }
  }
  std::printf("  %d read, %d of them with warnings, %d refused\n", read, warned, refused);
  EXPECT_GT(read, 2000);
  EXPECT_GT(warned, 1000);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace canyon::orbit
