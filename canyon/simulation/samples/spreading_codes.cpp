#include "canyon/simulation/samples/spreading_codes.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/samples/code_tables.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::samples {
namespace {

using geodesy::kPi;
using gnss::Modulation;
using gnss::System;
using Chips = std::vector<std::int8_t>;

constexpr const char* kGalileoE1[]{
#include "canyon/simulation/samples/galileo_e1_codes.inc"
};
constexpr std::size_t kGalileoE1Codes = 50;
static_assert(std::size(kGalileoE1) == 2 * kGalileoE1Codes && std::size(kGalileoCodes) == kGalileoE1Codes);

constexpr std::int8_t chip(unsigned bit) {
  return (bit & 1U) != 0 ? -1 : 1;
}

unsigned parity(std::uint32_t bits) {
  unsigned sum = 0;
  for (; bits != 0; bits &= bits - 1) sum ^= 1U;
  return sum;
}

/// The lowest `count` bits of a number in reverse order.
std::uint32_t reversed(std::uint32_t bits, int count) {
  std::uint32_t result = 0;
  for (int i = 0; i < count; ++i) result |= ((bits >> i) & 1U) << (count - 1 - i);
  return result;
}

/// Chips of a shift register with feedback to stage 1. Bit i - 1 of a number is stage i.
struct Register {
  int stages;
  std::uint32_t polynomial;  ///< bit i is the coefficient of x^i
  std::uint32_t start;       ///< contents before the first chip
  std::uint32_t output = 0;  ///< stages added to form a chip; 0: the last one
  /// Chips after which the register starts again; 0: never
  std::size_t restart = 0;

  [[nodiscard]] Chips chips(std::size_t count) const {
    const std::uint32_t mask = (1U << stages) - 1;
    const std::uint32_t out = output != 0 ? output : 1U << (stages - 1);
    Chips result(count);
    std::uint32_t state = start;
    for (std::size_t i = 0; i < count; ++i) {
      if (restart != 0 && i % restart == 0) state = start;
      result[i] = chip(parity(state & out));
      state = ((state << 1U) | parity(state & (polynomial >> 1U))) & mask;
    }
    return result;
  }
};

/// Polynomial with the constant term and these powers of x.
constexpr std::uint32_t powers(std::initializer_list<int> exponents) {
  std::uint32_t result = 1;
  for (const int exponent : exponents) result |= 1U << exponent;
  return result;
}

/// Sum modulo 2, b shifted: element i of the result is a[i] + b[(i + advance) mod size of b].
Chips sum(Chips a, const Chips& b, std::size_t advance = 0) {
  for (std::size_t i = 0; i < a.size(); ++i)
    a[i] = static_cast<std::int8_t>(a[i] * b[(i + advance) % b.size()]);
  return a;
}

Chips from_bits(std::string_view bits) {
  Chips result;
  for (const char c : bits) result.push_back(c == '1' ? -1 : 1);
  return result;
}
Chips from_hex(std::string_view digits, std::size_t count) {
  Chips result;
  for (const char c : digits) {
    const unsigned value = static_cast<unsigned>(c <= '9' ? c - '0' : c - 'A' + 10);
    for (unsigned bit = 4; bit-- > 0 && result.size() < count;) result.push_back(chip(value >> bit));
  }
  return result;
}

/// Chip k of the Weil code of a prime length is L(k) + L(k + shift), L the Legendre sequence: 1 if k is a
/// square modulo the length, and L(0) = 0.
Chips weil(std::size_t length, std::size_t shift) {
  Chips legendre(length, 1);
  for (std::size_t i = 1; i < length; ++i) legendre[i * i % length] = -1;
  return sum(legendre, legendre, shift);
}
/// BDS-SIS-ICD-B1C-1.0, 5.2.1.
Chips truncated_weil(std::size_t length, WeilCode code, std::size_t count) {
  return sum(Chips(count, 1), weil(length, code.shift), code.point - std::size_t{1});
}
/// IS-GPS-800, 3.2.2.1.1.
Chips l1c(WeilCode code) {
  Chips chips = weil(10223, code.shift);
  const Chips inserted = from_bits("0110100");
  chips.insert(chips.begin() + code.point - 1, inserted.begin(), inserted.end());
  return chips;
}

/// IS-GPS-200, 3.2.1.3.
Chips ca(std::size_t g2_delay) {
  constexpr std::size_t kLength = 1023;
  const Chips g1 = Register{10, powers({3, 10}), 0x3FF}.chips(kLength);
  const Chips g2 = Register{10, powers({2, 3, 6, 8, 9, 10}), 0x3FF}.chips(kLength);
  return sum(g1, g2, kLength - g2_delay);
}

/// IS-GPS-800, 3.2.2.1.2.
Chips overlay(const GpsCodes& codes) {
  constexpr std::size_t kLength = 1800;
  const Chips s1 = Register{11, codes.overlay, codes.overlay_start}.chips(kLength);
  if (codes.second_start == 0) return s1;
  return sum(s1, Register{11, powers({9, 11}), codes.second_start}.chips(kLength));
}

/// IS-GPS-200, 3.2.1.4 and 3.3.2.4: `own` chips of CM (the even ones of the signal) or CL, with zeros at the
/// chips of the other. Each output of the register is added to the stages of the polynomial.
Chips l2c(std::uint32_t start, std::size_t own, bool cl) {
  Chips result(2 * own, 0);
  std::uint32_t state = start;
  for (std::size_t i = 0; i < own; ++i) {
    result[2 * i + (cl ? 1 : 0)] = chip(state);
    state = (state >> 1U) ^ ((state & 1U) != 0 ? 0445112474U : 0U);
  }
  return result;
}

/// IS-GPS-705, 3.2.1.1.
Chips l5(std::size_t xb_advance) {
  const Chips xa = Register{13, powers({9, 10, 12, 13}), 0x1FFF, 0, 8190}.chips(10230);
  const Chips xb = Register{13, powers({1, 3, 4, 6, 7, 8, 12, 13}), 0x1FFF}.chips(8191);
  return sum(xa, xb, xb_advance);
}

/// Galileo OS SIS ICD 2.1, 3.4.1.
Chips e5(std::uint32_t polynomial1, std::uint32_t polynomial2, std::uint32_t start2) {
  return sum(Register{14, polynomial1, 0x3FFF}.chips(10230), Register{14, polynomial2, start2}.chips(10230));
}

/// BDS-SIS-ICD-B1I-3.0, 4.3.
Chips b1i(const std::uint8_t (&stages)[3]) {
  constexpr std::uint32_t kStart = 0x2AA;  // 01010101010
  std::uint32_t output = 0;
  for (const std::uint8_t stage : stages) output |= (1U << stage) >> 1U;
  return sum(Register{11, powers({1, 7, 8, 9, 10, 11}), kStart}.chips(2046),
             Register{11, powers({1, 2, 3, 4, 5, 8, 9, 11}), kStart, output}.chips(2046));
}

/// B2a, B2b, B3I: two registers of 13 stages; the first one restarts after 8190 chips.
Chips b2b3(std::uint32_t polynomial1, std::uint32_t polynomial2, std::uint32_t start2) {
  return sum(Register{13, polynomial1, 0x1FFF, 0, 8190}.chips(10230),
             Register{13, polynomial2, reversed(start2, 13)}.chips(10230));
}

constexpr std::string_view kNeumanHofman10 = "0000110101";
constexpr std::string_view kNeumanHofman20 = "00000100110101001110";

Component data_alone(Chips chips, double chip_rate_hz, Chips secondary = {1}) {
  return {std::move(chips), chip_rate_hz, std::move(secondary), Modulation::BPSK, 1, 0, true};
}
/// Two BPSK components, each with half of the power.
std::vector<Component> pilot_and_data(double chip_rate_hz, Chips pilot, Chips pilot_secondary, Chips data,
                                      Chips data_secondary, double data_phase_rad) {
  return {{std::move(pilot), chip_rate_hz, std::move(pilot_secondary), Modulation::BPSK, 0.5, 0, false},
          {std::move(data), chip_rate_hz, std::move(data_secondary), Modulation::BPSK, 0.5, data_phase_rad,
           true}};
}

/// GPS and QZSS.
std::vector<Component> gps_components(int prn, std::string_view signal) {
  const auto codes = std::find_if(std::begin(kGpsCodes), std::end(kGpsCodes),
                                  [&](const GpsCodes& c) { return c.prn == prn; });
  if (codes == std::end(kGpsCodes)) return {};
  if (signal == "L1CA") return {data_alone(ca(codes->ca_delay), 1.023e6)};
  // IS-GPS-800, 3.2.1.6: both in phase.
  if (signal == "L1C") {
    return {{l1c(codes->pilot), 1.023e6, overlay(*codes), Modulation::TMBOC, 0.75, 0, false},
            {l1c(codes->data), 1.023e6, {1}, Modulation::BOC11, 0.25, 0, true}};
  }
  if (signal == "L2C") {
    return pilot_and_data(1.023e6, l2c(codes->cl_start, 767250, true), {1},
                          l2c(codes->cm_start, 10230, false), {1}, 0);
  }
  // IS-GPS-705, 3.3.1.5: Q5 lags I5.
  if (signal == "L5") {
    return pilot_and_data(10.23e6, l5(codes->q5_advance), from_bits(kNeumanHofman20), l5(codes->i5_advance),
                          from_bits(kNeumanHofman10), kPi / 2);
  }
  return {};
}

std::vector<Component> galileo_components(std::size_t svid, std::string_view signal) {
  if (svid < 1 || svid > kGalileoE1Codes) return {};
  const GalileoCodes& codes = kGalileoCodes[svid - 1];
  // OS SIS ICD 2.1, 2.3.3: E1-C is subtracted from E1-B; 3.5.1: secondary codes.
  if (signal == "E1") {
    return {{from_hex(kGalileoE1[kGalileoE1Codes + svid - 1], 4092), 1.023e6, from_hex("380AD90", 25),
             Modulation::CBOCPilot, 0.5, 0, false},
            {from_hex(kGalileoE1[svid - 1], 4092), 1.023e6, {1}, Modulation::CBOCData, 0.5, kPi, true}};
  }
  // 2.3.1: I + iQ.
  if (signal == "E5a") {
    return pilot_and_data(10.23e6, e5(040503, 050661, codes.e5a_q), from_hex(codes.e5a_secondary, 100),
                          e5(040503, 050661, codes.e5a_i), from_hex("842E9", 20), -kPi / 2);
  }
  if (signal == "E5b") {
    return pilot_and_data(10.23e6, e5(064021, 043143, codes.e5b_q), from_hex(codes.e5b_secondary, 100),
                          e5(064021, 051445, codes.e5b_i), from_hex("E", 4), -kPi / 2);
  }
  return {};
}

std::vector<Component> beidou_components(gnss::SatelliteId id, std::string_view signal) {
  if (id.number < 1 || id.number > std::size(kBeiDouCodes)) return {};
  const BeiDouCodes& codes = kBeiDouCodes[id.number - 1];
  // D2 of geostationary satellites has no secondary code (B1I-3.0, 5.1.1).
  const Chips d1 = gnss::is_beidou_geo(id) ? Chips{1} : from_bits(kNeumanHofman20);
  if (signal == "B1I" || signal == "B2I") return {data_alone(b1i(codes.b1i), 2.046e6, d1)};
  if (signal == "B3I") {
    return {
        data_alone(b2b3(powers({1, 3, 4, 13}), powers({1, 5, 6, 7, 9, 10, 12, 13}), codes.b3i), 10.23e6, d1)};
  }
  // B1C-1.0, 4.2.1 and 4.2.3: 1/2 data + i sqrt(29/44) pilot of BOC(1,1) + sqrt(1/11) pilot of BOC(6,1).
  if (signal == "B1C") {
    Component pilot{truncated_weil(10243, codes.b1c_pilot, 10230),
                    1.023e6,
                    truncated_weil(3607, codes.b1c_secondary, 1800),
                    Modulation::BOC11,
                    29.0 / 44,
                    0,
                    false};
    Component second = pilot;
    second.modulation = Modulation::BOC61;
    second.power_fraction = 4.0 / 44;
    second.phase_rad = -kPi / 2;
    return {std::move(pilot),
            std::move(second),
            {truncated_weil(10243, codes.b1c_data, 10230),
             1.023e6,
             {1},
             Modulation::BOC11,
             0.25,
             -kPi / 2,
             true}};
  }
  // B2a-1.0, 4.2.1: data + i pilot.
  if (signal == "B2a") {
    return pilot_and_data(10.23e6, b2b3(powers({3, 6, 7, 13}), powers({1, 5, 7, 8, 12, 13}), codes.b2a_pilot),
                          truncated_weil(1021, codes.b2a_secondary, 100),
                          b2b3(powers({1, 5, 11, 13}), powers({3, 5, 9, 11, 12, 13}), codes.b2a_data),
                          from_bits("00010"), -kPi / 2);
  }
  if (signal == "B2b")
    return {data_alone(b2b3(powers({1, 9, 10, 13}), powers({3, 4, 6, 9, 12, 13}), codes.b2b), 10.23e6)};
  return {};
}

}  // namespace

std::vector<Component> components(gnss::SatelliteId id, const gnss::Signal& signal) {
  assert(id.system == signal.system);
  switch (id.system) {
    case System::GPS:
      return gps_components(id.number, signal.name);
    case System::QZSS:
      return gps_components(192 + id.number, signal.name);
    case System::SBAS: {
      const int index = id.number - 20;  // PRN 120 is the first
      if (index < 0 || index >= static_cast<int>(std::size(kSbasDelays))) return {};
      return {data_alone(ca(kSbasDelays[index]), 1.023e6)};
    }
    case System::GLONASS:
      // ICD GLONASS L1, L2 (5.1, 2008) 3.3.2.1: the output is stage 7.
      return {data_alone(Register{9, powers({5, 9}), 0x1FF, 1U << 6U}.chips(511), 0.511e6)};
    case System::Galileo:
      return galileo_components(id.number, signal.name);
    case System::BeiDou:
      return beidou_components(id, signal.name);
  }
  assert(false);
  return {};
}

double amplitude(const Component& component) {
  const auto on = component.chips.size() -
                  static_cast<std::size_t>(std::count(component.chips.begin(), component.chips.end(), 0));
  return std::sqrt(component.power_fraction * static_cast<double>(component.chips.size()) /
                   static_cast<double>(on));
}

}  // namespace canyon::samples
