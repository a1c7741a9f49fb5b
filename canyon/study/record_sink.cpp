#include "canyon/study/record_sink.hpp"

#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/epoch_values.hpp"

namespace canyon::study {

RecordSink::RecordSink(const std::vector<std::string>& receivers, std::optional<double> available_m,
                       bool keep_epochs)
    : summary_(receivers),
      records_(receivers.size()),
      available_m_(available_m),
      keep_(keep_epochs),
      ways_(receivers.size()) {
  for (std::size_t i = 0; i < receivers.size(); ++i) records_[i].name = receivers[i];
}

void RecordSink::write(const simulation::Epoch& epoch) {
  summary_.write(epoch);
  ReceiverRecord& record = records_.at(epoch.receiver);
  const geodesy::GpsTime time = epoch.observed.time;
  if (!first_) first_ = time;
  const auto hour = static_cast<std::size_t>(geodesy::utc_from_gps(epoch.truth.time).hour) % 24;
  const bool solved = epoch.observed.fix.solved();
  const double error_m = solved ? output::horizontal_m(epoch.error_enu_m) : 0;
  ++record.epochs[hour];
  if (solved) {
    ++record.errors[error_bin(error_m)];
    if (!available_m_ || error_m <= *available_m_) ++record.available[hour];
  }
  if (!keep_) return;
  const auto columns = kept_columns();
  record.kept.columns.resize(columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) {
    record.kept.columns[k].push_back(static_cast<float>(columns[k]->value(output::Row{epoch})));
  }
  record.kept.time_s.push_back(time - *first_);
  Way& way = ways_.at(epoch.receiver);
  if (way.last_ecef) way.gone_m += (epoch.truth_ecef - *way.last_ecef).norm();
  way.last_ecef = epoch.truth_ecef;
  record.kept.way_m.push_back(static_cast<float>(way.gone_m));
}

std::vector<ReceiverRecord> RecordSink::take() {
  const std::vector<output::RunSummary> summaries = summary_.summaries();
  for (std::size_t i = 0; i < records_.size(); ++i) {
    for (const auto* figure : figures()) records_[i].figures.push_back(figure->value(summaries[i]));
  }
  return std::move(records_);
}

}  // namespace canyon::study
