#include "canyon/validation/score_card.hpp"

#include <fmt/format.h>

#include "canyon/base/table_text.hpp"

namespace canyon::validation {
namespace {

std::string text_of(const Score& score) {
  return fmt::format("{} of {}", score.within, score.of);
}

/// The value with its interval, and whether it lies in its range.
std::string judged_text(const Headline& h, bool within) {
  std::string text = value_text(h);
  if (const auto& i = h.simulated_interval) {
    text += fmt::format(", {:.{}f} to {:.{}f}", i->low, h.decimals, i->high, h.decimals);
  }
  return text + (within ? ": yes" : ": no");
}

}  // namespace

std::optional<double> range_distance(const Headline& h) {
  const FigureInfo* info = figure_info(h.key);
  const auto compared = info != nullptr ? info->range.compared(h.measured, h.simulated) : std::nullopt;
  return compared ? std::optional(info->range.distance(*compared)) : std::nullopt;
}

std::optional<bool> within_range(const Headline& h) {
  const std::optional<double> distance = range_distance(h);
  return distance ? std::optional(is_within(*distance)) : std::nullopt;
}

Score score_of(const std::vector<Headline>& headlines) {
  Score score;
  for (const Headline& h : headlines) {
    const std::optional<bool> within = within_range(h);
    score.of += within.has_value();
    score.within += within.value_or(false);
  }
  return score;
}

std::string seed_scores(const std::vector<SeedRows>& seeds) {
  TextRow head{"seed"};
  std::vector<TextRow> lines;
  Score sum;
  for (const SeedRows& each : seeds) {
    Score all;
    TextRow& line = lines.emplace_back(TextRow{fmt::format("{}", each.seed)});
    for (const RecordingRow& row : each.rows) {
      if (!row.pooled.empty()) continue;
      const Score score = score_of(row.headlines);
      line.push_back(text_of(score));
      all += score;
      if (&each == &seeds.front()) head.push_back(row.name);
    }
    line.push_back(text_of(all));
    sum += all;
  }
  head.emplace_back("all");
  const double mean = sum.of > 0 ? 100.0 * static_cast<double>(sum.within) / static_cast<double>(sum.of) : 0;
  return markdown_table(head, lines) +
         fmt::format("\nMean of {} seeds: {:.0f} % of the figures within their ranges.\n", seeds.size(),
                     mean);
}

std::string score_card(const std::vector<RecordingRow>& rows) {
  std::vector<const RecordingRow*> recordings;
  for (const RecordingRow& row : rows) {
    if (row.pooled.empty()) recordings.push_back(&row);
  }
  TextRow head{"figure", "range"}, sums{"within their ranges", ""};
  Score all;
  for (const RecordingRow* row : recordings) {
    head.push_back(row->name);
    const Score score = score_of(row->headlines);
    sums.push_back(text_of(score));
    all += score;
  }
  std::vector<TextRow> lines;
  for (const FigureInfo& info : figure_infos()) {
    const bool ratio = info.range.of == Range::Of::Ratio;
    TextRow line{"", info.range.text() + (ratio ? " of recorded" : "")};
    for (const RecordingRow* row : recordings) {
      const Headline* h = headline_with(row->headlines, info.key);
      const auto within = h != nullptr ? within_range(*h) : std::nullopt;
      if (within) line.front() = h->title;
      line.push_back(within ? judged_text(*h, *within) : "-");
    }
    if (!line.front().empty()) lines.push_back(std::move(line));
  }
  lines.push_back(std::move(sums));
  return markdown_table(head, lines) +
         fmt::format("\nScore: {} of {} figures within their ranges.\n", all.within, all.of);
}

}  // namespace canyon::validation
