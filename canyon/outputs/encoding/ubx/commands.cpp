#include "canyon/outputs/encoding/ubx/commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/ubx/messages.hpp"

namespace canyon::encoding::ubx {
namespace {

constexpr MessageId kAcknowledge = 0x0501, kRefuse = 0x0500, kVersion = 0x0A04, kGnss = 0x063E,
                    kNav5 = 0x0624, kRates = 0x0608;

/// Keys of a port's protocol masks: UBX; NMEA and RTCM 3 follow at + 1 and + 3.
struct PortKeys {
  std::uint32_t in, out;
};
constexpr std::array<PortKeys, kPorts> kPortKeys{{{0x10710001, 0x10720001},
                                                  {0x10730001, 0x10740001},
                                                  {0x10750001, 0x10760001},
                                                  {0x10770001, 0x10780001},
                                                  {0x10790001, 0x107a0001}}};
/// Bits of CFG-PRT's masks, and the offset of their keys from the first.
constexpr std::array<std::pair<int, std::uint32_t>, 3> kProtocols{{{0, 0}, {1, 1}, {5, 3}}};

/// CFG-GNSS: reserved and maximum channels, and the signals near L1, with u-blox's defaults.
std::string gnss_blocks(const std::set<gnss::System>& systems) {
  struct Block {
    gnss::System system;
    std::uint8_t id, reserved, maximum;
  };
  constexpr Block kBlocks[]{{gnss::System::GPS, 0, 8, 16},    {gnss::System::SBAS, 1, 1, 3},
                            {gnss::System::Galileo, 2, 4, 8}, {gnss::System::BeiDou, 3, 8, 16},
                            {gnss::System::QZSS, 5, 0, 3},    {gnss::System::GLONASS, 6, 8, 14}};
  Payload p;
  p.u1(0).u1(32).u1(32).u1(std::size(kBlocks));
  for (const Block& block : kBlocks)
    p.u1(block.id).u1(block.reserved).u1(block.maximum).u1(0).u4(0x00010000 | systems.count(block.system));
  return p.bytes();
}

std::uint64_t mask_of(const Configuration& settings, std::uint32_t first) {
  std::uint64_t mask = 0;
  for (const auto& [bit, offset] : kProtocols) mask |= settings.value(first + offset).value_or(0) << bit;
  return mask;
}

struct KeyValue {
  std::uint32_t key;
  std::uint64_t value;
};
/// Keys with their values as in CFG-VALSET; empty for an incomplete list.
std::optional<std::vector<KeyValue>> key_values(std::string_view bytes) {
  std::vector<KeyValue> pairs;
  while (!bytes.empty()) {
    if (bytes.size() < 4) return std::nullopt;
    const auto key = static_cast<std::uint32_t>(number_at(bytes, 0, 4));
    const auto size = static_cast<std::size_t>(value_size(key));
    if (size == 0 || bytes.size() < 4 + size) return std::nullopt;
    pairs.push_back({key, number_at(bytes, 4, size)});
    bytes.remove_prefix(4 + size);
  }
  return pairs;
}

/// Fields of the older CFG messages whose values have keys; the other bytes are stored unchanged.
struct KeyField {
  MessageId id;
  std::size_t at, size;
  std::uint32_t key;
};
constexpr KeyField kKeyFields[]{{kRates, 0, 2, kRateMeasurement},
                                {kRates, 2, 2, kRateNavigation},
                                {kRates, 4, 2, kRateTimeReference},
                                {kNav5, 2, 1, kDynamicModel},
                                {kNav5, 3, 1, kFixMode}};

/// CFG-NAV5 with the parts of `given` selected by its mask.
std::string navigation_engine(std::string stored, std::string_view given) {
  // Bits of the mask, each with its bytes.
  struct Part {
    int bit;
    std::size_t first, size;
  };
  constexpr Part kParts[]{{0, 2, 1},  {1, 12, 1}, {2, 3, 9},  {3, 13, 1}, {4, 14, 2}, {4, 18, 2}, {5, 16, 2},
                          {5, 20, 2}, {6, 22, 1}, {6, 28, 2}, {7, 23, 1}, {8, 24, 2}, {10, 30, 1}};
  const std::uint64_t mask = number_at(given, 0, 2);
  for (const Part& part : kParts)
    if ((mask >> part.bit & 1) != 0)
      stored.replace(part.first, part.size, given.substr(part.first, part.size));
  return stored;
}

constexpr std::size_t kMaxKeys = 64;
/// The keys named by the masks after a header of 4 bytes; empty if a mask matches none.
std::vector<std::uint32_t> keys_named(const Configuration& settings, std::string_view payload) {
  std::vector<std::uint32_t> keys;
  for (std::size_t at = 4; at < payload.size() && at < 4 + 4 * kMaxKeys; at += 4) {
    const std::vector<std::uint32_t> found =
        settings.keys(static_cast<std::uint32_t>(number_at(payload, at, 4)));
    if (found.empty()) return {};
    keys.insert(keys.end(), found.begin(), found.end());
  }
  return keys;
}

constexpr std::uint64_t kRam = 1, kBattery = 2, kFlash = 4;

}  // namespace

UbxCommands::UbxCommands(Generation generation, const Configuration& factory,
                         const std::set<gnss::System>& systems, const Outputs& outputs)
    : generation_(generation),
      outputs_(outputs),
      settings_{factory, factory, factory},
      systems_(gnss_blocks(systems)),
      reported_baud_(*settings_.current.value(kBaud)) {}

std::string UbxCommands::receive(std::string_view bytes) {
  std::string response;
  const UbxParser::Handlers handlers{[&](MessageId id, std::string_view payload) {
                                       take(id, payload, response);
                                       note_change(fmt::format("CFG 0x{:02X}", id & 0xFF));
                                     },
                                     [&](std::string_view sentence) {
                                       take_line(sentence);
                                       note_change("$PUBX,41");
                                     }};
  parser_.receive(bytes, handlers);
  return response;
}

void UbxCommands::note_change(std::string command) {
  if (first_.empty() && (!running_ || settings_.current != settings_.factory)) first_ = std::move(command);
}

std::optional<int> UbxCommands::take_baud() {
  const std::uint64_t baud = *settings_.current.value(kBaud);
  if (baud == reported_baud_) return std::nullopt;
  reported_baud_ = baud;
  return static_cast<int>(baud);
}

std::int64_t UbxCommands::interval_ms() const {
  return static_cast<std::int64_t>(*settings_.current.value(kRateMeasurement) *
                                   *settings_.current.value(kRateNavigation));
}

void UbxCommands::take(MessageId id, std::string_view payload, std::string& response) {
  if (response.size() > kMaxResponse) return;
  if (id >> 8 == 0x06) {
    const Reply reply = configure(static_cast<std::uint8_t>(id & 0xFF), payload, response);
    if (reply == Reply::Silent) return;
    response += frame(reply == Reply::Acknowledge ? kAcknowledge : kRefuse,
                      Payload().u1(id >> 8).u1(id & 0xFF).bytes());
  } else if (payload.empty() && id == kVersion) {
    response += frame(id, version_payload(generation_));
  } else if (payload.empty() && settings_.current.rate_key(id, kConnectedPort)) {
    if (const auto polled = outputs_.output(id, settings_.current)) response += frame(id, *polled);
  }
}

UbxCommands::Reply UbxCommands::configure(std::uint8_t id, std::string_view payload, std::string& response) {
  const bool keys = generation_ != Generation::M8;
  // CFG-RST, CFG-CFG, CFG-VALSET, CFG-VALGET, CFG-VALDEL.
  constexpr std::array<std::uint8_t, 5> kOfKeys{0x04, 0x09, 0x8A, 0x8B, 0x8C};
  if (is_newest(generation_) && std::find(kOfKeys.begin(), kOfKeys.end(), id) == kOfKeys.end())
    return Reply::Refuse;
  switch (id) {
    case 0x00:
      return port(payload, response);
    case 0x01:
      return message_rate(payload, response);
    case 0x04:
      return restart(payload);
    case 0x09:
      return save(payload);
    case 0x3E:
      if (payload.empty()) response += frame(kGnss, systems_);
      if (payload.empty()) return Reply::Acknowledge;
      if (payload.size() < 4 || payload.size() != 4 + 8 * number_at(payload, 3, 1) ||
          payload.size() > 4 + 8 * 8)
        return Reply::Refuse;
      systems_ = payload;
      systems_[1] = 32;  // channels: read only
      return Reply::Acknowledge;
    case 0x8A:
      return keys ? set_values(payload) : Reply::Refuse;
    case 0x8B:
      return keys ? get_values(payload, response) : Reply::Refuse;
    case 0x8C:
      return keys ? delete_values(payload) : Reply::Refuse;
    default:
      return block(static_cast<MessageId>(0x0600 | id), payload, response);
  }
}

UbxCommands::Reply UbxCommands::message_rate(std::string_view payload, std::string& response) {
  if (payload.size() != 2 && payload.size() != 3 && payload.size() != 2 + 6) return Reply::Refuse;
  const auto id = static_cast<MessageId>(number_at(payload, 0, 1) << 8 | number_at(payload, 1, 1));
  Configuration& settings = settings_.current;
  const auto own = settings.rate_key(id, kConnectedPort);
  if (!own) return Reply::Refuse;
  if (payload.size() == 2) {
    Payload p;
    p.raw(payload);
    for (int port = 0; port < kPorts; ++port) {
      const auto key = settings.rate_key(id, port);
      p.u1(key ? *settings.value(*key) : 0);
    }
    response += frame(0x0601, p.u1(0).bytes());
    return Reply::Acknowledge;
  }
  const bool base_words = payload.size() == 3;
  for (int port = base_words ? kConnectedPort : 0; port < (base_words ? kConnectedPort + 1 : kPorts);
       ++port) {
    const auto key = settings.rate_key(id, port);
    const std::uint64_t rate = number_at(payload, base_words ? 2 : 2 + static_cast<std::size_t>(port), 1);
    if (key && !settings.set(*key, rate)) return Reply::Refuse;
  }
  return Reply::Acknowledge;
}

bool UbxCommands::set_port(int port, std::uint64_t baud, std::uint64_t in, std::uint64_t out) {
  if (port < 0 || port >= kPorts) return false;
  Configuration& settings = settings_.current;
  if (port == kConnectedPort && !settings.set(kBaud, baud)) return false;
  const PortKeys& keys = kPortKeys[static_cast<std::size_t>(port)];
  for (const auto& [bit, offset] : kProtocols) {
    settings.set(keys.in + offset, in >> bit & 1);
    settings.set(keys.out + offset, out >> bit & 1);
  }
  return true;
}

UbxCommands::Reply UbxCommands::port(std::string_view payload, std::string& response) {
  constexpr std::size_t kBlock = 20;
  if (payload.size() <= 1) {
    const std::uint64_t port = payload.empty() ? kConnectedPort : number_at(payload, 0, 1);
    if (port >= kPorts) return Reply::Refuse;
    const Configuration& settings = settings_.current;
    const bool own = port == kConnectedPort;
    Payload p;
    p.u1(port).u1(0).u2(0).u4(own ? 0x8D0 : 0).u4(own ? *settings.value(kBaud) : 0);  // 8N1
    p.u2(mask_of(settings, kPortKeys[port].in)).u2(mask_of(settings, kPortKeys[port].out)).zeros(4);
    response += frame(0x0600, p.bytes());
    return Reply::Acknowledge;
  }
  // One message may have several ports.
  if (payload.size() % kBlock != 0) return Reply::Refuse;
  for (; !payload.empty(); payload.remove_prefix(kBlock))
    if (!set_port(static_cast<int>(number_at(payload, 0, 1)), number_at(payload, 8, 4),
                  number_at(payload, 12, 2), number_at(payload, 14, 2)))
      return Reply::Refuse;
  return Reply::Acknowledge;
}

UbxCommands::Reply UbxCommands::block(MessageId id, std::string_view payload, std::string& response) {
  constexpr MessageId kJamming = 0x0639, kTimePulse = 0x0631, kTimeMode = 0x0671;
  Configuration& settings = settings_.current;
  std::string* const stored = settings.block(id);
  if (stored == nullptr) return Reply::Refuse;
  const auto each_key = [&](const auto& visit) {
    return std::all_of(std::begin(kKeyFields), std::end(kKeyFields),
                       [&](const KeyField& field) { return field.id != id || visit(field); });
  };
  each_key([&](const KeyField& field) {
    const std::string value = Payload().u4(*settings.value(field.key)).bytes();
    stored->replace(field.at, field.size, value, 0, field.size);
    return true;
  });
  if (payload.empty() || (id == kTimePulse && payload.size() == 1)) {
    response += frame(id, *stored);
    return Reply::Acknowledge;
  }
  if (payload.size() != stored->size()) return Reply::Refuse;
  if (id == kTimeMode && (number_at(payload, 2, 1)) != 0) return Reply::Refuse;  // no base station
  const std::string changed = id == kNav5 ? navigation_engine(*stored, payload) : std::string(payload);
  const auto value = [&](const KeyField& field) { return number_at(changed, field.at, field.size); };
  if (!each_key([&](const KeyField& field) { return settings.takes(field.key, value(field)); }))
    return Reply::Refuse;
  each_key([&](const KeyField& field) { return settings.set(field.key, value(field)); });
  *stored = changed;
  if (id == kJamming) settings.set(kJammingMonitor, number_at(payload, 0, 4) >> 31);
  return Reply::Acknowledge;
}

// CFG-CFG: clear, save and load; the sections of the masks are treated as one.
UbxCommands::Reply UbxCommands::save(std::string_view payload) {
  if (payload.size() != 12 && payload.size() != 13) return Reply::Refuse;
  if (number_at(payload, 0, 4) != 0) settings_.saved = settings_.factory;
  if (number_at(payload, 4, 4) != 0) settings_.saved = settings_.current;
  if (number_at(payload, 8, 4) != 0) settings_.current = settings_.saved;
  return Reply::Acknowledge;
}

// CFG-RST is not acknowledged. Its mask selects the data that the receiver deletes.
UbxCommands::Reply UbxCommands::restart(std::string_view payload) {
  if (payload.size() != 4) return Reply::Refuse;
  constexpr std::uint64_t kGnssOnly = 2, kStop = 8, kStart = 9;
  const std::uint64_t mode = number_at(payload, 2, 1);
  running_ = mode != kStop;
  if (!running_) return Reply::Silent;
  if (mode != kGnssOnly && mode != kStart) settings_.current = settings_.saved;
  constexpr std::uint64_t kEphemerides = 1, kAlmanacPositionOrClock = 1 << 1 | 1 << 4 | 1 << 8;
  const std::uint64_t forgotten = number_at(payload, 0, 2);
  restart_ = (forgotten & kEphemerides) == 0              ? disturbance::RestartKind::Hot
             : (forgotten & kAlmanacPositionOrClock) == 0 ? disturbance::RestartKind::Warm
                                                          : disturbance::RestartKind::Cold;
  return Reply::Silent;
}

UbxCommands::Reply UbxCommands::set_values(std::string_view payload) {
  if (payload.size() < 4 || number_at(payload, 0, 1) > 1) return Reply::Refuse;
  const std::uint64_t layers = number_at(payload, 1, 1);
  const auto pairs = key_values(payload.substr(4));
  if (!pairs || pairs->size() > kMaxKeys || (layers & 7) == 0) return Reply::Refuse;
  // All or nothing.
  for (const KeyValue& pair : *pairs)
    if (!settings_.current.takes(pair.key, pair.value)) return Reply::Refuse;
  for (const KeyValue& pair : *pairs) {
    if ((layers & kRam) != 0) settings_.current.set(pair.key, pair.value);
    if ((layers & (kBattery | kFlash)) != 0) settings_.saved.set(pair.key, pair.value);
  }
  return Reply::Acknowledge;
}

UbxCommands::Reply UbxCommands::get_values(std::string_view payload, std::string& response) {
  if (payload.size() < 8 || payload.size() % 4 != 0 || number_at(payload, 0, 1) != 0) return Reply::Refuse;
  const std::uint64_t layer = number_at(payload, 1, 1);
  if (layer > 2 && layer != 7) return Reply::Refuse;
  const Configuration& settings = layer == 0   ? settings_.current
                                  : layer == 7 ? settings_.factory
                                               : settings_.saved;
  const std::vector<std::uint32_t> keys = keys_named(settings, payload);
  if (keys.empty()) return Reply::Refuse;
  const std::size_t skipped = std::min<std::size_t>(number_at(payload, 2, 2), keys.size());
  Payload p;
  p.u1(1).u1(layer).u2(skipped);
  for (std::size_t i = skipped; i < std::min(keys.size(), skipped + kMaxKeys); ++i) {
    p.u4(keys[i]);
    const std::uint64_t value = *settings.value(keys[i]);
    for (int byte = 0; byte < value_size(keys[i]); ++byte) p.u1(value >> (8 * byte) & 0xFF);
  }
  response += frame(0x068B, p.bytes());
  return Reply::Acknowledge;
}

UbxCommands::Reply UbxCommands::delete_values(std::string_view payload) {
  if (payload.size() < 4 || payload.size() % 4 != 0 || number_at(payload, 0, 1) > 1) return Reply::Refuse;
  const std::vector<std::uint32_t> keys = keys_named(settings_.saved, payload);
  if (keys.empty() && payload.size() > 4) return Reply::Refuse;
  for (const std::uint32_t key : keys) settings_.saved.set(key, *settings_.factory.value(key));
  return Reply::Acknowledge;
}

// "PUBX,41,port,inProto,outProto,baud,autobauding", masks in hexadecimal (UBX-13003221, 30.4.2).
void UbxCommands::take_line(std::string_view sentence) {
  const std::vector<std::string_view> fields = split(sentence, ',');
  if (fields.size() < 6 || fields[0] != "PUBX" || fields[1] != "41") return;
  const auto hexadecimal = [](std::string_view text) {
    std::uint64_t value = 0;
    for (const char c : text.substr(0, 4)) {
      const std::size_t digit = std::string_view("0123456789ABCDEF").find(c);
      value = value << 4 | (digit == std::string_view::npos ? 0 : digit);
    }
    return value;
  };
  const auto port = parse_integer(fields[2]), baud = parse_integer(fields[5]);
  if (!port || !baud || *port < 0 || *port >= kPorts || *baud < 0) return;
  set_port(static_cast<int>(*port), static_cast<std::uint64_t>(*baud), hexadecimal(fields[3]),
           hexadecimal(fields[4]));
}

}  // namespace canyon::encoding::ubx
