#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "canyon/base/statistics.hpp"
#include "canyon/base/utf8.hpp"
#include "canyon/output/epoch_values.hpp"
#include "canyon/output/sinks.hpp"

namespace canyon::output {
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

/// What is kept of one receiver's epochs.
struct Tally {
  std::size_t epochs = 0, fixes = 0;
  std::vector<double> horizontal_m, vertical_m, hdop;
  double visible = 0, blocked = 0, used = 0;
  std::array<std::size_t, 4> by_visibility{};
  MeanOf cn0_los_dbhz, cn0_nlos_dbhz;
  std::size_t exclusions = 0, raim_tested = 0, inconsistent = 0;
  std::array<std::size_t, 6> by_kind{};  // FixKind
  std::size_t wrong_fixes = 0;
  std::vector<double> fixed_m;
  std::optional<geodesy::GpsTime> first, first_fixed;
  double longest_outage_s = 0;
  std::optional<geodesy::GpsTime> outage_began;
  std::optional<geodesy::GpsTime> last, last_but_one;
  struct Fault {
    std::string name;
    std::size_t epochs = 0;
    std::vector<double> horizontal_m;  // of its fixes
  };
  std::vector<Fault> faults;

  Fault& fault(const std::string& name) {
    const auto at =
        std::find_if(faults.begin(), faults.end(), [&](const Fault& f) { return f.name == name; });
    return at != faults.end() ? *at : faults.emplace_back(Fault{name, 0, {}});
  }
  void close_outage(geodesy::GpsTime end) {
    if (!outage_began) return;
    longest_outage_s = std::max(longest_outage_s, end - *outage_began);
    outage_began.reset();
  }
};

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
  ++tally.epochs;
  if (!tally.first) tally.first = seen.time;
  ++tally.by_kind.at(static_cast<std::size_t>(seen.fix.kind()));
  if (const std::optional<bool> wrong = wrong_fix(epoch)) {
    if (!tally.first_fixed) tally.first_fixed = seen.time;
    tally.wrong_fixes += *wrong ? 1 : 0;
    tally.fixed_m.push_back(output::horizontal_m(epoch.error_enu_m));
  }
  if (seen.fix.solved()) {
    ++tally.fixes;
    tally.horizontal_m.push_back(output::horizontal_m(epoch.error_enu_m));
    tally.vertical_m.push_back(std::abs(epoch.error_enu_m.z()));
    if (seen.fix.dop) tally.hdop.push_back(seen.fix.dop->hdop);
    tally.close_outage(seen.time);
  } else if (!tally.outage_began) {
    tally.outage_began = seen.time;
  }
  for (const std::string& name : epoch.faults) {
    Tally::Fault& fault = tally.fault(name);
    ++fault.epochs;
    if (seen.fix.solved()) fault.horizontal_m.push_back(output::horizontal_m(epoch.error_enu_m));
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
  tally.exclusions += seen.fix.excluded.size();
  if (seen.fix.consistent) {
    ++tally.raim_tested;
    if (!*seen.fix.consistent) ++tally.inconsistent;
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
      // An outage that lasts to the end counts its last epoch as long as the one before it.
      const double step = tally.last_but_one ? *tally.last - *tally.last_but_one : 0.0;
      tally.close_outage(*tally.last + step);
    }
    RunSummary s;
    s.receiver = state_->names[i];
    s.epochs = tally.epochs;
    s.fixes = tally.fixes;
    const auto of_kind = [&](positioning::FixKind kind) {
      return tally.by_kind[static_cast<std::size_t>(kind)];
    };
    s.by_fixed = of_kind(positioning::FixKind::Fixed);
    s.by_float = of_kind(positioning::FixKind::Float);
    s.by_differential = of_kind(positioning::FixKind::Differential);
    s.wrong_fixes = tally.wrong_fixes;
    s.fixed_p95_m = quantile(tally.fixed_m, 0.95).value_or(kNan);
    s.first_fixed_s = tally.first_fixed ? *tally.first_fixed - *tally.first : kNan;
    s.horizontal_p50_m = quantile(tally.horizontal_m, 0.50).value_or(kNan);
    s.horizontal_p95_m = quantile(tally.horizontal_m, 0.95).value_or(kNan);
    s.horizontal_max_m = quantile(tally.horizontal_m, 1.0).value_or(kNan);
    s.vertical_p50_m = quantile(tally.vertical_m, 0.50).value_or(kNan);
    s.vertical_p95_m = quantile(tally.vertical_m, 0.95).value_or(kNan);
    const double epochs = tally.epochs > 0 ? static_cast<double>(tally.epochs) : kNan;
    s.mean_visible = tally.visible / epochs;
    s.mean_blocked = tally.blocked / epochs;
    s.mean_used = tally.used / epochs;
    std::size_t satellites = 0;
    for (const std::size_t n : tally.by_visibility) satellites += n;
    const auto share = [&](propagation::Visibility visibility) {
      const auto n = static_cast<double>(tally.by_visibility[static_cast<std::size_t>(visibility)]);
      return satellites > 0 ? n / static_cast<double>(satellites) : kNan;
    };
    s.los_share = share(propagation::Visibility::LOS);
    s.los_multipath_share = share(propagation::Visibility::LOSMultipath);
    s.nlos_share = share(propagation::Visibility::NLOS);
    s.blocked_share = share(propagation::Visibility::Blocked);
    s.median_hdop = quantile(tally.hdop, 0.50).value_or(kNan);
    s.mean_cn0_los_dbhz = tally.cn0_los_dbhz.mean();
    s.mean_cn0_nlos_dbhz = tally.cn0_nlos_dbhz.mean();
    s.exclusions = tally.exclusions;
    s.raim_tested = tally.raim_tested;
    s.inconsistent = tally.inconsistent;
    s.longest_outage_s = tally.longest_outage_s;
    for (const Tally::Fault& fault : tally.faults) {
      s.faults.push_back({fault.name, fault.epochs, fault.horizontal_m.size(),
                          quantile(fault.horizontal_m, 0.95).value_or(kNan)});
    }
    result.push_back(std::move(s));
  }
  return result;
}

std::string format_summary_table(const std::vector<RunSummary>& summaries) {
  struct Line {
    std::string label;
    std::function<std::string(const RunSummary&)> cell;
  };
  const auto number = [](double RunSummary::*member, int decimals, double scale = 1) {
    return [=](const RunSummary& s) {
      const double value = s.*member * scale;
      return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : std::string("-");
    };
  };
  std::vector<Line> lines{
      {"epochs", [](const RunSummary& s) { return fmt::format("{}", s.epochs); }},
      {"with fix",
       [](const RunSummary& s) {
         if (s.epochs == 0) return std::string("-");
         const double percent = 100.0 * static_cast<double>(s.fixes) / static_cast<double>(s.epochs);
         return fmt::format("{} ({:.1f} %)", s.fixes, percent);
       }},
      {"longest outage [s]", number(&RunSummary::longest_outage_s, 1)},
      {"horizontal error, median [m]", number(&RunSummary::horizontal_p50_m, 3)},
      {"horizontal error, 95 % [m]", number(&RunSummary::horizontal_p95_m, 3)},
      {"horizontal error, largest [m]", number(&RunSummary::horizontal_max_m, 3)},
      {"vertical error, median [m]", number(&RunSummary::vertical_p50_m, 3)},
      {"vertical error, 95 % [m]", number(&RunSummary::vertical_p95_m, 3)},
      {"HDOP, median", number(&RunSummary::median_hdop, 2)},
      {"satellites tracked, mean", number(&RunSummary::mean_visible, 1)},
      {"satellites not tracked, mean", number(&RunSummary::mean_blocked, 1)},
      {"satellites used, mean", number(&RunSummary::mean_used, 1)},
      {"LOS [%]", number(&RunSummary::los_share, 1, 100)},
      {"LOS+multipath [%]", number(&RunSummary::los_multipath_share, 1, 100)},
      {"NLOS [%]", number(&RunSummary::nlos_share, 1, 100)},
      {"blocked [%]", number(&RunSummary::blocked_share, 1, 100)},
  };
  // What only some receivers have.
  const auto any = [&](auto has) { return std::any_of(summaries.begin(), summaries.end(), has); };
  const auto share = [](std::size_t RunSummary::*member) {
    return [=](const RunSummary& s) {
      if (s.by_fixed + s.by_float + s.by_differential == 0) return std::string("-");
      return fmt::format("{:.1f}", 100.0 * static_cast<double>(s.*member) / static_cast<double>(s.epochs));
    };
  };
  if (any([](const RunSummary& s) { return s.by_fixed + s.by_float + s.by_differential > 0; })) {
    lines.push_back({"fixed [% of epochs]", share(&RunSummary::by_fixed)});
    lines.push_back({"float [%]", share(&RunSummary::by_float)});
    lines.push_back({"differential [%]", share(&RunSummary::by_differential)});
  }
  if (any([](const RunSummary& s) { return s.by_fixed > 0; })) {
    lines.push_back({"wrongly fixed [%]", share(&RunSummary::wrong_fixes)});
    lines.push_back({"horizontal error while fixed, 95 % [m]", number(&RunSummary::fixed_p95_m, 3)});
    lines.push_back({"time to the first fixed position [s]", number(&RunSummary::first_fixed_s, 1)});
  }
  if (any([](const RunSummary& s) {
        return std::isfinite(s.mean_cn0_los_dbhz) || std::isfinite(s.mean_cn0_nlos_dbhz);
      })) {
    lines.push_back({"C/N0 of LOS, mean [dB-Hz]", number(&RunSummary::mean_cn0_los_dbhz, 1)});
    lines.push_back({"C/N0 of NLOS, mean [dB-Hz]", number(&RunSummary::mean_cn0_nlos_dbhz, 1)});
  }
  const auto asked = [](const RunSummary& s) { return s.raim_tested > 0 || s.exclusions > 0; };
  const auto tested = [](const RunSummary& s) { return s.raim_tested > 0; };
  const auto count = [](auto applies, std::size_t RunSummary::*member) {
    return [=](const RunSummary& s) { return applies(s) ? fmt::format("{}", s.*member) : std::string("-"); };
  };
  // By RAIM, or by the position filter's gate.
  if (any(asked)) lines.push_back({"satellites excluded, in all", count(asked, &RunSummary::exclusions)});
  if (any(tested)) lines.push_back({"epochs that failed RAIM", count(tested, &RunSummary::inconsistent)});
  // A fault that two receivers meet stands in one line.
  std::vector<std::string> faults;
  for (const RunSummary& s : summaries) {
    for (const RunSummary::Fault& fault : s.faults) {
      if (std::find(faults.begin(), faults.end(), fault.name) == faults.end()) faults.push_back(fault.name);
    }
  }
  for (const std::string& name : faults) {
    const auto of_fault = [name](const auto& cell) {
      return [name, cell](const RunSummary& s) {
        for (const RunSummary::Fault& fault : s.faults) {
          if (fault.name == name) return cell(fault);
        }
        return std::string("-");
      };
    };
    lines.push_back({fmt::format("during {}: with fix", name), of_fault([](const RunSummary::Fault& fault) {
                       return fmt::format("{} of {}", fault.fixes, fault.epochs);
                     })});
    lines.push_back(
        {fmt::format("during {}: error, 95 % [m]", name), of_fault([](const RunSummary::Fault& fault) {
           return std::isfinite(fault.horizontal_p95_m) ? fmt::format("{:.3f}", fault.horizontal_p95_m)
                                                        : std::string("-");
         })});
  }
  constexpr std::size_t kPerBlock = 4;  // receivers side by side on 80 to 100 columns
  std::size_t label_width = 0;
  for (const Line& line : lines) label_width = std::max(label_width, display_width(line.label));

  std::string text;
  const std::size_t shown = std::min(summaries.size(), kMostSummarized);
  for (std::size_t first = 0; first < shown; first += kPerBlock) {
    const std::size_t end = std::min(first + kPerBlock, shown);
    if (first > 0) text += '\n';
    std::vector<std::size_t> widths;
    for (std::size_t i = first; i < end; ++i) {
      std::size_t width = display_width(summaries[i].receiver);
      for (const Line& line : lines) width = std::max(width, line.cell(summaries[i]).size());
      widths.push_back(width);
    }
    const auto row = [&](std::string_view label, const std::function<std::string(const RunSummary&)>& cell) {
      text += label;
      text.append(label_width - display_width(label), ' ');
      for (std::size_t i = first; i < end; ++i) {
        const std::string value = cell(summaries[i]);
        text.append(2 + widths[i - first] - display_width(value), ' ');
        text += value;
      }
      text += '\n';
    };
    row("", [](const RunSummary& s) { return s.receiver; });
    std::size_t rule = label_width;
    for (const std::size_t width : widths) rule += 2 + width;
    text.append(rule, '-');
    text += '\n';
    for (const Line& line : lines) row(line.label, line.cell);
  }
  if (shown < summaries.size()) text += fmt::format("\n(and {} more receivers)\n", summaries.size() - shown);
  return text;
}

}  // namespace canyon::output
