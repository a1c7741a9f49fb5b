#include "canyon/city/buildings/sources/geoid.hpp"

#include <fmt/format.h>

#include <GeographicLib/Geoid.hpp>
#include <array>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <utility>

#include "canyon/base/input_error.hpp"

namespace canyon::buildings {
namespace {

struct KnownGeoid {
  int epsg;                                  ///< of the vertical reference system
  std::array<const char*, 3> geographiclib;  ///< file names, finest first
};
/// EPSG's codes with the names of GeographicLib's data sets (documentation of its class Geoid). The 1' grid
/// of EGM2008 is last: it is slow to open and differs from 5' by millimetres to centimetres. In the order of
/// GeoidModel, after ByFile.
constexpr std::array<KnownGeoid, 3> kKnownGeoids{{{5798, {"egm84-15", "egm84-30", ""}},
                                                  {5773, {"egm96-5", "egm96-15", ""}},
                                                  {3855, {"egm2008-2_5", "egm2008-5", "egm2008-1"}}}};

constexpr const char* kGridHint =
    "give the geoid's undulation at this position in metres (geoid_undulation_m, --geoid-undulation), or "
    "install the grid (Debian: proj-data for EGM96; others: geographiclib-get-geoids or projsync)";

std::unique_ptr<GeographicLib::Geoid> geographiclib_geoid(int epsg) {
  for (const KnownGeoid& known : kKnownGeoids) {
    if (known.epsg != epsg) continue;
    for (const char* name : known.geographiclib) {
      if (*name == '\0') continue;
      try {
        return std::make_unique<GeographicLib::Geoid>(name);
      } catch (const GeographicLib::GeographicErr&) {
        continue;  // not installed
      }
    }
  }
  return nullptr;
}

/// "EGM96 height (EPSG:5773)".
std::string vertical_name(OGRSpatialReferenceH reference) {
  const char* name = OSRGetAttrValue(reference, "VERT_CS", 0);
  const char* authority = OSRGetAuthorityName(reference, "VERT_CS");
  const char* code = OSRGetAuthorityCode(reference, "VERT_CS");
  std::string text = name != nullptr ? name : "unnamed heights";
  if (authority != nullptr && code != nullptr) text += fmt::format(" ({}:{})", authority, code);
  return text;
}

}  // namespace

struct Geoid::Grid {
  std::filesystem::path file;
  std::string name;
  gdal::Transformation compound_from_wgs84;             ///< PROJ's operation,
  double metres_per_unit = 1;                           ///< of its heights, or
  std::unique_ptr<GeographicLib::Geoid> geographiclib;  ///< GeographicLib's
  std::mutex mutex;                                     ///< both are not thread-safe
};

Geoid::~Geoid() = default;
Geoid::Geoid(Geoid&&) noexcept = default;
Geoid& Geoid::operator=(Geoid&&) noexcept = default;

Geoid::Geoid(const Heights& heights) {
  const std::string file = heights.file.filename().string();
  gdal::SpatialReference reference;
  if (heights.reference != nullptr) reference.reset(OSRClone(heights.reference));
  const bool compound = reference && OSRIsCompound(reference.get()) != 0;
  const bool ellipsoidal = reference && !compound && OSRGetAxesCount(reference.get()) == 3;
  if (heights.metres_per_unit) {
    metres_per_unit_ = *heights.metres_per_unit;
  } else if (compound) {
    metres_per_unit_ = OSRGetTargetLinearUnits(reference.get(), "VERT_CS", nullptr);
  } else if (reference && !ellipsoidal && OSRIsProjected(reference.get()) != 0) {
    char* unit = nullptr;
    metres_per_unit_ = OSRGetLinearUnits(reference.get(), &unit);
    if (std::abs(metres_per_unit_ - 1) > 1e-9) {
      unit_note_ = fmt::format("{}: heights read in the unit of {}, {} ({:.9g} m), because no unit is given",
                               file, OSRGetName(reference.get()), unit, metres_per_unit_);
    }
  }
  const bool by_user = !compound && !ellipsoidal && heights.prescribed.empty();
  std::string datum = heights.prescribed;
  if (const GeoidModel model = heights.options.geoid; by_user && model != GeoidModel::ByFile)
    datum = fmt::format("EPSG:4326+{}", kKnownGeoids.at(static_cast<std::size_t>(model) - 1).epsg);
  bool prescribed = false;
  if (!compound && !ellipsoidal && !datum.empty()) {
    reference = gdal::spatial_reference(datum);
    prescribed = true;
  }
  const bool above_datum = (compound || prescribed) && reference;
  if (above_datum) {
    OSRSetAxisMappingStrategy(reference.get(), OAMS_TRADITIONAL_GIS_ORDER);
    OGRAxisOrientation up = OAO_Up;
    OSRGetAxis(reference.get(), "VERT_CS", 0, &up);
    if (up == OAO_Down) {
      throw InputError(heights.file, 0,
                       fmt::format("{} are depths, not heights", vertical_name(reference.get())),
                       "convert them to heights first");
    }
  }
  if (heights.options.geoid_undulation_m) {
    constant_m_ = *heights.options.geoid_undulation_m;
    above_sea_level_ = true;
    note_ = fmt::format("{}: {:.3f} m added to heights (geoid undulation as given)", file, constant_m_);
    return;
  }
  if (!above_datum && !ellipsoidal) {
    guessed_ = true;
    note_ = fmt::format(
        "{}: heights read as ellipsoidal, because its reference system names no vertical datum", file);
    return;
  }
  auto grid = std::make_unique<Grid>();
  grid->file = heights.file;
  const gdal::SpatialReference wgs84 = gdal::spatial_reference("EPSG:4979");
  if (ellipsoidal) {
    // The datum may be another one: the difference is some metres, from PROJ's Helmert transformation.
    OSRSetAxisMappingStrategy(reference.get(), OAMS_TRADITIONAL_GIS_ORDER);
    note_ = fmt::format("{}: heights are ellipsoidal by its reference system", file);
    grid->name = "ellipsoidal heights";
    grid->compound_from_wgs84 = gdal::transformation(wgs84.get(), reference.get(), false);
    if (grid->compound_from_wgs84) grid_ = std::move(grid);
    return;
  }
  grid->name = vertical_name(reference.get());
  grid->metres_per_unit = OSRGetTargetLinearUnits(reference.get(), "VERT_CS", nullptr);
  const std::string why =
      !prescribed ? grid->name : grid->name + (by_user ? ", as given" : ", as its format prescribes");
  grid->compound_from_wgs84 = gdal::transformation(wgs84.get(), reference.get(), false);
  if (grid->compound_from_wgs84) {
    note_ = fmt::format("{}: heights above {}; geoid added by PROJ's grid", file, why);
  } else {
    const char* code = OSRGetAuthorityCode(reference.get(), "VERT_CS");
    grid->geographiclib = geographiclib_geoid(code != nullptr ? std::atoi(code) : 0);
    if (!grid->geographiclib && !by_user && heights.options.geoid != GeoidModel::ByFile) {
      *this = Geoid(Heights{heights.file, nullptr, {}, metres_per_unit_, heights.options, true});
      note_ += fmt::format("; the file's own, {}, has no grid installed", why);
      return;
    }
    if (!grid->geographiclib && !heights.required && !by_user) {
      guessed_ = true;
      note_ = fmt::format(
          "{}: heights above {} are read as ellipsoidal (errors of tens of metres in many areas), because no "
          "geoid grid for it is installed; {}",
          file, why, kGridHint);
      return;
    }
    if (!grid->geographiclib) {
      throw InputError(heights.file, 0,
                       fmt::format("heights are above {}, and no geoid grid for it is installed", why),
                       kGridHint);
    }
    note_ = fmt::format("{}: heights above {}; geoid added by GeographicLib's {}", file, why,
                        grid->geographiclib->GeoidName());
  }
  grid_ = std::move(grid);
  above_sea_level_ = true;
}

double Geoid::undulation_m(const LonLat& point) const {
  if (!grid_) return constant_m_;
  const std::lock_guard lock(grid_->mutex);
  if (grid_->geographiclib) {
    try {
      return (*grid_->geographiclib)(point.y(), longitude_near(point.x(), 0));
    } catch (const GeographicLib::GeographicErr& e) {
      throw InputError(grid_->file, 0, fmt::format("geoid of {}: {}", grid_->name, e.what()), kGridHint);
    }
  }
  // A point on the ellipsoid is N below the geoid. Systems in feet give results in feet.
  const gdal::Quiet quiet;
  double x = longitude_near(point.x(), 0);
  double y = point.y();
  double z = 0;
  int ok = 0;
  if (OCTTransformEx(grid_->compound_from_wgs84.get(), 1, &x, &y, &z, &ok) == 0 || ok == 0 ||
      !std::isfinite(z)) {
    throw InputError(grid_->file, 0,
                     fmt::format("the grid of {} does not cover longitude {:.5f}, latitude {:.5f}",
                                 grid_->name, point.x(), point.y()),
                     kGridHint);
  }
  return -z * grid_->metres_per_unit;
}

double geoid_undulation_m(GeoidModel model, const LonLat& point) {
  Geoid::Heights heights;
  heights.file = "geoid";
  heights.options.geoid = model;
  return Geoid(heights).undulation_m(point);
}

}  // namespace canyon::buildings
