#include "canyon/validation/report/report_targets.hpp"

#include "canyon/output/number.hpp"

namespace canyon::validation {
namespace {

constexpr std::size_t kMedian = 2, kP95 = 4;  // of kQuantiles
static_assert(kQuantiles[kMedian] == 0.5 && kQuantiles[kP95] == 0.95);

std::optional<double> tracked_difference(const TrackedShare& share) {
  if (share.satellites == 0) return std::nullopt;
  return share.simulated_ratio() - share.measured_ratio();
}

}  // namespace

std::string Target::value_text() const {
  return value ? output::fixed(factor * *value, decimals) + unit : "no value";
}

std::vector<Target> targets(const Figures& f) {
  std::optional<double> share, difference, rho;
  if (f.nlos > 0 && !f.explained.empty()) {
    const Explained& all = f.explained.back();
    share = all.share;
    difference = all.median_difference_m;
    if (all.correlation) rho = all.correlation->rho;
  }
  std::optional<double> used;
  if (f.measured.fixes > 0 && f.simulated.fixes > 0) used = f.simulated.mean_used - f.measured.mean_used;

  return {
      {"LOS and NLOS separated by C/N0, AUC", "at least 0.88", 0.88, 1, auc_of(f.by_cn0), 3, 1, ""},
      {"LOS and NLOS separated by pseudorange error, AUC", "at least 0.88", 0.88, 1, auc_of(f.by_error), 3, 1,
       ""},
      {"Tracked NLOS observations with a modelled path", "at least 80 %", 0.8, 1, share, 1, 100, " %"},
      {"NLOS, median of |error - predicted delay|", "at most 6 m", 0, 6, difference, 2, 1, " m"},
      {"NLOS, Spearman correlation of error and predicted delay", "at least 0.75", 0.75, 1, rho, 3, 1, ""},
      {"LOS pseudorange error, KS distance", "at most 0.15", 0, 0.15, f.error_los_m.ks, 3, 1, ""},
      {"NLOS pseudorange error, KS distance", "at most 0.15", 0, 0.15, f.error_nlos_m.ks, 3, 1, ""},
      {"LOS C/N0, KS distance", "at most 0.15", 0, 0.15, f.cn0_los_dbhz.ks, 3, 1, ""},
      {"NLOS C/N0, KS distance", "at most 0.15", 0, 0.15, f.cn0_nlos_dbhz.ks, 3, 1, ""},
      {"LOS tracked ratio, simulated less measured", "within 0.1", -0.1, 0.1,
       tracked_difference(f.tracked_los), 3, 1, ""},
      {"NLOS tracked ratio, simulated less measured", "within 0.1", -0.1, 0.1,
       tracked_difference(f.tracked_nlos), 3, 1, ""},
      {"Mean satellites used, simulated less measured", "within 1", -1, 1, used, 2, 1, ""},
      {"Horizontal error p50, simulated over measured", "0.8 to 1.25", 0.8, 1.25, error_ratio(f, kMedian), 3,
       1, ""},
      {"Horizontal error p95, simulated over measured", "0.8 to 1.25", 0.8, 1.25, error_ratio(f, kP95), 3, 1,
       ""},
  };
}

}  // namespace canyon::validation
