#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/output/rinex_observation.hpp"
#include "canyon/output/sinks.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::output {
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
  EXPECT_EQ(receiver_folder_names({std::string(300, 'x')}).front().size(), 64U);
}

TEST(OutputFiles, UnwritableFolderIsSaidBeforeTheRun) {
  EXPECT_THROW((void)make_epochs_csv("/nowhere/at/all/epochs.csv", 0), InputError);
  EXPECT_THROW((void)make_kml("/nowhere/at/all/track.kml", 0, "rover"), InputError);
}

TEST(OutputFiles, WithoutFinishNothingIsLeft) {
  const test::TemporaryFolder folder;
  {
    const auto sink = make_nmea(folder / "receiver.nmea", 0);
    sink->write(test::sample_epoch(test::sample_time(), test::sample_place(), {1, 2, 3}));
  }
  EXPECT_TRUE(files_in(folder.path()).empty());
}

/// Files cannot grow beyond some bytes while this lives: a full disk.
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
  const auto epoch = test::sample_epoch(test::sample_time(), test::sample_place(), {1, 2, 3});
  RinexObservationHeader header;
  header.systems = {orbit::kAllSystems.begin(), orbit::kAllSystems.end()};
  std::vector<std::unique_ptr<simulation::EpochSink>> sinks;
  sinks.push_back(make_epochs_csv(folder / "epochs.csv", 0));
  sinks.push_back(make_satellites_csv(folder / "satellites.csv", 0));
  sinks.push_back(make_nmea(folder / "receiver.nmea", 0));
  sinks.push_back(make_rinex_observation(folder / "receiver.obs", 0, header));
  sinks.push_back(make_kml(folder / "track.kml", 0, "rover"));
  sinks.push_back(make_geojson(folder / "track.geojson", 0, "rover"));
  int failures = 0;
  std::string message;
  {
    const FileSizeLimit limit(1000);
    for (const auto& sink : sinks) {
      try {
        for (int i = 0; i < 100; ++i) sink->write(epoch);
        sink->finish();
      } catch (const InputError& error) {
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
  const auto epoch = test::sample_epoch(test::sample_time(), test::sample_place(), {1, 2, 3});
  const auto first = make_epochs_csv(folder / "epochs.csv", 0);
  first->write(epoch);
  first->finish();
  const std::string before = test::read_bytes(folder / "epochs.csv");
  { make_epochs_csv(folder / "epochs.csv", 0)->write(epoch); }
  EXPECT_EQ(test::read_bytes(folder / "epochs.csv"), before);
}

}  // namespace
}  // namespace canyon::output
