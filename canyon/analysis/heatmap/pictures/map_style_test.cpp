#include "canyon/analysis/heatmap/pictures/map_style.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace canyon::heatmap::map_style_test {
namespace {

using drawing::Colour;
using ::testing::ElementsAre;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A row of a published table: entry of 256, and its colour.
struct Entry {
  int entry;
  double r, g, b;
};

void expect_near(Colour (*map)(double), const std::vector<Entry>& table, double tolerance) {
  for (const Entry& e : table) {
    const Colour c = map(e.entry / 255.0);
    EXPECT_NEAR(c.r, e.r, tolerance) << e.entry;
    EXPECT_NEAR(c.g, e.g, tolerance) << e.entry;
    EXPECT_NEAR(c.b, e.b, tolerance) << e.entry;
  }
}

/// CIE lightness L* of an sRGB colour (IEC 61966-2-1; CIE 15).
double lightness(const Colour& c) {
  const auto linear = [](double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); };
  const double y = 0.2126 * linear(c.r) + 0.7152 * linear(c.g) + 0.0722 * linear(c.b);
  return y > 216.0 / 24389 ? 116 * std::cbrt(y) - 16 : y * 24389 / 27;
}

ValueCounts histogram_of(const std::vector<float>& values) {
  ValueCounts histogram;
  for (const float value : values) histogram.add(value);
  return histogram;
}

std::vector<std::string> labels(const ColourScale& scale) {
  std::vector<std::string> labels;
  for (const auto& tick : scale.ticks) labels.push_back(tick.second);
  return labels;
}

// Entries of Matplotlib 3's _inferno_data and _cividis_data half-way between the knots, where the error is
// largest.
TEST(MapStyle, FollowsPublishedTables) {
  expect_near(&inferno,
              {{8, 0.0140, 0.0112, 0.0719},
               {24, 0.0820, 0.0433, 0.2153},
               {56, 0.2908, 0.0456, 0.4186},
               {88, 0.4910, 0.1172, 0.4256},
               {120, 0.6887, 0.1922, 0.3576},
               {152, 0.8605, 0.3119, 0.2306},
               {184, 0.9654, 0.5022, 0.0739},
               {216, 0.9841, 0.7361, 0.1295},
               {248, 0.9545, 0.9659, 0.5404},
               {255, 0.9884, 0.9984, 0.6449}},
              0.035);
  expect_near(&cividis,
              {{8, 0.0, 0.1579, 0.3575},
               {24, 0.0179, 0.1985, 0.4412},
               {56, 0.2309, 0.2861, 0.4235},
               {88, 0.3529, 0.3732, 0.4302},
               {120, 0.4616, 0.4624, 0.4620},
               {152, 0.5782, 0.5557, 0.4687},
               {184, 0.7040, 0.6547, 0.4371},
               {216, 0.8364, 0.7615, 0.3687},
               {248, 0.9778, 0.8773, 0.2280},
               {255, 0.9957, 0.9093, 0.2178}},
              0.035);
}

TEST(MapStyle, GreyTellsOrder) {
  for (Colour (*map)(double) : {&inferno, &cividis, &drawing::viridis}) {
    for (int i = 0; i < 100; ++i) {
      EXPECT_LT(lightness(map(i / 100.0)), lightness(map((i + 1) / 100.0)));
    }
  }
  // The grey of signed values shows their distance from zero.
  for (int i = 0; i < 50; ++i) {
    EXPECT_LT(lightness(orange_purple(i / 100.0)), lightness(orange_purple((i + 1) / 100.0)));
    EXPECT_LT(lightness(orange_purple(1 - i / 100.0)), lightness(orange_purple(1 - (i + 1) / 100.0)));
  }
}

TEST(MapStyle, BrightIsGood) {
  const ValueCounts values = histogram_of({1, 2, 3, 4, 5});
  for (const LayerInfo& each : all_layers()) {
    if (each.layer == Layer::VerticalError) continue;
    const ColourScale scale = make_colour_scale(each.layer, values);
    const bool good = each.name == "availability" || each.name == "protected_availability" ||
                      each.name == "sky_view" || each.name == "satellites_los" ||
                      each.name == "satellites_visible" || each.name == "satellites_used" ||
                      each.name == "rtk_fixed_share";
    const double low = lightness(scale.colour_at(0)), high = lightness(scale.colour_at(1));
    EXPECT_TRUE(good ? low < high : low > high) << each.name;
  }
}

TEST(MapStyle, LengthsReachTheirNinetyEighthPercentile) {
  std::vector<float> values(98, 21);
  values.insert(values.end(), {500, 900});
  const ColourScale scale = make_colour_scale(Layer::HorizontalErrorP95, histogram_of(values));
  EXPECT_EQ(scale.progression, ColourScale::Progression::Linear);
  EXPECT_EQ(scale.high, 25);
  EXPECT_TRUE(scale.above);
  EXPECT_FALSE(scale.below);
  EXPECT_EQ(scale.unit, "m");
  EXPECT_THAT(labels(scale), ElementsAre("0", "5", "10", "15", "20", "25"));
  EXPECT_DOUBLE_EQ(scale.at(5), 0.2);
  EXPECT_DOUBLE_EQ(scale.at(900), 1);
  EXPECT_EQ(scale.at(kNaN), 0);
}

TEST(MapStyle, SkewedLengthsGoByRootOrLogarithm) {
  std::vector<float> zeros(90, 0);
  zeros.insert(zeros.end(), 10, 95);
  const ColourScale root = make_colour_scale(Layer::HorizontalError, histogram_of(zeros));
  EXPECT_EQ(root.progression, ColourScale::Progression::SquareRoot);
  EXPECT_EQ(root.high, 100);
  EXPECT_DOUBLE_EQ(root.at(25), 0.5);
  // "5" would be within a tenth of the bar from "10".
  EXPECT_THAT(labels(root), ElementsAre("0", "2", "10", "20", "50", "100"));

  std::vector<float> twos(90, 2.05F);
  twos.insert(twos.end(), 10, 195);
  const ColourScale logarithm = make_colour_scale(Layer::HorizontalErrorP95, histogram_of(twos));
  EXPECT_EQ(logarithm.progression, ColourScale::Progression::Logarithm);
  EXPECT_EQ(logarithm.low, 2);
  EXPECT_EQ(logarithm.high, 200);
  EXPECT_DOUBLE_EQ(logarithm.at(20), 0.5);
  EXPECT_THAT(labels(logarithm), ElementsAre("2", "5", "10", "20", "50", "100", "200"));
}

TEST(MapStyle, SignedLengthsGoToBothSides) {
  const ColourScale scale = make_colour_scale(Layer::VerticalError, histogram_of({3, 2, 1, 2}));
  EXPECT_EQ(scale.low, -scale.high);
  EXPECT_GE(scale.high, 3);
  EXPECT_DOUBLE_EQ(scale.at(0), 0.5);
  EXPECT_DOUBLE_EQ(scale.at(scale.high / 2), 0.75);
  EXPECT_DOUBLE_EQ(scale.at(-scale.high), 0);
  EXPECT_FALSE(scale.below || scale.above);
}

TEST(MapStyle, DopsEndAtTheLargestDrawn) {
  std::vector<float> values(50, 1.2F);
  values.insert(values.end(), 50, 300);
  const ColourScale scale = make_colour_scale(Layer::Hdop, histogram_of(values));
  EXPECT_EQ(scale.high, kMaxRenderedDop);
  EXPECT_TRUE(scale.above);
  EXPECT_EQ(labels(scale).back(), "20");
  const ColourScale narrow = make_colour_scale(Layer::Pdop, histogram_of({1.1F, 2.9F, 2.4F}));
  EXPECT_EQ(narrow.low, 1);
  EXPECT_EQ(narrow.high, 3);
  EXPECT_FALSE(narrow.above || narrow.below);
}

TEST(MapStyle, CountsHaveClasses) {
  const ColourScale few = make_colour_scale(Layer::SatellitesVisible, histogram_of({3, 4, 7}));
  EXPECT_EQ(few.classes, 5);
  EXPECT_THAT(labels(few), ElementsAre("3", "4", "5", "6", "7"));
  std::vector<double> shades;
  for (int n = 3; n <= 7; ++n) shades.push_back(few.colour(n).g);
  for (std::size_t i = 1; i < shades.size(); ++i) EXPECT_GT(shades[i], shades[i - 1]);
  EXPECT_EQ(few.colour(7).g, few.colour_at(1).g);

  const ColourScale many = make_colour_scale(Layer::SatellitesUsed, histogram_of({0, 38}));
  EXPECT_EQ(many.classes, 8);
  EXPECT_EQ(many.class_width, 5);
  EXPECT_THAT(labels(many), ElementsAre("0", "5", "10", "15", "20", "25", "30", "35", "40"));
  EXPECT_EQ(many.colour(14).g, many.colour(10).g);
  EXPECT_NE(many.colour(15).g, many.colour(14).g);
}

TEST(MapStyle, NothingToShowStillHasAScale) {
  for (const LayerInfo& each : all_layers()) {
    const ColourScale scale = make_colour_scale(each.layer, {});
    EXPECT_LT(scale.low, scale.high) << each.name;
    EXPECT_GE(scale.ticks.size(), 1U) << each.name;
    EXPECT_FALSE(scale.below || scale.above) << each.name;
  }
}

TEST(MapStyle, LabelsStandApart) {
  for (const float end : {0.03F, 0.9F, 4.4F, 11.F, 47.F, 390.F, 25000.F}) {
    std::vector<float> values;
    for (int i = 1; i <= 1000; ++i) values.push_back(end * std::pow(i / 1000.0F, 6.0F));
    for (const Layer layer : {Layer::HorizontalError, Layer::VerticalError, Layer::LargestExcess}) {
      const ColourScale scale = make_colour_scale(layer, histogram_of(values));
      ASSERT_GE(scale.ticks.size(), 3U);
      for (std::size_t i = 1; i < scale.ticks.size(); ++i) {
        EXPECT_GT(scale.ticks[i].first - scale.ticks[i - 1].first, 0.0999)
            << end << " " << scale.ticks[i].second;
      }
      EXPECT_DOUBLE_EQ(scale.ticks.front().first, 0);
      EXPECT_DOUBLE_EQ(scale.ticks.back().first, 1);
    }
  }
}

}  // namespace
}  // namespace canyon::heatmap::map_style_test
