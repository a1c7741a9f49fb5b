#include "canyon/base/read_report.hpp"

#include <cctype>

namespace canyon {
namespace {

bool begins_number(std::string_view text) {
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  return !text.empty() && std::isdigit(static_cast<unsigned char>(text[0])) != 0;
}

/// A file and a reason without its numbers and quoted parts.
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

void ReadReport::append(const ReadReport& other) {
  for (const Note& note : other.notes_) add(note.level, note.first, note.count, note.outcome);
  losses_ += other.losses_;
  if (!first_loss_) first_loss_ = other.first_loss_;
}

std::size_t ReadReport::count(std::string_view what) const {
  const auto known = index_.find(key(path_.string(), what));
  return known == index_.end() ? 0 : notes_[known->second].count;
}

void ReadReport::require_most(std::size_t good) const {
  if (good > losses_ || !first_loss_) return;
  if (good == 0) throw InputError(*first_loss_);
  throw InputError(first_loss_->file(), first_loss_->line(),
                   first_loss_->problem() + " (the first of " + std::to_string(losses_) + " bad records of " +
                       std::to_string(losses_ + good) + ")",
                   first_loss_->cure());
}

std::vector<std::string> ReadReport::lines(Level up_to) const {
  std::vector<std::string> lines;
  std::size_t listed = 0, more = 0;
  for (const Note& note : notes_) {
    if (note.level > up_to) continue;
    if (note.level == Level::Loss && ++listed > kListed) {
      more += note.count;
      continue;
    }
    const std::string of = note.count > 1 ? " (the first of " + std::to_string(note.count) + ")" : "";
    lines.emplace_back(
        InputError(note.first.file(), note.first.line(), note.first.problem() + of, note.outcome).what());
  }
  if (more > 0) {
    lines.emplace_back(InputError(path_, 0, std::to_string(more) + " more damaged records", kLeftOut).what());
  }
  return lines;
}

}  // namespace canyon
