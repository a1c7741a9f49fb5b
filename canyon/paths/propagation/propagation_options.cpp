#include "canyon/paths/propagation/propagation_options.hpp"

#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::propagation {
namespace {

constexpr options::Range kReach_m{0, 100e3, true};

}  // namespace

void DiffractionOptions::validate() const {
  options::check(*this, "diffraction.");
}

void visit(options::Visitor& v, DiffractionOptions& o) {
  v.number({"max_range_m", "m", "largest distance from the antenna to an edge"}, o.max_range_m, kReach_m);
  v.number({"edge_radius_m", "m", "radius of rounded edges (ITU-R P.526, 4.2); 0: knife edges"},
           o.edge_radius_m, {0, 100});
  v.boolean({"terrain", "", "crests of the terrain too"}, o.terrain);
}

void DiffuseOptions::validate() const {
  options::check(*this, "diffuse.");
}

void visit(options::Visitor& v, DiffuseOptions& o) {
  v.number({"scattering_coefficient", "",
            "scattered amplitude, divided by the amplitude that a smooth wall reflects"},
           o.scattering_coefficient, {0, 1});
  v.integer({"bounces", "", "largest number of facades on a path, at least one of which scatters"}, o.bounces,
            1, 8);
  v.number({"max_range_m", "m", "largest length of these rays"}, o.max_range_m, kReach_m);
  v.number({"scattering_angle_sigma_rad", "rad",
            "angle between the specular point and the scattering centre of a piece of facade, visible in "
            "Dopplers; 0: mirrors"},
           o.glint_sigma, {0, 1});
  v.former_name("glint_sigma", "scattering_angle_sigma_rad");
}

void PropagationOptions::validate() const {
  edges.validate();
  scattering.validate();
  options::check(*this);
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
       "largest length of the mirror ray, and of the path from the antenna to the (last) reflection point"},
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
            "interval between searches for reflections of the second order, diffuse paths and edges; in "
            "between, paths are updated for the motion of antenna and satellites; 0: search in every epoch"},
           o.retrace_interval_s, {0, 10});
  v.number({"retrace_distance_m", "m", "distance of the antenna from the last search that starts a new one"},
           o.retrace_distance_m, {0, 10});
}

}  // namespace canyon::propagation
