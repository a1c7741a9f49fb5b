#include "adapters/common/msgs/gnss_message.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "adapters/common/testing/sample_report.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "tests/support/carried_columns.hpp"

namespace canyon::adapters {
namespace {

using canyon::test::sample_identity;
using canyon::test::SampleReport;
using ::testing::ElementsAre;

const msgs::GnssSatellite& satellite(const msgs::GnssReceiver& message, const std::string& id) {
  for (const auto& s : message.satellites()) {
    if (s.id() == id) return s;
  }
  throw std::runtime_error("no satellite " + id);
}

/// Names of the fields, including nested messages, that never have a value.
void note_fields(const google::protobuf::Message& message, std::set<std::string>& all,
                 std::set<std::string>& seen) {
  const auto& reflection = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const auto* field = message.GetDescriptor()->field(i);
    all.insert(field->full_name());
    const int size = field->is_repeated() ? reflection.FieldSize(message, field) : 0;
    if (size > 0 || (!field->is_repeated() && reflection.HasField(message, field))) {
      seen.insert(field->full_name());
    }
    if (field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) continue;
    for (int j = 0; j < size; ++j) note_fields(reflection.GetRepeatedMessage(message, field, j), all, seen);
    if (!field->is_repeated()) note_fields(reflection.GetMessage(message, field), all, seen);
  }
}

TEST(GnssMessage, FillsEveryFieldButTheDocumentedOnes) {
  const SampleReport sample;
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), sample.report, message);
  std::set<std::string> all, seen;
  note_fields(message, all, seen);
  for (const auto& name : seen) all.erase(name);
  EXPECT_THAT(
      all,
      ElementsAre("canyon.msgs.GnssBaseline.ambiguity_ratio", "canyon.msgs.GnssBaseline.covariance_enu_m2",
                  "canyon.msgs.GnssBaseline.fixed", "canyon.msgs.GnssBaseline.heading_rad",
                  "canyon.msgs.GnssBaseline.heading_sigma_rad", "canyon.msgs.GnssBaseline.moving_base",
                  "canyon.msgs.GnssBaseline.vector_enu_m", "canyon.msgs.GnssFix.baseline",
                  "canyon.msgs.GnssFix.correction_age_s", "canyon.msgs.GnssFix.correction_station",
                  "canyon.msgs.GnssFix.wrong_fix", "canyon.msgs.GnssReceiver.reason"));
}

double clock_bias(const msgs::GnssReceiver& message, msgs::GnssSystem system) {
  for (const auto& bias : message.fix().clock_biases()) {
    if (bias.system() == system) return bias.bias_s();
  }
  return NAN;
}

// The columns of epochs.csv that are in the message, and those that are not.
TEST(GnssMessage, SaysWhatItLacksOfEpochs) {
  using M = msgs::GnssReceiver;
  const test::Carried<M> carried{
      {"gps_week", [](const M& m) -> test::ReportedValue { return 1.0 * m.gps_week(); }},
      {"gps_tow",
       [](const M& m) -> test::ReportedValue { return 1e-9 * static_cast<double>(m.gps_time_of_week_ns()); }},
      {"true_latitude_deg", [](const M& m) -> test::ReportedValue { return m.antenna().latitude_deg(); }},
      {"true_longitude_deg", [](const M& m) -> test::ReportedValue { return m.antenna().longitude_deg(); }},
      {"true_height_m", [](const M& m) -> test::ReportedValue { return m.antenna().height_m(); }},
      {"status",
       [](const M& m) -> test::ReportedValue { return std::string(m.state() == M::FIX ? "fix" : "no fix"); }},
      {"reason", [](const M& m) -> test::ReportedValue { return m.reason(); }},
      {"fix_latitude_deg",
       [](const M& m) -> test::ReportedValue { return m.fix().position().latitude_deg(); }},
      {"fix_longitude_deg",
       [](const M& m) -> test::ReportedValue { return m.fix().position().longitude_deg(); }},
      {"fix_height_m", [](const M& m) -> test::ReportedValue { return m.fix().position().height_m(); }},
      {"error_east_m", [](const M& m) -> test::ReportedValue { return m.fix().error_enu_m().east(); }},
      {"error_north_m", [](const M& m) -> test::ReportedValue { return m.fix().error_enu_m().north(); }},
      {"error_up_m", [](const M& m) -> test::ReportedValue { return m.fix().error_enu_m().up(); }},
      {"gdop", [](const M& m) -> test::ReportedValue { return m.fix().dop().gdop(); }},
      {"pdop", [](const M& m) -> test::ReportedValue { return m.fix().dop().pdop(); }},
      {"hdop", [](const M& m) -> test::ReportedValue { return m.fix().dop().hdop(); }},
      {"vdop", [](const M& m) -> test::ReportedValue { return m.fix().dop().vdop(); }},
      {"tdop", [](const M& m) -> test::ReportedValue { return m.fix().dop().tdop(); }},
      {"tracked", [](const M& m) -> test::ReportedValue { return 1.0 * m.visible(); }},
      {"not_tracked", [](const M& m) -> test::ReportedValue { return 1.0 * m.blocked(); }},
      {"used", [](const M& m) -> test::ReportedValue { return 1.0 * m.fix().used_size(); }},
      {"placement", [](const M& m) -> test::ReportedValue { return static_cast<double>(m.placement()); }},
      {"true_velocity_east_mps",
       [](const M& m) -> test::ReportedValue { return m.antenna_velocity_enu_mps().east(); }},
      {"true_velocity_north_mps",
       [](const M& m) -> test::ReportedValue { return m.antenna_velocity_enu_mps().north(); }},
      {"true_velocity_up_mps",
       [](const M& m) -> test::ReportedValue { return m.antenna_velocity_enu_mps().up(); }},
      {"fix_velocity_east_mps",
       [](const M& m) -> test::ReportedValue { return m.fix().velocity_enu_mps().east(); }},
      {"fix_velocity_north_mps",
       [](const M& m) -> test::ReportedValue { return m.fix().velocity_enu_mps().north(); }},
      {"fix_velocity_up_mps",
       [](const M& m) -> test::ReportedValue { return m.fix().velocity_enu_mps().up(); }},
      {"sigma_east_m",
       [](const M& m) -> test::ReportedValue { return std::sqrt(m.fix().covariance_enu_m2(0)); }},
      {"sigma_north_m",
       [](const M& m) -> test::ReportedValue { return std::sqrt(m.fix().covariance_enu_m2(4)); }},
      {"sigma_up_m",
       [](const M& m) -> test::ReportedValue { return std::sqrt(m.fix().covariance_enu_m2(8)); }},
      {"covariance_east_north_m2",
       [](const M& m) -> test::ReportedValue { return m.fix().covariance_enu_m2(1); }},
      {"covariance_east_up_m2",
       [](const M& m) -> test::ReportedValue { return m.fix().covariance_enu_m2(2); }},
      {"covariance_north_up_m2",
       [](const M& m) -> test::ReportedValue { return m.fix().covariance_enu_m2(5); }},
      {"clock_gps_s", [](const M& m) -> test::ReportedValue { return clock_bias(m, msgs::GPS); }},
      {"clock_glonass_s", [](const M& m) -> test::ReportedValue { return clock_bias(m, msgs::GLONASS); }},
      {"clock_galileo_s", [](const M& m) -> test::ReportedValue { return clock_bias(m, msgs::GALILEO); }},
      {"clock_beidou_s", [](const M& m) -> test::ReportedValue { return clock_bias(m, msgs::BEIDOU); }},
      {"clock_qzss_s", [](const M& m) -> test::ReportedValue { return clock_bias(m, msgs::QZSS); }},
      {"excluded", [](const M& m) -> test::ReportedValue { return 1.0 * m.fix().excluded_size(); }},
      {"consistent", [](const M& m) -> test::ReportedValue { return m.fix().consistent() ? 1.0 : 0.0; }},
      {"faults",
       [](const M& m) -> test::ReportedValue {
         return encoding::fault_names({m.faults().begin(), m.faults().end()});
       }},
      {"clock_bias_s", [](const M& m) -> test::ReportedValue { return m.clock_bias_s(); }},
      {"clock_drift", [](const M& m) -> test::ReportedValue { return m.clock_drift(); }},
      {"fix_kind", [](const M& m) -> test::ReportedValue { return static_cast<double>(m.fix().kind()); }},
      {"correction_age_s", [](const M& m) -> test::ReportedValue { return m.fix().correction_age_s(); }},
      {"baseline_kind",
       [](const M& m) -> test::ReportedValue {
         return static_cast<double>(m.fix().baseline().fixed() ? msgs::GnssFix::FIXED : msgs::GnssFix::FLOAT);
       }},
      {"ambiguity_ratio",
       [](const M& m) -> test::ReportedValue { return m.fix().baseline().ambiguity_ratio(); }},
      {"baseline_east_m",
       [](const M& m) -> test::ReportedValue { return m.fix().baseline().vector_enu_m().east(); }},
      {"baseline_north_m",
       [](const M& m) -> test::ReportedValue { return m.fix().baseline().vector_enu_m().north(); }},
      {"baseline_up_m",
       [](const M& m) -> test::ReportedValue { return m.fix().baseline().vector_enu_m().up(); }},
      {"heading_deg",
       [](const M& m) -> test::ReportedValue { return geodesy::degrees(m.fix().baseline().heading_rad()); }},
      {"heading_sigma_deg",
       [](const M& m) -> test::ReportedValue {
         return geodesy::degrees(m.fix().baseline().heading_sigma_rad());
       }},
      {"wrong_fix", [](const M& m) -> test::ReportedValue { return m.fix().wrong_fix() ? 1.0 : 0.0; }},
  };
  const std::set<std::string> lacks{"rating",
                                    "error_horizontal_m",
                                    "fusion",
                                    "vehicle_heading_deg",
                                    "vehicle_heading_sigma_deg",
                                    "velocity_covariance_east_m2ps2",
                                    "velocity_covariance_east_north_m2ps2",
                                    "velocity_covariance_east_up_m2ps2",
                                    "velocity_covariance_north_m2ps2",
                                    "velocity_covariance_north_up_m2ps2",
                                    "velocity_covariance_up_m2ps2"};
  SampleReport sample;
  sample.step.epoch = test::with_baseline(test::corrected(sample.step.epoch, positioning::FixKind::Fixed),
                                          positioning::FixKind::Fixed, true);
  M message;
  fill_gnss_message(sample_identity(), sample.report, message);
  test::expect_carried(encoding::TableKind::Epochs, sample.step.epoch, message, carried, lacks);
}

// Week and second of the week are in the enclosing message, residuals in the fix.
TEST(GnssMessage, SaysWhatItLacksOfSatellites) {
  using S = msgs::GnssSatellite;
  const test::Carried<S> carried{
      {"sat", [](const S& s) -> test::ReportedValue { return s.id(); }},
      {"azimuth_deg", [](const S& s) -> test::ReportedValue { return geodesy::degrees(s.azimuth_rad()); }},
      {"elevation_deg",
       [](const S& s) -> test::ReportedValue { return geodesy::degrees(s.elevation_rad()); }},
      {"visibility", [](const S& s) -> test::ReportedValue { return static_cast<double>(s.visibility()); }},
      {"excess_path_m", [](const S& s) -> test::ReportedValue { return s.excess_m(); }},
      {"pseudorange_m", [](const S& s) -> test::ReportedValue { return s.pseudorange_m(); }},
      {"pseudorange_error_m", [](const S& s) -> test::ReportedValue { return s.pseudorange_error_m(); }},
      {"noise_m", [](const S& s) -> test::ReportedValue { return s.noise_m(); }},
      {"used", [](const S& s) -> test::ReportedValue { return s.used() ? 1.0 : 0.0; }},
      {"above_mask", [](const S& s) -> test::ReportedValue { return s.above_mask() ? 1.0 : 0.0; }},
      {"doppler_hz", [](const S& s) -> test::ReportedValue { return s.doppler_hz(); }},
      {"carrier_frequency_hz", [](const S& s) -> test::ReportedValue { return s.carrier_frequency_hz(); }},
      {"sigma_m", [](const S& s) -> test::ReportedValue { return s.sigma_m(); }},
      {"cn0_dbhz", [](const S& s) -> test::ReportedValue { return s.cn0_dbhz(); }},
      {"true_cn0_dbhz", [](const S& s) -> test::ReportedValue { return s.true_cn0_dbhz(); }},
      {"lock", [](const S& s) -> test::ReportedValue { return static_cast<double>(s.lock()); }},
      {"carrier_phase_cycles", [](const S& s) -> test::ReportedValue { return s.carrier_phase_cycles(); }},
      {"phase_lock_s", [](const S& s) -> test::ReportedValue { return s.phase_lock_s(); }},
      {"excluded", [](const S& s) -> test::ReportedValue { return s.excluded() ? 1.0 : 0.0; }},
  };
  const std::set<std::string> lacks{"gps_week", "gps_tow",        "residual_m",   "cycle_slip",
                                    "signal",   "map_visibility", "obstacles_db", "tracked_path"};
  const SampleReport sample;
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), sample.report, message);
  test::expect_carried(encoding::TableKind::Satellites, sample.step.epoch, message.satellites(0), carried,
                       lacks);
}

// Points are those of the city if the world's axes are east and north.
TEST(GnssMessage, SaysWhatItLacksOfPaths) {
  using P = msgs::GnssPath;
  static const auto of = [](const P& p) {
    return geodesy::enu_from_azimuth_elevation(p.arrival_azimuth_rad(), p.arrival_elevation_rad());
  };
  const test::Carried<P> carried{
      {"kind", [](const P& p) -> test::ReportedValue { return static_cast<double>(p.kind()); }},
      {"excess_path_m", [](const P& p) -> test::ReportedValue { return p.excess_m(); }},
      {"point_east_m", [](const P& p) -> test::ReportedValue { return p.reflection_point_world_m().x(); }},
      {"point_north_m", [](const P& p) -> test::ReportedValue { return p.reflection_point_world_m().y(); }},
      {"point_up_m", [](const P& p) -> test::ReportedValue { return p.reflection_point_world_m().z(); }},
      {"far_point_east_m",
       [](const P& p) -> test::ReportedValue { return p.far_reflection_point_world_m().x(); }},
      {"far_point_north_m",
       [](const P& p) -> test::ReportedValue { return p.far_reflection_point_world_m().y(); }},
      {"far_point_up_m",
       [](const P& p) -> test::ReportedValue { return p.far_reflection_point_world_m().z(); }},
      {"arrival_east", [](const P& p) -> test::ReportedValue { return of(p).x(); }},
      {"arrival_north", [](const P& p) -> test::ReportedValue { return of(p).y(); }},
      {"arrival_up", [](const P& p) -> test::ReportedValue { return of(p).z(); }},
      {"incidence_deg",
       [](const P& p) -> test::ReportedValue { return geodesy::degrees(p.incidence_rad()); }},
  };
  const std::set<std::string> lacks{"gps_week", "gps_tow",   "sat",       "path",     "order",
                                    "loss_db",  "phase_deg", "reflector", "material", "far_material"};
  SampleReport sample;
  sample.report.world_yaw_from_enu_rad = 0;
  sample.step.epoch.arrival = &sample.step.arrival;
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), sample.report, message);
  std::size_t before = 0;
  for (const auto& s : message.satellites()) {
    if (s.id() == "G17") break;
    before += static_cast<std::size_t>(s.paths_size());
  }
  test::expect_carried(encoding::TableKind::Paths, sample.step.epoch, satellite(message, "G17").paths(0),
                       carried, lacks, 1e-12, before);
}

// Numbers are those of SampleReport and tests/support/sample_epochs.hpp.
TEST(GnssMessage, CarriesTruthAndTime) {
  const SampleReport sample;
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), sample.report, message);
  EXPECT_EQ(message.sim_time_ns(), 12'345'678'901);
  EXPECT_EQ(message.state(), msgs::GnssReceiver::FIX);
  EXPECT_FALSE(message.has_reason());
  EXPECT_EQ(message.model(), "iris");
  EXPECT_EQ(message.link(), "iris::gps0::link");
  EXPECT_EQ(message.sensor(), "gps");
  EXPECT_EQ(message.gps_week(), 2051);
  EXPECT_EQ(message.gps_time_of_week_ns(), 46'701'000'000'000);
  EXPECT_NEAR(message.antenna().latitude_deg(), 22.298251, 1e-12);
  EXPECT_NEAR(message.antenna().longitude_deg(), 114.178761, 1e-12);
  EXPECT_DOUBLE_EQ(message.antenna().height_m(), 12.345);
  EXPECT_EQ(message.antenna_velocity_enu_mps().east(), 3.0);
  EXPECT_EQ(message.antenna_velocity_enu_mps().north(), -4.0);
  EXPECT_EQ(message.antenna_velocity_enu_mps().up(), 0.5);
  EXPECT_EQ(message.antenna_world_m().x(), 10.5);
  EXPECT_EQ(message.antenna_world_m().y(), -20.25);
  EXPECT_EQ(message.antenna_world_m().z(), 2.125);
  EXPECT_EQ(message.link_attitude_world().w(), 0.5);
  EXPECT_EQ(message.link_attitude_world().x(), -0.5);
  EXPECT_EQ(message.link_attitude_world().z(), 0.5);
  EXPECT_EQ(message.placement(), msgs::GnssReceiver::FREE);
  EXPECT_EQ(message.clock_bias_s(), 1.5e-4);
  EXPECT_EQ(message.clock_drift(), 2.5e-8);
  EXPECT_EQ(message.visible(), 10U);
  EXPECT_EQ(message.blocked(), 1U);
  EXPECT_EQ(message.scan_max_range_m(), 150);
  ASSERT_EQ(message.scan_ranges_m_size(), 24);
  EXPECT_EQ(message.scan_ranges_m(0), 0.5);
  EXPECT_TRUE(std::isinf(message.scan_ranges_m(1)));
  EXPECT_EQ(message.scan_ranges_m(23), 23.5);
}

TEST(GnssMessage, CarriesTheFix) {
  const SampleReport sample;
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), sample.report, message);
  const msgs::GnssFix& fix = message.fix();
  EXPECT_EQ(fix.status(), msgs::GnssFix::FIX);
  EXPECT_EQ(fix.reason(), "solved");
  EXPECT_EQ(fix.kind(), msgs::GnssFix::SINGLE);
  EXPECT_FALSE(fix.has_correction_age_s() || fix.has_correction_station());
  EXPECT_EQ(fix.available(), 11U);
  const auto& solved = sample.step.epoch.observed.fix;
  EXPECT_DOUBLE_EQ(fix.position().latitude_deg(), geodesy::degrees(solved.position.latitude_rad));
  EXPECT_DOUBLE_EQ(fix.position().longitude_deg(), geodesy::degrees(solved.position.longitude_rad));
  EXPECT_DOUBLE_EQ(fix.position().height_m(), solved.position.height_m);
  EXPECT_THAT(fix.covariance_enu_m2(), ElementsAre(4.0, 1.5, 0.2, 1.5, 2.25, 0.1, 0.2, 0.1, 9.0));
  EXPECT_EQ(fix.velocity_enu_mps().east(), 3.1);
  EXPECT_EQ(fix.velocity_enu_mps().north(), -4.2);
  EXPECT_EQ(fix.velocity_enu_mps().up(), 0.4);
  EXPECT_THAT(fix.velocity_covariance_enu_m2ps2(),
              ElementsAre(0.01, 0.001, 0.002, 0.001, 0.02, 0.003, 0.002, 0.003, 0.03));
  EXPECT_EQ(fix.dop().gdop(), 2.5);
  EXPECT_EQ(fix.dop().pdop(), 2.1);
  EXPECT_EQ(fix.dop().hdop(), 1.25);
  EXPECT_EQ(fix.dop().vdop(), 1.6875);
  EXPECT_EQ(fix.dop().tdop(), 1.356);
  ASSERT_EQ(fix.clock_biases_size(), 5);
  EXPECT_EQ(fix.clock_biases(0).system(), msgs::GPS);
  EXPECT_EQ(fix.clock_biases(0).bias_s(), 1.2345e-4);
  EXPECT_EQ(fix.clock_biases(1).system(), msgs::GLONASS);
  EXPECT_EQ(fix.clock_biases(1).bias_s(), 1.25e-4);
  EXPECT_EQ(fix.clock_biases(4).system(), msgs::QZSS);
  EXPECT_EQ(fix.clock_drift(), 2.625e-8);
  EXPECT_THAT(fix.used(), ElementsAre("G05", "G12", "G17", "R01", "R24", "E11", "C03", "C30", "J02"));
  EXPECT_EQ(fix.residuals_m_size(), 9);
  EXPECT_EQ(fix.error_enu_m().east(), 1.25);
  EXPECT_EQ(fix.error_enu_m().north(), -2.5);
  EXPECT_EQ(fix.error_enu_m().up(), 3.75);
}

TEST(GnssMessage, CarriesSatellitesAndTheirPaths) {
  const SampleReport sample;
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), sample.report, message);
  ASSERT_EQ(message.satellites_size(), 12);

  const auto& nlos = satellite(message, "G17");
  EXPECT_EQ(nlos.system(), msgs::GPS);
  EXPECT_EQ(nlos.number(), 17U);
  EXPECT_DOUBLE_EQ(nlos.azimuth_rad(), geodesy::radians(200));
  EXPECT_DOUBLE_EQ(nlos.elevation_rad(), geodesy::radians(15.5));
  EXPECT_EQ(nlos.visibility(), msgs::GnssSatellite::NLOS);
  EXPECT_TRUE(nlos.above_mask());
  EXPECT_TRUE(nlos.used());
  EXPECT_EQ(nlos.excess_m(), 35.25);
  EXPECT_DOUBLE_EQ(nlos.pseudorange_m(), 2.1e7 + 17 * 1000.12345 + 35.25);
  EXPECT_DOUBLE_EQ(nlos.doppler_hz(), -1234.5678 + 17);
  EXPECT_EQ(nlos.carrier_frequency_hz(), 1575.42e6);  // L1
  EXPECT_EQ(nlos.sigma_m(), 1.5);
  EXPECT_EQ(nlos.noise_m(), 0.25);
  EXPECT_EQ(nlos.pseudorange_error_m(), 35.5);
  ASSERT_EQ(nlos.paths_size(), 1);
  const auto& path = nlos.paths(0);
  EXPECT_EQ(path.kind(), msgs::GnssPath::REFLECTED);
  EXPECT_EQ(path.excess_m(), 35.25);
  EXPECT_NEAR(path.arrival_azimuth_rad(), 0.75, 1e-15);
  EXPECT_NEAR(path.arrival_elevation_rad(), 0.5, 1e-15);
  EXPECT_EQ(path.incidence_rad(), 0.625);
  // (12, -34) rotated by +0.5 rad about the vertical.
  EXPECT_NEAR(path.reflection_point_world_m().x(), 12 * std::cos(0.5) + 34 * std::sin(0.5), 1e-12);
  EXPECT_NEAR(path.reflection_point_world_m().y(), 12 * std::sin(0.5) - 34 * std::cos(0.5), 1e-12);
  EXPECT_EQ(path.reflection_point_world_m().z(), 5.6);
  // (-7.5, 21), rotated too.
  EXPECT_NEAR(path.far_reflection_point_world_m().x(), -7.5 * std::cos(0.5) - 21 * std::sin(0.5), 1e-12);
  EXPECT_NEAR(path.far_reflection_point_world_m().y(), -7.5 * std::sin(0.5) + 21 * std::cos(0.5), 1e-12);
  EXPECT_EQ(path.far_reflection_point_world_m().z(), 9.25);
  EXPECT_EQ(path.far_incidence_rad(), 0.375);

  const auto& los = satellite(message, "G05");
  EXPECT_EQ(los.visibility(), msgs::GnssSatellite::LOS);
  ASSERT_EQ(los.paths_size(), 1);
  EXPECT_EQ(los.paths(0).kind(), msgs::GnssPath::DIRECT);
  EXPECT_NEAR(los.paths(0).arrival_elevation_rad(), los.elevation_rad(), 1e-12);
  EXPECT_FALSE(los.paths(0).has_reflection_point_world_m());

  EXPECT_EQ(satellite(message, "G12").visibility(), msgs::GnssSatellite::LOS_MULTIPATH);
  const auto& blocked = satellite(message, "G31");
  EXPECT_EQ(blocked.visibility(), msgs::GnssSatellite::BLOCKED);
  EXPECT_FALSE(blocked.has_pseudorange_m());
  EXPECT_TRUE(std::isnan(blocked.pseudorange_m()));
  EXPECT_EQ(blocked.paths_size(), 0);
  EXPECT_FALSE(satellite(message, "G24").above_mask());
  EXPECT_FALSE(satellite(message, "E36").used());
  EXPECT_EQ(satellite(message, "R24").system(), msgs::GLONASS);
  EXPECT_EQ(satellite(message, "E11").system(), msgs::GALILEO);
  EXPECT_EQ(satellite(message, "C30").system(), msgs::BEIDOU);
  EXPECT_EQ(satellite(message, "J02").number(), 2U);
}

// Numbers are those of sample_signal_epoch().
TEST(GnssMessage, CarriesStrengthLockAndPhase) {
  SampleReport sample;
  auto& held = sample.step.epoch.observed.satellites[5];  // R01
  held.lock = tracking::LockState::Holding;
  held.measurement.reset();
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), sample.report, message);
  const auto& g05 = satellite(message, "G05");
  EXPECT_EQ(g05.cn0_dbhz(), 46.3);
  EXPECT_EQ(g05.true_cn0_dbhz(), 46.55);
  EXPECT_EQ(g05.lock(), msgs::GnssSatellite::TRACKING);
  EXPECT_NEAR(g05.carrier_phase_cycles(), 1239.5678, 1e-9);
  EXPECT_EQ(g05.phase_lock_s(), 12.5);
  EXPECT_FALSE(g05.excluded());
  EXPECT_EQ(satellite(message, "G12").cn0_dbhz(), 45.3);
  EXPECT_FALSE(satellite(message, "G12").has_carrier_phase_cycles());
  EXPECT_FALSE(satellite(message, "G12").has_phase_lock_s());
  const auto& searched = satellite(message, "G31");
  EXPECT_EQ(searched.lock(), msgs::GnssSatellite::SEARCHING);
  EXPECT_FALSE(searched.has_cn0_dbhz() || searched.has_true_cn0_dbhz());
  const auto& weak = satellite(message, "R01");
  EXPECT_EQ(weak.lock(), msgs::GnssSatellite::HOLDING);
  EXPECT_TRUE(weak.has_true_cn0_dbhz());
  EXPECT_FALSE(weak.has_cn0_dbhz());
  EXPECT_TRUE(satellite(message, "E36").excluded());
  EXPECT_THAT(message.fix().excluded(), ElementsAre("E36"));
  EXPECT_TRUE(message.fix().consistent());

  // Signals without strength: the fields are absent.
  const SampleReport plain(false);
  fill_gnss_message(sample_identity(), plain.report, message);
  EXPECT_TRUE(std::isnan(satellite(message, "G05").cn0_dbhz()));
  EXPECT_FALSE(satellite(message, "G05").has_carrier_phase_cycles());
  EXPECT_FALSE(message.fix().has_consistent());
}

TEST(GnssMessage, NamesEveryKindOfPathAndStatus) {
  SampleReport sample;
  propagation::Path& path = sample.step.arrival.views[2].paths.paths[0];  // G17
  path.order = 0;
  msgs::GnssReceiver message;
  for (const auto& [kind, code] : {std::pair{propagation::PathKind::Diffracted, msgs::GnssPath::DIFFRACTED},
                                   {propagation::PathKind::Diffuse, msgs::GnssPath::DIFFUSE}}) {
    path.kind = kind;
    fill_gnss_message(sample_identity(), sample.report, message);
    const auto& shown = satellite(message, "G17").paths(0);
    EXPECT_EQ(shown.kind(), code);
    EXPECT_EQ(shown.reflection_point_world_m().z(), 5.6);
    EXPECT_FALSE(shown.has_incidence_rad());
    EXPECT_FALSE(shown.has_far_reflection_point_world_m());
  }
  sample.step.epoch.observed.fix.status = positioning::FixStatus::WeakGeometry;
  fill_gnss_message(sample_identity(), sample.report, message);
  EXPECT_EQ(message.state(), msgs::GnssReceiver::NO_FIX);
  EXPECT_EQ(message.fix().status(), msgs::GnssFix::WEAK_GEOMETRY);
  EXPECT_EQ(message.fix().kind(), msgs::GnssFix::NONE);
}

TEST(GnssMessage, SaysWhatTheCorrectionsMadeOfTheFix) {
  SampleReport sample;
  positioning::Fix& fix = sample.step.epoch.observed.fix;
  fix.correction_age_s = 1.5;
  fix.correction_station = 7;
  msgs::GnssReceiver message;
  for (const auto& [solution, kind] :
       {std::pair{positioning::FixKind::Differential, msgs::GnssFix::DIFFERENTIAL},
        {positioning::FixKind::Float, msgs::GnssFix::FLOAT},
        {positioning::FixKind::Fixed, msgs::GnssFix::FIXED}}) {
    fix.solution = solution;
    fill_gnss_message(sample_identity(), sample.report, message);
    EXPECT_EQ(message.fix().kind(), kind);
    EXPECT_EQ(message.fix().correction_age_s(), 1.5);
    EXPECT_EQ(message.fix().correction_station(), 7U);
  }
  fix.solution = positioning::FixKind::Single;
  fix.fusion = positioning::Fusion{positioning::FusionPhase::Calibrating};
  fill_gnss_message(sample_identity(), sample.report, message);
  EXPECT_EQ(message.fix().kind(), msgs::GnssFix::COMBINED);
  fix.solution = positioning::FixKind::Fixed;
  fix.used.clear();
  fill_gnss_message(sample_identity(), sample.report, message);
  EXPECT_EQ(message.state(), msgs::GnssReceiver::PREDICTION);
  EXPECT_EQ(message.reason(), "prediction: no satellite is used");
  EXPECT_EQ(message.fix().kind(), msgs::GnssFix::DEAD_RECKONING);
  EXPECT_FALSE(message.fix().has_correction_age_s() || message.fix().has_correction_station());
}

TEST(GnssMessage, MatchesPathsToSatellitesByName) {
  SampleReport sample;
  auto& views = sample.step.arrival.views;
  views.erase(views.begin());  // G05's
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), sample.report, message);
  EXPECT_EQ(satellite(message, "G05").paths_size(), 0);
  ASSERT_EQ(satellite(message, "G17").paths_size(), 1);
  EXPECT_EQ(satellite(message, "G17").paths(0).kind(), msgs::GnssPath::REFLECTED);
}

TEST(GnssMessage, HasNoPositionWithoutFixAndNothingButNamesWithoutTruth) {
  const SampleReport good;
  SampleReport sample(false);
  sample.step.epoch.containment = raytrace::Containment::UnderTerrain;
  msgs::GnssReceiver message;
  fill_gnss_message(sample_identity(), good.report, message);  // old values must be cleared
  fill_gnss_message(sample_identity(), sample.report, message);
  EXPECT_EQ(message.state(), msgs::GnssReceiver::NO_FIX);
  EXPECT_EQ(message.reason(), "too few satellites");
  EXPECT_EQ(message.placement(), msgs::GnssReceiver::UNDER_TERRAIN);
  EXPECT_EQ(message.fix().status(), msgs::GnssFix::TOO_FEW_SATELLITES);
  EXPECT_FALSE(message.fix().has_position());
  EXPECT_TRUE(std::isnan(message.fix().position().latitude_deg()));
  EXPECT_EQ(message.fix().covariance_enu_m2_size(), 0);
  EXPECT_TRUE(std::isnan(message.fix().error_enu_m().east()));
  EXPECT_EQ(message.satellites_size(), 12);

  sample.report.step = nullptr;
  sample.report.reason = "no pose on /mocap for 1.5 s";
  fill_gnss_message(sample_identity(), sample.report, message);
  EXPECT_EQ(message.state(), msgs::GnssReceiver::NO_TRUTH);
  EXPECT_EQ(message.reason(), "no pose on /mocap for 1.5 s");
  EXPECT_EQ(message.sim_time_ns(), 12'345'678'901);
  EXPECT_EQ(message.link(), "iris::gps0::link");
  EXPECT_FALSE(message.has_antenna());
  EXPECT_FALSE(message.has_fix());
  EXPECT_FALSE(message.has_gps_week());
  EXPECT_EQ(message.satellites_size(), 0);
}

}  // namespace
}  // namespace canyon::adapters
