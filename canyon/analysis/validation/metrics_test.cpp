#include "canyon/analysis/validation/metrics.hpp"
#include "canyon/analysis/validation/metrics_text.hpp"

#include <gtest/gtest.h>

#include <gmock/gmock.h>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include "canyon/analysis/validation/alignment.hpp"
#include "canyon/analysis/validation/recording_table.hpp"
#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "tests/support/bootstrap.hpp"

namespace canyon::validation {
namespace {

using nlohmann::json;
using propagation::PathKind;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A comparison, epoch by epoch.
class Hand {
 public:
  Hand() { comparison.name = "by hand"; }
  ComparedEpoch& epoch() {
    ComparedEpoch e;
    e.time = geodesy::parse_time("2019-04-28T12:52:00 GPST") + static_cast<double>(comparison.epochs.size());
    e.position_enu_m = {static_cast<double>(comparison.epochs.size()), 0, 0};
    e.first = comparison.satellites.size();
    e.clock = ClockSource::Clear;
    return comparison.epochs.emplace_back(e);
  }
  ComparedSatellite& satellite(bool clear, double elevation_deg = 60) {
    ComparedSatellite s;
    s.id = {gnss::System::GPS, static_cast<std::uint8_t>(++comparison.epochs.back().count)};
    s.clear = clear;
    s.elevation_rad = geodesy::radians(elevation_deg);
    return comparison.satellites.emplace_back(s);
  }
  ComparedSatellite& measured(bool clear, double error_m, double cn0_dbhz, double elevation_deg = 60) {
    ComparedSatellite& s = satellite(clear, elevation_deg);
    s.measured.tracked = true;
    s.measured.error_m = error_m;
    s.measured.cn0_dbhz = cn0_dbhz;
    return s;
  }
  [[nodiscard]] ModelMetrics metrics(const MetricOptions& options = no_intervals()) const {
    return validation::metrics(comparison, 0, comparison.epochs.size(), "all", options);
  }
  static MetricOptions no_intervals() {
    MetricOptions options;
    options.resamples = 0;
    return options;
  }
  Comparison comparison;
};

// NLOS is later and weaker in 5 of the 3 times 2 pairs: AUC 5/6.
TEST(ModelMetrics, SeparationByHand) {
  Hand hand;
  hand.epoch();
  hand.measured(true, 0, 40);
  hand.measured(true, 1, 45);
  hand.measured(true, 2, 38);
  hand.epoch();
  hand.measured(false, 1.5, 39, 20);
  hand.measured(false, 10, 30, 20);
  const ModelMetrics f = hand.metrics();
  EXPECT_EQ(f.model, "by hand");
  EXPECT_EQ(f.epochs, 2U);
  EXPECT_EQ(f.los, 3U);
  EXPECT_EQ(f.nlos, 2U);
  EXPECT_DOUBLE_EQ(f.by_error->auc, 5.0 / 6);
  EXPECT_DOUBLE_EQ(f.by_cn0->auc, 5.0 / 6);
  // Above 1.25 m: both NLOS, and one LOS of three.
  EXPECT_DOUBLE_EQ(f.by_error->balanced_accuracy, (1 + 2.0 / 3) / 2);
  EXPECT_DOUBLE_EQ(f.by_error->threshold, 1.25);
  // LOS is in one band, NLOS in another: neither separates.
  ASSERT_EQ(f.bands.size(), 3U);
  EXPECT_EQ(f.bands[0].nlos, 2U);
  EXPECT_EQ(f.bands[2].los, 3U);
  for (const Band& band : f.bands) EXPECT_FALSE(band.by_error || band.by_cn0);
  EXPECT_FALSE(f.by_error_interval);
}

TEST(ModelMetrics, BandsMeetWithoutOverlap) {
  Hand hand;
  hand.epoch();
  for (const double elevation_deg : {5.0, 10.0, 29.999, 30.001, 49.999, 50.001, 90.0})
    hand.measured(true, 0, 40, elevation_deg);
  const ModelMetrics f = hand.metrics();
  EXPECT_EQ(f.bands[0].los, 2U);
  EXPECT_EQ(f.bands[1].los, 2U);
  EXPECT_EQ(f.bands[2].los, 2U);
  EXPECT_EQ(f.los, 7U);
}

TEST(ModelMetrics, TrackedExplainedAndDistributions) {
  Hand hand;
  hand.epoch();
  // LOS: 4 satellites, 3 measured, 2 simulated.
  for (int i = 0; i < 4; ++i) {
    ComparedSatellite& s = hand.satellite(true);
    s.measured.tracked = i < 3;
    if (s.measured.tracked) s.measured.error_m = i;  // 0, 1, 2
    s.simulated.tracked = i < 2;
    if (s.simulated.tracked) s.simulated.error_m = 5 + i;  // 5, 6: beyond all measured
    if (s.simulated.tracked) s.simulated.cn0_dbhz = 44;
  }
  // NLOS: 5, 4 measured, of which one without a path.
  const double errors[] = {10, 22, 33, 40};
  const double delays[] = {11, 20, 30};
  for (int i = 0; i < 5; ++i) {
    ComparedSatellite& s = hand.satellite(false);
    s.measured.tracked = i < 4;
    if (s.measured.tracked) s.measured.error_m = errors[i];
    if (i < 2) s.prediction = {PathKind::Reflected, 1, delays[i]};
    if (i == 2) s.prediction = {PathKind::Diffracted, 0, delays[i]};
    if (i == 4) s.prediction = {PathKind::Diffuse, 0, 99};  // not measured: explains nothing
  }
  const ModelMetrics f = hand.metrics();
  EXPECT_EQ(f.tracked_los.satellites, 4U);
  EXPECT_DOUBLE_EQ(f.tracked_los.ratio(Side::Measured).value(), 0.75);
  EXPECT_DOUBLE_EQ(f.tracked_los.ratio(Side::Simulated).value(), 0.5);
  EXPECT_DOUBLE_EQ(f.tracked_nlos.ratio(Side::Measured).value(), 0.8);
  EXPECT_DOUBLE_EQ(f.tracked_nlos.ratio(Side::Simulated).value(), 0);
  EXPECT_FALSE(TrackedFraction{}.ratio(Side::Measured));

  ASSERT_EQ(f.explained.size(), 5U);
  EXPECT_EQ(f.explained[0].kind, "reflected 1");
  EXPECT_EQ(f.explained[0].n, 2U);
  EXPECT_DOUBLE_EQ(f.explained[0].fraction, 0.5);
  EXPECT_DOUBLE_EQ(*f.explained[0].median_difference_m, 1.5);  // 1 and 2
  EXPECT_FALSE(f.explained[0].correlation);                    // two pairs
  EXPECT_EQ(f.explained[1].n, 0U);
  EXPECT_EQ(f.explained[2].kind, "diffracted");
  EXPECT_EQ(f.explained[3].n, 0U);
  EXPECT_EQ(f.explained[4].kind, "all");
  EXPECT_EQ(f.explained[4].n, 3U);
  EXPECT_DOUBLE_EQ(f.explained[4].fraction, 0.75);
  EXPECT_DOUBLE_EQ(*f.explained[4].median_difference_m, 2);  // 1, 2, 3
  EXPECT_DOUBLE_EQ(f.explained[4].correlation->rho, 1);

  EXPECT_DOUBLE_EQ(*f.error_los_m.ks, 1);
  EXPECT_EQ(f.error_los_m.measured.n, 3U);
  EXPECT_DOUBLE_EQ(f.error_los_m.measured.at[2], 1);
  EXPECT_DOUBLE_EQ(f.error_los_m.simulated.at[2], 5.5);
  EXPECT_FALSE(f.error_nlos_m.ks);
  EXPECT_EQ(f.cn0_los_dbhz.simulated.n, 2U);
  EXPECT_EQ(f.cn0_los_dbhz.measured.n, 0U);
}

TEST(ModelMetrics, PositionsAndSegments) {
  Hand hand;
  for (int i = 0; i < 40; ++i) {
    ComparedEpoch& e = hand.epoch();
    e.segment = i < 25 ? 0 : 1;
    e.fix.measured.solved = i % 2 == 0;
    if (e.fix.measured.solved) e.fix.measured.error_enu_m = {3, 4, -7};
    if (e.fix.measured.solved) e.fix.measured.used = 6;
    e.fix.simulated.solved = true;
    e.fix.simulated.error_enu_m = {0, static_cast<double>(i), 1};
    e.fix.simulated.used = 8;
  }
  hand.comparison.segments = {{0, 25, 25, 90}, {25, 15, 15, 180}};
  const ModelMetrics f = hand.metrics();
  EXPECT_EQ(f.position.measured.epochs, 40U);
  EXPECT_EQ(f.position.measured.fixes, 20U);
  EXPECT_DOUBLE_EQ(f.position.measured.mean_used, 6);
  EXPECT_DOUBLE_EQ(f.position.measured.horizontal_m[4], 5);
  EXPECT_DOUBLE_EQ(f.position.measured.vertical_m[0], 7);  // without sign
  EXPECT_DOUBLE_EQ(f.position.simulated.horizontal_m[2], 19.5);
  EXPECT_DOUBLE_EQ(*f.used.ks, 1);
  ASSERT_EQ(f.segments.size(), 2U);
  EXPECT_EQ(f.segments[1].position.simulated.epochs, 15U);
  EXPECT_DOUBLE_EQ(f.segments[1].position.simulated.horizontal_m[2], 32);  // of 25 to 39

  // A part: segments are cut to it, and those of fewer than ten epochs are left out.
  const ModelMetrics part = metrics(hand.comparison, 18, 20, "middle", Hand::no_intervals());
  ASSERT_EQ(part.segments.size(), 1U);
  EXPECT_EQ(part.segments[0].segment.first, 25U);
  EXPECT_EQ(part.segments[0].segment.count, 13U);
  EXPECT_DOUBLE_EQ(part.segments[0].segment.length_m, 12);
  EXPECT_EQ(part.epochs, 20U);
  EXPECT_EQ(part.position.measured.fixes, 10U);
  EXPECT_EQ(describe_part(hand.comparison, 18, 20, "middle"), "middle: 12:52:18 to 12:52:37 GPST, 20 epochs");
  EXPECT_EQ(describe_part(hand.comparison, 0, 0, "none"), "none: no epoch");
}

const gnss::Signal* signal_named(gnss::System system, std::string_view name) {
  for (const gnss::Signal& signal : gnss::signals_of(system)) {
    if (signal.name == name) return &signal;
  }
  return nullptr;
}

/// Satellites whose phases contain a varying clock of tens of metres, a position error of centimetres, an
/// ambiguity, and white noise of 2 mm at 44 dB-Hz and of 5 mm at 36 dB-Hz, alternately.
Hand phases(int epochs, int satellites) {
  Hand hand;
  const gnss::Signal* l1 = signal_named(gnss::System::GPS, "L1CA");
  hand.comparison.recorded = hand.comparison.tracked = {l1};
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  double clock_m = 0;
  for (int e = 0; e < epochs; ++e) {
    hand.epoch();
    clock_m += 30 * normal(random);
    const Eigen::Vector3d off_m(0.05 * normal(random), 0.05 * normal(random), 0.05 * normal(random));
    for (int k = 0; k < satellites; ++k) {
      ComparedSatellite& s = hand.measured(true, 0, k % 2 == 0 ? 44 : 36);
      s.signal = l1;
      s.azimuth_rad = geodesy::radians(45 * k);
      s.elevation_rad = geodesy::radians(15 + 10 * (k * 3 % 8));
      const Eigen::Vector3d direction(std::sin(s.azimuth_rad) * std::cos(s.elevation_rad),
                                      std::cos(s.azimuth_rad) * std::cos(s.elevation_rad),
                                      std::sin(s.elevation_rad));
      s.measured.phase.residual_m =
          clock_m + direction.dot(off_m) + 1e6 * k + (k % 2 == 0 ? 2e-3 : 5e-3) * normal(random);
    }
  }
  return hand;
}

// Half of the magnitudes are below m where erf(m / (2 sqrt 2)) + erf(m / (5 sqrt 2)) = 1 (m in mm): m
// = 2.0167, noise 1.4826 m = 2.990 mm.
TEST(ModelMetrics, PhaseNoiseIsWhatWasPutIn) {
  const Hand hand = phases(1500, 8);
  const ModelMetrics f = hand.metrics();
  ASSERT_EQ(f.signals.size(), 1U);
  const PhaseView& los = f.signals[0].phase.measured.los;
  EXPECT_GT(los.noise_n, 8U * 1350);  // of 8 * 1497, minus those that determine the estimate
  EXPECT_NEAR(std::erf(2.0167 / 2 / std::sqrt(2.0)) + std::erf(2.0167 / 5 / std::sqrt(2.0)), 1, 1e-4);
  // 1.17 sqrt(2.3 / n) is 1.6 %.
  EXPECT_NEAR(*los.noise_m, 2.990e-3, 0.05 * 2.990e-3);
  EXPECT_FALSE(f.signals[0].phase.measured.nlos.noise_m);
  EXPECT_EQ(f.signals[0].phase.simulated.los.observations, 0U);
}

TEST(ModelMetrics, CycleSlipsByHand) {
  constexpr int kSatellites = 24;
  Hand hand = phases(10, kSatellites);
  const auto satellite = [&hand](std::size_t epoch, std::size_t k) -> ComparedSatellite& {
    return hand.comparison.satellites[kSatellites * epoch + k];
  };
  for (std::size_t e = 5; e < 10; ++e) *satellite(e, 0).measured.phase.residual_m += 100;
  satellite(5, 0).measured.phase.slip = true;  // reported
  satellite(5, 1).measured.phase = {};         // a gap
  satellite(0, 2).measured.phase.slip = true;  // nothing before it
  satellite(9, 3) = [&] {                      // not tracked at the end
    ComparedSatellite lost = satellite(9, 3);
    lost.measured.tracked = false;
    lost.measured.error_m.reset();
    lost.measured.phase = {};
    return lost;
  }();
  for (std::size_t e = 0; e < 10; ++e) satellite(e, 4).clear = false;
  const PhaseMetrics p = hand.metrics().signals.at(0).phase.measured;
  EXPECT_EQ(p.slips, 2U);
  EXPECT_EQ(p.los.observations, 229U);
  EXPECT_EQ(p.los.with_phase, 228U);
  EXPECT_EQ(p.nlos.with_phase, 10U);
  EXPECT_DOUBLE_EQ(*p.los.fraction(), 228.0 / 229);
  EXPECT_DOUBLE_EQ(p.time_s, 238);
  EXPECT_DOUBLE_EQ(*p.time_between_slips_s(), 119);
  // Four epochs in sequence: 7 of ten, 2 and 2 around the slip, 2 and 1 around the gap, 6 of nine.
  EXPECT_EQ(p.los.noise_n, 20U * 7 + 4 + 3 + 6);
  EXPECT_EQ(p.nlos.noise_n, 7U);
  EXPECT_LT(*p.los.noise_m, 0.01);

  // A missing epoch ends the sequences of four but is not a slip: no loss of lock is reported.
  Hand late = phases(10, kSatellites);
  for (std::size_t e = 6; e < 10; ++e) late.comparison.epochs[e].time = late.comparison.epochs[e].time + 3;
  const PhaseMetrics q = late.metrics().signals.at(0).phase.measured;
  EXPECT_EQ(q.slips, 0U);
  EXPECT_EQ(q.los.noise_n, 24U * (3 + 1));
  EXPECT_FALSE(q.time_between_slips_s());
}

TEST(ModelMetrics, FurtherSignalsByHand) {
  Hand hand;
  const gnss::Signal *l1 = signal_named(gnss::System::GPS, "L1CA"),
                     *l2c = signal_named(gnss::System::GPS, "L2C"),
                     *l5 = signal_named(gnss::System::GPS, "L5");
  hand.comparison.recorded = {l1, l2c, l5};
  hand.comparison.tracked = {l1, l2c};
  hand.epoch();
  for (int k = 0; k < 4; ++k) {
    ComparedSatellite& s = hand.measured(k < 3, 0, 40);
    s.signal = l1;
    if (k == 0) continue;  // does not send it
    ComparedSignal& other = s.more.emplace_back();
    other.signal = l2c;
    other.measured.tracked = k > 1;
    if (other.measured.tracked) other.measured.error_m = k;  // 2 LOS, 3 NLOS
    other.simulated.tracked = true;
    other.simulated.error_m = 10 * k;
    other.simulated.cn0_dbhz = 30;
  }
  const ModelMetrics f = hand.metrics();
  ASSERT_EQ(f.signals.size(), 3U);
  const SignalMetrics& s = f.signals[1];
  EXPECT_EQ(s.name(), "GPS L2C");
  EXPECT_TRUE(s.judged());
  EXPECT_FALSE(s.first());
  EXPECT_TRUE(f.signals[0].first());
  EXPECT_EQ(s.tracked_los.satellites, 2U);
  EXPECT_EQ(s.tracked_los.measured, 1U);
  EXPECT_EQ(s.tracked_los.simulated, 2U);
  EXPECT_EQ(s.error_los_m.measured.n, 1U);
  EXPECT_DOUBLE_EQ(s.error_los_m.measured.at[2], 2);
  EXPECT_DOUBLE_EQ(s.error_los_m.simulated.at[2], 15);
  EXPECT_DOUBLE_EQ(s.error_nlos_m.measured.at[2], 3);
  EXPECT_DOUBLE_EQ(*s.error_nlos_m.ks, 1);
  EXPECT_EQ(s.cn0_los_dbhz.simulated.n, 2U);
  EXPECT_FALSE(f.signals[2].judged());
  // The other metrics are still those of first signals.
  EXPECT_EQ(f.error_los_m.measured.n, 3U);
  EXPECT_EQ(f.error_los_m.simulated.n, 0U);

  const std::string text = to_text(f);
  EXPECT_THAT(text, HasSubstr("GPS L2C"));
  EXPECT_THAT(text, HasSubstr("  GPS L5       yes                        no\n"));
  const json parsed = json::parse(to_json({f}, {})).at("models")[0].at("signals");
  EXPECT_EQ(parsed[1].at("signal"), "L2C");
  EXPECT_EQ(parsed[1].at("distributions").at("los_error_m").at("simulated").at("p50"), 15);
  EXPECT_TRUE(parsed[1].at("carrier_phase").at("measured").at("los").at("noise_m").is_null());
  EXPECT_EQ(parsed[2].at("tracked_by_the_simulated"), false);
  EXPECT_FALSE(parsed[2].contains("distributions"));
}

Hand random_comparison() {
  Hand hand;
  std::mt19937 random(5);
  const auto uniform = [&random] { return static_cast<double>(random() % 1000) / 1000; };
  for (int e = 0; e < 300; ++e) {
    hand.epoch();
    for (int s = 0; s < 6; ++s) {
      const bool clear = (e / 20 + s) % 3 != 0;
      hand.measured(clear, std::floor(8 * uniform()) + (clear ? 0 : 3),
                    std::floor(20 * uniform()) + (clear ? 25 : 20));
    }
  }
  return hand;
}

// separation(), checked against SciPy, and the bootstrap by its definition compute the same directly. Two
// runs of one recording: the simulated values are theirs, measured values and LOS the comparison's.
TEST(ModelMetrics, SimulatedValuesOfSeveralRuns) {
  Hand hand;
  hand.epoch();
  hand.measured(true, 0, 40);
  ComparedSatellite& late = hand.measured(false, 20, 25);
  late.prediction = ComparedSatellite::Prediction{PathKind::Reflected, 1, 18};
  hand.comparison.epochs[0].fix.measured = {true, Eigen::Vector3d(3, 4, 0), 5};
  std::vector<Comparison> runs{hand.comparison, hand.comparison};
  for (std::size_t r = 0; r < 2; ++r) {
    // In the runs' cities the satellites are exchanged.
    runs[r].satellites[0].clear = false;
    runs[r].satellites[1].clear = true;
    runs[r].satellites[0].prediction = ComparedSatellite::Prediction{PathKind::Diffuse, 0, 1};
    runs[r].satellites[0].simulated.tracked = true;
    runs[r].satellites[0].simulated.error_m = 1.0 + static_cast<double>(r);
    runs[r].satellites[0].simulated.cn0_dbhz = 30;
    runs[r].epochs[0].fix.simulated = {true, Eigen::Vector3d(r == 0 ? 6 : 12, 0, 0), 6};
  }
  runs[1].satellites[1].simulated.tracked = true;
  runs[1].satellites[1].simulated.error_m = 9;
  const ModelMetrics f = metrics(hand.comparison, 0, 1, "all", Hand::no_intervals(), runs);
  EXPECT_EQ(f.runs, 2U);
  EXPECT_EQ(f.error_los_m.simulated.n, 2U);
  EXPECT_DOUBLE_EQ(f.error_los_m.simulated.at[2], 1.5);
  EXPECT_EQ(f.error_nlos_m.simulated.n, 1U);
  EXPECT_EQ(f.error_los_m.measured.n, 1U);
  EXPECT_EQ(f.tracked_los.simulated, 1U);
  EXPECT_EQ(f.tracked_los.satellites, 1U);
  EXPECT_EQ(f.tracked_nlos.simulated, 1U);  // half of two runs, rounded
  EXPECT_EQ(f.explained.back().n, 1U);
  EXPECT_DOUBLE_EQ(*f.explained.back().median_difference_m, 2);
  EXPECT_EQ(f.position.simulated.epochs, 2U);
  EXPECT_DOUBLE_EQ(f.position.simulated.horizontal_m[2], 9);
  EXPECT_DOUBLE_EQ(f.position.simulated.mean_used, 6);
  EXPECT_DOUBLE_EQ(f.position.measured.horizontal_m[2], 5);
}

/// Options of intervals, and the interval of a statistic of clear and other satellites' values by its
/// definition.
MetricOptions few_resamples() {
  MetricOptions options;
  options.block_s = 20;
  options.resamples = 200;
  options.seed = 3;
  return options;
}
template <typename Value, typename Statistic>
std::optional<Interval> bootstrap(const Comparison& comparison, const Value& value,
                                  const Statistic& statistic) {
  const auto of = [&](std::span<const std::size_t> sampled) -> std::optional<double> {
    std::vector<double> los, nlos;
    for (const std::size_t e : sampled) {
      const ComparedEpoch& epoch = comparison.epochs[e];
      for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
        const ComparedSatellite& s = comparison.satellites[i];
        (s.clear ? los : nlos).push_back(*value(s.measured));
      }
    }
    return statistic(los, nlos);
  };
  const MetricOptions options = few_resamples();
  return test::bootstrap_interval(comparison.epochs.size(), of, {options.resamples, 0.95, 20, options.seed});
}

TEST(ModelMetrics, IntervalsAreThoseOfTheBootstrap) {
  const Hand hand = random_comparison();
  const ModelMetrics f = hand.metrics(few_resamples());
  const auto interval = bootstrap(
      hand.comparison, [](const auto& s) { return s.error_m; },
      [](const auto& los, const auto& nlos) {
        const auto found = separation(nlos, los);
        return found ? std::optional(found->auc) : std::nullopt;
      });
  ASSERT_TRUE(f.by_error_interval && interval);
  EXPECT_NEAR(f.by_error_interval->low, interval->low, 1e-12);
  EXPECT_NEAR(f.by_error_interval->high, interval->high, 1e-12);
  EXPECT_LT(f.by_error_interval->low, f.by_error->auc);
  EXPECT_GT(f.by_error_interval->high, f.by_error->auc);
  EXPECT_TRUE(f.by_cn0_interval);
}

const KeyMetric& headline(const std::vector<KeyMetric>& all, const std::string& key) {
  const auto at =
      std::find_if(all.begin(), all.end(), [&key](const KeyMetric& h) { return h.info.key == key; });
  if (at == all.end()) throw std::out_of_range(key);
  return *at;
}

TEST(Headlines, ByHand) {
  Hand hand;
  hand.epoch();
  for (const double cn0 : {40.0, 42.0, 47.0}) hand.measured(true, 1, cn0).simulated.tracked = true;
  hand.measured(false, 20, 30);
  hand.satellite(false);
  for (std::size_t i = 0; i < 2; ++i) {
    hand.comparison.satellites[i].simulated.error_m = 1;
    hand.comparison.satellites[i].simulated.cn0_dbhz = 44;
  }
  hand.comparison.epochs[0].fix.measured = {true, {3, 4, 100}, 7};
  hand.comparison.epochs[0].fix.simulated = {true, {0, 2, 1}, 8};
  const std::vector<KeyMetric> all = key_metrics(hand.metrics());
  EXPECT_EQ(headline(all, "horizontal_p50_m").measured, 5);
  EXPECT_EQ(headline(all, "horizontal_p95_m").simulated, 2);
  EXPECT_EQ(headline(all, "tracked_los").simulated, 1);
  EXPECT_EQ(headline(all, "tracked_nlos").measured, 0.5);
  EXPECT_EQ(headline(all, "cn0_los_dbhz").measured, 42);
  EXPECT_EQ(headline(all, "cn0_los_dbhz").simulated, 44);
  EXPECT_EQ(headline(all, "cn0_los_less_nlos_db").measured, 12);
  EXPECT_FALSE(headline(all, "cn0_los_less_nlos_db").simulated);
  EXPECT_NEAR(*headline(all, "ks_cn0_los").simulated, 2.0 / 3, 1e-12);  // below 44: two of three against none
  EXPECT_EQ(headline(all, "satellites_used").simulated, 8);
  EXPECT_FALSE(headline(all, "spearman").simulated);
  EXPECT_EQ(all.size(), key_metrics(ModelMetrics{}).size());
  const std::vector<KeyMetric> direct = key_metrics(hand.comparison, 0, 1);
  ASSERT_EQ(direct.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(direct[i].measured, all[i].measured) << all[i].info.key;
    EXPECT_EQ(direct[i].simulated, all[i].simulated) << all[i].info.key;
  }
}

TEST(Headlines, IntervalsAreThoseOfTheBootstrap) {
  const Hand hand = random_comparison();
  std::vector<KeyMetric> all = key_metrics(hand.metrics());
  add_intervals(all, hand.comparison, 0, hand.comparison.epochs.size(), few_resamples());
  const auto interval = bootstrap(
      hand.comparison, [](const auto& s) { return s.cn0_dbhz; },
      [](const auto& los, const auto& nlos) { return *median(los) - *median(nlos); });
  const KeyMetric& h = headline(all, "cn0_los_less_nlos_db");
  ASSERT_TRUE(h.measured_interval && interval);
  EXPECT_NEAR(h.measured_interval->low, interval->low, 1e-12);
  EXPECT_NEAR(h.measured_interval->high, interval->high, 1e-12);
  EXPECT_FALSE(h.simulated_interval);
}

// One epoch a second and one every fifth of a second: a second counts once.
TEST(Pool, ObservationsOfAllAndNoSecondTwice) {
  Hand slow, fast;
  for (int e = 0; e < 3; ++e) {
    slow.epoch();
    slow.measured(true, e, 40);
    slow.measured(false, 10 + e, 30);
  }
  for (int e = 0; e < 11; ++e) {
    fast.epoch().time = slow.comparison.epochs[0].time + 0.2 * e;
    fast.measured(true, 100 + e, 45);
  }
  std::vector<Comparison> runs(2, slow.comparison);
  runs[1].satellites[2].simulated.tracked = true;
  const std::array<PooledPart, 2> parts{PooledPart{&slow.comparison, 1, 2, runs},
                                        PooledPart{&fast.comparison, 0, 11, {}}};
  const Pooled pooled = pool(parts);
  ASSERT_EQ(pooled.comparison.epochs.size(), 5U);
  const ModelMetrics f = metrics(pooled.comparison, 0, 5, "all", Hand::no_intervals(), pooled.runs);
  EXPECT_EQ(f.runs, 2U);
  EXPECT_EQ(f.los, 5U);
  EXPECT_EQ(f.nlos, 2U);
  // 1, 2 and, each second, 100, 105, 110.
  EXPECT_DOUBLE_EQ(f.error_los_m.measured.at[2], 100);
  EXPECT_EQ(f.tracked_los.satellites, 5U);
  EXPECT_TRUE(pooled.runs[1].satellites[0].simulated.tracked);
  EXPECT_FALSE(pooled.runs[0].satellites[0].simulated.tracked);
}

TEST(Headlines, ByAnotherPartOfTheRecording) {
  Hand hand;
  for (int e = 0; e < 4; ++e) {
    hand.epoch();
    hand.measured(true, e < 2 ? 0.1 * e : 5 + e, e < 2 ? 40 : 50);
    hand.measured(false, 20, 30);
    if (e < 2) hand.satellite(true);  // not tracked
    ComparedEpoch& epoch = hand.comparison.epochs.back();
    epoch.fix.measured = {true, Eigen::Vector3d(e < 2 ? 3 : 8, 0, 0), e < 2 ? 7 : 9};
    epoch.fix.simulated = {true, Eigen::Vector3d(99, 0, 0), 1};
  }
  const std::vector<KeyMetric> found = headlines_by_other_part(hand.comparison, 2, 2, 0, 2);
  const auto of = [&found](const std::string& key) {
    return *std::find_if(found.begin(), found.end(),
                         [&key](const KeyMetric& h) { return h.info.key == key; });
  };
  EXPECT_DOUBLE_EQ(*of("tracked_los").measured, 1);
  EXPECT_DOUBLE_EQ(*of("tracked_los").simulated, 0.5);
  EXPECT_DOUBLE_EQ(*of("cn0_los_less_nlos_db").measured, 20);
  EXPECT_DOUBLE_EQ(*of("cn0_los_less_nlos_db").simulated, 10);
  EXPECT_DOUBLE_EQ(*of("horizontal_p50_m").measured, 8);
  EXPECT_DOUBLE_EQ(*of("horizontal_p50_m").simulated, 3);
  EXPECT_DOUBLE_EQ(*of("satellites_used").simulated, 7);
  EXPECT_DOUBLE_EQ(*of("ks_cn0_los").simulated, 1);
  EXPECT_DOUBLE_EQ(*of("ks_cn0_nlos").simulated, 0);
  EXPECT_DOUBLE_EQ(*of("ks_error_los").simulated, 1);
  EXPECT_DOUBLE_EQ(*of("ks_error_nlos").simulated, 0);
  EXPECT_FALSE(of("spearman").simulated);
  EXPECT_FALSE(of("median_difference_m").simulated);
}

TEST(RecordingTable, RowsAndTheirIntervals) {
  RecordingRow tst{"tst", "mass market", {}, "second half", "never tracked: C07", "{}", {}};
  KeyMetric p50{{"p50_m", "p50 [m]", 1, MetricInfo::Kind::Pair}, 8.46, 1.54, Interval{6, 9}, Interval{1, 2}};
  const KeyMetric ks{{"ks", "KS", 2}, {}, 0.156, {}, Interval{0.1, 0.2}};
  tst.key_metrics = {p50, ks};
  RecordingRow berlin{"berlin", "mass market", {}, "all", "", R"({"models": []})", {}};
  p50.measured.reset();
  berlin.key_metrics = {p50};
  RecordingRow both{"all mass market", "mass market", {ks}, "", "", "", {"tst", "berlin"}};
  const std::vector<RecordingRow> rows{tst, berlin, both};
  const std::string table = to_text(rows);
  EXPECT_THAT(table, HasSubstr("recording        p50 [m]                  KS\n"
                               "tst              1.5 (8.5)                0.16\n"
                               "95 %             1.0 to 2.0 (6.0 to 9.0)  0.10 to 0.20\n"
                               "berlin           1.5 (-)                  -\n"));
  EXPECT_THAT(table, HasSubstr("all mass market  -                        0.16\n"));
  EXPECT_THAT(table, HasSubstr("- tst (mass market): second half; never tracked: C07\n"));
  EXPECT_THAT(table, HasSubstr("observations of tst, berlin pooled"));
  const json j = json::parse(to_json(rows));
  EXPECT_EQ(j["recordings"].size(), 2U);
  EXPECT_DOUBLE_EQ(j["recordings"][0]["headlines"]["p50_m"]["measured"], 8.46);
  EXPECT_TRUE(j["recordings"][1]["headlines"]["p50_m"]["measured"].is_null());
  EXPECT_TRUE(j["recordings"][1]["models"].is_array());
  EXPECT_EQ(j["classes"][0]["recordings"][1], "berlin");
  EXPECT_DOUBLE_EQ(j["classes"][0]["headlines"]["ks"]["interval_95"][1], 0.2);
}

TEST(ModelMetrics, NothingGivesNothing) {
  Hand hand;
  const ModelMetrics none = hand.metrics();
  EXPECT_EQ(none.epochs, 0U);
  EXPECT_FALSE(none.by_cn0);
  // An epoch whose errors have no clock, and a measured satellite without C/N0.
  hand.epoch().clock = ClockSource::None;
  hand.satellite(true).measured.tracked = true;
  const ModelMetrics f = hand.metrics();
  EXPECT_EQ(f.los, 0U);
  EXPECT_EQ(f.tracked_los.measured, 1U);
  EXPECT_FALSE(f.explained.back().median_difference_m);
}

/// Whether a non-number was printed.
void expect_no_nan(const std::string& text) {
  for (const char* word : {"nan", "NaN", "inf", "-inf"}) {
    const std::size_t at = text.find(word);
    // "inf" is not part of a word that is used.
    EXPECT_EQ(at, std::string::npos) << text.substr(at == std::string::npos ? 0 : at, 40);
  }
}

TEST(ModelMetrics, TextsOfFullAndEmpty) {
  Hand hand = random_comparison();
  hand.comparison.name = "a \"quoted\" | name";
  hand.comparison.segments = {{0, 300, 300, 90}};
  const ModelMetrics full = hand.metrics();
  const ModelMetrics empty = Hand().metrics();

  CityAlignment alignment;
  alignment.registration.east_m = 1.25;
  alignment.registration.heading_rad = geodesy::radians(2);
  alignment.score = kNan;  // never printed as such
  const std::string text = to_json({full, empty}, to_json(alignment));
  expect_no_nan(text);
  const json parsed = json::parse(text);
  EXPECT_EQ(parsed.at("alignment").at("east_m"), 1.25);
  EXPECT_NEAR(parsed.at("alignment").at("heading_deg").get<double>(), 2, 1e-12);
  EXPECT_TRUE(parsed.at("alignment").at("score").is_null());
  ASSERT_EQ(parsed.at("models").size(), 2U);
  const json& first = parsed.at("models")[0];
  EXPECT_EQ(first.at("model"), hand.comparison.name);
  EXPECT_EQ(first.at("separation_by_error").at("auc"), full.by_error->auc);
  EXPECT_EQ(first.at("separation_by_cn0").at("threshold_dbhz"), -full.by_cn0->threshold);
  EXPECT_EQ(first.at("distributions").at("los_error_m").at("measured").at("p50"),
            full.error_los_m.measured.at[2]);
  EXPECT_TRUE(first.at("distributions").at("los_error_m").at("simulated").at("p50").is_null());
  EXPECT_EQ(first.at("tracked").at("nlos").at("measured_ratio"), 1);
  EXPECT_EQ(first.at("segments").size(), 1U);
  const json& second = parsed.at("models")[1];
  EXPECT_TRUE(second.at("separation_by_cn0").is_null());
  EXPECT_TRUE(second.at("tracked").at("los").at("measured_ratio").is_null());
  EXPECT_TRUE(second.at("position").at("measured").at("horizontal_error_m").at("p95").is_null());
  EXPECT_FALSE(json::parse(to_json({full}, {})).contains("alignment"));

  for (const ModelMetrics& f : {full, empty}) expect_no_nan(to_text(f));
  EXPECT_THAT(to_text(full), HasSubstr("AUC"));

  const std::string table = models_table({full, empty});
  expect_no_nan(table);
  EXPECT_THAT(table, HasSubstr(hand.comparison.name));
}

}  // namespace
}  // namespace canyon::validation
