#include "canyon/simulation/samples/path_interpolator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace canyon::samples {
namespace {

const geodesy::GpsTime kZero = geodesy::GpsTime::from_week(2421, 115218);

gnss::SatelliteId satellite_of(gnss::System system) {
  const std::map<gnss::System, std::uint8_t> numbers{{gnss::System::GPS, 4},     {gnss::System::Galileo, 11},
                                                     {gnss::System::BeiDou, 30}, {gnss::System::GLONASS, 3},
                                                     {gnss::System::QZSS, 2},    {gnss::System::SBAS, 23}};
  return {system, numbers.at(system)};
}

TEST(Waveform, HasPowerOneAndKnowsWhatIsTracked) {
  // IS-GPS-200, -705 and -800, OS SIS ICD, BDS-SIS-ICD-B1C, -B2a: fractions of the pilots; 1 if all is
  // tracked.
  const std::map<std::string, double> over_tracked{
      {"L1C", 4.0 / 3}, {"L2C", 2}, {"L5", 2}, {"B1C", 4.0 / 3}, {"B2a", 2}};
  int known = 0;
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      if (!signal.only_recorded.empty()) continue;
      Waveform waveform(satellite_of(system), signal, kZero);
      if (waveform.empty()) continue;
      ++known;
      const auto found = over_tracked.find(std::string(signal.name));
      EXPECT_NEAR(waveform.power_over_tracked(), found == over_tracked.end() ? 1 : found->second, 1e-9)
          << signal.name;
      Slots slots;
      const auto count = static_cast<std::size_t>(0.02 * waveform.slot_rate_hz());
      waveform.send(-1000, count, slots);
      double power = 0;
      for (const float x : slots.re) power += x * x;
      for (const float x : slots.im) power += x * x;
      EXPECT_NEAR(power / static_cast<double>(count), 1, 0.02) << gnss::name(system) << ' ' << signal.name;
    }
  }
  EXPECT_GE(known, 20);
}

TEST(Waveform, DoesNotDependOnWhereOneBeginsToSend) {
  Waveform waveform(satellite_of(gnss::System::Galileo), gnss::signals_of(gnss::System::Galileo)[0], kZero);
  Slots all, part;
  waveform.send(-100'007, 200'000, all);
  for (const std::int64_t first : {-100'007, -49'105, -49'104, 0, 5, 49'103}) {
    waveform.send(first, 50'001, part);
    for (std::size_t i = 0; i < part.re.size(); ++i) {
      ASSERT_EQ(part.re[i], all.re[i + static_cast<std::size_t>(first + 100'007)]) << first << ' ' << i;
    }
  }
}

// A C/A code begins with each millisecond of the week, a symbol of LNAV with every twentieth.
TEST(Waveform, BeginsWithTheSecond) {
  const gnss::SatelliteId id = satellite_of(gnss::System::GPS);
  const gnss::Signal& signal = gnss::signals_of(gnss::System::GPS)[0];
  gnss::NavigationData navigation;
  gnss::KeplerEphemeris e;
  e.id = id;
  e.toe = e.toc = kZero;
  e.sqrt_a = 5153.7;
  navigation.kepler.push_back(e);
  Waveform waveform(id, signal, kZero);
  EXPECT_TRUE(waveform.read_symbols(navigation, 0, 1));
  EXPECT_FALSE(Waveform(id, signal, kZero).read_symbols({}, 0, 1));
  const std::vector<std::int8_t> chips = components(id, signal).at(0).chips;
  Slots slots;
  waveform.send(0, std::size_t{1023} * 200, slots);
  int cycles = 0;
  for (std::size_t period = 0; period < 200; ++period) {
    const float symbol = slots.re[1023 * period] * static_cast<float>(chips[0]);
    for (std::size_t i = 0; i < 1023; ++i) {
      ASSERT_EQ(slots.re[1023 * period + i], symbol * static_cast<float>(chips[i])) << period;
    }
    if (period == 0 || slots.re[1023 * (period - 1)] == slots.re[1023 * period]) continue;
    ++cycles;
    EXPECT_EQ(period % 20, 0U);
  }
  EXPECT_GT(cycles, 1);
}

// Frames of L1C begin with each 18 s of the GPS week, those of B1C, B2a and B2b with each 18 s, 3 s and
// second of the BDT week, which is 14 s late: the first symbols of a frame, and the secondary code within
// them.
TEST(Waveform, BeginsFramesWithTheWeekOfTheSystem) {
  struct Case {
    gnss::System system;
    const char* name;
    double begin_s;  // of a frame after kZero
    std::string bits, secondary;
  };
  // Count 6402 of two hours of 400; PRN 30; preambles (IS-GPS-800, 3.5.2; BDS-SIS-ICD-B1C, 6.2.2.1; -B2a,
  // 6.2.1; -B2b, 6.2.1).
  for (const auto& [system, name, begin_s, bits, secondary] :
       {Case{gnss::System::GPS, "L1C", 0, "000000010", "0"},
        Case{gnss::System::BeiDou, "B1C", 14, "011110", "0"},
        Case{gnss::System::BeiDou, "B2a", 2, "111000100100110111101000", "00010"},
        Case{gnss::System::BeiDou, "B2b", 0, "1110101110010000011110000000", "0"}}) {
    SCOPED_TRACE(name);
    const gnss::SatelliteId id = satellite_of(system);
    const auto signals = gnss::signals_of(system);
    const gnss::Signal& signal =
        *std::find_if(signals.begin(), signals.end(),
                      [named = std::string(name)](const gnss::Signal& s) { return s.name == named; });
    gnss::NavigationData navigation;
    gnss::KeplerEphemeris e;
    e.id = id;
    e.toe = e.toc = kZero;
    e.sqrt_a = 5282.6;
    navigation.kepler.push_back(e);
    Waveform waveform(id, signal, kZero);
    EXPECT_TRUE(waveform.read_symbols(navigation, 0, begin_s + 1));
    const std::vector<Component> sent = components(id, signal);
    const Component& data =
        *std::find_if(sent.begin(), sent.end(), [](const Component& c) { return c.data; });
    const auto slots_per_chip = static_cast<std::size_t>(waveform.slot_rate_hz() / data.chip_rate_hz);
    const std::size_t length = data.chips.size() * slots_per_chip;
    auto first = static_cast<std::int64_t>(begin_s * waveform.slot_rate_hz());
    Slots slots;
    for (const char bit : bits) {
      for (const char chip : secondary) {
        waveform.send(first, length, slots);
        first += static_cast<std::int64_t>(length);
        double sum = 0;
        for (std::size_t i = 0; i < length; ++i) {
          const double fraction = (static_cast<double>(i % slots_per_chip) + 0.5) / slots_per_chip;
          const double im = slots.im.empty() ? 0 : slots.im[i];
          sum += data.chips[i / slots_per_chip] * subcarrier(data.modulation, fraction, i / slots_per_chip) *
                 (slots.re[i] * std::cos(data.phase_rad) + im * std::sin(data.phase_rad));
        }
        const double expected = (bit == chip ? 1 : -1) * std::sqrt(data.power_fraction);
        EXPECT_NEAR(sum / static_cast<double>(length), expected, 0.05);
      }
    }
  }
}

}  // namespace
}  // namespace canyon::samples
