#include "canyon/outputs/view/live_relay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "canyon/base/input_error.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/outputs/view/page.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/view_listener.hpp"

namespace canyon::view {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

/// Stores epochs with the data they point to.
class EpochRecorder final : public simulation::EpochSink {
 public:
  void write(const simulation::Epoch& epoch) override {
    arrivals.push_back(std::make_unique<propagation::Arrival>(*epoch.arrival));
    epochs.push_back(epoch);
    epochs.back().arrival = arrivals.back().get();
  }
  void finish() override {}
  std::vector<simulation::Epoch> epochs;
  std::vector<std::unique_ptr<propagation::Arrival>> arrivals;
};

class LiveRelayTest : public testing::Test {
 protected:
  static simulation::Scenario scenario() {
    return simulation::parse_scenario(
        "city: {synthetic: {seed: 3}}\nsky: {nominal: true, systems: [GPS]}\nstart: 2026-06-01T12:00:00Z\n"
        "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\nduration_s: 2\n"
        "receivers: [{name: rover, profile: ublox-m8t}]\n",
        "live.yaml");
  }
  LiveRelayTest() {
    scene_ = std::make_shared<simulation::CityScene>(simulation::load_city(scenario()));
    simulation_ = std::make_unique<simulation::Simulation>(scenario(), scene_);
    simulation_->run({&run_});
    address_ = "tcp://127.0.0.1:" + std::to_string(test::free_port());
    server_ = std::make_unique<Server>(ServedSite{"page", folder_.path()});
    relay_ = relay({address_});
  }
  [[nodiscard]] std::unique_ptr<LiveRelay> relay(const std::vector<std::string>& addresses) const {
    ViewHeader header;
    header.title = "live";
    header.city.origin = scene_->city.frame.origin();
    return std::make_unique<LiveRelay>(addresses, header, folder_.path(), scene_->scene);
  }
  [[nodiscard]] std::unique_ptr<encoding::EncodedStream> host() const {
    return encoding::open_stream(encoding::parse_stream("view=" + address_), *simulation_);
  }
  /// Reads this many messages of a page while both ends are served.
  std::vector<Json> receive(test::Listener& page, std::size_t count, encoding::EncodedStream& stream,
                            encoding::EncodedStream* other = nullptr) {
    std::atomic<bool> received_all{false};
    std::thread work([&] {
      while (!received_all) {
        stream.serve();
        if (other != nullptr) other->serve();
        relay_->serve(*server_);
      }
    });
    std::vector<Json> received;
    for (std::size_t i = 0; i < count; ++i) received.push_back(Json::parse(page.read(), nullptr, false));
    received_all = true;
    work.join();
    return received;
  }
  [[nodiscard]] Json header() const { return Json::parse(read_bytes(folder_.path() / kHeaderFile)); }

  test::TemporaryFolder folder_;
  std::shared_ptr<simulation::CityScene> scene_;
  std::unique_ptr<simulation::Simulation> simulation_;
  EpochRecorder run_;
  std::string address_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<LiveRelay> relay_;
};

TEST_F(LiveRelayTest, TakesAHostsEpochsToPagesAndGreetsLateOnesWithTheNewest) {
  EXPECT_EQ(header()["live"], true);
  EXPECT_EQ(header()["time"], nullptr);
  const auto stream = host();
  test::Listener page(*server_);
  std::vector<Json> received = receive(page, 1, *stream);
  EXPECT_EQ(received[0]["type"], "hello");
  EXPECT_EQ(received[0]["begin_utc"], "2026-06-01T12:00:00.000Z");
  EXPECT_EQ(received[0]["receivers"][0]["name"], "rover");
  ASSERT_TRUE(relay_->take_header());
  EXPECT_FALSE(relay_->take_header());  // once
  // The header has the same, for later pages.
  EXPECT_EQ(header()["time"]["begin_utc"], "2026-06-01T12:00:00.000Z");
  EXPECT_EQ(header()["time"]["interval_s"], simulation_->interval_s());
  EXPECT_EQ(header()["receivers"][0]["name"], "rover");
  EXPECT_EQ(header()["receivers"][0]["strength"], true);

  for (const simulation::Epoch& epoch : run_.epochs) stream->write(epoch);
  ASSERT_EQ(run_.epochs.size(), 3U);
  received = receive(page, 3, *stream);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(received[i]["type"], "epoch");
    EXPECT_EQ(received[i]["time_s"], static_cast<double>(i));
    EXPECT_NEAR(received[i]["place"]["up_m"].get<double>(), 2, 1e-6);
    EXPECT_EQ(received[i]["satellites"].size(), run_.epochs[i].observed.satellites.size());
    EXPECT_EQ(received[i]["skyline"].size(), 120U);
  }
  test::Listener late(*server_);
  const std::vector<Json> greeting = receive(late, 2, *stream);
  EXPECT_EQ(greeting[0]["type"], "hello");
  EXPECT_EQ(greeting[1], received[2]);
}

TEST_F(LiveRelayTest, ConnectsAnewWhenItsHostComesBack) {
  test::Listener page(*server_);
  {
    const auto stream = host();
    EXPECT_EQ(receive(page, 1, *stream)[0]["type"], "hello");
  }
  const auto again = host();
  EXPECT_EQ(receive(page, 1, *again)[0]["type"], "hello");
  again->write(run_.epochs[0]);
  EXPECT_EQ(receive(page, 1, *again)[0]["type"], "epoch");
}

TEST_F(LiveRelayTest, PassesOverWhatIsNoStreamOfTheViewer) {
  const auto other = transport::open_transport(address_);
  other->begin("hello\n\xff\xfe\n{\"type\":7}\n[]\n{\"version\":1}\n{\"type\":\"hello\",\"version\":1}\n");
  std::vector<std::string> notes;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (notes.empty() && std::chrono::steady_clock::now() < until) {
    other->serve();
    relay_->serve(*server_);
    for (std::string& note : relay_->take_notes()) {
      if (note.find("stream") != std::string::npos) notes.push_back(std::move(note));
    }
  }
  EXPECT_THAT(notes, testing::ElementsAre(HasSubstr("are not the stream 'view'")));  // reported once
  EXPECT_EQ(header()["time"], nullptr);
  EXPECT_THROW(relay({"nowhere"}), InputError);
  EXPECT_THROW(relay({address_, address_}), InputError);
}

// Impossible values of times, positions or angles end neither the viewer nor the stream.
TEST_F(LiveRelayTest, PassesOverImpossibleNumbers) {
  const auto stream = host();
  test::Listener page(*server_);
  const Json hello = receive(page, 1, *stream)[0];
  stream->write(run_.epochs[0]);
  const Json epoch = receive(page, 1, *stream)[0];
  const std::string second = "tcp://127.0.0.1:" + std::to_string(test::free_port());
  relay_ = relay({second});
  const auto other = transport::open_transport(second);
  const auto changed = [](Json message, const std::string& pointer, const Json& value) {
    message[Json::json_pointer(pointer)] = value;
    return message.dump() + "\n";
  };
  std::string bad;
  for (const auto& value : {Json(1e9), Json(-2000000000), Json(1e308), Json("2421")}) {
    bad += changed(hello, "/gps_week", value) + changed(hello, "/gps_tow", value) +
           changed(hello, "/interval_s", value) + changed(hello, "/receivers/0/elevation_mask_deg", value);
  }
  bad += hello.dump() + "\n";
  for (const auto& value : {Json(1e308), Json(-1e300), Json("here")}) {
    bad += changed(epoch, "/place/east_m", value) + changed(epoch, "/place/up_m", value) +
           changed(epoch, "/time_s", value);
  }
  bad += epoch.dump() + "\n";
  std::atomic<bool> received_all{false};
  std::thread work([&] {
    bool sent = false;
    while (!received_all) {
      other->serve();
      relay_->serve(*server_);
      if (!std::exchange(sent, true)) other->begin(bad);
    }
  });
  EXPECT_EQ(Json::parse(page.read(), nullptr, false)["type"], "hello");
  const Json shown = Json::parse(page.read(), nullptr, false);
  EXPECT_EQ(shown["type"], "epoch");
  EXPECT_EQ(shown["place"], epoch["place"]);
  received_all = true;
  work.join();
}

TEST_F(LiveRelayTest, ShowsTheReceiversOfAllHostsInOneTime) {
  simulation::Scenario later = scenario();
  later.start = *later.start + 10.0;
  const simulation::Simulation other(later, scene_);
  EpochRecorder epochs;
  other.run({&epochs});
  const std::string second = "tcp://127.0.0.1:" + std::to_string(test::free_port());
  relay_ = relay({address_, second});
  const auto stream = host();
  const auto stream_of_other = encoding::open_stream(encoding::parse_stream("view=" + second), other);
  test::Listener page(*server_);
  const std::string name = "rover (" + second + ")";  // both are named "rover"
  Json hello = Json::object();
  for (int i = 0; i < 4 && hello.value("receivers", Json::array()).size() < 2; ++i) {
    hello = receive(page, 1, *stream, stream_of_other.get())[0];
  }
  ASSERT_EQ(hello["receivers"].size(), 2U);
  EXPECT_EQ(hello["receivers"][0]["name"], "rover");
  EXPECT_EQ(hello["receivers"][1]["name"], name);
  EXPECT_EQ(hello["begin_utc"], "2026-06-01T12:00:00.000Z");
  EXPECT_EQ(header()["receivers"].size(), 2U);

  stream->write(run_.epochs[1]);
  Json first = receive(page, 1, *stream, stream_of_other.get())[0];
  EXPECT_EQ(first["receiver"], "rover");
  EXPECT_EQ(first["time_s"], 1);
  stream_of_other->write(epochs.epochs[1]);
  first = receive(page, 1, *stream, stream_of_other.get())[0];
  EXPECT_EQ(first["receiver"], name);
  EXPECT_EQ(first["time_s"], 11);
  test::Listener late(*server_);
  EXPECT_EQ(receive(late, 3, *stream)[2]["receiver"], name);
}

TEST(ViewStream, SaysNothingOfEpochsWithoutArrival) {
  const auto encoder = encoding::format_named("view").make({"rover"});
  const std::string first = encoder->begin();
  EXPECT_EQ(first.back(), '\n');
  EXPECT_EQ(Json::parse(first)["type"], "hello");
  EXPECT_EQ(encoder->encode(simulation::Epoch{}), "");
}

}  // namespace
}  // namespace canyon::view
