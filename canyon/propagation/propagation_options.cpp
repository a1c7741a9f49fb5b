#include "canyon/propagation/propagation_options.hpp"

#include "canyon/options/values.hpp"

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
  v.number({"max_range_m", "m", "reach of the leg from antenna to edge"}, o.max_range_m, kReach_m);
  v.angle({"max_bending_deg", "deg", "largest angle between that leg and the direction to the satellite"},
          o.max_bending_rad, {0, 180, true});
  v.number({"max_loss_db", "dB", "largest loss of a path that is kept"}, o.max_loss_db, {7, 100});
  v.number({"edge_radius_m", "m", "edges are rounded with, by ITU-R P.526, 4.2; 0: knife edges"},
           o.edge_radius_m, {0, 100});
  v.number({"max_clear_nu", "",
            "with the straight line clear, edges up to this Fresnel-Kirchhoff parameter from it"},
           o.max_clear_nu, {0, 100});
  v.integer({"max_paths", "", "of one satellite, the strongest ones"}, o.max_paths, 1, 100);
  visit(v, o.edges);
}

void DiffuseOptions::validate() const {
  options::check(*this, "diffuse.");
}

void visit(options::Visitor& v, DiffuseOptions& o) {
  v.integer({"rays", "", "directions that facades are looked for in"}, o.rays, 8, 4096);
  v.number(
      {"scattering_coefficient", "", "amplitude scattered over amplitude that a smooth wall would reflect"},
      o.scattering_coefficient, {0, 1});
  v.number(
      {"wall_reflectance", "", "power that smooth walls would reflect; left out: by each one's material"},
      o.wall_reflectance, {0, 1});
  v.integer({"bounces", "", "facades on a way at most, one of which scatters"}, o.bounces, 1, 8);
  v.integer(
      {"lobe_exponent", "", "0: Lambert's lobe; more: about the mirror's direction, 3 to 4 by measurements"},
      o.lobe_exponent, 0, 20);
  v.angle({"lowest_elevation_deg", "deg", "nothing is looked for below"}, o.lowest_elevation_rad,
          {-90, 90, false, true});
  v.number({"max_range_m", "m", "reach of these rays"}, o.max_range_m, kReach_m);
  v.number({"min_power_db", "dB", "paths farther below the line of sight are dropped"}, o.min_power_db,
           {-100, 0});
  v.number({"class_m", "m", "width of the classes of detour that ways are gathered in"}, o.class_m,
           {0.1, 100e3});
  v.integer({"max_paths", "", "classes of one satellite, the strongest ones"}, o.max_paths, 1, 64);
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
             "reflections on a path at most: 0 (direct signal only), 1 or 2; specular only"},
            o.reflection_order, 0, 2);
  v.number({"max_range_m", "m",
            "reach of the mirror ray, and of the way from antenna to the (last) reflection point"},
           o.max_range_m, kReach_m);
  v.angle({"max_incidence_deg", "deg",
           "largest angle of incidence of a reflection, from the facade's normal; specular only"},
          o.max_incidence_rad, {0, 90, true});
  v.boolean({"ground_reflection", "", "reflect from terrain as well; specular only"}, o.ground_reflection);
  v.section("diffraction", [&] {
    v.boolean({"enabled", "", "paths around single edges of roofs and walls; specular only"}, o.diffraction);
    visit(v, o.edges);
    v.validate(o.edges);
  });
  v.section("diffuse", [&] {
    v.boolean({"enabled", "", "scattering by facades that are no mirrors; specular only"}, o.diffuse);
    visit(v, o.scattering);
    v.validate(o.scattering);
  });
  v.boolean(
      {"through_foliage", "", "vegetation weakens the direct signal instead of blocking it; specular only"},
      o.through_foliage);
}

}  // namespace canyon::propagation
