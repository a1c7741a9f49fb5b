#include "canyon/outputs/drawing/views/pictures.hpp"
#include "canyon/outputs/drawing/views/timeline_picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <set>
#include <string>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/outputs/drawing/views/sky_picture.hpp"
#include "canyon/outputs/drawing/views/track_picture.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/loaded_city.hpp"
#include "tests/support/png_pixels.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::drawing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A decoded picture of two pixels to the unit.
class Pixels : public test::PngPixels {
 public:
  using PngPixels::PngPixels;

  /// 0xRRGGBB at a point in the picture's units.
  [[nodiscard]] std::uint32_t at(const Point& p) const {
    return pixel(static_cast<int>(2 * p.x), static_cast<int>(2 * p.y));
  }
  /// Whether a colour occurs within `reach` units of a point.
  [[nodiscard]] bool has_near(const Point& p, double reach, const Colour& colour) const {
    const int r = static_cast<int>(2 * reach);
    for (int y = -r; y <= r; ++y) {
      for (int x = -r; x <= r; ++x) {
        if (is(pixel(static_cast<int>(2 * p.x) + x, static_cast<int>(2 * p.y) + y), colour)) return true;
      }
    }
    return false;
  }
};

constexpr const char* kPngSignature = "\x89PNG\r\n\x1a\n";

TEST(MapExtent, TrackFixesAndMargin) {
  std::vector<TrackPoint> points{{{0, 0}, {}, 0}, {{100, 80}, Eigen::Vector2d(120, 80), 20}};
  const city::Box box = map_extent(points);
  // x 0 to 120, y 0 to 80, a tenth on each side.
  EXPECT_NEAR(box.min.x(), -12, 1e-9);
  EXPECT_NEAR(box.max.x(), 132, 1e-9);
  EXPECT_NEAR(box.min.y(), -8, 1e-9);
  EXPECT_NEAR(box.max.y(), 88, 1e-9);
}

TEST(MapExtent, OneFarFixOfManyDoesNotCount) {
  std::vector<TrackPoint> points;
  for (int i = 0; i <= 100; ++i) points.push_back({{i, 60}, Eigen::Vector2d(i, 61), 1});
  points[50].fix = Eigen::Vector2d(5000, 60);
  points[50].error_m = 4950;
  EXPECT_LT(map_extent(points).max.x(), 150);
  // Any number of outliers does not either.
  for (auto& p : points) {
    p.fix = Eigen::Vector2d(90000, 0);
    p.error_m = 90000;
  }
  EXPECT_LT(map_extent(points).max.x(), 150);
}

TEST(MapExtent, StandstillAndStraightLine) {
  const city::Box one = map_extent({{{5, 5}, {}, 0}});
  EXPECT_NEAR(one.max.x() - one.min.x(), 60, 1e-9);
  EXPECT_NEAR(one.max.y() - one.min.y(), 60, 1e-9);
  const city::Box line = map_extent({{{0, 0}, {}, 0}, {{1000, 0}, {}, 0}});
  EXPECT_NEAR(line.max.y() - line.min.y(), 600, 1e-9);
}

TEST(MapPoint, NorthIsUpEastIsRight) {
  const Rect area{10, 20, 100, 200};
  const city::Box extent{{0, 0, 0}, {50, 100, 0}};
  const Point south_west = map_point(area, extent, {0, 0});
  EXPECT_EQ(south_west.x, 10);
  EXPECT_EQ(south_west.y, 220);
  const Point north_east = map_point(area, extent, {50, 100});
  EXPECT_EQ(north_east.x, 110);
  EXPECT_EQ(north_east.y, 20);
}

// A square map of 120 m; one building in its north-east quarter, an L-shaped drive around it.
class TrackPictureTest : public ::testing::Test {
 protected:
  TrackPictureTest() {
    canyon::test::append_box(mesh_, "house", city::Surface::Building, city::Material::Unknown, {60, 60, 0},
                             {90, 90, 30});
    drawing_.title = "test";
    drawing_.subtitle = "sub";
    drawing_.mesh = &mesh_;
    for (int i = 0; i <= 100; i += 5) drawing_.points.push_back({{i, 0}, Eigen::Vector2d(i, 2), 2.0});
    for (int i = 5; i <= 100; i += 5) drawing_.points.push_back({{100, i}, {}, 0});
    drawing_.epochs = drawing_.points.size();
    drawing_.without_fix = 20;
    for (int i = 0; i < 21; ++i) drawing_.error_m.add(2);
  }
  /// The page position of a point: the map's frame is 860 units high, its upper left corner at (76, 78).
  [[nodiscard]] Point page(double east, double north) const {
    return map_point({76, 78, 860, 860}, map_extent(drawing_.points), {east, north});
  }

  city::Mesh mesh_;
  TrackDrawing drawing_;
};

TEST_F(TrackPictureTest, BuildingsTrackFixesAndOutages) {
  const Picture picture = draw_track(drawing_);
  EXPECT_THAT(picture.png, StartsWith(kPngSignature));
  EXPECT_THAT(picture.svg, HasSubstr("<svg"));
  EXPECT_THAT(picture.svg, HasSubstr("</svg>"));
  const Pixels pixels(picture.png);
  EXPECT_TRUE(Pixels::is(pixels.at(page(75, 75)), kHighRoof)) << "the highest roof";
  EXPECT_TRUE(Pixels::is(pixels.at(page(25, 75)), kGround));
  EXPECT_TRUE(Pixels::is(pixels.at(page(75, 25)), kGround));
  EXPECT_TRUE(pixels.has_near(page(52, 0), 2, kInk)) << "the true track";
  EXPECT_TRUE(pixels.has_near(page(50, 2), 1, viridis(2.0 / 2.5))) << "2 m of a scale to 2.5 m";
  EXPECT_TRUE(pixels.has_near(page(100, 50), 6, kNoFix)) << "no fix";
  EXPECT_FALSE(pixels.has_near(page(50, 0), 6, kNoFix));
}

TEST_F(TrackPictureTest, FixOffTheMapBecomesAnArrowAtTheRim) {
  drawing_.points[3].fix = Eigen::Vector2d(-5000, 50);  // west
  drawing_.points[3].error_m = 5015;
  const Picture picture = draw_track(drawing_);
  const Pixels pixels(picture.png);
  const city::Box extent = map_extent(drawing_.points);
  EXPECT_TRUE(pixels.has_near({76 + 8, page(50, 50).y}, 3, viridis(1)));
  EXPECT_GT(extent.min.x(), -30);
}

TEST_F(TrackPictureTest, OpenFieldStandstillWithoutAnyFix) {
  drawing_.mesh = nullptr;
  drawing_.points = {{{3, 4}, {}, 0}};
  EXPECT_THAT(draw_track(drawing_).png, StartsWith(kPngSignature));
}

TEST_F(TrackPictureTest, ManyFixes) {
  drawing_.points.clear();
  for (int i = 0; i < 20000; ++i) {
    drawing_.points.push_back(
        {{0.01 * i, 0}, Eigen::Vector2d(0.01 * i, 0.001 * (i % 5000)), 0.001 * (i % 5000)});
  }
  const Picture picture = draw_track(drawing_);
  EXPECT_LT(picture.svg.size(), 8'000'000U);
}

TEST_F(TrackPictureTest, TextThatIsNotUtf8IsStillDrawn) {
  drawing_.title = "bad \xff\xc3 text \xe2\x82\xac \xed\xa0\x80 \xf0\x9f\x9b\xb0";
  EXPECT_NO_THROW(static_cast<void>(draw_track(drawing_)));
}

SkyMask eastern_half_hidden() {
  SkyMask mask;
  mask.azimuths.resize(360);
  for (std::size_t a = 0; a < 180; ++a) mask.azimuths[a].push_back({0, geodesy::radians(80)});
  return mask;
}

// Centre (410, 456), radius 340: azimuth is from the top, clockwise.
TEST(SkyPicture, NorthUpEastRight) {
  using propagation::Visibility;
  SkyDrawing drawing;
  drawing.mask = eastern_half_hidden();
  const auto satellite = [&](const std::string& name, double azimuth_deg, Visibility visibility) {
    drawing.satellites.push_back(
        {name, {geodesy::radians(azimuth_deg), geodesy::radians(45), visibility}, true, {}});
  };
  satellite("G01", 0, Visibility::LOS);
  satellite("G02", 90, Visibility::NLOS);
  satellite("G03", 180, Visibility::LOSMultipath);
  satellite("G04", 270, Visibility::Blocked);
  const Picture picture = draw_sky(drawing);
  const Pixels pixels(picture.png);
  EXPECT_EQ(pixels.width(), 2 * 990);
  EXPECT_EQ(pixels.height(), 2 * 836);
  EXPECT_TRUE(pixels.has_near({410, 456 - 170}, 1, colour_of(Visibility::LOS)));
  EXPECT_TRUE(pixels.has_near({410 + 170, 456}, 1, colour_of(Visibility::NLOS)));
  EXPECT_TRUE(pixels.has_near({410, 456 + 170}, 1, colour_of(Visibility::LOSMultipath)));
  EXPECT_TRUE(pixels.has_near({410 - 170, 456}, 1, kInk));
  const std::uint32_t east = pixels.at({410 + 250, 456 - 60});
  const std::uint32_t west = pixels.at({410 - 250, 456 - 60});
  EXPECT_TRUE(Pixels::is(west, kGround));
  EXPECT_FALSE(Pixels::is(east, kGround));
  EXPECT_LT(east & 0xFFU, west & 0xFFU) << "what is hidden is darker";
}

TEST(SkyPicture, EmptySky) {
  EXPECT_THAT(draw_sky({}).png, StartsWith(kPngSignature));
}

std::vector<TimelinePoint> minutes(std::size_t count, double step_s) {
  std::vector<TimelinePoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    TimelinePoint p;
    p.time = test::sample_time() + static_cast<double>(i) * step_s;
    p.visible = 8;
    p.blocked = 3;
    if (i < count / 2) {
      p.error_m = 3;
      p.hdop = 1.2;
      p.used = 7;
    }
    points.push_back(p);
  }
  return points;
}

// The plots begin at x = 84 and are 940 wide; the error's spans y 92 to 352, the satellites' 392 to 562.
TEST(TimelinePicture, OutagesAreShadedAndCountsStacked) {
  const Picture picture = draw_timeline({"t", "s", minutes(120, 1)});
  const Pixels pixels(picture.png);
  const std::uint32_t fixed = pixels.at({84 + 230, 110});
  const std::uint32_t outage = pixels.at({84 + 710, 110});
  EXPECT_TRUE(Pixels::is(fixed, kGround));
  EXPECT_FALSE(Pixels::is(outage, kGround));
  // 11 satellites of a scale to 12: 7 used, 1 unused, 3 blocked.
  const auto y = [](double satellites) { return 562 - 170 * satellites / 12; };
  EXPECT_TRUE(Pixels::is(pixels.at({84 + 230, y(5.5)}), kGreen));
  EXPECT_FALSE(Pixels::is(pixels.at({84 + 230, y(7.5)}), kGreen));
  EXPECT_FALSE(Pixels::is(pixels.at({84 + 710, y(5.5)}), kGreen));
  EXPECT_TRUE(Pixels::is(pixels.at({84 + 230, y(11.6)}), kGround));
}

// Below the HDOP's plot, which ends at y = 732, the strength's spans y 772 to 902 from 20 to 50 dB-Hz.
TEST(TimelinePicture, StrengthHasAPlotOfItsOwn) {
  auto points = minutes(120, 1);
  const Pixels plain(draw_timeline({"t", "s", points}).png);
  for (TimelinePoint& p : points) p.cn0_los_dbhz = 45;
  for (std::size_t i = 0; i < 60; ++i) points[i].cn0_nlos_dbhz = 25;
  const Pixels pixels(draw_timeline({"t", "s", points}).png);
  EXPECT_EQ(plain.height(), 2 * 800);
  EXPECT_EQ(pixels.height(), 2 * 970);
  const auto y = [](double cn0_dbhz) { return 902 - 130 * (cn0_dbhz - 20) / 30; };
  // The first epoch of 120.
  const double first = 84 + 940 * 0.5 / 120;
  const Colour los = colour_of(propagation::Visibility::LOS), nlos = colour_of(propagation::Visibility::NLOS);
  EXPECT_TRUE(Pixels::is(pixels.at({first, y(45)}), los));
  EXPECT_TRUE(Pixels::is(pixels.at({first, y(25)}), nlos));
  const double late = 84 + 940 * 100.5 / 120;
  EXPECT_TRUE(Pixels::is(pixels.at({late, y(45)}), los));
  EXPECT_FALSE(Pixels::is(pixels.at({late, y(25)}), nlos));
}

// A row of 18 units for each fault above the plots, and 12 to spare.
TEST(TimelinePicture, FaultsHaveBandsAndNames) {
  TimelineDrawing drawing{"t", "s", minutes(120, 1), {}};
  const auto at = [&](std::size_t i) { return drawing.points[i].time; };
  drawing.faults = {{"a", {{at(0), at(9)}, {at(100), at(119)}}}, {"b", {{at(50), at(59)}}}};
  const Picture picture = draw_timeline(drawing);
  const Pixels pixels(picture.png);
  EXPECT_EQ(pixels.height(), 2 * (800 + 48));
  const auto band = [&](double minute, double row) {
    return Pixels::is(pixels.at({84 + 940 * (minute + 0.5) / 120, 92 + 18 * row + 7}), rgb(0xCC79A7));
  };
  EXPECT_TRUE(band(5, 0));
  EXPECT_FALSE(band(20, 0));
  EXPECT_TRUE(band(110, 0));
  EXPECT_TRUE(band(55, 1));
  EXPECT_FALSE(band(5, 1));
}

TEST(TimelinePicture, OneEpochAndManyEpochs) {
  EXPECT_THAT(draw_timeline({"t", "s", minutes(1, 1)}).png, StartsWith(kPngSignature));
  const Picture many = draw_timeline({"t", "s", minutes(200'000, 0.1)});
  EXPECT_LT(many.svg.size(), 3'000'000U);
  EXPECT_GT(Pixels(many.png).count(kBlue), 200U);
}

const std::set<std::string> kFiles{"track.png",   "track.svg",    "skyplot.png",
                                   "skyplot.svg", "timeline.png", "timeline.svg"};

std::set<std::string> files_in(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

simulation::Simulation small_town() {
  const simulation::Scenario scenario = simulation::parse_scenario(R"(
city:
  synthetic: {blocks_east: 2, blocks_north: 2}
  origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}
sky: {nominal: true}
start: 2024-05-01T12:00:00Z
trajectory:
  waypoints:
    - {latitude_deg: 22.2997, longitude_deg: 114.17, height_m: 2}
    - {latitude_deg: 22.3003, longitude_deg: 114.17, height_m: 2}
receivers:
  - name: car
)",
                                                                   "town.yaml");
  return simulation::Simulation(scenario, test::loaded_city(scenario.city));
}

TEST(Pictures, OfARun) {
  const test::TemporaryFolder folder;
  const simulation::Simulation town = small_town();
  const auto pictures = make_pictures(town, folder.path(), 0);
  town.run({pictures.get()});  // calls finish()
  pictures->finish();
  EXPECT_EQ(files_in(folder.path()), kFiles);
  for (const std::string& name : kFiles) {
    const std::string bytes = test::read_bytes(folder / name);
    if (name.substr(name.size() - 3) == "png") {
      EXPECT_THAT(bytes, StartsWith(kPngSignature)) << name;
      const Pixels pixels(bytes);
      EXPECT_GT(pixels.width(), 1000) << name;
      EXPECT_GT(pixels.height(), 1000) << name;
      const auto all = static_cast<double>(pixels.width()) * pixels.height();
      EXPECT_LT(static_cast<double>(pixels.count(kPaper)), 0.9 * all) << name << " is more than paper";
    } else {
      EXPECT_THAT(bytes, HasSubstr("</svg>")) << name;
    }
  }
}

TEST(Pictures, SameRunSameBytes) {
  const simulation::Simulation town = small_town();
  const test::TemporaryFolder one;
  const test::TemporaryFolder other;
  for (const auto* folder : {&one, &other}) {
    const auto pictures = make_pictures(town, folder->path(), 0);
    town.run({pictures.get()});
    pictures->finish();
  }
  for (const char* name :
       {"track.png", "skyplot.png", "timeline.png", "track.svg", "skyplot.svg", "timeline.svg"}) {
    EXPECT_EQ(test::read_bytes(one / name), test::read_bytes(other / name)) << name;
  }
}

TEST(Pictures, MissingFolderIsFoundBeforeTheRun) {
  const test::TemporaryFolder folder;
  const simulation::Simulation town = small_town();
  EXPECT_THROW(static_cast<void>(make_pictures(town, folder / "missing", 0)), InputError);
  EXPECT_TRUE(files_in(folder.path()).empty());
}

TEST(Pictures, NothingIsLeftOfARunThatWasNotFinished) {
  const test::TemporaryFolder folder;
  const simulation::Simulation town = small_town();
  {
    const auto pictures = make_pictures(town, folder.path(), 0);
    pictures->write(test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3}));
  }
  EXPECT_TRUE(files_in(folder.path()).empty());
}

TEST(Pictures, NoEpochNoPicture) {
  const test::TemporaryFolder folder;
  const simulation::Simulation town = small_town();
  make_pictures(town, folder.path(), 0)->finish();
  EXPECT_TRUE(files_in(folder.path()).empty());
}

// The run has more epochs than stored snapshots; other receivers' epochs are ignored.
TEST(Pictures, LongRun) {
  const test::TemporaryFolder folder;
  const simulation::Simulation town = small_town();
  const auto pictures = make_pictures(town, folder.path(), 0);
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  for (int i = 0; i < 4500; ++i) {
    epoch.observed.time = test::sample_time() + i;
    epoch.receiver = static_cast<std::size_t>(i % 2);
    pictures->write(epoch);
  }
  pictures->finish();
  EXPECT_EQ(files_in(folder.path()), kFiles);
}

TEST(Palette, ViridisEndsAndGrowsLighter) {
  EXPECT_NEAR(viridis(0).r, 0x44 / 255.0, 1e-12);
  EXPECT_NEAR(viridis(1).g, 0xE7 / 255.0, 1e-12);
  double last = -1;
  for (double t = 0; t <= 1; t += 0.02) {
    const Colour c = viridis(t);
    const double luma = 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;  // Rec. 709
    EXPECT_GT(luma, last) << t;
    last = luma;
  }
  EXPECT_EQ(viridis(std::numeric_limits<double>::quiet_NaN()).r, viridis(0).r);
}

}  // namespace
}  // namespace canyon::drawing
