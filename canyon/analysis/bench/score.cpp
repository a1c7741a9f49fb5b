#include "canyon/analysis/bench/score.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::bench {
namespace {

namespace fs = std::filesystem;
constexpr double kSmallest_m2 = 1e-6;  // minimum variance: truth has a tenth of a millimetre
constexpr double kMoved_m = 10;        // distance after which a heading is observable
constexpr double kBefore_s = 5;        // interval in which an estimate is good, or lost
constexpr double kEnough_s = 30;       // of a drive before an event, for the estimate's usual error

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return values.empty() ? kNan : std::sqrt(sum / static_cast<double>(values.size()));
}

std::optional<double> mean_of(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// The displacement from one truth to another, `lag_s` later, minus that of the estimate.
double relative_error_m(const Track& truth, const std::vector<Eigen::Vector2d>& errors, double lag_s) {
  std::vector<double> values;
  std::size_t j = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    while (j < errors.size() && truth.time_s[j] < truth.time_s[i] + lag_s - 1e-6) ++j;
    if (j == errors.size()) break;
    const double difference = (errors[j] - errors[i]).norm();
    if (std::isfinite(difference)) values.push_back(difference);
  }
  return rms(values);
}

/// e' P^-1 e, with eigenvalues of P of at least kSmallest_m2; empty if P is not known.
std::optional<double> normalized_square(const Eigen::Vector2d& error, const Eigen::Matrix2d& covariance) {
  if (!covariance.allFinite()) return std::nullopt;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(covariance);
  const Eigen::Vector2d along = axes.eigenvectors().transpose() * error;
  return (along.array().square() / axes.eigenvalues().array().max(kSmallest_m2)).sum();
}

EventScore score_event(const DriveFolder& drive, const Event& event,
                       const std::vector<Eigen::Vector2d>& errors, double recovered_m,
                       const EstimateFacts& facts) {
  constexpr double kAfter_s = 5, kStays_s = 2, kFollowed_m = 2.5;
  EventScore result;
  result.event = event;
  const std::vector<double>& time_s = drive.truth.time_s;
  std::vector<double> fractions, before;
  std::size_t times = 0, known = 0, last = 0, good = 0;  // during it, with an estimate; before it
  for (std::size_t i = 0; i < time_s.size() && time_s[i] < event.start_s; ++i)
    if (std::isfinite(errors[i].norm())) before.push_back(errors[i].norm());
  const auto usual_m = facts.without_fault_p95_m || event.start_s < kEnough_s ? facts.without_fault_p95_m
                                                                              : quantile(before, 0.95);
  result.bound_m = std::max(recovered_m, usual_m.value_or(0));
  double good_since = kNan;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double t = time_s[i], error_m = errors[i].norm();
    if (t >= event.start_s - kBefore_s && t < event.start_s) {
      ++last;
      good += error_m < result.bound_m ? 1 : 0;
    }
    if (t < event.start_s) continue;
    if (t <= event.end_s + kAfter_s && std::isfinite(error_m))
      result.largest_m = std::max(result.largest_m.value_or(0), error_m);
    if (t <= event.end_s) {
      ++times;
      known += std::isfinite(error_m) ? 1 : 0;
      // Outliers of a second end at once: the errors during the event count, not only their mean.
      if (event.bias_m.norm() > kFollowed_m && std::isfinite(error_m))
        fractions.push_back(errors[i].dot(event.bias_m) / event.bias_m.squaredNorm());
      continue;
    }
    if (result.recovery_s) continue;
    if (!(error_m < result.bound_m))
      good_since = kNan;
    else if (std::isnan(good_since))
      good_since = t;
    if (t - good_since >= kStays_s) result.recovery_s = std::max(0.0, good_since - event.end_s);
  }
  result.over = event.end_s + kStays_s < time_s.back();
  const auto reads = [&](const std::string& input) {
    return std::count(facts.inputs.begin(), facts.inputs.end(), input) > 0;
  };
  if (!facts.inputs.empty() && !event.inputs.empty() &&
      std::none_of(event.inputs.begin(), event.inputs.end(), reads)) {
    result.state = EventState::NotRead;
    result.recovery_s.reset();
  } else if (times > 0 && known == 0) {
    result.state = EventState::Absent;
  } else if (last > 0 && good == 0) {
    result.state = EventState::Lost;
  } else if (result.over || event.start_s > time_s.front()) {
    result.followed = mean_of(fractions);
  }
  return result;
}

}  // namespace

std::vector<double> errors_over_time(const DriveFolder& drive, const Track& estimate) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < drive.truth.time_s.size(); ++i)
    errors.push_back(
        (point_at(estimate, drive.truth.time_s[i]).enu_m - drive.truth.enu_m[i]).head<2>().norm());
  return errors;
}

double misleading_bound() {
  static const double bound = std::sqrt(chi_square_quantile(1e-4, 2));
  return bound;
}

Score score(const DriveFolder& drive, const Track& estimate, double recovered_m, const EstimateFacts& facts) {
  static const double ellipse_95 = chi_square_quantile(0.05, 2);
  const double bound = misleading_bound();
  Score result;
  const Track& truth = drive.truth;
  std::vector<Eigen::Vector2d> errors;
  std::vector<double> known, squares, inside, beyond, headings;
  double diverged_since = kNan;
  bool moved = false;
  for (std::size_t i = 0; i < truth.time_s.size(); ++i) {
    const TrackPoint here = point_at(estimate, truth.time_s[i]);
    errors.emplace_back((here.enu_m - truth.enu_m[i]).head<2>());
    const double error_m = errors.back().norm();
    const double fix_m = (point_at(drive.fixes, truth.time_s[i]).enu_m - truth.enu_m[i]).head<2>().norm();
    if (!(fix_m < recovered_m && error_m >= recovered_m))
      diverged_since = kNan;
    else if (std::isnan(diverged_since))
      diverged_since = truth.time_s[i];
    else
      result.longest_divergence_s = std::max(result.longest_divergence_s, truth.time_s[i] - diverged_since);
    moved = moved || (truth.enu_m[i] - truth.enu_m[0]).norm() > kMoved_m;
    if (!std::isfinite(error_m)) continue;
    known.push_back(error_m);
    if (const auto square = normalized_square(errors.back(), here.covariance)) {
      squares.push_back(*square);
      inside.push_back(*square <= ellipse_95 ? 1 : 0);
      beyond.push_back(*square > bound * bound ? 1 : 0);
    }
    const double heading = std::remainder(here.heading_deg - truth.heading_deg[i], 360);
    if (moved && std::isfinite(heading)) headings.push_back(std::abs(heading));
  }
  const auto fraction = [&](std::ptrdiff_t count) {
    return static_cast<double>(count) / static_cast<double>(truth.time_s.size());
  };
  result.availability = fraction(std::ssize(known));
  for (std::size_t k = 0; k < kWithin_m.size(); ++k)
    result.within[k] =
        fraction(std::count_if(known.begin(), known.end(), [k](double e) { return e < kWithin_m[k]; }));
  result.p50_m = quantile(known, 0.5).value_or(kNan);
  result.p95_m = quantile(known, 0.95).value_or(kNan);
  result.largest_m = quantile(known, 1).value_or(kNan);
  result.rmse_m = rms(known);
  result.rpe_1s_m = relative_error_m(truth, errors, 1);
  result.rpe_10s_m = relative_error_m(truth, errors, 10);
  result.nees = mean_of(squares);
  result.within_95 = mean_of(inside);
  result.misleading = mean_of(beyond);
  result.heading_p95_deg = quantile(headings, 0.95);
  for (const Event& event : drive.events)
    result.events.push_back(score_event(drive, event, errors, recovered_m, facts));
  return result;
}

void visit(options::Visitor& v, LimitsFile& file) {
  constexpr options::Range kAny{0, 1e6};
  v.number({"recovered_m", "m", "an error below it is good"}, file.recovered_m, kAny);
  v.list("limits", file.limits, [&](Limits& each) {
    v.texts({"drives", "", "names to which these limits apply", "all"}, each.drives);
    v.number({"p50_m", "m", "largest median error"}, each.p50_m, kAny);
    v.number({"p95_m", "m", "largest 95 % error"}, each.p95_m, kAny);
    v.number({"largest_m", "m", "largest error"}, each.largest_m, kAny);
    v.number({"availability", "", "smallest fraction of times with an estimate"}, each.availability, {0, 1});
    v.number({"within_2m", "", "smallest fraction of times with an error below 2 m"}, each.within[0], {0, 1});
    v.number({"within_5m", "", "smallest fraction of times with an error below 5 m"}, each.within[1], {0, 1});
    v.number({"within_10m", "", "smallest fraction of times with an error below 10 m"}, each.within[2],
             {0, 1});
    v.number({"followed", "", "largest fraction of the fixes' error in the estimate during a fault"},
             each.followed, kAny);
    v.number({"recovery_s", "s", "longest time from a fault's end to a good estimate"}, each.recovery_s,
             kAny);
    v.number({"divergence_s", "s", "longest time with good fixes and a bad estimate"}, each.divergence_s,
             kAny);
    v.number({"within_95", "", "smallest fraction inside the reported 95 % ellipse"}, each.within_95, {0, 1});
  });
}

LimitsFile read_limits(const fs::path& path, const std::vector<std::string>& drives) {
  options::Document document;
  document.file = path.string();
  document.kind = "limits";
  document.page = "docs/bench.md";
  LimitsFile file;
  options::read_yaml(std::string(TextFile(path).text()), document, "it needs limits: [{p95_m: 10}]", file);
  for (const Limits& each : file.limits) {
    for (const std::string& name : each.drives) {
      if (std::count(drives.begin(), drives.end(), name) > 0) continue;
      throw InputError(path, 0, fmt::format("there is no drive '{}' in the bench", name),
                       did_you_mean(closest(name, drives), "make it, or remove it from the limits"));
    }
  }
  return file;
}

std::vector<std::string> violations(const std::string& drive, const Score& score,
                                    const std::vector<Limits>& limits) {
  std::vector<std::string> found;
  const auto check = [&](const std::string& what, double value, const std::optional<double>& limit,
                         bool least = false) {
    if (limit && !(least ? value >= *limit : value <= *limit))
      found.push_back(fmt::format("{} is {:.3g}, limit {:.3g}", what, value, *limit));
  };
  for (const Limits& each : limits) {
    if (!each.drives.empty() && std::count(each.drives.begin(), each.drives.end(), drive) == 0) continue;
    check("p50_m", score.p50_m, each.p50_m);
    check("p95_m", score.p95_m, each.p95_m);
    check("largest_m", score.largest_m, each.largest_m);
    check("availability", score.availability, each.availability, true);
    for (std::size_t k = 0; k < kWithin_m.size(); ++k)
      check(fmt::format("within_{}m", kWithin_m[k]), score.within[k], each.within[k], true);
    check("divergence_s", score.longest_divergence_s, each.divergence_s);
    if (each.within_95) check("within_95", score.within_95.value_or(0), each.within_95, true);
    for (const EventScore& event : score.events) {
      if (event.event.kind == "street" || event.state == EventState::NotRead) continue;
      if (event.followed) check("followed of '" + event.event.kind + "'", *event.followed, each.followed);
      if (each.followed && event.state != EventState::Scored)
        found.push_back(fmt::format("followed of '{}': {}", event.event.kind,
                                    event.state == EventState::Lost ? "the estimate is lost before it"
                                                                    : "there is no estimate during it"));
      if (!event.over) continue;
      check("recovery_s of '" + event.event.kind + "'",
            event.recovery_s.value_or(std::numeric_limits<double>::infinity()), each.recovery_s);
    }
  }
  return found;
}

std::string to_json(const std::vector<Result>& results) {
  constexpr const char* kStates[]{"scored", "not in the data that it reads", "lost before", "no estimate"};
  Json rows = Json::array();
  for (const Result& each : results) {
    const Score& s = each.score;
    Json events = Json::array();
    for (const EventScore& event : s.events)
      events.push_back(Json{{"kind", event.event.kind},
                            {"start_s", event.event.start_s},
                            {"end_s", event.event.end_s},
                            {"state", kStates[static_cast<int>(event.state)]},
                            {"followed", Json(event.followed)},
                            {"largest_m", Json(event.largest_m)},
                            {"recovered_below_m", event.bound_m},
                            {"recovery_s", Json(event.recovery_s)}});
    Json row{{"drive", each.drive},
             {"estimate", each.estimate},
             {"bench", each.edition},
             {"availability", s.availability},
             {"p50_m", s.p50_m},
             {"p95_m", s.p95_m},
             {"rmse_m", s.rmse_m},
             {"largest_m", s.largest_m},
             {"rpe_1s_m", s.rpe_1s_m},
             {"rpe_10s_m", s.rpe_10s_m},
             {"nees", Json(s.nees)},
             {"within_95", Json(s.within_95)},
             {"misleading", Json(s.misleading)},
             {"heading_p95_deg", Json(s.heading_p95_deg)},
             {"divergence_s", s.longest_divergence_s},
             {"events", events},
             {"violations", Json(each.violations)}};
    for (std::size_t k = 0; k < kWithin_m.size(); ++k)
      row[fmt::format("within_{}m", kWithin_m[k])] = s.within[k];
    rows.push_back(std::move(row));
  }
  return Json{{"bench", results.empty() ? 0 : results.front().edition}, {"results", rows}}.dump(1) + "\n";
}

std::string to_junit(const std::vector<Result>& results) {
  const auto failed =
      std::count_if(results.begin(), results.end(), [](const Result& r) { return !r.violations.empty(); });
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"canyon bench\" tests=\"{}\" "
      "failures=\"{}\">\n",
      results.size(), failed);
  for (const Result& each : results) {
    text += fmt::format("  <testcase classname=\"{}\" name=\"{}\"", xml_escaped(each.estimate),
                        xml_escaped(each.drive));
    if (each.violations.empty())
      text += "/>\n";
    else
      text += fmt::format(">\n    <failure message=\"{}\"/>\n  </testcase>\n",
                          xml_escaped(fmt::format("{}", fmt::join(each.violations, "; "))));
  }
  return text + "</testsuite>\n";
}

}  // namespace canyon::bench
