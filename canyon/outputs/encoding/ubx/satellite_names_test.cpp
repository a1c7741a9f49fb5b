#include "canyon/outputs/encoding/ubx/messages.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "canyon/sky/broadcast/messages.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::encoding::ubx {
namespace {

/// The signal with a number that a satellite of a system sends, or null.
const gnss::Signal* signal_of(gnss::SatelliteId id, int number) {
  for (const gnss::Signal& signal : gnss::signals_of(id.system)) {
    if (signal_number(id, signal) == number) return &signal;
  }
  return nullptr;
}

// UBX-22008968, 1.5.4.
TEST(SignalNumber, OfGeostationarySatellitesIsThatOfD2) {
  const gnss::SatelliteId medium{gnss::System::BeiDou, 27}, inclined{gnss::System::BeiDou, 9},
      geostationary{gnss::System::BeiDou, 3};
  for (const auto& [number, d2_number] : {std::pair{0, 1}, {2, 3}, {4, 10}}) {
    const gnss::Signal* signal = signal_of(medium, number);
    ASSERT_NE(signal, nullptr);
    EXPECT_EQ(signal_number(inclined, *signal), number);
    EXPECT_EQ(signal_number(geostationary, *signal), d2_number);
  }
  EXPECT_EQ(signal_number(geostationary, *signal_of(medium, 5)), 5) << "B1C";
  const gnss::SatelliteId gps{gnss::System::GPS, 4};
  EXPECT_FALSE(signal_number(gps, gnss::signals_of(gps.system)[1])) << "L1C";
}

// A real receiver's RXM-RAWX: for each signal, the rate of the pseudorange divided by the Doppler is the
// wavelength of the signal with the number here.
TEST(SignalNumber, IsThatOfARealReceiver) {
  CANYON_SHARED_DATA(path, "ubx-longmont-20250828/gnss_1730.ubx");
  const TextFile file(path);
  const std::string_view bytes = file.text();
  // The machine's numbers are little-endian, as UBX's.
  const auto read = [&](std::size_t at, auto value) {
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  struct Sample {
    double time_s, range_m, doppler_hz;
  };
  std::map<std::pair<int, int>, std::map<int, std::vector<Sample>>> tracks;  // gnssId, sigId; svId
  constexpr std::string_view kRawx("\xb5\x62\x02\x15", 4);
  for (std::size_t at = bytes.find(kRawx); at != bytes.npos; at = bytes.find(kRawx, at + 1)) {
    const std::size_t begin = at + 6, size = number_at(bytes, at + 4, 2);
    if (begin + size > bytes.size() || size < 16) break;
    for (std::size_t o = begin + 16; o + 32 <= begin + size; o += 32) {
      const auto byte = [&](std::size_t i) { return static_cast<int>(number_at(bytes, o + i, 1)); };
      tracks[{byte(20), byte(22)}][byte(21)].push_back({read(begin, 0.0), read(o, 0.0), read(o + 16, 0.0F)});
    }
  }
  const std::map<int, gnss::SatelliteId> a_satellite{{0, {gnss::System::GPS, 5}},
                                                     {1, {gnss::System::SBAS, 33}},
                                                     {2, {gnss::System::Galileo, 11}},
                                                     {3, {gnss::System::BeiDou, 27}}};
  int known = 0;
  for (const auto& [numbers, satellites] : tracks) {
    std::vector<double> wavelengths_m;
    for (const auto& [satellite, samples] : satellites) {
      for (std::size_t i = 40; i < samples.size(); ++i) {
        const Sample &a = samples[i - 40], &b = samples[i];
        const double moved_m = b.range_m - a.range_m;
        if (b.time_s - a.time_s > 20 || std::abs(a.doppler_hz) < 800 || std::abs(moved_m) > 1e5) continue;
        wavelengths_m.push_back(-moved_m / (b.time_s - a.time_s) / ((a.doppler_hz + b.doppler_hz) / 2));
      }
    }
    const gnss::Signal* signal = signal_of(a_satellite.at(numbers.first), numbers.second);
    if (numbers == std::pair{2, 8}) {
      EXPECT_EQ(signal, nullptr) << "E6-B, which is not in the table";
      continue;
    }
    ASSERT_NE(signal, nullptr) << numbers.first << ' ' << numbers.second;
    if (wavelengths_m.size() < 1000) continue;  // SBAS hardly moves
    std::sort(wavelengths_m.begin(), wavelengths_m.end());
    const double median_m = wavelengths_m[wavelengths_m.size() / 2];
    EXPECT_NEAR(geodesy::kSpeedOfLight / median_m / signal->carrier_hz, 1, 1e-4) << signal->name;
    ++known;
  }
  EXPECT_EQ(known, 8);  // L1CA, L2C, L5, E1, E5a, B1C, B2a, B3I
}

/// Words of LNAV in RXM-SFRBX with u-blox's parity; fails if the parity is wrong.
int lnav_words(std::string_view bytes) {
  constexpr std::string_view kSfrbx("\xb5\x62\x02\x13", 4);
  int words = 0;
  for (std::size_t at = bytes.find(kSfrbx); at != bytes.npos; at = bytes.find(kSfrbx, at + 1)) {
    if (at + 14 + 40 > bytes.size()) break;
    const bool is_lnav = number_at(bytes, at + 6, 1) == 0 && number_at(bytes, at + 8, 1) == 0;
    if (!is_lnav || number_at(bytes, at + 10, 1) != 10) continue;
    for (std::size_t i = 1; i < 10; ++i) {
      const auto word = static_cast<std::uint32_t>(number_at(bytes, at + 14 + 4 * i, 4));
      EXPECT_EQ(word & 63, broadcast::lnav_parity(word >> 6 & 0xFFFFFF, word >> 31 != 0, false));
      EXPECT_EQ(word >> 30 & 1, 0U);
      ++words;
    }
  }
  return words;
}

TEST(LnavWords, HaveTheParityOfARealReceivers) {
  gnss::KeplerEphemeris ephemeris;
  ephemeris.id = {gnss::System::GPS, 5};
  ephemeris.sqrt_a = 5153.7;
  ephemeris.eccentricity = 0.0123;
  ephemeris.mean_anomaly = 1.234;
  std::string bytes;
  for (int subframe = 1; subframe <= 3; ++subframe) {
    const broadcast::SentMessage message{ephemeris.id, {}, broadcast::lnav_subframe(ephemeris, subframe, {})};
    bytes += frame(MessageId{0x0213}, subframe_payload(message, Generation::F9, {}));
  }
  EXPECT_EQ(lnav_words(bytes), 27);
  CANYON_SHARED_DATA(path, "ubx-longmont-20250828/gnss_1730.ubx");
  EXPECT_EQ(lnav_words(TextFile(path).text()), 720);
}

// A real receiver's RXM-SFRBX of BeiDou's D1: Canyon's words must be coded in the same way.
TEST(BeiDouWords, OfARealReceiverHaveTheParityOfTheirHalves) {
  CANYON_SHARED_DATA(path, "ubx-longmont-20250828/gnss_1730.ubx");
  const TextFile file(path);
  const std::string_view bytes = file.text();
  constexpr std::string_view kSfrbx("\xb5\x62\x02\x13", 4);
  int words = 0;
  for (std::size_t at = bytes.find(kSfrbx); at != bytes.npos; at = bytes.find(kSfrbx, at + 1)) {
    if (at + 14 + 40 > bytes.size()) break;
    const bool is_d1 = number_at(bytes, at + 6, 1) == 3 && number_at(bytes, at + 8, 1) == 4;
    if (!is_d1 || number_at(bytes, at + 10, 1) != 10) continue;
    for (std::size_t i = 1; i < 10; ++i) {
      const auto word = static_cast<std::uint32_t>(number_at(bytes, at + 14 + 4 * i, 4)) & 0x3FFFFFFFU;
      ASSERT_EQ(word >> 4 & 15, broadcast::bch_15_11(word >> 19));
      ASSERT_EQ(word & 15, broadcast::bch_15_11(word >> 8 & 0x7FF));
      ++words;
    }
  }
  EXPECT_EQ(words, 1377);
}

}  // namespace
}  // namespace canyon::encoding::ubx
