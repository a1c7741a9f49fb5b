#include "canyon/base/read_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "canyon/base/output_file.hpp"

namespace canyon {
namespace {

bool begins_number(std::string_view text) {
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  return !text.empty() && std::isdigit(static_cast<unsigned char>(text[0])) != 0;
}

/// Key of a note: the file, and the reason without its numbers and quoted parts.
std::string key(const std::string& file, std::string_view what) {
  std::string common = file + '\n';
  bool word_begins = true;
  for (std::size_t at = 0; at < what.size(); ++at) {
    std::size_t end = at;
    if (word_begins && what[at] == '\'') end = what.find('\'', at + 1);
    if (word_begins && begins_number(what.substr(at))) end = what.find(' ', at);
    if (end != at) {
      if (end == std::string_view::npos) break;
      at = end;
    }
    word_begins = what[at] == ' ' || what[at] == '(';
    common += what[at];
  }
  return common;
}

}  // namespace

void ReadReport::add(Level level, const InputError& reason, std::size_t count, std::string_view outcome) {
  const auto [known, is_new] = index_.try_emplace(key(reason.file(), reason.problem()), notes_.size());
  if (is_new)
    notes_.push_back({level, reason, std::string(outcome), count});
  else
    notes_[known->second].count += count;
}

void ReadReport::count_or_add(Level level, int line, std::string_view what, std::string_view outcome) {
  if (const auto known = index_.find(key(path_.string(), what)); known != index_.end())
    ++notes_[known->second].count;
  else
    add(level, InputError(path_, line, what), 1, outcome);
}

ReadReport::Note& ReadReport::note_of(Note::Form form, Level level, const std::string& file,
                                      std::string_view what) {
  const auto [known, is_new] =
      index_.try_emplace(fmt::format("{}\n={}\n{}", file, name(level), what), notes_.size());
  if (is_new) notes_.push_back({level, InputError(file, 0, what), {}, 0, form});
  return notes_[known->second];
}

void ReadReport::add_line(Level level, std::string_view line) {
  note_of(Note::Form::Line, level, {}, line).count = 1;
}

void ReadReport::add_counted(Level level, std::string_view what, std::string_view id, std::size_t count) {
  Note& note = note_of(Note::Form::Things, level, path_.string(), what);
  note.count += count;
  if (!id.empty() && note.ids.size() < kIds) note.ids.emplace_back(id);
}

void ReadReport::append(const ReadReport& other, const std::filesystem::path& file) {
  for (const Note& note : other.notes_) {
    if (note.form == Note::Form::Record) {
      add(note.level, note.first, note.count, note.outcome);
      continue;
    }
    Note& mine = note_of(note.form, note.level, note.first.file().empty() ? file.string() : note.first.file(),
                         note.first.problem());
    mine.count = std::max(mine.count, note.count);
    if (mine.ids.empty()) mine.ids = note.ids;
  }
  losses_ += other.losses_;
  if (!first_loss_) first_loss_ = other.first_loss_;
}

std::size_t ReadReport::count(std::string_view what) const {
  const auto known = index_.find(key(path_.string(), what));
  return known == index_.end() ? 0 : notes_[known->second].count;
}

void ReadReport::require_majority(std::size_t good) const {
  if (good > losses_ || !first_loss_) return;
  if (good == 0) throw InputError(*first_loss_);
  throw InputError(first_loss_->file(), first_loss_->line(),
                   first_loss_->problem() + " (the first of " + std::to_string(losses_) + " bad records of " +
                       std::to_string(losses_ + good) + ")",
                   first_loss_->hint());
}

std::string_view ReadReport::name(Level level) {
  static constexpr std::array<std::string_view, 3> kNames{"loss", "guess", "remark"};
  return kNames.at(static_cast<std::size_t>(level));
}

std::string ReadReport::Note::line() const {
  std::string what = first.problem();
  if (form == Form::Record) {
    if (count > 1) what += fmt::format(" (the first of {})", count);
    return InputError(first.file(), first.line(), what, outcome).what();
  }
  if (form == Form::Line) return InputError(first.file(), 0, what).what();
  const std::size_t number = what.find("{}");
  if (number != std::string::npos)
    what.replace(number, 2, std::to_string(count));
  else if (count > 1 && ids.empty())
    what += fmt::format(" ({} times)", count);
  if (!ids.empty()) what += fmt::format(": {}", fmt::join(ids, ", "));
  if (!ids.empty() && count > ids.size()) what += fmt::format(" and {} more", count - ids.size());
  return InputError(first.file(), 0, what).what();
}

std::vector<ReadReport::Entry> ReadReport::entries(Level up_to) const {
  std::vector<Entry> entries;
  std::map<std::string, std::size_t> listed, more;  // by file
  for (const Note& note : notes_) {
    if (note.level > up_to) continue;
    const std::string& file = note.first.file();
    if (note.level == Level::Loss && note.form == Note::Form::Record && ++listed[file] > kListed)
      more[file] += note.count;
    else
      entries.emplace_back(note.level, note.line());
  }
  for (const auto& [file, count] : more) {
    entries.emplace_back(Level::Loss,
                         InputError(file, 0, fmt::format("{} more damaged records", count), kLeftOut).what());
  }
  return entries;
}

std::vector<std::string> ReadReport::lines(Level up_to) const {
  std::vector<std::string> lines;
  for (Entry& entry : entries(up_to)) lines.push_back(std::move(entry.second));
  return lines;
}

std::vector<std::string> ReadReport::warnings() const {
  std::vector<std::string> lines = this->lines(Level::Loss);
  for (Entry& entry : entries(Level::Guess))
    if (entry.first == Level::Guess) lines.push_back(std::move(entry.second));
  return lines;
}

std::vector<std::string> ReadReport::shown(std::string_view where) const {
  std::vector<std::string> lines = warnings();
  if (lines.size() <= kShown) return lines;
  const std::size_t losses = this->lines(Level::Loss).size(), guesses = lines.size() - losses;
  const std::size_t more = lines.size() - kShown;
  const std::size_t guess_lines =
      std::max(std::min<std::size_t>(2, guesses), kShown - std::min(kShown, losses));
  std::rotate(lines.begin() + static_cast<std::ptrdiff_t>(kShown - guess_lines),
              lines.begin() + static_cast<std::ptrdiff_t>(losses), lines.end());
  lines.resize(kShown);
  lines.push_back(fmt::format("{} more {}: {}", more, more == 1 ? "warning" : "warnings", where));
  return lines;
}

void ReadReport::write(const std::filesystem::path& folder) const {
  std::string text;
  for (const auto& [level, line] : entries())
    text += fmt::format("{}: {}\n", name(level), hide_passwords(line));
  write_file(folder / "report.txt", text.empty() ? "Nothing was left out or guessed.\n" : text);
}

}  // namespace canyon
