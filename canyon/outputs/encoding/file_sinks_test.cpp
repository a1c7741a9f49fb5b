#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/loaded_city.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding {
namespace {

using Strings = std::vector<std::string>;

std::set<std::string> files_in(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) names.insert(std::filesystem::relative(entry.path(), folder).string());
  }
  return names;
}

TEST(ReceiverFolders, NamesAreSafeAndDiffer) {
  EXPECT_EQ(receiver_folder_names({"rover", "base station", "a/b", "../x"}),
            (Strings{"rover", "base_station", "a_b", "_._x"}));
  EXPECT_EQ(receiver_folder_names({"a/b", "a:b", "A_B", "a_b-2"}),
            (Strings{"a_b", "a_b-2", "A_B-3", "a_b-2-2"}));
  EXPECT_EQ(receiver_folder_names({"", "..", "sky.nav"}), (Strings{"receiver", "_.", "sky.nav-2"}));
  EXPECT_EQ(receiver_folder_names({"view", "Report.txt", "imu.csv"}),
            (Strings{"view-2", "Report.txt-2", "imu.csv-2"}));
  EXPECT_EQ(receiver_folder_names({std::string(300, 'x')}).front().size(), 64U);
}

TEST(OutputFiles, UnwritableFolderIsSaidBeforeTheRun) {
  EXPECT_THROW((void)open_file("epochs_csv", "/nowhere/at/all/epochs.csv", 0), InputError);
  EXPECT_THROW((void)open_file("kml", "/nowhere/at/all/track.kml", 0, {"rover"}), InputError);
}

TEST(OutputFiles, WithoutFinishNothingIsLeft) {
  const test::TemporaryFolder folder;
  {
    const auto sink = open_file("nmea", folder / "receiver.nmea", 0);
    sink->write(test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3}));
  }
  EXPECT_TRUE(files_in(folder.path()).empty());
}

/// Limits the size of files during its lifetime: a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : old_handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &old_);
    rlimit limit = old_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, old_handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit old_{};
  void (*old_handler_)(int);
};

TEST(OutputFiles, DiskThatFillsUpIsAnErrorAndLeavesNothing) {
  const test::TemporaryFolder folder;
  const auto epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  ReceiverDescription header;
  header.systems = {gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  std::vector<std::unique_ptr<simulation::EpochSink>> sinks;
  sinks.push_back(open_file("epochs_csv", folder / "epochs.csv", 0));
  sinks.push_back(open_file("satellites_csv", folder / "satellites.csv", 0));
  sinks.push_back(open_file("nmea", folder / "receiver.nmea", 0));
  sinks.push_back(open_file("rinex_observation", folder / "receiver.obs", 0, header));
  sinks.push_back(open_file("kml", folder / "track.kml", 0, {"rover"}));
  sinks.push_back(open_file("geojson", folder / "track.geojson", 0, {"rover"}));
  int failures = 0;
  std::string message;
  {
    const FileSizeLimit limit(1000);
    for (const auto& sink : sinks) {
      try {
        for (int i = 0; i < 100; ++i) sink->write(epoch);
        sink->finish();
      } catch (const OutputError& error) {
        ++failures;
        message = error.what();
      }
    }
  }
  EXPECT_EQ(failures, 6) << message;
  EXPECT_NE(message.find("cannot be written"), std::string::npos) << message;
  sinks.clear();
  EXPECT_TRUE(files_in(folder.path()).empty());
}

TEST(OutputFiles, AnOlderFileStaysWhereTheRunFails) {
  const test::TemporaryFolder folder;
  const auto epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  const auto first = open_file("epochs_csv", folder / "epochs.csv", 0);
  first->write(epoch);
  first->finish();
  const std::string before = test::read_bytes(folder / "epochs.csv");
  { open_file("epochs_csv", folder / "epochs.csv", 0)->write(epoch); }
  EXPECT_EQ(test::read_bytes(folder / "epochs.csv"), before);
}

/// Fifty metres through a small synthetic downtown.
simulation::Simulation prepare(const std::string& sky, const std::string& receivers) {
  simulation::Scenario scenario = simulation::parse_scenario(
      "city: {synthetic: {blocks_east: 2, blocks_north: 2}}\n" + sky +
          "start: 2026-03-01T10:00:00Z\n"
          "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 0, north_m: 50, up_m: 2}]}\n"
          "rate_hz: 4\n" +
          receivers,
      "test.yaml");
  city::City city = test::loaded_city(scenario.city);
  return simulation::Simulation(std::move(scenario), std::move(city));
}

simulation::RunResult run_into(const simulation::Simulation& simulation, const std::filesystem::path& folder,
                               const simulation::RunOptions& options = {},
                               simulation::EpochSink* more = nullptr) {
  const auto files = make_file_sinks(simulation, folder);
  std::vector<simulation::EpochSink*> sinks;
  for (const auto& file : files) sinks.push_back(file.get());
  if (more != nullptr) sinks.push_back(more);
  return simulation.run(sinks, options);
}

const std::string kNominal = "sky: {nominal: true}\n";

TEST(FileSinks, OneReceiverHasPlainNames) {
  const test::TemporaryFolder folder;
  const auto simulation = prepare(kNominal, "receivers: [{name: rover, profile: ideal}]\n");
  const auto result = run_into(simulation, folder / "deep/out");
  EXPECT_EQ(files_in(folder / "deep/out"),
            (std::set<std::string>{"epochs.csv", "satellites.csv", "receiver.nmea", "receiver.obs", "sky.nav",
                                   "track.kml", "track.geojson"}));
  const std::string epochs = test::read_bytes(folder / "deep/out/epochs.csv");
  EXPECT_EQ(static_cast<std::size_t>(std::count(epochs.begin(), epochs.end(), '\n')), result.epochs + 1);
  // sky.nav reads back as the sky that was simulated.
  const gnss::NavigationData sky = rinex::read_rinex_navigation(folder / "deep/out/sky.nav");
  EXPECT_EQ(sky.kepler.size(), simulation.navigation().kepler.size());
  EXPECT_EQ(sky.glonass.size(), simulation.navigation().glonass.size());
}

TEST(FileSinks, SeveralReceiversHaveFolders) {
  const test::TemporaryFolder folder;
  const auto simulation =
      prepare(kNominal,
              "receivers: [{name: left}, {name: right, independent_noise: true}]\n"
              "outputs: {kml: false, geojson: false, nmea: false, satellites_csv: false}\n");
  (void)run_into(simulation, folder.path());
  EXPECT_EQ(files_in(folder.path()), (std::set<std::string>{"sky.nav", "left/epochs.csv", "left/receiver.obs",
                                                            "right/epochs.csv", "right/receiver.obs"}));
  EXPECT_EQ(receiver_folder(simulation, "out", 1), std::filesystem::path("out") / "right");
  // Noise differs by receiver, so each file is of its own receiver.
  EXPECT_NE(test::read_bytes(folder / "left/epochs.csv"), test::read_bytes(folder / "right/epochs.csv"));
  EXPECT_NE(test::read_bytes(folder / "left/receiver.obs").find("left   "), std::string::npos);
}

TEST(FileSinks, SamplesAreOneFileABandAndReceiver) {
  const test::TemporaryFolder folder;
  const auto simulation =
      prepare(kNominal,
              "duration_s: 0.5\nreceivers: [{name: left}, {name: right, independent_noise: true}]\n"
              "outputs: [samples]\nsamples: {bands: [L1, L2C], rate_hz: 2.5e6, format: 2bit}\n");
  const auto result = run_into(simulation, folder.path());
  std::set<std::string> expected;
  for (const char* of : {"left/samples.L1", "left/samples.L2C", "right/samples.L1", "right/samples.L2C"}) {
    expected.insert(std::string(of) + ".iq");
    expected.insert(std::string(of) + ".sigmf-meta");
  }
  EXPECT_EQ(files_in(folder.path()), expected);
  // Half a second of the receiver's clock; two parts of two bits.
  EXPECT_NEAR(static_cast<double>(std::filesystem::file_size(folder / "right/samples.L1.iq")), 625e3, 10);
  EXPECT_NE(test::read_bytes(folder / "left/samples.L1.iq"),
            test::read_bytes(folder / "right/samples.L1.iq"));
  EXPECT_NE(test::read_bytes(folder / "left/samples.L2C.sigmf-meta").find("GPS L2C"), std::string::npos);
  // E1 and L1C are wider than 2.5 Msps.
  ASSERT_EQ(result.warnings.size(), 2U);
  EXPECT_NE(result.warnings[0].find("Galileo E1"), std::string::npos) << result.warnings[0];
}

TEST(FileSinks, FrozenSkyHasNoNavigationFile) {
  const test::TemporaryFolder folder;
  const auto simulation =
      prepare("sky: {frozen: {satAzimuth: [0, 1, 2, 3, 4, 5], satElevation: [1, 0.8, 1.2, 0.9, 0.7, 1.4]}}\n",
              "receivers: [{name: rover, profile: ideal}]\n");
  (void)run_into(simulation, folder.path());
  EXPECT_EQ(files_in(folder.path()).count("sky.nav"), 0U);
  EXPECT_EQ(files_in(folder.path()).count("receiver.obs"), 1U);
}

/// Stops the run after some epochs, as Ctrl-C does.
class Interrupter final : public simulation::EpochSink {
 public:
  Interrupter(std::size_t after, std::atomic<bool>& stop) : after_(after), stop_(stop) {}
  void write(const simulation::Epoch&) override {
    if (++seen_ == after_) stop_ = true;
  }
  void finish() override {}

 private:
  std::size_t after_, seen_ = 0;
  std::atomic<bool>& stop_;
};

TEST(FileSinks, AnInterruptedRunKeepsItsEpochs) {
  const test::TemporaryFolder folder;
  std::atomic<bool> stop{false};
  Interrupter interrupter(3, stop);
  simulation::RunOptions options;
  options.threads = 1;
  options.stop = &stop;
  const auto simulation = prepare(kNominal, "receivers: [{name: rover, profile: ideal}]\nduration_s: 3000\n");
  const auto result = run_into(simulation, folder.path(), options, &interrupter);
  ASSERT_GE(result.epochs, 3U);
  for (const char* file : {"epochs.csv", "receiver.obs", "track.geojson", "sky.nav"}) {
    EXPECT_EQ(files_in(folder.path()).count(file), 1U) << file;
  }
  const std::string epochs = test::read_bytes(folder / "epochs.csv");
  EXPECT_EQ(static_cast<std::size_t>(std::count(epochs.begin(), epochs.end(), '\n')), result.epochs + 1);
}

TEST(FileSinks, SameSeedSameBytesOnOneAndTwoThreads) {
  const test::TemporaryFolder folder;
  for (const int threads : {1, 2}) {
    simulation::RunOptions options;
    options.threads = threads;
    (void)run_into(prepare(kNominal, "receivers: [{name: rover, profile: ideal}]\n"),
                   folder / std::to_string(threads), options);
  }
  const auto files = files_in(folder / "1");
  ASSERT_EQ(files.size(), 7U);
  EXPECT_EQ(files, files_in(folder / "2"));
  for (const std::string& file : files) {
    EXPECT_EQ(test::read_bytes(folder / ("1/" + file)), test::read_bytes(folder / ("2/" + file))) << file;
  }
}

TEST(FileSinks, UnwritableFolderIsAnInputError) {
  const auto simulation = prepare(kNominal, "receivers: [{name: rover, profile: ideal}]\n");
  EXPECT_THROW((void)make_file_sinks(simulation, "/proc/canyon/out"), InputError);
}

}  // namespace
}  // namespace canyon::encoding
