#include "canyon/analysis/bench/tracks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::bench {
namespace {

namespace fs = std::filesystem;
constexpr double kNear_s = 0.75;           // largest time difference at which a row is used
constexpr double kOutside_s = 0.1;         // the same before the first and after the last row
constexpr double kFar_m = 1e6;             // larger positions or heights have other units
constexpr double kUnix_s = 1e8;            // larger times count from 1970
constexpr double kRows_hz = 1000;          // maximum for an estimate
constexpr double kRounding_m2 = 1e-6;      // of covariances in files
constexpr double kGpsEpoch_s = 315964800;  // UNIX time of 1980-01-06
constexpr double kMaxLeap_s = 18;          // GPS minus UTC

enum Column { kTime, kUnix, kLatitude, kLongitude, kHeight, kHeading, kEe, kEn, kNn, kColumns };
constexpr std::array<const char*, kColumns> kNames{"time_s",        "unix_s",    "latitude_deg",
                                                   "longitude_deg", "height_m",  "heading_deg",
                                                   "cov_ee_m2",     "cov_en_m2", "cov_nn_m2"};
using Numbers = std::array<double, kColumns>;  // of a row; NaN: not given

/// Checks and collects the rows of a track.
class TrackBuilder {
 public:
  /// 0: the track is the drive's own
  TrackBuilder(const TextFile& file, double begin_unix_s, double duration_s)
      : file_(file), begin_unix_s_(begin_unix_s), duration_s_(duration_s) {}

  void add(double time_s, const Eigen::Vector3d& enu_m, const Numbers& row, const char* units) {
    if (!std::isfinite(time_s)) throw file_.error("the time is not a number", "give seconds");
    last_given_s_ = time_s;
    const double t = time_s > kUnix_s ? time_s - begin_unix_s_ : time_s;
    if (t <= last_s_)
      throw file_.error(fmt::format("{:.3f} s is not after {:.3f} s", t, last_s_),
                        "give rows in order of time, each time once");
    last_s_ = t;
    if (++rows_ > kRows_hz * (duration_s_ + 1) && duration_s_ > 0)
      throw file_.error(fmt::format("this is row {} of a drive of {:.0f} s", rows_, duration_s_),
                        "give at most 1000 rows for a second");
    if (!enu_m.head<2>().allFinite()) return;
    const double away_m = std::max(enu_m.head<2>().norm(), std::isnan(enu_m.z()) ? 0 : std::abs(enu_m.z()));
    if (!(away_m < kFar_m))
      throw file_.error(fmt::format("the position is {:.4g} km from the drive's begin", away_m / 1e3), units);
    inside_ += t >= -1 && t <= duration_s_ + 1 ? 1 : 0;
    track_.time_s.push_back(t);
    track_.enu_m.push_back(enu_m);
    track_.heading_deg.push_back(row[kHeading]);
    track_.covariance.push_back(covariance(row));
  }

  [[nodiscard]] Track take() {
    if (rows_ == 0) throw InputError(file_.path(), 0, "has no rows", "give a row for each time");
    if (duration_s_ > 0 && 2 * inside_ < track_.time_s.size())
      throw InputError(
          file_.path(), 0,
          fmt::format("{} of {} times are outside the drive, which lasts {:.1f} s; the last is {:.3f}",
                      track_.time_s.size() - inside_, track_.time_s.size(), duration_s_, last_given_s_),
          hint(last_given_s_));
    return std::move(track_);
  }

 private:
  [[nodiscard]] Eigen::Matrix2d covariance(const Numbers& row) const {
    const double ee = row[kEe], nn = row[kNn];
    const double en = std::isnan(row[kEn]) ? 0 : row[kEn];
    if (std::isnan(ee) && std::isnan(nn)) return Eigen::Matrix2d::Constant(kNan);
    if (std::isnan(ee + nn))
      throw file_.error("one variance of east and north is missing", "give cov_ee_m2 and cov_nn_m2");
    const double smaller = (ee + nn) / 2 - std::hypot((ee - nn) / 2, en);
    if (!(smaller >= -kRounding_m2 * (1 + ee + nn)))
      throw file_.error(
          fmt::format("the covariance is not positive semidefinite: ee {:g}, en {:g}, nn {:g}", ee, en, nn),
          "give variances and the covariance in m^2");
    return (Eigen::Matrix2d() << ee, en, en, nn).finished();
  }

  /// The likely unit of times outside the drive. @param t the last of them, as in the file
  [[nodiscard]] std::string hint(double t) const {
    const auto inside = [&](double time_s) { return time_s > -1 && time_s < duration_s_ + 1; };
    if (inside(t + kGpsEpoch_s - kMaxLeap_s - begin_unix_s_) || inside(t + kGpsEpoch_s - begin_unix_s_))
      return "they seem to be GPS seconds: give UNIX time, or seconds since the drive's begin";
    for (const auto& [unit, scale] :
         {std::pair("milliseconds", 1e-3), std::pair("microseconds", 1e-6), std::pair("nanoseconds", 1e-9)})
      if (t > duration_s_ && (inside(t * scale) || inside(t * scale - begin_unix_s_)))
        return fmt::format("they seem to be {}: give seconds", unit);
    return fmt::format("give seconds since the drive's begin, or UNIX time (it begins at {:.3f})",
                       begin_unix_s_);
  }

  const TextFile& file_;
  double begin_unix_s_, duration_s_, last_s_ = -std::numeric_limits<double>::infinity();
  double last_given_s_ = 0;  // as in the file
  std::size_t rows_ = 0, inside_ = 0;
  Track track_;
};

/// A cell as a number; NaN if it is empty.
double number_of(const TextFile& file, std::string_view cell, const char* name) {
  const std::string_view text = trim(cell);
  if (text.empty() || lower_case(text) == "nan") return kNan;
  const auto value = parse_double(text);
  if (!value || !std::isfinite(*value))
    throw file.error(fmt::format("'{}' in {} is not a number", text, name),
                     "give a number, or nothing if unknown");
  return *value;
}

bool is_blank(std::string_view line) {
  return trim(line).empty() || line.starts_with('#');
}

/// A CSV file. @param frame empty: set to the frame of the first row
Track read_csv(const fs::path& path, double begin_unix_s, double duration_s,
               std::optional<geodesy::LocalFrame>& frame) {
  TextFile file = TextFile::streamed(path);
  std::vector<std::string> head;
  std::array<std::optional<std::size_t>, kColumns> columns;
  TrackBuilder track(file, begin_unix_s, duration_s);
  while (const auto line = file.next_line()) {
    if (is_blank(*line)) continue;
    const auto cells = split(*line, ',');
    if (head.empty()) {
      for (const std::string_view cell : cells) head.emplace_back(trim(cell));
      for (std::size_t k = 0; k < kColumns; ++k) {
        const auto found = std::find(head.begin(), head.end(), kNames[k]);
        if (found != head.end()) columns[k] = found - head.begin();
        if (found != head.end() && std::count(found, head.end(), kNames[k]) > 1)
          throw file.error(fmt::format("there are two columns '{}'", kNames[k]), "give each once");
        const bool needed = k == kTime ? std::count(head.begin(), head.end(), kNames[kUnix]) == 0
                                       : k == kLatitude || k == kLongitude;
        if (needed && !columns[k])
          throw file.error(fmt::format("there is no column '{}'", kNames[k]),
                           "the header needs time_s or unix_s, latitude_deg, longitude_deg");
      }
      continue;
    }
    if (cells.size() != head.size())
      throw file.error(fmt::format("{} fields under {} names", cells.size(), head.size()),
                       "give all fields in each row; empty ones are unknown");
    Numbers row;
    for (std::size_t k = 0; k < kColumns; ++k)
      row[k] = columns[k] ? number_of(file, cells[*columns[k]], kNames[k]) : kNan;
    if (std::abs(row[kLatitude]) > 90 || std::abs(row[kLongitude]) > 360)
      throw file.error("this is not a latitude and longitude", "give degrees");
    Eigen::Vector3d enu_m = Eigen::Vector3d::Constant(kNan);
    if (!std::isnan(row[kLatitude] + row[kLongitude])) {
      if (!frame)
        frame.emplace(geodesy::Geodetic::from_degrees(row[kLatitude], row[kLongitude], row[kHeight]));
      const bool flat = std::isnan(row[kHeight]);
      enu_m = frame->local_from_geodetic(geodesy::Geodetic::from_degrees(
          row[kLatitude], row[kLongitude], flat ? frame->origin().height_m : row[kHeight]));
      if (flat) enu_m.z() = kNan;
    }
    track.add(columns[kUnix] ? row[kUnix] : row[kTime], enu_m, row,
              "give degrees and metres, each in its column");
  }
  return track.take();
}

Track read_tum(const fs::path& path, double begin_unix_s, double duration_s) {
  TextFile file = TextFile::streamed(path);
  TrackBuilder track(file, begin_unix_s, duration_s);
  while (const auto line = file.next_line()) {
    if (is_blank(*line)) continue;
    std::vector<double> v;
    for (const std::string_view cell : split_blanks(*line)) v.push_back(parse_double(cell).value_or(kNan));
    if (v.size() != 8 || !std::all_of(v.begin(), v.begin() + 4, [](double x) { return std::isfinite(x); }))
      throw file.error("is not a line of TUM", "give stamp x y z qx qy qz qw, with blanks between");
    Numbers row;
    row.fill(kNan);
    row[kHeading] = 90 - geodesy::degrees(std::atan2(2 * (v[7] * v[6] + v[4] * v[5]),
                                                     1 - 2 * (v[5] * v[5] + v[6] * v[6])));
    track.add(v[0], {v[1], v[2], v[3]}, row, "give metres east, north and up of the first row of truth.csv");
  }
  return track.take();
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
  bool has_begin = false;
  while (const auto line = card.next_line()) {
    const std::size_t colon = std::min(line->find(": "), line->size());
    const std::string_view key = line->substr(0, colon),
                           value = trim(line->substr(std::min(colon + 1, line->size())));
    const auto number = parse_double(value);
    if ((key == "begin_unix_s" || key == "bench") && !number)
      throw card.error(fmt::format("{} '{}' is not a number", key, value), "make the bench again");
    if (key == "begin_unix_s") has_begin = true, drive.begin_unix_s = *number;
    if (key == "bench") drive.edition = static_cast<int>(*number);
    if (key == "without_fault") drive.without_fault = value;
  }
  if (!has_begin) throw InputError(card.path(), 0, "there is no begin_unix_s", "make the bench again");
  std::optional<geodesy::LocalFrame> frame;
  drive.truth = read_csv(folder / "truth.csv", drive.begin_unix_s, 0, frame);
  drive.fixes = read_csv(folder / "fixes.csv", drive.begin_unix_s, 0, frame);
  drive.frame = *frame;
  TextFile events(folder / "events.csv");
  (void)events.next_line();
  while (const auto line = events.next_line()) {
    const auto cells = split(*line, ',');
    if (cells.size() < 7) throw events.error("has too few fields", "make the bench again");
    const auto number = [&](std::size_t k) { return number_of(events, cells[k], "a time or error"); };
    Event& event = drive.events.emplace_back(
        Event{number(0), number(1), std::string(cells[2]), {number(3), number(4)}, {}});
    if (cells.size() > 7)
      for (const std::string_view input : split_blanks(cells[7])) event.inputs.emplace_back(input);
  }
  return drive;
}

Track read_estimate(const fs::path& path, const DriveFolder& drive) {
  const double duration_s = drive.truth.time_s.back();
  {
    TextFile file = TextFile::streamed(path);
    auto line = file.next_line();
    while (line && is_blank(*line)) line = file.next_line();
    if (line && line->find(',') == std::string::npos && split_blanks(*line).size() == 8)
      return read_tum(path, drive.begin_unix_s, duration_s);
  }
  std::optional<geodesy::LocalFrame> frame = drive.frame;
  return read_csv(path, drive.begin_unix_s, duration_s, frame);
}

std::string filled(const std::string& text, const std::map<std::string, std::string>& values) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text[at] == '{' ? text.find('}', at) : std::string::npos;
    const auto value =
        end == std::string::npos ? values.end() : values.find(text.substr(at + 1, end - at - 1));
    result += value == values.end() ? std::string(1, text[at]) : value->second;
    at = value == values.end() ? at + 1 : end + 1;
  }
  return result;
}

void check_estimate_name(const std::string& name, const std::string& option) {
  const bool clean =
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.") ==
      std::string::npos;
  if (name.empty() || name.front() == '.' || !clean)
    throw InputError(fmt::format("{}: '{}' is not a valid name", option, name),
                     "give letters, digits, '-', '_' and '.'");
}

NamedFile named_file(const std::string& text, const std::string& option) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw InputError(fmt::format("{} '{}' has no name", option, text),
                     "give NAME=FILE, such as mine=est/{drive}.csv");
  check_estimate_name(text.substr(0, equals), option);
  return {text.substr(0, equals), text.substr(equals + 1)};
}

TrackPoint point_at(const Track& track, double t) {
  TrackPoint result;
  const auto row = [&](std::size_t i) {
    return TrackPoint{track.enu_m[i], track.covariance[i], track.heading_deg[i]};
  };
  if (track.time_s.empty()) return result;
  if (t <= track.time_s.front()) return t >= track.time_s.front() - kOutside_s ? row(0) : result;
  const std::size_t last = track.time_s.size() - 1;
  if (t >= track.time_s[last]) return t <= track.time_s[last] + kOutside_s ? row(last) : result;
  const auto next = std::upper_bound(track.time_s.begin(), track.time_s.end(), t);
  const auto i = static_cast<std::size_t>(next - track.time_s.begin());
  const double before_s = t - track.time_s[i - 1], after_s = *next - t;
  if (std::min(before_s, after_s) > kNear_s) return result;
  const double w = before_s / (before_s + after_s);
  const TrackPoint a = row(i - 1), b = row(i), &nearest = w < 0.5 ? a : b;
  result.enu_m = (1 - w) * a.enu_m + w * b.enu_m;
  const Eigen::Matrix2d covariance = (1 - w) * a.covariance + w * b.covariance;
  result.covariance = covariance.allFinite() ? covariance : nearest.covariance;
  const double heading_deg = a.heading_deg + w * std::remainder(b.heading_deg - a.heading_deg, 360);
  result.heading_deg = std::isfinite(heading_deg) ? heading_deg : nearest.heading_deg;
  return result;
}

}  // namespace canyon::bench
