#include "canyon/city/tiles/tile_content.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/json.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::tiles {
namespace {

using test::bytes_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

std::string nothing(const std::string& uri) {
  throw InputError(uri + " is not there");
}

const std::vector<float> kTriangle{0, 0, 0, 2, 0, 0, 0, 3, 0};

TEST(TileContent, BatchedTilesHaveACentreAndNames) {
  const std::string gltf = test::triangle_glb({0, 0, 0, 2, 0, 0, 0, 3, 0}, {0, 1, 2}, "", "glass", {4, 4, 4});
  const TileContent content = read_content(
      test::b3dm(gltf, R"({"BATCH_LENGTH":5,"RTC_CENTER":[100,200,300]})",
                 R"({"name":["a","b","c","d","Town hall"],"class":["x","x","x","x","Building"]})"),
      'Y', nothing);
  ASSERT_THAT(content.models, SizeIs(1));
  const PosedModel& posed = content.models[0];
  ASSERT_THAT(posed.containments, SizeIs(1));
  // y up becomes z up, then the centre is added.
  const Eigen::Vector4d top = posed.containments[0] * posed.model.primitives[0].positions[2].homogeneous();
  EXPECT_TRUE(top.head<3>().isApprox(Eigen::Vector3d(100, 200, 303)));
  EXPECT_EQ(posed.batch.name.at(4), "Town hall");
  EXPECT_EQ(posed.batch.kind.at(4), "Building");
  EXPECT_THAT(posed.model.primitives[0].features, ElementsAre(4, 4, 4));
  // Tilesets from before 2018 may have z.
  const TileContent upright = read_content(test::b3dm(gltf), 'Z', nothing);
  EXPECT_EQ(upright.models.at(0).containments.at(0), Eigen::Matrix4d(Eigen::Matrix4d::Identity()));
}

std::string i3dm(const std::string& features, const std::string& binary, const std::string& gltf) {
  const auto size = static_cast<std::uint32_t>(32 + features.size() + binary.size() + gltf.size());
  return "i3dm" +
         bytes_of<std::uint32_t>({1, size, static_cast<std::uint32_t>(features.size()),
                                  static_cast<std::uint32_t>(binary.size()), 0, 0, 1}) +
         features + binary + gltf;
}

TEST(TileContent, InstancesStandWhereTheyAreTold) {
  const std::string gltf = test::triangle_glb(kTriangle, {0, 1, 2});
  const std::string binary = bytes_of<float>({1, 2, 3, 4, 5, 6}) + bytes_of<float>({1, 10});
  const TileContent content = read_content(
      i3dm(R"({"INSTANCES_LENGTH":2,"POSITION":{"byteOffset":0},"SCALE":{"byteOffset":24}})", binary, gltf),
      'Y', nothing);
  ASSERT_THAT(content.models.at(0).containments, SizeIs(2));
  const Eigen::Vector4d corner = content.models[0].containments[1] * Eigen::Vector4d(2, 0, 0, 1);
  EXPECT_TRUE(corner.head<3>().isApprox(Eigen::Vector3d(24, 5, 6)));
  EXPECT_THAT(test::refusal([&] {
                (void)read_content(
                    i3dm(R"({"INSTANCES_LENGTH":9,"POSITION":{"byteOffset":0}})", binary, gltf), 'Y',
                    nothing);
              }),
              HasSubstr("extends beyond"));
  EXPECT_THAT(test::refusal([&] {
                (void)read_content(i3dm(R"({"INSTANCES_LENGTH":4000000000,"POSITION":[]})", binary, gltf),
                                   'Y', nothing);
              }),
              HasSubstr("instances"));
}

TEST(TileContent, CompositesHoldTilesAndPointsAreNamed) {
  const std::string inner = test::b3dm(test::triangle_glb(kTriangle, {0, 1, 2}));
  const std::string points = "pnts" + bytes_of<std::uint32_t>({1, 28, 0, 0, 0, 0});
  const std::string cmpt =
      "cmpt" +
      bytes_of<std::uint32_t>({1, static_cast<std::uint32_t>(16 + inner.size() + points.size()), 2}) + inner +
      points;
  const TileContent content = read_content(cmpt, 'Y', nothing);
  EXPECT_THAT(content.models, SizeIs(1));
  EXPECT_THAT(content.left_out, ElementsAre("points (pnts)"));
  EXPECT_THAT(test::refusal([&] { (void)read_content(cmpt.substr(0, cmpt.size() - 20), 'Y', nothing); }),
              HasSubstr("end early"));
  EXPECT_THAT(test::refusal([&] {
                (void)read_content("cmpt" + bytes_of<std::uint32_t>({1, 28, 1, 0, 1, 4}), 'Y', nothing);
              }),
              HasSubstr("shorter than its header"));
}

}  // namespace
}  // namespace canyon::tiles
