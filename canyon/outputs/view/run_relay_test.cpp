#include <gtest/gtest.h>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/page.hpp"
#include "canyon/outputs/view/view_sink.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/view_listener.hpp"

namespace canyon::view::run_relay_test {
namespace {

using Json = nlohmann::json;
using std::chrono::hours;
using std::chrono::milliseconds;

/// A run of three epochs of two receivers, served while it is computed.
class RunRelayTest : public testing::Test {
 protected:
  RunRelayTest() {
    const auto scenario = simulation::parse_scenario(
        "city: {synthetic: {seed: 3}}\nsky: {nominal: true, systems: [GPS]}\nstart: 2026-06-01T12:00:00Z\n"
        "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\nduration_s: 2\n"
        "receivers: [{name: rover}, {name: base, fixed: {east_m: 20, north_m: 0, up_m: 3}}]\n",
        "run.yaml");
    scene_ = std::make_shared<simulation::CityScene>(simulation::load_city(scenario));
    simulation_ = std::make_unique<simulation::Simulation>(scenario, scene_);
    ViewOptions options;
    options.watched = true;
    view_ = make_view(*simulation_, folder_.path(), options);
    server_ = std::make_unique<Server>(ServedSite{"page", folder_.path()});
  }
  [[nodiscard]] Json header() const { return Json::parse(read_bytes(folder_.path() / kHeaderFile)); }
  void run(RunRelay& relay) {
    simulation::RunOptions options;
    options.progress = [&](std::size_t done, std::size_t planned) { relay.progress(done, planned); };
    simulation_->run({view_.get(), &relay}, options);
    relay.finished();
  }
  /// The messages of a page until the end of the run.
  static std::vector<Json> receive(test::Listener& page) {
    std::vector<Json> received;
    do {
      received.push_back(Json::parse(page.read(), nullptr, false));
    } while (!received.back().is_discarded() && received.back()["type"] != "finished");
    return received;
  }
  static std::vector<Json> of_type(const std::vector<Json>& messages, const std::string& type) {
    std::vector<Json> found;
    for (const Json& message : messages) {
      if (message.value("type", "") == type) found.push_back(message);
    }
    return found;
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<simulation::CityScene> scene_;
  std::unique_ptr<simulation::Simulation> simulation_;
  std::unique_ptr<simulation::EpochSink> view_;
  std::unique_ptr<Server> server_;
};

TEST_F(RunRelayTest, TakesEpochsToPagesWhileTheyAreComputedAndThenTheWholeView) {
  const Json started = header();
  EXPECT_EQ(started["live"], true);
  EXPECT_EQ(started["time"]["begin_utc"], "2026-06-01T12:00:00.000Z");
  ASSERT_EQ(started["receivers"].size(), 2U);
  EXPECT_EQ(started["receivers"][1]["name"], "base");
  EXPECT_TRUE(started["chunks"].empty());

  RunRelay relay(*simulation_, *server_, 12, milliseconds(0));
  test::Listener page(*server_);
  run(relay);
  const std::vector<Json> received = receive(page);
  EXPECT_EQ(received.front()["type"], "hello");
  EXPECT_EQ(received.front()["receivers"].size(), 2U);
  const std::vector<Json> epochs = of_type(received, "epoch");
  ASSERT_EQ(epochs.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t instant = i / 2;
    EXPECT_EQ(epochs[i]["receiver"], i % 2 == 0 ? "rover" : "base");
    EXPECT_EQ(epochs[i]["time_s"], static_cast<double>(instant));
    EXPECT_NEAR(epochs[i]["place"]["east_m"].get<double>(), i % 2 == 0 ? 0 : 20, 1e-6);
    EXPECT_EQ(epochs[i]["skyline"].size(), 120U);
  }
  ASSERT_FALSE(of_type(received, "progress").empty());
  EXPECT_EQ(of_type(received, "progress").back()["done"], 3);
  EXPECT_EQ(of_type(received, "progress").back()["planned"], 3);

  // The satellites' numbers are kept from the beginning, so a selection is kept too.
  const Json whole = header();
  EXPECT_FALSE(whole.contains("live"));
  EXPECT_EQ(whole["satellites"], started["satellites"]);
  EXPECT_EQ(whole["receivers"][0]["summary"]["epochs"], 3);
  EXPECT_FALSE(whole["chunks"].empty());
  test::Listener late(*server_);
  const std::vector<Json> reported = receive(late);
  ASSERT_EQ(reported.size(), 2U);
  EXPECT_EQ(reported[0]["type"], "hello");
}

TEST_F(RunRelayTest, SendsNoMoreInstantsThanArePictures) {
  RunRelay relay(*simulation_, *server_, 12, hours(1));
  test::Listener page(*server_);
  run(relay);
  const std::vector<Json> epochs = of_type(receive(page), "epoch");
  ASSERT_EQ(epochs.size(), 2U);  // both receivers' of the first
  EXPECT_EQ(epochs[1]["receiver"], "base");
  EXPECT_EQ(epochs[1]["time_s"], 0);
}

TEST_F(RunRelayTest, WhatIsSentLastArrivesBeforeTheServerEnds) {
  server_->greet({"hello"});
  test::Listener page(*server_);
  EXPECT_EQ(page.read(), "hello");  // the server has registered it now
  server_->send("why");
  EXPECT_TRUE(server_->flush(std::chrono::seconds(20)));
  server_.reset();
  EXPECT_EQ(page.read(), "why");
}

}  // namespace
}  // namespace canyon::view::run_relay_test
