#include "canyon/analysis/validation/comparison_view.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/outputs/encoding/epoch_rows.hpp"
#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/probe.hpp"
#include "canyon/outputs/view/recorder.hpp"
#include "canyon/receiver/tracking/signal_lock.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::validation {

using namespace view;

namespace {

using Eigen::Vector3d;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
/// Only the direct path is known.
constexpr std::size_t kPathsKept = 1;

/// Key of the comparison in the header.
constexpr const char* kKey = "comparison";

/// A compared satellite as a receiver's observation; the excess is the predicted one.
receiver::SatelliteObservation observation_of(const ComparedSatellite& s, Side side) {
  receiver::SatelliteObservation seen;
  seen.id = s.id;
  seen.azimuth_rad = s.azimuth_rad;
  seen.elevation_rad = s.elevation_rad;
  seen.above_mask = true;
  seen.visibility = s.visibility;
  seen.excess_m = side == Side::Simulated && s.prediction ? s.prediction->excess_m : kNone;
  if (s.of(side).tracked) seen.lock = tracking::LockState::Tracking;
  seen.measurement.emplace().cn0_dbhz = s.of(side).cn0_dbhz;
  seen.pseudorange_error_m = s.of(side).error_m.value_or(kNone);
  return seen;
}

/// Root mean square of the added values; NaN without any.
class MeanSquare {
 public:
  void add(double value) {
    if (std::isnan(value)) return;
    sum_ += value * value;
    ++count_;
  }
  [[nodiscard]] double root() const { return count_ > 0 ? std::sqrt(sum_ / count_) : kNone; }
  [[nodiscard]] int count() const { return count_; }

 private:
  double sum_ = 0;
  int count_ = 0;
};

class ComparisonView {
 public:
  ComparisonView(const ComparisonInput& input, const std::filesystem::path& folder)
      : input_(input), comparison_(*input.comparison), folder_(folder) {
    for (const ComparedSatellite& s : comparison_.satellites) ids_.insert(s.id);
  }

  void write() {
    make_output_folder(folder_);
    header_.title = input_.title;
    header_.city = write_city(input_.environment->city(), {}, folder_);
    header_.begin = epoch(0).time;
    header_.interval_s = interval_of(std::span(comparison_.epochs).subspan(input_.first, input_.count));
    header_.paths_per_satellite = kPathsKept;
    header_.satellites.assign(ids_.begin(), ids_.end());
    const auto words = std::make_shared<encoding::ViewWords>();
    for (const Side side : kSides) add_receiver(side, words);
    header_.words = *words;
    write_header(header_, folder_);
    extend();
  }

 private:
  [[nodiscard]] const ComparedEpoch& epoch(std::size_t i) const {
    return comparison_.epochs[input_.first + i];
  }
  [[nodiscard]] double time_s(std::size_t i) const { return epoch(i).time - epoch(0).time; }
  [[nodiscard]] std::span<const ComparedSatellite> satellites(std::size_t i) const {
    return std::span(comparison_.satellites).subspan(epoch(i).first, epoch(i).count);
  }

  /// Velocity of the true position, from the previous to the next epoch.
  [[nodiscard]] Vector3d velocity(std::size_t i) const {
    const std::size_t before = i > 0 ? i - 1 : i, after = std::min(i + 1, input_.count - 1);
    const double step_s = time_s(after) - time_s(before);
    if (!(step_s > 0)) return Vector3d::Zero();
    return (epoch(after).position_enu_m - epoch(before).position_enu_m) / step_s;
  }

  void add_receiver(Side side, const std::shared_ptr<encoding::ViewWords>& words) {
    ReceiverHeader& receiver = header_.receivers.emplace_back();
    receiver.name = side == Side::Measured ? "recorded" : "simulated";
    receiver.strength = std::any_of(comparison_.satellites.begin(), comparison_.satellites.end(),
                                    [&](const auto& s) { return s.of(side).cn0_dbhz.has_value(); });
    receiver.elevation_mask_deg = input_.elevation_mask_deg;
    ViewOptions options;
    options.paths_per_satellite = kPathsKept;
    Recorder recorder(folder_, static_cast<std::size_t>(side), options, {}, input_.environment->scene(),
                      words);
    encoding::SummarySink summary(std::vector<std::string>(1));
    double yaw_rad = 0;
    for (std::size_t i = 0; i < input_.count; ++i) {
      const simulation::Epoch row = add_epoch(side, i, recorder, yaw_rad);
      summary.write(row);
      recorder.end_epoch({}, time_s(i));
    }
    receiver.summary = summary.summaries().front();
    recorder.finish(header_);
  }

  /// Adds an epoch and its satellites. @param yaw_rad of the previous epoch, then of this one
  simulation::Epoch add_epoch(Side side, std::size_t i, Recorder& recorder, double& yaw_rad) const {
    const ComparedEpoch& e = epoch(i);
    const ComparedFix& fix = e.fix.of(side);
    simulation::Epoch row;
    row.truth.velocity_enu_mps = velocity(i);
    // A stationary car keeps its last heading.
    const Vector3d& v = row.truth.velocity_enu_mps;
    if (v.head<2>().norm() > 0.5) yaw_rad = std::atan2(v.y(), v.x());
    row.truth.yaw_rad = yaw_rad;
    const auto list = satellites(i);
    receiver::ReceiverEpoch& seen = row.observed;
    seen.time = e.time;
    for (const ComparedSatellite& s : list) seen.satellites.push_back(observation_of(s, side));
    seen.visible = static_cast<int>(
        std::count_if(list.begin(), list.end(), [&](const auto& s) { return s.of(side).tracked; }));
    seen.blocked = static_cast<int>(list.size()) - seen.visible;
    encoding::EpochRows::ShownRow shown{time_s(i), recorder.skyline(e.position_enu_m), e.position_enu_m};
    add_satellites(side, i, recorder.rows(), seen);
    if (fix.solved) {
      seen.fix.status = positioning::FixStatus::Fix;
      seen.fix.used.resize(static_cast<std::size_t>(fix.used));  // only their number is known
      row.error_enu_m = fix.error_enu_m;
      shown.fix_m = e.position_enu_m + comparison_.registration.direction_in_city(fix.error_enu_m);
    }
    recorder.rows().add_epoch(row, shown);
    return row;
  }

  void add_satellites(Side side, std::size_t i, encoding::EpochRows& rows,
                      const receiver::ReceiverEpoch& seen) const {
    const simulation::Epoch epoch;  // without satellites
    const propagation::Path direct;
    const auto list = satellites(i);
    for (std::size_t k = 0; k < list.size(); ++k) {
      const ComparedSatellite& s = list[k];
      const encoding::Row row{epoch, &seen.satellites[k], &seen.satellites[k], &direct};
      if (s.clear) rows.add_path(row);
      rows.add_satellite(row, i, static_cast<std::size_t>(std::distance(ids_.begin(), ids_.find(s.id))),
                         encoding::kAboveMask | (s.used.of(side) ? encoding::kUsed : 0) |
                             (s.of(side).tracked ? encoding::kMeasured : 0),
                         s.clear ? 1 : 0);
    }
  }

  /// Length of the path between epochs of the view, [first, end).
  [[nodiscard]] double length_m(std::size_t first, std::size_t end) const {
    double length = 0;
    for (std::size_t i = first + 1; i < end; ++i)
      length += (epoch(i).position_enu_m - epoch(i - 1).position_enu_m).head<2>().norm();
    return length;
  }

  /// Adds the differences of both, and the streets.
  void extend() const {
    encoding::ViewRows rows(encoding::kViewComparison);
    for (std::size_t i = 0; i < input_.count; ++i) {
      MeanSquare recorded, simulated, difference;
      for (const ComparedSatellite& s : satellites(i)) {
        const double recorded_m = s.measured.error_m.value_or(kNone);
        const double simulated_m = s.simulated.error_m.value_or(kNone);
        recorded.add(recorded_m);
        simulated.add(simulated_m);
        difference.add(recorded_m - simulated_m);
      }
      rows.add(
          {recorded.root(), simulated.root(), difference.root(), static_cast<double>(difference.count())});
    }
    Json streets = Json::array();
    for (const StreetSegment& s : comparison_.segments) {
      const std::size_t from = std::max(s.first, input_.first);
      const std::size_t end = std::min(s.first + s.count, input_.first + input_.count);
      if (from >= end) continue;
      streets.push_back({{"from_s", time_s(from - input_.first)},
                         {"until_s", time_s(end - 1 - input_.first)},
                         {"length_m", length_m(from - input_.first, end - input_.first)},
                         {"heading_deg", s.heading_deg}});
    }
    const char* file = "comparison.bin.gz";
    const std::size_t bytes = encoding::write_chunk(folder_, file, {&rows});
    extend_header(folder_, kKey, {{"recorded", 0}, {"simulated", 1}, {"streets", std::move(streets)}},
                  Json::array({{{"file", file}, {"kind", "comparison"}, {"bytes", bytes}}}));
  }

  const ComparisonInput& input_;
  const Comparison& comparison_;
  const std::filesystem::path& folder_;
  std::set<gnss::SatelliteId> ids_;
  ViewHeader header_;
};

}  // namespace

void write_comparison(const ComparisonInput& input, const std::filesystem::path& folder) {
  assert(input.environment != nullptr && input.comparison != nullptr);
  assert(input.first + input.count <= input.comparison->epochs.size());
  if (input.count == 0)
    throw InputError("the comparison has no epoch", "give a longer part of the recording");
  ComparisonView(input, folder).write();
}

bool is_comparison(const std::filesystem::path& folder) {
  return read_header(folder).contains(kKey);
}

std::unique_ptr<Probe> comparison_probe(const std::filesystem::path& folder, simulation::Scenario scenario,
                                        std::shared_ptr<simulation::CityScene> scene,
                                        std::size_t paths_per_satellite) {
  const Json shown = read_header(folder);
  if (!shows_city(shown, scene->city)) {
    throw InputError(folder, 0, "shows a validation in another city than the scenario's",
                     "give the validated scenario");
  }
  geodesy::GpsTime begin;
  double interval_s = 0;
  try {
    const Json& time = shown.at("time");
    begin = geodesy::GpsTime::from_week(time.at("gps_week").get<int>(), time.at("gps_tow").get<double>());
    interval_s = time.at("interval_s").get<double>();
  } catch (const JsonError&) {
    throw InputError(folder / kHeaderFile, 0, "has no times", "write it again: canyon validate --view");
  }
  // The page requests receivers by number; both sides are compared with one model.
  scenario.receivers.resize(1);
  scenario.receivers.push_back(scenario.receivers.front());
  scenario.faults = {};  // as on the simulated side
  return std::make_unique<Probe>(scenario, begin, interval_s, std::move(scene), paths_per_satellite);
}

}  // namespace canyon::validation
