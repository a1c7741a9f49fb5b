#include "canyon/rinex/observation_codes.hpp"

#include <algorithm>
#include <cassert>

#include "canyon/base/text.hpp"
#include "canyon/rinex/observation_reader.hpp"

namespace canyon::rinex {
namespace {

using gnss::System;

/// Codes that are read as a signal, best first. That of a system's first signal stands for the band near L1:
/// it ends with codes that are another's, or encrypted, and better than nothing.
struct SignalCodes {
  System system;
  std::string_view signal;  ///< gnss::Signal::name
  std::string_view codes;
};
constexpr SignalCodes kCodes[] = {
    {System::GPS, "L1CA", "1C 1S 1L 1X 1P 1W 1Y"},
    {System::GPS, "L1C", "1L 1X 1S"},
    {System::GPS, "L2C", "2L 2S 2X"},
    {System::GPS, "L5", "5Q 5X 5I"},
    {System::GLONASS, "G1", "1C 1P"},
    {System::GLONASS, "G2", "2C 2P"},
    {System::Galileo, "E1", "1X 1C 1B 1Z"},
    {System::Galileo, "E5a", "5X 5Q 5I"},
    {System::Galileo, "E5b", "7X 7Q 7I"},
    {System::BeiDou, "B1I", "2I 1I 2X 2Q"},
    {System::BeiDou, "B1C", "1P 1X 1D"},
    {System::BeiDou, "B2I", "7I 7X 7Q"},
    {System::BeiDou, "B2a", "5P 5X 5D"},
    {System::BeiDou, "B3I", "6I 6X 6Q"},
    {System::QZSS, "L1CA", "1C 1S 1L 1X 1Z 1B"},
    {System::QZSS, "L1C", "1L 1X 1S"},
    {System::QZSS, "L2C", "2L 2S 2X"},
    {System::QZSS, "L5", "5Q 5X 5I"},
    {System::SBAS, "L1CA", "1C"},
};

/// Version 2 does not say which component was tracked: X, but I of BeiDou, whose pilots came later. 2.12 (A
/// for C/A, B for L1C, C for L2C, D for GLONASS's C/A of L2) took 2 away from L2C.
constexpr double k212 = 2.115, k3 = 3;
constexpr Version2Types kVersion2[] = {
    {"GRJS", "1C", "CA", 'A', k212, k3}, {"GRJES", "1C", "C1", '1', 0, k3}, {"GRJ", "1P", "P1", '1', 0, k3},
    {"GJ", "1X", "CB", 'B', k212, k3},   {"GJ", "2X", "CC", 'C', k212, k3}, {"GJ", "2X", "C2", '2', 0, k212},
    {"R", "2C", "CD", 'D', k212, k3},    {"R", "2C", "C2", '2', 0, k3},     {"R", "2P", "P2", '2', 0, k3},
    {"GJE", "5X", "C5", '5', 0, k3},     {"E", "7X", "C7", '7', 0, k3},     {"C", "2I", "C2", '2', k212, k3},
    {"C", "2I", "C1", '1', 0, k212},     {"C", "7I", "C7", '7', 0, k3},     {"C", "6I", "C6", '6', 0, k3},
};

/// 3.02 alone calls the band of B1I 1, which is B1C's everywhere else.
bool calls_b1i_band1(System system, double version) {
  return system == System::BeiDou && version > 3.015 && version < 3.025;
}

std::vector<std::string> listed(System system, std::string_view signal, double version) {
  const auto row = std::find_if(std::begin(kCodes), std::end(kCodes), [&](const SignalCodes& c) {
    return c.system == system && c.signal == signal;
  });
  if (row == std::end(kCodes)) return {};
  std::string_view codes = row->codes;
  if (calls_b1i_band1(system, version)) {
    if (signal == "B1I") codes = "2I 1I 2X 2Q 1X 1Q";
    if (signal == "B1C") codes = "";
  }
  std::vector<std::string> result;
  for (const std::string_view code : split_blanks(codes)) result.emplace_back(code);
  return result;
}

}  // namespace

std::vector<std::string> default_codes(System system, double version) {
  return listed(system, gnss::signals_of(system).front().name, version);
}

std::vector<std::string> signal_codes(const gnss::Signal& signal, double version) {
  std::vector<std::string> codes = listed(signal.system, signal.name, version);
  if (gnss::index_of(signal) > 0) return codes;
  for (const gnss::Signal& other : gnss::signals_of(signal.system).subspan(1)) {
    for (const std::string& taken : listed(other.system, other.name, version)) std::erase(codes, taken);
  }
  return codes;
}

std::span<const Version2Types> version2_types() {
  return kVersion2;
}

bool is_known_code(System system, std::string_view code, double version) {
  const std::span<const gnss::Signal> signals = gnss::signals_of(system);
  return std::any_of(signals.begin(), signals.end(), [&](const gnss::Signal& signal) {
    const std::vector<std::string> codes = listed(system, signal.name, version);
    return std::find(codes.begin(), codes.end(), code) != codes.end();
  });
}

}  // namespace canyon::rinex
