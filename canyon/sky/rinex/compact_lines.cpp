#include "canyon/sky/rinex/compact_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/sky/rinex/fields.hpp"

namespace canyon::rinex {
namespace {

constexpr std::size_t kNameWidth = 3, kNamesPerLine2 = 12, kValuesPerLine2 = 5;
constexpr std::size_t kValueWidth = 14, kFlagWidth = 2;

/// A line from the preceding one: a blank keeps the character, '&' makes it blank, any other replaces it.
void change_text(std::string& text, std::string_view difference) {
  if (difference.size() > text.size()) text.resize(difference.size(), ' ');
  for (std::size_t i = 0; i < difference.size(); ++i)
    if (difference[i] == '&')
      text[i] = ' ';
    else if (difference[i] != ' ')
      text[i] = difference[i];
}

/// A number with `decimals` decimals, stored as an integer.
std::string decimal(std::int64_t value, int decimals, std::size_t width) {
  std::int64_t unit = 1;
  for (int i = 0; i < decimals; ++i) unit *= 10;
  const auto whole = std::abs(value) / unit, rest = std::abs(value) % unit;
  return fmt::format("{:>{}}", fmt::format("{}{}.{:0{}}", value < 0 ? "-" : "", whole, rest, decimals),
                     width);
}

}  // namespace

void CompactLines::Arc::begin(int highest, std::int64_t value) {
  order = highest;
  known = 0;
  differences[0] = value;
}

void CompactLines::Arc::go_on(std::int64_t difference) {
  if (known < order) ++known;
  // Unsigned: differences of damaged files may overflow.
  std::uint64_t sum = static_cast<std::uint64_t>(difference);
  differences[static_cast<std::size_t>(known)] = difference;
  for (int i = known - 1; i >= 0; --i) {
    std::int64_t& d = differences[static_cast<std::size_t>(i)];
    sum += static_cast<std::uint64_t>(d);
    d = static_cast<std::int64_t>(sum);
  }
}

CompactLines::CompactLines(TextFile file, ReadReport& notes) : file_(std::move(file)), notes_(notes) {}

void CompactLines::begin() {
  started_ = true;
  const auto first = file_.next_line();
  if (!first) return;
  begin_file(*first);
  file_.unread_line();
}

bool CompactLines::begin_file(std::string_view first) {
  if (trim(column(first, 60, 20)) != "CRINEX VERS   / TYPE") return false;
  const std::string_view version = trim(column(first, 0, 20));
  if (version != "1.0" && version != "3.0") {
    throw file_.error(fmt::format("version '{}' of Hatanaka's compression is not supported", version),
                      "versions 1.0 and 3.0 are supported: expand the file with crx2rnx");
  }
  version2_ = version == "1.0";
  compact_ = in_header_ = true;
  header_ = {};
  epoch_line_.clear();
  return true;
}

std::optional<std::string_view> CompactLines::next_line() {
  if (!started_) begin();
  if (!compact_) return file_.next_line();
  if (next_ == ready_.size()) {
    ready_.clear();
    next_ = 0;
    while (ready_.empty() && file_.peek_line())
      if (in_header_)
        expand_header();
      else
        expand_epoch();
    if (ready_.empty()) return std::nullopt;
  }
  line_ = ready_[next_].line;
  return ready_[next_++].text;
}

void CompactLines::unread_line() {
  if (!compact_) return file_.unread_line();
  --next_;
  line_ = next_ > 0 ? ready_[next_ - 1].line : ready_[next_].line - 1;
}

void CompactLines::put(std::string line) {
  ready_.push_back({std::move(line), file_.line()});
}

void CompactLines::expand_header() {
  const std::string_view line = *file_.next_line();
  if (column(line, 60, 6) == "CRINEX") return;
  put(std::string(line));
  if (header_.header().version == 0)
    (void)header_.begin(line);
  else if (header_.apply(line).outcome == HeaderRecords::Outcome::End)
    in_header_ = false;
}

bool CompactLines::begins_epoch(std::string_view line) const {
  return !line.empty() && line.front() == (version2_ ? '&' : '>');
}

std::size_t CompactLines::type_count(char system) const {
  const auto types = header_.header().types.find(version2_ ? ' ' : system);
  return types == header_.header().types.end() ? 0 : types->second.size();
}

void CompactLines::expand_epoch() {
  const std::string_view line = *file_.next_line();
  if (begin_file(line)) return;  // concatenated files
  if (begins_epoch(line)) {
    epoch_line_ = line;
    if (version2_) epoch_line_[0] = ' ';
    clock_ = {};
    satellites_.clear();
  } else if (!epoch_line_.empty()) {
    change_text(epoch_line_, line);
  } else {
    return;  // nothing to compare with: reported at the loss
  }
  const std::size_t flag_at = version2_ ? 28 : 31, names_at = version2_ ? 32 : 41;
  const std::string flag(column(epoch_line_, flag_at, 1));
  const auto count = parse_integer(column(epoch_line_, flag_at + 1, 3));
  const bool event = flag > "1" && flag <= "6";
  const auto names = static_cast<std::size_t>(std::max(0LL, count.value_or(0))) * kNameWidth;
  if (!count || *count < 0 || flag < "0" || flag > "6" || (!event && epoch_line_.size() < names_at + names)) {
    // A line without its trailing blanks still has all names, because no name ends with a blank.
    damaged("the compressed epoch line is damaged: epochs are left out up to the next complete one");
    epoch_line_.clear();
    return;
  }
  if (event) return expand_event(static_cast<int>(*count));
  const auto clock = file_.next_line();
  if (!clock) return damaged("the file ends within an epoch");
  const std::string names_text(column(epoch_line_, names_at, names));
  expand_clock(*clock);
  put_epoch_line(names_text, static_cast<std::size_t>(*count));
  std::map<std::string, Satellite> now;
  std::swap(now, satellites_);  // those of the preceding epoch
  for (std::size_t i = 0; i < names_text.size(); i += kNameWidth) {
    const std::string name = names_text.substr(i, kNameWidth);
    const auto row = file_.peek_line();
    if (!row || begins_epoch(*row)) return;  // the reader reports that the epoch is short
    if (const auto before = now.find(name); before != now.end())
      satellites_[name] = std::move(before->second);
    expand_satellite(name, *file_.next_line());
  }
}

void CompactLines::expand_event(int count) {
  put(epoch_line_);
  for (int i = 0; i < count; ++i) {
    const auto row = file_.peek_line();
    if (!row || begins_epoch(*row)) break;
    (void)header_.apply(*row);
    (void)file_.next_line();
    put(std::string(*row));
  }
  // The next epoch starts again.
  epoch_line_.clear();
}

bool CompactLines::read_arc(Arc& arc, std::string_view text) const {
  if (text.size() > 2 && text[1] == '&' && is_digit(text[0])) {
    const auto value = parse_integer(text.substr(2));
    if (!value) return false;
    arc.begin(text[0] - '0', *value);
    return true;
  }
  const auto difference = parse_integer(text);
  if (!difference || arc.order < 0) return false;
  arc.go_on(*difference);
  return true;
}

void CompactLines::expand_clock(std::string_view text) {
  text = trim(text);
  if (text.empty()) {
    clock_ = {};
  } else if (!read_arc(clock_, text)) {
    clock_ = {};
    damaged("the compressed clock offset is damaged");
  }
}

void CompactLines::put_epoch_line(std::string_view names, std::size_t count) {
  if (!version2_) {
    std::string line(column(epoch_line_, 0, 41));
    line.resize(41, ' ');
    if (clock_.order >= 0) line += decimal(clock_.differences[0], 12, 15);
    return put(std::move(line));
  }
  constexpr std::size_t kNames = 32, kClock = 68;
  std::string line(column(epoch_line_, 0, kNames));
  for (std::size_t i = 0; i == 0 || i < count; i += kNamesPerLine2) {
    line.resize(kNames, ' ');
    line += names.substr(std::min(names.size(), i * kNameWidth), kNamesPerLine2 * kNameWidth);
    if (i == 0 && clock_.order >= 0) {
      line.resize(kClock, ' ');
      line += decimal(clock_.differences[0], 9, 12);
    }
    put(std::exchange(line, {}));
  }
}

void CompactLines::expand_satellite(const std::string& name, std::string_view text) {
  Satellite& satellite = satellites_[name];
  const std::size_t count = type_count(name[0]);
  satellite.arcs.resize(count);
  satellite.flags.resize(count * kFlagWidth, ' ');
  bool lost = false;
  std::size_t at = 0;
  for (Arc& arc : satellite.arcs) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    const std::string_view field = column(text, at, end - std::min(at, end));
    at = std::min(end + 1, text.size());
    if (field.empty()) {
      arc = {};
    } else if (!read_arc(arc, field)) {
      arc = {};
      lost = true;
    }
  }
  if (lost) damaged(fmt::format("a compressed value of {} is damaged", name));
  change_text(satellite.flags, text.substr(at).substr(0, satellite.flags.size()));
  std::string row = version2_ ? std::string() : name;
  for (std::size_t i = 0; i < count; ++i) {
    const Arc& arc = satellite.arcs[i];
    row += arc.order < 0 ? std::string(kValueWidth, ' ') : decimal(arc.differences[0], 3, kValueWidth);
    row += satellite.flags.substr(i * kFlagWidth, kFlagWidth);
    if (version2_ && (i + 1) % kValuesPerLine2 == 0 && i + 1 < count) put(std::exchange(row, {}));
  }
  put(std::move(row));
}

}  // namespace canyon::rinex
