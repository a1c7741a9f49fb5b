// A recorded pair of receivers one metre apart: two Septentrio mosaic-X5, 301 epochs, five systems, three
// bands (rtk-nagoya-20240624), compared with its survey and with RTKLIB's solution of the same files.
#include "canyon/receiver/rtk/recorded_pair.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::rtk {
namespace {

using geodesy::Geodetic;
using gnss::System;
using ::testing::HasSubstr;

/// base_position.txt and rover_position.txt.
const Geodetic kBase = Geodetic::from_degrees(35.134707705, 136.977577939, 104.853);
const Geodetic kRover = Geodetic::from_degrees(35.13469901, 136.97757549, 104.8626);

/// The receivers output aligned phases.
const GlonassBiases kAligned{{"1C", 0}, {"2C", 0}};

void set_biases(std::vector<rinex::ObservationEpoch>& epochs, const GlonassBiases& biases) {
  rinex::ObservationHeader header = *epochs.front().header;
  header.glonass_bias_m = biases;
  const auto shared = std::make_shared<const rinex::ObservationHeader>(header);
  for (rinex::ObservationEpoch& epoch : epochs) epoch.header = shared;
}

class RecordedPair : public ::testing::Test {
 protected:
  void SetUp() override {
    CANYON_SHARED_DATA(folder, "rtk-nagoya-20240624");
    navigation = rinex::read_rinex_navigation({folder / "base.nav"});
    sky = std::make_unique<orbit::BroadcastSky>(navigation);
    rinex::ObservationOptions wanted;
    wanted.all_signals = true;
    rover = rinex::read_rinex_observations(folder / "rover.obs", wanted).epochs;
    recorded_base = rinex::read_rinex_observations(folder / "base.obs", wanted).epochs;
    set_biases(rover, kAligned);
    set_biases(recorded_base, kAligned);
    options.fix.elevation_mask_rad = geodesy::radians(15);
    options.fix.correct_troposphere = true;
  }

  [[nodiscard]] RecordedEpochs base(const Geodetic& position = kBase) const {
    return recorded_epochs(recorded_base, *sky, geodesy::ecef_from_geodetic(position));
  }
  [[nodiscard]] std::vector<PairEpoch> solve(const RecordedEpochs& base_measurements) const {
    return solve_pair(recorded_epochs(rover, *sky), base_measurements, *sky, navigation.klobuchar, options);
  }
  /// Keeps only satellites of these systems.
  void keep(std::initializer_list<System> systems) {
    for (auto* epochs : {&rover, &recorded_base}) {
      for (rinex::ObservationEpoch& epoch : *epochs) {
        std::erase_if(epoch.signals, [&](const rinex::ObservedSignal& s) {
          return std::find(systems.begin(), systems.end(), s.id.system) == systems.end();
        });
      }
    }
  }

  gnss::NavigationData navigation;
  std::unique_ptr<orbit::BroadcastSky> sky;
  std::vector<rinex::ObservationEpoch> rover, recorded_base;
  PairOptions options;
};

Eigen::Vector3d error_enu(const positioning::Fix& fix, const Geodetic& position = kRover) {
  return geodesy::enu_from_ecef_rotation(position) *
         (fix.position_ecef - geodesy::ecef_from_geodetic(position));
}

struct Outcome {
  double fixed = 0;                  // fraction of epochs
  double median_m = 0, worst_m = 0;  // error while fixed
};
Outcome outcome(const std::vector<PairEpoch>& epochs, const Geodetic& position = kRover) {
  std::vector<double> errors;
  for (const PairEpoch& epoch : epochs) {
    if (epoch.fix.kind() != positioning::FixKind::Fixed) continue;
    errors.push_back(error_enu(epoch.fix, position).norm());
  }
  std::sort(errors.begin(), errors.end());
  if (errors.empty()) return {};
  return {static_cast<double>(errors.size()) / static_cast<double>(epochs.size()), errors[errors.size() / 2],
          errors.back()};
}

TEST_F(RecordedPair, AllSystemsOfOneToThreeBands) {
  for (const std::vector<std::string>& signals :
       {std::vector<std::string>{"L1CA", "E1", "G1", "B1I"},
        {"L1CA", "E1", "G1", "B1I", "L2C", "E5b", "G2", "B2I", "B3I"},
        {}}) {
    options.signals = signals;
    const Outcome found = outcome(solve(base()));
    EXPECT_GE(found.fixed, 0.95) << signals.size();
    EXPECT_LT(found.median_m, 0.003) << signals.size();
    EXPECT_LT(found.worst_m, 0.015) << signals.size();
  }
}

TEST_F(RecordedPair, GpsAloneOfOneToThreeBands) {
  keep({System::GPS});
  for (const std::vector<std::string>& signals :
       {std::vector<std::string>{"L1CA"}, {"L1CA", "L2C"}, {"L1CA", "L2P"}, {}}) {
    options.signals = signals;
    const Outcome found = outcome(solve(base()));
    EXPECT_GE(found.fixed, 0.95) << signals.size();
    EXPECT_LT(found.median_m, 0.007) << signals.size();
    EXPECT_LT(found.worst_m, 0.015) << signals.size();
  }
}

// Components of one carrier are interchangeable: their phases are aligned.
TEST_F(RecordedPair, P2OfTheBaseBesideL2COfTheRover) {
  keep({System::GPS});
  for (rinex::ObservationEpoch& epoch : rover) {
    std::erase_if(epoch.signals,
                  [](const auto& s) { return s.signal->name == "L2P" || s.signal->name == "L5"; });
  }
  for (rinex::ObservationEpoch& epoch : recorded_base) {
    std::erase_if(epoch.signals,
                  [](const auto& s) { return s.signal->name == "L2C" || s.signal->name == "L5"; });
  }
  const Outcome found = outcome(solve(base()));
  EXPECT_GE(found.fixed, 0.95);
  EXPECT_LT(found.worst_m, 0.015);
}

// RINEX 2 has one phase for P2 and C2 of a satellite: it counts once.
TEST_F(RecordedPair, APhaseOfTwoCodesCountsOnce) {
  keep({System::GPS});
  for (rinex::ObservationEpoch& epoch : rover) {
    for (rinex::ObservedSignal& p2 : epoch.signals) {
      if (p2.signal->name != "L2P") continue;
      for (const rinex::ObservedSignal& c2 : epoch.signals) {
        if (c2.id != p2.id || c2.signal->name != "L2C") continue;
        p2.carrier_phase_cycles = c2.carrier_phase_cycles;
        p2.doppler_hz = c2.doppler_hz;
        p2.cn0_dbhz = c2.cn0_dbhz;
      }
    }
  }
  for (const auto& epoch : recorded_epochs(rover, *sky)) {
    std::map<gnss::SatelliteId, int> phases;
    for (const SignalMeasurement& m : epoch->observations) {
      if (m.signal->carrier_hz < 1.2e9 || m.signal->carrier_hz > 1.25e9) continue;
      phases[m.measurement.id] += m.measurement.carrier_phase_cycles ? 1 : 0;
    }
    for (const auto& [id, count] : phases) EXPECT_LE(count, 1) << gnss::to_string(id);
  }
  // With only its P2 the base has a partner for it.
  for (rinex::ObservationEpoch& epoch : recorded_base) {
    std::erase_if(epoch.signals, [](const auto& s) { return s.signal->name == "L2C"; });
  }
  const Outcome found = outcome(solve(base()));
  EXPECT_GE(found.fixed, 0.95);
  EXPECT_LT(found.worst_m, 0.015);
}

// B2I of one receiver is B2b of another one: codes have different group delays, phases have a common carrier.
TEST_F(RecordedPair, ComponentsOfOtherGroupDelays) {
  keep({System::BeiDou});
  const auto signals = gnss::signals_of(System::BeiDou);
  const auto b2b =
      std::find_if(signals.begin(), signals.end(), [](const auto& s) { return s.name == "B2b"; });
  ASSERT_NE(b2b, signals.end());
  for (rinex::ObservationEpoch& epoch : recorded_base) {
    for (rinex::ObservedSignal& s : epoch.signals) {
      if (s.signal->name == "B2I") s.signal = &*b2b;
    }
  }
  const Outcome found = outcome(solve(base()));
  EXPECT_GE(found.fixed, 0.95);
  EXPECT_LT(found.worst_m, 0.025);
}

// Stations give epochs half a minute apart: positions are new each time, and ambiguities' variances fall.
TEST_F(RecordedPair, EpochsFarApart) {
  keep({System::GPS});
  options.signals = {"L1CA"};
  options.rtk.min_success = 0.999;
  const auto thin = [](std::vector<rinex::ObservationEpoch>& epochs) {
    std::vector<rinex::ObservationEpoch> kept;
    for (std::size_t k = 0; k < epochs.size(); k += 30) kept.push_back(epochs[k]);
    epochs = std::move(kept);
  };
  thin(rover);
  thin(recorded_base);
  const auto epochs = solve(base());
  EXPECT_EQ(epochs.size(), 11U);
  EXPECT_GE(outcome(epochs).fixed, 0.4);
  EXPECT_EQ(epochs.back().fix.kind(), positioning::FixKind::Fixed);
  EXPECT_LT(outcome(epochs).worst_m, 0.015);
}

// RINEX 2 files often have no C/N0: it is unknown, and codes are weighted as in the open.
TEST_F(RecordedPair, WithoutStrengths) {
  keep({System::GPS});
  options.signals = {"L1CA", "L2C"};
  for (auto* epochs : {&rover, &recorded_base}) {
    for (rinex::ObservationEpoch& epoch : *epochs) {
      for (rinex::ObservedSignal& s : epoch.signals) s.cn0_dbhz.reset();
    }
  }
  const auto epochs = solve(base());
  EXPECT_EQ(epochs.front().fix.kind(), positioning::FixKind::Fixed);
  EXPECT_GE(outcome(epochs).fixed, 0.95);
  EXPECT_LT(outcome(epochs).worst_m, 0.015);
}

// Cold starts throughout the file.
TEST_F(RecordedPair, FixesAtOnceWhereverItBegins) {
  const std::vector<rinex::ObservationEpoch> whole = rover;
  int at_once = 0, starts = 0;
  double first_m = 0, later_m = 0;
  for (std::size_t begin = 0; begin + 5 < whole.size(); begin += 20, ++starts) {
    rover.assign(whole.begin() + static_cast<std::ptrdiff_t>(begin),
                 whole.begin() + static_cast<std::ptrdiff_t>(begin + 5));
    const auto epochs = solve(base());
    at_once += epochs.front().fix.kind() == positioning::FixKind::Fixed ? 1 : 0;
    EXPECT_LT(outcome(epochs).worst_m, 0.02) << begin;
    // The troposphere is that of the final position, not only of the fix.
    if (epochs.front().fix.kind() != positioning::FixKind::Fixed) continue;
    first_m += error_enu(epochs.front().fix).z();
    later_m += error_enu(epochs.back().fix).z();
  }
  EXPECT_GE(at_once, starts - 1);
  EXPECT_LT(std::abs(first_m - later_m) / at_once, 0.002);
}

// rover_rtk.pos: RTKPOST 2.4.3 b34, kinematic, instantaneous, L1 and L2, GLONASS integers enabled.
TEST_F(RecordedPair, AgreesWithRtklib) {
  CANYON_SHARED_DATA(path, "rtk-nagoya-20240624/rover_rtk.pos");
  options.rtk.fix_glonass = true;
  const auto epochs = solve(base());
  std::ifstream file(path);
  std::size_t next = 0, compared = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line.front() == '%') continue;
    const auto fields = split_blanks(line);
    ASSERT_GT(fields.size(), 5U);
    const Geodetic theirs =
        Geodetic::from_degrees(*parse_double(fields[2]), *parse_double(fields[3]), *parse_double(fields[4]));
    ASSERT_LT(next, epochs.size());
    const Eigen::Vector3d apart = error_enu(epochs[next++].fix, theirs);
    EXPECT_LT(apart.head<2>().norm(), 0.005) << line;
    EXPECT_LT(std::abs(apart.z()), 0.012) << line;
    ++compared;
  }
  EXPECT_EQ(compared, 301U);
}

// Of the antenna 4 m farther east and 1.5 m higher, 4.272 m away.
TEST_F(RecordedPair, TheBaseStandsWhereItsHeaderSaysAtEachEpoch) {
  rinex::ObservationHeader header = *recorded_base.front().header;
  header.antenna_delta_hen = Eigen::Vector3d(1.5, 4, 0);
  recorded_base.back().header = std::make_shared<const rinex::ObservationHeader>(header);
  const RecordedEpochs moves = recorded_epochs(recorded_base, *sky);
  EXPECT_EQ(moves.front()->station_ecef, moves[1]->station_ecef);
  EXPECT_NEAR((moves.back()->station_ecef - moves.front()->station_ecef).norm(), 4.272, 1e-3);
  EXPECT_EQ(base().back()->station_ecef, geodesy::ecef_from_geodetic(kBase));
  header.moving = true;
  recorded_base.back().header = std::make_shared<const rinex::ObservationHeader>(header);
  EXPECT_FALSE(recorded_epochs(recorded_base, *sky).back()->station_ecef.allFinite());
}

// Phases of GLONASS that are 72 m off the codes, as those of a base of another make: with the bias they are
// integers, without it they stay real, and with a wrong one the others are fixed.
TEST_F(RecordedPair, BiasesOfGlonassOfABaseOfAnotherMake) {
  for (rinex::ObservationEpoch& epoch : recorded_base) {
    for (rinex::ObservedSignal& s : epoch.signals) {
      if (s.id.system != System::GLONASS || !s.carrier_phase_cycles) continue;
      const auto state = sky->state(s.id, epoch.receiver_time);
      if (!state) continue;
      const double hz = gnss::carrier_hz(*s.signal, state->carrier_frequency_hz);
      *s.carrier_phase_cycles -= -71.94 * hz / geodesy::kSpeedOfLight;
    }
  }
  const auto base_measurements = [&](const GlonassBiases& biases) {
    set_biases(recorded_base, biases);
    return base();
  };
  const RecordedEpochs known = base_measurements({{"1C", -71.94}, {"2C", -71.94}});
  const RecordedEpochs unknown = base_measurements({}), wrong = base_measurements(kAligned);
  for (const RecordedEpochs& recorded : {known, unknown, wrong}) {
    const Outcome found = outcome(solve(recorded));
    EXPECT_GE(found.fixed, 0.95);
    EXPECT_LT(found.worst_m, 0.015);
  }
  keep({System::GLONASS});
  EXPECT_GE(outcome(solve(known)).fixed, 0.9);
  EXPECT_LT(outcome(solve(known)).worst_m, 0.02);
  EXPECT_EQ(outcome(solve(unknown)).fixed, 0);
}

// Receivers that steer their clock by jumps of a millisecond: in some only the code moves.
TEST_F(RecordedPair, JumpsOfAMillisecondInCodesAlone) {
  for (std::size_t k = 100; k < rover.size(); ++k) {
    rover[k].receiver_time = rover[k].receiver_time + 1e-3;
    for (rinex::ObservedSignal& s : rover[k].signals) {
      if (s.pseudorange_m) *s.pseudorange_m += 1e-3 * geodesy::kSpeedOfLight;
      // A phase that starts after the jump.
      if (k == 120 && s.id.number % 3 == 0) s.loss_of_lock = 1;
    }
  }
  const auto epochs = solve(base());
  EXPECT_GE(outcome(epochs).fixed, 0.95);
  EXPECT_LT(outcome(epochs).worst_m, 0.015);
}

TEST_F(RecordedPair, StatesWhatItErrs) {
  keep({System::GPS, System::Galileo});
  const auto epochs = solve(base());
  double squares = 0, reported = 0;
  for (const PairEpoch& epoch : epochs) {
    squares += error_enu(epoch.fix).squaredNorm();
    reported += epoch.fix.covariance_enu.trace();
  }
  EXPECT_GT(reported, 0.5 * squares);
  EXPECT_LT(reported, 60 * squares);
}

// Like two antennas of a vehicle: the reported deviations follow from the residuals.
TEST_F(RecordedPair, StatesWhatItErrsBesideAMovingBase) {
  RecordedEpochs moving = base();
  for (auto& epoch : moving) {
    Corrections epoch_fix = *epoch;
    epoch_fix.moving = true;
    epoch = std::make_shared<const Corrections>(std::move(epoch_fix));
  }
  double squares = 0, reported = 0;
  for (const PairEpoch& epoch : solve(moving)) {
    squares += error_enu(epoch.fix).squaredNorm();
    reported += epoch.fix.baseline->covariance_enu.trace();
  }
  EXPECT_GT(std::sqrt(reported / squares), 0.7);
  EXPECT_LT(std::sqrt(reported / squares), 1.4);
}

// A base whose reported position is wrong by metres moves the rover by the same vector.
TEST_F(RecordedPair, AWrongPlaceOfTheBaseIsInTheFix) {
  const Eigen::Vector3d wrong_enu(20, -10, 5);
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(kBase);
  const Geodetic position =
      geodesy::geodetic_from_ecef(geodesy::ecef_from_geodetic(kBase) + enu.transpose() * wrong_enu);
  const auto epochs = solve(base(position));
  EXPECT_LT((error_enu(epochs.back().fix) - wrong_enu).norm(), 0.05);
}

// Clocks a millisecond apart, and a base that sends every fifth epoch.
TEST_F(RecordedPair, ClocksApartAndASlowBase) {
  RecordedEpochs slow;
  for (const auto& epoch : base()) {
    Corrections late = *epoch;
    late.receiver_time = late.receiver_time + 1e-3;
    for (SignalMeasurement& m : late.observations) {
      m.measurement.pseudorange_m += 1e-3 * geodesy::kSpeedOfLight;
      if (m.measurement.carrier_phase_cycles) {
        *m.measurement.carrier_phase_cycles += 1e-3 * m.measurement.carrier_frequency_hz;
      }
      m.measurement.phase_since = rover.front().receiver_time;
    }
    if (slow.empty() || late.receiver_time - slow.back()->receiver_time > 4.5) {
      slow.push_back(std::make_shared<const Corrections>(std::move(late)));
    }
  }
  const auto epochs = solve(slow);
  const Outcome found = outcome(epochs);
  EXPECT_GE(found.fixed, 0.95);
  EXPECT_LT(found.median_m, 0.012);
  double oldest_s = 0;
  for (const PairEpoch& epoch : epochs) oldest_s = std::max(oldest_s, epoch.fix.correction_age_s.value_or(0));
  EXPECT_NEAR(oldest_s, 4, 0.01);
}

TEST_F(RecordedPair, RefusesWhatHasNothingInCommon) {
  const auto problem = [&](const auto& call) -> std::string {
    try {
      (void)call();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  RecordedEpochs elsewhen;
  for (const auto& epoch : base()) {
    Corrections other = *epoch;
    other.receiver_time = other.receiver_time + 86'400.0;
    elsewhen.push_back(std::make_shared<const Corrections>(std::move(other)));
  }
  EXPECT_THAT(problem([&] { return solve(elsewhen); }), HasSubstr("have no common time"));
  EXPECT_THAT(problem([&] { return solve({}); }), HasSubstr("the base has no epoch"));
  for (rinex::ObservationEpoch& epoch : recorded_base) {
    std::erase_if(epoch.signals, [](const auto& s) { return s.id.system != System::GPS; });
  }
  const RecordedEpochs gps = base();
  keep({System::Galileo});
  EXPECT_THAT(problem([&] { return solve(gps); }), HasSubstr("same systems and bands"));
}

}  // namespace
}  // namespace canyon::rtk
