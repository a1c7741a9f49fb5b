#include "canyon/study/record.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"

namespace canyon::study {
namespace {

using output::RunSummary;

double share(std::size_t epochs, const RunSummary& s) {
  return s.epochs > 0 ? static_cast<double>(epochs) / static_cast<double>(s.epochs)
                      : std::numeric_limits<double>::quiet_NaN();
}

constexpr std::array kFigures{
    Figure{"epochs", "1", "epochs", [](const RunSummary& s) { return static_cast<double>(s.epochs); }},
    Figure{"fix_share", "1", "share of epochs with a fix",
           [](const RunSummary& s) { return share(s.fixes, s); }},
    Figure{"longest_outage", "s", "longest time without a fix",
           [](const RunSummary& s) { return s.longest_outage_s; }},
    Figure{"horizontal_error_p50", "m", "median of the horizontal error",
           [](const RunSummary& s) { return s.horizontal_p50_m; }},
    Figure{"horizontal_error_p95", "m", "95 % of the horizontal error",
           [](const RunSummary& s) { return s.horizontal_p95_m; }},
    Figure{"horizontal_error_max", "m", "largest horizontal error",
           [](const RunSummary& s) { return s.horizontal_max_m; }},
    Figure{"vertical_error_p50", "m", "median of the vertical error without its sign",
           [](const RunSummary& s) { return s.vertical_p50_m; }},
    Figure{"vertical_error_p95", "m", "95 % of the vertical error without its sign",
           [](const RunSummary& s) { return s.vertical_p95_m; }},
    Figure{"hdop", "1", "median of the horizontal dilution of precision",
           [](const RunSummary& s) { return s.median_hdop; }},
    Figure{"satellites_tracked", "1", "satellites tracked, mean",
           [](const RunSummary& s) { return s.mean_visible; }},
    Figure{"satellites_not_tracked", "1", "satellites above the mask that are not tracked, mean",
           [](const RunSummary& s) { return s.mean_blocked; }},
    Figure{"satellites_used", "1", "satellites used in fixes, mean",
           [](const RunSummary& s) { return s.mean_used; }},
    Figure{"los_share", "1", "share of satellites above the mask in line of sight alone",
           [](const RunSummary& s) { return s.los_share; }},
    Figure{"los_multipath_share", "1", "share in line of sight with multipath",
           [](const RunSummary& s) { return s.los_multipath_share; }},
    Figure{"nlos_share", "1", "share without line of sight that are received",
           [](const RunSummary& s) { return s.nlos_share; }},
    Figure{"blocked_share", "1", "share that is blocked",
           [](const RunSummary& s) { return s.blocked_share; }},
    Figure{"cn0_los", "dB", "C/N0 of satellites in line of sight, mean (dB-Hz)",
           [](const RunSummary& s) { return s.mean_cn0_los_dbhz; }},
    Figure{"cn0_nlos", "dB", "C/N0 of satellites without line of sight, mean (dB-Hz)",
           [](const RunSummary& s) { return s.mean_cn0_nlos_dbhz; }},
    Figure{"exclusions", "1", "satellites excluded from fixes, in all",
           [](const RunSummary& s) { return static_cast<double>(s.exclusions); }},
    Figure{"raim_failures", "1", "epochs that failed RAIM",
           [](const RunSummary& s) { return static_cast<double>(s.inconsistent); }},
    Figure{"fixed_share", "1", "share of epochs with a fixed position (RTK)",
           [](const RunSummary& s) { return share(s.by_fixed, s); }},
    Figure{"float_share", "1", "share of epochs with a float position",
           [](const RunSummary& s) { return share(s.by_float, s); }},
    Figure{"wrong_fix_share", "1", "share of epochs with a fixed position that is wrong",
           [](const RunSummary& s) { return share(s.wrong_fixes, s); }},
    Figure{"fixed_error_p95", "m", "95 % of the horizontal error while fixed",
           [](const RunSummary& s) { return s.fixed_p95_m; }},
    Figure{"time_to_first_fixed", "s", "from the first epoch to the first fixed position",
           [](const RunSummary& s) { return s.first_fixed_s; }},
};

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
  for (std::size_t i = 0; i + 1 < list.size(); i += 2) {
    counts.at(list[i].get<std::size_t>()) = list[i + 1].get<std::uint32_t>();
  }
}

}  // namespace

std::span<const Figure> figures() {
  return kFigures;
}

std::span<const output::Column* const> kept_columns() {
  static const std::vector<const output::Column*> kept = [] {
    std::vector<const output::Column*> list;
    for (const output::Column& column : output::table(output::TableKind::Epochs).columns) {
      if (*column.kept != '\0') list.push_back(&column);
    }
    return list;
  }();
  return kept;
}

std::size_t kept_column(std::string_view name) {
  const auto all = kept_columns();
  const auto at =
      std::find_if(all.begin(), all.end(), [&](const auto* column) { return name == column->kept; });
  assert(at != all.end());
  return static_cast<std::size_t>(at - all.begin());
}

std::size_t error_bin(double error_m) {
  const double bin =
      std::floor(kBinsPerDecade * std::log10(std::max(error_m, kLeastError_m) / kLeastError_m));
  return std::min(static_cast<std::size_t>(std::max(bin, 0.0)), kErrorBins - 1);
}

double error_edge_m(std::size_t bin) {
  return kLeastError_m * std::pow(10.0, static_cast<double>(bin) / kBinsPerDecade);
}

std::string to_line(const RunRecord& record) {
  Json line{{"run", record.number}, {"seed", record.seed}, {"at", record.at}};
  if (!record.problem.empty()) line["problem"] = record.problem;
  Json receivers = Json::array();
  for (const ReceiverRecord& receiver : record.receivers) {
    receivers.push_back({{"name", receiver.name},
                         {"figures", receiver.figures},
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
    for (const Json& each : from.at("receivers")) {
      ReceiverRecord receiver;
      receiver.name = each.at("name").get<std::string>();
      for (const Json& value : each.at("figures")) {
        receiver.figures.push_back(value.is_null() ? std::numeric_limits<double>::quiet_NaN()
                                                   : value.get<double>());
      }
      dense(each.at("errors"), receiver.errors);
      dense(each.at("epochs"), receiver.epochs);
      dense(each.at("available"), receiver.available);
      if (receiver.figures.size() != kFigures.size()) throw InputError("other figures than this program's");
      record.receivers.push_back(std::move(receiver));
    }
    return record;
  } catch (const JsonError& e) {
    throw InputError(std::string("is no record of a run: ") + e.what());
  } catch (const std::out_of_range&) {
    throw InputError("is no record of a run: a count out of range");
  }
}

}  // namespace canyon::study
