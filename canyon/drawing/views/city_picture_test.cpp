#include "canyon/drawing/views/city_picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/drawing/views/city_camera.hpp"
#include "canyon/drawing/views/city_render.hpp"
#include "canyon/geodesy/constants.hpp"
#include "tests/support/png_pixels.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::drawing {
namespace {

using Eigen::Vector3d;
using test::PngPixels;
using ::testing::HasSubstr;

constexpr double kRight = geodesy::kPi / 2;
const ViewDirection kFromAbove{kRight, geodesy::kPi, 0};

std::vector<Vector3d> box_corners(const Vector3d& low, const Vector3d& high) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                         (i & 4) != 0 ? high.z() : low.z());
  }
  return corners;
}

/// Ground 400 m square about the origin, and boxes on it.
city::City city_of(const std::vector<std::pair<Vector3d, Vector3d>>& boxes) {
  city::City city;
  city.name = "blocks";
  city::append_object(city.mesh, "terrain", city::Surface::Terrain, city::Material::Ground,
                      {{-200, -200, 0}, {200, -200, 0}, {200, 200, 0}, {-200, 200, 0}},
                      {{0, 1, 2}, {0, 2, 3}});
  for (const auto& [low, high] : boxes) {
    city::append_box(city.mesh, "box", city::Surface::Building, city::Material::Concrete, low, high);
  }
  return city;
}

std::uint32_t at(const RgbImage& image, const CityCamera& camera, const Vector3d& place) {
  const auto p = camera.pixel(place);
  if (!p) throw std::runtime_error("behind the eye");
  return image.pixels.at(static_cast<std::size_t>(p->y) * static_cast<std::size_t>(image.width) +
                         static_cast<std::size_t>(p->x));
}

double brightness(std::uint32_t pixel) {
  return 0.2126 * (pixel >> 16U) + 0.7152 * (pixel >> 8U & 0xFFU) + 0.0722 * (pixel & 0xFFU);
}

std::string problem_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  return "no InputError";
}

// The camera.

TEST(CityCamera, EastIsRightAndNorthIsUpFromAbove) {
  const CityCamera camera(box_corners({-100, -50, 0}, {100, 50, 30}), {0, 0, 400, 200}, 400, kFromAbove);
  // 200 m over 400 px, 100 m over 200 px: half a metre each, the middle in the middle.
  EXPECT_NEAR(camera.metres_per_pixel(), 0.5, 1e-12);
  const auto p = camera.pixel({-100, 50, 7});
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->x, 0, 1e-9);
  EXPECT_NEAR(p->y, 0, 1e-9);
  const auto q = camera.pixel({30, -20, 0});
  EXPECT_NEAR(q->x, 200 + 60, 1e-9);
  EXPECT_NEAR(q->y, 100 + 40, 1e-9);
}

TEST(CityCamera, ViewerStandsWhereTheAzimuthSays) {
  // From the west east is away (up), north is left.
  const CityCamera camera(box_corners({-50, -50, 0}, {50, 50, 10}), {0, 0, 100, 100}, 100,
                          {geodesy::radians(30), geodesy::radians(270), 0});
  EXPECT_NEAR((camera.towards_viewer() - Vector3d(-std::sqrt(0.75), 0, 0.5)).norm(), 0, 1e-12);
  const auto origin = camera.pixel({0, 0, 0}), north = camera.pixel({0, 10, 0}),
             east = camera.pixel({10, 0, 0}), up = camera.pixel({0, 0, 10});
  EXPECT_LT(north->x, origin->x);
  EXPECT_NEAR(north->y, origin->y, 1e-9);
  EXPECT_NEAR(east->x, origin->x, 1e-9);
  // Lengths along the view shrink by sin 30, upright ones by cos 30.
  EXPECT_NEAR((origin->y - east->y) * camera.metres_per_pixel(), 5, 1e-9);
  EXPECT_NEAR((origin->y - up->y) * camera.metres_per_pixel(), 10 * std::sqrt(0.75), 1e-9);
}

TEST(CityCamera, EverythingFitsAndTouchesTheFrame) {
  const Rect area{40, 90, 700, 500};
  // A district, a mast of 540 m and 2 m across, a wall seen end on.
  const std::vector<std::vector<Vector3d>> scenes{box_corners({-600, -700, -3}, {500, 800, 274}),
                                                  box_corners({1000, 2000, 150}, {1002, 2002, 690}),
                                                  box_corners({0, -900, 0}, {0.1, 900, 20})};
  for (const auto& points : scenes) {
    for (const double elevation_deg : {0.0, 8.0, 35.0, 70.0, 90.0}) {
      for (const double azimuth_deg : {0.0, 137.0, 215.0, 300.0}) {
        for (const double field_deg : {0.0, 28.0, 80.0}) {
          const CityCamera camera(
              points, area, 900,
              {geodesy::radians(elevation_deg), geodesy::radians(azimuth_deg), geodesy::radians(field_deg)});
          double left = 1e300, right = -1e300, top = 1e300, bottom = -1e300;
          for (const Vector3d& point : points) {
            const auto p = camera.pixel(point);
            ASSERT_TRUE(p);
            left = std::min(left, p->x);
            right = std::max(right, p->x);
            top = std::min(top, p->y);
            bottom = std::max(bottom, p->y);
            // The ray of a place goes through it.
            const raytrace::Ray ray = camera.ray(p->x, p->y);
            EXPECT_NEAR(ray.direction.norm(), 1, 1e-12);
            const Vector3d to = point - ray.origin;
            EXPECT_LT(to.cross(ray.direction).norm(), 1e-6);
            EXPECT_GT(to.dot(ray.direction), 0);
          }
          EXPECT_GT(left, area.x - 1e-6);
          EXPECT_LT(right, area.right() + 1e-6);
          EXPECT_GT(top, area.y - 1e-6);
          EXPECT_LT(bottom, area.bottom() + 1e-6);
          const bool fills_width = left < area.x + 1e-6 && right > area.right() - 1e-6;
          const bool fills_height = top < area.y + 1e-6 && bottom > area.bottom() - 1e-6;
          EXPECT_TRUE(fills_width || fills_height) << elevation_deg << ' ' << azimuth_deg << ' ' << field_deg;
        }
      }
    }
  }
}

TEST(CityCamera, SinglePointIsNotMagnifiedWithoutEnd) {
  for (const double field : {0.0, 0.5}) {
    const CityCamera camera({Vector3d(5, 6, 7)}, {0, 0, 100, 100}, 100, {0.5, 1, field});
    EXPECT_GT(camera.metres_per_pixel(), 0.001);
    const auto p = camera.pixel({5, 6, 7});
    ASSERT_TRUE(p);
    EXPECT_NEAR(p->x, 50, 1e-6);
    EXPECT_NEAR(p->y, 50, 1e-6);
  }
}

// The contents of the picture.

class TwoBoxes : public ::testing::Test {
 protected:
  // 20 m and 60 m high, far enough apart that neither shades the other's roof at 45 deg.
  const city::City city_ = city_of({{{-120, -20, 0}, {-80, 20, 20}}, {{80, -20, 0}, {120, 20, 60}}});
  const CityRenderer renderer_{city_.mesh};
  const CityCamera camera_{box_corners({-200, -200, 0}, {200, 200, 60}), {0, 0, 400, 400}, 400, kFromAbove};

  [[nodiscard]] RgbImage from_above(double sun_azimuth_deg) const {
    return renderer_.render(camera_, 400, 400,
                            {{geodesy::radians(sun_azimuth_deg), geodesy::radians(45)}, true, true, false});
  }
};

TEST_F(TwoBoxes, RoofsHaveTheLegendsColours) {
  EXPECT_NEAR(renderer_.heights().highest_m, 60, 1e-9);
  const RgbImage image = from_above(315);
  const std::uint32_t low = at(image, camera_, {-100, 0, 20}), high = at(image, camera_, {100, 0, 60});
  EXPECT_TRUE(PngPixels::is(low, HeightColours::colour(renderer_.heights().at(20)), 2)) << std::hex << low;
  EXPECT_TRUE(PngPixels::is(high, viridis(1), 2)) << std::hex << high;
  EXPECT_GT(brightness(high), brightness(low) + 30);
  EXPECT_TRUE(PngPixels::is(at(image, camera_, {0, 150, 0}), kBareGround, 2));
}

TEST_F(TwoBoxes, ShadowsFallAwayFromTheSun) {
  // With the sun 45 deg high a 60 m box throws a shadow of 60 m.
  const double open = brightness(at(from_above(270), camera_, {0, 150, 0}));
  struct Case {
    double sun_azimuth_deg;
    Vector3d shaded, beyond, opposite;
  };
  const std::array<Case, 4> cases{Case{270, {150, 0, 0}, {190, 0, 0}, {50, 0, 0}},
                                  Case{90, {50, 0, 0}, {10, 0, 0}, {150, 0, 0}},
                                  Case{180, {100, 50, 0}, {100, 90, 0}, {100, -50, 0}},
                                  Case{0, {100, -50, 0}, {100, -90, 0}, {100, 50, 0}}};
  for (const Case& c : cases) {
    const RgbImage image = from_above(c.sun_azimuth_deg);
    EXPECT_LT(brightness(at(image, camera_, c.shaded)), 0.8 * open) << c.sun_azimuth_deg;
    EXPECT_GT(brightness(at(image, camera_, c.beyond)), 0.93 * open) << c.sun_azimuth_deg;
    EXPECT_GT(brightness(at(image, camera_, c.opposite)), 0.85 * open) << c.sun_azimuth_deg;
  }
}

TEST(CityRenderer, HeightsCountFromTheGround) {
  city::City city;
  city.name = "plateau";
  city::append_object(city.mesh, "terrain", city::Surface::Terrain, city::Material::Ground,
                      {{-200, -200, 300}, {200, -200, 300}, {200, 200, 340}, {-200, 200, 340}},
                      {{0, 1, 2}, {0, 2, 3}});
  city::append_box(city.mesh, "box", city::Surface::Building, city::Material::Concrete, {-10, -10, 310},
                   {10, 10, 360});
  // The slope is a plane: 320 + 0.1 y. The box's lowest ground is at y = -10: 319 m.
  EXPECT_NEAR(CityRenderer(city.mesh).heights().highest_m, 360 - 319, 0.01);
}

TEST(CityRenderer, SurfacesFromBehindAreMagenta) {
  city::City city = city_of({{{-20, -20, 0}, {20, 20, 20}}});
  const city::Object& box = city.mesh.objects.back();
  for (std::uint32_t k = 0; k < box.triangle_count; ++k) {
    auto& t = city.mesh.triangles[box.first_triangle + k];
    std::swap(t[0], t[1]);
  }
  const CityRenderer renderer(city.mesh);
  const CityCamera camera(renderer.essential_points(), {0, 0, 100, 100}, 100, kFromAbove);
  const CityRenderer::Style style{{geodesy::radians(315), geodesy::radians(45)}, true, true, false};
  EXPECT_TRUE(PngPixels::is(at(renderer.render(camera, 100, 100, style), camera, {0, 0, 20}), kBackFace, 2));
  CityRenderer::Style plain = style;
  plain.mark_back_faces = false;
  EXPECT_TRUE(PngPixels::is(at(renderer.render(camera, 100, 100, plain), camera, {0, 0, 20}), viridis(1), 2));
}

TEST(CityRenderer, MaterialsFoliageAndVehicles) {
  city::City city = city_of({});
  city::append_box(city.mesh, "house", city::Surface::Building, city::Material::Brick, {-90, -10, 0},
                   {-70, 10, 10});
  city::append_box(city.mesh, "tree", city::Surface::Foliage, city::Material::Unknown, {-10, -10, 0},
                   {10, 10, 10});
  city::append_box(city.mesh, "bus", city::Surface::Vehicle, city::Material::Metal, {70, -10, 0},
                   {90, 10, 3});
  const CityRenderer renderer(city.mesh);
  const CityCamera camera(box_corners({-100, -100, 0}, {100, 100, 10}), {0, 0, 200, 200}, 200, kFromAbove);
  const RgbImage image =
      renderer.render(camera, 200, 200, {{geodesy::radians(315), geodesy::radians(45)}, false, true, false});
  EXPECT_TRUE(PngPixels::is(at(image, camera, {-80, 0, 10}), colour_of(city::Material::Brick), 2));
  EXPECT_TRUE(PngPixels::is(at(image, camera, {0, 0, 10}), kFoliage, 2));
  EXPECT_TRUE(PngPixels::is(at(image, camera, {80, 0, 3}), kVehicle, 2));
}

// Whole pictures.

TEST(CityPicture, HasTheAskedSize) {
  const city::City city = city::synthetic_city({});
  CityPictureOptions options;
  const PngPixels full(city_png(city, options));
  EXPECT_EQ(full.width(), 1600);
  EXPECT_EQ(full.height(), 1000);
  for (const double elevation_deg : {0.0, 35.0, 90.0}) {
    options.elevation_deg = elevation_deg;
    options.width_px = 481;
    options.height_px = 377;
    const PngPixels small(city_png(city, options));
    EXPECT_EQ(small.width(), 481);
    EXPECT_EQ(small.height(), 377);
  }
}

TEST(CityPicture, MapHasNorthUpAndEastRight) {
  // The highest box in the north-east; only its roof and the legend's end have the last colour.
  const city::City city = city_of({{{-150, -150, 0}, {-110, -110, 20}}, {{110, 110, 0}, {150, 150, 60}}});
  CityPictureOptions options;
  options.elevation_deg = 90;
  options.azimuth_deg = 215;  // has no say on a map
  options.width_px = options.height_px = 800;
  const PngPixels map(city_png(city, options));
  double x = 0, y = 0, n = 0, low_x = 0, low_y = 0, low_n = 0;
  const CityRenderer renderer(city.mesh);
  const Colour low = HeightColours::colour(renderer.heights().at(20));
  for (int row = 0; row < map.height(); ++row) {
    for (int column = 0; column < map.width(); ++column) {
      if (PngPixels::is(map.pixel(column, row), viridis(1), 1)) {
        x += column;
        y += row;
        ++n;
      }
      if (PngPixels::is(map.pixel(column, row), low, 1)) {
        low_x += column;
        low_y += row;
        ++low_n;
      }
    }
  }
  ASSERT_GT(n, 1000);
  ASSERT_GT(low_n, 1000);
  EXPECT_GT(x / n, low_x / low_n + 200);
  EXPECT_LT(y / n, low_y / low_n - 200);
}

TEST(CityPicture, FocusFillsTheFrameWithItsBuildings) {
  // A mast of 540 m, 4 m across, far from a low house: alone in the frame it stands high and wide.
  const city::City city = city_of({{{-150, -150, 0}, {-110, -110, 20}}, {{110, 110, 0}, {114, 114, 540}}});
  const auto mast = [&city](const std::optional<PictureFocus>& focus, double elevation_deg) {
    CityPictureOptions options;
    options.width_px = 800;
    options.height_px = 500;
    options.focus = focus;
    options.elevation_deg = elevation_deg;
    const PngPixels picture(city_png(city, options));
    if (elevation_deg == 90) return picture.count(viridis(1));  // its roof
    std::size_t top = 0;  // the mast's upper part is yellow; so is the legend's end, in both
    for (int y = 0; y < picture.height(); ++y) {
      for (int x = 0; x < picture.width() - 100; ++x) {
        const std::uint32_t p = picture.pixel(x, y);
        top += (p >> 16U) > (p & 0xFFU) + 60 && (p >> 8U & 0xFFU) > (p & 0xFFU) + 60 ? 1U : 0U;
      }
    }
    return top;
  };
  const PictureFocus focus{112, 112, 10};
  EXPECT_GT(mast(std::nullopt, 20), 100U);
  EXPECT_GT(mast(focus, 20), mast(std::nullopt, 20));
  EXPECT_GT(mast(focus, 90), 10 * mast(std::nullopt, 90));
}

TEST(CityPicture, SameBytesOnOneThread) {
  const city::City city = city::synthetic_city({});
  CityPictureOptions options;
  options.width_px = 640;
  options.height_px = 400;
  const std::string many = city_png(city, options);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(city_png(city, options), many);
}

TEST(CityPicture, CityWithoutTerrainStandsOnAGround) {
  city::City city;
  city.name = "one box";
  city::append_box(city.mesh, "box", city::Surface::Building, city::Material::Concrete, {0, 0, 5},
                   {30, 30, 25});
  const PngPixels picture(city_png(city));
  EXPECT_GT(picture.count(kBareGround), 1000U);
}

TEST(CityPicture, TerrainAloneIsDrawn) {
  EXPECT_GT(PngPixels(city_png(city_of({}))).count(kBareGround), 1000U);
}

TEST(CityPicture, RealMeshFacesOutwards) {
  CANYON_SHARED_DATA(path, "hongkong/buildings.dae");
  city::MeshImportOptions import;
  import.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  const city::City city = city::read_mesh_city(path, import);
  for (const double elevation_deg : {20.0, 90.0}) {
    CityPictureOptions options;
    options.elevation_deg = elevation_deg;
    const PngPixels picture(city_png(city, options));
    // No pixel of the back faces' hue, lit or in shade.
    std::size_t magenta = 0;
    for (int y = 0; y < picture.height(); ++y) {
      for (int x = 0; x < picture.width(); ++x) {
        const std::uint32_t p = picture.pixel(x, y);
        const double r = p >> 16U, g = p >> 8U & 0xFFU, b = p & 0xFFU;
        magenta += r > 90 && g < 0.25 * r && b > 0.4 * r && b < 0.7 * r ? 1U : 0U;
      }
    }
    EXPECT_EQ(magenta, 0U) << elevation_deg;
  }
}

TEST(CityPicture, BadOptionsAreNamed) {
  const city::City city = city_of({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto with = [&city](const std::function<void(CityPictureOptions&)>& change) {
    CityPictureOptions options;
    change(options);
    return problem_of([&] { (void)city_png(city, options); });
  };
  EXPECT_THAT(with([](auto& o) { o.width_px = 319; }),
              HasSubstr("width_px of the picture is 319; it must be from 320 to 16384 px"));
  EXPECT_THAT(with([](auto& o) { o.height_px = 20000; }), HasSubstr("height"));
  EXPECT_THAT(with([](auto& o) { o.elevation_deg = 90.5; }),
              HasSubstr("elevation_deg of the picture is 90.5"));
  EXPECT_THAT(with([nan](auto& o) { o.elevation_deg = nan; }), HasSubstr("elevation"));
  EXPECT_THAT(with([](auto& o) { o.azimuth_deg = 361; }), HasSubstr("azimuth"));
  EXPECT_THAT(with([](auto& o) { o.field_deg = -1; }), HasSubstr("field"));
  EXPECT_THAT(with([](auto& o) { o.sun_elevation_deg = 4; }), HasSubstr("sun_elevation_deg"));
  EXPECT_THAT(with([nan](auto& o) { o.sun_azimuth_deg = nan; }), HasSubstr("sun_azimuth_deg"));
  EXPECT_THAT(with([](auto& o) { o.focus = PictureFocus{0, 0, 0.5}; }), HasSubstr("focus.radius_m"));
  EXPECT_THAT(with([nan](auto& o) { o.focus = PictureFocus{nan, 0, 9}; }), HasSubstr("focus.east_m"));
}

TEST(CityPicture, EmptyCityIsRefusedAndLeavesOlderFilesAlone) {
  const test::TemporaryFolder folder;
  city::City empty;
  empty.name = "nowhere";
  draw_city(city_of({}), folder / "city.png");
  const std::string before = test::read_bytes(folder / "city.png");
  EXPECT_THAT(problem_of([&] { draw_city(empty, folder / "city.png"); }),
              HasSubstr("'nowhere' has no triangle"));
  EXPECT_EQ(test::read_bytes(folder / "city.png"), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(CityPicture, UnwritablePathIsRefused) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(problem_of([&] { draw_city(city_of({}), folder / "missing/city.png"); }), HasSubstr("missing"));
}

}  // namespace
}  // namespace canyon::drawing
