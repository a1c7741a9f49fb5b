#include "canyon/paths/propagation/propagation_options.hpp"

#include "canyon/base/options/values.hpp"

namespace canyon::propagation {
namespace {

constexpr options::Range kReach_m{0, 100e3, true};

}  // namespace

void DiffractionOptions::validate() const {
  edges.validate();
  options::check(*this, "diffraction.");
}

void visit(options::Visitor& v, DiffractionOptions& o) {
  v.number({"frequency_hz", "Hz", ""}, o.frequency_hz, {1e8, 1e11});
  v.number({"max_range_m", "m", "largest distance from the antenna to an edge"}, o.max_range_m, kReach_m);
  v.angle({"max_bending_deg", "deg", "largest angle between that leg and the direction to the satellite"},
          o.max_bending_rad, {0, 180, true});
  v.number({"max_loss_db", "dB", "largest loss of a path that is kept"}, o.max_loss_db, {7, 100});
  v.number({"edge_radius_m", "m", "radius of rounded edges (ITU-R P.526, 4.2); 0: knife edges"},
           o.edge_radius_m, {0, 100});
  v.number(
      {"max_clear_nu", "", "if the line of sight is clear: largest Fresnel-Kirchhoff parameter of an edge"},
      o.max_clear_nu, {0, 100});
  v.integer({"max_paths", "", "largest number of these paths of one satellite, the strongest ones"},
            o.max_paths, 1, 100);
  visit(v, o.edges);
}

void DiffuseOptions::validate() const {
  options::check(*this, "diffuse.");
}

void visit(options::Visitor& v, DiffuseOptions& o) {
  v.integer({"rays", "", "number of directions in which facades are searched"}, o.rays, 8, 4096);
  v.number({"scattering_coefficient", "",
            "scattered amplitude, divided by the amplitude that a smooth wall reflects"},
           o.scattering_coefficient, {0, 1});
  v.number({"wall_reflectance", "", "share of power that smooth walls reflect; left out: by material"},
           o.wall_reflectance, {0, 1});
  v.integer({"bounces", "", "largest number of facades on a path, one of which scatters"}, o.bounces, 1, 8);
  v.integer(
      {"lobe_exponent", "",
       "exponent of the lobe; 0: Lambert's; larger: about the mirror's direction, 3 to 4 by measurements"},
      o.lobe_exponent, 0, 20);
  v.angle({"lowest_elevation_deg", "deg", "lowest elevation of these directions"}, o.lowest_elevation_rad,
          {-90, 90, false, true});
  v.number({"max_range_m", "m", "largest length of these rays"}, o.max_range_m, kReach_m);
  v.number({"min_power_db", "dB", "weakest power of a path, relative to the line of sight"}, o.min_power_db,
           {-100, 0});
  v.number({"class_m", "m", "width of the classes of excess path in which paths are added"}, o.class_m,
           {0.1, 100e3});
  v.integer({"max_paths", "", "largest number of classes of one satellite, the strongest ones"}, o.max_paths,
            1, 64);
  v.number({"strength_sigma_db", "dB", "standard deviation of the strengths of pieces of facades; 0: none"},
           o.strength_sigma_db, {0, 30});
  v.number({"strength_median_db", "dB", "median of these strengths"}, o.strength_median_db, {-30, 30});
  v.number({"strength_piece_m", "m", "length of such a piece"}, o.strength_piece_m, {0, 1000, true});
  v.number(
      {"glint_sigma", "rad",
       "angle between a mirror's point and what leads on a piece of facade, which Dopplers show; 0: mirrors"},
      o.glint_sigma, {0, 1});
}

void PropagationOptions::validate() const {
  edges.validate();
  scattering.validate();
  options::check(*this);
}

DiffractionOptions PropagationOptions::default_edges() {
  DiffractionOptions options;
  options.max_clear_nu = 2;
  return options;
}

void visit(options::Visitor& v, PropagationOptions& o) {
  static constexpr std::string_view kModels[]{"specular", "mirror"};
  v.choice({"model", "",
            "specular: image method on planar facets; mirror: the paper's algorithm 2 (one mirror ray)"},
           o.model, kModels);
  v.integer({"reflection_order", "",
             "largest number of reflections on a path: 0 (direct signal only), 1 or 2; specular only"},
            o.reflection_order, 0, 2);
  v.number(
      {"max_range_m", "m",
       "largest length of the mirror ray, and of the way from the antenna to the (last) reflection point"},
      o.max_range_m, kReach_m);
  v.angle({"max_incidence_deg", "deg",
           "largest angle of incidence of a reflection, from the facade's normal; specular only"},
          o.max_incidence_rad, {0, 90, true});
  v.boolean({"ground_reflection", "", "reflections on terrain too; specular only"}, o.ground_reflection);
  v.section("diffraction", [&] {
    v.boolean({"enabled", "", "paths around single edges of roofs and walls; specular only"}, o.diffraction);
    visit(v, o.edges);
    v.validate(o.edges);
  });
  v.section("diffuse", [&] {
    v.boolean({"enabled", "", "diffuse scattering by facades; specular only"}, o.diffuse);
    visit(v, o.scattering);
    v.validate(o.scattering);
  });
  v.boolean(
      {"through_foliage", "", "vegetation weakens the direct signal instead of blocking it; specular only"},
      o.through_foliage);
  v.number({"retrace_interval_s", "s",
            "reflections of the second order, diffuse paths and the choice of edges are found anew so often, "
            "and go along with antenna and satellites in between; 0: anew in every epoch"},
           o.retrace_interval_s, {0, 10});
  v.number({"retrace_distance_m", "m", "they are found anew, too, where the antenna has gone so far"},
           o.retrace_distance_m, {0, 10});
}

}  // namespace canyon::propagation
