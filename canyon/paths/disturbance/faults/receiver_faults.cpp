#include "canyon/paths/disturbance/faults/receiver_faults.hpp"

#include <array>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::disturbance {
namespace {

double ratio(double db) {
  return std::pow(10, db / 10);
}

}  // namespace

void visit(options::Visitor& v, OscillatorOptions& o) {
  v.number({"jump_s", "s", "offset of the receiver's clock during the fault"}, o.jump_s, {-0.1, 0.1});
  v.number({"drift", "s/s", "offset of the clock's drift during the fault"}, o.drift, {-1e-4, 1e-4});
}

void OscillatorFault::happen(const propagation::Antenna& antenna, ReceiverEvents& events) {
  events.clock_bias_s += options_.jump_s + options_.drift * (antenna.time - begin_);
  events.clock_drift += options_.drift;
}

void DateOptions::validate() const {
  options::check(*this, "date fault");
  if (weeks == 0 && utc_s == 0)
    throw InputError("nothing is wrong with the date", "give weeks (-1024) or utc_s (1)");
}

void visit(options::Visitor& v, DateOptions& o) {
  v.integer({"weeks", "weeks", "error of the reported date: -1024 after an unhandled rollover"}, o.weeks,
            -2048, 2048);
  v.integer({"utc_s", "s", "error of the reported UTC: 1 for a leap second that was not inserted"}, o.utc_s,
            -60, 60);
}

void DateFault::happen(const propagation::Antenna& /*antenna*/, ReceiverEvents& events) {
  events.weeks_off += options_.weeks;
  events.utc_off_s += options_.utc_s;
}

void AntennaFaultOptions::validate() const {
  options::check(*this, "antenna fault");
  if (elevation_from_rad > elevation_to_rad)
    throw InputError("elevation_from_deg is above elevation_to_deg", "swap them");
  if (period_s > 0 && on_s > period_s)
    throw InputError("on_s is longer than period_s", "give at most the period");
}

void visit(options::Visitor& v, AntennaFaultOptions& o) {
  static constexpr std::string_view kStages[]{"before", "after", "behind"};
  v.angle({"azimuth_from_deg", "deg", "beginning of the sector, clockwise"}, o.azimuth_from_rad, {0, 360});
  v.angle({"azimuth_to_deg", "deg", "end of the sector; the sector may contain north"}, o.azimuth_to_rad,
          {0, 360});
  v.angle({"elevation_from_deg", "deg",
           "lower edge of the sector; reflections also arrive from below the horizon"},
          o.elevation_from_rad, {-90, 90});
  v.angle({"elevation_to_deg", "deg", "upper edge of the sector"}, o.elevation_to_rad, {-90, 90});
  v.number({"loss_db", "dB", "loss of signals from the sector; none: nothing is received"}, o.loss_db,
           options::or_none({0, std::numeric_limits<double>::infinity()}));
  v.choice({"stage", "",
            "before the antenna's amplifier (C/N0 falls by the loss) or after it (by Friis' formula); "
            "behind: the same as after"},
           o.stage, kStages);
  if (o.stage == AntennaStage::Behind) o.stage = AntennaStage::After;
  v.number({"period_s", "s", "period of a loose contact; 0: permanent"}, o.period_s, {0, 1e6});
  v.number({"on_s", "s", "duration of the loss in each period"}, o.on_s, {0, 1e6});
}

double AntennaFaultOptions::cn0_loss_db() const {
  if (stage == AntennaStage::Before || std::isinf(loss_db)) return loss_db;
  // Assumed: active antennas have gains of 15 to 40 and noise figures of 0.8 to 2.5, receivers 2 to 6.
  constexpr double kAmplifierGain_db = 27, kAmplifierNoise_db = 1.5, kReceiverNoise_db = 3;
  const auto noise = [&](double loss) {
    return ratio(kAmplifierNoise_db) + (loss * ratio(kReceiverNoise_db) - 1) / ratio(kAmplifierGain_db);
  };
  return 10 * std::log10(noise(ratio(loss_db)) / noise(1));
}

bool AntennaFault::concerns(const Eigen::Vector3d& direction) const {
  const geodesy::AzimuthElevation look_angles = geodesy::azimuth_elevation_from_enu(direction);
  if (look_angles.elevation_rad < options_.elevation_from_rad ||
      look_angles.elevation_rad > options_.elevation_to_rad)
    return false;
  constexpr double kTwoPi = 2 * geodesy::kPi;
  const auto clockwise = [](double from, double to) {
    const double angle = std::fmod(to - from, kTwoPi);
    return angle < 0 ? angle + kTwoPi : angle;
  };
  const double width = options_.azimuth_to_rad - options_.azimuth_from_rad;
  if (std::abs(width) >= kTwoPi) return true;
  return clockwise(options_.azimuth_from_rad, look_angles.azimuth_rad) <=
         clockwise(options_.azimuth_from_rad, options_.azimuth_to_rad);
}

void AntennaFault::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  if (options_.period_s > 0 && std::fmod(antenna.time - begin_, options_.period_s) >= options_.on_s) return;
  const double loss_db = options_.cn0_loss_db();
  const double amplitude = std::pow(10, -loss_db / 20);
  // The receiver's own noise stays; all signals that the antenna receives weaken equally.
  for (propagation::Interference& wave : arrival.interference)
    if (concerns(wave.arrival)) wave.power_dbw -= loss_db;
  for (propagation::SatelliteView& view : arrival.views) {
    const Eigen::Vector3d direct =
        geodesy::enu_from_azimuth_elevation(view.line.azimuth_rad, view.line.elevation_rad);
    std::vector<propagation::Path>& paths = view.paths.paths;
    const auto concerned = [&](const propagation::Path& path) {
      return concerns(path.kind == propagation::PathKind::Direct ? direct : path.arrival);
    };
    if (std::isinf(loss_db)) {
      std::erase_if(paths, concerned);
      continue;
    }
    for (propagation::Path& path : paths)
      if (concerned(path)) path.amplitude_factor *= amplitude;
  }
}

namespace {

struct RestartTimes {
  double search_s, ephemeris_s;
};
constexpr std::array<RestartTimes, 3> kUsual{{{1, 0}, {1, 19}, {2, 24}}};
constexpr std::string_view kRestartNames[]{"hot", "warm", "cold"};

}  // namespace

std::string_view name(RestartKind kind) {
  return kRestartNames[static_cast<std::size_t>(kind)];
}

double RestartOptions::duration_s() const {
  const RestartTimes& usual = kUsual[static_cast<std::size_t>(kind)];
  return search_s.value_or(usual.search_s) + ephemeris_s.value_or(usual.ephemeris_s);
}

void visit(options::Visitor& v, RestartOptions& o) {
  v.choice({"kind", "",
            "what the receiver keeps: hot (all), warm (time and position, no ephemerides), cold (nothing)"},
           o.kind, kRestartNames);
  v.number({"search_s", "s", "time until signals are measured again", "by the receiver's profile"},
           o.search_s, {0, 1e4});
  v.number({"ephemeris_s", "s", "additional time until the ephemeris of each satellite is read",
            "by the satellites' message schedule"},
           o.ephemeris_s, {0, 1e4});
}

RestartFault::RestartFault(const RestartOptions& options, const FaultContext& context)
    : restart_{context.begin, options.kind, options.search_s, options.ephemeris_s} {}

void RestartFault::happen(const propagation::Antenna& /*antenna*/, ReceiverEvents& events) {
  events.restart = restart_;
}

void visit(options::Visitor& v, ForceOptions& o) {
  static constexpr std::string_view kFixes[]{"none", "single", "differential", "float", "fixed"};
  v.require("fix", "give fix: none, single, differential, float or fixed");
  v.choice({"fix", "", "reported kind of fix, independent of the measurements"}, o.fix, kFixes);
  v.number(
      {"horizontal_m", "m", "reported and actual standard deviation of its position, east and north each",
       "single 1, differential 0.5, float 0.2, fixed 0.01"},
      o.horizontal_m, {0, 1000, true});
  v.number({"vertical_m", "m", "the same of its height", "single 2, differential 1, float 0.4, fixed 0.02"},
           o.vertical_m, {0, 1000, true});
}

ForceFault::ForceFault(const ForceOptions& options, const FaultContext& context)
    : stream_(context.seed, context.receiver + "/force/" + context.name) {
  // Assumed: the order of modules' reported accuracy under an open sky: horizontal, vertical, velocity.
  constexpr std::array<std::array<double, 2>, 5> kUsual_m{
      {{0, 0}, {1, 2}, {0.5, 1}, {0.2, 0.4}, {0.01, 0.02}}};
  constexpr double kVelocity_mps = 0.05;
  const auto& [horizontal_m, vertical_m] = kUsual_m.at(static_cast<std::size_t>(options.fix));
  const double axis_m = options.horizontal_m.value_or(horizontal_m);
  forced_.kind = options.fix;
  forced_.sigma_m = {axis_m, axis_m, options.vertical_m.value_or(vertical_m)};
  forced_.velocity_sigma_mps.setConstant(kVelocity_mps);
}

void ForceFault::happen(const propagation::Antenna& antenna, ReceiverEvents& events) {
  constexpr double kCorrelation_s = 60;
  const double kept = last_ ? std::exp(-(antenna.time - *last_) / kCorrelation_s) : 0;
  last_ = antenna.time;
  for (Eigen::Index i = 0; i < 3; ++i) {
    double& error_m = forced_.error_m[i];
    error_m = kept * error_m + std::sqrt(1 - kept * kept) * forced_.sigma_m[i] * stream_.normal();
    forced_.velocity_error_mps[i] = forced_.velocity_sigma_mps[i] * stream_.normal();
  }
  events.forced = forced_;
}

void visit(options::Visitor& v, FixFaultOptions& o) {
  static constexpr std::string_view kStates[]{"own", "single", "differential", "float", "fixed"};
  constexpr options::Range kMetres{-1e6, 1e6};
  v.boolean({"stuck", "", "the fix at the fault's begin is reported again and again, with fresh timestamps"},
            o.stuck);
  v.number({"late_s", "s", "age of the reported fix, which has fresh timestamps"}, o.late_s, {0, 1e4});
  v.integer({"repeat", "", "number of times that each fix is reported"}, o.repeat, 1, 1'000'000);
  v.number({"drop_fraction", "", "fraction of epochs without a fix, at random"}, o.drop, {0, 1});
  v.former_name("drop", "drop_fraction");
  v.number({"east_m", "m", "added to the position"}, o.east_m, kMetres);
  v.number({"north_m", "m", "added to the position"}, o.north_m, kMetres);
  v.number({"up_m", "m", "added to the position"}, o.up_m, kMetres);
  v.number({"forward_m", "m", "added along the direction of travel, as by a wrong lever arm"}, o.forward_m,
           kMetres);
  v.number({"growth_s", "s", "time over which the offset grows to its full value; 0: at once"}, o.growth_s,
           {0, 1e6});
  v.choice({"state", "", "reported kind of fix"}, o.state, kStates);
  v.number({"accuracy_m", "m", "reported standard deviation of each axis; 0: none", "its own"}, o.accuracy_m,
           {0, 1e6});
  v.number({"accuracy_factor", "", "of the reported standard deviations"}, o.accuracy_factor,
           {0, 1000, true});
  v.number({"after_outage_s", "s", "active only for this time after each outage of fixes of 2 s or more",
            "always"},
           o.after_outage_s, {0, 1e6, true});
  v.boolean({"without_satellites", "", "reports 0 satellites"}, o.without_satellites);
}

FixFault::FixFault(const FixFaultOptions& options, const FaultContext& context)
    : options_(options),
      begin_(context.begin),
      repeated_(context.begin),
      stream_(context.seed, context.receiver + "/fix/" + context.name) {}

void FixFault::happen(const propagation::Antenna& antenna, ReceiverEvents& events) {
  FixEdit edit;
  if (times_ == 0) repeated_ = antenna.time;
  times_ = (times_ + 1) % options_.repeat;
  edit.first = options_.stuck;
  if (options_.stuck)
    edit.of = begin_;
  else if (options_.late_s > 0)
    edit.of = antenna.time - options_.late_s;
  else if (options_.repeat > 1)
    edit.of = repeated_;
  const double grown = options_.growth_s > 0 ? std::min(1.0, (antenna.time - begin_) / options_.growth_s) : 1;
  // A stationary antenna keeps the last direction.
  const Eigen::Vector3d along =
      geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(antenna.position_ecef)) *
      antenna.velocity_ecef;
  if (along.head<2>().norm() > 0.1) forward_ = along.head<2>().normalized();
  edit.offset_m = grown * Eigen::Vector3d(options_.east_m, options_.north_m, options_.up_m);
  edit.offset_m.head<2>() += grown * options_.forward_m * forward_;
  if (options_.state != gnss::FixKind::None) edit.kind = options_.state;
  edit.sigma_m = options_.accuracy_m;
  edit.sigma_factor = options_.accuracy_factor;
  edit.after_outage_s = options_.after_outage_s;
  edit.without_satellites = options_.without_satellites;
  edit.dropped = options_.drop > 0 && stream_.uniform() < options_.drop;
  events.fix_edits.push_back(edit);
}

}  // namespace canyon::disturbance
