#include "canyon/disturbance/shadowing_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/options/values.hpp"

namespace canyon::disturbance {
namespace {

/// One elevation of the tables in docs/shadowing.md: states 1 (clear) and 2 (moderate shadow).
struct Row {
  double elevation_deg;
  double mean1_db, sigma1_db, mean2_db, sigma2_db;
  double p11, p12, p21, p22;
};
constexpr std::array<Row, 3> kUrban{{{40, -0.3, 0.73, -8.0, 4.5, 0.8628, 0.0737, 0.1247, 0.8214},
                                     {60, -0.35, 0.26, -6.3, 1.4, 0.8681, 0.0952, 0.1300, 0.8429},
                                     {80, -0.25, 0.87, -6.6, 2.3, 0.8870, 0.0562, 0.1489, 0.8039}}};
constexpr std::array<Row, 3> kSuburban{{{40, -1.0, 0.5, -3.7, 0.98, 0.8177, 0.1715, 0.1544, 0.7997},
                                        {60, -0.3, 0.91, -2.0, 0.5, 0.8177, 0.1715, 0.1544, 0.7997},
                                        {80, -0.4, 0.58, -2.5, 0.2, 0.8177, 0.1715, 0.1544, 0.7997}}};

/// Obstacles of dense surroundings (docs/shadowing.md). Others have none, but with these numbers if a share
/// is given.
constexpr SkylineNumbers kDense{.share = 0.45,
                                .height_m = 18,
                                .distance_m = 8,
                                .distance_sigma = 0.4,
                                .foliage_share = 0.2,
                                .crown_m = 5,
                                .edge_radius_m = 1,
                                .length_m = 25,
                                .width_rad = 0.5235987755982988,  // 30 deg
                                .moving_share = 0.15,
                                .moving_s = 20};

ShadowingParameters of_row(const Row& row) {
  return {row.mean1_db,
          row.sigma1_db,
          row.mean2_db,
          row.sigma2_db,
          row.p12 / (row.p11 + row.p12),
          row.p21 / (row.p21 + row.p22)};
}

ShadowingParameters between(const ShadowingParameters& a, const ShadowingParameters& b, double share) {
  const auto mix = [share](double from, double to) { return from + share * (to - from); };
  return {mix(a.clear_mean_db, b.clear_mean_db),
          mix(a.clear_sigma_db, b.clear_sigma_db),
          mix(a.shadowed_mean_db, b.shadowed_mean_db),
          mix(a.shadowed_sigma_db, b.shadowed_sigma_db),
          mix(a.enter, b.enter),
          mix(a.leave, b.leave)};
}

ShadowingParameters interpolated(std::span<const Row> rows, double elevation_deg) {
  if (elevation_deg <= rows.front().elevation_deg) return of_row(rows.front());
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const double low = rows[i - 1].elevation_deg;
    const double high = rows[i].elevation_deg;
    if (elevation_deg <= high) {
      return between(of_row(rows[i - 1]), of_row(rows[i]), (elevation_deg - low) / (high - low));
    }
  }
  return of_row(rows.back());
}

}  // namespace

ShadowingParameters shadowing_parameters(const ShadowingOptions& options, double elevation_rad) {
  const double elevation_deg = geodesy::degrees(elevation_rad);
  if (options.environment == ShadowingEnvironment::Custom) return options.custom;
  const bool suburban = options.environment == ShadowingEnvironment::Suburban;
  return suburban ? interpolated(kSuburban, elevation_deg) : interpolated(kUrban, elevation_deg);
}

ShadowingEnvironment of_surroundings(double closed_sky, bool outlines) {
  if (closed_sky < 0.02) return ShadowingEnvironment::Open;
  if (closed_sky < 0.07) return ShadowingEnvironment::Suburban;
  return outlines && closed_sky >= 0.15 ? ShadowingEnvironment::Dense : ShadowingEnvironment::Urban;
}

void ShadowingOptions::validate() const {
  options::check(*this, "shadowing");
  if (transition_m > frame_m) {
    throw InputError(fmt::format("transition_m of the shadowing is {}", transition_m),
                     fmt::format("it runs from 0 m to one frame, {:g} m", frame_m));
  }
}

void SkylineOptions::validate() const {
  options::check(*this, "skyline");
}

double SkylineNumbers::share_above(double above_m) const {
  const double x = 2 * std::max(0.0, above_m - kBase_m) / height_m;
  return (1 + x) * std::exp(-x);
}

SkylineNumbers skyline_numbers(const ShadowingOptions& options) {
  const SkylineOptions& o = options.skyline;
  SkylineNumbers n = kDense;
  n.share = o.share.value_or(options.environment == ShadowingEnvironment::Dense ? n.share : 0);
  n.height_m = o.height_m.value_or(n.height_m);
  n.distance_m = o.distance_m.value_or(n.distance_m);
  n.distance_sigma = o.distance_sigma.value_or(n.distance_sigma);
  n.foliage_share = o.foliage_share.value_or(n.foliage_share);
  n.crown_m = o.crown_m.value_or(n.crown_m);
  n.edge_radius_m = o.edge_radius_m.value_or(n.edge_radius_m);
  n.length_m = o.length_m.value_or(n.length_m);
  n.width_rad = o.width_deg ? geodesy::radians(*o.width_deg) : n.width_rad;
  n.moving_share = o.moving_share.value_or(n.moving_share);
  n.moving_s = o.moving_s.value_or(n.moving_s);
  return n;
}

void visit(options::Visitor& v, SkylineOptions& o) {
  v.number(
      {"share", "",
       "share of azimuths with an obstacle that the map lacks; left out: 0.45 in dense surroundings, else 0"},
      o.share, {0, 1});
  v.number({"height_m", "m", "mean height of obstacles above 2 m; left out: 18"}, o.height_m, {0, 100, true});
  v.number({"distance_m", "m", "median distance of obstacles; left out: 8"}, o.distance_m, {1, 100});
  v.number({"distance_sigma", "", "standard deviation of the logarithm of distances; left out: 0.4"},
           o.distance_sigma, {0, 2});
  v.number({"foliage_share", "", "share of obstacles that are vegetation; left out: 0.2"}, o.foliage_share,
           {0, 1});
  v.number({"crown_m", "m", "width of a crown; left out: 5"}, o.crown_m, {0, 100, true});
  v.number({"edge_radius_m", "m", "radius that the edges of obstacles are rounded with; left out: 1"},
           o.edge_radius_m, {0, 10});
  v.number({"length_m", "m", "way after which other obstacles are met; left out: 25"}, o.length_m, {1, 1000});
  v.number({"width_deg", "deg", "angle of azimuth after which other obstacles are seen; left out: 30"},
           o.width_deg, {5, 90});
  v.number({"moving_share", "",
            "share of the variance of heights that changes with time, by traffic; left out: 0.15"},
           o.moving_share, {0, 1});
  v.number({"moving_s", "s", "time in which that part changes; left out: 20"}, o.moving_s, {0.1, 1e4});
}

void visit_environment(options::Visitor& v, std::string_view key, ShadowingEnvironment& environment) {
  static constexpr std::string_view kEnvironments[]{"urban", "suburban", "custom", "dense", "open", "auto"};
  v.choice({key, "",
            "statistics of shadows: urban, suburban, dense (urban, with many obstacles that the map lacks), "
            "open (none) or custom; auto: open, suburban, urban or dense by the city"},
           environment, kEnvironments);
}

void visit(options::Visitor& v, ShadowingOptions& o) {
  v.boolean({"enabled", "", "shadows on the direct signal by objects that maps lack: vehicles, trees, signs"},
            o.enabled);
  visit_environment(v, "environment", o.environment);
  v.section("custom", [&] {
    v.number({"clear_mean_db", "dB", "custom: mean level in the clear"}, o.custom.clear_mean_db, {-40, 10});
    v.number({"clear_sigma_db", "dB", "standard deviation of that level"}, o.custom.clear_sigma_db, {0, 20});
    v.number({"shadowed_mean_db", "dB", "mean level in shadow"}, o.custom.shadowed_mean_db, {-40, 10});
    v.number({"shadowed_sigma_db", "dB", "standard deviation of that level"}, o.custom.shadowed_sigma_db,
             {0, 20});
    v.number({"enter", "", "probability that shadow follows a clear frame"}, o.custom.enter, {0, 1});
    v.number({"leave", "", "probability that a clear frame follows shadow"}, o.custom.leave, {0, 1, true});
  });
  v.part("skyline", o.skyline);
  v.replaced("blockage",
             "obstacles that maps lack are 'skyline' now: write skyline: {share: S}, S twice the share of "
             "blockages");
  v.angle({"shared_angle_deg", "deg", "angle between satellites whose shadows have a correlation of 0.6"},
          o.shared_angle_rad, {5, 60});
  v.number({"frame_m", "m", "length of a frame; states last whole frames"}, o.frame_m, {0.1, 1000});
  v.number({"transition_m", "m", "length of the transition between states"}, o.transition_m, {0, 1000});
  v.number({"correlation_m", "m", "distance over which the correlation of levels falls to 1/e"},
           o.correlation_m, {0, 1000, true});
  v.number({"obstacle_distance_m", "m", "distance to the obstacles, whose shadows move with the satellite"},
           o.obstacle_distance_m, {0, 1000});
  v.number({"obstacle_speed_mps", "m/s", "speed at which obstacles pass an antenna at rest"},
           o.obstacle_speed_mps, {0, 100});
}

}  // namespace canyon::disturbance
