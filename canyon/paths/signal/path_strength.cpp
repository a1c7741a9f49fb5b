#include "canyon/paths/signal/path_strength.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"

namespace canyon::signal {

namespace {

/// [J/K], exact by SI.
constexpr double kBoltzmann = 1.380649e-23;

}  // namespace

double elevation_rise_db(double elevation_rad) {
  if (std::isnan(elevation_rad)) throw InputError("elevation of NaN rad", "give a direction");
  constexpr double kTopDeg = 40, kTopDb = 2;
  const double elevation = std::clamp(geodesy::degrees(elevation_rad), 0.0, 90.0);
  const double x = elevation < kTopDeg ? (elevation - kTopDeg) / 35 : (elevation - kTopDeg) / 50;
  return kTopDb * (1 - x * x);
}

double noise_density_dbw_per_hz(const LinkBudgetOptions& options) {
  constexpr double kReferenceK = 290;  // IEEE definition of the noise figure
  const double noise_factor = std::pow(10.0, options.noise_figure_db / 10);
  return 10 * std::log10(kBoltzmann * (options.antenna_temperature_k + kReferenceK * (noise_factor - 1)));
}

double los_cn0_dbhz(const gnss::Signal& signal, double elevation_rad, const AntennaPattern& antenna,
                    const LinkBudgetOptions& options) {
  const double power = signal.minimum_dbw + options.above_minimum_db + elevation_rise_db(elevation_rad);
  return power + antenna.gain(elevation_rad, signal.carrier_hz).rhcp_dbic -
         noise_density_dbw_per_hz(options) - options.implementation_loss_db;
}

void LinkBudgetOptions::validate() const {
  options::check(*this, "link budget");
}

void visit(options::Visitor& v, LinkBudgetOptions& o) {
  v.number({"above_minimum_db", "dB", "power of satellites above the minimum of their interface documents"},
           o.above_minimum_db, {-10, 20});
  v.number({"antenna_temperature_k", "K", "noise temperature of sky, ground and losses before the amplifier"},
           o.antenna_temperature_k, {2, 1000});
  v.number({"noise_figure_db", "dB", "noise figure of the receiver with its amplifier"}, o.noise_figure_db,
           {0, 20});
  v.number({"implementation_loss_db", "dB", "loss by filter, quantization and correlation"},
           o.implementation_loss_db, {0, 20});
}

namespace {

using Complex = std::complex<double>;

/// sqrt(10^(db / 10)), in half of std::pow's time.
double amplitude_of_db(double db) {
  constexpr double kNepersPerDb = 0.11512925464970228;  // ln(10) / 20
  return std::exp(kNepersPerDb * db);
}

/// e^(-2 pi j turns)
Complex phasor(double cycles) {
  return std::polar(1.0, -2 * geodesy::kPi * (cycles - std::trunc(cycles)));
}

void check_excess(double excess_m) {
  if (!(excess_m >= 0) || !std::isfinite(excess_m))
    throw InputError(fmt::format("excess path of {} m", excess_m), "give 0 m or more");
}

CircularReflection reflection_of(const propagation::Incidence& incidence, double frequency_hz,
                                 double wavelength, const StrengthOptions& options) {
  const RadioMaterial material = radio_material(incidence.material);
  const Complex eta = complex_permittivity(material, frequency_hz);
  const double thickness = incidence.thickness_m.value_or(material.default_thickness_m);
  const bool half_space = !options.slabs || material.default_thickness_m == 0;
  const LinearReflection linear = half_space ? reflect_half_space(eta, incidence.incidence_rad)
                                             : slab(eta, incidence.incidence_rad, thickness, wavelength);
  if (!(incidence.specular_factor >= 0 && incidence.specular_factor <= 1)) {
    throw InputError(fmt::format("specular factor of {}", incidence.specular_factor),
                     "give a fraction from 0 to 1");
  }
  CircularReflection result = circular(linear);
  result.co *= incidence.specular_factor;
  result.cross *= incidence.specular_factor;
  return result;
}

}  // namespace

CircularWave arriving_wave(const propagation::PathGeometry& path, double frequency_hz,
                           const StrengthOptions& options) {
  if (path.incidence_count < 0 || path.incidence_count > static_cast<int>(path.incidences.size()))
    throw InputError(fmt::format("path of {} reflections", path.incidence_count), "give 0 to 2");
  check_excess(path.excess_m);
  const double wavelength = wavelength_m(frequency_hz);
  CircularWave wave;
  for (int i = 0; i < path.incidence_count; ++i) {
    const propagation::Incidence& incidence = path.incidences[static_cast<std::size_t>(i)];
    wave = reflect(wave, reflection_of(incidence, frequency_hz, wavelength, options),
                   incidence.plane_rotation_rad);
  }
  double cycles = path.excess_m / wavelength;
  Complex factor = 1;
  if (path.edge_nu) {
    if (!std::isfinite(*path.edge_nu))
      throw InputError(fmt::format("edge with nu {}", *path.edge_nu), "give a finite nu");
    factor = propagation::edge_wave(*path.edge_nu) *
             amplitude_of_db(-propagation::rounded_edge_loss_db(path.edge_radius_m, path.edge_leg_m,
                                                                path.edge_bending_rad, wavelength));
    cycles -= *path.edge_nu * *path.edge_nu / 4;
  }
  factor *= phasor(cycles);
  if (path.foliage_depth_m != 0)
    factor *= amplitude_of_db(-foliage_loss_db(FoliageModel::Woodland, path.foliage_depth_m, frequency_hz,
                                               path.arrival_elevation_rad));
  return {wave.rhcp * factor, wave.lhcp * factor};
}

Complex antenna_output(const CircularWave& wave, const AntennaGain& gain) {
  const Complex r = wave.rhcp * amplitude_of_db(gain.rhcp_dbic);
  const Complex l = wave.lhcp * amplitude_of_db(gain.lhcp_dbic);
  const Complex sum = r + l;
  const double power = std::norm(r) + std::norm(l), sum_power = std::norm(sum);
  // If both hands cancel, the phase is undefined.
  if (!(sum_power > 0)) return std::sqrt(power);
  return sum * std::sqrt(power / sum_power);
}

namespace {

Complex received(const propagation::PathGeometry& path, double frequency_hz, const AntennaPattern& antenna,
                 const StrengthOptions& options) {
  return antenna_output(arriving_wave(path, frequency_hz, options),
                        antenna.gain(path.arrival_elevation_rad, frequency_hz));
}

/// Amplitude after the antenna, of a wave with 1 before it.
Complex received(const propagation::Path& path, double frequency_hz, const AntennaPattern& antenna,
                 const StrengthOptions& options) {
  const double factor = path.amplitude_factor;
  if (!(factor >= 0) || !std::isfinite(factor))
    throw InputError(fmt::format("path with an amplitude factor of {}", factor), "give 0 or more");
  const propagation::PathGeometry& geometry = path;
  if (path.kind == propagation::PathKind::Transmitted) {
    propagation::PathGeometry wave = path;
    wave.excess_m = 0;
    return factor * phasor(path.carrier_excess_m() / wavelength_m(frequency_hz)) *
           received(wave, frequency_hz, antenna, options);
  }
  if (path.kind == propagation::PathKind::Diffracted && path.edge_nu) {
    // trace() sets nu for its own carrier.
    propagation::PathGeometry here = path;
    here.edge_nu = propagation::signed_knife_edge_nu(here.excess_m, wavelength_m(frequency_hz),
                                                     !std::signbit(*here.edge_nu));
    return factor * received(here, frequency_hz, antenna, options);
  }
  if (path.kind != propagation::PathKind::Diffuse)
    return factor * received(geometry, frequency_hz, antenna, options);
  if (!(path.scattered_power >= 0) || !std::isfinite(path.scattered_power))
    throw InputError(fmt::format("diffuse path of power {}", path.scattered_power), "give 0 or more");
  check_excess(path.excess_m);
  const AntennaGain gain = antenna.gain(path.arrival_elevation_rad, frequency_hz);
  const double right = amplitude_of_db(gain.rhcp_dbic), left = amplitude_of_db(gain.lhcp_dbic);
  // Half of an unpolarised wave's power is in each hand.
  return factor * std::sqrt(path.scattered_power * (right * right + left * left) / 2) *
         phasor(path.excess_m / wavelength_m(frequency_hz));
}

/// Inverse of the same for the direct wave.
double over_direct(double satellite_elevation_rad, double frequency_hz, const AntennaPattern& antenna) {
  return amplitude_of_db(-antenna.gain(satellite_elevation_rad, frequency_hz).rhcp_dbic);
}

}  // namespace

Complex path_amplitude(const propagation::PathGeometry& path, double satellite_elevation_rad,
                       double frequency_hz, const AntennaPattern& antenna, const StrengthOptions& options) {
  return received(path, frequency_hz, antenna, options) *
         over_direct(satellite_elevation_rad, frequency_hz, antenna);
}

Complex path_amplitude(const propagation::Path& path, double satellite_elevation_rad, double frequency_hz,
                       const AntennaPattern& antenna, const StrengthOptions& options) {
  return received(path, frequency_hz, antenna, options) *
         over_direct(satellite_elevation_rad, frequency_hz, antenna);
}

void path_amplitudes(const propagation::SatelliteView& view, double carrier_hz, const AntennaPattern& antenna,
                     const StrengthOptions& options, std::vector<Complex>& amplitudes) {
  amplitudes.clear();
  const double factor = over_direct(view.line.elevation_rad, carrier_hz, antenna);
  for (const propagation::Path& path : view.paths.paths)
    amplitudes.push_back(received(path, carrier_hz, antenna, options) * factor);
}

void visit(options::Visitor& v, StrengthOptions& o) {
  v.boolean({"slabs", "", "facades are slabs of their material's thickness; false: half spaces"}, o.slabs);
}

}  // namespace canyon::signal
