#include "canyon/outputs/drawing/views/skyplot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tinyxml2.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/drawing/views/sky_render.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/png_pixels.hpp"

namespace canyon::drawing::skyplot_test {
namespace {

using Eigen::Vector3d;
using geodesy::degrees;
using geodesy::kPi;
using geodesy::radians;
using propagation::Visibility;
using ::testing::HasSubstr;

const geodesy::Geodetic kOrigin = geodesy::Geodetic::from_degrees(22.3, 114.17, 0);
const Vector3d kAntenna(0, 0, 2);

/// A sheet with one pixel per unit.
class Pixels : public test::PngPixels {
 public:
  using PngPixels::PngPixels;
  [[nodiscard]] std::uint32_t at(const Point& p) const {
    return pixel(static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)));
  }
  [[nodiscard]] bool has_near(const Point& p, int reach, const Colour& colour) const {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        if (is(at({p.x + x, p.y + y}), colour)) return true;
      }
    }
    return false;
  }
};

/// Open sky is much bluer than red, walls are not.
bool is_sky(std::uint32_t pixel) {
  return static_cast<int>(pixel & 0xFFU) - static_cast<int>(pixel >> 16U) > 8 && (pixel & 0xFFU) > 200;
}
bool is_wall(std::uint32_t pixel) {
  return (pixel & 0xFFU) < 190;
}

/// A wall 10 m east of the antenna, 60 m to both sides, 12 m above it, over level ground; satellites in four
/// directions: behind the wall, mirrored by it in the west, high in the north, low in the south.
class SkyplotTest : public ::testing::Test {
 protected:
  SkyplotTest() {
    city::City city;
    city.name = "one wall";
    city.frame = geodesy::LocalFrame(kOrigin);
    canyon::test::append_box(city.mesh, "wall", city::Surface::Building, city::Material::Concrete,
                             {10, -60, 0}, {11, 60, 14});
    auto sky = std::make_shared<orbit::FrozenSky>(
        city.frame.geodetic_from_local(kAntenna),
        std::vector<double>{radians(90), radians(270), radians(10), radians(190)},
        std::vector<double>{radians(45), radians(40), radians(75), radians(20)});
    environment_ = std::make_unique<simulation::Environment>(std::move(city), std::move(sky));
    propagator_ = std::make_unique<propagation::Propagator>(environment_->make_propagator({}));
    options_.sheet.width_px = 990;
    options_.receiver = "car";
  }
  [[nodiscard]] std::string draw(const Vector3d& antenna = kAntenna) const {
    return draw_skyplot(*environment_, *propagator_, time_, antenna, options_);
  }
  [[nodiscard]] SkyLens lens() const {
    return sky_sheet_lens(options_.projection, options_.style == SkyStyle::Fisheye);
  }

  std::unique_ptr<simulation::Environment> environment_;
  std::unique_ptr<propagation::Propagator> propagator_;
  geodesy::GpsTime time_ = geodesy::parse_time("2026-06-01T08:02:32Z");
  SkyplotOptions options_;
};

TEST_F(SkyplotTest, DrawingHoldsWhatArrives) {
  const SkyDrawing drawing = make_sky_drawing(*environment_, *propagator_, time_, kAntenna, options_);
  EXPECT_EQ(drawing.title, "car: sky at 2026-06-01 08:02:32 UTC");
  EXPECT_THAT(drawing.subtitle, HasSubstr("22.300000"));
  EXPECT_THAT(drawing.subtitle, HasSubstr("0.0 m east, 0.0 m north, 2.0 m up in one wall"));
  ASSERT_EQ(drawing.satellites.size(), 4U);
  EXPECT_EQ(drawing.satellites[0].name, "G01");
  EXPECT_EQ(drawing.satellites[0].now.visibility, Visibility::Blocked);
  EXPECT_EQ(drawing.satellites[1].now.visibility, Visibility::LOSMultipath);
  EXPECT_EQ(drawing.satellites[2].now.visibility, Visibility::LOS);
  // It is reflected by a wall in the plane x = 10: same elevation, from the east; longer by 2 h
  // cos(elevation).
  ASSERT_EQ(drawing.satellites[1].reflections.size(), 1U);
  EXPECT_NEAR(degrees(drawing.satellites[1].reflections[0].azimuth_rad), 90, 1e-6);
  EXPECT_NEAR(degrees(drawing.satellites[1].reflections[0].elevation_rad), 40, 1e-6);
  EXPECT_NEAR(drawing.satellites[1].reflections[0].excess_m, 20 * std::cos(radians(40)), 1e-6);
  EXPECT_FALSE(drawing.has_fix);
  EXPECT_EQ(drawing.mask.azimuths.size(), 1440U);
  EXPECT_THAT(make_sky_drawing(*environment_, *propagator_, time_, {-1e-9, -0.04, 2}, options_).subtitle,
              HasSubstr(" 0.0 m east, 0.0 m north"));
  time_ = geodesy::parse_time("2026-06-01T08:02:30.250Z");
  EXPECT_THAT(make_sky_drawing(*environment_, *propagator_, time_, kAntenna, options_).title,
              HasSubstr("08:02:30.25 UTC"));
}

// The wall's edge is 1.4 m above the straight line and 15.6 m away: nu = 1.16, 15 dB (ITU-R P.526, equation
// 31) below a direct signal's 49 dB-Hz. A receiver that needs 45 does not receive it, and nothing is drawn,
// neither now nor for the previous minute.
TEST_F(SkyplotTest, ReceiversAreBlockedWhereNothingStrongEnoughArrives) {
  propagation::PropagationOptions edges;
  edges.diffraction = true;
  const propagation::Propagator around = environment_->make_propagator(edges);
  options_.trail_s = 60;
  receiver::ReceiverOptions receiver;
  const auto hidden = [&](const receiver::ReceiverOptions* options) {
    return make_sky_drawing(*environment_, around, time_, kAntenna, options_, options).satellites.at(0);
  };
  EXPECT_EQ(hidden(nullptr).now.visibility, Visibility::NLOS);
  EXPECT_EQ(hidden(nullptr).reflections.size(), 1U);
  EXPECT_EQ(hidden(&receiver).now.visibility, Visibility::NLOS) << "signals without strength";
  receiver.signal.enabled = true;
  receiver.signal.lock.tracking_threshold_dbhz = 5;
  EXPECT_EQ(hidden(&receiver).now.visibility, Visibility::NLOS);
  receiver.signal.lock.tracking_threshold_dbhz = receiver.signal.lock.acquisition_threshold_dbhz = 45;
  const SkySatellite deaf = hidden(&receiver);
  EXPECT_EQ(deaf.now.visibility, Visibility::Blocked);
  EXPECT_TRUE(deaf.reflections.empty());
  for (const SkyPoint& point : deaf.trails.at(0)) EXPECT_EQ(point.visibility, Visibility::Blocked);
  const SkyDrawing drawing = make_sky_drawing(*environment_, around, time_, kAntenna, options_, &receiver);
  EXPECT_EQ(drawing.satellites[2].now.visibility, Visibility::LOS);
}

// Both styles, both projections: the wall's upper edge is, towards azimuth a, at the elevation whose
// tangent is 12 sin(a) / 10, up to its ends at tan a = 60 / 10; the open west on the other side.
TEST_F(SkyplotTest, SilhouetteOfAWall) {
  for (const SkyStyle style : {SkyStyle::Chart, SkyStyle::Fisheye}) {
    for (const SkyProjection projection : {SkyProjection::Equidistant, SkyProjection::Stereographic}) {
      options_.style = style;
      options_.projection = projection;
      const Pixels pixels(draw());
      const auto hidden = [&](double azimuth_rad, double elevation_rad) {
        const std::uint32_t pixel = pixels.at(lens().point(azimuth_rad, elevation_rad));
        if (style == SkyStyle::Fisheye) {
          EXPECT_NE(is_wall(pixel), is_sky(pixel)) << std::hex << pixel;
          return is_wall(pixel);
        }
        EXPECT_NE(Pixels::is(pixel, rgb(0xC9CCD1)), Pixels::is(pixel, kGround)) << std::hex << pixel;
        return Pixels::is(pixel, rgb(0xC9CCD1));
      };
      // Azimuths and elevations clear of grid, marks and their names; 1.5 deg are five pixels and more.
      for (const double azimuth_deg : {50.0, 70.0, 107.0, 138.0}) {
        const double edge = std::atan(12 * std::sin(radians(azimuth_deg)) / 10);
        EXPECT_TRUE(hidden(radians(azimuth_deg), edge - radians(1.5))) << azimuth_deg;
        EXPECT_FALSE(hidden(radians(azimuth_deg), edge + radians(1.5))) << azimuth_deg;
        EXPECT_FALSE(hidden(radians(-azimuth_deg), edge - radians(1.5))) << "west " << azimuth_deg;
      }
      // The ends of the wall, atan(10 / 60) from north and south.
      const double end = std::atan(10.0 / 60);
      EXPECT_TRUE(hidden(end + radians(1), radians(5)));
      EXPECT_FALSE(hidden(end - radians(1), radians(5)));
      EXPECT_TRUE(hidden(kPi - end - radians(1), radians(5)));
      EXPECT_FALSE(hidden(kPi - end + radians(1), radians(5)));
    }
  }
}

// On a sheet of 990 units the disc's middle is (410, 456), its radius 340.
TEST_F(SkyplotTest, MarksStandWhereTheClosedFormSays) {
  const Pixels chart(draw());
  EXPECT_EQ(chart.width(), 990);
  EXPECT_EQ(chart.height(), 836);
  EXPECT_TRUE(chart.has_near({410 + 170, 456}, 1, kInk)) << "blocked, azimuth 90, elevation 45: right";
  EXPECT_TRUE(chart.has_near({410 - 340 * 50.0 / 90, 456}, 1, colour_of(Visibility::LOSMultipath)));
  options_.style = SkyStyle::Fisheye;
  const Pixels up(draw());
  EXPECT_TRUE(up.has_near({410 - 170, 456}, 1, kInk)) << "looking up east is left";
  EXPECT_TRUE(up.has_near({410 + 340 * 50.0 / 90, 456}, 1, colour_of(Visibility::LOSMultipath)));
  EXPECT_TRUE(up.has_near({410 - 340 * 50.0 / 90, 456}, 1, colour_of(Visibility::LOSMultipath)))
      << "the reflection arrives from the east";
  EXPECT_FALSE(chart.has_near({410 + 340 * 50.0 / 90, 456}, 4, colour_of(Visibility::LOSMultipath)))
      << "a chart shows satellites only";
  const double r = 340 * 15.0 / 90;
  EXPECT_TRUE(up.has_near({410 - r * std::sin(radians(10)), 456 - r * std::cos(radians(10))}, 1,
                          colour_of(Visibility::LOS)));
  options_.projection = SkyProjection::Stereographic;
  const Pixels stereographic(draw());
  EXPECT_TRUE(stereographic.has_near({410 - 340 * (std::sqrt(2) - 1), 456}, 1, kInk));
}

// Each kind of path has its own mark at the direction of arrival; scattered ones have no label.
TEST_F(SkyplotTest, MarksOfEveryKindOfPath) {
  using propagation::PathKind;
  SkyDrawing drawing;
  drawing.satellites.push_back({"G01", {radians(90), radians(20), Visibility::NLOS}, false, {}, {}});
  drawing.satellites[0].reflections = {{radians(0), radians(45), 11, PathKind::Reflected},
                                       {radians(270), radians(45), 22, PathKind::Diffracted},
                                       {radians(180), radians(45), 33, PathKind::Diffuse}};
  const SkySurroundings surroundings{&environment_->scene(), &environment_->city().mesh, {-100, 0, 2}};
  const SkySheet png{PictureFormat::Png, 990}, svg{PictureFormat::Svg, 990};
  const Pixels up(draw_fisheye(drawing, surroundings, png));
  const Colour nlos = colour_of(Visibility::NLOS);
  const Point reflected{410, 456 - 170}, bent{410 + 170, 456}, scattered{410, 456 + 170};
  EXPECT_TRUE(up.has_near(reflected, 1, nlos));
  EXPECT_TRUE(up.has_near(bent, 1, nlos));
  EXPECT_FALSE(up.has_near(scattered, 1, nlos)) << "pale: mixed with what is below";
  // The corner of a square of half the side 4.2 is outside a diamond of half the diagonal 5.2.
  EXPECT_TRUE(Pixels::is(up.at({bent.x - 3, bent.y - 3}), nlos));
  EXPECT_FALSE(Pixels::is(up.at({reflected.x - 3.5, reflected.y - 3.5}), nlos));
  const std::string text = draw_fisheye(drawing, surroundings, svg);
  drawing.satellites[0].reflections.resize(1);
  const std::string plain = draw_fisheye(drawing, surroundings, svg);
  EXPECT_GT(text.size(), plain.size() + 200);
}

TEST_F(SkyplotTest, SvgIsWellFormedAndNamesEverySatellite) {
  options_.sheet.format = PictureFormat::Svg;
  for (const SkyStyle style : {SkyStyle::Chart, SkyStyle::Fisheye}) {
    options_.style = style;
    const std::string svg = draw();
    tinyxml2::XMLDocument document;
    ASSERT_EQ(document.Parse(svg.data(), svg.size()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
    ASSERT_NE(document.FirstChildElement("svg"), nullptr);
    EXPECT_STREQ(document.FirstChildElement("svg")->Attribute("viewBox"), "0 0 990 836");
    EXPECT_EQ(svg.find("<image") != std::string::npos, style == SkyStyle::Fisheye);
  }
}

TEST_F(SkyplotTest, SizesOfPng) {
  for (const auto& [width, height] : {std::pair{200, 169}, {1980, 1672}, {801, 676}}) {
    options_.sheet.width_px = width;
    for (const SkyStyle style : {SkyStyle::Chart, SkyStyle::Fisheye}) {
      options_.style = style;
      const Pixels pixels(draw());
      EXPECT_EQ(pixels.width(), width);
      EXPECT_EQ(pixels.height(), height);  // 836/990 of the width, rounded
    }
  }
}

TEST_F(SkyplotTest, SameBytesOnAnyNumberOfThreads) {
  for (const SkyStyle style : {SkyStyle::Chart, SkyStyle::Fisheye}) {
    options_.style = style;
    const std::string many = draw();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_TRUE(draw() == many);
  }
}

TEST_F(SkyplotTest, InsideABuildingThePictureSaysSo) {
  const Vector3d inside(10.5, 0, 2);
  const SkyDrawing drawing = make_sky_drawing(*environment_, *propagator_, time_, inside, options_);
  EXPECT_EQ(drawing.containment, raytrace::Containment::InsideBuilding);
  for (const SkySatellite& s : drawing.satellites) EXPECT_EQ(s.now.visibility, Visibility::Blocked);
  for (const SkyStyle style : {SkyStyle::Chart, SkyStyle::Fisheye}) {
    options_.style = style;
    // The note's frame and letters, 0.45 of the radius below the middle.
    const Pixels free(draw()), indoors(draw(inside));
    EXPECT_GT(indoors.count(kVermilion), free.count(kVermilion) + 200);
    EXPECT_TRUE(indoors.has_near({410, 456 + 0.45 * 340}, 8, kVermilion));
  }
}

TEST_F(SkyplotTest, BadInput) {
  const auto refused = [this] { EXPECT_THROW((void)draw(), InputError); };
  options_.sheet.width_px = 199;
  refused();
  options_.sheet.width_px = 4001;
  refused();
  options_.sheet.width_px = 990;
  options_.trail_s = -1;
  refused();
  options_.trail_s = std::numeric_limits<double>::quiet_NaN();
  refused();
  options_.trail_s = 86'401;
  refused();
  options_.trail_s = 0;
  options_.elevation_mask_rad = radians(90);
  refused();
  options_.elevation_mask_rad = 0;
  EXPECT_THROW((void)draw({std::numeric_limits<double>::quiet_NaN(), 0, 2}), InputError);
  EXPECT_THROW((void)draw_sky(SkyDrawing{}, SkySheet{PictureFormat::Png, 0}), InputError);
}

// Each direction in the picture of an upward camera equals that of the ray cast there: a thin mast in the
// north-west.
TEST(SkyRender, AMastStandsAtItsAzimuth) {
  city::Mesh mesh;
  canyon::test::append_box(mesh, "mast", city::Surface::Building, city::Material::Metal, {-21, 20, 0},
                           {-20, 21, 60});
  const raytrace::RayScene scene(mesh);
  const SkyLens lens{{200, 200}, 200, SkyProjection::Equidistant, true};
  const RgbImage image = render_sky(scene, mesh, {0, 0, 2}, lens, 400, 400);
  const auto at = [&](double azimuth_deg, double elevation_deg) {
    const Point p = lens.point(radians(azimuth_deg), radians(elevation_deg));
    return image.pixels.at(static_cast<std::size_t>(p.y) * 400 + static_cast<std::size_t>(p.x));
  };
  // Its axis is at azimuth 315, its top 58 m up, 28.99 m away: elevation 63.4.
  EXPECT_TRUE(is_wall(at(315, 30)));
  EXPECT_TRUE(is_wall(at(315, 61)));
  EXPECT_TRUE(is_sky(at(315, 66)));
  EXPECT_TRUE(is_sky(at(45, 30)));
  EXPECT_TRUE(is_sky(at(309, 30)));
  EXPECT_EQ(image.pixels[0], 0xFFFFFFU) << "paper beyond the disc";
}

TEST(SkyRender, MovingThingsAreSeen) {
  const city::Mesh city;
  raytrace::RayScene scene(city);
  city::Mesh truck;
  canyon::test::append_box(truck, "truck", city::Surface::Vehicle, city::Material::Metal, {-5, -1.2, 0},
                           {5, 1.2, 3.5});
  const raytrace::InstanceId id = scene.add_instance(truck);
  const SkyLens lens{{100, 100}, 100, SkyProjection::Stereographic, true};
  const auto east = [&] {
    const RgbImage image = render_sky(scene, city, {0, 0, 1.5}, lens, 200, 200);
    const Point p = lens.point(radians(90), radians(8));
    return image.pixels.at(static_cast<std::size_t>(p.y) * 200 + static_cast<std::size_t>(p.x));
  };
  EXPECT_TRUE(is_sky(east()));
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Vector3d(9, 0, 0);  // its rear at 4 m, 2 m above the antenna: up to 26.6 deg
  scene.set_pose(id, pose);
  scene.commit();
  EXPECT_TRUE(is_wall(east()));
}

// Tracks lead up to where satellites are now, over the requested time, interrupted while they were below the
// horizon.
TEST(SkyplotTrails, OfTheLastMinutes) {
  city::City city;
  city.frame = geodesy::LocalFrame(kOrigin);
  const geodesy::GpsTime time = geodesy::parse_time("2026-06-01T08:00:00Z");
  auto sky = std::make_shared<orbit::BroadcastSky>(
      orbit::nominal_constellation(time - 3600.0, time, {gnss::System::GPS}));
  const simulation::Environment environment(std::move(city), sky);
  const propagation::Propagator propagator = environment.make_propagator({});
  SkyplotOptions options;
  options.trail_s = 3600;
  const SkyDrawing drawing = make_sky_drawing(environment, propagator, time, {0, 0, 2}, options);
  ASSERT_GT(drawing.satellites.size(), 5U);
  EXPECT_EQ(drawing.trail_meaning, "last 60 min, seen here");
  std::size_t whole = 0;
  for (const SkySatellite& s : drawing.satellites) {
    ASSERT_FALSE(s.trails.empty());
    const std::vector<SkyPoint>& last = s.trails.back();
    EXPECT_EQ(last.back().azimuth_rad, s.now.azimuth_rad);
    EXPECT_EQ(last.back().elevation_rad, s.now.elevation_rad);
    whole += last.size() == 61 ? 1U : 0U;  // a point each minute, both ends
  }
  EXPECT_GT(whole, 3U);
  EXPECT_LT(whole, drawing.satellites.size()) << "one rose within the hour";
  options.trail_s = 0;
  for (const SkySatellite& s :
       make_sky_drawing(environment, propagator, time, {0, 0, 2}, options).satellites) {
    EXPECT_TRUE(s.trails.empty());
  }
}

}  // namespace
}  // namespace canyon::drawing::skyplot_test
