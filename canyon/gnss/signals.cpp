#include "canyon/gnss/signals.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

#include "canyon/geodesy/time_scales.hpp"

namespace canyon::gnss {
namespace {

constexpr Modulation BPSK = Modulation::BPSK, TMBOC = Modulation::TMBOC, CBOCPilot = Modulation::CBOCPilot;

constexpr double kL1 = kL1_hz, kL2 = 1227.6e6, kL5 = 1176.45e6, kE5b = 1207.14e6;

// IS-GPS-200 table 3-Va, IS-GPS-800 3.2.1.9, IS-GPS-705 table 3-III (Q5); L2C of IIR-M and IIF: CL, half of
// -160.
constexpr Signal kGps[]{
    {System::GPS, "L1CA", "1C", kL1, 0, BPSK, 1.023e6, -158.5, 1e3},
    {System::GPS, "L1C", "1L", kL1, 0, TMBOC, 1.023e6, -158.25},
    {System::GPS, "L2C", "2L", kL2, 0, BPSK, 1.023e6, -163},
    {System::GPS, "L5", "5Q", kL5, 0, BPSK, 10.23e6, -157.9},
};
// IS-QZSS-PNT table 3.1.1-1 and 3.1.5-1: as GPS.
constexpr Signal kQzss[]{
    {System::QZSS, "L1CA", "1C", kL1, 0, BPSK, 1.023e6, -158.5, 1e3},
    {System::QZSS, "L1C", "1L", kL1, 0, TMBOC, 1.023e6, -158.25},
    {System::QZSS, "L2C", "2L", kL2, 0, BPSK, 1.023e6, -163},
    {System::QZSS, "L5", "5Q", kL5, 0, BPSK, 10.23e6, -157.9},
};
// ICD GLONASS L1, L2 (5.1, 2008) 3.3.1.1 and 3.3.1.6.
constexpr Signal kGlonass[]{
    {System::GLONASS, "G1", "1C", 1602e6, 0.5625e6, BPSK, 0.511e6, -161, 1e3},
    {System::GLONASS, "G2", "2C", 1246e6, 0.4375e6, BPSK, 0.511e6, -167, 1e3},
};
// OS SIS ICD 2.1, table 12: data and pilot together, as receivers track them; X of RINEX 3.04, table 6.
constexpr Signal kGalileo[]{
    {System::Galileo, "E1", "1X", kL1, 0, CBOCPilot, 1.023e6, -157.25},
    {System::Galileo, "E5a", "5X", kL5, 0, BPSK, 10.23e6, -155.25},
    {System::Galileo, "E5b", "7X", kE5b, 0, BPSK, 10.23e6, -155.25},
};
// BDS-SIS-ICD-B1I-3.0, B1C-1.0 (MEO; the pilot's QMBOC has the correlation of TMBOC's power shares nearly),
// B2I of 2.1, B2a-1.0 (MEO), B3I-1.0.
constexpr Signal kBeiDou[]{
    {System::BeiDou, "B1I", "2I", 1561.098e6, 0, BPSK, 2.046e6, -163},
    {System::BeiDou, "B1C", "1P", kL1, 0, TMBOC, 1.023e6, -160.25},
    {System::BeiDou, "B2I", "7I", kE5b, 0, BPSK, 2.046e6, -163},
    {System::BeiDou, "B2a", "5P", kL5, 0, BPSK, 10.23e6, -159},
    {System::BeiDou, "B3I", "6I", 1268.52e6, 0, BPSK, 10.23e6, -163},
};

// RTCA DO-229 A.2 (C/A codes of 1.023 Mchip/s) and ICAO Annex 10, Volume I, 3.7.3.4.4.3.
constexpr Signal kSbas[]{{System::SBAS, "L1CA", "1C", kL1, 0, BPSK, 1.023e6, -161, 1e3}};

enum class Block { IIR, IIRM, IIF, III };

/// Which block sends as a GPS PRN since a day (GPS constellation status reports); before its first line a PRN
/// is of the next one's predecessor by kind, IIR.
struct Change {
  int prn;
  int year, month, day;
  Block block;
};
constexpr Change kGpsBlocks[]{
    {1, 2011, 7, 16, Block::IIF},    {2, 2004, 11, 6, Block::IIR},    {3, 2014, 10, 29, Block::IIF},
    {4, 2018, 12, 23, Block::III},   {5, 2009, 8, 17, Block::IIRM},   {6, 2014, 5, 17, Block::IIF},
    {7, 2008, 3, 15, Block::IIRM},   {8, 2015, 7, 15, Block::IIF},    {9, 2014, 8, 2, Block::IIF},
    {10, 2015, 10, 31, Block::IIF},  {11, 1999, 10, 7, Block::IIR},   {11, 2021, 6, 17, Block::III},
    {12, 2006, 11, 17, Block::IIRM}, {13, 1997, 7, 23, Block::IIR},   {14, 2000, 11, 10, Block::IIR},
    {14, 2020, 11, 5, Block::III},   {15, 2007, 10, 17, Block::IIRM}, {16, 2003, 1, 29, Block::IIR},
    {17, 2005, 9, 26, Block::IIRM},  {18, 2001, 1, 30, Block::IIR},   {18, 2019, 8, 22, Block::III},
    {19, 2004, 3, 20, Block::IIR},   {20, 2000, 5, 11, Block::IIR},   {21, 2003, 3, 31, Block::IIR},
    {22, 2003, 12, 21, Block::IIR},  {23, 2004, 6, 23, Block::IIR},   {23, 2020, 6, 30, Block::III},
    {24, 2012, 10, 4, Block::IIF},   {25, 2010, 5, 28, Block::IIF},   {26, 2015, 3, 25, Block::IIF},
    {27, 2013, 5, 15, Block::IIF},   {28, 2000, 7, 16, Block::IIR},   {28, 2023, 1, 18, Block::III},
    {29, 2007, 12, 20, Block::IIRM}, {30, 2014, 2, 21, Block::IIF},   {31, 2006, 9, 25, Block::IIRM},
    {32, 2016, 2, 5, Block::IIF},
};

Block gps_block(int prn, geodesy::GpsTime time) {
  std::optional<Block> block;
  for (const Change& change : kGpsBlocks) {
    if (change.prn != prn) continue;
    geodesy::CalendarTime day;
    day.year = change.year;
    day.month = change.month;
    day.day = change.day;
    if (!block || time >= geodesy::gps_from_calendar(day)) block = change.block;
  }
  return block.value_or(Block::III);
}

// BDS-2 has the PRNs to 16, BDS-3 those from 19 (CSNO's constellation list).
bool is_second_beidou(int prn) {
  return prn <= 16;
}

bool gps_sends(Block block, std::string_view name) {
  if (name == "L1CA") return true;
  if (name == "L2C") return block != Block::IIR;
  if (name == "L5") return block == Block::IIF || block == Block::III;
  return block == Block::III;  // L1C
}

}  // namespace

std::string_view name(Modulation modulation) {
  switch (modulation) {
    case Modulation::BPSK:
      return "BPSK";
    case Modulation::BOC11:
      return "BOC(1,1)";
    case Modulation::CBOCData:
      return "CBOC+";
    case Modulation::CBOCPilot:
      return "CBOC-";
    case Modulation::TMBOC:
      return "TMBOC";
  }
  assert(false);
  return "";
}

std::span<const Signal> signals_of(System system) {
  switch (system) {
    case System::GPS:
      return kGps;
    case System::GLONASS:
      return kGlonass;
    case System::Galileo:
      return kGalileo;
    case System::BeiDou:
      return kBeiDou;
    case System::QZSS:
      return kQzss;
    case System::SBAS:
      return kSbas;
  }
  assert(false);
  return kGps;
}

std::size_t index_of(const Signal& signal) {
  const std::span<const Signal> all = signals_of(signal.system);
  const auto at =
      std::find_if(all.begin(), all.end(), [&](const Signal& s) { return s.name == signal.name; });
  assert(at != all.end());
  return static_cast<std::size_t>(at - all.begin());
}

double carrier_hz(const Signal& signal, double l1_carrier_hz) {
  if (signal.channel_hz == 0) return signal.carrier_hz;
  const Signal& first = signals_of(signal.system).front();
  return signal.carrier_hz +
         signal.channel_hz * std::round((l1_carrier_hz - first.carrier_hz) / first.channel_hz);
}

bool transmits(SatelliteId id, const Signal& signal, geodesy::GpsTime time) {
  assert(id.system == signal.system);
  if (id.system == System::GPS) return gps_sends(gps_block(id.number, time), signal.name);
  if (id.system == System::BeiDou) {
    const bool second = is_second_beidou(id.number);
    if (signal.name == "B2I") return second;
    if (signal.name == "B1C" || signal.name == "B2a") return !second;
  }
  return true;
}

std::string_view block_of(SatelliteId id, geodesy::GpsTime time) {
  if (id.system == System::BeiDou) return is_second_beidou(id.number) ? "BeiDou-2" : "BeiDou-3";
  if (id.system != System::GPS) return "";
  switch (gps_block(id.number, time)) {
    case Block::IIR:
      return "GPS-IIR";
    case Block::IIRM:
      return "GPS-IIRM";
    case Block::IIF:
      return "GPS-IIF";
    case Block::III:
      break;
  }
  return "GPS-III";
}

std::array<double, kMostSignals> group_delays_s(const KeplerEphemeris& e, bool fnav) {
  std::array<double, kMostSignals> delays{};
  const std::span<const Signal> signals = signals_of(e.id.system);
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const double ratio = signals.front().carrier_hz / signals[i].carrier_hz;
    switch (e.id.system) {
      case System::GPS:
      case System::QZSS:
        delays[i] = ratio * ratio * e.group_delay[0];
        break;
      case System::Galileo: {
        // Of E1 in the message's clock, and from E1 to the others.
        const double own = fnav ? e.group_delay[0] : e.group_delay[1];
        const double bgd = signals[i].name == "E5a" ? e.group_delay[0] : e.group_delay[1];
        delays[i] = i == 0 ? own : own + (ratio * ratio - 1) * bgd;
        break;
      }
      case System::BeiDou:
        delays[i] = signals[i].name.starts_with("B1")   ? e.group_delay[0]
                    : signals[i].name.starts_with("B2") ? e.group_delay[1]
                                                        : 0;
        break;
      case System::GLONASS:
      case System::SBAS:
        break;
    }
  }
  return delays;
}

}  // namespace canyon::gnss
