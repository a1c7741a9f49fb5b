#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

namespace canyon::test {

/// A header line of RINEX: content in columns 1 to 60, then the label.
inline std::string header_line(const std::string& content, const std::string& label) {
  return fmt::format("{:<60}{:<20}\n", content, label);
}

/// F14.3, loss-of-lock and signal-strength digits; "" is a blank field.
inline std::string field(double value, char lock = ' ', char strength = ' ') {
  return fmt::format("{:14.3f}{}{}", value, lock, strength);
}
inline std::string blank_field(char lock = ' ') {
  std::string blank(16, ' ');
  blank[14] = lock;
  return blank;
}

/// RINEX 3.04, GPS, GLONASS, Galileo and BeiDou: types in different orders, a system without L1, SBAS.
inline std::string observations3() {
  return header_line("     3.04           OBSERVATION DATA    M: MIXED", "RINEX VERSION / TYPE") +
         header_line("Receiver tool       somebody            20190428 000000 UTC", "PGM / RUN BY / DATE") +
         header_line("ROOF", "MARKER NAME") +
         header_line("12345               M8T                 3.01", "REC # / TYPE / VERS") +
         header_line("1                   PATCH", "ANT # / TYPE") +
         header_line(" -2419215.8865  5385498.5603  2405403.6314", "APPROX POSITION XYZ") +
         header_line("        1.5000        0.2500       -0.1250", "ANTENNA: DELTA H/E/N") +
         // 14 types: one more than fits in a line.
         header_line("G   14 C1C L1C D1C S1C C1W L1W D1W S1W C2W L2W D2W S2W C5Q", "SYS / # / OBS TYPES") +
         header_line("       L5Q", "SYS / # / OBS TYPES") +
         header_line("R    4 C1C L1C D1C S1C", "SYS / # / OBS TYPES") +
         header_line("E    4 S1X D1X L1X C1X", "SYS / # / OBS TYPES") +
         header_line("C    4 C2I L2I D2I S2I", "SYS / # / OBS TYPES") +
         header_line("S    2 C1C S1C", "SYS / # / OBS TYPES") +
         header_line("E  100  1 D1X", "SYS / SCALE FACTOR") + header_line("DBHZ", "SIGNAL STRENGTH UNIT") +
         header_line("     0.500", "INTERVAL") +
         header_line("  2019     4    28    12    44   33.9970000     GPS", "TIME OF FIRST OBS") +
         header_line("  2 R07  5 R10 -7", "GLONASS SLOT / FRQ #") + header_line("    18", "LEAP SECONDS") +
         header_line("", "END OF HEADER");
}

/// RINEX 2.11, mixed, seven types: two lines for a satellite.
inline std::string observations2(const std::string& time_system = "GPS") {
  return header_line("     2.11           OBSERVATION DATA    M (MIXED)", "RINEX VERSION / TYPE") +
         header_line("     1     1", "WAVELENGTH FACT L1/2") +
         header_line("    10    L1    L2    C1    P1    P2    D1    D2    S1    S2", "# / TYPES OF OBSERV") +
         header_line("          C2", "# / TYPES OF OBSERV") +
         header_line("  2019     4    28    12    44   34.0000000     " + time_system, "TIME OF FIRST OBS") +
         header_line("", "END OF HEADER");
}

}  // namespace canyon::test
