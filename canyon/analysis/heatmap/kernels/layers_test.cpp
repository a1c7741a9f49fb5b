#include "canyon/analysis/heatmap/kernels/layers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "canyon/base/input_error.hpp"

namespace canyon::heatmap {
namespace {

TEST(Layers, EveryLayerIsFoundByItsName) {
  std::set<std::string_view> names;
  for (const LayerInfo& each : all_layers()) {
    EXPECT_EQ(&info(each.layer), &each);
    EXPECT_EQ(layer_by_name(each.name), each.layer);
    EXPECT_TRUE(names.insert(each.name).second) << each.name;
    EXPECT_FALSE(each.long_name.empty());
    EXPECT_TRUE(each.unit == "m" || each.unit == "1" || each.unit == "s") << each.name;
    EXPECT_TRUE(std::all_of(each.name.begin(), each.name.end(), [](char c) {
      return c == '_' || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    })) << each.name;
  }
  EXPECT_EQ(layer_by_name(" HDOP "), Layer::Hdop);
}

TEST(Layers, SayWhatTheyNeed) {
  for (const LayerInfo& each : all_layers()) {
    const bool statistics = each.name.find("error_") != std::string_view::npos ||
                            each.layer == Layer::ProtectedAvailability ||
                            each.layer == Layer::MisleadingFraction || is_rtk_layer(each.layer);
    EXPECT_EQ(each.needs_samples, statistics) << each.name;
    EXPECT_EQ(each.received, each.layer != Layer::SatellitesLos && each.layer != Layer::SkyView) << each.name;
    if (each.needs_samples) {
      EXPECT_TRUE(each.error) << each.name;
    }
    if (each.error) {
      EXPECT_TRUE(each.received) << each.name;
    }
  }
}

TEST(Layers, AnotherNameIsAnErrorThatNamesTheClosest) {
  try {
    (void)layer_by_name("horizontal_eror");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.problem(), "there is no layer 'horizontal_eror'");
    EXPECT_EQ(error.hint(), "did you mean 'horizontal_error'?");
  }
  EXPECT_THROW((void)layer_by_name("all"), InputError);
  EXPECT_THROW((void)layer_by_name(""), InputError);
}

// "all" must not become a hundred times slower: layers that run through time must be requested by name.
TEST(Layers, OneLookGivesAllThatDoNotRunOn) {
  const std::vector<Layer> layers = layers_of_one_look();
  EXPECT_EQ(layers.size(), all_layers().size() - 3);
  EXPECT_EQ(std::count_if(layers.begin(), layers.end(), is_rtk_layer), 0);
}

TEST(Layers, LimitsHaveBounds) {
  LimitOptions limits;
  EXPECT_NO_THROW(limits.validate());
  limits.error_m = 0;
  EXPECT_THROW(limits.validate(), InputError);
  limits = {};
  limits.rtk_s = 3601;
  EXPECT_THROW(limits.validate(), InputError);
}

TEST(Layers, ThePaperShowsThree) {
  EXPECT_EQ(default_layers(), (std::vector{Layer::HorizontalError, Layer::SatellitesVisible, Layer::Hdop}));
}

}  // namespace
}  // namespace canyon::heatmap
