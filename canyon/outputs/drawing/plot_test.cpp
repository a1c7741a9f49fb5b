#include "canyon/outputs/drawing/plot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/png_pixels.hpp"

namespace canyon::drawing {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(LinearScale, WholeStepsHoldTheRange) {
  const Scale scale = linear_scale(-13, 86, 5);
  EXPECT_EQ(scale.low, -20);
  EXPECT_EQ(scale.high, 100);
  EXPECT_FALSE(scale.logarithmic);
  EXPECT_THAT(scale.ticks, ElementsAre(-20, 0, 20, 40, 60, 80, 100));
  const Scale exact = linear_scale(0, 50, 5);
  EXPECT_EQ(exact.low, 0);
  EXPECT_EQ(exact.high, 50);
}

TEST(LinearScale, OneValueGetsAWidth) {
  const Scale scale = linear_scale(7, 7);
  EXPECT_LT(scale.low, 7);
  EXPECT_GT(scale.high, 7);
  EXPECT_GE(scale.ticks.size(), 3U);
  const Scale far = linear_scale(-3e6, -3e6);
  EXPECT_LT(far.low, -3e6);
  EXPECT_GT(far.high, -3e6);
}

Plot sample_plot() {
  Plot plot;
  plot.area = {50, 20, 200, 100};
  plot.x = linear_scale(-10, 10, 4);
  plot.y = linear_scale(0, 4, 4);
  plot.x_label = "x [m]";
  plot.y_label = "y [m]";
  return plot;
}

TEST(Plot, XToTheRightYUpAndBeyondOnTheFrame) {
  const Plot plot = sample_plot();
  EXPECT_EQ(plot.at(-10, 0).x, 50);
  EXPECT_EQ(plot.at(-10, 0).y, 120);
  EXPECT_THAT(plot.at(5, 3).x, DoubleNear(200, 1e-9));
  EXPECT_THAT(plot.at(5, 3).y, DoubleNear(45, 1e-9));
  EXPECT_EQ(plot.at(99, 99).x, 250);
  EXPECT_EQ(plot.at(99, 99).y, 20);
}

TEST(Plot, LegendsAreAsLargeAsTheySay) {
  const std::vector<LegendEntry> entries{{[](Canvas& c, const Point& p) { c.circle(p, 4, kBlue); }, "one"},
                                         {{}, "a longer line without a mark"}};
  static_cast<void>(render_png(600, 200, 1, [&](Canvas& canvas) {
    const Rect size = legend_size(canvas, entries);
    const Rect box = draw_legend(canvas, {30, 40}, entries);
    EXPECT_EQ(box.x, 30);
    EXPECT_EQ(box.y, 40);
    EXPECT_EQ(box.width, size.width);
    EXPECT_EQ(box.height, size.height);
    EXPECT_GT(box.width, canvas.text_width(entries[1].label, {.size = 11.5}));
  }));
}

TEST(Plot, AFrameHasItsTicksAndANoticeItsPicture) {
  const auto draw = [](Canvas& canvas) {
    const Plot plot = sample_plot();
    plot.draw_ground(canvas);
    plot.draw_frame(canvas);
    plot.draw_note(canvas, "nothing");
  };
  const test::PngPixels pixels(render_png(300, 200, 1, draw));
  EXPECT_TRUE(test::PngPixels::is(pixels.pixel(110, 100), kGround));
  EXPECT_FALSE(test::PngPixels::is(pixels.pixel(50, 70), kGround));  // the frame
  EXPECT_TRUE(test::PngPixels::is(pixels.pixel(290, 100), kPaper));
  EXPECT_THAT(draw_notice("title", "subtitle", "nothing").svg, HasSubstr("</svg>"));
}

TEST(Svg, TheSameDrawingHasTheSameBytes) {
  const auto draw = [](Canvas& canvas) {
    canvas.rectangle({10, 10, 50, 50}, kBlue.with_alpha(0.5));
    canvas.text({20, 80}, "text", {.halo = 2, .halo_colour = kPaper.with_alpha(0.5)});
  };
  EXPECT_EQ(render_svg(200, 100, draw), render_svg(200, 100, draw));
}

}  // namespace
}  // namespace canyon::drawing
