#include "canyon/base/input_files.hpp"

#include <gtest/gtest.h>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/output_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

namespace fs = std::filesystem;

class InputFilesTest : public testing::Test {
 protected:
  InputFilesTest() { std::ofstream(input) << "mine"; }

  /// Whether an output of that name is rejected, and the input unchanged.
  [[nodiscard]] bool refused(const fs::path& path) const {
    bool threw = false;
    try {
      write_file(path, "other");
    } catch (const InputError& error) {
      threw = error.problem() == "is an input of this run and would be replaced" &&
              error.hint() == "choose another --out or name" && error.file() == path.string();
    }
    EXPECT_EQ(test::read_bytes(input), "mine");
    return threw;
  }

  test::TemporaryFolder folder;
  fs::path input = folder / "a.txt";
  InputFiles files;
  InputFiles::Scope scope{files};
};

TEST_F(InputFilesTest, NoOutputReplacesWhatWasRead) {
  EXPECT_EQ(read_bytes(input), "mine");
  fs::create_directory(folder / "sub");
  fs::create_symlink(input, folder / "link.txt");
  fs::create_directory_symlink(folder.path(), folder / "sub/up");
  fs::create_hard_link(input, folder / "hard.txt");
  for (const char* name : {"a.txt", "./sub/../a.txt", "link.txt", "sub/up/a.txt", "hard.txt"})
    EXPECT_TRUE(refused(folder / name)) << name;
  EXPECT_FALSE(refused(folder / "b.txt"));
  EXPECT_FALSE(refused(folder / "a.txt2"));
}

TEST_F(InputFilesTest, AnInputByItsLinkIsKnownByItsName) {
  fs::create_symlink(input, folder / "link.txt");
  EXPECT_EQ(read_bytes(folder / "link.txt"), "mine");
  EXPECT_TRUE(refused(input));
}

TEST_F(InputFilesTest, NoReaderOpensAnOutput) {
  {
    const OutputFile out(input);
    EXPECT_THROW((void)read_bytes(input), InputError);
  }
  OutputFile written(folder / "b.txt");
  written.commit();
  EXPECT_EQ(read_bytes(folder / "b.txt"), "");
  EXPECT_EQ(read_bytes(input), "mine");
}

TEST_F(InputFilesTest, AFolderWithAnInputIsNotReplaced) {
  fs::create_directory(folder / "model");
  fs::rename(input, folder / "model/a.txt");
  input = folder / "model/a.txt";
  EXPECT_EQ(read_bytes(input), "mine");
  EXPECT_THROW(Temporary(folder / "model", Temporary::Kind::Folder), InputError);
  files.remove(input);
  const Temporary out(folder / "model", Temporary::Kind::Folder);
  EXPECT_THROW((void)read_bytes(input), InputError);
}

TEST_F(InputFilesTest, ScopesKeepRunsApart) {
  EXPECT_EQ(read_bytes(input), "mine");
  InputFiles other;
  {
    const InputFiles::Scope inner(other);
    write_file(input, "mine");
    other.add(files);
    EXPECT_TRUE(refused(input));
  }
  EXPECT_TRUE(refused(input));
}

}  // namespace
}  // namespace canyon
