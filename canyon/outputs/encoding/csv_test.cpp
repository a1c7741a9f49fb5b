#include <gtest/gtest.h>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <map>
#include <set>

#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/outputs/encoding/sensor_arrays.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/outputs/encoding/view_tables.hpp"
#include "tests/support/documented.hpp"
#include "tests/support/sample_signals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding {
namespace {

using Record = std::map<std::string, std::string>;

/// Names of the columns that a table's CSV file has.
std::vector<std::string> csv_columns(TableKind kind) {
  std::vector<std::string> names;
  for (const Column& column : table(kind).columns) {
    if (column.csv) names.emplace_back(column.name);
  }
  return names;
}

/// Records of a CSV file by column name; every line must have as many cells as the header.
std::vector<Record> read_csv(const std::filesystem::path& path, const std::vector<std::string>& columns) {
  TextFile file(path);
  std::vector<Record> records;
  bool header = true;
  while (const auto line = file.next_line()) {
    const auto cells = split(*line, ',');
    EXPECT_EQ(cells.size(), columns.size()) << *line;
    Record record;
    for (std::size_t i = 0; i < std::min(cells.size(), columns.size()); ++i) {
      if (header) {
        EXPECT_EQ(cells[i], columns[i]);
      }
      record[columns[i]] = std::string(cells[i]);
    }
    if (!header) records.push_back(std::move(record));
    header = false;
  }
  return records;
}

double number(const Record& record, const std::string& column) {
  const auto value = parse_double(record.at(column));
  EXPECT_TRUE(value) << column << " is '" << record.at(column) << "'";
  return value.value_or(0);
}

TEST(EpochsCsv, KeepsEveryNumberOfAFix) {
  const test::TemporaryFolder folder;
  const auto sink = open_file("epochs_csv", folder / "epochs.csv", 0);
  const simulation::Epoch epoch =
      test::sample_epoch(test::sample_time() + 0.05, test::sample_point(), {1.23456, -2.34567, 3.45678});
  simulation::Epoch other = epoch;
  other.receiver = 1;
  sink->write(other);  // of another receiver: not in this file
  sink->write(epoch);
  EXPECT_FALSE(std::filesystem::exists(folder / "epochs.csv")) << "the file must appear whole";
  sink->finish();
  sink->finish();

  const auto records = read_csv(folder / "epochs.csv", csv_columns(TableKind::Epochs));
  ASSERT_EQ(records.size(), 1U);
  const Record& r = records.front();
  EXPECT_EQ(r.at("gps_week"), "2051");
  EXPECT_EQ(r.at("gps_tow"), "46701.050");
  EXPECT_NEAR(number(r, "true_latitude_deg"), 22.298251, 1e-10);
  EXPECT_NEAR(number(r, "true_longitude_deg"), 114.178761, 1e-10);
  EXPECT_NEAR(number(r, "true_height_m"), 12.345, 1e-4);
  EXPECT_EQ(r.at("status"), "fix");
  EXPECT_EQ(r.at("reason"), "");
  // The fix cells reproduce the ECEF position within 0.1 mm.
  const Eigen::Vector3d fix = geodesy::ecef_from_geodetic(geodesy::Geodetic::from_degrees(
      number(r, "fix_latitude_deg"), number(r, "fix_longitude_deg"), number(r, "fix_height_m")));
  EXPECT_LT((fix - epoch.observed.fix.position_ecef).norm(), 1e-4);
  EXPECT_NEAR(number(r, "error_east_m"), 1.23456, 5.1e-5);
  EXPECT_NEAR(number(r, "error_north_m"), -2.34567, 5.1e-5);
  EXPECT_NEAR(number(r, "error_up_m"), 3.45678, 5.1e-5);
  EXPECT_EQ(number(r, "gdop"), 2.5);
  EXPECT_EQ(number(r, "pdop"), 2.1);
  EXPECT_EQ(number(r, "hdop"), 1.25);
  EXPECT_EQ(number(r, "vdop"), 1.6875);
  EXPECT_EQ(number(r, "tdop"), 1.356);
  EXPECT_EQ(r.at("rating"), "Good");
  EXPECT_EQ(r.at("tracked"), "10");
  EXPECT_EQ(r.at("not_tracked"), "1");
  EXPECT_EQ(r.at("used"), "9");
  EXPECT_EQ(r.at("placement"), "free");
  EXPECT_EQ(number(r, "sigma_north_m"), 1.5);
  EXPECT_EQ(number(r, "covariance_east_north_m2"), 1.5);
  EXPECT_EQ(number(r, "true_velocity_north_mps"), -4);
  EXPECT_EQ(number(r, "fix_velocity_up_mps"), 0.4);
  EXPECT_EQ(number(r, "clock_gps_s"), 1.2345e-4);
}

TEST(EpochsCsv, NoFixLeavesEmptyCells) {
  const test::TemporaryFolder folder;
  const auto sink = open_file("epochs_csv", folder / "epochs.csv", 0);
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0}, false);
  epoch.containment = raytrace::Containment::InsideBuilding;
  // Remaining values of an unsolved fix must not look like a solution.
  epoch.observed.fix.dop = positioning::Dop{1, 1, 1, 1, 1};
  epoch.observed.fix.position = {};
  epoch.observed.fix.used = {*gnss::parse_satellite("G05")};
  sink->write(epoch);
  sink->finish();
  const auto records = read_csv(folder / "epochs.csv", csv_columns(TableKind::Epochs));
  ASSERT_EQ(records.size(), 1U);
  const Record& r = records.front();
  EXPECT_EQ(r.at("status"), "no fix");
  EXPECT_EQ(r.at("reason"), "too few satellites");
  EXPECT_EQ(r.at("placement"), "inside building");
  EXPECT_EQ(r.at("used"), "0");
  EXPECT_EQ(r.at("tracked"), "10");
  for (const char* column : {"fix_latitude_deg", "fix_longitude_deg", "fix_height_m", "error_east_m",
                             "error_north_m", "error_up_m", "gdop", "pdop", "hdop", "vdop", "tdop", "rating",
                             "fix_velocity_east_mps", "sigma_up_m", "clock_gps_s"}) {
    EXPECT_EQ(r.at(column), "") << column;
  }
}

TEST(SatellitesCsv, OneLineForEachSatelliteAboveTheHorizon) {
  const test::TemporaryFolder folder;
  const auto sink = open_file("satellites_csv", folder / "satellites.csv", 0);
  sink->write(test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3}));
  sink->finish();
  const auto records = read_csv(folder / "satellites.csv", csv_columns(TableKind::Satellites));
  ASSERT_EQ(records.size(), 12U);
  const Record& los = records[0];
  EXPECT_EQ(los.at("sat"), "G05");
  EXPECT_EQ(los.at("gps_week"), "2051");
  EXPECT_EQ(los.at("gps_tow"), "46701.000");
  EXPECT_NEAR(number(los, "azimuth_deg"), 45.5, 1e-6);
  EXPECT_NEAR(number(los, "elevation_deg"), 60.2, 1e-6);
  EXPECT_EQ(los.at("visibility"), "LOS");
  EXPECT_EQ(number(los, "excess_path_m"), 0);
  EXPECT_NEAR(number(los, "pseudorange_m"), 2.1e7 + 5 * 1000.12345, 5.1e-5);
  EXPECT_EQ(los.at("used"), "1");
  EXPECT_EQ(los.at("above_mask"), "1");
  EXPECT_NEAR(number(los, "doppler_hz"), -1229.5678, 5.1e-5);
  EXPECT_EQ(number(los, "carrier_frequency_hz"), 1575.42e6);
  EXPECT_EQ(number(los, "residual_m"), 0.5);
  EXPECT_EQ(records[1].at("visibility"), "LOS+multipath");
  const Record& nlos = records[2];
  EXPECT_EQ(nlos.at("visibility"), "NLOS");
  EXPECT_EQ(number(nlos, "excess_path_m"), 35.25);
  EXPECT_EQ(number(nlos, "pseudorange_error_m"), 35.5);
  EXPECT_EQ(number(nlos, "noise_m"), 0.25);
  const Record& low = records[3];
  EXPECT_EQ(low.at("sat"), "G24");
  EXPECT_EQ(low.at("above_mask"), "0");
  EXPECT_EQ(low.at("pseudorange_m"), "");
  const Record& blocked = records[4];
  EXPECT_EQ(blocked.at("visibility"), "blocked");
  for (const char* column :
       {"excess_path_m", "pseudorange_m", "pseudorange_error_m", "noise_m", "residual_m"}) {
    EXPECT_EQ(blocked.at(column), "") << column;
  }
  EXPECT_EQ(blocked.at("used"), "0");
  EXPECT_EQ(records[8].at("sat"), "E36");
  EXPECT_EQ(records[8].at("used"), "0");
  EXPECT_EQ(records[8].at("residual_m"), "");
}

TEST(SatellitesCsv, StrengthLockAndPhase) {
  const test::TemporaryFolder folder;
  const auto sink = open_file("satellites_csv", folder / "satellites.csv", 0);
  const geodesy::GpsTime begin = test::sample_time();
  auto first = test::sample_signal_epoch(begin, begin - 12.5);
  auto second = test::sample_signal_epoch(begin + 1, begin - 12.5);
  auto& g05 = second.observed.satellites[0];
  g05.measurement->phase_since = begin + 0.75;  // lost and found again
  auto& g17 = second.observed.satellites[2];
  g17.lock = tracking::LockState::Holding;  // arrives, too weak to be measured
  g17.cn0_dbhz = 12.5;
  g17.measurement.reset();
  sink->write(first);
  sink->write(second);
  sink->finish();
  const auto records = read_csv(folder / "satellites.csv", csv_columns(TableKind::Satellites));
  ASSERT_EQ(records.size(), 24U);
  const Record& tracked = records[0];
  EXPECT_EQ(number(tracked, "cn0_dbhz"), 46.3);
  EXPECT_EQ(number(tracked, "true_cn0_dbhz"), 46.55);
  EXPECT_EQ(tracked.at("lock"), "tracking");
  EXPECT_EQ(number(tracked, "carrier_phase_cycles"), 1239.5678);
  EXPECT_EQ(number(tracked, "phase_lock_s"), 12.5);
  EXPECT_EQ(tracked.at("cycle_slip"), "0") << "a first phase has nothing before it";
  EXPECT_EQ(tracked.at("excluded"), "0");
  const Record& no_phase = records[1];
  EXPECT_EQ(number(no_phase, "cn0_dbhz"), 45.3);
  for (const char* column : {"carrier_phase_cycles", "phase_lock_s", "cycle_slip"}) {
    EXPECT_EQ(no_phase.at(column), "") << column;
  }
  const Record& searched = records[4];  // G31
  EXPECT_EQ(searched.at("lock"), "searching");
  EXPECT_EQ(searched.at("cn0_dbhz"), "");
  EXPECT_EQ(searched.at("true_cn0_dbhz"), "");
  const Record& excluded = records[8];  // E36
  EXPECT_EQ(excluded.at("excluded"), "1");
  EXPECT_EQ(excluded.at("used"), "0");

  EXPECT_EQ(records[12].at("cycle_slip"), "1");
  EXPECT_EQ(number(records[12], "phase_lock_s"), 0.25);
  EXPECT_EQ(records[17].at("cycle_slip"), "0");
  EXPECT_EQ(number(records[17], "phase_lock_s"), 13.5);
  const Record& held = records[14];
  EXPECT_EQ(held.at("visibility"), "NLOS");
  EXPECT_EQ(held.at("lock"), "holding");
  EXPECT_EQ(number(held, "true_cn0_dbhz"), 12.5);
  for (const char* column : {"cn0_dbhz", "excess_path_m", "pseudorange_m", "carrier_phase_cycles"}) {
    EXPECT_EQ(held.at(column), "") << column;
  }
}

/// A receiver with strength and an ideal antenna, and the arriving signals of G05 and E11; it does not track
/// G12.
struct PathsSample {
  ReceiverDescription receiver;
  simulation::Epoch epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time(), {1, 2, 3});
  propagation::Arrival arrival;

  PathsSample() {
    receiver.signal.enabled = true;
    receiver.signal.antenna = signal::isotropic_antenna();
    auto& satellites = epoch.observed.satellites;
    satellites.erase(satellites.begin() + 1);  // G12
    for (const char* id : {"G05", "G12", "G31", "E11"}) {
      arrival.views.emplace_back();
      arrival.views.back().line.id = *gnss::parse_satellite(id);
      arrival.views.back().line.elevation_rad = 0.5;
    }
    arrival.views[0].paths.paths.resize(1);
    arrival.views[0].paths.paths[0].amplitude_factor = 0.5;
    arrival.views[1].paths.paths.resize(1);
    propagation::Path diffuse;
    diffuse.kind = propagation::PathKind::Diffuse;
    diffuse.excess_m = 10.25 * geodesy::kSpeedOfLight / 1575.42e6;
    diffuse.scattered_power = 0.01;
    diffuse.reflector = 0xABC;
    diffuse.point = {1.5, -2.25, 3.125};
    propagation::Path twice;
    twice.kind = propagation::PathKind::Reflected;
    twice.order = 2;
    twice.excess_m = 35.25;
    twice.incidence_count = 2;
    twice.incidences[0].material = city::Material::Glass;  // next to the satellite
    twice.incidences[1].material = city::Material::Metal;
    twice.amplitude_factor = 0;
    twice.reflector = 0xFEDCBA9876543210;
    twice.point = {10, 20, 30};
    twice.far_point = {-1, -2, -3};
    arrival.views[3].paths.paths = {diffuse, twice};
    epoch.arrival = &arrival;
  }
  [[nodiscard]] std::vector<Record> written(const std::filesystem::path& folder) const {
    const auto sink = open_file("paths_csv", folder / "paths.csv", 0, receiver);
    sink->write(epoch);
    sink->finish();
    return read_csv(folder / "paths.csv", csv_columns(TableKind::Paths));
  }
};

// Half of an amplitude is 6.02 dB. Scattered power has equal parts in both polarizations and the antenna
// receives one of them: 1 % of it is 23.01 dB less than the clear line of sight. A quarter of a cycle of
// excess path is 90 deg.
TEST(PathsCsv, OneLineForEachPathOfWhatTheReceiverTracks) {
  const test::TemporaryFolder folder;
  const auto records = PathsSample().written(folder.path());
  ASSERT_EQ(records.size(), 3U);
  const Record &direct = records[0], &diffuse = records[1], &twice = records[2];
  EXPECT_EQ(direct.at("gps_week"), "2051");
  EXPECT_EQ(direct.at("gps_tow"), "46701.000");
  EXPECT_EQ(direct.at("sat") + direct.at("path") + direct.at("kind") + direct.at("order"), "G050direct0");
  EXPECT_EQ(direct.at("excess_path_m"), "0.0000");
  EXPECT_EQ(direct.at("loss_db"), "6.02");
  EXPECT_EQ(direct.at("phase_deg"), "0.0");
  for (const char* column : {"reflector", "material", "point_east_m", "far_material", "far_point_up_m"}) {
    EXPECT_EQ(direct.at(column), "") << column;
  }
  EXPECT_EQ(diffuse.at("sat") + diffuse.at("path") + diffuse.at("kind"), "E110diffuse");
  EXPECT_EQ(diffuse.at("loss_db"), "23.01");
  EXPECT_EQ(diffuse.at("phase_deg"), "-90.0");
  EXPECT_EQ(diffuse.at("reflector"), "0000000000000abc");
  EXPECT_EQ(diffuse.at("material"), "");
  EXPECT_EQ(diffuse.at("point_east_m") + diffuse.at("point_north_m") + diffuse.at("point_up_m"),
            "1.500-2.2503.125");
  EXPECT_EQ(diffuse.at("far_point_east_m"), "");
  EXPECT_EQ(twice.at("path") + twice.at("kind") + twice.at("order"), "1reflected2");
  EXPECT_EQ(twice.at("excess_path_m"), "35.2500");
  EXPECT_EQ(twice.at("loss_db") + twice.at("phase_deg"), "") << "nothing is left of it";
  EXPECT_EQ(twice.at("reflector"), "fedcba9876543210");
  EXPECT_EQ(twice.at("material"), "metal");
  EXPECT_EQ(twice.at("point_up_m"), "30.000");
  EXPECT_EQ(twice.at("far_material"), "glass");
  EXPECT_EQ(twice.at("far_point_north_m"), "-2.000");
}

// f(E5a) / f(E1) = 115 / 154 of 10.25 cycles are 7.6542: -0.6542 cycles are +124.5 deg.
TEST(PathsCsv, StrengthIsOfTheFirstTrackedSignal) {
  const test::TemporaryFolder folder;
  PathsSample sample;
  for (receiver::SatelliteObservation& s : sample.epoch.observed.satellites) {
    if (s.id.system == gnss::System::Galileo) s.signal = &gnss::signals_of(gnss::System::Galileo)[1];
  }
  EXPECT_EQ(sample.written(folder.path())[1].at("phase_deg"), "124.5");
}

TEST(PathsCsv, WithoutStrengthOrPathsCellsAndLinesAreMissing) {
  const test::TemporaryFolder folder;
  PathsSample sample;
  sample.receiver.signal.enabled = false;
  for (const Record& record : sample.written(folder.path())) {
    EXPECT_EQ(record.at("loss_db") + record.at("phase_deg"), "");
    EXPECT_NE(record.at("excess_path_m"), "");
  }
  sample.epoch.arrival = nullptr;
  EXPECT_TRUE(sample.written(folder.path()).empty());
}

TEST(EpochsCsv, NamesFaultsAndQuotesThem) {
  const test::TemporaryFolder folder;
  const auto sink = open_file("epochs_csv", folder / "epochs.csv", 0);
  auto epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  sink->write(epoch);
  epoch.faults = {"jammer", "outage 2"};
  sink->write(epoch);
  epoch.faults = {"say \"no\", twice"};
  sink->write(epoch);
  sink->finish();
  // RFC 4180, 2.5 to 2.7.
  TextFile file(folder / "epochs.csv");
  (void)file.next_line();
  EXPECT_THAT(*file.next_line(), testing::HasSubstr(",,single,"));
  EXPECT_THAT(*file.next_line(), testing::HasSubstr(",jammer; outage 2,single,"));
  EXPECT_THAT(*file.next_line(), testing::HasSubstr(",\"say \"\"no\"\", twice\",single,"));
}

TEST(EpochsCsv, StatementOfRaim) {
  const test::TemporaryFolder folder;
  const auto sink = open_file("epochs_csv", folder / "epochs.csv", 0);
  auto epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time());
  sink->write(epoch);
  epoch.observed.fix.consistent = false;
  sink->write(epoch);
  sink->write(test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3}));
  sink->finish();
  const auto records = read_csv(folder / "epochs.csv", csv_columns(TableKind::Epochs));
  ASSERT_EQ(records.size(), 3U);
  EXPECT_EQ(records[0].at("excluded"), "1");
  EXPECT_EQ(records[0].at("consistent"), "1");
  EXPECT_EQ(records[1].at("consistent"), "0");
  EXPECT_EQ(records[2].at("excluded"), "0");
  EXPECT_EQ(records[2].at("consistent"), "") << "no test was made";
}

TEST(Columns, DocumentationHasTheSameTables) {
  for (const Table& table : tables()) {
    test::expect_documented("columns.md", "columns of " + std::string(table.name) + ".csv", markdown(table));
  }
  for (const ViewTableIndex i : {kViewEpochs, kViewSatellites, kViewPaths, kViewBodies}) {
    const ViewTable& table = view_tables()[i];
    test::expect_documented("columns.md", "columns of the viewer's " + std::string(table.name),
                            markdown(table));
  }
  test::expect_documented("columns.md", "figures of the summary", markdown(summary_metrics()));
  std::string sensors = "| file | columns |\n|---|---|\n";
  for (const auto& [file, heads] : sensor_files())
    sensors += fmt::format("| `{}` | `{}` |\n", file, fmt::join(split(heads, ','), "`, `"));
  test::expect_documented("columns.md", "columns of the sensors' files", sensors);
}

TEST(Columns, AreNamedOnceAndSayWhatTheyAre) {
  for (const Table& table : tables()) {
    std::set<std::string> names;
    for (const Column& column : table.columns) {
      EXPECT_TRUE(names.insert(column.name).second) << column.name;
      EXPECT_NE(std::string(column.help), "") << column.name;
      EXPECT_NE(std::string(column.empty), "") << column.name;
      EXPECT_EQ(column.kind == Column::Kind::Word, column.words > 0) << column.name;
    }
  }
}

// The columns used by other programs, in this order.
TEST(Documentation, AgreedColumnsComeFirst) {
  const std::vector<std::string> epochs{"gps_week",
                                        "gps_tow",
                                        "true_latitude_deg",
                                        "true_longitude_deg",
                                        "true_height_m",
                                        "status",
                                        "fix_latitude_deg",
                                        "fix_longitude_deg",
                                        "fix_height_m",
                                        "error_east_m",
                                        "error_north_m",
                                        "error_up_m",
                                        "gdop",
                                        "pdop",
                                        "hdop",
                                        "vdop",
                                        "tdop",
                                        "rating",
                                        "tracked",
                                        "not_tracked",
                                        "used"};
  const std::vector<std::string> satellites{"gps_week",      "gps_tow",       "sat",
                                            "azimuth_deg",   "elevation_deg", "visibility",
                                            "excess_path_m", "pseudorange_m", "pseudorange_error_m",
                                            "noise_m",       "used"};
  ASSERT_GE(csv_columns(TableKind::Epochs).size(), epochs.size());
  EXPECT_TRUE(std::equal(epochs.begin(), epochs.end(), csv_columns(TableKind::Epochs).begin()));
  ASSERT_GE(csv_columns(TableKind::Satellites).size(), satellites.size());
  EXPECT_TRUE(std::equal(satellites.begin(), satellites.end(), csv_columns(TableKind::Satellites).begin()));
}

}  // namespace
}  // namespace canyon::encoding
