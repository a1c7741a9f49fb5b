#include "canyon/city/buildings/sources/reference_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {

namespace {

/// The names of AdV (Germany's surveying authorities) for plane systems and heights, with EPSG's codes.
constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kAdvNames{
    {{"ETRS89_UTM31", "25831"},
     {"ETRS89_UTM32", "25832"},
     {"ETRS89_UTM33", "25833"},
     {"DE_DHDN_3GK2", "31466"},
     {"DE_DHDN_3GK3", "31467"},
     {"DE_DHDN_3GK4", "31468"},
     {"DE_DHDN_3GK5", "31469"},
     {"ETRS89_Lat-Lon", "4258"},
     {"DE_DHHN2016_NH", "7837"},
     {"DE_DHHN92_NH", "5783"},
     {"DE_DHHN12_NOH", "7699"},
     {"DE_DHHN85_NOH", "5784"}}};

/// "EPSG:25832+7837" of "urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH*GCG2016"; empty if a part is not known.
std::string adv_reference(std::string_view name) {
  std::string codes;
  int parts = 0;
  for (const std::string_view part : split(name, '*')) {
    if (parts++ == 2) break;  // the geoid is the third part
    const auto known = std::find_if(kAdvNames.begin(), kAdvNames.end(),
                                    [part](const auto& pair) { return pair.first == part; });
    if (known == kAdvNames.end()) return {};
    codes += codes.empty() ? "EPSG:" : "+";
    codes += known->second;
  }
  return codes;
}

}  // namespace

std::string reference_name(std::string_view ogc_name) {
  constexpr std::string_view kAdv = "urn:adv:crs:";
  if (ogc_name.substr(0, kAdv.size()) == kAdv) return adv_reference(ogc_name.substr(kAdv.size()));
  // "http://www.opengis.net/gml/srs/epsg.xml#31467", from GML 2; "EPSG:25832+7837", GDAL's own form.
  const std::size_t hash = ogc_name.find("epsg.xml#");
  if (hash != std::string_view::npos)
    return reference_name("EPSG:" + std::string(ogc_name.substr(hash + std::strlen("epsg.xml#"))));
  const std::size_t plus = ogc_name.find('+');
  if (plus != std::string_view::npos && ogc_name.find("EPSG", plus) == std::string_view::npos) {
    const std::string plane = reference_name(ogc_name.substr(0, plus));
    const std::string heights = reference_name("EPSG:" + std::string(ogc_name.substr(plus + 1)));
    if (plane.empty() || heights.empty()) return {};
    return plane + "+" + heights.substr(std::strlen("EPSG:"));
  }
  if (ogc_name.find("CRS84h") != std::string_view::npos) return "EPSG:4979";
  if (ogc_name.find("CRS84") != std::string_view::npos) return "EPSG:4326";
  std::string codes;
  for (std::size_t at = ogc_name.find("EPSG"); at != std::string_view::npos;) {
    const std::size_t next = ogc_name.find("EPSG", at + 4);
    std::string_view piece = ogc_name.substr(at + 4, next == std::string_view::npos ? next : next - at - 4);
    piece = piece.substr(0, piece.find_first_of("&,+"));
    // ":7415", "::7415", ":9.8:7415", "/0/7415": the code is last.
    const std::size_t separator = piece.find_last_of(":/");
    const std::string_view code = separator == std::string_view::npos ? piece : piece.substr(separator + 1);
    if (code.empty() || code.size() > 9) return {};
    for (const char c : code)
      if (std::isdigit(static_cast<unsigned char>(c)) == 0) return {};
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
                     "correct the name of the reference system in the file, or install proj-data");
  }
  const gdal::SpatialReference map = gdal::horizontal_part(whole.get());
  geographic_ = OSRIsGeographic(map.get()) != 0;
  if (!geographic_ && OSRIsProjected(map.get()) == 0) {
    throw InputError(file, 0,
                     fmt::format("the reference system {} is neither projected nor geographic", name),
                     "convert the file to a projected reference system");
  }
  OGRAxisOrientation first_axis = OAO_East;
  OSRGetAxis(map.get(), geographic_ ? "GEOGCS" : "PROJCS", 0, &first_axis);
  north_first_ = first_axis == OAO_North;
  if (const char* full_name = OSRGetName(whole.get()); full_name != nullptr) title_ = full_name;
  LonLatBox area;
  const char* area_name = nullptr;
  if (OSRGetAreaOfUse(map.get(), &area.west, &area.south, &area.east, &area.north, &area_name) != 0 &&
      area.west >= -180)
    area_of_use_ = area;
  const gdal::SpatialReference wgs84 = gdal::spatial_reference("EPSG:4326");
  if (OSRIsSame(map.get(), wgs84.get()) == 0) {
    // Only the horizontal part: with heights whose grid is missing, PROJ would also drop the shift between
    // the horizontal datums (100 m in the Netherlands).
    wgs84_from_map_ =
        gdal::best_transformation(map.get(), wgs84.get(), file, "from " + name + " to WGS 84", notes_);
  }
  Geoid::Heights heights;
  heights.file = file;
  heights.reference = whole.get();
  heights.options = options;
  heights.required = false;
  geoid_.emplace(heights);
  geoid_->add_line(notes_);
}

bool ReferenceSystem::in_area_of_use(const LonLat& point) const {
  if (!area_of_use_) return true;
  const LonLatBox area = area_of_use_->unwrapped();
  const double longitude = longitude_near(point.x(), area_of_use_->middle_longitude());
  return longitude >= area.west - 1 && longitude <= area.east + 1 && point.y() >= area.south - 1 &&
         point.y() <= area.north + 1;
}

bool ReferenceSystem::finds(const Eigen::Vector2d& point) const {
  std::vector<double> x{point.x()}, y{point.y()};
  std::vector<int> ok{1};
  plane_to_wgs84(x, y, ok);
  return ok[0] != 0 && in_area_of_use({x[0], y[0]});
}

void ReferenceSystem::plane_to_wgs84(std::vector<double>& x, std::vector<double>& y,
                                     std::vector<int>& ok) const {
  if (wgs84_from_map_) {
    const gdal::Quiet quiet;
    // GDAL counts with int.
    constexpr std::size_t kBatch = 1 << 20;
    for (std::size_t first = 0; first < x.size(); first += kBatch) {
      const std::size_t count = std::min(kBatch, x.size() - first);
      OCTTransformEx(wgs84_from_map_.get(), static_cast<int>(count), &x[first], &y[first], nullptr,
                     &ok[first]);
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!(std::abs(x[i]) <= 180 && std::abs(y[i]) <= 90)) ok[i] = 0;
}

void ReferenceSystem::to_wgs84(std::vector<Eigen::Vector3d>& points) const {
  std::vector<double> x(points.size());
  std::vector<double> y(points.size());
  std::vector<int> ok(points.size(), 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    x[i] = points[i].x();
    y[i] = points[i].y();
  }
  plane_to_wgs84(x, y, ok);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool on_earth = ok[i] != 0;
    if (!on_earth || !std::isfinite(points[i].z())) {
      points[i].setConstant(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    points[i] = {x[i], y[i], points[i].z() * geoid_->metres_per_unit() + geoid_->undulation_m({x[i], y[i]})};
  }
}

}  // namespace canyon::buildings
