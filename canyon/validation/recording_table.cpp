#include "canyon/validation/recording_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/json.hpp"
#include "canyon/base/table_text.hpp"

namespace canyon::validation {
namespace {

Json ends(const std::optional<Interval>& interval) {
  return interval ? Json{interval->low, interval->high} : Json();
}

Json headlines_json(const std::vector<Headline>& headlines) {
  Json json = Json::object();
  for (const Headline& h : headlines) {
    if (h.pair) {
      json[h.key] = {{"measured", h.measured},
                     {"measured_interval_95", ends(h.measured_interval)},
                     {"simulated", h.simulated},
                     {"simulated_interval_95", ends(h.simulated_interval)}};
    } else {
      json[h.key] = {{"value", h.simulated}, {"interval_95", ends(h.simulated_interval)}};
    }
  }
  return json;
}

}  // namespace

std::vector<Headline> headlines_of(const std::vector<RecordingRow>& rows) {
  std::vector<Headline> all;
  for (const RecordingRow& row : rows) {
    for (const Headline& h : row.headlines) {
      if (headline_with(all, h.key) == nullptr) all.push_back(h);
    }
  }
  return all;
}

std::string description_of(const RecordingRow& row) {
  if (!row.pooled.empty()) {
    return fmt::format("{}: observations of {} pooled", row.name, fmt::join(row.pooled, ", "));
  }
  return fmt::format("{}{}: {}{}", row.name,
                     row.receiver_class.empty() ? "" : fmt::format(" ({})", row.receiver_class), row.part,
                     row.never_tracked.empty() ? "" : "; " + row.never_tracked);
}

std::string to_markdown(const std::vector<RecordingRow>& rows) {
  const std::vector<Headline> columns = headlines_of(rows);
  TextRow head{"recording"};
  for (const Headline& column : columns) head.push_back(column.title);
  std::vector<TextRow> lines;
  for (const RecordingRow& row : rows) {
    const auto line = [&](const std::string& name, std::string (*show)(const Headline&)) {
      TextRow& cells = lines.emplace_back(TextRow{name});
      for (const Headline& column : columns) {
        const Headline* h = headline_with(row.headlines, column.key);
        cells.push_back(h != nullptr ? show(*h) : "-");
      }
    };
    line(row.name, value_text);
    line("95 %", interval_text);
  }
  std::string text =
      markdown_table(head, lines) + "\nSimulated, with measured in brackets, where both are given.\n\n";
  for (const RecordingRow& row : rows) text += fmt::format("- {}\n", description_of(row));
  return text;
}

std::string to_json(const std::vector<RecordingRow>& rows) {
  Json json{{"recordings", Json::array()}, {"classes", Json::array()}};
  for (const RecordingRow& row : rows) {
    if (!row.pooled.empty()) {
      json["classes"].push_back({{"class", row.receiver_class},
                                 {"recordings", row.pooled},
                                 {"headlines", headlines_json(row.headlines)}});
      continue;
    }
    Json one{{"name", row.name}, {"class", row.receiver_class}};
    one["headlines"] = headlines_json(row.headlines);
    const Json figures = Json::parse(row.figures_json);
    for (const auto& [key, value] : figures.members()) one[key] = value;
    json["recordings"].push_back(std::move(one));
  }
  return json.dump(2) + "\n";
}

}  // namespace canyon::validation
