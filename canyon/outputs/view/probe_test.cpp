#include "canyon/outputs/view/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "canyon/base/arithmetic.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/encoding/view_messages.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::view::probe_test {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

/// Decodes base64 (RFC 4648).
std::string unpacked(const std::string& text) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6U | static_cast<std::uint32_t>(letters.find(c));
    count += 6;
    if (count >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 0xFFU);
  }
  return bytes;
}

/// Columns of a chunk by table and name, read as in docs/view-format.md; floating-point columns.
std::map<std::string, std::vector<double>> columns_of(const std::string& bytes) {
  const auto u32 = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  EXPECT_EQ(bytes.substr(0, 8), "canyonV1");
  std::map<std::string, std::vector<double>> columns;
  const std::uint32_t count = u32(8);
  std::size_t offset = 16 + 8 * count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const encoding::ViewTable& table = encoding::view_tables()[u32(16 + 8 * i)];
    const std::uint32_t rows = u32(20 + 8 * i);
    for (const encoding::ViewColumn& column : table.columns) {
      offset = (offset + 7) / 8 * 8;
      auto& values = columns[std::string(table.name) + "." + std::string(column.name)];
      for (std::uint32_t row = 0; row < rows; ++row, offset += encoding::size_of(column.type)) {
        std::uint64_t bits = 0;
        std::memcpy(&bits, bytes.data() + offset, encoding::size_of(column.type));
        values.push_back(column.type == encoding::ViewType::F64 ? same_bytes<double>(bits)
                         : column.type == encoding::ViewType::F32
                             ? same_bytes<float>(static_cast<std::uint32_t>(bits))
                             : static_cast<double>(bits));
      }
    }
  }
  return columns;
}

/// The first epoch of each receiver as a message.
class FirstEpochs final : public simulation::EpochSink {
 public:
  explicit FirstEpochs(const simulation::Simulation& simulation) : simulation_(simulation) {}
  void write(const simulation::Epoch& epoch) override {
    if (positions.size() > epoch.receiver) return;
    const auto& options = simulation_.scenario().receivers[epoch.receiver].options;
    const geodesy::LocalFrame& frame = simulation_.environment().city().frame;
    encoding::EpochMessage message;
    for (const auto& s : epoch.observed.satellites) message.satellites.push_back(s.id);
    encoding::EpochRows rows(options.signal, 12);
    rows.add(
        epoch, 0, 0, -1, [&](const Eigen::Vector3d& ecef) { return frame.local_from_ecef(ecef); },
        message.satellites);
    positions.push_back(frame.local_from_ecef(epoch.truth_ecef));
    messages.push_back(Json::parse(encoding::epoch_message(message, rows)));
  }
  void finish() override {}
  std::vector<Eigen::Vector3d> positions;
  std::vector<Json> messages;

 private:
  const simulation::Simulation& simulation_;
};

class ProbeTest : public testing::Test {
 protected:
  static simulation::Scenario scenario() {
    return simulation::parse_scenario(
        "city: {synthetic: {seed: 3}}\nsky: {nominal: true, systems: [GPS, Galileo]}\n"
        "start: 2026-06-01T12:00:00Z\nduration_s: 10\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: "
        "2}}\n"
        "receivers:\n"
        "  - {name: plain, fixed: {east_m: 0, north_m: 0, up_m: 1.5}}\n"
        "  - {name: m8t, profile: ublox-m8t, fixed: {east_m: 20, north_m: 0, up_m: 3}}\n",
        "probe.yaml");
  }
  ProbeTest() {
    scene_ = std::make_shared<simulation::CityScene>(simulation::load_city(scenario()));
    simulation_ = std::make_unique<simulation::Simulation>(scenario(), scene_);
    probe_ = std::make_unique<Probe>(*simulation_, scene_, 12);
  }
  [[nodiscard]] Json submit(const Json& question) {
    return Json::parse(probe_->handle_request(question.dump()));
  }
  static Json question(const Eigen::Vector3d& point, double time_s = 0, int receiver = 0) {
    return {
        {"type", "probe"},  {"version", 1},
        {"id", 7},          {"receiver", receiver},
        {"time_s", time_s}, {"place", {{"east_m", point.x()}, {"north_m", point.y()}, {"up_m", point.z()}}}};
  }

  std::shared_ptr<simulation::CityScene> scene_;
  std::unique_ptr<simulation::Simulation> simulation_;
  std::unique_ptr<Probe> probe_;
};

// The first epoch of a receiver at the probe's position equals the probe's epoch.
TEST_F(ProbeTest, IsTheFirstEpochOfAReceiverThere) {
  FirstEpochs run(*simulation_);
  simulation_->run({&run});
  ASSERT_EQ(run.positions.size(), 2U);
  for (int receiver = 0; receiver < 2; ++receiver) {
    const auto r = static_cast<std::size_t>(receiver);
    const Json response = submit(question(run.positions[r], 0, receiver));
    EXPECT_EQ(response["type"], "epoch");
    EXPECT_EQ(response["version"], 1);
    EXPECT_EQ(response["id"], 7);
    EXPECT_EQ(response["receiver"], receiver == 0 ? "plain" : "m8t");
    EXPECT_EQ(response["skyline"].size(), 120U);
    EXPECT_EQ(response["satellites"], run.messages[r]["satellites"]);
    EXPECT_GT(response["satellites"].size(), 8U);
    const auto got = columns_of(unpacked(response["chunk"]));
    const auto expected = columns_of(unpacked(run.messages[r]["chunk"]));
    ASSERT_EQ(got.size(), expected.size());
    for (const auto& [name, values] : expected) {
      if (name == "epochs.yaw_deg") continue;  // a stationary receiver has no heading
      ASSERT_EQ(got.at(name).size(), values.size()) << name;
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (std::isnan(values[i])) {
          EXPECT_TRUE(std::isnan(got.at(name)[i])) << name;
        } else {
          // The position is converted to latitude and longitude on one side: nanometres.
          EXPECT_NEAR(got.at(name)[i], values[i], 1e-5 * std::max(1.0, std::abs(values[i])))
              << name << " " << i;
        }
      }
    }
    EXPECT_EQ(got.at("epochs.placement"), std::vector<double>{0});
    EXPECT_GT(got.at("paths.kind").size(), got.at("satellites.epoch").size() / 2);
  }
}

TEST_F(ProbeTest, AnswersTheSameAgainAndSaysWhereAnAntennaCannotBe) {
  const Json first = submit(question({38, 38, 1.5}, 5, 1));
  EXPECT_EQ(submit(question({38, 60, 10}, 2, 0))["type"], "epoch");
  EXPECT_EQ(submit(question({38, 38, 1.5}, 5, 1)), first);
  // Inside the first building of the city, at half its height.
  const city::Object& building = scene_->city.mesh.objects.at(1);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::uint32_t t = 0; t < building.triangle_count; ++t) {
    for (const std::uint32_t v : scene_->city.mesh.triangles[building.first_triangle + t]) {
      middle += scene_->city.mesh.vertices[v] / (3.0 * building.triangle_count);
    }
  }
  const auto inside = columns_of(unpacked(submit(question(middle))["chunk"]));
  EXPECT_EQ(inside.at("epochs.placement"),
            std::vector<double>{static_cast<double>(scene_->scene.containment(middle))});
  EXPECT_NE(inside.at("epochs.placement").front(), 0);
  EXPECT_EQ(inside.at("epochs.used").front(), 0);
}

TEST_F(ProbeTest, SaysInOneMessageWhatIsWrong) {
  const auto complaint = [&](const std::string& message) {
    const Json response = Json::parse(probe_->handle_request(message));
    EXPECT_EQ(response["type"], "error") << message;
    EXPECT_EQ(response["version"], 1);
    return response["message"].get<std::string>();
  };
  const auto changed = [&](const char* key, const Json& value) {
    Json json = question({38, 38, 1.5});
    json[key] = value;
    return json.dump();
  };
  const auto posed = [&](const char* key, const Json& value) {
    Json json = question({38, 38, 1.5});
    json["place"][key] = value;
    return json.dump();
  };
  for (const char* garbage : {"", "probe", "{", "[]", "null", "7", "{\"type\": 3}", "\xff\xfe"}) {
    EXPECT_FALSE(complaint(garbage).empty());
  }
  std::string nan = question({38, 38, 1.5}).dump();
  nan.replace(nan.find("38.0"), 4, "NaN");
  EXPECT_THAT(complaint(nan), HasSubstr("is not a number"));
  EXPECT_THAT(complaint(std::string(2000, '[')), HasSubstr("not JSON"));
  EXPECT_THAT(complaint(changed("type", "fire")), HasSubstr("the server has no such message type"));
  EXPECT_THAT(complaint(changed("version", 2)), HasSubstr("not of version 1"));
  EXPECT_THAT(complaint(changed("receiver", 2)), HasSubstr("'receiver' is 2; give a value from 0 to 1"));
  EXPECT_THAT(complaint(changed("receiver", -1)), HasSubstr("'receiver' is -1"));
  EXPECT_THAT(complaint(changed("receiver", 0.5)), HasSubstr("'receiver' is 0.5"));
  EXPECT_THAT(complaint(changed("receiver", "plain")), HasSubstr("'receiver' is not a number"));
  EXPECT_THAT(complaint(changed("time_s", 10.5)), HasSubstr("'time_s' is 10.5; give a value from 0 to 10"));
  EXPECT_THAT(complaint(changed("time_s", nullptr)), HasSubstr("'time_s' is not a number"));
  EXPECT_THAT(complaint(changed("place", {1, 2, 3})), HasSubstr("'place' is missing"));
  EXPECT_THAT(complaint(posed("up_m", nullptr)), HasSubstr("'up_m' is not a number"));
  EXPECT_THAT(complaint(posed("north_m", 1e6)), HasSubstr("'north_m' is 1000000"));
  EXPECT_THAT(complaint(posed("east_m", "here")), HasSubstr("'east_m' is not a number"));
  EXPECT_EQ(Json::parse(probe_->handle_request(changed("time_s", 99)))["id"], 7);
  EXPECT_EQ(submit(question({38, 38, 1.5}))["type"], "epoch");  // and continues
}

// A live run has the same sky at the same time, and no end.
TEST_F(ProbeTest, TracesARunWhoseEndNobodyKnows) {
  const auto live = std::make_unique<Probe>(simulation_->scenario(), simulation_->begin(), 1.0, scene_, 12);
  const std::string at_5 = question({38, 38, 1.5}, 5, 1).dump();
  EXPECT_EQ(live->handle_request(at_5), probe_->handle_request(at_5));
  EXPECT_EQ(Json::parse(live->handle_request(question({38, 38, 1.5}, 10'000).dump()))["type"], "epoch");
  EXPECT_EQ(Json::parse(live->handle_request(question({38, 38, 1.5}, 1e300).dump()))["type"], "error");
}

TEST(NoProbe, SaysWhy) {
  const Json response = Json::parse(no_probe(R"({"type":"probe","id":3})", "no scenario"));
  EXPECT_EQ(response["type"], "error");
  EXPECT_EQ(response["id"], 3);
  EXPECT_EQ(response["message"], "no scenario");
  EXPECT_EQ(Json::parse(no_probe("\xff", "no scenario"))["type"], "error");
}

}  // namespace
}  // namespace canyon::view::probe_test
