#include "canyon/outputs/encoding/sbf/commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/sbf/block.hpp"

namespace canyon::encoding::sbf {
namespace {

constexpr std::string_view kPort = "COM1";

/// Commands: the full name with "set" or "exe", then the short name.
constexpr std::string_view kKnown =
    "setsbfoutput, sso, setnmeaoutput, sno, setdatainout, sdio, setcomsettings, scs, "
    "setipserversettings, siss, setpvtmode, spm, setreceiverdynamics, srd, setattitudeoffset, sto, "
    "setantennaoffset, sao, setgnssattitude, sga, setobserverparameters, sop, setnmeatalkerid, snti, "
    "setntpserver, sntp, setptpserver, sptp, setelevationmask, sem, setsatellitetracking, sst, "
    "setsignaltracking, snt, setstaticposgeodetic, sspg, setantennatype, sat, setgeodeticdatum, sgd, "
    "setntripsettings, snts, setntriptlssettings, sntt, exeresetreceiver, err, "
    "execopyconfigfile, eccf, getreceivercapabilities, grc, login, login, logout, logout";

std::string prompt() {
  return fmt::format("{}>", kPort);
}
std::string accepted(std::string_view line, std::string_view settings = {}) {
  return fmt::format("$R: {}\r\n{}{}{}", line, settings.empty() ? "" : "  ", settings,
                     settings.empty() ? prompt() : "\r\n" + prompt());
}

/// "a, b" of "A, B ": trimmed words; the first in lower case.
std::vector<std::string> words_of(std::string_view line) {
  std::vector<std::string> words;
  for (const std::string_view word : split(line, ',')) words.emplace_back(trim(word));
  words.front() = lower_case(words.front());
  return words;
}
std::string word(const std::vector<std::string>& words, std::size_t at) {
  return at < words.size() ? words[at] : std::string();
}

bool is_none(const std::string& text) {
  return text.empty() || lower_case(text) == "none";
}

/// [ms] of "msec100", "sec1", "min1"; 0: at each epoch. Empty for a word that is none of these.
std::optional<std::int64_t> parse_interval(const std::string& text) {
  const std::string lower = lower_case(text);
  if (lower == "onchange") return 0;
  static constexpr std::pair<std::string_view, std::int64_t> kUnits[]{
      {"msec", 1}, {"sec", 1000}, {"min", 60'000}};
  for (const auto& [unit, ms] : kUnits) {
    if (lower.rfind(unit, 0) != 0) continue;
    const auto count = parse_integer(std::string_view(lower).substr(unit.size()));
    if (count && *count >= 1 && *count <= 60'000) return *count * ms;
  }
  return std::nullopt;
}

/// Adds and removes blocks: "A+B" replaces the list, "+A-B" changes it. Ignores names of other blocks.
void change_blocks(std::set<std::uint16_t>& blocks, const std::string& text) {
  if (text.empty()) return;
  if (text.front() != '+' && text.front() != '-') blocks.clear();
  bool adds = true;
  std::string name;
  const auto take = [&] {
    for (const BlockId& known : kBlocks) {
      if (lower_case(std::string(known.name)) != lower_case(name)) continue;
      if (adds) blocks.insert(known.number);
      if (!adds) blocks.erase(known.number);
    }
    name.clear();
  };
  for (const char c : text) {
    if (c == '+' || c == '-') {
      take();
      adds = c == '+';
    } else if (c != ' ') {
      name += c;
    }
  }
  take();
}

std::string names_of(const std::set<std::uint16_t>& blocks) {
  std::string text;
  for (const BlockId& known : kBlocks)
    if (blocks.count(known.number) > 0) text += (text.empty() ? "" : "+") + std::string(known.name);
  return text.empty() ? "none" : text;
}

}  // namespace

std::string SbfCommands::receive(std::string_view bytes, std::int64_t now_ms) {
  std::string answers;
  for (const char c : bytes) {
    if (c == '\r' || c == '\n') {
      answers += execute(trim(line_), now_ms);
      line_.clear();
    } else if (c < ' ' || c > '~' || line_.size() >= kMaxLine) {
      line_.assign(1, '\0');  // bytes of another protocol, not a command line
    } else {
      line_ += c;
    }
  }
  return answers;
}

std::string SbfCommands::execute(std::string_view line, std::int64_t now_ms) {
  constexpr std::string_view kAttention = "SSSSSSSSSS";  // requests the command line
  if (line.empty()) return prompt();
  if (line.starts_with(kAttention) && line.find_first_not_of('S') == std::string_view::npos) {
    if (first_.empty()) first_ = kAttention;
    return prompt();
  }
  const bool text = std::all_of(line.begin(), line.begin() + std::min<std::ptrdiff_t>(3, std::ssize(line)),
                                [](unsigned char c) { return std::isalpha(c) != 0; });
  if (!text || line.size() < 3) return {};
  const std::vector<std::string> words = words_of(line);
  const std::string& name = words.front();
  static const std::vector<std::string> known = words_of(kKnown);
  const auto at = std::find(known.begin(), known.end(), name);
  if (at == known.end()) return fmt::format("$R? {}: Invalid command!\r\n{}", name, prompt());
  const std::string& brief = known[static_cast<std::size_t>(at - known.begin()) | 1];
  if (first_.empty()) first_ = name;
  quiet_until_ms_ = now_ms + kQuiet_ms;
  if (brief == "login") return accepted("login");  // without the name and the password
  std::string settings;
  if (brief == "sso") settings = sbf_output(words);
  if (brief == "sno" && !is_none(word(words, 3)))
    settings = "$R? setNMEAOutput: Argument 'Messages' is invalid!";  // NMEA is another format
  if (brief == "scs") settings = com_settings(words);
  if (brief == "err") settings = reset_receiver(words);
  if (brief == "grc") settings = "ReceiverCapabilities, Main";
  if (settings.rfind("$R?", 0) == 0) return settings + "\r\n" + prompt();
  return accepted(line, settings);
}

std::string SbfCommands::sbf_output(const std::vector<std::string>& words) {
  const std::string stream = word(words, 1), pace = lower_case(word(words, 4));
  const bool all = lower_case(stream) == "all";
  if (!all && stream.empty()) return "$R? setSBFOutput: Argument 'Stream' is invalid!";
  const std::optional<std::int64_t> interval = parse_interval(word(words, 4));
  if (!pace.empty() && pace != "off" && !interval) return "$R? setSBFOutput: Argument 'Interval' is invalid!";
  if (all) streams_.clear();
  Stream& changed = streams_[stream];
  change_blocks(changed.blocks, word(words, 3));
  if (interval) changed.interval_ms = *interval;
  if (!pace.empty()) changed.on = pace != "off";
  return fmt::format("SBFOutput, {}, {}, {}, {}", stream, word(words, 2), names_of(changed.blocks),
                     changed.on ? fmt::format("msec{}", changed.interval_ms) : "off");
}

std::string SbfCommands::com_settings(const std::vector<std::string>& words) {
  const std::string rate = lower_case(word(words, 2));
  if (rate.empty()) return {};
  const auto baud =
      rate.rfind("baud", 0) == 0 ? parse_integer(std::string_view(rate).substr(4)) : std::nullopt;
  if (!baud || *baud < 1200 || *baud > 4'000'000) return "$R? setCOMSettings: Argument 'Rate' is invalid!";
  baud_ = static_cast<int>(*baud);
  return fmt::format("COMSettings, {}, baud{}, bits8, No, bit1, none", word(words, 1), *baud);
}

std::string SbfCommands::reset_receiver(const std::vector<std::string>& words) {
  const std::string level = lower_case(word(words, 1)), erased = lower_case(word(words, 2));
  if (level != "soft" && level != "hard") return "$R? exeResetReceiver: Argument 'Level' is invalid!";
  const bool satellites = erased.find("satdata") != std::string::npos || erased == "all";
  restart_ = satellites ? disturbance::RestartKind::Cold : disturbance::RestartKind::Hot;
  return fmt::format("ResetReceiver, {}, {}", word(words, 1), word(words, 2));
}

std::optional<std::int64_t> SbfCommands::interval_ms(std::uint16_t block) const {
  std::optional<std::int64_t> interval;
  for (const auto& [name, stream] : streams_) {
    if (!stream.on || stream.blocks.count(block) == 0) continue;
    interval = std::min(interval.value_or(stream.interval_ms), stream.interval_ms);
  }
  return interval;
}

bool SbfCommands::is_due(std::uint16_t block, std::int64_t epoch_ms) {
  if (first_.empty()) return true;
  if (epoch_ms < quiet_until_ms_) return false;
  const std::optional<std::int64_t> interval = interval_ms(block);
  if (!interval) return false;
  if (*interval == 0) return true;
  const std::int64_t round = epoch_ms / *interval;
  return std::exchange(previous_rotation_[block], round) != round;
}

}  // namespace canyon::encoding::sbf
