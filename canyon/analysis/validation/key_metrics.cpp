#include "canyon/analysis/validation/key_metrics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/analysis/validation/metrics_text.hpp"

namespace canyon::validation {
namespace {

using Number = std::optional<double>;
using Kind = MetricInfo::Kind;
using Of = MetricRange::Of;

constexpr std::size_t kMedian = 2, kP95 = 4;
static_assert(kQuantiles[kMedian] == 0.5 && kQuantiles[kP95] == 0.95);

Number known(double value) {
  return std::isnan(value) ? std::nullopt : Number(value);
}
template <std::size_t kQuantile>
Number horizontal(const ModelMetrics& f, Side side) {
  return known(f.position.of(side).horizontal_m.at(kQuantile));
}
template <std::size_t kQuantile>
Number reported_horizontal(const ModelMetrics& f, Side side) {
  return known(
      (side == Side::Measured ? *f.reported_fixes : f.filtered.simulated).horizontal_m.at(kQuantile));
}
Number satellites_used(const ModelMetrics& f, Side side) {
  return known(f.position.of(side).mean_used);
}

template <auto kFraction>
Number tracked(const ModelMetrics& f, Side side) {
  return (f.*kFraction).ratio(side);
}
template <auto kQuantity>
Number middle(const ModelMetrics& f, Side side) {
  return known((f.*kQuantity).of(side).at[kMedian]);
}
template <auto kQuantity>
Number distance(const ModelMetrics& f, Side /*both*/) {
  return (f.*kQuantity).ks;
}
template <auto kSeparation>
Number auc(const ModelMetrics& f, Side /*both*/) {
  return auc_of(f.*kSeparation);
}
Number los_less_nlos(const ModelMetrics& f, Side side) {
  const Number los = middle<&ModelMetrics::cn0_los_dbhz>(f, side),
               nlos = middle<&ModelMetrics::cn0_nlos_dbhz>(f, side);
  return los && nlos ? Number(*los - *nlos) : std::nullopt;
}

Number explained_fraction(const ModelMetrics& f, Side /*both*/) {
  return f.nlos > 0 && !f.explained.empty() ? Number(100 * f.explained.back().fraction) : std::nullopt;
}
Number tracked_over_time(const ModelMetrics& f, Side /*both*/) {
  return f.tracked_over_time ? Number(f.tracked_over_time->rho) : std::nullopt;
}
Number spearman_of(const ModelMetrics& f, Side /*both*/) {
  if (f.explained.empty() || !f.explained.back().correlation) return std::nullopt;
  return f.explained.back().correlation->rho;
}
Number median_difference(const ModelMetrics& f, Side /*both*/) {
  return f.explained.empty() ? std::nullopt : f.explained.back().median_difference_m;
}

constexpr MetricRange kDistance{Of::Value, 0, 0.2};
constexpr MetricRange kTenth{Of::Difference, 0, 0.1};
constexpr MetricRange kRatio{Of::Ratio, 0.7, 1.4};

constexpr Kind kModel = Kind::OfModel, kBoth = Kind::Both, kPair = Kind::Pair,
               kReported = Kind::ReportedFixes;
constexpr MetricInfo kMetrics[]{
    {"auc_cn0", "AUC C/N0", 3, kModel, auc<&ModelMetrics::by_cn0>},
    {"auc_error", "AUC error", 3, kModel, auc<&ModelMetrics::by_error>},
    {"nlos_explained", "NLOS explained [%]", 1, kModel, explained_fraction},
    {"horizontal_p50_m", "horizontal p50 [m]", 1, kPair, horizontal<kMedian>, kRatio},
    {"horizontal_p95_m", "p95 [m]", 1, kPair, horizontal<kP95>, kRatio},
    {"tracked_los", "tracked LOS", 2, kPair, tracked<&ModelMetrics::tracked_los>, kTenth},
    {"tracked_nlos", "tracked NLOS", 2, kPair, tracked<&ModelMetrics::tracked_nlos>, kTenth},
    {"cn0_los_dbhz", "C/N0 LOS [dB-Hz]", 1, kPair, middle<&ModelMetrics::cn0_los_dbhz>},
    {"cn0_nlos_dbhz", "C/N0 NLOS [dB-Hz]", 1, kPair, middle<&ModelMetrics::cn0_nlos_dbhz>},
    {"cn0_los_less_nlos_db", "LOS less NLOS [dB]", 1, kPair, los_less_nlos, {Of::Difference, 0, 2}},
    {"ks_cn0_los", "KS C/N0 LOS", 2, kBoth, distance<&ModelMetrics::cn0_los_dbhz>, kDistance},
    {"ks_cn0_nlos", "KS C/N0 NLOS", 2, kBoth, distance<&ModelMetrics::cn0_nlos_dbhz>, kDistance},
    {"ks_error_los", "KS error LOS", 2, kBoth, distance<&ModelMetrics::error_los_m>, kDistance},
    {"ks_error_nlos", "KS error NLOS", 2, kBoth, distance<&ModelMetrics::error_nlos_m>, kDistance},
    {"satellites_used", "satellites used", 1, kPair, satellites_used, {Of::Difference, 0, 1}},
    {"tracked_over_time", "tracked over time", 2, kBoth, tracked_over_time, {Of::Value, 1, 0.5}},
    {"spearman", "Spearman", 2, kBoth, spearman_of, {Of::Value, 1, 0.6}},
    {"median_difference_m", "median difference [m]", 1, kBoth, median_difference, {Of::Value, 0, 10}},
    {"own_fix_p50_m", "filter p50 (own fixes) [m]", 1, kReported, reported_horizontal<kMedian>},
    {"own_fix_p95_m", "filter p95 (own fixes) [m]", 1, kReported, reported_horizontal<kP95>}};

/// Both numbers of a key metric, each formatted by `show`.
template <typename Value, typename Show>
std::string pair_text(const KeyMetric& h, const Value& measured, const Value& simulated, const Show& show) {
  const auto shown = [&show](const Value& value) { return value ? show(*value) : std::string("-"); };
  if (!h.pair() || (!measured && !simulated)) return shown(simulated);
  return fmt::format("{} ({})", shown(simulated), shown(measured));
}

}  // namespace

std::optional<double> MetricRange::compared(const Number& measured, const Number& simulated) const {
  if (of == Of::Nothing || !simulated) return std::nullopt;
  if (of == Of::Value) return simulated;
  if (!measured || (of == Of::Ratio && !(*measured > 0))) return std::nullopt;
  return of == Of::Difference ? *simulated - *measured : *simulated / *measured;
}

double MetricRange::distance(double compared) const {
  if (of != Of::Ratio) return (compared - low) / (end - low);
  return std::log(compared) / (compared < 1 ? -std::log(low) : std::log(end));
}

std::optional<double> KeyMetric::distance() const {
  const Number compared = info.range.compared(measured, simulated);
  return compared ? Number(info.range.distance(*compared)) : std::nullopt;
}

std::optional<bool> KeyMetric::within() const {
  constexpr double kRounding = 1e-9;
  const Number away = distance();
  return away ? std::optional(std::abs(*away) <= 1 + kRounding) : std::nullopt;
}

std::string MetricRange::text() const {
  if (of == Of::Ratio) return fmt::format("{} to {}", low, end);
  const char* const words = of == Of::Difference ? "within" : low > end ? "at least" : "at most";
  return fmt::format("{} {}{}", words, end, unit);
}

std::span<const MetricInfo> metric_infos() {
  return kMetrics;
}

const MetricInfo* metric_info(std::string_view key) {
  const auto at =
      std::find_if(std::begin(kMetrics), std::end(kMetrics), [key](const auto& i) { return i.key == key; });
  return at != std::end(kMetrics) ? &*at : nullptr;
}

KeyMetric headline(const MetricInfo& info, const ModelMetrics& f) {
  KeyMetric h{info, {}, info.value(f, Side::Simulated), {}, {}};
  if (h.pair()) h.measured = info.value(f, Side::Measured);
  return h;
}

std::vector<KeyMetric> key_metrics(const ModelMetrics& f) {
  std::vector<KeyMetric> result;
  for (const MetricInfo& info : kMetrics) {
    const bool shown = info.kind != Kind::OfModel && (info.kind != Kind::ReportedFixes || f.reported_fixes);
    if (shown) result.push_back(headline(info, f));
  }
  return result;
}

const KeyMetric* headline_with(const std::vector<KeyMetric>& key_metrics, std::string_view key) {
  const auto at = std::find_if(key_metrics.begin(), key_metrics.end(),
                               [key](const KeyMetric& h) { return h.info.key == key; });
  return at != key_metrics.end() ? &*at : nullptr;
}

std::string value_text(const KeyMetric& h) {
  return pair_text(h, h.measured, h.simulated,
                   [&h](double value) { return fmt::format("{:.{}f}", value, h.info.decimals); });
}

std::string interval_text(const KeyMetric& h) {
  return pair_text(h, h.measured_interval, h.simulated_interval, [&h](const Interval& i) {
    return fmt::format("{:.{}f} to {:.{}f}", i.low, h.info.decimals, i.high, h.info.decimals);
  });
}

}  // namespace canyon::validation
