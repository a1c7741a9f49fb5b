#include "canyon/validation/score_card.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "canyon/base/table_text.hpp"

namespace canyon::validation {
namespace {

struct Range {
  std::string_view key, text;
  enum class Of { Difference, Ratio, Value } of;
  double low;  ///< of a ratio; of a value that of a perfect simulation
  double end;  ///< of the range
};
using Of = Range::Of;
constexpr std::array<Range, 12> kRanges{{{"horizontal_p50_m", "0.7 to 1.4 of recorded", Of::Ratio, 0.7, 1.4},
                                         {"horizontal_p95_m", "0.7 to 1.4 of recorded", Of::Ratio, 0.7, 1.4},
                                         {"tracked_los", "within 0.1", Of::Difference, 0, 0.1},
                                         {"tracked_nlos", "within 0.1", Of::Difference, 0, 0.1},
                                         {"cn0_los_less_nlos_db", "within 2", Of::Difference, 0, 2},
                                         {"ks_cn0_los", "at most 0.2", Of::Value, 0, 0.2},
                                         {"ks_cn0_nlos", "at most 0.2", Of::Value, 0, 0.2},
                                         {"ks_error_los", "at most 0.2", Of::Value, 0, 0.2},
                                         {"ks_error_nlos", "at most 0.2", Of::Value, 0, 0.2},
                                         {"satellites_used", "within 1", Of::Difference, 0, 1},
                                         {"spearman", "at least 0.6", Of::Value, 1, 0.6},
                                         {"median_difference_m", "at most 10", Of::Value, 0, 10}}};

const Range* range_of(std::string_view key) {
  const auto at =
      std::find_if(kRanges.begin(), kRanges.end(), [key](const Range& r) { return r.key == key; });
  return at != kRanges.end() ? &*at : nullptr;
}

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
  const Range* range = range_of(h.key);
  if (range == nullptr || !h.simulated || (range->of != Of::Value && !h.measured)) return std::nullopt;
  switch (range->of) {
    case Of::Difference:
      return (*h.simulated - *h.measured) / range->end;
    case Of::Ratio: {
      const double ratio = *h.simulated / *h.measured;
      return std::log(ratio) / (ratio < 1 ? -std::log(range->low) : std::log(range->end));
    }
    case Of::Value:
      break;
  }
  return (*h.simulated - range->low) / (range->end - range->low);
}

std::optional<bool> within_range(const Headline& h) {
  const std::optional<double> distance = range_distance(h);
  const double rounding = 1e-9;
  return distance ? std::optional(std::abs(*distance) <= 1 + rounding) : std::nullopt;
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
  for (const Range& range : kRanges) {
    TextRow line{"", std::string(range.text)};
    for (const RecordingRow* row : recordings) {
      const Headline* h = headline_with(row->headlines, range.key);
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
