#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/outputs/encoding/observations/fix_codes.hpp"
#include "canyon/outputs/encoding/ubx/messages.hpp"

// u-blox defines a range but no unit for these fields; docs/outputs.md describes Canyon's values.

namespace canyon::encoding::ubx {
namespace {

struct Band {
  double interference = 0, tone = 0, agc = 1;  // undisturbed, also for unknown bands
  bool known = false;
};

/// The worst of the carriers in a front end: 0 around L1, 1 below.
Band band(const UbxEpoch& epoch, int block) {
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

/// 0 unknown, else as encoding::jamming_state().
std::uint64_t jamming_state(const UbxEpoch& epoch, const Band& band) {
  if (!epoch.jamming_monitor || !band.known) return 0;
  return encoding::jamming_state(band.interference, epoch.seen.fix);
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
std::string mon_hw(const UbxEpoch& epoch) {
  const Band l1 = band(epoch, 0);
  Payload p;
  p.zeros(16).u2(noise_per_ms(l1)).u2(agc_count(l1)).u1(2).u1(1);  // antenna OK, on
  p.u1(1 | jamming_state(epoch, l1) << 2).zeros(1 + 4 + 17).u1(jamming_indicator(l1));
  return p.zeros(2 + 12).bytes();
}

// 32.16.4, 3.14.4: not modelled; configuration from internal memory, power-on self-test passed.
std::string mon_hw2(const UbxEpoch& /*epoch*/) {
  return Payload().zeros(4).u1(111).zeros(23).bytes();
}

// 3.14.10
std::string mon_rf(const UbxEpoch& epoch) {
  const bool second = band(epoch, 1).known;
  Payload p;
  p.u1(0).u1(second ? 2 : 1).zeros(2);
  for (int block = 0; block < (second ? 2 : 1); ++block) {
    const Band state = band(epoch, block);
    const auto jamming = is_newest(epoch.generation) ? 0 : jamming_state(epoch, state);
    p.u1(block).u1(jamming).u1(2).u1(1).zeros(4 + 4);
    p.u2(noise_per_ms(state)).u2(agc_count(state)).u1(jamming_indicator(state)).zeros(4 + 3);
  }
  return p.bytes();
}

// 3.18.1: version 1; M10: version 2, with centre frequencies of signals [kHz]; X20: likewise, version 3.
std::string sec_sig(const UbxEpoch& epoch) {
  std::uint64_t jamming = 0;
  for (const int block : {0, 1}) jamming = std::max(jamming, jamming_state(epoch, band(epoch, block)));
  // spoofingState: 0 unknown, 1 none, 2 indicated, 3 affirmed.
  const auto spoofing = static_cast<std::uint64_t>(epoch.seen.spoofing);
  Payload p;
  if (is_newest(epoch.generation)) {
    p.u1(epoch.generation == Generation::X20 ? 3 : 2);
    p.u1((jamming != 0 ? 1 : 0) | jamming << 1 | (spoofing != 0 ? 1 << 3 : 0) | spoofing << 4);
    p.u1(0).u1(epoch.seen.bands.size());
    for (const receiver::BandState& state : epoch.seen.bands) {
      const bool jammed = epoch.jamming_monitor && state.interference_ratio >= 1;
      p.u4(static_cast<std::uint64_t>(std::floor(state.carrier_hz / 1e3)) | (jammed ? 1 << 24 : 0));
    }
    return p.bytes();
  }
  p.u1(1).zeros(3).u1((jamming != 0 ? 1 : 0) | jamming << 1).zeros(3);
  return p.u1((spoofing != 0 ? 1 : 0) | spoofing << 1).zeros(3).bytes();
}

void SecurityLog::take(const UbxEpoch& epoch) {
  using Detection = SecurityEvent::Detection;
  std::optional<Detection> jamming;
  for (const int block : {0, 1}) {
    const Band state = band(epoch, block);
    if (jamming_state(epoch, state) < 2) continue;
    jamming =
        state.tone > state.interference / 2 ? Detection::NarrowbandJamming : Detection::BroadbandJamming;
  }
  // One jammer; its kind was reported at its start.
  if (jamming && jamming_) jamming = jamming_;
  change(jamming_, jamming, epoch.seen.time);
  change(spoofing_,
         epoch.seen.spoofing >= receiver::SpoofingState::Indicated ? std::optional(Detection::AbruptChange)
                                                                   : std::nullopt,
         epoch.seen.time);
}

void SecurityLog::change(std::optional<SecurityEvent::Detection>& before,
                         std::optional<SecurityEvent::Detection> now, geodesy::GpsTime time) {
  constexpr std::size_t kMax = 16;
  if (before.has_value() != now.has_value()) {
    events_.insert(events_.begin(), {time, now ? *now : *before, !now.has_value()});
    if (events_.size() > kMax) events_.pop_back();
  }
  before = now;
}

// 3.18.2: seconds since each event.
std::string sec_siglog(const UbxEpoch& epoch) {
  static const std::vector<SecurityEvent> kNone;
  const auto& events = epoch.security_events != nullptr ? *epoch.security_events : kNone;
  Payload p;
  p.u1(0).u1(events.size()).zeros(6);
  for (const SecurityEvent& event : events) {
    p.u4(static_cast<std::uint64_t>(std::max(0.0, std::floor(epoch.seen.time - event.time))));
    p.u1(static_cast<std::uint64_t>(event.detection)).u1(event.stopped ? 1 : 0).zeros(2);
  }
  return p.bytes();
}

// 32.16.12, 3.14.13
std::string version_payload(Generation generation) {
  constexpr std::size_t kLine = 30;
  struct Version {
    const char *software, *hardware;
    std::vector<const char*> lines;
  };
  static const std::array<Version, 4> kVersions{{
      {"ROM CORE 3.01 (Canyon)",
       "00080000",
       {"FWVER=SPG 3.01", "PROTVER=18.00", "GPS;GLO;GAL;BDS", "SBAS;QZSS"}},
      {"EXT CORE 1.00 (Canyon)",
       "00190000",
       {"ROM BASE 0x118B2060", "FWVER=HPG 1.32", "PROTVER=27.31", "MOD=ZED-F9P", "GPS;GLO;GAL;BDS",
        "SBAS;QZSS"}},
      {"ROM SPG 5.30 (Canyon)",
       "000A0000",
       {"FWVER=SPG 5.30", "PROTVER=34.30", "MOD=MAX-M10S", "GPS;GLO;GAL;BDS", "SBAS;QZSS"}},
      {"EXT HPG 2.10 (Canyon)",
       "000B0000",
       {"ROM BASE 0x00A9D329", "FWVER=HPG 2.10", "PROTVER=50.11", "MOD=ZED-X20P", "GPS;GLO;GAL;BDS",
        "SBAS;QZSS", "NAVIC;LBAND"}},
  }};
  const Version& version = kVersions.at(static_cast<std::size_t>(generation));
  Payload p;
  p.text(version.software, kLine).text(version.hardware, 10);
  for (const char* line : version.lines) p.text(line, kLine);
  return p.bytes();
}

}  // namespace canyon::encoding::ubx
