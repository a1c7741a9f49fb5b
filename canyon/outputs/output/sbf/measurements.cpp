// Declared in canyon/outputs/output/sbf/block.hpp.
#include <algorithm>
#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/outputs/output/sbf/block.hpp"

// MeasEpoch (4.2.1): of each satellite one sub-block with its first signal, and one for each further signal
// with differences from that.

namespace canyon::output::sbf {
namespace {

constexpr double kCode_m = 0.001, kDoppler_hz = 1e-4, kPhase_cycles = 0.001;
constexpr double kLowestCn0_dbhz = 10, kCn0_db = 0.25;
constexpr int kFirstBytes = 20, kFurtherBytes = 12;
constexpr std::int64_t kHigh = 65536;  ///< of the high byte of a field in two parts

/// Bits 0 to 4 of a signal's number; 31 says that ObsInfo has the rest.
int type_of(const gnss::Signal& signal) {
  return std::min<int>(signal.sbf, 31);
}

int observation_info(const RawObservation& o, const std::map<gnss::SatelliteId, int>& channels) {
  const int info = o.measurement->half_cycle ? 1 << 2 : 0;
  const int rest = o.signal->sbf >= 31 ? o.signal->sbf - 32 : frequency_number(o.id, channels);
  return info | rest << 3;
}

/// A phase relative to the pseudorange in 0.001 cycles: low 16 bits, high 8 bits; -128 and 0 without one.
struct Carrier {
  std::int64_t steps = -128 * kHigh;
  [[nodiscard]] std::uint64_t low() const { return static_cast<std::uint64_t>(steps) & 0xFFFF; }
  [[nodiscard]] std::int64_t high() const { return steps >> 16; }
};
Carrier carrier_of(const RawObservation& o, double stated_range_m) {
  if (!o.carrier_phase_cycles) return {};
  const double wavelength_m = geodesy::kSpeedOfLight / o.measurement->carrier_frequency_hz;
  const auto steps = std::llround((*o.carrier_phase_cycles - stated_range_m / wavelength_m) / kPhase_cycles);
  constexpr std::int64_t kMost = 127 * kHigh;  // a phase that the code has left this far is not sent
  return std::abs(steps) > kMost ? Carrier{} : Carrier{steps};
}

/// C/N0 in quarters of a decibel; 255: not known. Codes of P(Y) count from 0.
int strength(const RawObservation& o) {
  if (!o.measurement->cn0_dbhz) return 255;
  const double from = o.signal->sbf == 1 || o.signal->sbf == 2 ? 0 : kLowestCn0_dbhz;
  return static_cast<int>(std::clamp(std::lround((*o.measurement->cn0_dbhz - from) / kCn0_db), 0L, 254L));
}

/// The pseudorange as its field has it: readers add to that.
double stated(double range_m) {
  return std::llround(range_m / kCode_m) * kCode_m;
}

void put_first(Payload& p, const RawObservation& o, std::size_t channel, std::size_t further,
               const std::map<gnss::SatelliteId, int>& channels) {
  const auto code = static_cast<std::uint64_t>(std::llround(o.pseudorange_m / kCode_m));
  const Carrier carrier = carrier_of(o, stated(o.pseudorange_m));
  p.u1(channel).u1(type_of(*o.signal)).u1(satellite_number(o.id).value_or(0)).u1(code >> 32 & 0xF);
  p.u4(code & 0xFFFFFFFF);
  if (o.doppler_hz) {
    p.signed_field(*o.doppler_hz, kDoppler_hz, 4);
  } else {
    p.u4(0x80000000U);
  }
  p.u2(carrier.low()).u1(carrier.high()).u1(strength(o));
  p.u2(std::clamp(std::floor(o.locked_s + 1e-6), 0.0, 65534.0)).u1(observation_info(o, channels)).u1(further);
}

void put_further(Payload& p, const RawObservation& first, const RawObservation& o,
                 const std::map<gnss::SatelliteId, int>& channels) {
  constexpr std::int64_t kNoCode = -4 * kHigh, kNoDoppler = -16 * kHigh;
  constexpr double kLongest_s = 254;
  const double from_m = stated(first.pseudorange_m);
  std::int64_t code = std::llround((o.pseudorange_m - from_m) / kCode_m);
  if (code <= kNoCode || code > 4 * kHigh - 1) code = kNoCode;
  std::int64_t doppler = kNoDoppler;
  if (o.doppler_hz && first.doppler_hz) {
    const double base = std::llround(*first.doppler_hz / kDoppler_hz) * kDoppler_hz *
                        (o.measurement->carrier_frequency_hz / first.measurement->carrier_frequency_hz);
    doppler = std::llround((*o.doppler_hz - base) / kDoppler_hz);
    if (doppler <= kNoDoppler || doppler > 16 * kHigh - 1) doppler = kNoDoppler;
  }
  const Carrier carrier =
      code == kNoCode ? Carrier{} : carrier_of(o, from_m + static_cast<double>(code) * kCode_m);
  p.u1(type_of(*o.signal)).u1(std::clamp(std::floor(o.locked_s + 1e-6), 0.0, kLongest_s)).u1(strength(o));
  p.u1((code >> 16 & 7) | (doppler >> 16 & 31) << 3).u1(carrier.high()).u1(observation_info(o, channels));
  p.u2(code & 0xFFFF).u2(carrier.low()).u2(doppler & 0xFFFF);
}

}  // namespace

std::string meas_epoch(const DeviceEpoch& epoch) {
  Payload list;
  const std::vector<RawObservation>& observations = epoch.raw.observations;
  std::size_t satellites = 0;
  for (std::size_t i = 0; i < observations.size();) {
    std::vector<const RawObservation*> signals;
    const gnss::SatelliteId id = observations[i].id;
    for (; i < observations.size() && observations[i].id == id; ++i) {
      if (observations[i].signal->sbf >= 0) signals.push_back(&observations[i]);
    }
    if (signals.empty() || !satellite_number(id)) continue;
    put_first(list, *signals.front(), ++satellites, signals.size() - 1, epoch.glonass_channels);
    for (std::size_t k = 1; k < signals.size(); ++k)
      put_further(list, *signals.front(), *signals[k], epoch.glonass_channels);
  }
  Payload p;
  constexpr unsigned kSteered = 1U << 3U;
  p.u1(satellites).u1(kFirstBytes).u1(kFurtherBytes).u1(kSteered).u1(0).u1(0);
  return p.raw(list.bytes()).bytes();
}

}  // namespace canyon::output::sbf
