#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "canyon/buildings/sources/map_data.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::buildings {

/// Appends ready-made surfaces (CityGML, CityJSON) as one object of Surface::Building in `frame`: planar
/// polygons with holes triangulated in their plane, vertices within 1 mm made one, front sides outwards (each
/// connected closed shell is turned where its volume is negative). Materials by semantic: RoofSurface `roof`,
/// Window Glass, all else `facade`; windows and doors are cut out of walls that they lie in (cut_openings()).
/// ClosureSurfaces only close the shell: nothing is there in reality, and they are not built. Surfaces whose
/// rings cross or touch along edges are repaired, those without an area (below 1e-6 m^2) are left out;
/// `notes` says how many, and where the result is not watertight; lines begin with `name`. Returns whether an
/// object was added.
[[nodiscard]] bool append_surfaces(city::Mesh& mesh, const std::string& name,
                                   const std::vector<MapSurface>& surfaces, const geodesy::LocalFrame& frame,
                                   std::vector<std::string>& notes,
                                   city::Material facade = city::Material::Concrete,
                                   city::Material roof = city::Material::Concrete);

/// A surface of a building in its frame [m].
struct LocalSurface {
  std::vector<Eigen::Vector3d> outer;
  std::vector<std::vector<Eigen::Vector3d>> inners;
  std::string semantic;
};

/// Repairs a surface whose rings cross themselves or each other, or touch along edges, by repair() in its
/// plane. The result may be empty.
[[nodiscard]] std::vector<LocalSurface> mended(const LocalSurface& surface);

/// Takes windows and doors (by their semantics) out of the surfaces that they lie in, so that nothing is
/// there twice: many files draw them on walls without a hole. They lie in a surface where they are within 5
/// cm of its plane and half of their area is inside. A surface may become several, or none.
void cut_openings(std::vector<LocalSurface>& surfaces);

}  // namespace canyon::buildings
