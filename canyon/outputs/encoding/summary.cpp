#include "canyon/outputs/encoding/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"

namespace canyon::encoding {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class MeanOf {
 public:
  void add(double value) {
    sum_ += value;
    ++count_;
  }
  [[nodiscard]] double mean() const { return count_ > 0 ? sum_ / static_cast<double>(count_) : kNan; }

 private:
  double sum_ = 0;
  std::size_t count_ = 0;
};

/// Sums and lists over one receiver's epochs.
struct Tally {
  RunSummary counts;  // the metrics that are counts, and the longest outage
  Distribution horizontal_m, vertical_m, hdop;
  double visible = 0, blocked = 0, used = 0;
  std::array<std::size_t, 4> by_visibility{};
  MeanOf cn0_los_dbhz, cn0_nlos_dbhz;
  Distribution fixed_m;
  std::optional<geodesy::GpsTime> first, first_fixed;
  std::optional<geodesy::GpsTime> outage_began;
  std::optional<geodesy::GpsTime> last, last_but_one;
  struct Fault {
    std::string name;
    std::size_t epochs = 0;
    std::size_t fixes = 0;
    Distribution horizontal_m;  // of fixed epochs
  };
  std::vector<Fault> faults;

  Fault& fault(const std::string& name) {
    const auto at =
        std::find_if(faults.begin(), faults.end(), [&](const Fault& f) { return f.name == name; });
    return at != faults.end() ? *at : faults.emplace_back(Fault{name, 0, 0, {}});
  }
  void close_outage(geodesy::GpsTime end) {
    if (!outage_began) return;
    counts.longest_outage_s = std::max(counts.longest_outage_s, end - *outage_began);
    outage_began.reset();
  }
};

// --- the metrics. Records of studies have them in this order: a new metric is appended.

template <auto member>
double of(const RunSummary& s) {
  return static_cast<double>(s.*member);
}
template <std::size_t RunSummary::*count>
double fraction_of_epochs(const RunSummary& s) {
  return s.epochs > 0 ? static_cast<double>(s.*count) / static_cast<double>(s.epochs) : kNan;
}
template <double RunSummary::*value>
bool known(const RunSummary& s) {
  return std::isfinite(s.*value);
}
bool corrected(const RunSummary& s) {
  return s.by_fixed + s.by_float + s.by_differential > 0;
}
bool ever_fixed(const RunSummary& s) {
  return s.by_fixed > 0;
}
bool excludes(const RunSummary& s) {
  return s.raim_tested > 0 || s.exclusions > 0;
}
bool tested(const RunSummary& s) {
  return s.raim_tested > 0;
}

using S = RunSummary;
// Name, unit, decimals, label and factor in printed tables, variable in studies, meaning, value, and the
// condition on a run.
constexpr SummaryMetric kMetrics[]{
    {"epochs", "", 0, "epochs", 1, "epochs", "epochs", &of<&S::epochs>},
    {"fixes", "", 0, "epochs with fix", 1, "", "epochs with a fix", &of<&S::fixes>},
    {"fix_share", "", 1, "epochs with fix", 100, "fix_share", "fraction of epochs with a fix",
     &fraction_of_epochs<&S::fixes>},
    {"longest_outage_s", "s", 1, "longest outage", 1, "longest_outage", "longest time without a fix",
     &of<&S::longest_outage_s>},
    {"horizontal_p50_m", "m", 3, "horizontal error, median", 1, "horizontal_error_p50",
     "median of the horizontal error", &of<&S::horizontal_p50_m>},
    {"horizontal_p95_m", "m", 3, "horizontal error, 95 %", 1, "horizontal_error_p95",
     "95 % of the horizontal error", &of<&S::horizontal_p95_m>},
    {"horizontal_max_m", "m", 3, "horizontal error, largest", 1, "horizontal_error_max",
     "maximum horizontal error", &of<&S::horizontal_max_m>},
    {"vertical_p50_m", "m", 3, "vertical error, median", 1, "vertical_error_p50",
     "median of the absolute vertical error", &of<&S::vertical_p50_m>},
    {"vertical_p95_m", "m", 3, "vertical error, 95 %", 1, "vertical_error_p95",
     "95 % of the absolute vertical error", &of<&S::vertical_p95_m>},
    {"median_hdop", "", 2, "HDOP, median", 1, "hdop", "median of the horizontal dilution of precision",
     &of<&S::median_hdop>},
    {"mean_tracked", "", 1, "satellites tracked, mean", 1, "satellites_tracked", "satellites tracked, mean",
     &of<&S::mean_visible>},
    {"mean_not_tracked", "", 1, "satellites not tracked, mean", 1, "satellites_not_tracked",
     "satellites above the mask that are not tracked, mean", &of<&S::mean_blocked>},
    {"mean_used", "", 1, "satellites used, mean", 1, "satellites_used", "satellites used in fixes, mean",
     &of<&S::mean_used>},
    {"los_share", "", 1, "LOS", 100, "los_share",
     "fraction of satellites above the mask in line of sight without multipath", &of<&S::los_fraction>},
    {"los_multipath_share", "", 1, "LOS+multipath", 100, "los_multipath_share",
     "fraction in line of sight with multipath", &of<&S::los_multipath_fraction>},
    {"nlos_share", "", 1, "NLOS", 100, "nlos_share", "fraction received without line of sight",
     &of<&S::nlos_fraction>},
    {"blocked_share", "", 1, "blocked", 100, "blocked_share", "fraction blocked", &of<&S::blocked_fraction>},
    {"mean_cn0_los_dbhz", "dB-Hz", 1, "C/N0 in sight, mean", 1, "cn0_los",
     "C/N0 of satellites in line of sight, mean", &of<&S::mean_cn0_los_dbhz>, &known<&S::mean_cn0_los_dbhz>},
    {"mean_cn0_nlos_dbhz", "dB-Hz", 1, "C/N0 of NLOS, mean", 1, "cn0_nlos",
     "C/N0 of satellites without line of sight, mean", &of<&S::mean_cn0_nlos_dbhz>,
     &known<&S::mean_cn0_nlos_dbhz>},
    {"exclusions", "", 0, "satellites excluded, in all", 1, "exclusions",
     "satellites excluded from fixes, in all", &of<&S::exclusions>, &excludes},
    {"raim_tested", "", 0, "", 1, "", "epochs tested by RAIM", &of<&S::raim_tested>},
    {"inconsistent", "", 0, "epochs that failed RAIM", 1, "raim_failures", "epochs that failed RAIM",
     &of<&S::inconsistent>, &tested},
    {"by_fixed", "", 0, "", 1, "", "epochs with a fixed position (RTK)", &of<&S::by_fixed>},
    {"by_float", "", 0, "", 1, "", "epochs with a float position", &of<&S::by_float>},
    {"by_differential", "", 0, "", 1, "", "epochs with a differential position", &of<&S::by_differential>},
    {"wrong_fixes", "", 0, "", 1, "", "epochs with a fixed position that is wrong", &of<&S::wrong_fixes>},
    {"fixed_share", "", 1, "epochs fixed", 100, "fixed_share",
     "fraction of epochs with a fixed position (RTK)", &fraction_of_epochs<&S::by_fixed>, &corrected},
    {"float_share", "", 1, "epochs float", 100, "float_share", "fraction of epochs with a float position",
     &fraction_of_epochs<&S::by_float>, &corrected},
    {"differential_share", "", 1, "epochs differential", 100, "",
     "fraction of epochs with a differential position", &fraction_of_epochs<&S::by_differential>, &corrected},
    {"wrong_fix_share", "", 1, "epochs wrongly fixed", 100, "wrong_fix_share",
     "fraction of epochs with a fixed position that is wrong", &fraction_of_epochs<&S::wrong_fixes>,
     &ever_fixed},
    {"fixed_p95_m", "m", 3, "horizontal error while fixed, 95 %", 1, "fixed_error_p95",
     "95 % of the horizontal error while fixed", &of<&S::fixed_p95_m>, &ever_fixed},
    {"first_fixed_s", "s", 1, "time to the first fixed position", 1, "time_to_first_fixed",
     "from the first epoch to the first fixed position", &of<&S::first_fixed_s>, &ever_fixed},
};

/// A cell of the printed table.
std::string cell(const SummaryMetric& metric, const RunSummary& summary) {
  const double value = metric.value(summary) * metric.factor;
  return metric.is_applicable(summary) && std::isfinite(value)
             ? fmt::format("{:.{}f}", value, metric.decimals)
             : std::string("-");
}

}  // namespace

struct SummarySink::State {
  std::vector<std::string> names;
  std::vector<Tally> tallies;
};

SummarySink::SummarySink(std::vector<std::string> receiver_names) : state_(std::make_unique<State>()) {
  state_->tallies.resize(receiver_names.size());
  state_->names = std::move(receiver_names);
}
SummarySink::~SummarySink() = default;

void SummarySink::write(const simulation::Epoch& epoch) {
  Tally& tally = state_->tallies.at(epoch.receiver);
  const receiver::ReceiverEpoch& seen = epoch.observed;
  RunSummary& counts = tally.counts;
  ++counts.epochs;
  if (!tally.first) tally.first = seen.time;
  const positioning::FixKind kind = seen.fix.kind();
  counts.by_fixed += kind == positioning::FixKind::Fixed ? 1 : 0;
  counts.by_float += kind == positioning::FixKind::Float ? 1 : 0;
  counts.by_differential += kind == positioning::FixKind::Differential ? 1 : 0;
  if (const std::optional<bool> wrong = wrong_fix(epoch)) {
    if (!tally.first_fixed) tally.first_fixed = seen.time;
    counts.wrong_fixes += *wrong ? 1 : 0;
    tally.fixed_m.add(encoding::horizontal_m(epoch.error_enu_m));
  }
  if (seen.fix.solved()) {
    ++counts.fixes;
    tally.horizontal_m.add(encoding::horizontal_m(epoch.error_enu_m));
    tally.vertical_m.add(std::abs(epoch.error_enu_m.z()));
    if (seen.fix.dop) tally.hdop.add(seen.fix.dop->hdop);
    tally.close_outage(seen.time);
  } else if (!tally.outage_began) {
    tally.outage_began = seen.time;
  }
  for (const std::string& name : epoch.faults) {
    Tally::Fault& fault = tally.fault(name);
    ++fault.epochs;
    if (!seen.fix.solved()) continue;
    ++fault.fixes;
    fault.horizontal_m.add(encoding::horizontal_m(epoch.error_enu_m));
  }
  tally.visible += seen.visible;
  tally.blocked += seen.blocked;
  tally.used += static_cast<double>(used_count(seen.fix));
  for (const receiver::SatelliteObservation& satellite : seen.satellites) {
    if (!satellite.above_mask) continue;
    ++tally.by_visibility[static_cast<std::size_t>(satellite.visibility)];
    if (satellite.measurement && satellite.measurement->cn0_dbhz) {
      MeanOf& strength =
          satellite.visibility == propagation::Visibility::NLOS ? tally.cn0_nlos_dbhz : tally.cn0_los_dbhz;
      strength.add(*satellite.measurement->cn0_dbhz);
    }
  }
  counts.exclusions += seen.fix.excluded.size();
  if (seen.fix.consistent) {
    ++counts.raim_tested;
    counts.inconsistent += *seen.fix.consistent ? 0 : 1;
  }
  tally.last_but_one = tally.last;
  tally.last = seen.time;
}

void SummarySink::finish() {}

std::vector<RunSummary> SummarySink::summaries() const {
  std::vector<RunSummary> result;
  for (std::size_t i = 0; i < state_->tallies.size(); ++i) {
    Tally tally = state_->tallies[i];
    if (tally.last) {
      // In an outage until the end, the last epoch counts as long as the previous one.
      const double step = tally.last_but_one ? *tally.last - *tally.last_but_one : 0.0;
      tally.close_outage(*tally.last + step);
    }
    RunSummary s = std::move(tally.counts);
    s.receiver = state_->names[i];
    s.fixed_p95_m = tally.fixed_m.quantile(0.95).value_or(kNan);
    s.first_fixed_s = tally.first_fixed ? *tally.first_fixed - *tally.first : kNan;
    s.horizontal_p50_m = tally.horizontal_m.quantile(0.50).value_or(kNan);
    s.horizontal_p95_m = tally.horizontal_m.quantile(0.95).value_or(kNan);
    s.horizontal_max_m = tally.horizontal_m.quantile(1.0).value_or(kNan);
    s.vertical_p50_m = tally.vertical_m.quantile(0.50).value_or(kNan);
    s.vertical_p95_m = tally.vertical_m.quantile(0.95).value_or(kNan);
    const double epochs = s.epochs > 0 ? static_cast<double>(s.epochs) : kNan;
    s.mean_visible = tally.visible / epochs;
    s.mean_blocked = tally.blocked / epochs;
    s.mean_used = tally.used / epochs;
    std::size_t satellites = 0;
    for (const std::size_t n : tally.by_visibility) satellites += n;
    const auto fraction = [&](propagation::Visibility visibility) {
      const auto n = static_cast<double>(tally.by_visibility[static_cast<std::size_t>(visibility)]);
      return satellites > 0 ? n / static_cast<double>(satellites) : kNan;
    };
    s.los_fraction = fraction(propagation::Visibility::LOS);
    s.los_multipath_fraction = fraction(propagation::Visibility::LOSMultipath);
    s.nlos_fraction = fraction(propagation::Visibility::NLOS);
    s.blocked_fraction = fraction(propagation::Visibility::Blocked);
    s.median_hdop = tally.hdop.quantile(0.50).value_or(kNan);
    s.mean_cn0_los_dbhz = tally.cn0_los_dbhz.mean();
    s.mean_cn0_nlos_dbhz = tally.cn0_nlos_dbhz.mean();
    for (const Tally::Fault& fault : tally.faults) {
      s.faults.push_back(
          {fault.name, fault.epochs, fault.fixes, fault.horizontal_m.quantile(0.95).value_or(kNan)});
    }
    result.push_back(std::move(s));
  }
  return result;
}

std::span<const SummaryMetric> summary_metrics() {
  return kMetrics;
}

std::string markdown(std::span<const SummaryMetric> metrics) {
  std::vector<TextRow> rows;
  for (const SummaryMetric& f : metrics) {
    const std::string kept = *f.kept != '\0' ? fmt::format("`{}`", f.kept) : std::string();
    rows.push_back({fmt::format("`{}`", f.name), kept, f.unit, f.help});
  }
  return markdown_table({"figure", "in studies", "unit", "meaning"}, rows);
}

std::string format_summary_table(const std::vector<RunSummary>& summaries) {
  struct Line {
    std::string label;
    std::function<std::string(const RunSummary&)> cell;
  };
  std::vector<Line> lines;
  for (const SummaryMetric& metric : kMetrics) {
    const bool wanted =
        metric.applies == nullptr || std::any_of(summaries.begin(), summaries.end(), metric.applies);
    if (*metric.label == '\0' || !wanted) continue;
    const std::string_view unit = metric.printed_unit();
    lines.push_back({unit.empty() ? metric.label : fmt::format("{} [{}]", metric.label, unit),
                     [&metric](const RunSummary& s) { return cell(metric, s); }});
  }
  // A fault of two receivers is in one line.
  std::vector<std::string> faults;
  for (const RunSummary& s : summaries) {
    for (const RunSummary::Fault& fault : s.faults)
      if (std::find(faults.begin(), faults.end(), fault.name) == faults.end()) faults.push_back(fault.name);
  }
  for (const std::string& name : faults) {
    const auto fault_values = [name](const auto& cell) {
      return [name, cell](const RunSummary& s) {
        for (const RunSummary::Fault& fault : s.faults)
          if (fault.name == name) return cell(fault);
        return std::string("-");
      };
    };
    lines.push_back(
        {fmt::format("during {}: with fix", name), fault_values([](const RunSummary::Fault& fault) {
           return fmt::format("{} of {}", fault.fixes, fault.epochs);
         })});
    lines.push_back(
        {fmt::format("during {}: error, 95 % [m]", name), fault_values([](const RunSummary::Fault& fault) {
           return std::isfinite(fault.horizontal_p95_m) ? fmt::format("{:.3f}", fault.horizontal_p95_m)
                                                        : std::string("-");
         })});
  }
  constexpr std::size_t kPerBlock = 4;  // receivers side by side on 80 to 100 columns
  std::string text;
  const std::size_t shown = std::min(summaries.size(), kMaxSummarized);
  for (std::size_t first = 0; first < shown; first += kPerBlock) {
    const auto receivers = std::span(summaries).subspan(first, std::min(kPerBlock, shown - first));
    TextRow head{""};
    for (const RunSummary& s : receivers) head.push_back(s.receiver);
    std::vector<TextRow> rows;
    for (const Line& line : lines) {
      TextRow& row = rows.emplace_back(TextRow{line.label});
      for (const RunSummary& s : receivers) row.push_back(line.cell(s));
    }
    text += (first > 0 ? "\n" : "") + text_table(head, rows, {1, "", true});
  }
  if (shown < summaries.size()) text += fmt::format("\n(and {} more receivers)\n", summaries.size() - shown);
  return text;
}

}  // namespace canyon::encoding
