#include "canyon/rinex/observation_codes.hpp"

#include <algorithm>

#include "canyon/base/text.hpp"
#include "canyon/rinex/observation_reader.hpp"

namespace canyon::rinex {
namespace {

using gnss::System;

/// Version 2 does not say which component was tracked: X, but I of BeiDou, whose pilots came later. 2.12 (A
/// for C/A, B for L1C, C for L2C, D for GLONASS's C/A of L2) took 2 away from L2C.
constexpr double k212 = 2.115, k3 = 3;
constexpr Version2Types kVersion2[] = {
    {"GRJS", "1C", "CA", 'A', k212, k3}, {"GRJES", "1C", "C1", '1', 0, k3}, {"GRJ", "1P", "P1", '1', 0, k3},
    {"GJ", "1X", "CB", 'B', k212, k3},   {"GJ", "2X", "CC", 'C', k212, k3}, {"GJ", "2X", "C2", '2', 0, k212},
    {"R", "2C", "CD", 'D', k212, k3},    {"R", "2C", "C2", '2', 0, k3},     {"R", "2P", "P2", '2', 0, k3},
    {"G", "2W", "P2", '2', 0, k3},       {"GJE", "5X", "C5", '5', 0, k3},   {"E", "7X", "C7", '7', 0, k3},
    {"C", "2I", "C2", '2', k212, k3},    {"C", "2I", "C1", '1', 0, k212},   {"C", "7I", "C7", '7', 0, k3},
    {"C", "6I", "C6", '6', 0, k3},
};

/// 3.02 alone calls the band of B1I 1, which is B1C's everywhere else.
bool calls_b1i_band1(System system, double version) {
  return system == System::BeiDou && version > 3.015 && version < 3.025;
}

std::vector<std::string> listed(const gnss::Signal& signal, double version) {
  const bool b1i_band1 = calls_b1i_band1(signal.system, version);
  if (b1i_band1 && signal.code.front() == '1') return {};
  std::vector<std::string> codes{std::string(signal.code)};
  for (const std::string_view code : split_blanks(signal.also_read)) codes.emplace_back(code);
  if (b1i_band1 && signal.code.front() == '2') codes.insert(codes.end(), {"1X", "1Q"});
  return codes;
}

}  // namespace

std::vector<std::string> default_codes(System system, double version) {
  return listed(gnss::signals_of(system).front(), version);
}

std::vector<std::string> signal_codes(const gnss::Signal& signal, double version) {
  std::vector<std::string> codes = listed(signal, version);
  if (gnss::index_of(signal) > 0) return codes;
  for (const gnss::Signal& other : gnss::signals_of(signal.system).subspan(1)) {
    for (const std::string& taken : listed(other, version)) std::erase(codes, taken);
  }
  return codes;
}

std::span<const Version2Types> version2_types() {
  return kVersion2;
}

bool is_known_code(System system, std::string_view code, double version) {
  const std::span<const gnss::Signal> signals = gnss::signals_of(system);
  return std::any_of(signals.begin(), signals.end(), [&](const gnss::Signal& signal) {
    const std::vector<std::string> codes = listed(signal, version);
    return std::find(codes.begin(), codes.end(), code) != codes.end();
  });
}

}  // namespace canyon::rinex
