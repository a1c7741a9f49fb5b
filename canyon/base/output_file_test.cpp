#include "canyon/base/output_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
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
  EXPECT_TRUE(std::filesystem::exists(file.temporary_path()));
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
    temporary = file.temporary_path();
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
    EXPECT_NE(std::string(error.what()).find("choose a folder"), std::string::npos) << error.what();
  }
}

TEST(OutputFile, DiskThatIsFullLeavesTheOlderFile) {
  const test::TemporaryFolder folder;
  {
    OutputFile file(folder / "a.txt");
    file.write("old");
    file.commit();
  }
  // A limit on the size of files stands for a full disk: both fail in write(2).
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

TEST(OutputFile, NameOfAFolderFailsAtCommit) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "taken");
  OutputFile file(folder / "taken");
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
