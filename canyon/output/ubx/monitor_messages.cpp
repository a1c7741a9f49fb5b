// Declared in canyon/output/ubx/messages.hpp.
#include <algorithm>
#include <cmath>

#include "canyon/output/ubx/messages.hpp"

// u-blox gives these fields a range and no unit; docs/outputs.md states how Canyon fills them.

namespace canyon::output::ubx {
namespace {

struct Band {
  double interference = 0, tone = 0, agc = 1;  // undisturbed, as unknown bands are
  bool known = false;
};

/// The worst of the carriers in a front end: 0 around L1, 1 below.
Band band(const Epoch& epoch, int block) {
  constexpr double kBetween_hz = 1.4e9;
  Band worst;
  for (const receiver::BandState& state : epoch.seen.bands) {
    if ((state.carrier_hz < kBetween_hz) != (block == 1)) continue;
    if (worst.known && state.interference_ratio <= worst.interference) {
      worst.tone = std::max(worst.tone, state.tone_ratio);
      continue;
    }
    worst = {state.interference_ratio, std::max(worst.tone, state.tone_ratio), state.agc(), true};
  }
  return worst;
}

/// 0 unknown, 1 none, 2 seen, the fix goes on, 3 seen, no fix. Seen: as strong as the front end's own noise.
std::uint64_t jamming_state(const Epoch& epoch, const Band& band) {
  if (!epoch.jamming_monitor || !band.known) return 0;
  if (band.interference < 1) return 1;
  return epoch.seen.fix.measured() ? 2 : 3;
}

std::uint64_t noise_per_ms(const Band& band) {
  constexpr double kQuiet = 90;
  return static_cast<std::uint64_t>(std::min(65535.0, std::round(kQuiet * std::sqrt(1 + band.interference))));
}

std::uint64_t agc_count(const Band& band) {
  return static_cast<std::uint64_t>(std::lround(8191 * std::clamp(band.agc, 0.0, 1.0)));
}

/// 0 to 255: tones over noise in dB, 30 dB fill the scale.
std::uint64_t jamming_indicator(const Band& band) {
  return static_cast<std::uint64_t>(
      std::clamp(std::round(255 * 10 * std::log10(1 + band.tone) / 30), 0.0, 255.0));
}

}  // namespace

// UBX-13003221 32.16.5, UBX-22008968 3.14.6
std::string mon_hw(const Epoch& epoch) {
  const Band l1 = band(epoch, 0);
  Payload p;
  p.zeros(16).u2(noise_per_ms(l1)).u2(agc_count(l1)).u1(2).u1(1);  // antenna OK, on
  p.u1(1 | jamming_state(epoch, l1) << 2).zeros(1 + 4 + 17).u1(jamming_indicator(l1));
  return p.zeros(2 + 12).bytes();
}

// 32.16.4, 3.14.4: nothing that Canyon models; a configuration from its own memory, power-on self-test
// passed.
std::string mon_hw2(const Epoch& /*epoch*/) {
  return Payload().zeros(4).u1(111).zeros(23).bytes();
}

// 3.14.10
std::string mon_rf(const Epoch& epoch) {
  const bool second = band(epoch, 1).known;
  Payload p;
  p.u1(0).u1(second ? 2 : 1).zeros(2);
  for (int block = 0; block < (second ? 2 : 1); ++block) {
    const Band state = band(epoch, block);
    p.u1(block).u1(jamming_state(epoch, state)).u1(2).u1(1).zeros(4 + 4);
    p.u2(noise_per_ms(state)).u2(agc_count(state)).u1(jamming_indicator(state)).zeros(4 + 3);
  }
  return p.bytes();
}

// 3.18.1, version 1
std::string sec_sig(const Epoch& epoch) {
  std::uint64_t jamming = 0;
  for (const int block : {0, 1}) jamming = std::max(jamming, jamming_state(epoch, band(epoch, block)));
  // spoofingState: 0 unknown, 1 none, 2 indicated, 3 affirmed.
  const auto spoofing = static_cast<std::uint64_t>(epoch.seen.spoofing);
  Payload p;
  p.u1(1).zeros(3).u1((jamming != 0 ? 1 : 0) | jamming << 1).zeros(3);
  return p.u1((spoofing != 0 ? 1 : 0) | spoofing << 1).zeros(3).bytes();
}

// 32.16.12, 3.14.13
std::string version_payload(Generation generation) {
  constexpr std::size_t kLine = 30;
  Payload p;
  if (generation == Generation::M8) {
    p.text("ROM CORE 3.01 (Canyon)", kLine).text("00080000", 10);
    for (const char* line : {"FWVER=SPG 3.01", "PROTVER=18.00", "GPS;GLO;GAL;BDS", "SBAS;QZSS"})
      p.text(line, kLine);
    return p.bytes();
  }
  p.text("EXT CORE 1.00 (Canyon)", kLine).text("00190000", 10);
  for (const char* line : {"ROM BASE 0x118B2060", "FWVER=HPG 1.32", "PROTVER=27.31", "MOD=ZED-F9P",
                           "GPS;GLO;GAL;BDS", "SBAS;QZSS"}) {
    p.text(line, kLine);
  }
  return p.bytes();
}

}  // namespace canyon::output::ubx
