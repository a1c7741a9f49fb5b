#include "canyon/receiver/positioning/pseudorange_model.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <string_view>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"

namespace canyon::positioning {

namespace {

using geodesy::kSpeedOfLight;

/// A satellite at the mask moves the position when it appears or disappears, and with it the mask.
constexpr int kMaskLooks = 3;

void check(const Measurement& m) {
  const char* bad = nullptr;
  if (!std::isfinite(m.pseudorange_m) || std::abs(m.pseudorange_m) > 1e12) bad = "pseudorange_m";
  if (!(m.sigma_m > 0) || !std::isfinite(m.sigma_m)) bad = "sigma_m";
  if (!(m.sigma_factor > 0) || !std::isfinite(m.sigma_factor)) bad = "sigma_factor";
  if (m.id.number > 99) bad = "number";
  if (!std::isfinite(m.ionosphere_fraction)) bad = "ionosphere_fraction";
  if (m.cn0_dbhz && !std::isfinite(*m.cn0_dbhz)) bad = "cn0_dbhz";
  if (m.doppler_hz) {
    if (!std::isfinite(*m.doppler_hz)) bad = "doppler_hz";
    if (!(m.doppler_sigma_hz > 0) || !std::isfinite(m.doppler_sigma_hz)) bad = "doppler_sigma_hz";
    if (!(m.carrier_frequency_hz > 0) || !std::isfinite(m.carrier_frequency_hz)) bad = "carrier_frequency_hz";
  }
  if (bad != nullptr) {
    throw InputError(
        fmt::format("{} of satellite {} is invalid", bad, gnss::to_string(m.id)),
        "give finite pseudoranges, C/N0 and Doppler, sigmas and frequencies above 0, numbers below 100");
  }
}

}  // namespace

receiver::CodeAndCarrier satellite_range(const orbit::SatelliteState& state, const gnss::Signal* signal) {
  receiver::ModelState model;
  model.satellite = &state;
  model.signal = signal;
  return modelled_range(receiver::RangeTermOf::Satellite, model);
}

Clocks clocks_of(const std::array<int, gnss::kSystemCount>& satellites) {
  const auto clock_of = [](gnss::System system) { return static_cast<std::size_t>(clock_system(system)); };
  std::array<int, gnss::kSystemCount> sharing{};
  for (const gnss::System system : gnss::kAllSystems)
    sharing[clock_of(system)] += satellites[static_cast<std::size_t>(system)];
  Clocks clocks;
  for (const gnss::System system : gnss::kConstellations) {
    const auto index = static_cast<std::size_t>(system);
    clocks.column[index] = sharing[index] >= 2 ? 3 + clocks.count++ : -1;
  }
  for (const gnss::System system : gnss::kAllSystems)
    clocks.column[static_cast<std::size_t>(system)] = clocks.column[clock_of(system)];
  return clocks;
}

bool enough_satellites(int satellites, int clocks, const FixOptions& options) {
  return satellites >= options.min_satellites + std::max(clocks, 1) - 1;
}

bool strong_enough(const std::optional<Dop>& dop, const FixOptions& options) {
  return !std::isfinite(options.max_pdop) || (dop && dop->pdop <= options.max_pdop);
}

bool is_near_ground(double height_m) {
  return height_m >= -1e4 && height_m <= 1e5;
}

bool is_sound(const Fix& fix) {
  // The elementary symmetric functions of the eigenvalues, up to rounding.
  const auto semi_definite = [](const Eigen::Matrix3d& c) {
    constexpr double kRounding = 1e-9;
    const double sum = c.trace(), pairs = (sum * sum - c.squaredNorm()) / 2;
    return sum >= 0 && pairs >= -kRounding * sum * sum && c.determinant() >= -kRounding * sum * sum * sum;
  };
  const auto& baseline = fix.baseline;
  if (baseline && !(baseline->vector_enu.allFinite() && semi_definite(baseline->covariance_enu)))
    return false;
  if (!fix.solved()) return true;
  return fix.position_ecef.allFinite() && semi_definite(fix.covariance_enu) &&
         (!fix.velocity_enu_mps || fix.velocity_enu_mps->allFinite()) &&
         (!fix.velocity_covariance_enu || semi_definite(*fix.velocity_covariance_enu));
}

void range_satellites(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                      const orbit::Sky& sky, const FixOptions& options,
                      std::vector<RangedSatellite>& satellites) {
  satellites.clear();
  for (const Measurement& m : measurements) {
    check(m);
    if (m.cn0_dbhz && *m.cn0_dbhz < options.cn0_mask_dbhz) continue;
    const geodesy::GpsTime shown = receiver_time - m.pseudorange_m / kSpeedOfLight;
    std::optional<orbit::SatelliteState> state = sky.state(m.id, shown);
    if (state) state = sky.state(m.id, shown - (state->clock_bias_s - state->group_delay_s));
    if (!state) continue;
    RangedSatellite satellite;
    satellite.measured = &m;
    satellite.state = *state;
    satellite.pseudorange_m = m.pseudorange_m - satellite_range(satellite.state, nullptr).code;
    satellite.sigma_m = options.weights.sigma_m(m, geodesy::kPi / 2);
    satellite.doppler_sigma_mps = options.weights.doppler_sigma_mps(m);
    satellites.push_back(satellite);
  }
  std::sort(satellites.begin(), satellites.end(), [](const RangedSatellite& a, const RangedSatellite& b) {
    return a.measured->id < b.measured->id;
  });
  for (std::size_t i = 1; i < satellites.size(); ++i) {
    if (satellites[i].measured->id == satellites[i - 1].measured->id) {
      throw InputError(fmt::format("satellite {} is measured twice at one epoch",
                                   gnss::to_string(satellites[i].measured->id)),
                       "give one L1-band pseudorange for each satellite");
    }
  }
  check_rows(satellites.size());
}

void update_satellite_geometry(RangedSatellite& satellite, const Eigen::Vector3d& receiver_ecef) {
  satellite.position = orbit::rotate_earth(satellite.state.position_m, satellite.flight_time_s);
  const Eigen::Vector3d towards = satellite.position - receiver_ecef;
  satellite.range_m = towards.norm();
  satellite.direction = towards / satellite.range_m;
  satellite.flight_time_s = satellite.range_m / kSpeedOfLight;
}

void look_up(std::span<RangedSatellite> satellites, const Eigen::Vector3d& receiver_ecef,
             geodesy::GpsTime receiver_time, const FixOptions& options,
             const std::map<gnss::System, gnss::Klobuchar>& klobuchar, int looks) {
  const geodesy::Geodetic geodetic = geodesy::geodetic_from_ecef(receiver_ecef);
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(geodetic);
  const double sine_of_mask = std::sin(options.elevation_mask_rad);
  const bool weighs = options.weights.weighting == Weighting::Elevation;
  for (RangedSatellite& satellite : satellites) {
    satellite.direction = (satellite.position - receiver_ecef).normalized();
    const Eigen::Vector3d enu = enu_from_ecef * satellite.direction;
    const bool above = enu.z() >= sine_of_mask;
    satellite.above_mask = above && (satellite.above_mask || looks < kMaskLooks);
    if (!above) continue;
    const geodesy::AzimuthElevation look_angles = geodesy::azimuth_elevation_from_enu(enu);
    const Measurement& m = *satellite.measured;
    if (weighs) satellite.sigma_m = options.weights.sigma_m(m, look_angles.elevation_rad);
    std::array<double, receiver::kRangeTermCount> term_values_m{};
    satellite.space_m = modelled_range(receiver::RangeTermOf::Space,
                                       {&options, &klobuchar, &satellite.state, nullptr, m.id,
                                        m.carrier_frequency_hz > 0 ? m.carrier_frequency_hz
                                                                   : satellite.state.carrier_frequency_hz,
                                        receiver_time, geodetic, look_angles, m.ionosphere_fraction},
                                       term_values_m)
                            .code;
    const double ionosphere_m = term_values_m[static_cast<std::size_t>(receiver::RangeTermId::Ionosphere)];
    satellite.ionosphere_m = m.reported_sigma_ratio == 1 ? ionosphere_m : 0;
  }
}

DopplerEquation doppler_equation(const RangedSatellite& satellite) {
  const Measurement& m = *satellite.measured;
  assert(m.doppler_hz);
  const double wavelength = kSpeedOfLight / m.carrier_frequency_hz;
  const Eigen::Vector3d omega(0, 0, geodesy::kEarthRotationRate);
  DopplerEquation equation;
  equation.sigma_mps = satellite.doppler_sigma_mps;
  equation.satellite_mps = orbit::rotate_earth(satellite.state.velocity_mps, satellite.flight_time_s);
  equation.g =
      1 + satellite.direction.dot(equation.satellite_mps + omega.cross(satellite.position)) / kSpeedOfLight;
  equation.measured_mps = -wavelength * *m.doppler_hz;
  return equation;
}

void visit(options::Visitor& v, SmoothingOptions& o) {
  static constexpr std::string_view kSmoothings[]{"none", "hatch", "divergence_free"};
  v.choice({"method", "",
            "carrier smoothing of the fix's pseudoranges: none, hatch, or divergence_free (by two carriers)"},
           o.smoothing, kSmoothings);
  v.number({"window_s", "s", "time constant"}, o.window_s, {1, 3600});
}

CodeSmoother::Smoothed CodeSmoother::next(geodesy::GpsTime time, double pseudorange_m,
                                          std::optional<double> carrier_step_m,
                                          const std::array<CodeNoise, 2>& noise,
                                          const SmoothingOptions& options) {
  const double dt = last_ ? time - *last_ : 0;
  if (!last_ || !carrier_step_m) {
    count_ = 0;
    smoothed_m_ = pseudorange_m;
  }
  ++count_;
  const double a = std::min(1.0, std::max(dt / options.window_s, 1.0 / count_));
  if (count_ > 1) smoothed_m_ = a * pseudorange_m + (1 - a) * (smoothed_m_ + *carrier_step_m);
  last_ = time;

  Smoothed result{smoothed_m_, 0};
  for (std::size_t i = 0; i < noise.size(); ++i) {
    if (count_ == 1) {
      variance_[i] = covariance_[i] = 1;
    } else {
      // cov(S_k-1, P_k) is cov(S_k-1, P_k-1) e^(-dt rate).
      const double before = dt > 0 ? covariance_[i] * std::exp(-dt * noise[i].rate_per_s) : covariance_[i];
      variance_[i] = a * a + (1 - a) * (1 - a) * variance_[i] + 2 * a * (1 - a) * before;
      covariance_[i] = a + (1 - a) * before;
    }
    result.sigma_m += noise[i].sigma_m * noise[i].sigma_m * variance_[i];
  }
  result.sigma_m = std::sqrt(result.sigma_m);
  return result;
}

}  // namespace canyon::positioning
