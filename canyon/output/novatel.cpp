// Declared in canyon/output/formats.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/output/formats.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/observations/device_epochs.hpp"
#include "canyon/output/ubx/fix_codes.hpp"
#include "canyon/transport/readers.hpp"

// Logs of a NovAtel receiver in ASCII (OEM7 Commands and Logs Reference Manual, v22: 1.1.1
// format, 3.17 BESTPOS, 3.22 BESTVEL, 3.61 HEADING2, 3.147 PSRDOP, 3.154 RANGE, 3.220 TIME).

namespace canyon::output {
namespace {

using positioning::Fix;
using positioning::FixKind;

/// CRC-32 of a log between '#' and '*': the polynomial of Ethernet, from 0, not inverted (1.7).
std::uint32_t checksum(std::string_view text) {
  constexpr std::uint32_t kPolynomial = 0xEDB88320;
  std::uint32_t crc = 0;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1U ^ ((crc & 1U) != 0 ? kPolynomial : 0U);
  }
  return crc;
}

std::string log_of(std::string_view name, const DeviceEpoch& epoch, geodesy::GpsTime time,
                   std::string_view body) {
  const std::string text = fmt::format(
      "{},COM1,0,50.0,{},{},{},00000000,0000,32768;{}", name, epoch.time_known ? "FINESTEERING" : "UNKNOWN",
      epoch.time_known ? time.week() : 0, epoch.time_known ? seconds_of_week(time) : "0.000", body);
  return fmt::format("#{}*{:08x}\r\n", text, checksum(text));
}

/// Numbers of a signal: type in the tracking status (table 157), bit in the masks of a fix (tables 97 and
/// 98).
struct Numbers {
  std::string_view signal;
  unsigned type;
  bool in_second_mask;  ///< Galileo's and BeiDou's, else GPS' and GLONASS'
  unsigned mask;
};
constexpr std::array kNumbers{Numbers{"L1CA", 0, false, 1U << 0U}, Numbers{"L1C", 16, false, 1U << 0U},
                              Numbers{"L2C", 17, false, 1U << 1U}, Numbers{"L2P", 9, false, 1U << 1U},
                              Numbers{"L5", 14, false, 1U << 2U},  Numbers{"G1", 0, false, 1U << 4U},
                              Numbers{"G2", 1, false, 1U << 5U},   Numbers{"E1", 2, true, 1U << 0U},
                              Numbers{"E5a", 12, true, 1U << 1U},  Numbers{"E5b", 17, true, 1U << 2U},
                              Numbers{"B1I", 0, true, 1U << 4U},   Numbers{"B1C", 7, true, 1U << 4U},
                              Numbers{"B2I", 1, true, 1U << 5U},   Numbers{"B2a", 9, true, 1U << 5U},
                              Numbers{"B3I", 2, true, 1U << 6U},   Numbers{"B2b", 11, true, 1U << 5U}};

const Numbers* numbers_of(const gnss::Signal& signal) {
  const auto* const found = std::find_if(kNumbers.begin(), kNumbers.end(),
                                         [&](const Numbers& each) { return each.signal == signal.name; });
  return found == kNumbers.end() ? nullptr : found;
}

/// The four last fields of a fix: reserved, extended status, and the masks of the signals in it.
std::string masks(const DeviceEpoch& epoch) {
  std::array<unsigned, 2> bits{};
  for (const receiver::SatelliteObservation& s : epoch.seen.satellites) {
    if (!s.used || !s.measurement || !epoch.seen.fix.measured()) continue;
    const Numbers* numbers =
        numbers_of(s.signal != nullptr ? *s.signal : gnss::signals_of(s.id.system).front());
    if (numbers != nullptr) bits.at(numbers->in_second_mask ? 1 : 0) |= numbers->mask;
  }
  return fmt::format("0,00,{:02x},{:02x}", bits[1], bits[0]);
}

std::string_view status_of(const Fix& fix) {
  return fix.solved() ? "SOL_COMPUTED" : "INSUFFICIENT_OBS";
}

std::string_view position_type(const Fix& fix) {
  return codes_of(fix.kind()).novatel;
}

std::size_t tracked(const DeviceEpoch& epoch) {
  return static_cast<std::size_t>(std::count_if(epoch.seen.satellites.begin(), epoch.seen.satellites.end(),
                                                [](const auto& s) { return s.measurement.has_value(); }));
}

std::string best_position(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  const bool known = fix.solved();
  const geodesy::Geodetic place = known ? fix.position : geodesy::Geodetic{};
  const auto sigma = [&](int axis) {
    return known ? std::sqrt(std::max(0.0, fix.covariance_enu(axis, axis))) : 0;
  };
  const std::size_t used = fix.used.size();
  return fmt::format(
      "{},{},{:.11f},{:.11f},{:.4f},{:.4f},WGS84,{:.4f},{:.4f},{:.4f},\"{}\",{:.3f},0.000,{},{},{},0,{}",
      status_of(fix), position_type(fix), geodesy::degrees(place.latitude_rad),
      geodesy::degrees(place.longitude_rad), known ? place.height_m - epoch.geoid_undulation_m : 0,
      known ? epoch.geoid_undulation_m : 0, sigma(1), sigma(0), sigma(2),
      fix.correction_station ? std::to_string(*fix.correction_station) : "", fix.correction_age_s.value_or(0),
      tracked(epoch), used, used, masks(epoch));
}

std::string best_velocity(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  const bool known = fix.solved() && fix.velocity_enu_mps.has_value();
  const Eigen::Vector3d v = known ? *fix.velocity_enu_mps : Eigen::Vector3d(Eigen::Vector3d::Zero());
  const double course_deg = geodesy::degrees(std::atan2(v.x(), v.y()));
  return fmt::format("{},{},0.000,{:.3f},{:.4f},{:.6f},{:.4f},0.0",
                     known ? "SOL_COMPUTED" : "INSUFFICIENT_OBS", known ? "DOPPLER_VELOCITY" : "NONE",
                     fix.correction_age_s.value_or(0), v.head<2>().norm(),
                     course_deg < 0 ? course_deg + 360 : course_deg, v.z());
}

/// The number of a satellite: GLONASS by slot from 38, the others as in RINEX, SBAS and QZSS by their PRN.
int satellite_number(gnss::SatelliteId id) {
  constexpr int kGlonass = 37, kSbas = 100, kQzss = 192;
  switch (id.system) {
    case gnss::System::GLONASS:
      return id.number + kGlonass;
    case gnss::System::SBAS:
      return id.number + kSbas;
    case gnss::System::QZSS:
      return id.number + kQzss;
    default:
      return id.number;
  }
}

std::string dilutions(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  const positioning::Dop dop = fix.solved() && fix.dop ? *fix.dop : positioning::Dop{};
  std::string text = fmt::format("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},0.0,{}", dop.gdop, dop.pdop, dop.hdop,
                                 std::hypot(dop.hdop, dop.tdop), dop.tdop, fix.used.size());
  for (const gnss::SatelliteId id : fix.used) text += fmt::format(",{}", satellite_number(id));
  return text;
}

std::string time_of(const DeviceEpoch& epoch) {
  const geodesy::CalendarTime utc = geodesy::utc_from_gps(epoch.seen.stated_utc());
  return fmt::format(
      "{},0.000000000e+00,1.000000000e-08,{:.11f},{},{},{},{},{},{},{}",
      epoch.time_known ? "VALID" : "INVALID", -static_cast<double>(geodesy::leap_seconds(epoch.seen.time)),
      utc.year, utc.month, utc.day, utc.hour, utc.minute,
      std::int64_t{utc.second} * 1000 + utc.nanosecond / 1'000'000, epoch.time_known ? "VALID" : "INVALID");
}

/// Empty without a second antenna: a moving base behind this one.
std::string heading(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  if (!fix.baseline || !fix.baseline->moving_base) return {};
  const positioning::Baseline& vector = *fix.baseline;
  const Eigen::Vector3d along = vector.vector_enu.normalized();
  // Across the vector in the vertical plane.
  const Eigen::Vector3d up = (Eigen::Vector3d::UnitZ() - along.z() * along).normalized();
  const double pitch_sigma =
      std::sqrt(std::max(0.0, up.dot(vector.covariance_enu * up))) / std::max(1e-3, vector.length_m());
  return fmt::format("{},{},{:.4f},{:.4f},{:.4f},0.0,{:.4f},{:.4f},\"0\",\"0\",{},{},{},0,{}", status_of(fix),
                     vector.kind == FixKind::Fixed ? "NARROW_INT" : "NARROW_FLOAT", vector.length_m(),
                     geodesy::degrees(vector.heading_rad()), geodesy::degrees(vector.pitch_rad()),
                     geodesy::degrees(vector.heading_sigma_rad()), geodesy::degrees(pitch_sigma),
                     tracked(epoch), vector.used.size(), vector.used.size(), masks(epoch));
}

unsigned system_number(gnss::System system) {
  // GPS, GLONASS, Galileo, BeiDou, QZSS, SBAS.
  constexpr std::array kSystems{0U, 1U, 3U, 4U, 5U, 2U};
  return kSystems.at(static_cast<std::size_t>(system));
}

std::string ranges(const DeviceEpoch& epoch) {
  constexpr int kMiddleChannel = 7;
  std::string list;
  std::size_t count = 0;
  const auto& observations = epoch.raw.observations;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const RawObservation& o = observations[i];
    const Numbers* numbers = numbers_of(*o.signal);
    if (numbers == nullptr) continue;
    const auto same = [&](std::size_t k) { return k < observations.size() && observations[k].id == o.id; };
    const bool first = i == 0 || !same(i - 1);
    const bool phase = o.carrier_phase_cycles.has_value();
    unsigned status = phase ? 4U : 3U;  // phase lock, or frequency lock
    status |= static_cast<unsigned>(count & 31U) << 5U | (phase ? 1U << 10U : 0U);
    status |= phase && !o.measurement->half_cycle ? 1U << 11U : 0U;
    status |= 1U << 12U | 1U << 13U | system_number(o.id.system) << 16U;  // code lock, a standard correlator
    status |= (!first || same(i + 1) ? 1U << 20U : 0U) | numbers->type << 21U;
    status |= (first ? 1U << 27U : 0U) | (phase && o.measurement->half_cycle ? 1U << 28U : 0U);
    const auto channel = epoch.glonass_channels.find(o.id);
    const int frequency = channel == epoch.glonass_channels.end() ? 0 : channel->second + kMiddleChannel;
    list += fmt::format(",{},{},{:.3f},{:.3f},{:.6f},{:.6f},{:.3f},{:.1f},{:.3f},{:08x}",
                        satellite_number(o.id), o.id.system == gnss::System::GLONASS ? frequency : 0,
                        o.pseudorange_m, o.measurement->sigma_m, phase ? -*o.carrier_phase_cycles : 0.0,
                        phase ? o.measurement->carrier_phase_sigma_cycles : 0.0, o.doppler_hz.value_or(0),
                        o.measurement->cn0_dbhz.value_or(0), o.locked_s, status);
    ++count;
  }
  return fmt::format("{}{}", count, list);
}

struct Log {
  std::string_view name;  ///< in lower case
  std::string (*body)(const DeviceEpoch&);
};
constexpr std::array kLogs{Log{"timea", time_of},          Log{"bestposa", best_position},
                           Log{"bestvela", best_velocity}, Log{"psrdopa", dilutions},
                           Log{"heading2a", heading},      Log{"rangea", ranges}};

/// A NovAtel receiver at the other end of a line: LOG, UNLOG, UNLOGALL, RESET and FRESET, and logs of each
/// epoch. Other commands are acknowledged and have no effect, since the scenario defines the receiver.
class NovatelDevice final : public Encoder {
 public:
  explicit NovatelDevice(const ReceiverDescription& receiver)
      : epochs_(receiver.glonass_channels, receiver.begin, Tags::WholeMilliseconds) {
    interval_ms_.fill(0);
  }

  std::string encode(const simulation::Epoch& epoch) override {
    const DeviceEpoch told = epochs_.next(epoch);
    const std::int64_t ms = told.stated.nanoseconds() / 1'000'000;
    std::string text;
    for (std::size_t i = 0; i < kLogs.size(); ++i) {
      if (!interval_ms_.at(i)) continue;
      const std::int64_t turn = *interval_ms_.at(i) > 0 ? ms / *interval_ms_.at(i) : ms;
      if (std::exchange(turn_.at(i), turn) == turn) continue;
      const std::string body = kLogs.at(i).body(told);
      if (body.empty()) continue;
      const bool measured = kLogs.at(i).body == ranges;
      std::string name(kLogs.at(i).name);
      std::transform(name.begin(), name.end(), name.begin(),
                     [](char c) { return static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c); });
      text += log_of(name, told, measured ? epoch.observed.stated(told.raw.tag) : told.stated, body);
    }
    return text;
  }

  std::string receive(std::uint64_t reader, std::string_view bytes) override {
    constexpr std::size_t kLongest = 1024;
    epochs_.receive(bytes);
    std::string answer;
    lines_.of(reader, kLongest).receive(bytes, [&](std::optional<std::string_view> line) {
      if (line) answer += execute(*line);
    });
    return answer;
  }
  std::vector<std::shared_ptr<const relative::Corrections>> take_corrections() override {
    return epochs_.take_corrections();
  }
  std::optional<disturbance::RestartKind> take_restart() override {
    return std::exchange(restart_, std::nullopt);
  }

 private:
  static constexpr std::string_view kDone = "\r\n<OK\r\n[COM1]";

  /// Empty for what is no command: the rest of RTCM 3, lines of blanks.
  std::string execute(std::string_view line) {
    if (std::any_of(line.begin(), line.end(), [](char c) {
          return (static_cast<unsigned char>(c) < ' ' && c != '\r') || (c & 0x80) != 0;
        })) {
      return {};
    }
    std::vector<std::string> words;
    for (const std::string_view word : split(trim(line), ' ')) {
      if (!word.empty()) words.push_back(lower_case(word));
    }
    if (words.empty()) return {};
    const auto is_port = [](const std::string& word) {
      return word.starts_with("com") || word.starts_with("usb") || word.starts_with("thisport");
    };
    const std::string command = words.front();
    words.erase(words.begin());
    if (!words.empty() && is_port(words.front())) words.erase(words.begin());
    if (command == "unlogall") {
      interval_ms_.fill(std::nullopt);
    } else if (command == "log" || command == "unlog") {
      const auto* const log =
          words.empty() ? kLogs.end() : std::find_if(kLogs.begin(), kLogs.end(), [&](const Log& each) {
            return each.name == words.front();
          });
      if (log == kLogs.end()) return "\r\n<ERROR:Invalid Message ID\r\n[COM1]";
      const auto i = static_cast<std::size_t>(log - kLogs.begin());
      if (command == "unlog") {
        interval_ms_.at(i).reset();
      } else if (const auto interval = interval_of(words)) {
        if (std::exchange(told_to_, true) == false) interval_ms_.fill(std::nullopt);
        interval_ms_.at(i) = interval;
      } else {
        return "\r\n<ERROR:Invalid Message Field\r\n[COM1]";
      }
    } else if (command == "reset" || command == "freset") {
      restart_ = command == "reset" ? disturbance::RestartKind::Hot : disturbance::RestartKind::Cold;
    }
    return std::string(kDone);
  }

  /// "ontime 0.1", "onnew", "onchanged", "once"; milliseconds, 0: at each epoch.
  static std::optional<std::int64_t> interval_of(const std::vector<std::string>& words) {
    if (words.size() < 2 || words[1] != "ontime") return 0;
    const std::optional<double> seconds = words.size() < 3 ? std::nullopt : parse_double(words[2]);
    if (!seconds || !(*seconds >= 0.001 && *seconds <= 1e6)) return std::nullopt;
    return std::llround(*seconds * 1e3);
  }

  DeviceEpochs epochs_;
  std::array<std::optional<std::int64_t>, kLogs.size()> interval_ms_;  ///< 0: each epoch; empty: off
  std::array<std::int64_t, kLogs.size()> turn_{};
  bool told_to_ = false;  ///< the first LOG replaces what is sent from the start
  transport::Readers<transport::LineCutter> lines_;
  std::optional<disturbance::RestartKind> restart_;
};

}  // namespace

std::unique_ptr<Encoder> encode_novatel(const ReceiverDescription& receiver) {
  return std::make_unique<NovatelDevice>(receiver);
}

}  // namespace canyon::output
