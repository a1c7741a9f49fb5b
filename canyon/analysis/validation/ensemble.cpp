#include "canyon/analysis/validation/ensemble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "canyon/base/json.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"

namespace canyon::validation {
namespace {

/// 5, 25, 50, 75, 95 % of the next sample.
using Five = std::array<double, 5>;
enum Quantile : std::size_t { kLow90, kLow50, kMiddle, kHigh50, kHigh90 };

Five five_of(const std::vector<double>& values) {
  constexpr Five kShares{0.05, 0.25, 0.5, 0.75, 0.95};
  Five five{};
  for (std::size_t i = 0; i < five.size(); ++i) five.at(i) = predictive_quantile(values, kShares.at(i));
  return five;
}

double interval_score(const Five& five, double truth) {
  const auto outside = [truth](double low, double high) {
    return std::max({low - truth, truth - high, 0.0});
  };
  const double half = five[kHigh50] - five[kLow50], maximum = five[kHigh90] - five[kLow90];
  return (std::abs(truth - five[kMiddle]) / 2 + 0.25 * half + outside(five[kLow50], five[kHigh50]) +
          0.05 * maximum + outside(five[kLow90], five[kHigh90])) /
         2.5;
}

/// The distance from the recorded value in units of the range, as in the point's key metric.
std::optional<double> distance_of(const KeyMetric& point, double simulated) {
  KeyMetric h = point;
  h.simulated = simulated;
  return h.distance();
}

void add_scores(const KeyMetric& point, const std::vector<double>& values, EnsembleMetric& metric) {
  std::vector<double> distances;
  for (const double value : values) {
    const auto distance = distance_of(point, value);
    if (!distance || !std::isfinite(*distance)) return;
    distances.push_back(*distance);
  }
  metric.score = interval_score(five_of(distances), 0);
  if (const auto distance = point.distance()) metric.point_score = std::abs(*distance);
}

std::string percent(std::size_t part, std::size_t all) {
  const double fraction = all > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(all) : 0;
  return fmt::format("{:.0f} %", fraction);
}

std::string table_of(const EnsembleRow& row) {
  std::string text = fmt::format("{}: {}; {} samples\n\n", row.name, row.part, row.samples.size());
  for (const std::string& unknown : row.unknowns) text += fmt::format("- {}\n", unknown);
  std::vector<TextRow> lines;
  for (const EnsembleMetric& f : ensemble_metrics(row)) {
    const auto number = [&f](double value) { return fmt::format("{:.{}f}", value, f.info.decimals); };
    const auto ends = [&number](const Interval& i) { return number(i.low) + " to " + number(i.high); };
    lines.push_back({std::string(f.info.title), number(f.recorded), f.point ? number(*f.point) : "-",
                     number(f.median), ends(f.half), ends(f.maximum),
                     f.within_half()   ? "50 %"
                     : f.within_most() ? "90 %"
                                       : "no"});
  }
  return text + "\n" +
         text_table({"metric", "recorded", "as it is", "median", "50 %", "90 %", "within"}, lines) + "\n";
}

Json ends_json(const Interval& interval) {
  return {interval.low, interval.high};
}

Json metric_json(const EnsembleMetric& f) {
  return {{"recorded", f.recorded},
          {"point", f.point},
          {"median", f.median},
          {"interval_50", ends_json(f.half)},
          {"interval_90", ends_json(f.maximum)},
          {"score", f.score},
          {"point_score", f.point_score}};
}

}  // namespace

std::vector<EnsembleMetric> ensemble_metrics(const EnsembleRow& row) {
  std::vector<EnsembleMetric> metrics;
  for (const KeyMetric& point : row.point) {
    if (!point.pair() || !point.measured) continue;
    std::vector<double> values;
    for (const EnsembleRow::EnsembleSample& draw : row.samples) {
      const KeyMetric* h = headline_with(draw.key_metrics, point.info.key);
      if (h != nullptr && h->simulated) values.push_back(*h->simulated);
    }
    if (values.size() < 2) continue;
    const Five five = five_of(values);
    EnsembleMetric metric{point.info, *point.measured, point.simulated, five[kMiddle], {}, {}, {}, {}};
    metric.half = {five[kLow50], five[kHigh50]};
    metric.maximum = {five[kLow90], five[kHigh90]};
    add_scores(point, values, metric);
    metrics.push_back(std::move(metric));
  }
  return metrics;
}

Coverage coverage(const std::vector<EnsembleRow>& rows) {
  Coverage sum;
  for (const EnsembleRow& row : rows) {
    for (const EnsembleMetric& f : ensemble_metrics(row)) {
      ++sum.metrics;
      sum.within_half += f.within_half();
      sum.within_most += f.within_most();
      if (f.info.key == "horizontal_p50_m")
        sum.widest_p50 = std::max(sum.widest_p50, f.maximum.high / f.maximum.low);
      if (!f.score || !f.point_score) continue;
      ++sum.scored;
      sum.score += *f.score;
      sum.point_score += *f.point_score;
    }
  }
  if (sum.scored > 0) {
    sum.score /= static_cast<double>(sum.scored);
    sum.point_score /= static_cast<double>(sum.scored);
  }
  return sum;
}

std::string ensemble_text(const std::vector<EnsembleRow>& rows) {
  std::string text;
  for (const EnsembleRow& row : rows) text += table_of(row);
  const Coverage sum = coverage(rows);
  std::vector<TextRow> lines;
  for (const auto& [fraction, within, goal] :
       {std::tuple("50", sum.within_half, "35 to 65 %"), std::tuple("90", sum.within_most, "80 to 97 %")}) {
    lines.push_back({fmt::format("within the {} % interval", fraction),
                     fmt::format("{} ({})", within, percent(within, sum.metrics)), goal});
  }
  if (sum.widest_p50 > 0) {
    lines.push_back({"widest 90 % interval of p50, ratio of its ends", fmt::format("{:.1f}", sum.widest_p50),
                     "at most 4"});
  }
  if (sum.scored > 0) {
    lines.push_back({"interval score, in ranges of the score card", fmt::format("{:.2f}", sum.score),
                     fmt::format("below {:.2f}, as it is", sum.point_score)});
  }
  return text + text_table({fmt::format("of {} recorded metrics", sum.metrics), "", "goal"}, lines);
}

std::string ensemble_json(const std::vector<EnsembleRow>& rows) {
  const Coverage sum = coverage(rows);
  Json json{{"recordings", Json::array()}};
  json["coverage"] = {{"figures", sum.metrics},         {"within_50", sum.within_half},
                      {"within_90", sum.within_most},   {"score", sum.score},
                      {"point_score", sum.point_score}, {"widest_p50_ratio", sum.widest_p50}};
  for (const EnsembleRow& row : rows) {
    Json metrics = Json::object(), samples = Json::array();
    for (const EnsembleMetric& f : ensemble_metrics(row)) metrics[f.info.key] = metric_json(f);
    for (const EnsembleRow::EnsembleSample& draw : row.samples) {
      Json unknowns = Json::object(), values = Json::object();
      for (const auto& [name, value] : draw.values) unknowns[name] = value;
      for (const KeyMetric& h : draw.key_metrics) values[h.info.key] = h.simulated;
      samples.push_back({{"unknowns", std::move(unknowns)}, {"figures", std::move(values)}});
    }
    json["recordings"].push_back({{"name", row.name},
                                  {"part", row.part},
                                  {"unknowns", row.unknowns},
                                  {"figures", std::move(metrics)},
                                  {"draws", std::move(samples)}});
  }
  return json.dump(2) + "\n";
}

}  // namespace canyon::validation
