#include "canyon/analysis/validation/metrics_text.hpp"

// Metrics as JSON, for terminals and for documents.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "canyon/analysis/validation/key_metrics.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::validation {
namespace {

using Row = TextRow;
const std::string kNone = "-";

/// The first cell of a row is its name, "-" means no value.
struct MetricTable {
  std::string title;  ///< empty: part of the previous table
  Row head;
  std::vector<Row> rows = {};
  std::string note = {};  ///< a sentence; empty: none
};

Json quantiles_json(const std::array<double, 5>& values) {
  Json json = Json::object();
  constexpr std::array<const char*, 5> kNames{"p5", "p25", "p50", "p75", "p95"};
  for (std::size_t i = 0; i < values.size(); ++i) json[kNames[i]] = values[i];
  return json;
}

Json json_of(const std::optional<Separation>& s, const char* threshold_name, double sign,
             const std::optional<Interval>& interval) {
  if (!s) return {};
  Json json{{"auc", s->auc}};
  if (interval) json["auc_interval_95"] = {interval->low, interval->high};
  json["balanced_accuracy"] = s->balanced_accuracy;
  json[threshold_name] = sign * s->threshold;
  return json;
}

Json json_of(const DistributionPair& pair) {
  return {{"measured_n", pair.measured.n},
          {"simulated_n", pair.simulated.n},
          {"measured", quantiles_json(pair.measured.at)},
          {"simulated", quantiles_json(pair.simulated.at)},
          {"ks", pair.ks}};
}

Json json_of(const TrackedFraction& weights) {
  return {{"satellites", weights.satellites},
          {"measured", weights.measured},
          {"simulated", weights.simulated},
          {"measured_ratio", weights.ratio(Side::Measured)},
          {"simulated_ratio", weights.ratio(Side::Simulated)}};
}

Json json_of(const Explained& e) {
  Json json{{"kind", e.kind}, {"n", e.n}, {"share", e.fraction}};
  json["median_difference_m"] = e.median_difference_m;
  if (e.correlation) {
    json["spearman"] = {{"rho", e.correlation->rho},
                        {"low_95", e.correlation->low},
                        {"high_95", e.correlation->high},
                        {"n", e.correlation->n}};
  } else {
    json["spearman"] = nullptr;
  }
  return json;
}

Json json_of(const PositionMetrics& p) {
  const auto within = [&p](const std::array<double, 2>& fractions) {
    return p.reported > 0 ? Json::array({fractions[0], fractions[1]}) : Json();
  };
  return {{"epochs", p.epochs},
          {"fixes", p.fixes},
          {"availability",
           p.epochs > 0 ? Json(static_cast<double>(p.fixes) / static_cast<double>(p.epochs)) : Json()},
          {"mean_satellites_used", p.mean_used},
          {"horizontal_error_m", quantiles_json(p.horizontal_m)},
          {"vertical_error_m", quantiles_json(p.vertical_m)},
          {"horizontal_within_stated", within(p.horizontal_within)},
          {"vertical_within_stated", within(p.vertical_within)}};
}

Json json_of(const PhaseMetrics& p) {
  const auto view = [](const PhaseView& v) {
    return Json{{"observations", v.observations},
                {"with_phase", v.with_phase},
                {"share", v.fraction()},
                {"noise_n", v.noise_n},
                {"noise_m", v.noise_m}};
  };
  return {{"los", view(p.los)},
          {"nlos", view(p.nlos)},
          {"time_s", p.time_s},
          {"slips", p.slips},
          {"time_between_slips_s", p.time_between_slips_s()}};
}

template <typename T>
Json json_of(const MeasuredAndSimulated<T>& sides) {
  return {{"measured", json_of(sides.measured)}, {"simulated", json_of(sides.simulated)}};
}

Json tracked_json(const ObservationMetrics& f) {
  return {{"los", json_of(f.tracked_los)}, {"nlos", json_of(f.tracked_nlos)}};
}

Json distributions_json(const ObservationMetrics& f) {
  return {{"los_error_m", json_of(f.error_los_m)},
          {"nlos_error_m", json_of(f.error_nlos_m)},
          {"los_cn0_dbhz", json_of(f.cn0_los_dbhz)},
          {"nlos_cn0_dbhz", json_of(f.cn0_nlos_dbhz)}};
}

Json json_of(const SignalMetrics& f) {
  Json json{{"system", std::string(gnss::name(f.signal->system))},
            {"signal", std::string(f.signal->name)},
            {"recorded", f.recorded},
            {"tracked_by_the_simulated", f.tracked}};
  if (!f.judged()) return json;
  json["tracked"] = tracked_json(f);
  json["distributions"] = distributions_json(f);
  json["carrier_phase"] = json_of(f.phase);
  return json;
}

Json json_of(const ModelMetrics& f) {
  Json json{{"model", f.model}, {"part", f.part}, {"epochs", f.epochs},
            {"runs", f.runs},   {"los", f.los},   {"nlos", f.nlos}};
  json["separation_by_cn0"] = json_of(f.by_cn0, "threshold_dbhz", -1, f.by_cn0_interval);
  json["separation_by_error"] = json_of(f.by_error, "threshold_m", 1, f.by_error_interval);
  json["elevation_bands"] = Json::array();
  for (const Band& band : f.bands) {
    json["elevation_bands"].push_back({{"low_deg", band.low_deg},
                                       {"high_deg", band.high_deg},
                                       {"los", band.los},
                                       {"nlos", band.nlos},
                                       {"by_cn0", json_of(band.by_cn0, "threshold_dbhz", -1, {})},
                                       {"by_error", json_of(band.by_error, "threshold_m", 1, {})}});
  }
  json["tracked"] = tracked_json(f);
  json["explained"] = Json::array();
  for (const Explained& e : f.explained) json["explained"].push_back(json_of(e));
  json["distributions"] = distributions_json(f);
  json["distributions"]["satellites_used"] = json_of(f.used);
  json["position"] = json_of(f.position);
  if (f.filtered.measured.epochs > 0) json["filtered_position"] = json_of(f.filtered);
  if (f.reported_fixes) json["own_fixes"] = json_of(*f.reported_fixes);
  json["never_tracked"] = Json::array();
  for (const NeverTracked& s : f.never_tracked) {
    json["never_tracked"].push_back(
        {{"satellite", gnss::to_string(s.id)}, {"clear_s", s.clear_s}, {"left_out", f.left_out}});
  }
  json["signals"] = Json::array();
  for (const SignalMetrics& s : f.signals) json["signals"].push_back(json_of(s));
  json["segments"] = Json::array();
  for (const SegmentMetrics& s : f.segments) {
    json["segments"].push_back({{"first_epoch", s.segment.first},
                                {"epochs", s.segment.count},
                                {"length_m", s.segment.length_m},
                                {"heading_deg", s.segment.heading_deg},
                                {"measured", json_of(s.position.measured)},
                                {"simulated", json_of(s.position.simulated)}});
  }
  return json;
}

std::string shown(const std::optional<double>& value, int decimals) {
  const std::string text = value ? encoding::fixed(*value, decimals) : "";
  return text.empty() ? kNone : text;
}
std::string percentage_of(std::size_t part, std::size_t all) {
  return shown(
      all > 0 ? std::optional(100.0 * static_cast<double>(part) / static_cast<double>(all)) : std::nullopt,
      1);
}
std::string from_to(double low, double high, int decimals) {
  return fmt::format("{} to {}", shown(low, decimals), shown(high, decimals));
}
/// Suffix of the name of a quantity.
const char* word(Side side) {
  return side == Side::Measured ? ", measured" : ", simulated";
}
std::vector<MetricTable> separation_tables(const ModelMetrics& f) {
  const auto row = [](const char* name, const std::optional<Separation>& s, const std::optional<Interval>& i,
                      const char* unit) {
    if (!s) return Row{name, kNone, kNone, kNone, kNone};
    const std::string threshold = shown(std::abs(s->threshold), 1);
    return Row{name, shown(s->auc, 3), i ? from_to(i->low, i->high, 3) : kNone,
               shown(s->balanced_accuracy, 3), threshold == kNone ? kNone : threshold + " " + unit};
  };
  MetricTable bands{"", {"Elevation", "LOS", "NLOS", "AUC by C/N0", "AUC by error"}};
  for (const Band& b : f.bands) {
    bands.rows.push_back({fmt::format("{:.0f} to {:.0f} deg", b.low_deg, b.high_deg), fmt::to_string(b.los),
                          fmt::to_string(b.nlos), shown(auc_of(b.by_cn0), 3), shown(auc_of(b.by_error), 3)});
  }
  return {{"LOS and NLOS separated",
           {"By", "AUC", "95 % interval", "Balanced accuracy", "at a threshold of"},
           {row("C/N0 (NLOS is weaker)", f.by_cn0, f.by_cn0_interval, "dB-Hz"),
            row("Pseudorange error (NLOS is later)", f.by_error, f.by_error_interval, "m")}},
          bands};
}

MetricTable tracked_table(const char* title, const ObservationMetrics& f) {
  const auto row = [](const char* name, const TrackedFraction& t) {
    return Row{name, fmt::to_string(t.satellites), percentage_of(t.measured, t.satellites),
               percentage_of(t.simulated, t.satellites)};
  };
  return {title,
          {"In the city", "Satellites", "Recorded [%]", "Simulated [%]"},
          {row("LOS", f.tracked_los), row("NLOS", f.tracked_nlos)}};
}

MetricTable explained_table(const ModelMetrics& f) {
  MetricTable table{"NLOS observations that a modelled path explains",
                    {"Path", "n", "Fraction [%]", "Median |difference| [m]", "Spearman", "95 % interval"}};
  for (const Explained& e : f.explained) {
    table.rows.push_back({e.kind, fmt::to_string(e.n), shown(100 * e.fraction, 1),
                          shown(e.median_difference_m, 1),
                          e.correlation ? shown(e.correlation->rho, 2) : kNone,
                          e.correlation ? from_to(e.correlation->low, e.correlation->high, 2) : kNone});
  }
  return table;
}

void add_distribution(MetricTable& table, const std::string& name, const DistributionPair& pair) {
  for (const Side side : kSides) {
    const QuantileSummary& d = pair.of(side);
    Row& cells = table.rows.emplace_back(Row{name + word(side), fmt::to_string(d.n)});
    for (const double value : d.at) cells.push_back(shown(value, 1));
    cells.push_back(side == Side::Simulated ? shown(pair.ks, 3) : "");
  }
}

MetricTable distributions_table(const std::string& title, const ObservationMetrics& f) {
  MetricTable table{title, {"Quantity", "n", "p5", "p25", "p50", "p75", "p95", "KS"}};
  add_distribution(table, "LOS pseudorange error [m]", f.error_los_m);
  add_distribution(table, "NLOS pseudorange error [m]", f.error_nlos_m);
  add_distribution(table, "LOS C/N0 [dB-Hz]", f.cn0_los_dbhz);
  add_distribution(table, "NLOS C/N0 [dB-Hz]", f.cn0_nlos_dbhz);
  return table;
}

/// Signals beyond the first, which the other metrics describe; then those of one side only.
void add_further_signals(const ModelMetrics& f, std::vector<MetricTable>& tables) {
  MetricTable one_sided{"Signals not compared", {"Signal", "Recorded", "Tracked by the simulated"}};
  for (const SignalMetrics& s : f.signals) {
    if (!s.judged()) {
      one_sided.rows.push_back({s.name(), s.recorded ? "yes" : "no", s.tracked ? "yes" : "no"});
    } else if (!s.first()) {
      tables.push_back(distributions_table(s.name(), s));
      tables.push_back(tracked_table("", s));
    }
  }
  tables.push_back(one_sided);
}

MetricTable phase_table(const ModelMetrics& f) {
  MetricTable table{"Carrier phase",
                    {"Signal", "LOS with phase [%]", "NLOS with phase [%]", "Between cycle slips [s]",
                     "Cycle slips", "LOS noise [mm]", "NLOS noise [mm]"}};
  for (const SignalMetrics& s : f.signals) {
    for (const Side side : kSides) {
      const PhaseMetrics& p = s.phase.of(side);
      if (!s.judged() || p.los.with_phase + p.nlos.with_phase == 0) continue;
      const auto mm = [](const PhaseView& v) { return v.noise_m ? shown(1e3 * *v.noise_m, 1) : kNone; };
      table.rows.push_back({s.name() + word(side), percentage_of(p.los.with_phase, p.los.observations),
                            percentage_of(p.nlos.with_phase, p.nlos.observations),
                            shown(p.time_between_slips_s(), 1), fmt::to_string(p.slips), mm(p.los),
                            mm(p.nlos)});
    }
  }
  return table;
}

Row quantiles_row(const std::string& name, const std::array<double, 5>& q) {
  Row row{name};
  for (const double value : q) row.push_back(shown(value, 1));
  return row;
}
std::vector<Row> error_rows(const MeasuredAndSimulated<PositionMetrics>& position) {
  std::vector<Row> rows;
  for (const auto& [name, errors] :
       {std::pair("Horizontal", &PositionMetrics::horizontal_m), {"Vertical", &PositionMetrics::vertical_m}})
    for (const Side side : kSides)
      rows.push_back(quantiles_row(std::string(name) + word(side), position.of(side).*errors));
  return rows;
}

std::vector<MetricTable> position_tables(const ModelMetrics& f) {
  const Row head{"Error [m]", "p5", "p25", "p50", "p75", "p95"};
  const auto availability = [](const char* name, const PositionMetrics& p) {
    return Row{name, fmt::to_string(p.epochs), fmt::to_string(p.fixes), percentage_of(p.fixes, p.epochs),
               shown(p.mean_used, 1)};
  };
  const auto ratio = [&f](std::string_view key) {
    const MetricInfo& info = *metric_info(key);
    return shown(info.range.compared(info.value(f, Side::Measured), info.value(f, Side::Simulated)), 2);
  };
  std::vector<MetricTable> tables{
      {"Position, by the same solver on both", head, error_rows(f.position),
       fmt::format("Horizontal, simulated over measured: p50 {}, p95 {}.", ratio("horizontal_p50_m"),
                   ratio("horizontal_p95_m"))},
      {"",
       {"Fixes", "Epochs", "With a fix", "[%]", "Mean satellites used"},
       {availability("Measured", f.position.measured), availability("Simulated", f.position.simulated)}}};
  MetricTable filtered{"Position, by the same filter on both", head};
  if (f.filtered.measured.epochs > 0) filtered.rows = error_rows(f.filtered);
  if (f.reported_fixes)
    filtered.rows.push_back(quantiles_row("Horizontal, receiver's own", f.reported_fixes->horizontal_m));
  if (!filtered.rows.empty()) tables.push_back(std::move(filtered));
  MetricTable reported{
      "Errors relative to the reported accuracy",
      {"Fraction of fixes [%]", "Horizontal within 1", "within 2", "Vertical within 1", "within 2"},
      {},
      "Deviations: horizontal the root of the east and north variances' sum, vertical that of up. Normal "
      "errors: 63 to 68, 95 to 98, 68, 95 %."};
  for (const auto& [name, position] : {std::pair("Single epochs", &f.position), {"Filter", &f.filtered}}) {
    for (const Side side : kSides) {
      const PositionMetrics& p = position->of(side);
      if (p.reported == 0) continue;
      reported.rows.push_back({std::string(name) + word(side), shown(100 * p.horizontal_within[0], 0),
                               shown(100 * p.horizontal_within[1], 0), shown(100 * p.vertical_within[0], 0),
                               shown(100 * p.vertical_within[1], 0)});
    }
  }
  if (!reported.rows.empty()) tables.push_back(std::move(reported));
  return tables;
}

MetricTable segments_table(const ModelMetrics& f) {
  MetricTable table{"By street",
                    {"Street", "Heading [deg]", "Length [m]", "Epochs", "Fixes [%]", "p50 [m]", "p95 [m]",
                     "Satellites used"},
                    {},
                    f.segments.empty() ? "No segment of one street has enough epochs."
                                       : "Pairs are measured / simulated; errors are horizontal."};
  for (const SegmentMetrics& s : f.segments) {
    const auto both = [&s](const auto& of) {
      return of(s.position.measured) + " / " + of(s.position.simulated);
    };
    const auto quantile_of = [&both](std::size_t q) {
      return both([q](const PositionMetrics& p) { return shown(p.horizontal_m[q], 1); });
    };
    table.rows.push_back({fmt::to_string(s.street), shown(s.segment.heading_deg, 0),
                          shown(s.segment.length_m, 0), fmt::to_string(s.position.measured.epochs),
                          both([](const PositionMetrics& p) { return percentage_of(p.fixes, p.epochs); }),
                          quantile_of(2), quantile_of(4),
                          both([](const PositionMetrics& p) { return shown(p.mean_used, 1); })});
  }
  return table;
}

/// A table for terminals: the first column to the left, the others to the right.
std::string text_of(const MetricTable& table) {
  std::string text;
  if (!table.title.empty()) text += "\n" + table.title + "\n";
  if (!table.rows.empty()) text += text_table(table.head, table.rows, {1, "  "});
  return table.note.empty() ? text : text + fmt::format("  {}\n", table.note);
}

}  // namespace

std::optional<double> auc_of(const std::optional<Separation>& s) {
  return s ? std::optional(s->auc) : std::nullopt;
}

std::string to_json(const std::vector<ModelMetrics>& models,
                    const std::optional<std::string>& alignment_json) {
  Json json = Json::object();
  if (alignment_json) json["alignment"] = Json::parse(*alignment_json);
  json["models"] = Json::array();
  for (const ModelMetrics& f : models) json["models"].push_back(json_of(f));
  return json.dump(2) + "\n";
}

std::string never_tracked_text(const ModelMetrics& f) {
  std::string text;
  for (const NeverTracked& s : f.never_tracked)
    text += fmt::format("{} {} ({:.0f} s)", text.empty() ? "" : ",", gnss::to_string(s.id), s.clear_s);
  if (text.empty()) return text;
  return fmt::format("never tracked above 15 deg in clear view{}:{}", f.left_out ? ", left out" : "", text);
}

std::string to_text(const ModelMetrics& f) {
  std::vector<MetricTable> tables = separation_tables(f);
  tables.push_back(tracked_table("Tracked satellites above the mask", f));
  if (!f.never_tracked.empty()) tables.back().note = "Satellites " + never_tracked_text(f) + ".";
  tables.push_back(explained_table(f));
  tables.push_back(distributions_table("Distributions", f));
  add_distribution(tables.back(), "Satellites used", f.used);
  add_further_signals(f, tables);
  tables.push_back(phase_table(f));
  for (MetricTable& table : position_tables(f)) tables.push_back(std::move(table));
  tables.push_back(segments_table(f));
  std::string text = fmt::format("{}\n{}\n\nLOS and NLOS by the city: {} observations, {} % NLOS\n", f.model,
                                 f.part, f.los + f.nlos, percentage_of(f.nlos, f.los + f.nlos));
  for (const MetricTable& table : tables)
    if (!table.rows.empty() || !table.note.empty()) text += text_of(table);
  return text;
}

std::string models_table(const std::vector<ModelMetrics>& models) {
  struct Column {
    std::string_view key, also = {}, title_of_both = {};
  };
  static constexpr std::array kColumns{Column{"auc_cn0"},
                                       Column{"auc_error"},
                                       Column{"nlos_explained"},
                                       Column{"median_difference_m"},
                                       Column{"spearman"},
                                       Column{"ks_error_los", "ks_error_nlos", "KS error LOS, NLOS"},
                                       Column{"ks_cn0_los", "ks_cn0_nlos", "KS C/N0 LOS, NLOS"},
                                       Column{"tracked_los"},
                                       Column{"tracked_nlos"},
                                       Column{"satellites_used"},
                                       Column{"horizontal_p50_m"},
                                       Column{"horizontal_p95_m"}};
  const auto cell = [](std::string_view key, const ModelMetrics& f) {
    return value_text(headline(*metric_info(key), f));
  };
  TextRow head{"model"};
  std::vector<TextRow> rows;
  for (const ModelMetrics& f : models) rows.push_back({f.model});
  for (const Column& column : kColumns) {
    const bool both = !column.also.empty();
    head.emplace_back(both ? column.title_of_both : metric_info(column.key)->title);
    for (std::size_t i = 0; i < models.size(); ++i)
      rows[i].push_back(cell(column.key, models[i]) + (both ? ", " + cell(column.also, models[i]) : ""));
  }
  return text_table(head, rows) + "\nSimulated, with measured in brackets, if both are given.\n";
}

}  // namespace canyon::validation
