#include "canyon/outputs/drawing/views/skyplot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::drawing {
namespace {

using geodesy::GpsTime;

/// Sectors of the silhouette: with 1440, a sector is 1.5 units wide on the rim.
constexpr int kSectors = 1440;
/// A track has a point each minute, and within these bounds.
constexpr double kTrailStep_s = 60;
constexpr int kMinTrailSteps = 10, kMaxTrailSteps = 240;
constexpr double kMaxTrail_s = 86'400;

/// "2026-06-01 08:02:32 UTC", with as many decimals as the instant needs, up to three.
std::string time_text(GpsTime time) {
  std::string text = geodesy::format_utc(time, 3);
  text.pop_back();  // Z
  while (text.back() == '0' && text.find('.') != std::string::npos) text.pop_back();
  if (text.back() == '.') text.pop_back();
  return fmt::format("{} {} UTC", text.substr(0, 10), text.substr(11));
}

SkyPoint point_of(const propagation::SatelliteView& view) {
  return {view.line.azimuth_rad, view.line.elevation_rad, view.paths.visibility};
}

/// Arrivals with the visibilities for a receiver; in order of time.
class Listener {
 public:
  Listener(const simulation::Environment& environment, const receiver::ReceiverOptions* options)
      : environment_(environment) {
    if (options == nullptr || !options->signal.enabled) return;
    receiver::ReceiverOptions quiet = *options;
    quiet.signal.lock.warm_start = true;
    quiet.signal.shadowing.enabled = false;
    quiet.filter.enabled = false;
    quiet.ionosphere = quiet.fix.correct_ionosphere = false;
    receiver_.emplace(std::move(quiet), 1);
  }
  [[nodiscard]] propagation::Arrival arrival(GpsTime time, const Eigen::Vector3d& antenna_enu,
                                             const propagation::Propagator& propagator) {
    propagation::Arrival arrival = environment_.arrival(time, antenna_enu, propagator);
    if (!receiver_) return arrival;
    const propagation::Antenna antenna{time, environment_.city().frame.ecef_from_local(antenna_enu),
                                       Eigen::Vector3d::Zero()};
    const receiver::ReceiverEpoch epoch =
        receiver_->observe({antenna, arrival, environment_.sky(), environment_.klobuchar()});
    for (const receiver::SatelliteObservation& satellite : epoch.satellites) {
      const auto view = std::find_if(arrival.views.begin(), arrival.views.end(),
                                     [&](const auto& each) { return each.line.id == satellite.id; });
      view->paths.visibility = satellite.visibility;
    }
    return arrival;
  }

 private:
  const simulation::Environment& environment_;
  std::optional<receiver::Receiver> receiver_;
};

/// Trails of each satellite, one piece for each interval above the horizon. `now` gets the arrival at `time`.
std::map<gnss::SatelliteId, std::vector<std::vector<SkyPoint>>> trails(
    Listener& listener, const propagation::Propagator& propagator, GpsTime time,
    const Eigen::Vector3d& antenna_enu, double trail_s, propagation::Arrival& now) {
  std::map<gnss::SatelliteId, std::vector<std::vector<SkyPoint>>> pieces;
  const int steps =
      std::clamp(static_cast<int>(std::ceil(trail_s / kTrailStep_s)), kMinTrailSteps, kMaxTrailSteps);
  std::map<gnss::SatelliteId, int> last;
  for (int k = 0; k <= steps; ++k) {
    now = listener.arrival(time - trail_s * (steps - k) / steps, antenna_enu, propagator);
    for (const propagation::SatelliteView& view : now.views) {
      auto& own = pieces[view.line.id];
      const auto before = last.find(view.line.id);
      if (before == last.end() || before->second + 1 < k) own.emplace_back();
      own.back().push_back(point_of(view));
      last[view.line.id] = k;
    }
  }
  return pieces;
}

}  // namespace

void SkyplotOptions::validate() const {
  options::check(*this, "sky plot");
}

void visit(options::Visitor& v, SkyplotOptions& o) {
  static constexpr std::string_view kStyles[]{"sky", "fisheye"};
  static constexpr std::string_view kProjections[]{"equidistant", "stereographic"};
  v.choice({"style", "", "sky (a map) or fisheye (a camera)"}, o.style, kStyles);
  v.choice({"projection", "", "equidistant (linear in elevation) or stereographic (conformal)"}, o.projection,
           kProjections);
  v.part("sheet", o.sheet);
  v.number({"trail_s", "s", "length of the tracks before this instant, as received at this point"}, o.trail_s,
           {0, kMaxTrail_s});
  v.angle({"elevation_mask_deg", "deg", "drawn only"}, o.elevation_mask_rad, {0, 90, false, true});
  v.text({"receiver", "", "for the title"}, o.receiver);
}

SkyDrawing make_sky_drawing(const simulation::Environment& environment,
                            const propagation::Propagator& propagator, GpsTime time,
                            const Eigen::Vector3d& antenna_enu, const SkyplotOptions& options,
                            const receiver::ReceiverOptions* receiver) {
  options.validate();
  Listener listener(environment, receiver);
  propagation::Arrival now;
  std::map<gnss::SatelliteId, std::vector<std::vector<SkyPoint>>> tracks;
  if (options.trail_s > 0)
    tracks = trails(listener, propagator, time, antenna_enu, options.trail_s, now);
  else
    now = listener.arrival(time, antenna_enu, propagator);
  const geodesy::Geodetic position = environment.city().frame.geodetic_from_local(antenna_enu);
  SkyDrawing drawing;
  drawing.title = fmt::format("{}{} at {}", options.receiver, options.receiver.empty() ? "Sky" : ": sky",
                              time_text(time));
  drawing.subtitle = fmt::format("{}\u00B0, {}\u00B0, {} m  \u00B7  {} m east, {} m north, {} m up in {}",
                                 encoding::fixed(geodesy::degrees(position.latitude_rad), 6),
                                 encoding::fixed(geodesy::degrees(position.longitude_rad), 6),
                                 encoding::fixed(position.height_m, 1), encoding::fixed(antenna_enu.x(), 1),
                                 encoding::fixed(antenna_enu.y(), 1), encoding::fixed(antenna_enu.z(), 1),
                                 environment.city().name);
  drawing.projection = options.projection;
  drawing.elevation_mask_rad = options.elevation_mask_rad;
  drawing.has_fix = false;
  drawing.containment = now.containment;
  if (!environment.city().mesh.triangles.empty() || !environment.scene().posed_instances().empty())
    drawing.mask = make_sky_mask(environment.scene(), antenna_enu, kSectors);
  if (options.trail_s > 0)
    drawing.trail_meaning =
        options.trail_s >= 60 ? fmt::format("last {:g} min, seen here", std::round(options.trail_s / 6) / 10)
                              : fmt::format("last {:g} s, seen here", options.trail_s);
  for (const propagation::SatelliteView& view : now.views) {
    SkySatellite satellite{gnss::to_string(view.line.id), point_of(view), false, {}, {}};
    if (const auto found = tracks.find(view.line.id); found != tracks.end())
      satellite.trails = std::move(found->second);
    for (const propagation::Path& path : view.paths.paths) {
      if (path.kind == propagation::PathKind::Direct || !view.paths.received()) continue;
      // A diffracted wave at the edge of a clear path arrives from the same direction as the path.
      const bool clear = view.paths.visibility != propagation::Visibility::NLOS;
      if (path.kind == propagation::PathKind::Diffracted && clear) continue;
      const geodesy::AzimuthElevation from = geodesy::azimuth_elevation_from_enu(path.arrival);
      satellite.reflections.push_back({from.azimuth_rad, from.elevation_rad, path.excess_m, path.kind});
    }
    drawing.satellites.push_back(std::move(satellite));
  }
  return drawing;
}

std::string draw_skyplot(const simulation::Environment& environment,
                         const propagation::Propagator& propagator, GpsTime time,
                         const Eigen::Vector3d& antenna_enu, const SkyplotOptions& options,
                         const receiver::ReceiverOptions* receiver) {
  const SkyDrawing drawing = make_sky_drawing(environment, propagator, time, antenna_enu, options, receiver);
  if (options.style == SkyStyle::Chart) return draw_sky(drawing, options.sheet);
  return draw_fisheye(drawing, {&environment.scene(), &environment.city().mesh, antenna_enu}, options.sheet);
}

}  // namespace canyon::drawing
