#include "canyon/base/json.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

// nlohmann/json is the reference: Json must read and write the same.

namespace canyon {
namespace {

using testing::HasSubstr;
using Theirs = nlohmann::ordered_json;

std::string problem(const std::string& text) {
  try {
    (void)Json::parse(text);
  } catch (const JsonError& error) {
    return error.what();
  }
  return {};
}

/// A random value with at most `levels` levels.
Theirs random_value(std::mt19937_64& random, int levels) {
  switch (random() % (levels > 0 ? 8 : 6)) {
    case 0:
      return nullptr;
    case 1:
      return random() % 2 == 0;
    case 2:
      return static_cast<std::int64_t>(random());
    case 3:
      return random();
    case 4:
      return std::ldexp(static_cast<double>(static_cast<std::int64_t>(random())),
                        static_cast<int>(random() % 400) - 200);
    case 5: {
      std::string text;
      for (auto n = random() % 12; n > 0; --n) text += static_cast<char>(random());
      return text;
    }
    case 6: {
      Theirs list = Theirs::array();
      for (auto n = random() % 5; n > 0; --n) list.push_back(random_value(random, levels - 1));
      return list;
    }
    default: {
      Theirs object = Theirs::object();
      for (auto n = random() % 5; n > 0; --n) {
        object["k" + std::to_string(random() % 100)] = random_value(random, levels - 1);
      }
      return object;
    }
  }
}

TEST(Json, ReadsAndWritesAsTheLibraryDoes) {
  std::mt19937_64 random(1);
  const auto replace = Theirs::error_handler_t::replace;
  for (int i = 0; i < 2000; ++i) {
    const std::string text = random_value(random, 4).dump(-1, ' ', false, replace);
    const Theirs theirs = Theirs::parse(text);
    const Json ours = Json::parse(text);
    ASSERT_EQ(ours.dump(), theirs.dump());
    ASSERT_EQ(ours.dump(2), theirs.dump(2));
    ASSERT_EQ(ours.dump(1, Json::Order::ByKey), nlohmann::json::parse(text).dump(1));
    ASSERT_TRUE(ours == Json::parse(nlohmann::json::parse(text).dump()));
  }
}

TEST(Json, WritesWhatIsNoUtf8AsTheLibraryDoes) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 2000; ++i) {
    std::string text;
    for (auto n = random() % 20; n > 0; --n) text += static_cast<char>(random());
    ASSERT_EQ(Json(text).dump(), Theirs(text).dump(-1, ' ', false, Theirs::error_handler_t::replace));
  }
}

TEST(Json, BracesMakeObjectsOfPairs) {
  const std::vector<double> values{0.5, 1};
  const Json json{{"name", std::string_view("rover")},
                  {"enu_m", {1, 2.5F, -3}},
                  {"flags", {true, nullptr}},
                  {"nested", {{"values", values}, {"none", std::optional<double>()}}},
                  {"list", Json::array({{{"a", 1U}}})},
                  {"words", {"a", "b"}}};
  EXPECT_EQ(
      json.dump(),
      R"({"name":"rover","enu_m":[1,2.5,-3],"flags":[true,null],"nested":{"values":[0.5,1.0],"none":null},)"
      R"("list":[{"a":1}],"words":["a","b"]})");
}

TEST(Json, NumbersThatAreNotFiniteAreNull) {
  EXPECT_TRUE(Json(std::nan("")).is_null());
  EXPECT_EQ(Json(std::vector<double>{std::numeric_limits<double>::infinity(), 1}).dump(), "[null,1.0]");
}

// Python's json writes and reads them.
TEST(Json, NanAndInfinityOfTextsAreNull) {
  const Json json = Json::parse(R"({"a": NaN, "b": [Infinity, -Infinity, 1], "NaN": "NaN \" Infinity"})");
  EXPECT_TRUE(json["a"].is_null());
  EXPECT_TRUE(json["b"][1].is_null());
  EXPECT_EQ(json["b"][2].get<int>(), 1);
  EXPECT_EQ(json["NaN"].text(), "NaN \" Infinity");
  EXPECT_THROW((void)Json::parse(R"({"a": NaN,})"), JsonError);
  EXPECT_THROW((void)Json::parse("[NaNs]"), JsonError);
}

TEST(Json, TheLastOfRepeatedMembersCounts) {
  EXPECT_EQ(Json::parse(R"({"a":1,"b":2,"a":3,"b":[4]})").dump(), R"({"a":3,"b":[4]})");
}

TEST(Json, MissingMembersAreNull) {
  const Json json = Json::parse(R"({"a":{"b":1}})");
  EXPECT_EQ(json["a"]["b"], 1);
  EXPECT_TRUE(json["x"]["y"].is_null());
  EXPECT_TRUE(json["a"]["b"]["c"].is_null());
  EXPECT_THROW((void)json.at("x"), JsonError);
  EXPECT_EQ(json["x"].begin(), json["x"].end());
  EXPECT_THROW((void)json.begin(), JsonError);
}

TEST(Json, GetsNumbersTextsAndLists) {
  const Json json = Json::parse(R"([1, 2.75, "a", [3, 4], true])");
  EXPECT_EQ(json[0].get<double>(), 1);
  EXPECT_EQ(json[1].get<int>(), 2);
  EXPECT_EQ(json[2].get<std::string>(), "a");
  EXPECT_EQ(json[3].get<std::vector<std::size_t>>(), (std::vector<std::size_t>{3, 4}));
  EXPECT_TRUE(json[4].get<bool>());
  EXPECT_THROW((void)json[0].get<std::string>(), JsonError);
  EXPECT_THROW((void)json[2].get<double>(), JsonError);
  EXPECT_THROW((void)json[0].get<bool>(), JsonError);
}

TEST(Json, SaysWhereATextIsNoJson) {
  EXPECT_THAT(problem("{\"a\":\n1,}"), HasSubstr("parse error at line 2, column 3"));
  EXPECT_THAT(problem("[1e999]"), HasSubstr("number overflow"));
  EXPECT_FALSE(Json::try_parse("").has_value());
  EXPECT_FALSE(Json::try_parse("{} x").has_value());
  try {
    (void)Json::parse("[1, oops]");
    FAIL();
  } catch (const JsonError& error) {
    EXPECT_EQ(error.byte(), 5U);
  }
}

TEST(Json, AssignsItsOwnPart) {
  Json json = Json::parse(R"({"a":{"b":[1]}})");
  json = std::move(json["a"]);
  EXPECT_EQ(json.dump(), R"({"b":[1]})");
  json["b"].push_back(json);
  EXPECT_EQ(json.dump(), R"({"b":[1,{"b":[1]}]})");
}

TEST(Json, AListInBracesServesAgain) {
  const std::initializer_list<Json> items{"a", {1, 2}};
  const std::initializer_list<Json> pairs{{"name", "rover"}, {"list", {1, {{"b", 2}}}}};
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(Json(items).dump(), R"(["a",[1,2]])");
    EXPECT_EQ(Json::array(items).dump(), R"(["a",[1,2]])");
    EXPECT_EQ(Json(pairs).dump(), R"({"name":"rover","list":[1,{"b":2}]})");
  }
}

TEST(Json, DepthDoesNotExhaustTheStack) {
  const auto nested = [](std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); };
  EXPECT_EQ(Json::parse(nested(1000)).dump(), nested(1000));
  EXPECT_THAT(problem(nested(1'000'000)), HasSubstr("nested deeper than 1000 levels"));
}

}  // namespace
}  // namespace canyon
