#include "canyon/buildings/sources/reference_system.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <limits>

#include "canyon/base/input_error.hpp"

namespace canyon::buildings {

std::string reference_name(std::string_view ogc_name) {
  if (ogc_name.find("CRS84h") != std::string_view::npos) return "EPSG:4979";
  if (ogc_name.find("CRS84") != std::string_view::npos) return "EPSG:4326";
  std::string codes;
  for (std::size_t at = ogc_name.find("EPSG"); at != std::string_view::npos;) {
    const std::size_t next = ogc_name.find("EPSG", at + 4);
    std::string_view piece = ogc_name.substr(at + 4, next == std::string_view::npos ? next : next - at - 4);
    piece = piece.substr(0, piece.find_first_of("&,+"));
    // ":7415", "::7415", ":9.8:7415", "/0/7415": the code comes last.
    const std::size_t separator = piece.find_last_of(":/");
    const std::string_view code = separator == std::string_view::npos ? piece : piece.substr(separator + 1);
    if (code.empty() || code.size() > 9) return {};
    for (const char c : code) {
      if (std::isdigit(static_cast<unsigned char>(c)) == 0) return {};
    }
    codes += codes.empty() ? "EPSG:" : "+";
    codes += code;
    at = next;
  }
  return codes;
}

ReferenceSystem::ReferenceSystem(const std::filesystem::path& file, const std::string& name,
                                 const TerrainOptions& options) {
  const gdal::Quiet quiet;
  const gdal::SpatialReference whole = gdal::spatial_reference(name);
  if (!whole) {
    throw InputError(file, 0, fmt::format("PROJ does not know the reference system {}", name),
                     "correct metadata.referenceSystem, or install proj-data");
  }
  const gdal::SpatialReference map = gdal::horizontal_part(whole.get());
  geographic_ = OSRIsGeographic(map.get()) != 0;
  if (!geographic_ && OSRIsProjected(map.get()) == 0) {
    throw InputError(file, 0,
                     fmt::format("the reference system {} is neither projected nor geographic", name),
                     "convert the file to a projected reference system");
  }
  LonLatBox area;
  const char* area_name = nullptr;
  if (OSRGetAreaOfUse(map.get(), &area.west, &area.south, &area.east, &area.north, &area_name) != 0 &&
      area.west >= -180) {
    area_of_use_ = area;
  }
  const gdal::SpatialReference wgs84 = gdal::spatial_reference("EPSG:4326");
  if (OSRIsSame(map.get(), wgs84.get()) == 0) {
    // The horizontal part goes alone: with heights whose grid is missing, PROJ would drop the shift between
    // the horizontal datums too (100 m in the Netherlands).
    wgs84_from_map_ = gdal::transformation(map.get(), wgs84.get(), false);
    if (!wgs84_from_map_) {
      wgs84_from_map_ = gdal::transformation(map.get(), wgs84.get(), true);
      notes_.push_back(
          fmt::format("{}: PROJ knows no exact way from {} to WGS 84; the datums are taken as the same",
                      file.filename().string(), name));
    }
    if (!wgs84_from_map_) {
      throw InputError(file, 0, fmt::format("PROJ cannot transform {} to WGS 84", name),
                       "convert the file to another reference system");
    }
  }
  Geoid::Heights heights;
  heights.file = file;
  heights.reference = whole.get();
  heights.options = options;
  heights.required = false;
  geoid_.emplace(heights);
  notes_.push_back(geoid_->note());
  metres_per_unit_ = geoid_->metres_per_unit();
  const bool has_heights = OSRIsCompound(whole.get()) != 0 || OSRGetAxesCount(whole.get()) == 3;
  if (!has_heights && !geographic_) {
    char* unit = nullptr;
    metres_per_unit_ = OSRGetLinearUnits(map.get(), &unit);
    if (std::abs(metres_per_unit_ - 1) > 1e-9) {
      notes_.push_back(fmt::format("{}: heights taken in the unit of {}, {} ({:.9g} m)",
                                   file.filename().string(), name, unit != nullptr ? unit : "unnamed",
                                   metres_per_unit_));
    }
  }
}

bool ReferenceSystem::in_area_of_use(const LonLat& place) const {
  if (!area_of_use_) return true;
  const LonLatBox area = area_of_use_->unwrapped();
  const double longitude = longitude_near(place.x(), area_of_use_->middle_longitude());
  return longitude >= area.west - 1 && longitude <= area.east + 1 && place.y() >= area.south - 1 &&
         place.y() <= area.north + 1;
}

void ReferenceSystem::to_wgs84(std::vector<Eigen::Vector3d>& points) const {
  std::vector<double> x(points.size());
  std::vector<double> y(points.size());
  std::vector<int> ok(points.size(), 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    x[i] = points[i].x();
    y[i] = points[i].y();
  }
  if (wgs84_from_map_ && !points.empty()) {
    const gdal::Quiet quiet;
    // GDAL counts in int.
    constexpr std::size_t kBatch = 1 << 20;
    for (std::size_t first = 0; first < points.size(); first += kBatch) {
      const std::size_t count = std::min(kBatch, points.size() - first);
      OCTTransformEx(wgs84_from_map_.get(), static_cast<int>(count), &x[first], &y[first], nullptr,
                     &ok[first]);
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool on_earth = ok[i] != 0 && std::abs(x[i]) <= 180 && std::abs(y[i]) <= 90;
    if (!on_earth || !std::isfinite(points[i].z())) {
      points[i].setConstant(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    points[i] = {x[i], y[i], points[i].z() * metres_per_unit_ + geoid_->undulation_m({x[i], y[i]})};
  }
}

}  // namespace canyon::buildings
