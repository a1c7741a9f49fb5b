#include "canyon/disturbance/shadowing_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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

ShadowingEnvironment of_surroundings(double closed_sky) {
  if (closed_sky < 0.02) return ShadowingEnvironment::Open;
  return closed_sky < 0.07 ? ShadowingEnvironment::Suburban : ShadowingEnvironment::Urban;
}

void ShadowingOptions::validate() const {
  options::check(*this, "shadowing");
  if (transition_m > frame_m) {
    throw InputError(fmt::format("transition_m of the shadowing is {}", transition_m),
                     fmt::format("it runs from 0 m to one frame, {:g} m", frame_m));
  }
  // Of a share above a half frames between blockages are rarer than blockages.
  const double share = blockage_share(), shortest_m = frame_m * std::max(1.0, share / (1 - share));
  if (share > 0 && blockage.length_m < shortest_m * (1 - 1e-9)) {
    throw InputError(fmt::format("length_m of the blockage is {}", blockage.length_m),
                     fmt::format("with its share of {:g} and frames of {:g} m it must be {:g} m or more",
                                 share, frame_m, shortest_m));
  }
}

void visit(options::Visitor& v, BlockageOptions& o) {
  v.number({"share", "",
            "share of the way on which objects that maps lack block the direct signal; left out: 0.2 in "
            "dense surroundings, else 0"},
           o.share, {0, 0.9});
  v.number({"length_m", "m", "mean length of a blockage"}, o.length_m, {0.1, 10e3});
  v.number({"mean_db", "dB", "mean level behind a blockage"}, o.mean_db, {-60, 0});
  v.number({"sigma_db", "dB", "standard deviation of that level"}, o.sigma_db, {0, 20});
  v.number({"shared_by_all", "", "share of the variance that all satellites have in common"}, o.shared_by_all,
           {0, 1});
}

void visit_environment(options::Visitor& v, std::string_view key, ShadowingEnvironment& environment) {
  static constexpr std::string_view kEnvironments[]{"urban", "suburban", "custom", "dense", "open", "auto"};
  v.choice({key, "",
            "statistics of shadows: urban, suburban, dense (urban, with a fifth of the way blocked), open "
            "(none) or "
            "custom; auto: open, suburban or urban by the city"},
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
  v.part("blockage", o.blockage);
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
