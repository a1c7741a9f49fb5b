#include "canyon/sky/gnss/satellite_id.hpp"

#include <fmt/format.h>

#include <cctype>
#include <vector>

#include "canyon/base/named.hpp"
#include "canyon/base/text.hpp"

namespace canyon::gnss {

char letter(System system) {
  return "GRECJS"[static_cast<std::size_t>(system)];
}

std::string_view name(System system) {
  constexpr std::array<std::string_view, kSystemCount> kNames{"GPS",    "GLONASS", "Galileo",
                                                              "BeiDou", "QZSS",    "SBAS"};
  return kNames[static_cast<std::size_t>(system)];
}

std::optional<System> system_from_letter(char c) {
  if (c == 'Q') return System::QZSS;  // used by some programs for its satellites
  for (const System system : kAllSystems)
    if (letter(system) == c) return system;
  return std::nullopt;
}

System system_from_name(std::string_view text) {
  const std::string wanted = lower_case(trim(text));
  std::vector<std::string> names;
  for (const System system : kAllSystems) {
    names.emplace_back(name(system));
    if (lower_case(names.back()) == wanted) return system;
  }
  throw unknown_name("satellite system", text, names);
}

std::string to_string(SatelliteId id) {
  return fmt::format("{}{:02d}", letter(id.system), static_cast<int>(id.number));
}

std::optional<SatelliteId> parse_satellite(std::string_view text) {
  text = trim(text);
  if (text.size() < 2 || text.size() > 3) return std::nullopt;
  const auto system =
      system_from_letter(static_cast<char>(std::toupper(static_cast<unsigned char>(text.front()))));
  if (!system) return std::nullopt;
  int number = 0;
  bool digit_seen = false;
  for (const char c : text.substr(1)) {
    if (c == ' ' && !digit_seen) continue;  // "G 5"
    if (c < '0' || c > '9') return std::nullopt;
    digit_seen = true;
    number = 10 * number + (c - '0');
  }
  if (number < 1) return std::nullopt;
  return SatelliteId{*system, static_cast<std::uint8_t>(number)};
}

double l1_frequency_hz(System system, int glonass_channel) {
  switch (system) {
    case System::GPS:
    case System::QZSS:
    case System::Galileo:
    case System::SBAS:
      return 1575.42e6;  // IS-GPS-200 3.3.1.1; IS-QZSS-PNT table 3.1.1-1; OS-SIS-ICD 2.1; RTCA DO-229 A.2
    case System::GLONASS:
      return 1602.0e6 + 0.5625e6 * glonass_channel;  // ICD GLONASS L1, L2 3.3.1.1
    case System::BeiDou:
      return 1561.098e6;  // BDS-SIS-ICD B1I 4.2.1
  }
  return 0;
}

}  // namespace canyon::gnss
