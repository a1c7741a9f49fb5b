#include "canyon/paths/disturbance/faults/spoofing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/sky/gnss/signal_groups.hpp"

namespace canyon::disturbance {
namespace {

using Eigen::Vector3d;
using geodesy::kSpeedOfLight;

}  // namespace

PullOffOptions::Progress PullOffOptions::progress(double seconds, double target_m) const {
  const double t = seconds - hold_s;
  if (!(t > 0) || !(target_m > 0)) return {};
  Progress now{rate_mps * t, rate_mps};
  if (acceleration_mps2 > 0) {
    const double until_s = rate_mps / acceleration_mps2;
    now = t < until_s ? Progress{acceleration_mps2 * t * t / 2, acceleration_mps2 * t}
                      : Progress{rate_mps * (t - until_s / 2), rate_mps};
  }
  return now.travelled_m < target_m ? now : Progress{target_m, 0};
}

void visit(options::Visitor& v, PullOffOptions& o) {
  v.number({"hold_s", "s", "time before the pull-off begins"}, o.hold_s, {0, 1e5});
  v.number({"rate_mps", "m/s", "rate at which position and clock move"}, o.rate_mps, {0, 1e4, true});
  v.number({"acceleration_mps2", "m/s^2", "acceleration to that rate; 0: at once"}, o.acceleration_mps2,
           {0, 1e3});
  v.number({"east_m", "m", "final position: east of the one shown before"}, o.east_m, {-1e6, 1e6});
  v.number({"north_m", "m", "final position: north of the one shown before"}, o.north_m, {-1e6, 1e6});
  v.number({"up_m", "m", "final position: above the one shown before"}, o.up_m, {-1e6, 1e6});
  v.number({"clock_m", "m", "final delay of all codes"}, o.clock_m, {-1e6, 1e6});
}

void SpoofingOptions::validate() const {
  options::check(*this, "spoofer");
  transmitter.validate();
  shows.validate();
  options::check(pull_off, "pull-off");
  gnss::check_signals(signals);
  if (kind == Kind::Meaconing && delay_s < 0)
    throw InputError(fmt::format("a repeater has a delay of {} s", delay_s), "give 0 s or more");
  check_satellites(satellites);
}

void visit(options::Visitor& v, SpoofingOptions& o) {
  static constexpr std::string_view kKinds[]{"simulated", "meaconing"};
  static constexpr std::string_view kCarriers[]{"follows_code", "held"};
  visit(v, o.transmitter);
  v.choice({"kind", "",
            "simulated (signals of another position and time) or meaconing (repeats received signals)"},
           o.kind, kKinds);
  if (v.wants(v.reads() || o.shows.given())) v.part("shows", o.shows);
  v.part("pull_off", o.pull_off);
  v.choice({"carrier", "", "carrier during the pull-off: follows_code, or held (does not move)"}, o.carrier,
           kCarriers);
  v.number({"delay_s", "s", "delay of all codes; for meaconing the repeater's delay"}, o.delay_s,
           {-0.01, 0.01});
  v.number({"advantage_db", "dB",
            "power of each signal above the true one's in a clear line of sight, before the receiver's "
            "antenna, with the transmitter in line of sight"},
           o.advantage_db, {-50, 80});
  v.number({"power_dbm", "dBm", "isotropically radiated power of each signal, instead of advantage_db",
            "by advantage_db"},
           o.power_dbm, {-200, 60});
  v.number({"ramp_s", "s", "time over which the power rises at the beginning"}, o.ramp_s, {0, 1e5});
  v.number({"ramp_from_db", "dB", "power at the beginning, below full power"}, o.ramp_from_db, {0, 100});
  visit_satellites(v, o.satellites);
  gnss::visit_signals(v, {"signals", "", "transmitted signals: [L1CA, E1]", "of each system the one near L1"},
                      o.signals);
  v.number({"mask_deg", "deg", "lowest elevation of the sent satellites at the shown position"}, o.mask_deg,
           {0, 90});
}

/// Data common to all satellites of an epoch.
struct Spoofing::Scene {
  propagation::Antenna antenna;
  Vector3d antenna_enu;
  Eigen::Matrix3d ecef_from_enu;
};

/// A satellite's signal from the spoofer.
struct Spoofing::Copy {
  double range_m = 0;    ///< of its code
  double carrier_m = 0;  ///< of its carrier
  double elevation_rad = 0;
};

Spoofing::Spoofing(const SpoofingOptions& options, FaultContext context)
    : options_((options.validate(), options)),
      context_(std::move(context)),
      transmitter_(options_.transmitter, context_) {
  if (!context_.sky) throw InputError("a spoofer needs a sky");
  if (options_.shows.given()) shown_.emplace(options_.shows, context_.city->frame, context_.begin);
  all_ = context_.sky->satellites();
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      const auto& names = options_.signals;
      const bool sent = names.empty() ? gnss::index_of(signal) == 0
                                      : std::find(names.begin(), names.end(), signal.name) != names.end();
      if (sent && signal.only_recorded.empty()) signals_.push_back(&signal);
    }
  }
}

bool Spoofing::sends(gnss::SatelliteId id) const {
  return holds(options_.satellites, id);
}

/// `dt_s` from the epoch [s], with the antenna's velocity. Signals are those of a position at a time `late`
/// ago: P = r(position, t - late) + c late, so that orbits and codes agree for any delay.
std::optional<Spoofing::Copy> Spoofing::copy(gnss::SatelliteId id, const Scene& scene, double dt_s) const {
  const geodesy::GpsTime time = scene.antenna.time + dt_s;
  const Vector3d antenna_ecef = scene.antenna.position_ecef + dt_s * scene.antenna.velocity_ecef;
  Vector3d point = antenna_ecef;
  double late_m = kSpeedOfLight * options_.delay_s;
  if (!options_.aligned()) {
    const geodesy::LocalFrame& frame = context_.city->frame;
    const Vector3d sender = transmitter_.position(time);
    point = frame.ecef_from_local(shown_ ? shown_->at(time) : sender);
    late_m += (frame.ecef_from_local(sender) - antenna_ecef).norm();
  }
  const auto seen = [&](const Vector3d& at, double metres) {
    return orbit::line_of_sight(*context_.sky, id, time - metres / kSpeedOfLight, at);
  };
  const PullOffOptions& pull = options_.pull_off;
  const Vector3d direction(pull.east_m, pull.north_m, pull.up_m);
  const double seconds = time - context_.begin;
  const double moved_m = pull.progress(seconds, direction.norm()).travelled_m;
  const double later_m =
      std::copysign(pull.progress(seconds, std::abs(pull.clock_m)).travelled_m, pull.clock_m);
  Vector3d sampled = point;
  if (moved_m > 0) sampled += scene.ecef_from_enu * (moved_m * direction.normalized());

  const auto code = seen(sampled, late_m + later_m);
  if (!code) return std::nullopt;
  Copy result{code->range_m + late_m + later_m, 0, code->elevation_rad};
  result.carrier_m = result.range_m;
  if (options_.carrier == SpoofingOptions::Carrier::Held) {
    const auto carrier = seen(point, late_m);
    if (!carrier) return std::nullopt;
    result.carrier_m = carrier->range_m + late_m;
  }
  return result;
}

void Spoofing::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  if (arrival.containment != raytrace::Containment::Free) return;
  constexpr double kHalfStep_s = 0.1;  // of rates
  const Scene scene{antenna, arrival.antenna_enu, arrival.ecef_from_enu};
  const orbit::Observer here(antenna.position_ecef);
  const std::vector<TransmitterPath> paths =
      transmitter_.paths(antenna.time, arrival.antenna_enu, gnss::kL1_hz);
  const double straight_m = paths.front().length_m;
  const Vector3d velocity_enu = arrival.ecef_from_enu.transpose() * antenna.velocity_ecef;
  const double seconds = antenna.time - context_.begin;
  const double ramp_db =
      seconds < options_.ramp_s ? options_.ramp_from_db * (seconds / options_.ramp_s - 1) : 0;

  propagation::Path path;
  path.kind = propagation::PathKind::Transmitted;
  path.point = transmitter_.position(antenna.time);
  const std::uint64_t name = RandomStream(context_.seed, "spoofing/" + context_.name).next();

  for (const gnss::SatelliteId id : all_) {
    if (!sends(id)) continue;
    const auto now = copy(id, scene, 0), before = copy(id, scene, -kHalfStep_s),
               after = copy(id, scene, kHalfStep_s);
    if (!now || !before || !after || now->elevation_rad < geodesy::radians(options_.mask_deg)) continue;

    auto view = std::find_if(arrival.views.begin(), arrival.views.end(),
                             [id](const auto& each) { return each.line.id == id; });
    if (view == arrival.views.end()) {
      auto line = orbit::line_of_sight(*context_.sky, id, antenna.time, here);
      if (!line) continue;
      propagation::SatelliteView added;
      added.line = *std::move(line);
      arrival.views.push_back(std::move(added));
      view = arrival.views.end() - 1;
    }
    const orbit::LineOfSight& line = view->line;
    // The fix applies its mask with the position that it computes.
    if (!options_.aligned()) view->shown_elevation_rad = std::max(line.elevation_rad, now->elevation_rad);
    path.code_ahead_m = now->range_m - now->carrier_m;
    const double rate_mps = (after->carrier_m - before->carrier_m) / (2 * kHalfStep_s);
    path.code_ahead_mps = (after->range_m - before->range_m) / (2 * kHalfStep_s) - rate_mps;
    for (const TransmitterPath& transmitter_path : paths) {
      path.arrival = transmitter_path.arrival;
      path.arrival_elevation_rad = std::asin(std::clamp(transmitter_path.arrival.z(), -1.0, 1.0));
      path.reflector = name ^ transmitter_path.reflector;
      path.excess_m = now->range_m - line.range_m + (transmitter_path.length_m - straight_m);
      path.range_rate_mps = rate_mps + (paths.front().arrival - transmitter_path.arrival).dot(velocity_enu);
      for (const gnss::Signal* signal : signals_) {
        if (signal->system != id.system || !gnss::transmits(id, *signal, antenna.time)) continue;
        // At an isotropic antenna in clear view [dBW], by the default link budget.
        const double nominal = signal->minimum_dbw + signal::LinkBudgetOptions().above_minimum_db +
                               signal::elevation_rise_db(line.elevation_rad);
        const double advantage_db =
            ramp_db + (options_.power_dbm ? *options_.power_dbm - 30 + transmitter_path.gain_db - nominal
                                          : options_.advantage_db - transmitter_path.obstruction_db +
                                                20 * std::log10(straight_m / transmitter_path.length_m));
        path.amplitude_factor = std::pow(10, advantage_db / 20);
        path.signals = 1U << gnss::index_of(*signal);
        view->paths.paths.push_back(path);

        propagation::Interference wave;
        wave.spectrum.shape = propagation::Spectrum::Shape::Code;
        wave.spectrum.centre_hz = gnss::carrier_hz(*signal, line.state.carrier_frequency_hz);
        wave.spectrum.modulation = signal->modulation;
        wave.spectrum.chip_rate_hz = signal->chip_rate_hz;
        wave.power_dbw = nominal + advantage_db;
        wave.polarisation = propagation::Polarisation::Right;
        wave.arrival = transmitter_path.arrival;
        wave.copy_of = id;
        arrival.interference.push_back(wave);
      }
    }
  }
}

}  // namespace canyon::disturbance
