#include "canyon/base/record_notes.hpp"

#include <cctype>

namespace canyon {
namespace {

bool begins_number(std::string_view text) {
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  return !text.empty() && std::isdigit(static_cast<unsigned char>(text[0])) != 0;
}

/// A text without its numbers and quoted parts.
std::string common_part(std::string_view what) {
  std::string common;
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

RecordNotes::Reason* RecordNotes::find(std::string_view what) {
  const auto known = index_.find(common_part(what));
  return known == index_.end() ? nullptr : &reasons_[known->second];
}

void RecordNotes::add(const InputError& record, std::size_t count, std::string_view outcome, bool is_bad) {
  if (Reason* known = find(record.problem())) {
    known->count += count;
    return;
  }
  index_.emplace(common_part(record.problem()), reasons_.size());
  reasons_.push_back({record, std::string(outcome), count, is_bad});
}

void RecordNotes::bad(const InputError& error, std::size_t count, std::string_view outcome) {
  if (!first_bad_) first_bad_ = error;
  bad_count_ += count;
  add(error, count, outcome, true);
}

std::size_t RecordNotes::count(std::string_view what) const {
  const auto known = index_.find(common_part(what));
  return known == index_.end() ? 0 : reasons_[known->second].count;
}

void RecordNotes::require_most(std::size_t good) const {
  if (good > bad_count_ || !first_bad_) return;
  if (good == 0) throw InputError(*first_bad_);
  throw InputError(first_bad_->file(), first_bad_->line(),
                   first_bad_->problem() + " (the first of " + std::to_string(bad_count_) +
                       " bad records of " + std::to_string(bad_count_ + good) + ")",
                   first_bad_->cure());
}

std::vector<std::string> RecordNotes::lines() const {
  std::vector<std::string> lines;
  std::size_t listed = 0, more = 0;
  for (const Reason& reason : reasons_) {
    if (reason.bad && ++listed > kListed) {
      more += reason.count;
      continue;
    }
    const std::string of = reason.count > 1 ? " (the first of " + std::to_string(reason.count) + ")" : "";
    lines.emplace_back(
        InputError(reason.first.file(), reason.first.line(), reason.first.problem() + of, reason.outcome)
            .what());
  }
  if (more > 0) {
    lines.emplace_back(InputError(path_, 0, std::to_string(more) + " more damaged records", kLeftOut).what());
  }
  return lines;
}

}  // namespace canyon
