#include "canyon/validation/recording_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/json.hpp"

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

/// Both numbers of a headline as `show` writes one.
template <typename Number, typename Show>
std::string pair_text(const Headline& h, const Number& measured, const Number& simulated, const Show& show) {
  const auto shown = [&show](const Number& value) { return value ? show(*value) : std::string("-"); };
  if (!h.pair || (!measured && !simulated)) return shown(simulated);
  return fmt::format("{} ({})", shown(simulated), shown(measured));
}

}  // namespace

std::string markdown_cell(const std::string& text) {
  std::string safe;
  for (const char c : text) safe += c == '|' ? std::string("\\|") : std::string(1, c);
  return safe;
}

std::string value_text(const Headline& h) {
  return pair_text(h, h.measured, h.simulated,
                   [&h](double value) { return fmt::format("{:.{}f}", value, h.decimals); });
}

std::string interval_text(const Headline& h) {
  return pair_text(h, h.measured_interval, h.simulated_interval, [&h](const Interval& i) {
    return fmt::format("{:.{}f} to {:.{}f}", i.low, h.decimals, i.high, h.decimals);
  });
}

std::vector<std::string> titles_of(const std::vector<RecordingRow>& rows) {
  std::vector<std::string> titles;
  for (const RecordingRow& row : rows) {
    for (const Headline& h : row.headlines) {
      if (std::find(titles.begin(), titles.end(), h.title) == titles.end()) titles.push_back(h.title);
    }
  }
  return titles;
}

const Headline* headline_of(const RecordingRow& row, const std::string& title) {
  const auto at = std::find_if(row.headlines.begin(), row.headlines.end(),
                               [&title](const Headline& h) { return h.title == title; });
  return at != row.headlines.end() ? &*at : nullptr;
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
  const std::vector<std::string> titles = titles_of(rows);
  std::string text = "| recording |", rule = "|---|";
  for (const std::string& title : titles) {
    text += fmt::format(" {} |", title);
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const RecordingRow& row : rows) {
    const auto line = [&](const std::string& name, std::string (*show)(const Headline&)) {
      text += fmt::format("| {} |", markdown_cell(name));
      for (const std::string& title : titles) {
        const Headline* h = headline_of(row, title);
        text += fmt::format(" {} |", h != nullptr ? show(*h) : "-");
      }
      text += "\n";
    };
    line(row.name, value_text);
    line("95 %", interval_text);
  }
  text += "\nSimulated, with measured in brackets, where both are given.\n\n";
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
