// Outputs of receivers under random faults: finite, with positive semi-definite covariances, and the same
// status in every output.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/mavlink.hpp"
#include "canyon/outputs/encoding/sbf/block.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/ubx_device.hpp"

namespace canyon {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Eigenvalues are non-negative to rounding.
bool positive(const Eigen::Matrix3d& c) {
  const Eigen::Vector3d deviations = c.diagonal().cwiseMax(1e-30).cwiseSqrt();
  const Eigen::Matrix3d correlations =
      deviations.cwiseInverse().asDiagonal() * c * deviations.cwiseInverse().asDiagonal();
  const double a = correlations(0, 1), b = correlations(0, 2), d = correlations(1, 2);
  const double determinant = 1 + 2 * a * b * d - a * a - b * b - d * d;
  return c.allFinite() && c.diagonal().minCoeff() > 0 && std::max({a * a, b * b, d * d}) < 1 + 1e-9 &&
         determinant > -1e-9;
}

double r8(std::string_view bytes, std::size_t at) {
  double value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// Compares each epoch of the rover, the first receiver, with its outputs.
class Outputs final : public simulation::EpochSink {
 public:
  explicit Outputs(const simulation::Simulation& simulation) {
    const encoding::ReceiverDescription rover = encoding::describe_receiver(simulation, 0);
    for (const char* name : {"epochs_csv", "nmea", "ubx", "sbf"}) {
      const auto& encoder = encoders_[name] = encoding::format_named(name).make(rover);
      const std::string head = encoder->begin();
      if (std::string_view(name) == "epochs_csv") columns_ = split(head);
    }
  }

  void write(const simulation::Epoch& epoch) override {
    if (epoch.receiver != 0) return;
    const positioning::Fix& fix = epoch.observed.fix;
    std::map<std::string, std::string> bytes;
    for (const auto& [name, encoder] : encoders_) bytes[name] = encoder->encode(epoch);
    if (fix.baseline) {
      EXPECT_TRUE(fix.baseline->vector_enu.allFinite());
      EXPECT_TRUE(positive(fix.baseline->covariance_enu)) << fix.baseline->covariance_enu;
    }
    if (fix.solved()) {
      EXPECT_TRUE(fix.position_ecef.allFinite());
      EXPECT_TRUE(positive(fix.covariance_enu)) << fix.covariance_enu;
      if (fix.velocity_enu_mps) {
        EXPECT_TRUE(fix.velocity_enu_mps->allFinite());
      }
      if (fix.velocity_covariance_enu) {
        EXPECT_TRUE(positive(*fix.velocity_covariance_enu));
      }
      for (const double m : fix.residuals_m) EXPECT_TRUE(std::isfinite(m));
      for (const auto& [system, bias_s] : fix.clock_bias_s) EXPECT_TRUE(std::isfinite(bias_s));
      EXPECT_TRUE(std::isfinite(fix.clock_drift.value_or(0)));
      if (fix.dop) {
        EXPECT_TRUE(std::isfinite(fix.dop->gdop));
      }
    }
    const double latitude_deg = geodesy::degrees(fix.position.latitude_rad);
    check_csv(bytes["epochs_csv"], fix, latitude_deg);
    check_nmea(bytes["nmea"], fix, latitude_deg);
    check_ubx(bytes["ubx"], fix, latitude_deg);
    check_sbf(bytes["sbf"], fix);
    check_mavlink(encoding::gps_raw_int(epoch), fix.measured(), latitude_deg);
    check_mavlink(encoding::hil_gps(epoch), fix.measured() && fix.velocity_enu_mps, latitude_deg);
    check_mavlink(encoding::gps_input(epoch), fix.measured() && fix.velocity_enu_mps, latitude_deg);
    ++kinds[fix.kind()];
  }
  void finish() override {}

  std::map<positioning::FixKind, int> kinds;

 private:
  static std::vector<std::string> split(std::string_view line) {
    std::vector<std::string> cells;
    std::string cell;
    for (const char c : line) {
      if (c == ',' || c == '\n')
        cells.push_back(std::exchange(cell, {}));
      else
        cell += c;
    }
    return cells;
  }
  void check_csv(const std::string& line, const positioning::Fix& fix, double latitude_deg) const {
    EXPECT_THAT(line, Not(HasSubstr("nan"))) << line;
    EXPECT_THAT(line, Not(HasSubstr("inf"))) << line;
    const std::vector<std::string> cells = split(line);
    std::map<std::string, std::string> of;
    for (std::size_t i = 0; i < std::min(cells.size(), columns_.size()); ++i) of[columns_[i]] = cells[i];
    EXPECT_EQ(of["status"], fix.solved() ? "fix" : "no fix");
    for (const char* name : {"fix_latitude_deg", "fix_longitude_deg", "fix_height_m"}) {
      EXPECT_EQ(of[name].empty(), !fix.solved()) << name;
    }
    if (fix.solved()) {
      EXPECT_NEAR(std::stod(of["fix_latitude_deg"]), latitude_deg, 1e-6);
    }
    EXPECT_EQ(of["baseline_east_m"].empty(), !fix.baseline) << of["baseline_kind"];
  }
  static void check_nmea(const std::string& text, const positioning::Fix& fix, double latitude_deg) {
    EXPECT_THAT(text, Not(HasSubstr("nan")));
    EXPECT_THAT(text, Not(HasSubstr("inf")));
    const std::size_t at = text.find("GGA,");
    ASSERT_NE(at, std::string::npos);
    const auto fields = split(std::string_view(text).substr(at, text.find('\r', at) - at));
    ASSERT_GT(fields.size(), 10U);
    EXPECT_EQ(fields[6] != "0", fix.solved());
    EXPECT_EQ(fields[2].empty(), !fix.solved());
    EXPECT_EQ(fields[9].empty(), !fix.solved());
    if (!fix.solved()) return;
    EXPECT_NEAR(std::stod(fields[2].substr(0, 2)) + std::stod(fields[2].substr(2)) / 60,
                std::abs(latitude_deg), 1e-6);
  }
  // UBX-22008968, 3.15.13: fixType, flags, lat, hAcc.
  static void check_ubx(const std::string& bytes, const positioning::Fix& fix, double latitude_deg) {
    const auto messages = test::split_frames(bytes);
    const test::Message& pvt = test::find(messages, 0x0107);
    ASSERT_EQ(pvt.payload.size(), 92U);
    EXPECT_EQ(pvt.u(20, 1) != 0, fix.solved());
    EXPECT_EQ((pvt.u(21, 1) & 1) != 0, fix.solved());
    EXPECT_NEAR(static_cast<double>(pvt.i4(28)) * 1e-7, fix.solved() ? latitude_deg : 0, 1e-6);
    EXPECT_EQ(pvt.u(40, 4) != 0xFFFFFFFF, fix.solved());
    if (fix.solved()) {
      EXPECT_GT(pvt.u(40, 4), 0U);
    }
  }
  // PolaRx5TR Reference Guide, 4.2.9: PVTGeodetic's Mode, Latitude.
  static void check_sbf(std::string_view bytes, const positioning::Fix& fix) {
    for (std::size_t at = 0; at + 40 < bytes.size(); ++at) {
      if (bytes.substr(at, 2) != "$@" || (test::ubx::number_at(bytes, at + 4, 2) & 0x1FFF) != 4007) continue;
      const bool known = (test::ubx::number_at(bytes, at + 14, 1) & 0xF) != 0;
      EXPECT_EQ(known, fix.measured());
      EXPECT_EQ(r8(bytes, at + 16), fix.measured() ? fix.position.latitude_rad : -2e10);
      return;
    }
    ADD_FAILURE() << "no PVTGeodetic";
  }
  template <typename Message>
  static void check_mavlink(const Message& m, bool known, double latitude_deg) {
    EXPECT_EQ(m.fix_type > 1, known);
    EXPECT_EQ(m.latitude_deg, known ? latitude_deg : 0);
    EXPECT_EQ(m.horizontal_accuracy_m > 0, known);
    if (known) {
      EXPECT_TRUE(std::isfinite(m.altitude_m + m.horizontal_accuracy_m + m.vertical_accuracy_m));
    }
  }

  std::map<std::string, std::unique_ptr<encoding::Encoder>> encoders_;
  std::vector<std::string> columns_;
};

class Dice {
 public:
  explicit Dice(int number) : random_(83, fmt::format("scenario {}", number)) {}
  double between(double low, double high) { return low + (high - low) * random_.uniform(); }
  int whole(int low, int high) { return low + static_cast<int>((high - low + 1) * random_.uniform()); }
  bool chance(double p) { return random_.uniform() < p; }
  template <class Value = const char*>
  Value one_of(std::initializer_list<Value> values) {
    return *std::next(values.begin(), whole(0, static_cast<int>(values.size()) - 1));
  }
  std::string random_position(double within_m) {
    return fmt::format("{{east_m: {:.1f}, north_m: {:.1f}, up_m: {:.1f}}}", between(-within_m, within_m),
                       between(-within_m, within_m), between(1, 4));
  }

 private:
  RandomStream random_;
};

std::string fault(Dice& dice, double duration_s) {
  const double from_s = dice.between(0, 0.6) * duration_s;
  const std::string when = fmt::format("from_s: {:.1f}, until_s: {:.1f}, receivers: [rover], ", from_s,
                                       from_s + dice.between(0.1, 0.6) * duration_s);
  switch (dice.whole(0, 10)) {
    case 0:
      return when +
             fmt::format("outage: {{satellites: {}}}", dice.one_of({"GPS", "Galileo", "GLONASS", "BeiDou"}));
    case 1:
      return when + "outage: {satellites: [GPS, Galileo, GLONASS, BeiDou]}";
    case 2:
      return when + fmt::format("clock: {{jump_s: {}}}", dice.one_of({"1e-3", "-2e-3", "1e-6", "3e-8"}));
    case 3:
      return when + fmt::format("clock: {{drift: {:.2e}}}", dice.between(-1e-6, 1e-6));
    case 4:
      return when + fmt::format("antenna: {{loss_db: {:.1f}, period_s: 4, on_s: 2}}", dice.between(5, 40));
    case 5:
      return when + fmt::format("scintillation: {{s4: {:.2f}, sigma_phi_rad: {:.2f}}}",
                                dice.between(0.3, 0.9), dice.between(0.1, 0.8));
    case 6:
      return fmt::format("from_s: {:.1f}, receivers: [rover], restart: {{kind: {}}}", from_s,
                         dice.one_of({"hot", "warm"}));
    case 7:
      return when + fmt::format("spoofing: {{position: {}, advantage_db: {:.1f}}}", dice.random_position(100),
                                dice.between(0, 10));
    default:
      return when + fmt::format("jamming: {{position: {}, preset: {}}}", dice.random_position(250),
                                dice.one_of({"noise_l1", "privacy_l1", "noise_l1", "privacy_l1_l2"}));
  }
}

std::string scenario(int number) {
  Dice dice(number);
  const double rate_hz = dice.one_of({1.0, 2.0, 5.0}), duration_s = 60 / rate_hz;
  const bool reckons = dice.chance(0.2), street = dice.chance(0.4);
  std::string yaml = fmt::format(
      "city: {{{}, origin: {{latitude_deg: {:.3f}, longitude_deg: {:.3f}, height_m: 10}}}}\n"
      "sky: {{nominal: true}}\nstart: 2026-06-{:02d}T{:02d}:00:00Z\nrate_hz: {}\nduration_s: {}\nseed: {}\n"
      "trajectory: {{attitude: car, speed_mps: {:.1f}, acceleration_mps2: 2, waypoints: [{{east_m: -150, "
      "north_m: 0, up_m: 1.5, hold_s: {}}}, {{east_m: 0, north_m: 0, up_m: 1.5}}, {{east_m: 0, north_m: 150, "
      "up_m: 1.5}}]}}\n",
      street ? fmt::format("synthetic: {{blocks_east: 4, blocks_north: 4, max_height_m: 50, seed: {}}}",
                           dice.whole(1, 100))
             : "open: true",
      dice.between(-60, 60), dice.between(-180, 180), dice.whole(1, 28), dice.whole(0, 23), rate_hz,
      duration_s, dice.whole(1, 1000), dice.between(2, 20), dice.chance(0.5) ? 5 : 0);
  const std::string paths = "propagation: {reflection_order: 1, diffuse: {enabled: false}}";
  if (reckons) {
    yaml += "sensors: {imu: {profile: automotive, rate_hz: 50}, wheels: {}}\n";
    yaml += fmt::format("receivers: [{{name: rover, profile: ublox-f9r, {}}}]\n", paths);
  } else {
    const bool rtk = dice.chance(0.7);
    const char* profile = rtk ? dice.one_of({"ublox-f9p", "septentrio-mosaic"})
                              : dice.one_of({"ublox-m8t", "ublox-m10", "phone", "ublox-f9p"});
    const bool filter = dice.chance(0.5);
    yaml += fmt::format(
        "receivers:\n- {{name: rover, profile: {}, {}, position_filter: {{enabled: {}}}, raim: {{enabled: "
        "{}}}{}}}\n",
        profile, paths, filter, dice.chance(0.3),
        rtk ? fmt::format(", rtk: {{enabled: true, integers: {}}}, corrections: {{from: base, rate_hz: 1}}",
                          dice.one_of({"continuous", "hold", "instantaneous"}))
            : "");
    if (rtk)
      yaml += fmt::format(
          "- {{name: base, profile: survey, {}, fixed: {{east_m: {:.0f}, north_m: 300, up_m: 60}}}}\n", paths,
          dice.one_of({-300.0, 850.0, 900.0, 950.0, 6000.0}));
  }
  yaml += "faults:\n";
  for (int i = dice.whole(1, 4); i > 0; --i) yaml += "- {" + fault(dice, duration_s) + "}\n";
  return yaml;
}

TEST(SoundEpochs, UnderFaultsAtRandom) {
  constexpr int kScenarios = 200;
  std::map<positioning::FixKind, int> kinds;
  for (int number = 0; number < kScenarios; ++number) {
    const std::string yaml = scenario(number);
    SCOPED_TRACE(fmt::format("{}: {}", number, yaml));
    const test::TemporaryFolder folder;
    const simulation::Simulation simulation = test::prepare(yaml, folder.path());
    Outputs outputs(simulation);
    simulation.run({&outputs});
    for (const auto& [kind, count] : outputs.kinds) kinds[kind] += count;
    if (testing::Test::HasFailure()) break;
  }
  using positioning::FixKind;
  for (const FixKind kind : {FixKind::None, FixKind::Single, FixKind::Differential, FixKind::Float,
                             FixKind::Fixed, FixKind::DeadReckoning, FixKind::Combined}) {
    EXPECT_GT(kinds[kind], 20) << gnss::name(kind);
  }
}

}  // namespace
}  // namespace canyon
