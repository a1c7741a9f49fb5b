#include "canyon/paths/disturbance/faults/transmitter.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "canyon/paths/signal/radio_materials.hpp"

namespace canyon::disturbance {

namespace {

using Eigen::Vector3d;

/// A point near the straight line: `along` it from the transmitter, `over` it to the side of the profile [m].
struct Station {
  double along = 0, over = 0;
};

/// Bullington's equivalent edge of a profile; over >= 0 if it blocks the line. If the whole profile is below
/// the line: its station closest to the line in Fresnel zones.
Station equivalent_edge(std::span<const Station> profile, double length_m) {
  double from_here = -1e300, from_there = -1e300, nearest = -1e300;
  Station result{length_m / 2, -1e9};
  for (const Station& s : profile) {
    const double left_m = length_m - s.along;
    from_here = std::max(from_here, s.over / s.along);
    from_there = std::max(from_there, s.over / left_m);
    const double zones = s.over / std::sqrt(s.along * left_m);
    if (zones > nearest) nearest = zones, result = s;
  }
  if (!(from_here > 0 && from_there > 0)) return result;
  const double along = length_m * from_there / (from_here + from_there);
  return {along, from_here * along};
}

double edge_loss_db(const Station& edge, double length_m, double wavelength_m) {
  const double detour_m =
      std::hypot(edge.along, edge.over) + std::hypot(length_m - edge.along, edge.over) - length_m;
  return propagation::approximate_knife_edge_loss_db(
      propagation::signed_knife_edge_nu(std::max(0.0, detour_m), wavelength_m, edge.over >= 0));
}

/// Line from transmitter to antenna, with the axes of its profiles.
struct Line {
  Vector3d from, direction;
  double length_m;

  [[nodiscard]] Vector3d at(double along) const { return from + along * direction; }
};

/// The surfaces below and above the line, seen from above.
/// @param walls on the line, along it: surfaces thinner than the spacing
std::vector<Station> profile_from_above(const raytrace::RayScene& rays, const Line& line, double top_m,
                                        std::span<const double> walls) {
  constexpr double kSpacing_m = 0.25;
  constexpr int kMin = 16, kMax = 512;
  const int count = std::clamp(static_cast<int>(line.length_m / kSpacing_m), kMin, kMax);
  const double level = std::hypot(line.direction.x(), line.direction.y());
  std::vector<Station> profile;
  profile.reserve(static_cast<std::size_t>(count) + walls.size());
  const auto look_angles = [&](double along) {
    const Vector3d on_line = line.at(along);
    const Vector3d above(on_line.x(), on_line.y(), std::max(top_m, on_line.z()) + 1);
    const auto hit = rays.cast({above, -Vector3d::UnitZ()});
    if (!hit) return;
    const double over = above.z() - hit->range_m - on_line.z();
    const Station s{along + over * line.direction.z(), over * level};
    if (s.along > 0 && s.along < line.length_m) profile.push_back(s);
  };
  for (int i = 0; i < count; ++i) look_angles(line.length_m * (i + 0.5) / count);
  for (const double along : walls) look_angles(along);
  return profile;
}

/// Walls to one side of a blocked line, if they begin on it. @param side unit, across the line
std::vector<Station> profile_aside(const raytrace::RayScene& rays, const Line& line, const Vector3d& side,
                                   double first_m, double last_m) {
  constexpr int kStations = 24;
  std::vector<Station> profile;
  for (int i = 0; i < kStations; ++i) {
    const double along = first_m + (last_m - first_m) * (i + 0.02) / (kStations - 0.96);
    const auto hit = rays.cast({line.at(along), side});
    if (hit && !hit->front) profile.push_back({along, hit->range_m});
  }
  return profile;
}

bool clear(const raytrace::RayScene& rays, const Vector3d& from, const Vector3d& to) {
  const Vector3d direction = to - from;
  const double length_m = direction.norm(), end_m = rays.surface_offset_m(from) + rays.surface_offset_m(to);
  return length_m <= end_m || !rays.occluded({from, direction / length_m, length_m - end_m}, end_m);
}

double obstruction_db(const raytrace::RayScene& rays, const Line& line, double top_m, double wavelength_m) {
  const Vector3d antenna = line.at(line.length_m);
  const bool in_sight = clear(rays, line.from, antenna);
  std::vector<double> walls;
  const auto first = rays.cast({line.from, line.direction, line.length_m}, rays.surface_offset_m(line.from));
  const auto last = rays.cast({antenna, -line.direction, line.length_m}, rays.surface_offset_m(antenna));
  constexpr double kInside_m = 0.01;
  if (first) walls.push_back(first->range_m + kInside_m);
  if (last) walls.push_back(line.length_m - last->range_m - kInside_m);
  Station over = equivalent_edge(profile_from_above(rays, line, top_m, walls), line.length_m);
  if (in_sight) {
    // A surface above a clear line is a bridge or a roof.
    return over.over < 0 ? edge_loss_db(over, line.length_m, wavelength_m) : 0;
  }
  over.over = std::max(over.over, 0.0);
  double power = std::pow(10, -edge_loss_db(over, line.length_m, wavelength_m) / 10);

  const Vector3d across = line.direction.cross(Vector3d::UnitZ());
  if (first && last && across.norm() > 1e-6) {
    for (const double sign : {1.0, -1.0}) {
      const Vector3d side = sign * across.normalized();
      const std::vector<Station> aside =
          profile_aside(rays, line, side, first->range_m, line.length_m - last->range_m);
      if (aside.empty()) continue;
      const Station edge = equivalent_edge(aside, line.length_m);
      constexpr double kLateralOffset_m = 0.05;
      const Vector3d corner = line.at(edge.along) + (edge.over + kLateralOffset_m) * side;
      if (!clear(rays, line.from, corner) || !clear(rays, corner, antenna)) continue;
      power += std::pow(10, -edge_loss_db(edge, line.length_m, wavelength_m) / 10);
    }
  }
  return -10 * std::log10(power);
}

}  // namespace

void visit(options::Visitor& v, BeamOptions& o) {
  v.number({"width_deg", "deg", "width between the directions of half power; none: isotropic"}, o.width_deg,
           options::or_none({0, 360, true}));
  v.number({"azimuth_deg", "deg", "azimuth of the axis, from north, clockwise"}, o.azimuth_deg,
           {0, 360, false, true});
  v.number({"elevation_deg", "deg", "elevation of the axis"}, o.elevation_deg, {-90, 90});
}

double beam_gain_db(const BeamOptions& beam, const Vector3d& direction) {
  if (std::isinf(beam.width_deg)) return 0;
  const Vector3d axis = geodesy::enu_from_azimuth_elevation(geodesy::radians(beam.azimuth_deg),
                                                            geodesy::radians(beam.elevation_deg));
  const double off_deg = geodesy::degrees(std::atan2(axis.cross(direction).norm(), axis.dot(direction)));
  return -std::min(12 * std::pow(off_deg / beam.width_deg, 2), BeamOptions::kFrontToBack_db);
}

void TransmitterOptions::validate() const {
  course.validate();
  options::check(beam, "beam");
  if (!course.given()) throw InputError("a transmitter has no position", "give position or waypoints");
}

void visit(options::Visitor& v, TransmitterOptions& o) {
  visit(v, o.course);
  v.part("beam", o.beam);
}

Transmitter::Transmitter(const TransmitterOptions& options, const FaultContext& context)
    : course_((options.validate(), options.course),
              (context.city ? context.city : throw InputError("a transmitter needs a city"))->frame,
              context.begin),
      beam_(options.beam),
      rays_(context.rays),
      city_(context.city),
      facets_(std::make_shared<propagation::FacetSet>(context.city->mesh, false)) {
  if (!context.city->mesh.vertices.empty()) top_m_ = context.city->bounds().max.z();
}

TransmitterPath Transmitter::shortest_path(geodesy::GpsTime time, const Vector3d& antenna_enu,
                                           double frequency_hz) const {
  const Vector3d from = position(time), between = antenna_enu - from;
  const double wavelength_m = geodesy::kSpeedOfLight / frequency_hz;
  TransmitterPath path;
  path.length_m = between.norm();
  const Vector3d direction = path.length_m > 0 ? Vector3d(between / path.length_m) : -Vector3d::UnitZ();
  path.arrival = -direction;
  if (rays_ && path.length_m > wavelength_m)
    path.obstruction_db = obstruction_db(*rays_, {from, direction, path.length_m}, top_m_, wavelength_m);
  const double far_m = std::max(path.length_m, wavelength_m);
  path.gain_db = beam_gain_db(beam_, direction) - 20 * std::log10(4 * geodesy::kPi * far_m / wavelength_m) -
                 path.obstruction_db;
  return path;
}

std::vector<TransmitterPath> Transmitter::paths(geodesy::GpsTime time, const Vector3d& antenna,
                                                double frequency_hz) const {
  std::vector<TransmitterPath> result{shortest_path(time, antenna, frequency_hz)};
  if (!rays_) return result;
  const Vector3d from = position(time);
  const double wavelength_m = geodesy::kSpeedOfLight / frequency_hz;
  propagation::NearFacets near;
  constexpr double kClearance_m = 0.01;
  facets_->gather(antenna, 0, kReach_m, near);
  for (const std::uint32_t index : near.facet) {
    const propagation::Facet& facet = facets_->facets()[index];
    const double here_m = facet.normal.dot(antenna) - facet.offset;
    const double there_m = facet.normal.dot(from) - facet.offset;
    if (here_m <= kClearance_m + 2 * facet.deviation || there_m < kClearance_m) continue;
    const Vector3d image = from - 2 * there_m * facet.normal;
    const Vector3d point = antenna + here_m / (here_m + there_m) * (image - antenna);
    if ((point - antenna).norm() > kReach_m) continue;
    const auto triangle = facets_->triangle_at(facet, point);
    if (!triangle) continue;
    const Vector3d lifted = point + (rays_->surface_offset_m(point) + facet.deviation) * facet.normal;
    if (!clear(*rays_, antenna, lifted) || !clear(*rays_, lifted, from)) continue;

    TransmitterPath& found = result.emplace_back();
    found.length_m = (image - antenna).norm();
    found.arrival = (point - antenna).normalized();
    const signal::LinearReflection wall = signal::reflect_half_space(
        signal::complex_permittivity(signal::radio_material(city_->mesh.materials[*triangle]), frequency_hz),
        std::acos(std::min(1.0, facet.normal.dot(-found.arrival))));
    const double fraction = (std::norm(wall.perpendicular) + std::norm(wall.parallel)) / 2;
    found.obstruction_db = -10 * std::log10(fraction);
    found.gain_db = beam_gain_db(beam_, (point - from).normalized()) -
                    20 * std::log10(4 * geodesy::kPi * found.length_m / wavelength_m) - found.obstruction_db;
    found.reflector = propagation::reflector_id(propagation::PathKind::Reflected, {0, index});
  }
  return result;
}

namespace {

using propagation::Polarisation;
using Shape = propagation::Spectrum::Shape;

// Sweeps of some 10 to 20 MHz in some 10 microseconds: R. H. Mitch et al., Signal Characteristics of Civil
// GPS Jammers, ION GNSS 2011; powers within those measured there.
constexpr std::array<std::string_view, 3> kPresets{"privacy_l1", "privacy_l1_l2", "noise_l1"};

std::vector<EmissionOptions> emissions_of(const JammingOptions& o) {
  EmissionOptions chirp;
  chirp.spectrum.shape = Shape::Chirp;
  EmissionOptions second = chirp;
  second.spectrum.centre_hz = 1227.6e6;
  EmissionOptions noise;
  noise.power_dbm = 30;
  if (o.preset == "privacy_l1") return {chirp};
  if (o.preset == "privacy_l1_l2") return {chirp, second};
  if (o.preset == "noise_l1") return {noise};
  return o.emissions;
}

}  // namespace

void visit(options::Visitor& v, EmissionOptions& o) {
  static constexpr std::string_view kShapes[]{"noise", "tone", "chirp"};
  v.choice({"shape", "", "noise (flat), chirp (saw-tooth sweep) or tone"}, o.spectrum.shape, kShapes);
  v.number({"centre_hz", "Hz", "centre of the band, or frequency of the tone"}, o.spectrum.centre_hz,
           {1e9, 2e9});
  v.number({"width_hz", "Hz", "width of noise or of a chirp's sweep"}, o.spectrum.width_hz, {0, 200e6, true});
  v.number({"period_s", "s", "period of a chirp's sweep"}, o.spectrum.period_s, {1e-7, 1e-2});
  v.number({"power_dbm", "dBm", "equivalent isotropically radiated power on the beam's axis"}, o.power_dbm,
           {-100, 100});
}

void JammingOptions::validate() const {
  options::check(*this, "jammer");
  transmitter.validate();
  for (const EmissionOptions& each : emissions) options::check(each, "emission");
  if (preset.empty() == emissions.empty()) {
    throw InputError(preset.empty() ? "a jammer has no emissions" : "a jammer has a preset and emissions",
                     fmt::format("give emissions, or a preset: {}", fmt::join(kPresets, ", ")));
  }
}

void visit(options::Visitor& v, JammingOptions& o) {
  static constexpr std::string_view kPolarisations[]{"right", "left", "linear"};
  visit(v, o.transmitter);
  v.choice({"polarisation", "", "polarization of its antenna: right, left (circular) or linear"},
           o.polarisation, kPolarisations);
  v.one_of({"preset", "emissions"});
  v.word(
      {"preset", "",
       "a kind of jammer: privacy_l1 (chirp of 20 MHz and 10 us, 10 dBm), privacy_l1_l2 (the same on L2 as "
       "well), noise_l1 (20 MHz, 30 dBm)",
       "none"},
      o.preset, kPresets);
  v.list("emissions", o.emissions, [&](EmissionOptions& each) { visit(v, each); });
}

Jamming::Jamming(const JammingOptions& options, FaultContext context)
    : polarisation_(options.polarisation), transmitter_(options.transmitter, context) {
  options.validate();
  emissions_ = emissions_of(options);
}

void Jamming::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  for (const EmissionOptions& each : emissions_) {
    propagation::Interference wave;
    wave.spectrum = each.spectrum;
    if (each.spectrum.shape == Shape::Tone) wave.spectrum.width_hz = 0;
    if (each.spectrum.shape != Shape::Chirp) wave.spectrum.period_s = 0;
    wave.polarisation = polarisation_;
    for (const TransmitterPath& path :
         transmitter_.paths(antenna.time, arrival.antenna_enu, each.spectrum.centre_hz)) {
      wave.power_dbw = each.power_dbm - 30 + path.gain_db;
      wave.arrival = path.arrival;
      arrival.interference.push_back(wave);
    }
  }
}

}  // namespace canyon::disturbance
