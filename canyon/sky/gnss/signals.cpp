#include "canyon/sky/gnss/signals.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::gnss {
namespace {

constexpr Modulation BPSK = Modulation::BPSK, TMBOC = Modulation::TMBOC, CBOCPilot = Modulation::CBOCPilot;
constexpr SatelliteBlock IIR = SatelliteBlock::IIR, IIRM = SatelliteBlock::IIRM, IIF = SatelliteBlock::IIF,
                         III = SatelliteBlock::III, All = SatelliteBlock::All,
                         BeiDou2 = SatelliteBlock::BeiDou2,
                         BeiDou3 = SatelliteBlock::BeiDou3 | SatelliteBlock::BeiDou3Geo;
constexpr GroupDelay None = GroupDelay::None, Tgd = GroupDelay::Tgd, Tgd1 = GroupDelay::Tgd1,
                     Tgd2 = GroupDelay::Tgd2, E1 = GroupDelay::BgdE1, E5a = GroupDelay::BgdE5a,
                     E5b = GroupDelay::BgdE5b;

constexpr double kL1 = kL1_hz, kL2 = 1227.6e6, kL5 = 1176.45e6, kE5b = 1207.14e6, kE5 = 1191.795e6,
                 kE6 = 1278.75e6;

/// A signal that is read from recordings and not tracked by any receiver here.
constexpr Signal recorded(Signal signal, std::string_view why) {
  signal.only_recorded = why;
  return signal;
}
constexpr std::string_view kCodes = "its codes and group delay are not modelled";
constexpr std::string_view kSenders = "which satellites send it is not modelled";

// One row a signal: system, name, code, codes also read; carrier, step of channels, modulation, chips, least
// power; blocks, group delay; MSM, SBF, UBX (of geostationary satellites); lines.

// IS-GPS-200 table 3-Va, IS-GPS-800 3.2.1.9, IS-GPS-705 table 3-III (Q5); L2C of IIR-M and IIF: CL, half of
// -160.
constexpr Signal kGps[]{
    {System::GPS, "L1CA", "1C", "1S 1L 1X 1P 1W 1Y", kL1, 0, BPSK, 1.023e6, -158.5, IIR | IIRM | IIF | III,
     Tgd, 2, 0, 0, -1, 1e3},
    {System::GPS, "L1C", "1L", "1X 1S", kL1, 0, TMBOC, 1.023e6, -158.25, III, Tgd, 31, 5},
    {System::GPS, "L2C", "2L", "2S 2X 2C", kL2, 0, BPSK, 1.023e6, -163, IIRM | IIF | III, Tgd, 16, 3, 3},
    {System::GPS, "L5", "5Q", "5X 5I", kL5, 0, BPSK, 10.23e6, -157.9, IIF | III, Tgd, 23, 4, 7},
    recorded({System::GPS, "L2P", "2W", "2P 2Y 2D", kL2, 0, BPSK, 10.23e6, -161.5, IIR | IIRM | IIF | III,
              Tgd, 10, 2},
             "it is encrypted"),
};
// IS-QZSS-PNT table 3.1.1-1 and 3.1.5-1: as GPS.
constexpr Signal kQzss[]{
    {System::QZSS, "L1CA", "1C", "1S 1L 1X 1Z 1B", kL1, 0, BPSK, 1.023e6, -158.5, All, Tgd, 2, 6, 0, -1, 1e3},
    {System::QZSS, "L1C", "1L", "1X 1S", kL1, 0, TMBOC, 1.023e6, -158.25, All, Tgd, 31, 32},
    {System::QZSS, "L2C", "2L", "2S 2X", kL2, 0, BPSK, 1.023e6, -163, All, Tgd, 16, 7, 5},
    {System::QZSS, "L5", "5Q", "5X 5I 5Z 5P 5D", kL5, 0, BPSK, 10.23e6, -157.9, All, Tgd, 23, 26, 9},
    recorded({System::QZSS, "L6", "6L", "6X 6S 6Z 6E", kE6, 0, BPSK, 5.115e6, -156.82, All, Tgd, 10, 27},
             kCodes),  // IS-QZSS-L6
};
// ICD GLONASS L1, L2 (5.1, 2008) 3.3.1.1 and 3.3.1.6; CDMA General Description 1.0 and L1, L2, L3 of 2016.
constexpr Signal kGlonass[]{
    {System::GLONASS, "G1", "1C", "1P", 1602e6, 0.5625e6, BPSK, 0.511e6, -161, All, None, 2, 8, 0, -1, 1e3},
    {System::GLONASS, "G2", "2C", "2P", 1246e6, 0.4375e6, BPSK, 0.511e6, -167, All, GroupDelay::DeltaTau, 8,
     11, 2, -1, 1e3},
    recorded({System::GLONASS, "G3", "3Q", "3X 3I", 1202.025e6, 0, BPSK, 10.23e6, -158, All, None, 0, 12},
             kSenders),
    recorded({System::GLONASS, "G1a", "4B", "4X 4A", 1600.995e6, 0, BPSK, 0.5115e6, -158.5, All, None},
             kSenders),
    recorded({System::GLONASS, "G2a", "6B", "6X 6A", 1248.06e6, 0, BPSK, 0.5115e6, -158.5, All, None},
             kSenders),
};
// OS SIS ICD 2.1, table 12: data and pilot together, as receivers track them; X of RINEX 3.04, table 6. BGDs
// of E5 are broadcast only for its halves.
constexpr Signal kGalileo[]{
    {System::Galileo, "E1", "1X", "1C 1B 1Z", kL1, 0, CBOCPilot, 1.023e6, -157.25, All, E1, 5, 17, 0},
    {System::Galileo, "E5a", "5X", "5Q 5I", kL5, 0, BPSK, 10.23e6, -155.25, All, E5a, 24, 20, 4},
    {System::Galileo, "E5b", "7X", "7Q 7I", kE5b, 0, BPSK, 10.23e6, -155.25, All, E5b, 16, 21, 6},
    recorded({System::Galileo, "E6", "6X", "6C 6B 6Z 6A", kE6, 0, BPSK, 5.115e6, -155.25, All, None, 11, 19},
             kCodes),
    recorded({System::Galileo, "E5", "8X", "8Q 8I", kE5, 0, BPSK, 10.23e6, -152.25, All, E5b, 20, 22},
             "its modulation, AltBOC, is not modelled"),
};
// BDS-SIS-ICD-B1I-3.0, B1C-1.0 (MEO; the pilot's QMBOC has nearly the correlation of TMBOC's power
// fractions), B2I of 2.1, B2a-1.0 (MEO), B3I-1.0, B2b-1.0 (MEO; not on geostationary satellites). TGD2 of
// BeiDou-3 is not for B2b, whose delay is only in B-CNAV3.
constexpr Signal kBeiDou[]{
    {System::BeiDou, "B1I", "2I", "1I 2X 2Q", 1561.098e6, 0, BPSK, 2.046e6, -163, BeiDou2 | BeiDou3, Tgd1, 2,
     28, 0, 1},
    {System::BeiDou, "B1C", "1P", "1X 1D", kL1, 0, TMBOC, 1.023e6, -160.25, BeiDou3, Tgd1, 31, 13, 5},
    {System::BeiDou, "B2I", "7I", "7X 7Q", kE5b, 0, BPSK, 2.046e6, -163, BeiDou2, Tgd2, 14, 29, 2, 3},
    {System::BeiDou, "B2a", "5P", "5X 5D", kL5, 0, BPSK, 10.23e6, -159, BeiDou3, Tgd2, 23, 14, 7},
    {System::BeiDou, "B3I", "6I", "6X 6Q", 1268.52e6, 0, BPSK, 10.23e6, -163, BeiDou2 | BeiDou3, None, 8, 30,
     4, 10},
    {System::BeiDou, "B2b", "7D", "7Z 7P", kE5b, 0, BPSK, 10.23e6, -160, SatelliteBlock::BeiDou3, None, 25,
     34},
    recorded(
        {System::BeiDou, "B2", "8P", "8X 8D", kE5, 0, BPSK, 10.23e6, -156, SatelliteBlock::BeiDou3, Tgd2},
        "its modulation, ACE-BOC, is not modelled"),
};

// RTCA DO-229 A.2 (C/A codes of 1.023 Mchip/s) and ICAO Annex 10, Volume I, 3.7.3.4.4.3; L5 of
// EUROCAE ED-259.
constexpr Signal kSbas[]{
    {System::SBAS, "L1CA", "1C", "", kL1, 0, BPSK, 1.023e6, -161, All, None, 2, 24, 0, -1, 1e3},
    recorded({System::SBAS, "L5", "5I", "5X 5Q", kL5, 0, BPSK, 10.23e6, -158, All, None, 22, 25}, kSenders),
};

/// Whether each row of a table has all required fields.
constexpr bool complete(std::span<const Signal> table, System system) {
  for (const Signal& s : table) {
    const bool received = s.carrier_hz > 1e9 && s.chip_rate_hz > 0 && s.minimum_dbw < 0 && s.msm <= 32;
    if (s.system != system || s.name.empty() || s.code.size() != 2 || !received) return false;
    if (s.sent_by == SatelliteBlock{} || s.group_delay == GroupDelay::Unspecified) return false;
  }
  return !table.empty();
}
static_assert(complete(kGps, System::GPS) && complete(kQzss, System::QZSS) &&
                  complete(kGlonass, System::GLONASS) && complete(kGalileo, System::Galileo) &&
                  complete(kBeiDou, System::BeiDou) && complete(kSbas, System::SBAS),
              "a signal's row lacks its carrier, power, blocks or group delay");
static_assert(std::max({std::size(kGps), std::size(kQzss), std::size(kGlonass), std::size(kGalileo),
                        std::size(kBeiDou), std::size(kSbas)}) <= kMaxSignals,
              "raise kMostSignals (up to 32, the bits of propagation::Path::signals)");

struct BlockName {
  SatelliteBlock block;
  std::string_view name;
};
constexpr BlockName kBlockNames[]{
    {IIR, "GPS-IIR"}, {IIRM, "GPS-IIRM"},    {IIF, "GPS-IIF"},
    {III, "GPS-III"}, {BeiDou2, "BeiDou-2"}, {BeiDou3, "BeiDou-3"},
};

constexpr bool overlap(SatelliteBlock a, SatelliteBlock b) {
  return (static_cast<unsigned>(a) & static_cast<unsigned>(b)) != 0;
}

/// The block that sends as a GPS PRN since a day (GPS constellation status reports); before the day of its
/// first line a PRN has the block of that line.
struct Change {
  int prn;
  int year, month, day;
  SatelliteBlock block;
};
constexpr Change kGpsBlocks[]{
    {1, 2011, 7, 16, SatelliteBlock::IIF},    {2, 2004, 11, 6, SatelliteBlock::IIR},
    {3, 2014, 10, 29, SatelliteBlock::IIF},   {4, 2018, 12, 23, SatelliteBlock::III},
    {5, 2009, 8, 17, SatelliteBlock::IIRM},   {6, 2014, 5, 17, SatelliteBlock::IIF},
    {7, 2008, 3, 15, SatelliteBlock::IIRM},   {8, 2015, 7, 15, SatelliteBlock::IIF},
    {9, 2014, 8, 2, SatelliteBlock::IIF},     {10, 2015, 10, 31, SatelliteBlock::IIF},
    {11, 1999, 10, 7, SatelliteBlock::IIR},   {11, 2021, 6, 17, SatelliteBlock::III},
    {12, 2006, 11, 17, SatelliteBlock::IIRM}, {13, 1997, 7, 23, SatelliteBlock::IIR},
    {14, 2000, 11, 10, SatelliteBlock::IIR},  {14, 2020, 11, 5, SatelliteBlock::III},
    {15, 2007, 10, 17, SatelliteBlock::IIRM}, {16, 2003, 1, 29, SatelliteBlock::IIR},
    {17, 2005, 9, 26, SatelliteBlock::IIRM},  {18, 2001, 1, 30, SatelliteBlock::IIR},
    {18, 2019, 8, 22, SatelliteBlock::III},   {19, 2004, 3, 20, SatelliteBlock::IIR},
    {20, 2000, 5, 11, SatelliteBlock::IIR},   {21, 2003, 3, 31, SatelliteBlock::IIR},
    {22, 2003, 12, 21, SatelliteBlock::IIR},  {23, 2004, 6, 23, SatelliteBlock::IIR},
    {23, 2020, 6, 30, SatelliteBlock::III},   {24, 2012, 10, 4, SatelliteBlock::IIF},
    {25, 2010, 5, 28, SatelliteBlock::IIF},   {26, 2015, 3, 25, SatelliteBlock::IIF},
    {27, 2013, 5, 15, SatelliteBlock::IIF},   {28, 2000, 7, 16, SatelliteBlock::IIR},
    {28, 2023, 1, 18, SatelliteBlock::III},   {29, 2007, 12, 20, SatelliteBlock::IIRM},
    {30, 2014, 2, 21, SatelliteBlock::IIF},   {31, 2006, 9, 25, SatelliteBlock::IIRM},
    {32, 2016, 2, 5, SatelliteBlock::IIF},
};

SatelliteBlock gps_block(int prn, geodesy::GpsTime time) {
  std::optional<SatelliteBlock> block;
  for (const Change& change : kGpsBlocks) {
    if (change.prn != prn) continue;
    geodesy::CalendarTime day;
    day.year = change.year;
    day.month = change.month;
    day.day = change.day;
    if (!block || time >= geodesy::gps_from_calendar(day)) block = change.block;
  }
  return block.value_or(SatelliteBlock::III);
}

SatelliteBlock block_at(SatelliteId id, geodesy::GpsTime time) {
  if (id.system == System::GPS) return gps_block(id.number, time);
  if (id.system != System::BeiDou) return SatelliteBlock::All;
  // BDS-2 has the PRNs to 16, BDS-3 those from 19 (CSNO's constellation list).
  if (id.number <= 16) return SatelliteBlock::BeiDou2;
  return is_beidou_geo(id) ? SatelliteBlock::BeiDou3Geo : SatelliteBlock::BeiDou3;
}

}  // namespace

std::string_view name(Modulation modulation) {
  constexpr std::string_view kNames[]{"BPSK", "BOC(1,1)", "CBOC+", "CBOC-", "TMBOC", "BOC(6,1)"};
  return kNames[static_cast<std::size_t>(modulation)];
}

std::span<const Signal> signals_of(System system) {
  constexpr std::array<std::span<const Signal>, kSystemCount> kTables{kGps,    kGlonass, kGalileo,
                                                                      kBeiDou, kQzss,    kSbas};
  return kTables[static_cast<std::size_t>(system)];
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
  return overlap(signal.sent_by, block_at(id, time));
}

std::string_view block_of(SatelliteId id, geodesy::GpsTime time) {
  const SatelliteBlock block = block_at(id, time);
  for (const BlockName& known : kBlockNames)
    if (overlap(known.block, block)) return known.name;
  return "";
}

std::vector<std::string_view> block_names() {
  std::vector<std::string_view> names;
  for (const BlockName& known : kBlockNames) names.push_back(known.name);
  return names;
}

std::vector<std::string_view> signal_names(bool only_received) {
  std::vector<std::string_view> names;
  for (const System system : kAllSystems) {
    for (const Signal& signal : signals_of(system)) {
      if (only_received && !signal.only_recorded.empty()) continue;
      if (std::find(names.begin(), names.end(), signal.name) == names.end()) names.push_back(signal.name);
    }
  }
  return names;
}

std::array<double, kMaxSignals> group_delays_s(const KeplerEphemeris& e, bool fnav) {
  std::array<double, kMaxSignals> delays{};
  const std::span<const Signal> signals = signals_of(e.id.system);
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const double ratio = signals.front().carrier_hz / signals[i].carrier_hz;
    // Delay of E1 relative to the message's clock; the others add their delay to E1's.
    const double own = fnav ? e.group_delay[0] : e.group_delay[1];
    switch (signals[i].group_delay) {
      case GroupDelay::Tgd:
        delays[i] = ratio * ratio * e.group_delay[0];
        break;
      case GroupDelay::BgdE1:
        delays[i] = own;
        break;
      case GroupDelay::BgdE5a:
        delays[i] = own + (ratio * ratio - 1) * e.group_delay[0];
        break;
      case GroupDelay::BgdE5b:
        delays[i] = own + (ratio * ratio - 1) * e.group_delay[1];
        break;
      case GroupDelay::Tgd1:
        delays[i] = e.group_delay[0];
        break;
      case GroupDelay::Tgd2:
        delays[i] = e.group_delay[1];
        break;
      case GroupDelay::Unspecified:
      case GroupDelay::None:
      case GroupDelay::DeltaTau:  // not in Keplerian messages
        break;
    }
  }
  return delays;
}

}  // namespace canyon::gnss
