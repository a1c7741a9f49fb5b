#include "canyon/base/output_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <set>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

TEST(OutputFile, AppearsAtCommitOnly) {
  const test::TemporaryFolder folder;
  OutputFile file(folder / "a.txt");
  file.write("one ");
  file.write("two");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  EXPECT_TRUE(std::filesystem::exists(file.external_path()));
  file.commit();
  EXPECT_EQ(test::read_bytes(folder / "a.txt"), "one two");
  EXPECT_TRUE(std::filesystem::equivalent(file.path(), folder / "a.txt"));
}

TEST(OutputFile, WithoutCommitTheOlderFileStays) {
  const test::TemporaryFolder folder;
  {
    OutputFile file(folder / "a.txt");
    file.write("old");
    file.commit();
  }
  std::filesystem::path temporary;
  {
    OutputFile file(folder / "a.txt");
    temporary = file.external_path();
    file.write("new");
  }
  EXPECT_EQ(test::read_bytes(folder / "a.txt"), "old");
  EXPECT_FALSE(std::filesystem::exists(temporary));
}

TEST(OutputFile, OverwriteReplacesBytesAndGoesOnAtTheEnd) {
  const test::TemporaryFolder folder;
  OutputFile file(folder / "a.txt");
  file.write("last: ???? ");
  file.write("body ");
  file.overwrite(6, "2026");
  file.write("end");
  file.commit();
  EXPECT_EQ(test::read_bytes(folder / "a.txt"), "last: 2026 body end");
}

TEST(OutputFile, FolderThatIsNotThere) {
  try {
    OutputFile file("/nowhere/at/all/a.txt");
    FAIL() << "no InputError";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "/nowhere/at/all/a.txt");
    EXPECT_NE(std::string(error.what()).find("choose an existing"), std::string::npos) << error.what();
  }
}

TEST(OutputFile, DiskThatIsFullLeavesTheOlderFile) {
  const test::TemporaryFolder folder;
  {
    OutputFile file(folder / "a.txt");
    file.write("old");
    file.commit();
  }
  // A limit on the size of files simulates a full disk: both fail in write(2).
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1 << 16;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::string message;
  try {
    OutputFile file(folder / "a.txt");
    for (int i = 0; i < 100; ++i) file.write(std::string(1000, 'x'));
    file.commit();
  } catch (const OutputError& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_NE(message.find("a.txt: cannot be written"), std::string::npos) << message;
  EXPECT_EQ(test::read_bytes(folder / "a.txt"), "old");
}

TEST(OutputFile, WhatTheDiskDidNotTakeNeverAppears) {
  const test::TemporaryFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1 << 16;
  {
    OutputFile file(folder / "a.txt");
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    EXPECT_THROW(file.write(std::string(100'000, 'x')), OutputError);
    setrlimit(RLIMIT_FSIZE, &before);
    // There is space again, as after the end of another program.
    EXPECT_THROW(file.write("end"), OutputError);
    EXPECT_THROW(file.commit(), OutputError);
  }
  std::signal(SIGXFSZ, handler);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

/// A process that holds an output's temporary file until it is killed.
pid_t hold(const std::filesystem::path& path) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) return -1;
  const pid_t child = fork();
  if (child == 0) {
    const OutputFile file(path);
    const Temporary inside(path.parent_path() / "model", Temporary::Kind::Folder);
    (void)!::write(ends[1], "x", 1);
    for (;;) pause();
  }
  char byte = 0;
  (void)!::read(ends[0], &byte, 1);
  for (const int end : ends) ::close(end);
  return child;
}

void end(pid_t child) {
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

std::set<std::string> names_in(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

TEST(OutputFile, WhatKilledProcessesLeftGoesAndWhatOthersHoldStays) {
  const test::TemporaryFolder folder;
  for (const char* name : {"archive.part1", "a.part-mine", "b.part-0123456789a"})
    std::ofstream(folder / name) << "a user's";
  std::filesystem::create_symlink(folder / "archive.part1", folder / "link.part-0123456789ab");
  const std::set<std::string> users = names_in(folder.path());
  end(hold(folder / "killed.txt"));
  const pid_t living = hold(folder / "living.txt");
  EXPECT_EQ(names_in(folder.path()).size(), users.size() + 2) << "the second process has swept";
  end(living);
  EXPECT_EQ(names_in(folder.path()).size(), users.size() + 2);
  const pid_t other = hold(folder / "other.txt");
  std::filesystem::create_directory(folder / "car");
  std::ofstream(folder / "car/epochs.csv.part-0123456789ab") << "cut";
  { const OutputFile mine(folder / "mine.txt"); }
  EXPECT_EQ(names_in(folder.path()).size(), users.size() + 3) << "the other's stay";
  EXPECT_TRUE(std::filesystem::is_empty(folder / "car")) << "of a receiver that this run has not";
  end(other);
}

TEST(OutputFile, ItsTemporaryNameIsNotForeseen) {
  const test::TemporaryFolder folder;
  const OutputFile one(folder / "a.txt"), two(folder / "a.txt");
  EXPECT_NE(one.external_path(), two.external_path());
  EXPECT_EQ(names_in(folder.path()).size(), 2U);
}

TEST(FolderLock, KeepsAnotherRunOut) {
  const test::TemporaryFolder folder;
  {
    const FolderLock lock(folder.path());
    try {
      const FolderLock other(folder.path());
      FAIL() << "no InputError";
    } catch (const InputError& error) {
      EXPECT_NE(error.problem().find("another run uses this folder (process " + std::to_string(getpid())),
                std::string::npos)
          << error.what();
    }
    EXPECT_THROW(FolderLock(folder.path(), true), InputError);
  }
  const FolderLock one(folder.path(), true), two(folder.path(), true);
  EXPECT_THROW(FolderLock(folder.path()), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(OutputFile, TooManyOpenFilesAreNoBadInput) {
  const test::TemporaryFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none = before;
  none.rlim_cur = 3;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  EXPECT_THROW(OutputFile(folder / "a.txt"), OutputError);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
}

TEST(OutputFile, NameOfAFolderFailsBeforeTheWork) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "taken");
  EXPECT_THROW(OutputFile(folder / "taken"), InputError);
  OutputFile file(folder / "later");
  std::filesystem::create_directory(folder / "later");
  EXPECT_THROW(file.commit(), InputError);
}

TEST(OutputFile, MovesWithItsDuty) {
  const test::TemporaryFolder folder;
  {
    OutputFile first(folder / "a.txt");
    first.write("one");
    OutputFile second(std::move(first));
    second.write(" two");
    second.commit();
  }
  EXPECT_EQ(test::read_bytes(folder / "a.txt"), "one two");
}

TEST(OutputFile, IsWrittenInOneCall) {
  const test::TemporaryFolder folder;
  write_file(folder / "a.txt", "one");
  write_file(folder / "a.txt", "two");
  EXPECT_EQ(test::read_bytes(folder / "a.txt"), "two");
  EXPECT_THROW(write_file(folder / "missing/a.txt", "three"), InputError);
}

// Results replace those written by a run, also by a killed one; a file of the user is kept.
// A file renamed to a device's name would replace the device.
TEST(OutputFile, RefusesADevice) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THROW(write_file(folder / "pipe", "1"), InputError);
  EXPECT_TRUE(std::filesystem::is_fifo(folder / "pipe"));
}

TEST(ResultFiles, ReplaceWhatARunWrote) {
  const test::TemporaryFolder folder;
  {
    std::ofstream(folder / "users.csv") << "mine";
    ResultFiles killed(folder.path(), "simulate");
    write_file(folder / "a.csv", "1");
    EXPECT_THROW(write_file(folder / "users.csv", "1"), InputError);
  }
  {
    ResultFiles results(folder.path(), "simulate");
    write_file(folder / "a.csv", "2");
    write_file(folder / "a.csv", "3");
    write_file(folder / "b.csv", "3");
    EXPECT_EQ(results.finish(), 0U);
  }
  {
    ResultFiles results(folder.path(), "simulate");
    write_file(folder / "b.csv", "4");
    EXPECT_EQ(results.finish(), 1U) << "a.csv";
  }
  EXPECT_EQ(test::read_bytes(folder / ".canyon-results"), "# files of canyon simulate\nb.csv\n");
  EXPECT_EQ(test::read_bytes(folder / "users.csv"), "mine");
  write_file(folder / "users.csv", "named by the user");  // outside a run
  EXPECT_FALSE(std::filesystem::exists(folder / "a.csv"));
}

// Two runs of one process, each with a folder; one has a store with its own list.
TEST(ResultFiles, AreOfTheirFolders) {
  const test::TemporaryFolder one, two;
  make_output_folder(one / "tiles");
  std::ofstream(one / "users.csv") << "mine";
  ResultFiles first(one.path(), "heatmap", "tiles");
  {
    const ResultFiles second(two.path(), "view");
    EXPECT_THROW(write_file(one / "users.csv", "1"), InputError);
    write_file(two / "b.csv", "2");
  }
  write_file(one / "tiles/1.bin", "3");
  write_file(one / "a.csv", "4");
  EXPECT_EQ(test::read_bytes(one / ".canyon-results"), "# files of canyon heatmap\na.csv\n");
  EXPECT_EQ(test::read_bytes(two / ".canyon-results"), "# files of canyon view\nb.csv\n");
}

// A command removes only files of its own kind; it rejects a folder with another command's results at once.
TEST(ResultFiles, AreOfOneCommand) {
  const test::TemporaryFolder folder;
  const auto list = [&] { return test::read_bytes(folder / ".canyon-results"); };
  {
    const ResultFiles map(folder.path(), "heatmap");
    EXPECT_THROW(ResultFiles(folder.path(), "simulate"), InputError) << "another one works there";
    write_file(folder / "map.nc", "1");
    const Temporary own(folder / "city", Temporary::Kind::Folder);
    write_file(own.temporary_path() / "city.glb", "2");
  }
  EXPECT_EQ(list(), "# files of canyon heatmap\nmap.nc\n") << "no temporary name";
  try {
    const ResultFiles run(folder.path(), "simulate");
    FAIL() << "no InputError";
  } catch (const InputError& error) {
    EXPECT_EQ(error.problem(), "has the results of another command, 'canyon heatmap'");
  }
  EXPECT_TRUE(ResultFiles(folder.path(), "heatmap").has_others()) << "map.nc";
}

TEST(ResultFiles, OtherCommandsMayComeWhenResultsAreGone) {
  const test::TemporaryFolder folder;
  // Older versions recorded no command: their files may be replaced, and are not removed.
  std::ofstream(folder / ".canyon-results") << "old.csv\nmap.nc\n# files of canyon heatmap\nhdop.tif\n";
  std::ofstream(folder / "old.csv") << "1";
  std::ofstream(folder / "map.nc") << "1";
  for (int run = 0; run < 2; ++run) {
    ResultFiles results(folder.path(), "simulate");
    write_file(folder / "old.csv", "2");
    EXPECT_EQ(results.finish(), 0U);
    EXPECT_EQ(test::read_bytes(folder / ".canyon-results"), "map.nc\n# files of canyon simulate\nold.csv\n");
  }
  EXPECT_EQ(test::read_bytes(folder / "map.nc"), "1");
}

TEST(ResultFiles, NamesOfFoldersAreRefusedBeforeTheWork) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "report.txt");
  {
    const ResultFiles results(folder.path(), "simulate");
    EXPECT_THROW(ResultFiles::refuse(folder / "report.txt"), InputError);
  }
  std::filesystem::create_directory(folder / ".canyon-results");
  EXPECT_THROW(ResultFiles(folder.path(), "simulate"), InputError);
}

TEST(OutputFile, MakesFoldersWithParents) {
  const test::TemporaryFolder folder;
  make_output_folder(folder / "a/b/c");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "a/b/c"));
  EXPECT_TRUE(std::filesystem::is_empty(folder / "a/b/c")) << "the probe is removed";
  OutputFile file(folder / "a/file");
  file.commit();
  EXPECT_THROW(make_output_folder(folder / "a/file/d"), InputError);
}

}  // namespace
}  // namespace canyon
