#include "canyon/analysis/validation/recording_table.hpp"

#include <fmt/format.h>

#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"

namespace canyon::validation {

namespace {

Json ends(const std::optional<Interval>& interval) {
  return interval ? Json{interval->low, interval->high} : Json();
}

Json headlines_json(const std::vector<KeyMetric>& key_metrics) {
  Json json = Json::object();
  for (const KeyMetric& h : key_metrics) {
    if (h.pair()) {
      json[h.info.key] = {{"measured", h.measured},
                          {"measured_interval_95", ends(h.measured_interval)},
                          {"simulated", h.simulated},
                          {"simulated_interval_95", ends(h.simulated_interval)}};
    } else {
      json[h.info.key] = {{"value", h.simulated}, {"interval_95", ends(h.simulated_interval)}};
    }
  }
  return json;
}

}  // namespace

std::string description_of(const RecordingRow& row) {
  if (!row.pooled.empty())
    return fmt::format("{}: observations of {} pooled", row.name, fmt::join(row.pooled, ", "));
  return fmt::format("{}{}: {}{}", row.name,
                     row.receiver_class.empty() ? "" : fmt::format(" ({})", row.receiver_class), row.part,
                     row.never_tracked.empty() ? "" : "; " + row.never_tracked);
}

std::string to_text(const std::vector<RecordingRow>& rows) {
  std::vector<KeyMetric> columns;  // of all rows, the first of each key
  for (const RecordingRow& row : rows)
    for (const KeyMetric& h : row.key_metrics)
      if (headline_with(columns, h.info.key) == nullptr) columns.push_back(h);
  TextRow head{"recording"};
  for (const KeyMetric& column : columns) head.emplace_back(column.info.title);
  std::vector<TextRow> lines;
  for (const RecordingRow& row : rows) {
    const auto line = [&](const std::string& name, std::string (*show)(const KeyMetric&)) {
      TextRow& cells = lines.emplace_back(TextRow{name});
      for (const KeyMetric& column : columns) {
        const KeyMetric* h = headline_with(row.key_metrics, column.info.key);
        cells.push_back(h != nullptr ? show(*h) : "-");
      }
    };
    line(row.name, value_text);
    line("95 %", interval_text);
  }
  std::string text =
      text_table(head, lines) + "\nSimulated, with measured in brackets, if both are given.\n\n";
  for (const RecordingRow& row : rows) text += fmt::format("- {}\n", description_of(row));
  return text;
}

std::string to_json(const std::vector<RecordingRow>& rows) {
  Json json{{"recordings", Json::array()}, {"classes", Json::array()}};
  for (const RecordingRow& row : rows) {
    if (!row.pooled.empty()) {
      json["classes"].push_back({{"class", row.receiver_class},
                                 {"recordings", row.pooled},
                                 {"headlines", headlines_json(row.key_metrics)}});
      continue;
    }
    Json one{{"name", row.name}, {"class", row.receiver_class}};
    one["headlines"] = headlines_json(row.key_metrics);
    const Json metrics = Json::parse(row.metrics_json);
    for (const auto& [key, value] : metrics.members()) one[key] = value;
    json["recordings"].push_back(std::move(one));
  }
  return json.dump(2) + "\n";
}

namespace {

std::string text_of(const Score& score) {
  return fmt::format("{} of {}", score.within, score.of);
}

/// The value with its interval, and whether it is in its range.
std::string judged_text(const KeyMetric& h, bool within) {
  std::string text = value_text(h);
  if (const auto& i = h.simulated_interval)
    text += fmt::format(", {:.{}f} to {:.{}f}", i->low, h.info.decimals, i->high, h.info.decimals);
  return text + (within ? ": yes" : ": no");
}

}  // namespace

Score score_of(const std::vector<KeyMetric>& key_metrics) {
  Score score;
  for (const KeyMetric& h : key_metrics) {
    const std::optional<bool> within = h.within();
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
      const Score score = score_of(row.key_metrics);
      line.push_back(text_of(score));
      all += score;
      if (&each == &seeds.front()) head.push_back(row.name);
    }
    line.push_back(text_of(all));
    sum += all;
  }
  head.emplace_back("all");
  const double mean = sum.of > 0 ? 100.0 * static_cast<double>(sum.within) / static_cast<double>(sum.of) : 0;
  return text_table(head, lines) +
         fmt::format("\nMean of {} seeds: {:.0f} % of the metrics within their ranges.\n", seeds.size(),
                     mean);
}

std::string score_card(const std::vector<RecordingRow>& rows) {
  std::vector<const RecordingRow*> recordings;
  for (const RecordingRow& row : rows)
    if (row.pooled.empty()) recordings.push_back(&row);
  TextRow head{"metric", "range"}, sums{"within their ranges", ""};
  Score all;
  for (const RecordingRow* row : recordings) {
    head.push_back(row->name);
    const Score score = score_of(row->key_metrics);
    sums.push_back(text_of(score));
    all += score;
  }
  std::vector<TextRow> lines;
  for (const MetricInfo& info : metric_infos()) {
    const bool ratio = info.range.of == MetricRange::Of::Ratio;
    TextRow line{"", info.range.text() + (ratio ? " of recorded" : "")};
    for (const RecordingRow* row : recordings) {
      const KeyMetric* h = headline_with(row->key_metrics, info.key);
      const auto within = h != nullptr ? h->within() : std::nullopt;
      if (within) line.front() = h->info.title;
      line.push_back(within ? judged_text(*h, *within) : "-");
    }
    if (!line.front().empty()) lines.push_back(std::move(line));
  }
  lines.push_back(std::move(sums));
  return text_table(head, lines) +
         fmt::format("\nScore: {} of {} metrics within their ranges.\n", all.within, all.of);
}

}  // namespace canyon::validation
