#include "canyon/city/mesh_import_options.hpp"

#include "canyon/base/input_error.hpp"
#include "canyon/options/values.hpp"

namespace canyon::city {

void MeshImportOptions::validate() const {
  geodesy::check_geodetic(origin, "city origin");
  if (!offset_m.allFinite() || offset_m.norm() > 1e6) {
    throw InputError("city offset must be finite and at most 1,000 km",
                     "give east_m, north_m and up_m in metres");
  }
  options::check(*this, "city mesh");
}

void visit(options::Visitor& v, MeshImportOptions& o) {
  static constexpr std::string_view kAxes[]{"Y", "Z"};
  constexpr options::Range kLocal_m{-1e6, 1e6};
  v.section("offset", [&] {
    v.number({"east_m", "m", "moves the mesh eastwards in its ENU frame"}, o.offset_m.x(), kLocal_m);
    v.number({"north_m", "m", "moves it northwards"}, o.offset_m.y(), kLocal_m);
    v.number({"up_m", "m", "moves it upwards"}, o.offset_m.z(), kLocal_m);
  });
  v.angle({"heading_deg", "deg", "turns the mesh counter-clockwise seen from above"}, o.heading_rad,
          {-360, 360});
  v.number({"scale", "", "scale factor in addition to the unit that the file declares"}, o.scale,
           {0, 1e6, true});
  std::string axis = o.up_axis ? std::string(1, *o.up_axis) : "";
  v.word({"up_axis", "", "up axis, Y or Z, if the file has none or a wrong one", "the file's"}, axis, kAxes);
  if (v.reads() && !axis.empty()) o.up_axis = axis.front();
  v.texts({"terrain_names", "", "words in node names that mark terrain"}, o.terrain_names);
}

}  // namespace canyon::city
