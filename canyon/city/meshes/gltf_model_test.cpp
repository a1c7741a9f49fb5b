#include "canyon/city/meshes/gltf_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/json.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::meshes {
namespace {

using test::bytes_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

std::string nothing(const std::string& uri) {
  throw InputError(uri + " is not there");
}

GltfModel model_of(const std::string& gltf) {
  return read_gltf(gltf, nothing);
}

std::string gltf_refusal(const std::string& gltf) {
  return test::refusal([&] { (void)model_of(gltf); });
}

std::string with(std::string text, const std::string& old, const std::string& now) {
  text.replace(text.find(old), old.size(), now);
  return text;
}

const std::vector<float> kTriangle{0, 0, 0, 2, 0, 0, 0, 3, 0};

/// A GLB of one triangle with this list of accessors, the first for the positions.
std::string with_accessors(const std::string& accessors, const std::string& node = {}) {
  return test::glb(
      fmt::format(
          R"({{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0{}}}],"meshes":)"
          R"([{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"buffers":[{{"byteLength":36}}],)"
          R"("bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteLength":36,"byteStride":1}}],)"
          R"("accessors":[{}]}})",
          node, accessors),
      bytes_of(kTriangle));
}

// 500 bytes that needed 4 GB: counts are compared with the bytes before any allocation.
TEST(Gltf, CountsDoNotExceedTheBytes) {
  const std::string positions = R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"})";
  EXPECT_THAT(model_of(with_accessors(positions)).primitives, SizeIs(1));
  const std::string many = R"("componentType":5126,"count":33000000,"type":)";
  for (const std::string type : {R"("VEC3")", R"("MAT4")", R"("SCALAR")"}) {
    EXPECT_THAT(gltf_refusal(with_accessors("{" + many + type + "}")), HasSubstr("33000000 elements"))
        << type;
    EXPECT_THAT(gltf_refusal(with_accessors(R"({"bufferView":0,)" + many + type + "}")),
                HasSubstr("33000000 elements"));
    EXPECT_NE(gltf_refusal(
                  with_accessors("{" + many + type +
                                 R"(,"sparse":{"count":30000000,"indices":{"bufferView":0,"componentType":)"
                                 R"(5121},"values":{"bufferView":0}}})")),
              "");
    const std::string instances =
        R"(,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":1}}})";
    EXPECT_NE(gltf_refusal(with_accessors(positions + ",{" + many + type + "}", instances)), "") << type;
  }
  EXPECT_THAT(
      gltf_refusal(with_accessors(R"({"bufferView":1,"componentType":5126,"count":20,"type":"VEC3"})")),
      HasSubstr("overlap"));
}

// A long name is one name, however many nodes and primitives share it.
TEST(Gltf, LongNamesAreCut) {
  const std::string name(50'000, 'n');
  const GltfModel model =
      model_of(test::triangle_glb(kTriangle, {0, 1, 2}, fmt::format(R"(,"name":"{}")", name), name));
  EXPECT_THAT(model.primitives[0].node, SizeIs(1000));
  EXPECT_THAT(model.primitives[0].material, SizeIs(1000));
}

TEST(Gltf, NodesMoveTheirMeshes) {
  // Rotated by 90 deg about z (x to y), twice as large, and moved.
  const GltfModel model = model_of(test::triangle_glb(
      kTriangle, {0, 1, 2},
      R"(,"name":"Roof","translation":[10,20,30],"rotation":[0,0,0.7071067811865476,0.7071067811865476],"scale":[2,2,2])",
      "red_brick"));
  ASSERT_THAT(model.primitives, SizeIs(1));
  const GltfPrimitive& primitive = model.primitives[0];
  EXPECT_EQ(primitive.node, "Roof");
  EXPECT_EQ(primitive.material, "red_brick");
  EXPECT_TRUE(primitive.positions[1].isApprox(Eigen::Vector3d(10, 24, 30), 1e-12));
  EXPECT_TRUE(primitive.positions[2].isApprox(Eigen::Vector3d(4, 20, 30), 1e-12));
}

TEST(Gltf, MirroringSwapsTheSides) {
  const GltfModel model = model_of(test::triangle_glb(kTriangle, {0, 1, 2}, R"(,"scale":[-1,1,1])"));
  EXPECT_THAT(model.primitives.at(0).triangles.at(0), ElementsAre(0, 2, 1));
}

TEST(Gltf, QuantisedPositionsAreScaledByTheNode) {
  const std::string positions = bytes_of<std::int16_t>({0, 0, 0, 0, 32767, 0, 0, 0, 0, -32767, 0, 0});
  const GltfModel model = model_of(test::glb(
      R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_mesh_quantization"],"scene":0,"scenes":[{"nodes":[0]}],)"
      R"("nodes":[{"mesh":0,"scale":[5,5,5]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
      R"("buffers":[{"byteLength":24}],"bufferViews":[{"buffer":0,"byteLength":24,"byteStride":8}],)"
      R"("accessors":[{"bufferView":0,"componentType":5122,"normalized":true,"count":3,"type":"VEC3"}]})",
      positions));
  EXPECT_TRUE(model.primitives.at(0).positions.at(1).isApprox(Eigen::Vector3d(5, 0, 0)));
  EXPECT_TRUE(model.primitives.at(0).positions.at(2).isApprox(Eigen::Vector3d(0, -5, 0)));
}

TEST(Gltf, SparseAccessorsPutValuesIn) {
  const std::string binary = bytes_of(kTriangle) + bytes_of<std::uint32_t>({1}) + bytes_of<float>({7, 8, 9});
  const GltfModel model = model_of(test::glb(
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":52}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":4},)"
      R"({"buffer":0,"byteOffset":40,"byteLength":12}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,)"
      R"("type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5125},"values":{"bufferView":2}}}]})",
      binary));
  EXPECT_EQ(model.primitives.at(0).positions.at(1), Eigen::Vector3d(7, 8, 9));
}

TEST(Gltf, StripsAndFansKeepTheirFronts) {
  const auto triangles = [](int mode) {
    const std::string binary = bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
    return model_of(
               test::glb(
                   fmt::format(
                       R"({{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],)"
                       R"("meshes":[{{"primitives":[{{"mode":{},"attributes":{{"POSITION":0}}}}]}}],)"
                       R"("buffers":[{{"byteLength":48}}],"bufferViews":[{{"buffer":0,"byteLength":48}}],)"
                       R"("accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}}]}})",
                       mode),
                   binary))
        .primitives;
  };
  EXPECT_THAT(triangles(5).at(0).triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(1, 3, 2)));
  EXPECT_THAT(triangles(6).at(0).triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3)));
  EXPECT_THAT(triangles(1), SizeIs(0));  // lines
}

TEST(Gltf, RefusesWhatIsNotThere) {
  const std::string good = test::triangle_glb(kTriangle, {0, 1, 2});
  EXPECT_EQ(gltf_refusal(good), "");
  EXPECT_THAT(gltf_refusal(test::triangle_glb(kTriangle, {0, 1, 3})),
              HasSubstr("vertex that does not exist"));
  EXPECT_THAT(gltf_refusal(good.substr(0, good.size() - 8)), HasSubstr("end early"));
  EXPECT_THAT(gltf_refusal(with(good, R"("count":3)", R"("count":9)")), HasSubstr("beyond"));
  EXPECT_THAT(gltf_refusal(with(good, R"("byteLength":36)", R"("byteLength":99)")), HasSubstr("end early"));
  EXPECT_THAT(gltf_refusal(with(good, R"("nodes":[0])", R"("nodes":[7])")),
              HasSubstr("nodes 7 does not exist"));
  EXPECT_THAT(gltf_refusal(test::glb(R"({"asset":{"version":"1.0"}})", "")), HasSubstr("glTF '1.0'"));
  EXPECT_THAT(gltf_refusal(test::glb("", "", 1)), HasSubstr("glTF 1,"));
  EXPECT_THAT(
      gltf_refusal(test::glb(R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_curved_air"]})", "")),
      HasSubstr("KHR_curved_air"));
  EXPECT_THAT(gltf_refusal(test::glb(
                  R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"children":[0]}]})", "")),
              HasSubstr("nested"));
}

TEST(Gltf, HostileCountsTakeNoMemory) {
  const std::string json =
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":0}],)"
      R"("accessors":[{"componentType":5126,"count":4000000000000,"type":"VEC3"}]})";
  EXPECT_THAT(gltf_refusal(test::glb(json, "")), HasSubstr("too many for its bytes"));
}

TEST(Gltf, DamagedCompressionIsSaid) {
  const std::string json =
      R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"],"scenes":[{"nodes":[0]}],)"
      R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"extensions":)"
      R"({"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}],)"
      R"("buffers":[{"byteLength":16}],"bufferViews":[{"buffer":0,"byteLength":16}]})";
  // Damaged data, or the package's name in a build without Draco.
  EXPECT_THAT(gltf_refusal(test::glb(json, "DRACO-not-really")), HasSubstr("raco"));
  // 2^28 points, and 2^21 faces, in 16 bytes.
  for (const std::string& claim : {std::string("DRACO\2\2\1\0\0\0\0\377\377\377\177", 16),
                                   std::string("DRACO\2\2\1\1\0\0\0\3\377\377\177", 16)})
    EXPECT_THAT(gltf_refusal(test::glb(json, claim)),
                ::testing::AnyOf(HasSubstr("not of version 2.2"), HasSubstr("no Draco")));
  const std::string packed =
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":16}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36,"extensions":{"EXT_meshopt_compression":{"buffer":0,)"
      R"("byteLength":16,"byteStride":12,"count":3,"mode":"ATTRIBUTES"}}}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]})";
  EXPECT_THAT(gltf_refusal(test::glb(packed, "0123456789abcdef")), HasSubstr("meshopt"));
  const std::string large =
      with(packed, R"("byteStride":12,"count":3,)", R"("byteStride":256,"count":30000,)");
  EXPECT_THAT(gltf_refusal(test::glb(large, "0123456789abcdef")), HasSubstr("meshopt"));
}

}  // namespace
}  // namespace canyon::meshes
