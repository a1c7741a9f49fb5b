#include "canyon/city/tiles/tile_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>

#include "canyon/city/tiles/read_tiles.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/web_folder.hpp"

namespace canyon::tiles {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

const geodesy::Geodetic kSomewhere = geodesy::Geodetic::from_degrees(48.2, 11.5, 560);

std::string leaf(const std::string& uri, double east) {
  return fmt::format(
      R"({{"boundingVolume":{{"sphere":[{},0,0,20]}},"geometricError":0,"content":{{"uri":"{}"}}}})", east,
      uri);
}

std::string tileset_of(const std::string& children) {
  return test::tileset(
      R"("boundingVolume":{"sphere":[0,0,0,9000]},"geometricError":50,"refine":"ADD","children":[)" +
      children + "]");
}

/// The server's files: a tileset of two tiles, one of them in a nested tileset.
std::map<std::string, test::WebFolder::File> served() {
  return {
      {"/city/tileset.json", {tileset_of(leaf("a.glb", 0) + "," + leaf("sub/tileset.json?session=7", 100))}},
      {"/city/a.glb", {test::box_glb(10, 10, 10)}},
      {"/city/sub/tileset.json", {tileset_of(leaf("b.glb", 0))}},
      {"/city/sub/b.glb", {test::box_glb(10, 10, 20)}}};
}

class WebTilesTest : public ::testing::Test {
 protected:
  [[nodiscard]] TileOptions options(const test::WebFolder& server, const std::string& query = {}) const {
    TileOptions out;
    out.url = server.url("/city/tileset.json") + query;
    out.cache = cache_.path().string();
    out.timeout_s = 1;
    return out;
  }
  [[nodiscard]] static TilesCity read(const TileOptions& options) { return read_tiles(options, kSomewhere); }

  test::TemporaryFolder cache_;
};

TEST_F(WebTilesTest, EachFileIsAskedForOnceAndKept) {
  const test::WebFolder server(served());
  const TilesCity first = read(options(server));
  EXPECT_EQ(first.tiles, 2U);
  EXPECT_THAT(first.city.notes.lines(), Contains(HasSubstr("4 files downloaded")));
  EXPECT_THAT(server.requests(), SizeIs(4));
  const TilesCity again = read(options(server));
  EXPECT_EQ(again.tiles, 2U);
  EXPECT_THAT(server.requests(), SizeIs(4));
}

TEST_F(WebTilesTest, WhatTheServerForbidsToKeepIsNotKept) {
  auto files = served();
  for (auto& [path, file] : files) file.headers = "Cache-Control: private, no-store\r\n";
  const test::WebFolder server(files);
  EXPECT_EQ(read(options(server)).tiles, 2U);
  EXPECT_TRUE(std::filesystem::is_empty(cache_ / "tiles"));
  EXPECT_EQ(read(options(server)).tiles, 2U);
  EXPECT_THAT(server.requests(), SizeIs(8));
}

TEST_F(WebTilesTest, KeysGoWithEachTileAndNowhereElse) {
  auto files = served();
  files.erase("/city/sub/b.glb");
  const test::WebFolder server(files);
  ASSERT_EQ(setenv("CANYON_TEST_KEY", "s3cret", 1), 0);
  const TilesCity city = read(options(server, "?key=$CANYON_TEST_KEY"));
  EXPECT_THAT(server.requests(), AllOf(SizeIs(4), Each(HasSubstr("key=s3cret"))));
  // A session parameter of a nested tileset is passed to its tiles.
  EXPECT_THAT(server.requests(), Contains(AllOf(HasSubstr("/city/sub/b.glb"), HasSubstr("session=7"))));
  EXPECT_EQ(city.gaps, 1U);
  EXPECT_THAT(city.city.notes.lines(), Each(AllOf(Not(HasSubstr("s3cret")), Not(HasSubstr("session=7")))));
  EXPECT_THAT(city.city.notes.warnings(), Contains(AllOf(HasSubstr("/city/sub/b.glb"), HasSubstr("404"))));
  EXPECT_THAT(city.city.name, Not(HasSubstr("s3cret")));
  for (const auto& entry : std::filesystem::recursive_directory_iterator(cache_.path())) {
    EXPECT_THAT(entry.path().string(), Not(HasSubstr("s3cret")));
    if (entry.is_regular_file()) {
      EXPECT_THAT(test::read_bytes(entry.path()), Not(HasSubstr("s3cret")));
    }
  }
  unsetenv("CANYON_TEST_KEY");
  EXPECT_THAT(test::refusal([&] { (void)read(options(server, "?key=$CANYON_TEST_KEY")); }),
              HasSubstr("no variable 'CANYON_TEST_KEY'"));
  const test::WebFolder empty({});
  EXPECT_THAT(test::refusal([&] { (void)read(options(empty, "?key=s3cret")); }),
              AllOf(HasSubstr("404"), Not(HasSubstr("s3cret"))));
}

TEST_F(WebTilesTest, AServerThatStallsIsGivenUp) {
  auto files = served();
  files["/city/tileset.json"].body =
      tileset_of(leaf("a.glb", 0) + "," + leaf("stall1.glb", 50) + "," + leaf("stall2.glb", 90));
  const test::WebFolder server(files);
  const auto begin = std::chrono::steady_clock::now();
  const TilesCity city = read(options(server));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(city.tiles, 1U);
  EXPECT_EQ(city.gaps, 2U);
  EXPECT_THAT(city.city.notes.warnings(),
              Contains(AllOf(HasSubstr("stall1.glb"), HasSubstr("did not respond"))));
  EXPECT_LT(took.count(), 10);  // both waited at the same time
}

TEST_F(WebTilesTest, OtherServersAreAskedOnlyWhereTheUserSaysSo) {
  const test::WebFolder other({{"/b.glb", {test::box_glb(10, 10, 30)}}});
  auto files = served();
  files["/city/tileset.json"].body = tileset_of(leaf("a.glb", 0) + "," + leaf(other.url("/b.glb"), 50));
  const test::WebFolder server(files);
  const TilesCity city = read(options(server, "?key=s3cret"));
  EXPECT_EQ(city.gaps, 1U);
  EXPECT_THAT(other.requests(), IsEmpty());
  TileOptions trusting = options(server, "?key=s3cret");
  trusting.allow_external = true;
  EXPECT_EQ(read(trusting).tiles, 2U);
  EXPECT_THAT(other.requests(), ::testing::ElementsAre("/b.glb"));  // without the key
}

TEST_F(WebTilesTest, OnlyTheAreaIsDownloaded) {
  auto files = served();
  files["/city/tileset.json"].body = tileset_of(leaf("a.glb", 0) + "," + leaf("far.glb", 5000));
  const test::WebFolder server(files);
  TileOptions boxed = options(server);
  boxed.bbox_deg = {11.499, 48.199, 11.501, 48.201};
  EXPECT_EQ(read(boxed).gaps, 0U);
  EXPECT_THAT(server.requests(), SizeIs(2));
}

TEST_F(WebTilesTest, FilesThatDifferByTheirQueriesAreKeptApart) {
  auto files = served();
  files["/city/tileset.json"].body = tileset_of(leaf("a.glb?part=1", 0) + "," + leaf("a.glb?part=2", 50));
  const test::WebFolder server(files);
  EXPECT_EQ(read(options(server, "?key=one")).tiles, 2U);
  EXPECT_THAT(server.requests(), SizeIs(3));
}

// Any parameter may select the file, whatever its name contains: "sig" is in "design", "key" in "monkey".
TEST_F(WebTilesTest, AnyParameterMayChooseTheFile) {
  auto files = served();
  std::string children;
  for (const char* name : {"design", "monkey", "authority", "sessions", "passage", "token"}) {
    for (const int number : {1, 2}) children += leaf(fmt::format("a.glb?{}={}", name, number), 0) + ",";
  }
  children.pop_back();
  files["/city/tileset.json"].body = tileset_of(children);
  const test::WebFolder server(files);
  EXPECT_EQ(read(options(server, "?design=0")).tiles, 12U);
  EXPECT_THAT(server.requests(), SizeIs(13));
  EXPECT_EQ(read(options(server, "?design=1")).tiles, 12U);
  EXPECT_THAT(server.requests(), SizeIs(24));  // includes those with their own design parameter
  EXPECT_EQ(read(options(server, "?design=1")).tiles, 12U);
  EXPECT_THAT(server.requests(), SizeIs(24));
}

TEST_F(WebTilesTest, RedirectsStayOnTheServer) {
  const test::WebFolder other({{"/b.glb", {test::box_glb(10, 10, 30)}}});
  const auto to = [](const std::string& address) {
    return test::WebFolder::File{"", "302 Found", fmt::format("Location: {}\r\n", address)};
  };
  auto files = served();
  files["/city/tileset.json"].body =
      tileset_of(leaf("a.glb", 0) + "," + leaf("same.glb", 0) + "," + leaf("out.glb", 50) + "," +
                 leaf("file.glb", 50) + "," + leaf("hops.glb", 50) + "," + leaf("round.glb", 50));
  files["/city/same.glb"] = to("/city/a.glb");
  files["/city/out.glb"] = to(other.url("/b.glb"));
  files["/city/file.glb"] = to("file:///etc/passwd");
  files["/city/hops.glb"] = to("out.glb");
  files["/city/round.glb"] = to("round.glb");
  const test::WebFolder server(files);
  const TilesCity city = read(options(server, "?key=s3cret"));
  EXPECT_EQ(city.tiles, 2U);
  EXPECT_EQ(city.gaps, 4U);
  EXPECT_THAT(other.requests(), IsEmpty());
  EXPECT_THAT(city.city.notes.warnings(),
              Contains(AllOf(HasSubstr("out.glb"), HasSubstr("redirects to another server"))));
  EXPECT_THAT(city.city.notes.warnings(), Each(Not(HasSubstr("s3cret"))));
  TileOptions trusting = options(server);
  trusting.allow_external = true;
  EXPECT_EQ(read(trusting).gaps, 2U);
}

TEST_F(WebTilesTest, BusyServersAreAskedAgain) {
  auto files = served();
  files["/city/a.glb"].status = "503 Service Unavailable";
  files["/city/a.glb"].headers = "Retry-After: 0\r\n";
  const test::WebFolder server(files);
  const TilesCity city = read(options(server));
  EXPECT_EQ(city.gaps, 1U);
  EXPECT_THAT(server.requests(), SizeIs(6));
}

TEST(PublicAddress, HidesKeysAndPasswords) {
  EXPECT_EQ(public_address("https://me:pw@host/a/b.json?key=1#x"), "https://host/a/b.json");
  EXPECT_EQ(public_address("/a/b?c.json"), "/a/b?c.json");
  EXPECT_TRUE(holds_key("https://host/a?key=abc"));
  EXPECT_FALSE(holds_key("https://host/a?key=$ABC"));
  EXPECT_FALSE(holds_key("https://host/a"));
}

}  // namespace
}  // namespace canyon::tiles
