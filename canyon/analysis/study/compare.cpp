#include "canyon/analysis/study/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "canyon/analysis/study/axis.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"

namespace canyon::study {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// Total samples of occasions: larger studies get fewer resamples, at least kMinResamples.
constexpr double kMaxSamples = 2e7;
constexpr std::uint32_t kMinResamples = 100;

std::optional<double> available_fraction(const ReceiverRecord& record) {
  const double epochs = std::accumulate(record.epochs.begin(), record.epochs.end(), 0.0);
  if (epochs == 0) return std::nullopt;
  return std::accumulate(record.available.begin(), record.available.end(), 0.0) / epochs;
}

/// Mean over the values of the sampled occasions; NaN if there are none.
double mean_of(const std::vector<double>& values, const std::vector<std::uint32_t>& sampled) {
  double sum = 0;
  std::size_t count = 0;
  for (const std::uint32_t i : sampled) {
    if (std::isnan(values[i])) continue;
    sum += values[i];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : kNan;
}

std::optional<MeanEstimate> estimate(const std::vector<double>& values, const Resamples& resamples,
                                     double confidence) {
  std::vector<std::uint32_t> all(values.size());
  std::iota(all.begin(), all.end(), 0U);
  MeanEstimate e{mean_of(values, all), kNan, kNan};
  if (std::isnan(e.mean)) return std::nullopt;
  std::vector<double> means;
  for (const auto& sampled : resamples) {
    const double mean = mean_of(values, sampled);
    if (!std::isnan(mean)) means.push_back(mean);
  }
  const auto known = std::count_if(values.begin(), values.end(), [](double v) { return !std::isnan(v); });
  if (known > 1 && !means.empty()) {
    e.low = *quantile(means, (1 - confidence) / 2);
    e.high = *quantile(means, (1 + confidence) / 2);
  }
  return e;
}

std::string number(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "-";
}

std::vector<double> values_of(const Group& group, const Compared& compared) {
  std::vector<double> values;
  for (const ReceiverRecord* record : group.records) {
    const auto value = record != nullptr ? compared.of(*record) : std::nullopt;
    if (value) values.push_back(*value * compared.scale);
  }
  return values;
}

/// Median and intervals of the runs of each group: the expected result of one run.
std::string spread_text(const GroupComparison& comparison, std::size_t shown) {
  TextRow head = comparison.axes;
  head.emplace_back("receiver");
  const std::size_t words = head.size();
  std::size_t minimum = kMinCountFor90;
  head.insert(head.end(), {"error, median [m]", "50 %", "90 %", "error, 95 % [m]", "50 %", "90 %"});
  std::vector<TextRow> rows;
  for (std::size_t i = 0; i < shown; ++i) {
    const Group& group = comparison.groups[i];
    TextRow& row = rows.emplace_back(group.at);
    row.push_back(group.receiver);
    for (const std::size_t k : {std::size_t{1}, std::size_t{2}}) {
      const std::vector<double> values = values_of(group, compared_metrics()[k]);
      const auto at = [&values](double p) {
        return number(values.size() > 1 ? predictive_quantile(values, p) : kNan, 2);
      };
      if (values.size() > 1) minimum = std::min(minimum, values.size());
      row.insert(row.end(), {at(0.5), at(0.25) + ".." + at(0.75), at(0.05) + ".." + at(0.95)});
    }
  }
  const std::optional<std::string> caution = caution_of_few(minimum, "runs");
  return text_table(head, rows, {words, "", true}) +
         "medians of runs, and the intervals that contain half and 90 % of them\n" +
         (caution ? fmt::format("{}; {} runs are needed\n", *caution, kMinCountFor90) : "");
}

}  // namespace

Resamples occasion_resamples(const Manifest& manifest, std::size_t occasions) {
  const auto count = static_cast<std::uint32_t>(
      std::clamp(kMaxSamples / static_cast<double>(occasions), static_cast<double>(kMinResamples),
                 static_cast<double>(std::max(kMinResamples, manifest.bootstrap))));
  RandomStream random(manifest.seed, "study bootstrap");
  Resamples resamples(occasions > 1 ? count : 0);
  for (auto& sampled : resamples) {
    sampled.resize(occasions);
    for (std::uint32_t& i : sampled)
      i = static_cast<std::uint32_t>(random.uniform() * static_cast<double>(occasions));
  }
  return resamples;
}

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string csv_interval(const std::optional<MeanEstimate>& e) {
  const auto one = [](double v) { return std::isfinite(v) ? fmt::format("{:.6g}", v) : std::string(); };
  return e ? fmt::format("{},{},{}", one(e->mean), one(e->low), one(e->high)) : std::string(",,");
}

std::optional<double> Compared::of(const ReceiverRecord& record) const {
  if (!index) return available_fraction(record);
  const double value = record.metrics.at(*index);
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

const std::vector<Compared>& compared_metrics() {
  static const std::vector<Compared> compared = [] {
    std::vector<Compared> list{{"available", "%", 100, {}}};
    for (const char* name :
         {"horizontal_error_p50", "horizontal_error_p95", "vertical_error_p95", "satellites_used"}) {
      const std::size_t index = metric(name);
      list.push_back({name, encoding::cf_unit(metrics()[index]->unit), 1, index});
    }
    return list;
  }();
  return compared;
}

GroupComparison compare(const Manifest& manifest, const std::vector<std::optional<RunRecord>>& records) {
  GroupComparison result;
  for (const Manifest::Coordinate& axis : manifest.axes)
    if (axis.groups) result.axes.push_back(axis.name);
  // Groups and occasions in the order of their first runs; receivers vary fastest.
  std::map<std::string, std::size_t> occasions;
  std::map<std::pair<std::string, std::size_t>, std::size_t> groups;
  for (const auto& record : records) {
    if (!record) continue;
    std::string occasion, setting;
    std::vector<std::string> labels;
    for (std::size_t i = 0; i < manifest.axes.size(); ++i) {
      const Manifest::Coordinate& axis = manifest.axes[i];
      (axis.groups ? setting : occasion) += record->at[i] + '\n';
      if (axis.groups) labels.push_back(axis.label(record->at[i]));
    }
    const std::size_t index = occasions.emplace(occasion, occasions.size()).first->second;
    for (const ReceiverRecord& receiver : record->receivers) {
      const auto name = static_cast<std::size_t>(
          std::find(manifest.receivers.begin(), manifest.receivers.end(), receiver.name) -
          manifest.receivers.begin());
      const auto [at, is_new] = groups.emplace(std::pair{setting, name}, result.groups.size());
      if (is_new) result.groups.push_back({labels, receiver.name, 0, {}, {}, {}});
      Group& group = result.groups[at->second];
      if (group.records.size() <= index) group.records.resize(index + 1, nullptr);
      group.records[index] = &receiver;
      ++group.runs;
    }
  }
  const std::size_t n = occasions.size();
  if (n == 0) return result;
  const Resamples resamples = occasion_resamples(manifest, n);
  for (const Compared& compared : compared_metrics()) {
    std::vector<double> first;
    for (Group& group : result.groups) {
      group.records.resize(n, nullptr);
      std::vector<double> values(n, kNan), differences(n, kNan);
      for (std::size_t i = 0; i < n; ++i) {
        if (group.records[i] == nullptr) continue;
        values[i] = compared.of(*group.records[i]).value_or(kNan) * compared.scale;
      }
      if (first.empty()) first = values;
      for (std::size_t i = 0; i < n; ++i) differences[i] = values[i] - first[i];
      group.estimates.push_back(estimate(values, resamples, manifest.confidence));
      group.differences.push_back(&group == &result.groups.front()
                                      ? std::nullopt
                                      : estimate(differences, resamples, manifest.confidence));
    }
  }
  return result;
}

std::string comparison_csv(const GroupComparison& comparison) {
  std::string text;
  for (const std::string& axis : comparison.axes) text += csv_text(axis) + ",";
  text += "receiver,runs,figure,unit,mean,low,high,difference,difference_low,difference_high\n";
  for (const Group& group : comparison.groups) {
    for (std::size_t k = 0; k < group.estimates.size(); ++k) {
      for (const std::string& value : group.at) text += csv_text(value) + ",";
      const Compared& metric = compared_metrics()[k];
      text += fmt::format("{},{},{},{},{},{}\n", csv_text(group.receiver), group.runs, metric.name,
                          metric.unit, csv_interval(group.estimates[k]), csv_interval(group.differences[k]));
    }
  }
  return text;
}

std::string comparison_text(const Manifest& manifest, const GroupComparison& comparison) {
  constexpr std::size_t kMaxShown = 40;
  TextRow head = comparison.axes;
  head.insert(head.end(), {"receiver", "runs"});
  const std::size_t words = head.size();
  head.insert(head.end(), {manifest.available_m ? fmt::format("within {:g} m [%]", *manifest.available_m)
                                                : "with fix [%]",
                           "error, median [m]", "error, 95 % [m]", "95 %, to the first [m]"});
  std::vector<TextRow> rows;
  const auto interval = [](const std::optional<MeanEstimate>& e, int decimals) {
    if (!e) return std::string("-");
    if (!std::isfinite(e->low)) return number(e->mean, decimals);
    return fmt::format("{} ({}..{})", number(e->mean, decimals), number(e->low, decimals),
                       number(e->high, decimals));
  };
  const std::size_t shown = std::min(kMaxShown, comparison.groups.size());
  for (std::size_t i = 0; i < shown; ++i) {
    const Group& group = comparison.groups[i];
    TextRow& row = rows.emplace_back(group.at);
    row.insert(row.end(), {group.receiver, fmt::format("{}", group.runs), interval(group.estimates[0], 1),
                           interval(group.estimates[1], 2), interval(group.estimates[2], 2),
                           interval(group.differences[2], 2)});
  }
  std::string text = text_table(head, rows, {words, "", true});
  if (shown < comparison.groups.size())
    text += fmt::format("(and {} more groups, in table.csv)\n", comparison.groups.size() - shown);
  text += fmt::format(
      "means over runs; in brackets {:.0f} % intervals (bootstrap over {})\n", manifest.confidence * 100,
      manifest.realizations.empty() ? "runs" : fmt::format("{}", fmt::join(manifest.realizations, ", ")));
  const bool unknowns = std::any_of(manifest.axes.begin(), manifest.axes.end(),
                                    [](const auto& axis) { return axis.key == Axis::kUnknowns; });
  return unknowns ? text + "\n" + spread_text(comparison, shown) : text;
}

}  // namespace canyon::study
