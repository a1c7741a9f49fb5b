#pragma once

#include <array>
#include <optional>

#include "canyon/analysis/bench/tracks.hpp"
#include "canyon/base/options/fwd.hpp"

namespace canyon::bench {

/// Whether an event can be scored.
enum class EventState : std::uint8_t {
  Scored,
  NotRead,  ///< the estimator reads no data that contain it
  Lost,     ///< the estimate had no error below bound_m in the 5 s before it
  Absent    ///< there is no estimate during it
};

struct EventScore {
  Event event;
  EventState state = EventState::Scored;
  std::optional<double> followed;    ///< fraction of the fixes' mean error that the estimate has; empty: that
                                     ///< error is below 2.5 m, the event has the whole drive, or not scored
  std::optional<double> largest_m;   ///< error from its start to 5 s after its end; empty: no estimate
  bool over = true;                  ///< it ends before the drive does
  double bound_m = 0;                ///< the estimate has recovered when its error stays below
  std::optional<double> recovery_s;  ///< from its end until the error stays below bound_m for 2 s
};

/// Errors [m] within which fractions of the drive are given.
inline constexpr std::array<int, 3> kWithin_m{2, 5, 10};

/// Metrics of an estimate; horizontal errors at the times of the truth.
struct Score {
  double availability = 0;         ///< fraction of the times with an estimate (point_at())
  std::array<double, 3> within{};  ///< fractions of all times with an error below kWithin_m; absent is not
  double p50_m = kNan, p95_m = kNan, rmse_m = kNan, largest_m = kNan;  ///< ATE; NaN without an estimate
  double rpe_1s_m = kNan, rpe_10s_m = kNan;  ///< RPE: RMS of errors of the displacement in 1 and 10 s
  /// Mean e' P^-1 e [1], 2 if consistent; fraction inside the 95 % ellipse. Deviations are at least 1 mm.
  std::optional<double> nees, within_95;
  std::optional<double> misleading;  ///< fraction of errors beyond the bound that is exceeded by 1e-4 of them
  std::optional<double> heading_p95_deg;  ///< after the vehicle has moved 10 m
  double longest_divergence_s =
      0;  ///< longest time in which fix and estimate are there and only the fix good
  std::vector<EventScore> events;
};

/// Limits of a user's estimates.
struct Limits {
  std::optional<double> p50_m, p95_m, largest_m, availability, followed, recovery_s, divergence_s, within_95;
  std::array<std::optional<double>, 3> within;
  std::vector<std::string> drives;  ///< drives that they apply to; empty: all
};
struct LimitsFile {
  double recovered_m = 5;  ///< an error below it is a good one
  std::vector<Limits> limits;
};
void visit(options::Visitor& v, LimitsFile& file);
/// `limits: [{...}, ...]`. Throws InputError, also for names that are not among `drives`.
[[nodiscard]] LimitsFile read_limits(const std::filesystem::path& path,
                                     const std::vector<std::string>& drives);

struct EstimateFacts {
  std::vector<std::string> inputs;  ///< what the estimator reads, of kInputs; empty: not known, perhaps all
  /// 95 % error [m] of the same estimator in the same drive without the fault; empty: that before the event.
  std::optional<double> without_fault_p95_m;
};
[[nodiscard]] Score score(const DriveFolder& drive, const Track& estimate, double recovered_m,
                          const EstimateFacts& facts = {});
/// "p95_m is 12.1, limit 10": metrics of a score that exceed the limits.
[[nodiscard]] std::vector<std::string> violations(const std::string& drive, const Score& score,
                                                  const std::vector<Limits>& limits);

struct Result {
  std::string drive, estimate;
  int edition = 1;  ///< of the drive
  Score score;
  std::vector<std::string> violations;  ///< of a user's estimate, or the reason why there is none
};
[[nodiscard]] std::string to_json(const std::vector<Result>& results);
[[nodiscard]] std::string to_junit(const std::vector<Result>& results);

/// The bound beyond which errors mislead, in reported deviations: exceeded with a probability of 1e-4.
[[nodiscard]] double misleading_bound();

/// Distance of an estimate from the truth, at its times, horizontally [m]; NaN without estimate.
[[nodiscard]] std::vector<double> errors_over_time(const DriveFolder& drive, const Track& estimate);

}  // namespace canyon::bench
