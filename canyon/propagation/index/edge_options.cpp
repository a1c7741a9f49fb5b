#include "canyon/propagation/index/edge_options.hpp"

#include "canyon/options/values.hpp"

namespace canyon::propagation {

void EdgeOptions::validate() const {
  options::check(*this, "edges.");
}

void visit(options::Visitor& v, EdgeOptions& o) {
  v.boolean({"terrain", "", "crests of the terrain too"}, o.terrain);
  v.boolean({"free_edges", "", "rims of sheets and of open meshes too"}, o.free_edges);
  v.angle({"min_turn_deg", "deg", "smallest angle between the faces of an edge"}, o.min_turn_rad,
          {0.0573, 90});
}

}  // namespace canyon::propagation
