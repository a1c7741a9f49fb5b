#include "canyon/outputs/encoding/ubx/configuration.hpp"

#include <algorithm>
#include <array>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::encoding::ubx {
namespace {

// Keys: UBX-22008968, 6.9.14 (CFG-MSGOUT). ID, key, M8, F9, rate, generated.
constexpr std::array kMessages{
    MessageInfo{0x0107, 0x20910006, true, true, 1},                                  // NAV-PVT
    MessageInfo{0x0103, 0x2091001a, true, true, 1},                                  // NAV-STATUS
    MessageInfo{0x0104, 0x20910038, true, true, 1},                                  // NAV-DOP
    MessageInfo{0x0120, 0x20910047, true, true, 1},                                  // NAV-TIMEGPS
    MessageInfo{0x0121, 0x2091005b, true, true, 0},                                  // NAV-TIMEUTC
    MessageInfo{0x0102, 0x20910029, true, true, 0},                                  // NAV-POSLLH
    MessageInfo{0x0112, 0x20910042, true, true, 0},                                  // NAV-VELNED
    MessageInfo{0x0106, 0, true, false, 0},                                          // NAV-SOL
    MessageInfo{0x0114, 0x20910033, false, true, 0, Sent::Epochs, true},             // NAV-HPPOSLLH
    MessageInfo{0x0136, 0x20910083, false, true, 1},                                 // NAV-COV
    MessageInfo{0x0162, 0x20910415, false, true, 0},                                 // NAV-PL
    MessageInfo{0x0126, 0x20910060, true, true, 0},                                  // NAV-TIMELS
    MessageInfo{0x0135, 0x20910015, true, true, 1},                                  // NAV-SAT
    MessageInfo{0x0130, 0, true, false, 0},                                          // NAV-SVINFO
    MessageInfo{0x0143, 0x20910345, false, true, 1},                                 // NAV-SIG
    MessageInfo{kRelativePosition, 0x2091008d, false, true, 0, Sent::Epochs, true},  // NAV-RELPOSNED
    MessageInfo{kFusionStatus, 0x20910105, true, true, 0},                           // ESF-STATUS
    MessageInfo{0x0161, 0x2091015f, true, true, 1},                                  // NAV-EOE
    MessageInfo{0x0215, 0x209102a4, true, true, 1, Sent::Epochs, true},              // RXM-RAWX
    MessageInfo{0x0213, 0x20910231, true, true, 1, Sent::Events},                    // RXM-SFRBX
    MessageInfo{kSensorSamples, 0x20910277, true, true, 0, Sent::Events},            // ESF-MEAS
    MessageInfo{kRawSamples, 0x2091029f, true, true, 0, Sent::Events},               // ESF-RAW
    MessageInfo{0x0A09, 0x209101b4, true, true, 0},                                  // MON-HW
    MessageInfo{0x0A0B, 0x209101b9, true, true, 0},                                  // MON-HW2
    MessageInfo{0x0A38, 0x20910359, false, true, 1},                                 // MON-RF
    MessageInfo{0x2709, 0x20910634, false, true, 1},                                 // SEC-SIG
    MessageInfo{0x2710, 0x20910689, false, true, 0},                                 // SEC-SIGLOG
    MessageInfo{0xF004, 0x209100ab, true, true, 0},                                  // RMC
    MessageInfo{0xF000, 0x209100ba, true, true, 0},                                  // GGA
    MessageInfo{0xF002, 0x209100bf, true, true, 0},                                  // GSA
    MessageInfo{0xF007, 0x209100d3, true, true, 0},                                  // GST
    MessageInfo{0xF003, 0x209100c4, true, true, 0},                                  // GSV
    // There are no edges of a time mark.
    MessageInfo{0x0D03, 0x20910178, true, true, 0, Sent::Events},         // TIM-TM2
    MessageInfo{0x0232, 0x20910268, false, true, 0, Sent::Events, true},  // RXM-RTCM
    MessageInfo{0x0234, 0x209106b6, false, true, 0, Sent::Events, true},  // RXM-COR
    MessageInfo{0xF001, 0x209100c9, true, true, 0, Sent::Never},          // GLL
    MessageInfo{0xF005, 0x209100b0, true, true, 0, Sent::Never},          // VTG
    MessageInfo{0xF008, 0x209100d8, true, true, 0, Sent::Never},          // ZDA
    MessageInfo{0x013B, 0x20910088, false, true, 0, Sent::Never, true},   // NAV-SVIN
    MessageInfo{0xF505, 0x209102bd, false, true, 0, Sent::Epochs, true},  // RTCM 1005, 1074, 1077, ...
    MessageInfo{0xF54A, 0x2091035e, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF54D, 0x209102cc, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF554, 0x20910363, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF557, 0x209102d1, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF55E, 0x20910368, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF561, 0x20910318, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF57C, 0x2091036d, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF57F, 0x209102d6, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF5E6, 0x20910303, false, true, 0, Sent::Epochs, true},
    MessageInfo{0xF5FE, 0x209102fe, false, true, 0, Sent::Never, true},
    MessageInfo{0xF5FD, 0x20910381, false, true, 0, Sent::Never, true},
};

struct KeyDefault {
  std::uint32_t key;
  std::uint64_t value;
};
// The groups set by flight controllers and gpsd, with the defaults of UBX-22008968, chapter 6, except NMEA
// and the jamming monitor (docs/outputs.md).
constexpr KeyDefault kKeys[]{{kRateNavigation, 1}, {kRateTimeReference, 1}, {kFixMode, 3},
                             {kDynamicModel, 0},   {0x201100a4, 10},        {0x20140011, 3},
                             {kJammingMonitor, 1}, {kOutputUbx, 1},         {kOutputNmea, 1},
                             {0x40530001, 38400},  {0x20640001, 50}};
// NAVSPG, ODO, TMODE, SIGNAL, and the ports' (I2C, UART1, UART2, USB, SPI) protocols: off and on.
constexpr std::uint32_t kOff[]{
    0x2011001c, 0x10220001, 0x10220002, 0x10220003, 0x10220004, 0x20030001, 0x20030002, 0x40030003,
    0x40030004, 0x40030005, 0x20030006, 0x20030007, 0x20030008, 0x40030009, 0x4003000a, 0x4003000b,
    0x2003000c, 0x2003000d, 0x2003000e, 0x4003000f, 0x40030010, 0x40030011, 0x10310004, 0x10310009,
    0x1031000f, 0x10310028, 0x10310014, 0x10310017, 0x10310026, 0x1031001d, 0x10320001, 0x10720002,
    0x10720004, 0x20520003, 0x20520004, 0x10520006, 0x10740004, 0x20530003, 0x20530004, 0x10530006,
    0x10750001, 0x10750002, 0x10760001, 0x10760002, 0x10760004, 0x10780002, 0x10780004, 0x10640006,
    0x107a0002, 0x107a0004};
constexpr std::uint32_t kOn[]{
    0x1031001f, 0x10310020, 0x10310021, 0x10310022, 0x10310024, 0x10310025, 0x10310001, 0x10310003,
    0x10310005, 0x10310007, 0x1031000a, 0x1031000d, 0x1031000e, 0x10310012, 0x10310015, 0x10310018,
    0x1031001a, 0x10510003, 0x10710001, 0x10710002, 0x10710004, 0x10720001, 0x20520002, 0x10520005,
    0x10730001, 0x10730002, 0x10730004, 0x20530002, 0x10530005, 0x10750004, 0x10650001, 0x10770001,
    0x10770002, 0x10770004, 0x10780001, 0x10790001, 0x10790002, 0x10790004, 0x107a0001};

// Not accessible by CFG-VALSET: no key has these high bits.
constexpr std::uint32_t kConnectedRate = 0x80000000;

const MessageInfo* info_of(MessageId id, Generation generation) {
  for (const MessageInfo& info : kMessages)
    if (info.id == id && info.known(generation)) return &info;
  return nullptr;
}

}  // namespace

std::span<const MessageInfo> messages() {
  return kMessages;
}

int value_size(std::uint32_t key) {
  constexpr std::array<int, 8> kSizes{0, 1, 1, 2, 4, 8, 0, 0};
  return key < kConnectedRate ? kSizes[key >> 28 & 7] : 0;
}

Configuration::Configuration(Generation generation, int period_ms, bool rtk, bool dead_reckoning,
                             bool is_stationary)
    : generation_(generation), is_stationary_(is_stationary) {
  for (const KeyDefault& key : kKeys) values_[key.key] = key.value;
  for (const std::uint32_t key : kOff) values_[key] = 0;
  for (const std::uint32_t key : kOn) values_[key] = 1;
  values_[kRateMeasurement] = static_cast<std::uint64_t>(std::clamp(period_ms, 1, 0xFFFF));
  values_[kBaud] = generation == Generation::M8 ? 9600 : 38400;
  for (const MessageInfo& info : kMessages) {
    if (!info.known(generation)) continue;
    for (int port = 0; port < kPorts; ++port) {
      const auto key = rate_key(info.id, port);
      if (key) values_[*key] = port == kConnectedPort ? static_cast<std::uint64_t>(info.rate) : 0;
    }
  }
  if (generation == Generation::M8) values_[*rate_key(0x0A09, kConnectedPort)] = 1;  // has no MON-RF
  if (const auto key = rate_key(kRelativePosition, kConnectedPort); rtk && key) values_[*key] = 1;
  if (dead_reckoning)
    for (const MessageId id : {kFusionStatus, kSensorSamples}) values_[*rate_key(id, kConnectedPort)] = 1;
  // Blocks with their defaults: dynModel and fixMode are from the keys.
  Payload engine;  // CFG-NAV5
  engine.u2(0xFFFF).u1(0).u1(3).u4(0).u4(10000).u1(5).u1(0).u2(250).u2(250).u2(100).u2(350).u1(0).u1(60);
  blocks_[0x0624] = engine.zeros(12).bytes();
  blocks_[0x0608] = std::string(6, '\0');                             // CFG-RATE: all values are from keys
  blocks_[0x0616] = Payload().u1(1).u1(3).u1(3).u1(0).u4(0).bytes();  // CFG-SBAS
  blocks_[0x0623] = Payload().u2(2).zeros(38).bytes();                // CFG-NAVX5
  blocks_[0x0639] = Payload().u4(0xADE62AD3).u4(0x0000031E).bytes();  // CFG-ITFM, bit 31: on
  blocks_[0x0613] = Payload().u2(0x001B).u2(0x8251).bytes();          // CFG-ANT
  Payload pulse;                                                      // CFG-TP5
  pulse.u1(0).u1(1).u2(0).u2(50).u2(0).u4(1'000'000).u4(1'000'000).u4(0).u4(100'000).u4(0).u4(0x77);
  blocks_[0x0631] = pulse.bytes();
  blocks_[0x0671] = std::string(40, '\0');  // CFG-TMODE3
}

std::optional<std::uint64_t> Configuration::value(std::uint32_t key) const {
  const auto found = values_.find(key);
  if (found == values_.end()) return std::nullopt;
  return found->second;
}

bool Configuration::takes(std::uint32_t key, std::uint64_t value) const {
  if (values_.count(key) == 0) return false;
  if (key == kRateMeasurement) return value > 0;
  if (key == kRateNavigation) return value > 0 && value <= 127;
  if (key == kBaud) return value >= 4800 && value <= 4'000'000;
  if (key == kBaseMode) return value == 0 || (value == 2 && is_stationary_);
  if (value == 0 || key >> 16 != 0x2091) return true;
  return std::none_of(kMessages.begin(), kMessages.end(), [&](const MessageInfo& info) {
    return info.sent == Sent::Never && key >= info.key && key < info.key + kPorts;
  });
}

bool Configuration::set(std::uint32_t key, std::uint64_t value) {
  if (!takes(key, value)) return false;
  values_[key] = value;
  return true;
}

std::vector<std::uint32_t> Configuration::keys(std::uint32_t mask) const {
  std::vector<std::uint32_t> found;
  const bool any_item = (mask & 0xFFFF) == 0xFFFF, any_group = (mask & 0x0FFF0000) == 0x0FFF0000;
  for (const auto& [key, value] : values_) {
    if (key >= kConnectedRate) continue;
    if (key == mask || (any_item && (any_group || (key & 0x0FFF0000) == (mask & 0x0FFF0000))))
      found.push_back(key);
  }
  return found;
}

std::optional<std::uint32_t> Configuration::rate_key(MessageId id, int port) const {
  const MessageInfo* info = info_of(id, generation_);
  if (info == nullptr || port < 0 || port >= kPorts) return std::nullopt;
  if (info->key != 0) return info->key + static_cast<std::uint32_t>(port);
  if (port != kConnectedPort) return std::nullopt;
  return kConnectedRate | id;
}

int Configuration::rate(MessageId id) const {
  const auto key = rate_key(id, kConnectedPort);
  return key ? static_cast<int>(values_.at(*key)) : 0;
}

std::optional<Eigen::Vector3d> Configuration::configured_position_ecef() const {
  if (value(kBaseMode).value_or(0) != 2) return std::nullopt;
  // TMODE-POS_TYPE; TMODE-ECEF_X, -ECEF_X_HP, -LAT and -LAT_HP, each followed by the two others.
  const bool geodetic = value(0x20030002).value_or(0) == 1;
  Eigen::Vector3d point;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t key = (geodetic ? 0x40030009 : 0x40030003) + axis;
    const std::uint32_t fine_key = (geodetic ? 0x2003000c : 0x20030006) + axis;
    const double unit = geodetic && axis < 2 ? 1e-7 : 1e-2;
    const auto whole = static_cast<std::int32_t>(value(key).value_or(0));
    const auto fine = static_cast<std::int8_t>(value(fine_key).value_or(0));
    point[axis] = unit * (whole + 0.01 * fine);
  }
  return geodetic ? geodesy::ecef_from_geodetic(
                        {geodesy::radians(point.x()), geodesy::radians(point.y()), point.z()})
                  : point;
}

std::string* Configuration::block(MessageId id) {
  const auto found = blocks_.find(id);
  return found == blocks_.end() ? nullptr : &found->second;
}

}  // namespace canyon::encoding::ubx
