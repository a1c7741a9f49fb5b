#include "canyon/city/buildings/sources/overpass.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <limits>
#include <mutex>
#include <thread>

#include "canyon/city/buildings/sources/http_client.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "tests/support/local_listener.hpp"
#include "tests/support/osm_text.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

TEST(PrivateAddress, IsOfNetworksThatAreNotTheInternet) {
  for (const char* ip :
       {"127.0.0.1", "10.1.2.3", "172.16.0.1", "172.31.255.255", "192.168.1.1", "169.254.169.254",
        "100.64.0.1", "0.0.0.0", "::1", "::", "fe80::1%eth0", "fd00::1", "::ffff:10.0.0.1"})
    EXPECT_TRUE(is_private_address(ip)) << ip;
  for (const char* ip : {"8.8.8.8", "172.32.0.1", "172.15.0.1", "100.128.0.1", "192.169.0.1",
                         "2001:4860:4860::8888", "::ffff:8.8.8.8", "", "host"})
    EXPECT_FALSE(is_private_address(ip)) << ip;
}

std::string reply(const std::string& status, const std::string& body, const std::string& headers = {}) {
  return fmt::format("HTTP/1.1 {}\r\nContent-Length: {}\r\nConnection: close\r\n{}\r\n{}", status,
                     body.size(), headers, body);
}

/// An HTTP server on 127.0.0.1 that sends the next stored bytes on each connection and stores the requests.
/// An empty response keeps the connection open, silent, until the client or the test ends.
class StoredServer {
 public:
  explicit StoredServer(std::vector<std::string> replies) : replies_(std::move(replies)) {
    thread_ = std::thread([this] { serve(); });
  }
  ~StoredServer() {
    listener_.stop();
    thread_.join();
  }
  StoredServer(const StoredServer&) = delete;
  StoredServer& operator=(const StoredServer&) = delete;

  [[nodiscard]] std::string url() const {
    return fmt::format("http://127.0.0.1:{}/api/interpreter", listener_.port());
  }
  [[nodiscard]] std::vector<std::string> requests() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return requests_;
  }

 private:
  void serve() {
    for (const std::string& response : replies_) {
      const int client = listener_.next();
      if (client < 0) return;
      converse(client, response);
      close(client);
    }
  }

  void converse(int client, const std::string& response) {
    std::string request;
    while (!is_whole(request)) {
      if (!listener_.receive(client, request)) return;
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      requests_.push_back(request);
    }
    if (response.empty()) {
      (void)listener_.readable(client);
      return;
    }
    test::LocalListener::send_all(client, response);
  }

  static bool is_whole(const std::string& request) {
    const std::size_t end = request.find("\r\n\r\n");
    if (end == std::string::npos) return false;
    const std::string key = "Content-Length: ";
    const std::size_t at = request.find(key);
    const std::size_t length = at < end ? std::stoul(request.substr(at + key.size())) : 0;
    return request.size() >= end + 4 + length;
  }

  std::vector<std::string> replies_;
  test::LocalListener listener_{10'000};
  mutable std::mutex mutex_;
  std::vector<std::string> requests_;
  std::thread thread_;
};

class Overpass : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"}) unsetenv(name);
    setenv("no_proxy", "*", 1);
  }

  OverpassOptions options(const StoredServer& server) const {
    OverpassOptions out;
    out.url = server.url();
    out.cache = folder_ / "cache";
    out.timeout_s = 20;
    return out;
  }
  /// The error message of a download of the box, with a server's responses.
  std::string download_problem(const std::vector<std::string>& replies, int timeout_s = 20) {
    const StoredServer server(replies);
    OverpassOptions requested = options(server);
    requested.timeout_s = timeout_s;
    const std::string what = test::refusal([&] { (void)download_osm(kBox, requested); });
    EXPECT_THAT(files(), IsEmpty()) << what;
    return what;
  }
  std::vector<std::string> files() const {
    std::vector<std::string> out;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "cache", ignored)) {
      out.push_back(entry.path().filename().string());
    }
    return out;
  }

  static constexpr LonLatBox kBox{114.17, 22.29, 114.18, 22.30};
  static constexpr const char* kBusy = "Retry-After: 0\r\n";
  const std::string map_ = test::OsmText().square(1, 114.171, 22.291, 0.001, {{"building", "yes"}}).text();
  test::TemporaryFolder folder_;
};

TEST_F(Overpass, AnAnswerIsKeptAndReadsAsAMap) {
  const StoredServer server({reply("200 OK", map_)});
  std::vector<std::size_t> steps;
  const auto paths = download_osm(kBox, options(server), [&](std::size_t done, std::size_t all) {
    steps.insert(steps.end(), {done, all});
  });
  ASSERT_THAT(paths, SizeIs(1));
  EXPECT_THAT(steps, ElementsAre(1, 1));
  EXPECT_EQ(test::read_bytes(paths[0]), map_);
  EXPECT_EQ(read_osm(paths).features.size(), 1U);
  // Only plain characters in the name.
  EXPECT_EQ(paths[0].filename().string().find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789._-"),
            std::string::npos);
  // The second time the server, which has no second response, gets no request.
  EXPECT_EQ(download_osm(kBox, options(server)), paths);
  ASSERT_THAT(server.requests(), SizeIs(1));
  EXPECT_THAT(server.requests()[0], AllOf(HasSubstr("POST /api/interpreter HTTP/1.1"),
                                          HasSubstr("User-Agent: Canyon/"), HasSubstr("data=%5Bout%3Axml%5D"),
                                          HasSubstr("22.2900000%2C114.1700000%2C22.3000000%2C114.1800000"),
                                          HasSubstr("building%3Apart"), Not(HasSubstr("tree_row"))));
}

TEST_F(Overpass, FoliageIsAnotherQuestion) {
  const StoredServer server({reply("200 OK", map_), reply("200 OK", map_)});
  OverpassOptions requested = options(server);
  const auto without = download_osm(kBox, requested);
  requested.foliage = true;
  EXPECT_NE(download_osm(kBox, requested), without);
  ASSERT_THAT(server.requests(), SizeIs(2));
  EXPECT_THAT(server.requests()[1], HasSubstr("tree_row"));
  requested.timeout_s = 30;  // but another timeout is not
  EXPECT_THAT(download_osm(kBox, requested), SizeIs(1));
}

TEST_F(Overpass, ABusyServerIsAskedAgain) {
  const StoredServer server(
      {reply("429 Too Many Requests", "slow down", kBusy), reply("504 Gateway Timeout", "", kBusy),
       reply("503 Service Unavailable", "", "retry-after: Sun, 06 Nov 1994 08:49:37 GMT\r\n"),
       reply("200 OK", map_)});
  EXPECT_THAT(download_osm(kBox, options(server)), SizeIs(1));
  EXPECT_THAT(server.requests(), SizeIs(4));
}

TEST_F(Overpass, ButNotForEver) {
  const std::string busy = reply("429 Too Many Requests", "<html><p>Please\nwait</p></html>", kBusy);
  const std::string what = download_problem({busy, busy, busy, busy});
  EXPECT_THAT(what, AllOf(HasSubstr("HTTP status 429 (too many requests) to each of 4 requests: Please wait"),
                          HasSubstr("try again later, or give a file")));
}

TEST_F(Overpass, ARefusalIsNotRepeated) {
  EXPECT_THAT(download_problem({reply("400 Bad Request", "<html>parse error</html>")}),
              AllOf(HasSubstr("HTTP status 400: parse error"), Not(HasSubstr("each of"))));
  EXPECT_THAT(download_problem({reply("404 Not Found", "")}),
              HasSubstr("HTTP status 404; check the address"));
}

TEST_F(Overpass, WhatIsNoWholeMapIsNotKept) {
  EXPECT_THAT(download_problem({reply("200 OK", "<!DOCTYPE html><html><title>Login</title></html>")}),
              HasSubstr("something other than OpenStreetMap XML: Login"));
  EXPECT_THAT(download_problem({reply("200 OK", "")}), HasSubstr("other than OpenStreetMap XML"));
  // The server stops inside the document, with and without a content length.
  EXPECT_THAT(download_problem({reply("200 OK", map_.substr(0, map_.size() / 2))}),
              HasSubstr("ends early, after"));
  const std::string whole = reply("200 OK", map_);
  EXPECT_THAT(download_problem({whole.substr(0, whole.size() - 40)}),
              HasSubstr("the response of 127.0.0.1 ended early"));
  EXPECT_THAT(download_problem({"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\n<osm "}),
              HasSubstr("the response of 127.0.0.1 ended early"));
  EXPECT_THAT(download_problem({"\r\n"}), Not(IsEmpty()));
  // Overpass runs out of time or memory despite a good status.
  EXPECT_THAT(download_problem(
                  {reply("200 OK",
                         "<?xml version=\"1.0\"?><osm version=\"0.6\"><remark> runtime error: Query timed "
                         "out in \"query\" at line 2 </remark></osm>")}),
              HasSubstr("aborted: runtime error: Query timed out"));
}

TEST_F(Overpass, ASilentServerRunsOutOfTime) {
  EXPECT_THAT(download_problem({""}, 1), HasSubstr("127.0.0.1 did not respond within 1 s"));
}

TEST_F(Overpass, OfflineIsSaidPlainly) {
  OverpassOptions requested;
  {
    const StoredServer gone({});
    requested = options(gone);
  }
  EXPECT_THAT(test::refusal([&] { (void)download_osm(kBox, requested); }),
              AllOf(HasSubstr("cannot reach 127.0.0.1: "), HasSubstr("; check the network, or give a file")));
}

TEST_F(Overpass, AnInterruptedDownloadGoesOn) {
  LonLatBox wide = kBox;
  wide.east = wide.west + 0.1;  // two tiles of 0.05 deg
  wide.north = wide.south + 0.04;
  std::vector<std::size_t> steps;
  const auto progress = [&](std::size_t done, std::size_t) { steps.push_back(done); };
  const StoredServer server(
      {reply("200 OK", map_), reply("500 Internal Server Error", ""), reply("200 OK", map_)});
  OverpassOptions requested = options(server);
  requested.retries = 0;
  EXPECT_THAT(test::refusal([&] { (void)download_osm(wide, requested, progress); }),
              HasSubstr("HTTP status 500"));
  EXPECT_THAT(steps, ElementsAre(1));
  EXPECT_THAT(files(), SizeIs(1));
  const auto paths = download_osm(wide, requested, progress);
  EXPECT_THAT(steps, ElementsAre(1, 1, 2));
  ASSERT_THAT(paths, SizeIs(2));
  EXPECT_THAT(server.requests(), SizeIs(3));
  // The tiles are adjacent, and the same building in both is read once.
  EXPECT_THAT(server.requests()[0], HasSubstr("22.2900000%2C114.1700000%2C22.3300000%2C114.2200000"));
  EXPECT_THAT(server.requests()[2], HasSubstr("22.2900000%2C114.2200000%2C22.3300000%2C114.2700000"));
  EXPECT_EQ(read_osm(paths).features.size(), 1U);
}

TEST_F(Overpass, FollowsARedirectAsPost) {
  const StoredServer target({reply("200 OK", map_)});
  const StoredServer server({reply("302 Found", "", "Location: " + target.url() + "\r\n")});
  EXPECT_THAT(download_osm(kBox, options(server)), SizeIs(1));
  ASSERT_THAT(target.requests(), SizeIs(1));
  EXPECT_THAT(target.requests()[0], AllOf(HasSubstr("POST "), HasSubstr("data=")));
  const StoredServer sly({reply("302 Found", "", "Location: file:///etc/hostname\r\n")});
  OverpassOptions requested = options(sly);
  requested.foliage = true;
  EXPECT_THAT(test::refusal([&] { (void)download_osm(kBox, requested); }), Not(IsEmpty()));
}

TEST_F(Overpass, OptionsAreChecked) {
  const auto reported = [](auto change) {
    OverpassOptions bad;
    change(bad);
    return test::refusal([&] { bad.validate(); });
  };
  EXPECT_EQ(reported([](OverpassOptions&) {}), "");
  EXPECT_THAT(reported([](OverpassOptions& o) { o.url = "file:///etc/passwd"; }),
              HasSubstr("not the address of an Overpass"));
  EXPECT_THAT(reported([](OverpassOptions& o) { o.url = "https://a b"; }),
              HasSubstr("not the address of an Overpass"));
  EXPECT_THAT(reported([](OverpassOptions& o) { o.timeout_s = 0; }),
              HasSubstr("timeout_s of the download is 0"));
  EXPECT_THAT(reported([](OverpassOptions& o) { o.retries = 11; }),
              HasSubstr("retries of the download is 11"));
  EXPECT_THAT(reported([](OverpassOptions& o) { o.tile_deg = std::numeric_limits<double>::quiet_NaN(); }),
              HasSubstr("tile_deg"));
  OverpassOptions fine;
  fine.cache = folder_ / "cache";
  EXPECT_THAT(test::refusal([&] {
                (void)download_osm({-10, 30, 40, 70}, fine);
              }),
              HasSubstr("at most 10000 are made"));
  EXPECT_THAT(test::refusal([&] {
                (void)download_osm({10, 30, -40, 70}, fine);
              }),
              HasSubstr("west,south,east,north"));
  EXPECT_THAT(files(), IsEmpty());
}

std::string area_query(const std::string& elements) {
  return reply("200 OK", "{\"version\": 0.6, \"elements\": [" + elements + "]}");
}

TEST_F(Overpass, FindsAPlaceByName) {
  const StoredServer server({area_query(
      R"({"type":"relation","id":1,"bounds":{"minlat":22.28,"minlon":114.16,"maxlat":22.31,"maxlon":114.19}},)"
      R"({"type":"way","id":2,"bounds":{"minlat":22.29,"minlon":114.17,"maxlat":22.30,"maxlon":114.18}},)"
      R"({"type":"node","id":3,"lat":22.29,"lon":114.17})")});
  const LonLatBox box = find_named_area("Tsim \"Sha\" Tsui, Hong Kong", options(server));
  EXPECT_EQ(box.west, 114.16);
  EXPECT_EQ(box.south, 22.28);
  EXPECT_EQ(box.east, 114.19);
  EXPECT_EQ(box.north, 22.31);
  ASSERT_THAT(server.requests(), SizeIs(1));
  // area["name"="Hong Kong"], and quotes in a name stay within its string.
  EXPECT_THAT(server.requests()[0], AllOf(HasSubstr("area%5B%22name%22%3D%22Hong%20Kong%22%5D"),
                                          HasSubstr("%22Tsim%20%5C%22Sha%5C%22%20Tsui%22")));
  EXPECT_EQ(find_named_area("Tsim \"Sha\" Tsui, Hong Kong", options(server)).west, 114.16);  // cached
  EXPECT_THAT(server.requests(), SizeIs(1));
}

TEST_F(Overpass, AsksOnBothSidesOfTheAntimeridian) {
  const StoredServer server(
      {area_query(
           R"({"type":"relation","id":1,"bounds":{"minlat":1,"minlon":179.99,"maxlat":1.01,"maxlon":-179.99}})"),
       reply("200 OK", map_), reply("200 OK", map_)});
  const LonLatBox box = find_named_area("Taveuni", options(server));
  EXPECT_THAT(download_osm(box, options(server)), SizeIs(2));
  EXPECT_THAT(server.requests()[1], HasSubstr("1.0000000%2C179.9900000%2C1.0100000%2C180.0000000"));
  EXPECT_THAT(server.requests()[2], HasSubstr("1.0000000%2C-180.0000000%2C1.0100000%2C-179.9900000"));
}

TEST_F(Overpass, SaysWhyAPlaceHasNoBox) {
  const auto logged = [&](const std::string& response, const std::string& name = "Springfield") {
    const StoredServer server({response});
    return test::refusal([&] { (void)find_named_area(name, options(server)); });
  };
  EXPECT_THAT(logged(area_query("")), HasSubstr("no place named 'Springfield' was found"));
  EXPECT_THAT(logged(area_query(R"({"type":"node","id":3,"lat":1,"lon":2})")),
              HasSubstr("is a point on the map"));
  EXPECT_THAT(logged(area_query(
                  R"({"type":"relation","id":1,"bounds":{"minlat":1,"minlon":1,"maxlat":2,"maxlon":2}},)"
                  R"({"type":"relation","id":2,"bounds":{"minlat":5,"minlon":1,"maxlat":6,"maxlon":2}})")),
              AllOf(HasSubstr("names several places that are far apart, relation/"),
                    HasSubstr("add the region or country")));
  EXPECT_THAT(logged(area_query(R"({"type":"relation","id":1,"bounds":[1,2]})")),
              HasSubstr("other than a list of places"));
  EXPECT_THAT(logged(reply("200 OK", "<html>Login</html>")), HasSubstr("other than a list of places: Login"));
  EXPECT_THAT(logged(reply("200 OK", R"({"elements":[],"remark":"runtime error: out of memory"})")),
              HasSubstr("aborted: runtime error: out of memory"));
  for (const char* bad : {"", " , ", "a,,b", "a\nb"}) {
    EXPECT_THAT(logged(area_query(""), bad), HasSubstr("is not the name of a place")) << bad;
  }
  EXPECT_THAT(files(), IsEmpty());
}

TEST_F(Overpass, TheCacheIsTheUsers) {
  const StoredServer server({reply("200 OK", map_), reply("200 OK", map_)});
  OverpassOptions requested = options(server);
  requested.cache.clear();
  const char* kept_xdg = std::getenv("XDG_CACHE_HOME");
  const char* kept_home = std::getenv("HOME");
  const std::string old_xdg = kept_xdg != nullptr ? kept_xdg : "";
  const std::string old_home = kept_home != nullptr ? kept_home : "";
  setenv("XDG_CACHE_HOME", (folder_ / "xdg").c_str(), 1);
  EXPECT_EQ(download_osm(kBox, requested).at(0).parent_path(), folder_ / "xdg" / "canyon");
  unsetenv("XDG_CACHE_HOME");
  setenv("HOME", folder_.path().c_str(), 1);
  EXPECT_EQ(download_osm(kBox, requested).at(0).parent_path(), folder_ / ".cache" / "canyon");
  unsetenv("HOME");
  EXPECT_THAT(test::refusal([&] { (void)download_osm(kBox, requested); }),
              HasSubstr("no folder for downloads"));
  if (!old_xdg.empty()) setenv("XDG_CACHE_HOME", old_xdg.c_str(), 1);
  if (!old_home.empty()) setenv("HOME", old_home.c_str(), 1);
}

}  // namespace
}  // namespace canyon::buildings
