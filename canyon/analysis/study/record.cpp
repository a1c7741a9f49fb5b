#include "canyon/analysis/study/record.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <set>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"

namespace canyon::study {

namespace {

/// The rows of a table that studies store.
template <typename Row>
std::vector<const Row*> kept_of(std::span<const Row> rows) {
  std::vector<const Row*> list;
  for (const Row& row : rows)
    if (*row.kept != '\0') list.push_back(&row);
  return list;
}
template <typename Row>
std::size_t position_of(std::span<const Row* const> all, std::string_view name) {
  const auto at = std::find_if(all.begin(), all.end(), [&](const Row* row) { return name == row->kept; });
  assert(at != all.end());
  return static_cast<std::size_t>(at - all.begin());
}

/// Counts as [index, count, index, count, ...] of those that are not 0.
template <std::size_t N>
Json sparse(const std::array<std::uint32_t, N>& counts) {
  Json list = Json::array();
  for (std::size_t i = 0; i < N; ++i) {
    if (counts[i] == 0) continue;
    list.push_back(i);
    list.push_back(counts[i]);
  }
  return list;
}

template <std::size_t N>
void dense(const Json& list, std::array<std::uint32_t, N>& counts) {
  for (std::size_t i = 0; i + 1 < list.size(); i += 2)
    counts.at(list[i].get<std::size_t>()) = list[i + 1].get<std::uint32_t>();
}

}  // namespace

std::span<const encoding::SummaryMetric* const> metrics() {
  static const auto kept = kept_of(encoding::summary_metrics());
  return kept;
}

std::size_t metric(std::string_view name) {
  return position_of(metrics(), name);
}

std::span<const encoding::Column* const> stored_columns() {
  static const auto kept = kept_of(encoding::table(encoding::TableKind::Epochs).columns);
  return kept;
}

std::size_t kept_column(std::string_view name) {
  return position_of(stored_columns(), name);
}

std::size_t error_bin(double error_m) {
  const double bin = std::floor(kBinsPerDecade * std::log10(std::max(error_m, kMinError_m) / kMinError_m));
  return std::min(static_cast<std::size_t>(std::max(bin, 0.0)), kErrorBins - 1);
}

double error_edge_m(std::size_t bin) {
  return kMinError_m * std::pow(10.0, static_cast<double>(bin) / kBinsPerDecade);
}

std::string to_line(const RunRecord& record) {
  Json line{{"run", record.number}, {"seed", record.seed}, {"at", record.at}};
  if (!record.problem.empty()) line["problem"] = record.problem;
  if (!record.notes.empty()) line["notes"] = record.notes;
  Json receivers = Json::array();
  for (const ReceiverRecord& receiver : record.receivers) {
    receivers.push_back({{"name", receiver.name},
                         {"figures", receiver.metrics},
                         {"errors", sparse(receiver.errors)},
                         {"epochs", sparse(receiver.epochs)},
                         {"available", sparse(receiver.available)}});
  }
  line["receivers"] = std::move(receivers);
  return line.dump();
}

RunRecord from_line(std::string_view line) {
  try {
    const Json from = Json::parse(line);
    RunRecord record;
    record.number = from.at("run").get<std::size_t>();
    record.seed = from.at("seed").get<std::uint64_t>();
    record.at = from.at("at").get<std::vector<std::string>>();
    if (from.contains("problem")) record.problem = from["problem"].get<std::string>();
    if (from.contains("notes")) record.notes = from["notes"].get<std::vector<std::string>>();
    for (const Json& each : from.at("receivers")) {
      ReceiverRecord receiver;
      receiver.name = each.at("name").get<std::string>();
      for (const Json& value : each.at("figures")) {
        receiver.metrics.push_back(value.is_null() ? std::numeric_limits<double>::quiet_NaN()
                                                   : value.get<double>());
      }
      dense(each.at("errors"), receiver.errors);
      dense(each.at("epochs"), receiver.epochs);
      dense(each.at("available"), receiver.available);
      if (receiver.metrics.size() != metrics().size()) throw InputError("other metrics than this program's");
      record.receivers.push_back(std::move(receiver));
    }
    return record;
  } catch (const JsonError& e) {
    throw InputError(std::string("is not a record of a run: ") + e.what());
  } catch (const std::out_of_range&) {
    throw InputError("is not a record of a run: a count out of range");
  }
}

ReadReport report_of(const std::vector<std::optional<RunRecord>>& records) {
  std::set<std::string> notes;  // sorted, since any process may have computed any run
  for (const auto& record : records)
    if (record) notes.insert(record->notes.begin(), record->notes.end());
  ReadReport report;
  for (const std::string& note : notes) {
    const std::string line = note.substr(note.find(' ') + 1);
    if (note.starts_with("loss"))
      report.add_line(ReadReport::Level::Loss, line);
    else
      report.guess(0, line, "");  // lines that differ only in numbers are joined
  }
  return report;
}

RecordSink::RecordSink(const std::vector<std::string>& receivers, std::optional<double> available_m,
                       bool keep_epochs)
    : summary_(receivers),
      records_(receivers.size()),
      available_m_(available_m),
      keep_(keep_epochs),
      distances_(receivers.size()) {
  for (std::size_t i = 0; i < receivers.size(); ++i) records_[i].name = receivers[i];
}

void RecordSink::write(const simulation::Epoch& epoch) {
  summary_.write(epoch);
  ReceiverRecord& record = records_.at(epoch.receiver);
  const geodesy::GpsTime time = epoch.observed.time;
  if (!first_) first_ = time;
  const auto hour = static_cast<std::size_t>(geodesy::utc_from_gps(epoch.truth.time).hour) % 24;
  const bool solved = epoch.observed.fix.solved();
  const double error_m = solved ? encoding::horizontal_m(epoch.error_enu_m) : 0;
  ++record.epochs[hour];
  if (solved) {
    ++record.errors[error_bin(error_m)];
    if (!available_m_ || error_m <= *available_m_) ++record.available[hour];
  }
  if (!keep_) return;
  const auto columns = stored_columns();
  record.kept.columns.resize(columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k)
    record.kept.columns[k].push_back(static_cast<float>(columns[k]->value(encoding::Row{epoch})));
  record.kept.time_s.push_back(time - *first_);
  DistanceCounter& route = distances_.at(epoch.receiver);
  if (route.last_ecef) route.gone_m += (epoch.truth_ecef - *route.last_ecef).norm();
  route.last_ecef = epoch.truth_ecef;
  record.kept.travelled_m.push_back(static_cast<float>(route.gone_m));
}

std::vector<ReceiverRecord> RecordSink::take() {
  const std::vector<encoding::RunSummary> summaries = summary_.summaries();
  for (std::size_t i = 0; i < records_.size(); ++i)
    for (const auto* metric : metrics()) records_[i].metrics.push_back(metric->value(summaries[i]));
  return std::move(records_);
}

}  // namespace canyon::study
