// Declared in canyon/output/formats.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/payload.hpp"
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

// Logs of a NovAtel receiver in ASCII and binary (OEM7 Commands and Logs Reference Manual, v22: 1.1.1
// and 1.1.3 formats, 3.17 BESTPOS, 3.22 BESTVEL, 3.61 HEADING2, 3.147 PSRDOP, 3.154 RANGE, 3.220 TIME).

namespace canyon::output {
namespace {

using positioning::Fix;
using positioning::FixKind;

/// CRC-32 of a log in front of its checksum: the polynomial of Ethernet, from 0, not inverted (1.7).
std::uint32_t checksum(std::string_view text) {
  constexpr std::uint32_t kPolynomial = 0xEDB88320;
  std::uint32_t crc = 0;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1U ^ ((crc & 1U) != 0 ? kPolynomial : 0U);
  }
  return crc;
}

enum class Encoding : std::uint8_t { Ascii, Binary };

/// A value of an enumeration: its number in binary logs, its name in ASCII.
struct Choice {
  std::uint32_t number;
  std::string_view name;
};

/// The body of a log in the making, field by field.
class Fields {
 public:
  explicit Fields(Encoding encoding) : encoding_(encoding) {}

  Fields& choice(const Choice& value) {
    return add(std::string(value.name), [&] { binary_.u4(value.number); });
  }
  /// Bytes of a whole number that is not negative.
  template <int kBytes, typename T>
  Fields& whole(T value) {
    return add(std::to_string(value), [&] { put<kBytes>(value); });
  }
  template <int kBytes>
  Fields& hexadecimal(std::uint32_t value) {
    return add(fmt::format("{:0{}x}", value, 2 * kBytes), [&] { put<kBytes>(value); });
  }
  Fields& r4(double value, int decimals) {
    return add(fixed(value, decimals), [&] { binary_.r4(static_cast<float>(value)); });
  }
  Fields& r8(double value, int decimals) {
    return add(fixed(value, decimals), [&] { binary_.r8(value); });
  }
  /// The name of a station, four characters.
  Fields& station(const std::string& name) {
    return add('"' + name + '"', [&] { binary_.text(name, 4); });
  }

  [[nodiscard]] const std::string& body() const {
    return encoding_ == Encoding::Ascii ? text_ : binary_.bytes();
  }

 private:
  template <typename Put>
  Fields& add(const std::string& text, const Put& put_binary) {
    if (encoding_ == Encoding::Binary) {
      put_binary();
    } else {
      text_.append(text_.empty() ? "" : ",").append(text);
    }
    return *this;
  }
  template <int kBytes, typename T>
  void put(T value) {
    binary_.unsigned_field(static_cast<double>(value), 1, kBytes);
  }

  Encoding encoding_;
  std::string text_;
  Payload binary_;
};

/// @param name of an ASCII log, in capitals; @param number of a binary one
std::string log_of(std::string_view name, std::uint16_t number, Encoding encoding, bool time_known,
                   geodesy::GpsTime time, const std::string& body) {
  constexpr std::uint32_t kVersion = 32768;
  if (encoding == Encoding::Ascii) {
    const std::string text = fmt::format(
        "{}A,COM1,0,50.0,{},{},{},00000000,0000,{};{}", name, time_known ? "FINESTEERING" : "UNKNOWN",
        time_known ? time.week() : 0, time_known ? seconds_of_week(time) : "0.000", kVersion, body);
    return fmt::format("#{}*{:08x}\r\n", text, checksum(text));
  }
  constexpr std::uint8_t kHeader = 28, kCom1 = 32, kHalfIdle = 100, kUnknown = 20, kFineSteering = 180;
  Payload log;
  log.raw("\xAA\x44\x12").u1(kHeader).u2(number).u1(0).u1(kCom1).u2(body.size()).u2(0);
  log.u1(kHalfIdle).u1(time_known ? kFineSteering : kUnknown).u2(time_known ? time.week() : 0);
  log.u4(time_known ? time.nanosecond_of_week() / 1'000'000 : 0).u4(0).u2(0).u2(kVersion).raw(body);
  return log.u4(checksum(log.bytes())).bytes();
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

/// The five last fields of a fix: satellites with several signals (not told), reserved, extended status, and
/// the masks of the signals in it.
void add_masks(const DeviceEpoch& epoch, Fields& log) {
  std::array<unsigned, 2> bits{};
  for (const receiver::SatelliteObservation& s : epoch.seen.satellites) {
    if (!s.used || !s.measurement || !epoch.seen.fix.measured()) continue;
    const Numbers* numbers =
        numbers_of(s.signal != nullptr ? *s.signal : gnss::signals_of(s.id.system).front());
    if (numbers != nullptr) bits.at(numbers->in_second_mask ? 1 : 0) |= numbers->mask;
  }
  log.whole<1>(0).whole<1>(0).hexadecimal<1>(0).hexadecimal<1>(bits[1]).hexadecimal<1>(bits[0]);
}

Choice status_of(bool known) {
  return known ? Choice{0, "SOL_COMPUTED"} : Choice{1, "INSUFFICIENT_OBS"};
}

Choice position_type(FixKind kind) {
  const FixCodes& codes = codes_of(kind);
  return {codes.novatel_type, codes.novatel_name};
}

std::size_t tracked(const DeviceEpoch& epoch) {
  return static_cast<std::size_t>(std::count_if(epoch.seen.satellites.begin(), epoch.seen.satellites.end(),
                                                [](const auto& s) { return s.measurement.has_value(); }));
}

void best_position(const DeviceEpoch& epoch, Fields& log) {
  constexpr Choice kWgs84{61, "WGS84"};
  const Fix& fix = epoch.seen.fix;
  const bool known = fix.solved();
  const geodesy::Geodetic place = known ? fix.position : geodesy::Geodetic{};
  const auto sigma = [&](int axis) {
    return known ? std::sqrt(std::max(0.0, fix.covariance_enu(axis, axis))) : 0;
  };
  log.choice(status_of(known)).choice(position_type(fix.kind()));
  log.r8(geodesy::degrees(place.latitude_rad), 11).r8(geodesy::degrees(place.longitude_rad), 11);
  log.r8(known ? place.height_m - epoch.geoid_undulation_m : 0, 4)
      .r4(known ? epoch.geoid_undulation_m : 0, 4);
  log.choice(kWgs84).r4(sigma(1), 4).r4(sigma(0), 4).r4(sigma(2), 4);
  log.station(fix.correction_station ? std::to_string(*fix.correction_station) : "");
  log.r4(fix.correction_age_s.value_or(0), 3).r4(0, 3).whole<1>(tracked(epoch));
  log.whole<1>(fix.used.size()).whole<1>(fix.used.size());
  add_masks(epoch, log);
}

void best_velocity(const DeviceEpoch& epoch, Fields& log) {
  const Fix& fix = epoch.seen.fix;
  const bool known = fix.solved() && fix.velocity_enu_mps.has_value();
  const Eigen::Vector3d v = known ? *fix.velocity_enu_mps : Eigen::Vector3d(Eigen::Vector3d::Zero());
  const double course_deg = geodesy::degrees(std::atan2(v.x(), v.y()));
  log.choice(status_of(known)).choice(known ? Choice{8, "DOPPLER_VELOCITY"} : position_type(FixKind::None));
  log.r4(0, 3).r4(fix.correction_age_s.value_or(0), 3).r8(v.head<2>().norm(), 4);
  log.r8(course_deg < 0 ? course_deg + 360 : course_deg, 6).r8(v.z(), 4).r4(0, 1);
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

void dilutions(const DeviceEpoch& epoch, Fields& log) {
  const Fix& fix = epoch.seen.fix;
  const positioning::Dop dop = fix.solved() && fix.dop ? *fix.dop : positioning::Dop{};
  log.r4(dop.gdop, 4).r4(dop.pdop, 4).r4(dop.hdop, 4).r4(std::hypot(dop.hdop, dop.tdop), 4).r4(dop.tdop, 4);
  log.r4(0, 1).whole<4>(fix.used.size());
  for (const gnss::SatelliteId id : fix.used) log.whole<4>(satellite_number(id));
}

void time_of(const DeviceEpoch& epoch, Fields& log) {
  const geodesy::CalendarTime utc = geodesy::utc_from_gps(epoch.seen.stated_utc());
  constexpr double kClockSigma_s = 1e-8;
  log.choice(epoch.time_known ? Choice{0, "VALID"} : Choice{3, "INVALID"}).r8(0, 9).r8(kClockSigma_s, 9);
  log.r8(-static_cast<double>(geodesy::leap_seconds(epoch.seen.time)), 11);
  log.whole<4>(utc.year).whole<1>(utc.month).whole<1>(utc.day).whole<1>(utc.hour).whole<1>(utc.minute);
  log.whole<4>(std::int64_t{utc.second} * 1000 + utc.nanosecond / 1'000'000);
  log.choice(epoch.time_known ? Choice{1, "VALID"} : Choice{0, "INVALID"});
}

/// Nothing without a second antenna: a moving base behind this one.
void heading(const DeviceEpoch& epoch, Fields& log) {
  const Fix& fix = epoch.seen.fix;
  if (!fix.baseline || !fix.baseline->moving_base) return;
  const positioning::Baseline& vector = *fix.baseline;
  const Eigen::Vector3d along = vector.vector_enu.normalized();
  // Across the vector in the vertical plane.
  const Eigen::Vector3d up = (Eigen::Vector3d::UnitZ() - along.z() * along).normalized();
  const double pitch_sigma =
      std::sqrt(std::max(0.0, up.dot(vector.covariance_enu * up))) / std::max(1e-3, vector.length_m());
  log.choice(status_of(fix.solved()));
  log.choice(position_type(vector.kind == FixKind::Fixed ? FixKind::Fixed : FixKind::Float));
  log.r4(vector.length_m(), 4).r4(geodesy::degrees(vector.heading_rad()), 4);
  log.r4(geodesy::degrees(vector.pitch_rad()), 4).r4(0, 1);
  log.r4(geodesy::degrees(vector.heading_sigma_rad()), 4).r4(geodesy::degrees(pitch_sigma), 4);
  log.station("0").station("0").whole<1>(tracked(epoch));
  log.whole<1>(vector.used.size()).whole<1>(vector.used.size());
  add_masks(epoch, log);
}

unsigned system_number(gnss::System system) {
  // GPS, GLONASS, Galileo, BeiDou, QZSS, SBAS.
  constexpr std::array kSystems{0U, 1U, 3U, 4U, 5U, 2U};
  return kSystems.at(static_cast<std::size_t>(system));
}

void ranges(const DeviceEpoch& epoch, Fields& log) {
  constexpr int kMiddleChannel = 7;
  const auto& observations = epoch.raw.observations;
  log.whole<4>(std::count_if(observations.begin(), observations.end(),
                             [](const RawObservation& o) { return numbers_of(*o.signal) != nullptr; }));
  unsigned count = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const RawObservation& o = observations[i];
    const Numbers* numbers = numbers_of(*o.signal);
    if (numbers == nullptr) continue;
    const auto same = [&](std::size_t k) { return k < observations.size() && observations[k].id == o.id; };
    const bool first = i == 0 || !same(i - 1);
    const bool phase = o.carrier_phase_cycles.has_value();
    unsigned status = phase ? 4U : 3U;  // phase lock, or frequency lock
    status |= (count++ & 31U) << 5U | (phase ? 1U << 10U : 0U);
    status |= phase && !o.measurement->half_cycle ? 1U << 11U : 0U;
    status |= 1U << 12U | 1U << 13U | system_number(o.id.system) << 16U;  // code lock, a standard correlator
    status |= (!first || same(i + 1) ? 1U << 20U : 0U) | numbers->type << 21U;
    status |= (first ? 1U << 27U : 0U) | (phase && o.measurement->half_cycle ? 1U << 28U : 0U);
    const auto channel = epoch.glonass_channels.find(o.id);
    const bool glonass = o.id.system == gnss::System::GLONASS && channel != epoch.glonass_channels.end();
    log.whole<2>(satellite_number(o.id)).whole<2>(glonass ? channel->second + kMiddleChannel : 0);
    log.r8(o.pseudorange_m, 3).r4(o.measurement->sigma_m, 3).r8(phase ? -*o.carrier_phase_cycles : 0, 6);
    log.r4(phase ? o.measurement->carrier_phase_sigma_cycles : 0, 6).r4(o.doppler_hz.value_or(0), 3);
    log.r4(o.measurement->cn0_dbhz.value_or(0), 1).r4(o.locked_s, 3).hexadecimal<4>(status);
  }
}

struct Log {
  std::string_view name;  ///< in capitals, without the letter of the encoding
  std::uint16_t number;
  void (*write)(const DeviceEpoch&, Fields&);  ///< nothing where the epoch has none
};
constexpr std::array kLogs{Log{"TIME", 101, time_of},         Log{"BESTPOS", 42, best_position},
                           Log{"BESTVEL", 99, best_velocity}, Log{"PSRDOP", 174, dilutions},
                           Log{"HEADING2", 1335, heading},    Log{"RANGE", 43, ranges}};

/// A NovAtel receiver at the other end of a line: LOG, UNLOG, UNLOGALL, RESET and FRESET, and logs of each
/// epoch. Other commands are acknowledged and have no effect, since the scenario defines the receiver.
class NovatelDevice final : public Encoder {
 public:
  /// @param encoding of the logs that are sent from the start
  NovatelDevice(const ReceiverDescription& receiver, Encoding encoding)
      : epochs_(receiver.glonass_channels, receiver.begin, Tags::WholeMilliseconds) {
    for (Request& request : requests_) {
      if (request.encoding == encoding) request.interval_ms = 0;
    }
  }

  std::string encode(const simulation::Epoch& epoch) override {
    const DeviceEpoch told = epochs_.next(epoch);
    const std::int64_t ms = told.stated.nanoseconds() / 1'000'000;
    std::string text;
    for (Request& request : requests_) {
      if (!request.interval_ms) continue;
      const std::int64_t turn = *request.interval_ms > 0 ? ms / *request.interval_ms : ms;
      if (std::exchange(request.turn, turn) == turn) continue;
      Fields fields(request.encoding);
      request.log->write(told, fields);
      if (fields.body().empty()) continue;
      const bool measured = request.log->write == ranges;
      text += log_of(request.log->name, request.log->number, request.encoding, told.time_known,
                     measured ? epoch.observed.stated(told.raw.tag) : told.stated, fields.body());
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
  /// A log in one of its encodings.
  struct Request {
    const Log* log;
    Encoding encoding;
    std::optional<std::int64_t> interval_ms = {};  ///< 0: each epoch; empty: off
    std::int64_t turn = 0;

    /// As commands have it, in lower case.
    [[nodiscard]] std::string name() const {
      return lower_case(log->name) + (encoding == Encoding::Ascii ? 'a' : 'b');
    }
  };
  static std::vector<Request> every_log() {
    std::vector<Request> requests;
    for (const Log& log : kLogs) {
      for (const Encoding encoding : {Encoding::Ascii, Encoding::Binary})
        requests.push_back({&log, encoding});
    }
    return requests;
  }

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
      silence();
    } else if (command == "log" || command == "unlog") {
      const auto request =
          words.empty() ? requests_.end()
                        : std::find_if(requests_.begin(), requests_.end(),
                                       [&](const Request& each) { return each.name() == words.front(); });
      if (request == requests_.end()) return "\r\n<ERROR:Invalid Message ID\r\n[COM1]";
      if (command == "unlog") {
        request->interval_ms.reset();
      } else if (const auto interval = interval_of(words)) {
        if (!std::exchange(told_to_, true)) silence();
        request->interval_ms = interval;
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

  void silence() {
    for (Request& request : requests_) request.interval_ms.reset();
  }

  DeviceEpochs epochs_;
  std::vector<Request> requests_ = every_log();
  bool told_to_ = false;  ///< the first LOG replaces what is sent from the start
  transport::Readers<transport::LineCutter> lines_;
  std::optional<disturbance::RestartKind> restart_;
};

}  // namespace

std::unique_ptr<Encoder> encode_novatel(const ReceiverDescription& receiver) {
  return std::make_unique<NovatelDevice>(receiver, Encoding::Ascii);
}

std::unique_ptr<Encoder> encode_novatel_binary(const ReceiverDescription& receiver) {
  return std::make_unique<NovatelDevice>(receiver, Encoding::Binary);
}

}  // namespace canyon::output
