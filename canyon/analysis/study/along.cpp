#include "canyon/analysis/study/along.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"

namespace canyon::study {
namespace {

constexpr std::size_t kMaxStretches = 10'000;

/// Epochs of one noise realization in one segment.
struct Passed {
  std::size_t epochs = 0;
  std::vector<double> errors_m;  ///< of those with a fix
};
/// [stretch][occasion]
using Passes = std::vector<std::vector<Passed>>;

void add(Passes& passes, std::size_t occasion, std::size_t occasions, const ReceiverRecord& record,
         double step_m) {
  if (record.kept.size() == 0) return;
  const std::vector<float>& east_m = record.kept.columns[kept_column("error_east")];
  const std::vector<float>& north_m = record.kept.columns[kept_column("error_north")];
  for (std::size_t i = 0; i < record.kept.size(); ++i) {
    const double travelled_m = record.kept.travelled_m[i];
    const auto stretch = static_cast<std::size_t>(travelled_m / step_m);
    if (stretch >= kMaxStretches) {
      throw InputError(fmt::format("along_m: a route of {:.0f} m has more than {} segments of {} m",
                                   travelled_m, kMaxStretches, step_m),
                       "use longer segments");
    }
    while (passes.size() <= stretch) passes.emplace_back(occasions);
    Passed& passed = passes[stretch][occasion];
    ++passed.epochs;
    const double error_m = std::hypot(static_cast<double>(east_m[i]), static_cast<double>(north_m[i]));
    if (std::isfinite(error_m)) passed.errors_m.push_back(error_m);
  }
}

Stretch summarize(const std::vector<Passed>& passes, const Resamples& resamples, double confidence) {
  Stretch stretch;
  std::vector<double> all;
  std::size_t known = 0;
  for (const Passed& passed : passes) {
    stretch.epochs += passed.epochs;
    all.insert(all.end(), passed.errors_m.begin(), passed.errors_m.end());
    known += passed.errors_m.empty() ? 0 : 1;
  }
  if (stretch.epochs > 0)
    stretch.available = static_cast<double>(all.size()) / static_cast<double>(stretch.epochs);
  if (all.empty()) return stretch;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  stretch.median = MeanEstimate{*quantile(all, 0.5), kNan, kNan};
  stretch.p95 = MeanEstimate{*quantile(all, 0.95), kNan, kNan};
  if (known < 2) return stretch;
  std::vector<double> medians, p95s;
  for (const std::vector<std::uint32_t>& sampled : resamples) {
    all.clear();
    for (const std::uint32_t i : sampled)
      all.insert(all.end(), passes[i].errors_m.begin(), passes[i].errors_m.end());
    if (all.empty()) continue;
    std::size_t ranked = 0;
    medians.push_back(select_quantile(all, 0.5, ranked));
    p95s.push_back(select_quantile(all, 0.95, ranked));
  }
  for (const auto& [estimate, sampled] :
       {std::pair{&*stretch.median, &medians}, std::pair{&*stretch.p95, &p95s}}) {
    if (sampled->empty()) continue;
    estimate->low = *quantile(*sampled, (1 - confidence) / 2);
    estimate->high = *quantile(*sampled, (1 + confidence) / 2);
  }
  return stretch;
}

}  // namespace

std::vector<std::vector<Stretch>> errors_along(const Manifest& manifest, const GroupComparison& comparison,
                                               std::vector<std::optional<RunRecord>>& records,
                                               const std::filesystem::path& folder) {
  const double step_m = manifest.along_m.value();
  std::unordered_map<const ReceiverRecord*, std::pair<std::size_t, std::size_t>> at;  // group, occasion
  for (std::size_t g = 0; g < comparison.groups.size(); ++g) {
    const Group& group = comparison.groups[g];
    for (std::size_t i = 0; i < group.records.size(); ++i)
      if (group.records[i] != nullptr) at.emplace(group.records[i], std::pair{g, i});
  }
  std::vector<Passes> passes(comparison.groups.size());
  std::size_t occasions = 0;
  for (const Group& group : comparison.groups) occasions = std::max(occasions, group.records.size());
  for (auto& record : records) {
    if (!record || record->receivers.empty()) continue;
    read_epochs(folder, *record);
    for (ReceiverRecord& receiver : record->receivers) {
      const auto found = at.find(&receiver);
      if (found != at.end())
        add(passes[found->second.first], found->second.second, occasions, receiver, step_m);
      receiver.kept = {};
    }
  }
  const Resamples resamples = occasion_resamples(manifest, std::max<std::size_t>(1, occasions));
  std::vector<std::vector<Stretch>> along(comparison.groups.size());
  for (std::size_t g = 0; g < along.size(); ++g) {
    for (std::size_t s = 0; s < passes[g].size(); ++s) {
      Stretch stretch = summarize(passes[g][s], resamples, manifest.confidence);
      stretch.from_m = step_m * static_cast<double>(s);
      stretch.to_m = stretch.from_m + step_m;
      along[g].push_back(stretch);
    }
  }
  return along;
}

std::string along_csv(const GroupComparison& comparison, const std::vector<std::vector<Stretch>>& along) {
  std::string text;
  for (const std::string& axis : comparison.axes) text += csv_text(axis) + ",";
  text +=
      "receiver,from_m,to_m,epochs,available,error_p50_m,error_p50_low_m,error_p50_high_m,error_p95_m,error_"
      "p95_low_m,error_p95_high_m\n";
  for (std::size_t g = 0; g < along.size(); ++g) {
    const Group& group = comparison.groups[g];
    for (const Stretch& stretch : along[g]) {
      for (const std::string& value : group.at) text += csv_text(value) + ",";
      text += fmt::format("{},{:g},{:g},{},{:.6g},{},{}\n", csv_text(group.receiver), stretch.from_m,
                          stretch.to_m, stretch.epochs, stretch.available, csv_interval(stretch.median),
                          csv_interval(stretch.p95));
    }
  }
  return text;
}

}  // namespace canyon::study
