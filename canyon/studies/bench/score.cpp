#include "canyon/studies/bench/score.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/studies/bench/drives.hpp"

namespace canyon::bench {
namespace {

namespace fs = std::filesystem;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// An estimate is as old as this at most; a step between two is interpolated up to twice of it.
constexpr double kFresh_s = 0.5;
constexpr double kElsewhere_km = 1000;  // an estimate that begins there has other units
constexpr double kUnix_s = 1e8;         // larger times count from 1970

/// Columns of a CSV file; empty cells are NaN as numbers.
struct Table {
  fs::path path;
  std::map<std::string, std::size_t> names;
  std::vector<std::vector<std::string>> rows;
  std::vector<int> lines;

  [[nodiscard]] bool has(const std::string& name) const { return names.count(name) > 0; }
  [[nodiscard]] double at(std::size_t row, const std::string& name) const {
    const auto column = names.find(name);
    if (column == names.end()) return kNan;
    const std::string& text = rows[row][column->second];
    if (text.empty() || lower_case(text) == "nan") return kNan;
    if (const auto value = parse_double(text)) return *value;
    throw InputError(path, lines[row], fmt::format("'{}' in {} is no number", text, name),
                     "give a number, or nothing where none is known");
  }
};

Table read_table(const fs::path& path, const std::vector<std::string>& needed) {
  Table table;
  table.path = path;
  TextFile file(path);
  while (const auto line = file.next_line()) {
    if (trim(*line).empty() || line->starts_with('#')) continue;
    std::vector<std::string> cells;
    for (const std::string_view cell : split(*line, ',')) cells.emplace_back(trim(cell));
    if (table.names.empty()) {
      for (std::size_t i = 0; i < cells.size(); ++i) table.names[cells[i]] = i;
      for (const std::string& name : needed)
        if (!table.has(name))
          throw file.error(fmt::format("there is no column '{}'", name),
                           fmt::format("the header needs {}", fmt::join(needed, ", ")));
      continue;
    }
    if (cells.size() != table.names.size())
      throw file.error(fmt::format("{} fields under {} names", cells.size(), table.names.size()),
                       "give each row all of them; empty ones are unknown");
    table.rows.push_back(std::move(cells));
    table.lines.push_back(file.line());
  }
  if (table.rows.empty()) throw InputError(path, 0, "has no rows", "give a header, and a row for each time");
  return table;
}

/// The rows of a table as a track; rows without a place are left out.
Track track_of(const Table& table, const DriveFolder& drive) {
  Track track;
  const bool unix_times = table.has("unix_s");
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const auto fail = [&](const std::string& problem, const char* cure) {
      return InputError(table.path, table.lines[row], problem, cure);
    };
    const double stated_s = table.at(row, unix_times ? "unix_s" : "time_s");
    if (!std::isfinite(stated_s)) throw fail("the time is no number", "give seconds");
    const double time_s = stated_s > kUnix_s ? stated_s - drive.begin_unix_s : stated_s;
    if (!track.time_s.empty() && time_s <= track.time_s.back())
      throw fail(fmt::format("{:.3f} s does not come after {:.3f} s", time_s, track.time_s.back()),
                 "give rows in order of time, each time once");
    const double latitude = table.at(row, "latitude_deg"), longitude = table.at(row, "longitude_deg");
    if (std::isnan(latitude) || std::isnan(longitude)) continue;
    if (std::abs(latitude) > 90 || std::abs(longitude) > 360)
      throw fail("this is no latitude and longitude", "give degrees");
    const double height = table.at(row, "height_m");
    const auto place = geodesy::Geodetic::from_degrees(
        latitude, longitude, std::isnan(height) ? drive.frame.origin().height_m : height);
    track.time_s.push_back(time_s);
    track.enu_m.push_back(drive.frame.local_from_geodetic(place));
    if (const double away_km = track.enu_m.front().norm() / 1e3; away_km > kElsewhere_km)
      throw fail(fmt::format("the first place is {:.0f} km away from the drive", away_km),
                 "give degrees, latitude and longitude each in its column");
    if (std::isnan(height)) track.enu_m.back().z() = kNan;
    track.heading_deg.push_back(table.at(row, "heading_deg"));
    Eigen::Matrix2d& c = track.covariance.emplace_back();
    const double en = table.at(row, "cov_en_m2");
    c << table.at(row, "cov_ee_m2"), en, en, table.at(row, "cov_nn_m2");
  }
  return track;
}

Track read_tum(const fs::path& path, const DriveFolder& drive) {
  Track track;
  TextFile file(path);
  while (const auto line = file.next_line()) {
    if (trim(*line).empty() || line->starts_with('#')) continue;
    std::vector<double> v;
    for (const std::string_view cell : split_blanks(*line)) v.push_back(parse_double(cell).value_or(kNan));
    if (v.size() != 8 || !std::all_of(v.begin(), v.begin() + 4, [](double x) { return std::isfinite(x); }))
      throw file.error("is no line of TUM", "give stamp x y z qx qy qz qw, with blanks between");
    const double time_s = v[0] > kUnix_s ? v[0] - drive.begin_unix_s : v[0];
    if (!track.time_s.empty() && time_s <= track.time_s.back())
      throw file.error("the time does not rise", "give lines in order of time, each time once");
    track.time_s.push_back(time_s);
    track.enu_m.emplace_back(v[1], v[2], v[3]);
    const double yaw = std::atan2(2 * (v[7] * v[6] + v[4] * v[5]), 1 - 2 * (v[5] * v[5] + v[6] * v[6]));
    track.heading_deg.push_back(90 - geodesy::degrees(yaw));
    track.covariance.push_back(Eigen::Matrix2d::Constant(kNan));
  }
  if (track.time_s.empty()) throw InputError(path, 0, "has no line", "give stamp x y z qx qy qz qw");
  return track;
}

/// Place and covariance of an estimate at a time, between its neighbours; NaN where it has none.
struct At {
  Eigen::Vector3d place = Eigen::Vector3d::Constant(kNan);
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Constant(kNan);
  double heading_deg = kNan;
};
At at(const Track& track, double t) {
  At result;
  const auto next = std::lower_bound(track.time_s.begin(), track.time_s.end(), t);
  const auto i = static_cast<std::size_t>(next - track.time_s.begin());
  const bool has_next = next != track.time_s.end(), has_last = i > 0;
  const std::size_t nearest = !has_last || (has_next && *next - t < t - track.time_s[i - 1]) ? i : i - 1;
  if (track.time_s.empty() || std::abs(track.time_s[nearest] - t) > kFresh_s) return result;
  result.place = track.enu_m[nearest];
  result.covariance = track.covariance[nearest];
  result.heading_deg = track.heading_deg[nearest];
  if (!has_next || !has_last || *next - track.time_s[i - 1] > 2 * kFresh_s) return result;
  const double share = (t - track.time_s[i - 1]) / (*next - track.time_s[i - 1]);
  result.place = (1 - share) * track.enu_m[i - 1] + share * track.enu_m[i];
  return result;
}

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

/// The way from one truth to another, `steps` on, less that of the estimate.
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

EventScore score_event(const DriveFolder& drive, const Event& event,
                       const std::vector<Eigen::Vector2d>& errors, double recovered_m) {
  constexpr double kAfter_s = 5, kStays_s = 2, kFollowed_m = 2.5;
  EventScore result;
  result.event = event;
  const std::vector<double>& time_s = drive.truth.time_s;
  std::vector<double> shares;
  double good_since = kNan;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double t = time_s[i], error_m = errors[i].norm();
    if (t < event.start_s) continue;
    if (t <= event.end_s + kAfter_s && std::isfinite(error_m))
      result.largest_m = std::max(result.largest_m, error_m);
    // What the fixes do at the time is followed, not the mean alone: outliers of a second are over at once.
    if (t <= event.end_s && event.bias_m.norm() > kFollowed_m && std::isfinite(error_m))
      shares.push_back(errors[i].dot(event.bias_m) / event.bias_m.squaredNorm());
    if (t <= event.end_s || result.recovery_s) continue;
    if (!(error_m < recovered_m))
      good_since = kNan;
    else if (std::isnan(good_since))
      good_since = t;
    if (t - good_since >= kStays_s) result.recovery_s = std::max(0.0, good_since - event.end_s);
  }
  result.over = event.end_s + kStays_s < time_s.back();
  if (result.over || event.start_s > time_s.front()) result.followed = mean_of(shares);
  return result;
}

}  // namespace

std::vector<fs::path> drives_in(const fs::path& bench) {
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(bench, ignored))
    if (fs::exists(entry.path() / "card.yaml", ignored)) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  if (found.empty())
    throw InputError(bench, 0, "has no drives", "make them: canyon bench make " + bench.string());
  return found;
}

DriveFolder read_drive(const fs::path& folder) {
  DriveFolder drive;
  drive.folder = folder;
  drive.name = folder.filename().string();
  TextFile card(folder / "card.yaml");
  while (const auto line = card.next_line())
    if (line->starts_with("begin_unix_s: ")) drive.begin_unix_s = parse_double(line->substr(14)).value_or(0);
  const std::vector<std::string> place{"time_s", "latitude_deg", "longitude_deg", "height_m"};
  const Table truth = read_table(folder / "truth.csv", place);
  drive.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(
      truth.at(0, "latitude_deg"), truth.at(0, "longitude_deg"), truth.at(0, "height_m")));
  drive.truth = track_of(truth, drive);
  drive.fixes = track_of(read_table(folder / "fixes.csv", place), drive);
  TextFile events(folder / "events.csv");
  (void)events.next_line();
  while (const auto line = events.next_line()) {
    const auto cells = split(*line, ',');
    if (cells.size() < 7) throw events.error("has too few fields", "make the bench anew");
    const auto number = [&](std::size_t k) { return parse_double(cells[k]).value_or(kNan); };
    drive.events.push_back({number(0), number(1), std::string(cells[2]), {number(3), number(4)}});
  }
  return drive;
}

Track read_estimate(const fs::path& path, const DriveFolder& drive) {
  std::string first;
  {
    TextFile file(path);
    for (auto line = file.next_line(); line && first.empty(); line = file.next_line())
      if (!trim(*line).empty() && !line->starts_with('#')) first = *line;
  }
  if (first.find(',') == std::string::npos && split_blanks(first).size() == 8) return read_tum(path, drive);
  return track_of(read_table(path, {first.find("unix_s") == std::string::npos ? "time_s" : "unix_s",
                                    "latitude_deg", "longitude_deg"}),
                  drive);
}

std::pair<std::string, fs::path> named_file(const std::string& text, const std::string& option,
                                            const DriveFolder& drive) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw InputError(fmt::format("{} '{}' has no name", option, text),
                     "give NAME=FILE, such as mine=est/{drive}.csv");
  std::string file = text.substr(equals + 1);
  replace_all(file, "{drive}", drive.name);
  return {text.substr(0, equals), file};
}

Eigen::Vector3d place_at(const Track& track, double time_s) {
  return at(track, time_s).place;
}

std::vector<double> errors_over_time(const DriveFolder& drive, const Track& estimate) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < drive.truth.time_s.size(); ++i)
    errors.push_back((at(estimate, drive.truth.time_s[i]).place - drive.truth.enu_m[i]).head<2>().norm());
  return errors;
}

double misleading_bound() {
  static const double bound = std::sqrt(chi_square_quantile(1e-4, 2));
  return bound;
}

Score score(const DriveFolder& drive, const Track& estimate, double recovered_m) {
  static const double ellipse_95 = chi_square_quantile(0.05, 2);
  const double bound = misleading_bound();
  Score result;
  const Track& truth = drive.truth;
  std::vector<Eigen::Vector2d> errors;
  std::vector<double> known, squares, inside, beyond, headings;
  double diverged_since = kNan;
  for (std::size_t i = 0; i < truth.time_s.size(); ++i) {
    const At here = at(estimate, truth.time_s[i]);
    errors.emplace_back((here.place - truth.enu_m[i]).head<2>());
    const double error_m = errors.back().norm();
    const double fix_m = (at(drive.fixes, truth.time_s[i]).place - truth.enu_m[i]).head<2>().norm();
    if (fix_m < recovered_m && !(error_m < recovered_m)) {
      if (std::isnan(diverged_since)) diverged_since = truth.time_s[i];
      result.longest_divergence_s = std::max(result.longest_divergence_s, truth.time_s[i] - diverged_since);
    } else if (error_m < recovered_m) {
      diverged_since = kNan;
    }
    if (!std::isfinite(error_m)) continue;
    known.push_back(error_m);
    if (here.covariance.allFinite() && here.covariance.determinant() > 0) {
      squares.push_back(errors.back().dot(here.covariance.inverse() * errors.back()));
      inside.push_back(squares.back() <= ellipse_95 ? 1 : 0);
      beyond.push_back(squares.back() > bound * bound ? 1 : 0);
    }
    const double heading = std::remainder(here.heading_deg - truth.heading_deg[i], 360);
    if (std::isfinite(heading)) headings.push_back(std::abs(heading));
  }
  result.availability = static_cast<double>(known.size()) / static_cast<double>(truth.time_s.size());
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
    result.events.push_back(score_event(drive, event, errors, recovered_m));
  return result;
}

void visit(options::Visitor& v, LimitsFile& file) {
  constexpr options::Range kAny{0, 1e6};
  v.number({"recovered_m", "m", "an error below it is a good one"}, file.recovered_m, kAny);
  v.list("limits", file.limits, [&](Limits& each) {
    v.texts({"drives", "", "names that these limits are for", "all"}, each.drives);
    v.number({"p50_m", "m", "largest median error"}, each.p50_m, kAny);
    v.number({"p95_m", "m", "largest 95 % error"}, each.p95_m, kAny);
    v.number({"largest_m", "m", "largest error"}, each.largest_m, kAny);
    v.number({"availability", "", "smallest share of times with an estimate"}, each.availability, {0, 1});
    v.number({"followed", "", "largest share of the fixes' error that the estimate has in a fault"},
             each.followed, kAny);
    v.number({"recovery_s", "s", "longest time from a fault's end to a good estimate"}, each.recovery_s,
             kAny);
    v.number({"divergence_s", "s", "longest time with good fixes and no good estimate"}, each.divergence_s,
             kAny);
    v.number({"within_95", "", "smallest share inside the stated 95 % ellipse"}, each.within_95, {0, 1});
  });
}

LimitsFile read_limits(const fs::path& path) {
  options::Document document;
  document.file = path.string();
  document.kind = "limits";
  document.page = "docs/bench.md";
  LimitsFile file;
  options::read_yaml(std::string(TextFile(path).text()), document, "it needs limits: [{p95_m: 10}]", file);
  return file;
}

std::vector<std::string> violations(const std::string& drive, const Score& score,
                                    const std::vector<Limits>& limits) {
  std::vector<std::string> found;
  const auto check = [&](const char* what, double value, const std::optional<double>& limit,
                         bool least = false) {
    if (limit && !(least ? value >= *limit : value <= *limit))
      found.push_back(fmt::format("{} is {:.3g}, limit {:.3g}", what, value, *limit));
  };
  for (const Limits& each : limits) {
    if (!each.drives.empty() && std::count(each.drives.begin(), each.drives.end(), drive) == 0) continue;
    if (score.availability == 0) return {"there is no estimate"};
    check("p50_m", score.p50_m, each.p50_m);
    check("p95_m", score.p95_m, each.p95_m);
    check("largest_m", score.largest_m, each.largest_m);
    check("availability", score.availability, each.availability, true);
    check("divergence_s", score.longest_divergence_s, each.divergence_s);
    if (each.within_95) check("within_95", score.within_95.value_or(0), each.within_95, true);
    for (const EventScore& event : score.events) {
      if (event.event.kind == "street") continue;
      if (event.followed)
        check(("followed of '" + event.event.kind + "'").c_str(), *event.followed, each.followed);
      if (!event.over) continue;
      check(("recovery_s of '" + event.event.kind + "'").c_str(),
            event.recovery_s.value_or(std::numeric_limits<double>::infinity()), each.recovery_s);
    }
  }
  return found;
}

Json to_json(const std::vector<Result>& results) {
  Json rows = Json::array();
  for (const Result& each : results) {
    const Score& s = each.score;
    Json events = Json::array();
    for (const EventScore& event : s.events)
      events.push_back(Json{{"kind", event.event.kind},
                            {"start_s", event.event.start_s},
                            {"end_s", event.event.end_s},
                            {"followed", Json(event.followed)},
                            {"largest_m", event.largest_m},
                            {"recovery_s", Json(event.recovery_s)}});
    rows.push_back(Json{{"drive", each.drive},
                        {"estimate", each.estimate},
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
                        {"violations", Json(each.violations)}});
  }
  return Json{{"bench", catalogue().bench}, {"results", rows}};
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
