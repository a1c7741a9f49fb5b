#include "canyon/sky/rinex/android_log.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/text.hpp"

namespace canyon::rinex {
namespace {

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

/// A comment's text; empty for another line.
std::optional<std::string_view> comment_of(std::string_view line) {
  line = trim(line);
  if (line.empty() || line.front() != '#') return std::nullopt;
  return trim(line.substr(1));
}

/// The first field where it can be a kind of lines: letters with a comma behind.
std::string_view kind_of(std::string_view line) {
  const std::size_t comma = line.find(',');
  if (comma == std::string_view::npos) return {};
  const std::string_view kind = trim(line.substr(0, comma));
  return std::all_of(kind.begin(), kind.end(), is_letter) ? kind : std::string_view();
}

/// Some logs have their names of columns in a line that is not a comment.
bool names_columns(std::string_view line) {
  const std::string_view second = trim(line.substr(line.find(',') + 1));
  return !second.empty() && is_letter(second.front()) && second.find("ime") != std::string_view::npos &&
         second.find("ime") < second.find(',');
}

}  // namespace

std::map<std::string, std::size_t> android_log_kinds(const std::filesystem::path& path) {
  std::map<std::string, std::size_t> kinds;
  TextFile file = TextFile::streamed(path);
  while (const auto line = file.next_line()) {
    const std::string_view kind = kind_of(*line);
    if (!kind.empty() && kind.size() < 32) ++kinds[std::string(kind)];
  }
  return kinds;
}

std::string android_log_kinds_text(const std::filesystem::path& path) {
  std::vector<std::string> parts;
  for (const auto& [kind, count] : android_log_kinds(path))
    parts.push_back(fmt::format("{} {}", kind, count));
  return parts.empty() ? "no line" : fmt::format("{}", fmt::join(parts, ", "));
}

bool AndroidLog::next() {
  while (const auto line = file_.next_line()) {
    if (const auto comment = comment_of(*line)) {
      if (kind_of(*comment) == kind_) read_columns(*comment);
      if (comment->starts_with("Version:")) read_version(*comment);
      continue;
    }
    if (kind_of(*line) != kind_) continue;
    if (kind_ == "Raw" && names_columns(*line)) {
      read_columns(*line);
      continue;
    }
    if (at_.empty()) {
      throw file_.error(
          fmt::format("a line of '{0}' before any header '# {0},...' that names its columns", kind_),
          "keep the comments at the head of the log");
    }
    fields_ = split(*line, ',');
    return true;
  }
  return false;
}

void AndroidLog::read_columns(std::string_view line) {
  std::vector<std::string_view> found = split(line, ',');
  for (std::string_view& each : found) each = trim(each);
  at_.assign(names_.size(), -1);
  for (std::size_t column = 0; column < names_.size(); ++column) {
    for (const std::string_view name : split(names_[column], '|')) {
      const auto at = std::find(found.begin(), found.end(), name);
      if (at == found.end()) continue;
      at_[column] = static_cast<int>(at - found.begin());
      break;
    }
  }
}

/// "Version: v3.0.6.4 Platform: 14 Manufacturer: Google Model: Pixel 7".
void AndroidLog::read_version(std::string_view comment) {
  const auto part = [&](std::string_view label, std::string_view next) {
    const std::size_t at = comment.find(label);
    if (at == std::string_view::npos) return std::string();
    const std::size_t begin = at + label.size();
    const std::size_t end = next.empty() ? std::string_view::npos : comment.find(next, begin);
    const std::string_view text = trim(comment.substr(begin, end - begin));
    return text == "null" ? std::string() : std::string(text);
  };
  version_ = part("Version:", " Platform:");
  device_ = std::string(trim(part("Manufacturer:", " Model:") + " " + part("Model:", {})));
}

std::string_view AndroidLog::text(std::size_t column) const {
  if (!has(column) || static_cast<std::size_t>(at_[column]) >= fields_.size()) return {};
  return trim(fields_[static_cast<std::size_t>(at_[column])]);
}

std::optional<long long> AndroidLog::integer(std::size_t column) const {
  return parse_integer(text(column));
}

std::optional<double> AndroidLog::number(std::size_t column) const {
  return parse_double(text(column));
}

std::string_view AndroidLog::name(std::size_t column) const {
  return names_[column].substr(0, names_[column].find('|'));
}

}  // namespace canyon::rinex
