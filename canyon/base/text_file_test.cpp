#include "canyon/base/text_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

void write(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

void write_gzip(const std::filesystem::path& path, const std::string& bytes) {
  gzFile file = gzopen(path.c_str(), "wb");
  ASSERT_NE(file, nullptr);
  ASSERT_EQ(gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size())), static_cast<int>(bytes.size()));
  ASSERT_EQ(gzclose(file), Z_OK);
}

std::string message(const std::filesystem::path& path, std::size_t max_bytes = 1 << 20) {
  try {
    const TextFile file(path, max_bytes);
  } catch (const InputError& e) {
    EXPECT_EQ(e.file(), path.string());
    return e.what();
  }
  return "no error";
}

TEST(TextFile, GivesLinesWithTheirNumbers) {
  TextFile file = TextFile::from_string("one\r\ntwo\n\nfour", "a.txt");
  EXPECT_EQ(file.line(), 0);
  EXPECT_EQ(file.peek_line(), "one");
  EXPECT_EQ(file.line(), 0);
  EXPECT_EQ(file.next_line(), "one");
  EXPECT_EQ(file.line(), 1);
  EXPECT_EQ(file.next_line(), "two");
  EXPECT_EQ(file.next_line(), "");
  EXPECT_EQ(file.next_line(), "four");
  EXPECT_EQ(file.line(), 4);
  EXPECT_EQ(file.next_line(), std::nullopt);
  EXPECT_EQ(file.peek_line(), std::nullopt);
  EXPECT_EQ(file.line(), 4);
  EXPECT_STREQ(file.error("bad", "mend it").what(), "a.txt:4: bad; mend it");
}

TEST(TextFile, ALastLineEndMakesNoEmptyLine) {
  TextFile file = TextFile::from_string("one\n", "a.txt");
  EXPECT_EQ(file.next_line(), "one");
  EXPECT_EQ(file.next_line(), std::nullopt);
  EXPECT_EQ(TextFile::from_string("", "a.txt").next_line(), std::nullopt);
}

TEST(TextFile, ReadsPlainAndGzipWhateverTheName) {
  const test::TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 30'000; ++i) text += "line " + std::to_string(i) + "\n";
  write(folder / "plain.gz", text);
  write_gzip(folder / "packed.txt", text);
  EXPECT_EQ(TextFile(folder / "plain.gz").text(), text);
  EXPECT_EQ(TextFile(folder / "packed.txt").text(), text);
  write(folder / "empty", "");
  EXPECT_EQ(TextFile(folder / "empty").text(), "");
}

TEST(TextFile, SurvivesAMove) {
  TextFile file = TextFile::from_string("one\ntwo\n", "a.txt");
  (void)file.next_line();
  TextFile moved = std::move(file);
  EXPECT_EQ(moved.next_line(), "two");
  EXPECT_EQ(moved.line(), 2);
}

TEST(TextFile, NamesWhatIsWrongWithAFile) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(message(folder / "none"), HasSubstr("no such file; check the path"));
  EXPECT_THAT(message(folder.path()), HasSubstr("is a folder, not a file"));
  write(folder / "big", std::string(3 << 20, 'x'));
  EXPECT_THAT(message(folder / "big", 1 << 20), HasSubstr("more than 1 MiB"));
  // A small file that unpacks to a large one.
  write_gzip(folder / "bomb", std::string(64 << 20, 'x'));
  EXPECT_LT(std::filesystem::file_size(folder / "bomb"), 100'000U);
  EXPECT_THAT(message(folder / "bomb", 1 << 20), HasSubstr("more than 1 MiB"));
}

TEST(TextFile, RefusesGzipThatIsCutShortOrDamaged) {
  const test::TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 20'000; ++i) text += std::to_string(i * 7919 % 10'007) + "\n";
  write_gzip(folder / "good.gz", text);
  const std::string packed = test::read_bytes(folder / "good.gz");
  for (const double part : {0.001, 0.3, 0.9, 0.9999}) {
    write(folder / "cut.gz",
          packed.substr(0, 4 + static_cast<std::size_t>(part * static_cast<double>(packed.size() - 4))));
    EXPECT_THAT(message(folder / "cut.gz"), HasSubstr("damaged or cut short")) << part;
  }
  std::string damaged = packed;
  damaged[damaged.size() / 2] = static_cast<char>(~damaged[damaged.size() / 2]);
  write(folder / "damaged.gz", damaged);
  EXPECT_THAT(message(folder / "damaged.gz"), AllOf(HasSubstr("damaged"), HasSubstr("fetch the file again")));
  EXPECT_THROW((void)TextFile(folder / "damaged.gz", 1 << 20, CutGzip::ReadToCut), InputError);
  // The last eight bytes are checksum and length.
  damaged = packed;
  damaged[damaged.size() - 6] = static_cast<char>(~damaged[damaged.size() - 6]);
  write(folder / "checksum.gz", damaged);
  EXPECT_THAT(message(folder / "checksum.gz"), HasSubstr("damaged"));
}

// zlib unpacks the beginning of a file that ends early; half a line is dropped.
TEST(TextFile, ReadsGzipUpToACutWhereAskedTo) {
  const test::TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 20'000; ++i) text += std::to_string(i * 7919 % 10'007) + "\n";
  write_gzip(folder / "good.gz", text);
  const std::string packed = test::read_bytes(folder / "good.gz");
  EXPECT_EQ(TextFile(folder / "good.gz", 1 << 20, CutGzip::ReadToCut).cut_warning(), "");
  std::size_t before = 0;
  for (const double part : {0.3, 0.5, 0.9}) {
    write(folder / "cut.gz",
          packed.substr(0, static_cast<std::size_t>(part * static_cast<double>(packed.size()))));
    TextFile file(folder / "cut.gz", 1 << 20, CutGzip::ReadToCut);
    ASSERT_GT(file.text().size(), before) << part;
    before = file.text().size();
    EXPECT_EQ(file.text(), text.substr(0, before));
    EXPECT_EQ(file.text().back(), '\n');
    TextFile stream = TextFile::streamed(folder / "cut.gz");
    int lines = 0;
    while (const auto line = stream.next_line()) {
      ++lines;
      ASSERT_EQ(*line, file.next_line());
    }
    EXPECT_EQ(file.next_line(), std::nullopt);
    EXPECT_EQ(stream.cut_warning(), file.cut_warning());
    EXPECT_EQ(file.cut_warning(), (folder / "cut.gz").string() + ":" + std::to_string(lines) +
                                      ": the gzip data end early; read up to here; fetch the file again");
  }
  // All of the text, and only the checksum missing.
  write(folder / "cut.gz", packed.substr(0, packed.size() - 8));
  EXPECT_EQ(TextFile(folder / "cut.gz", 1 << 20, CutGzip::ReadToCut).text(), text);
  TextFile whole = TextFile::streamed(folder / "good.gz");
  while (whole.next_line()) {
  }
  EXPECT_EQ(whole.cut_warning(), "");
}

TEST(TextFile, StreamsEveryLineAcrossChunks) {
  const test::TemporaryFolder folder;
  const auto expected = [](int i) {
    return std::to_string(i) + std::string(static_cast<std::size_t>(i % 17), 'x');
  };
  std::string text;
  for (int i = 0; i < 20000; ++i) text += expected(i) + "\r\n";
  write(folder / "lines.txt", text + "last");
  TextFile lines = TextFile::streamed(folder / "lines.txt");
  for (int i = 0; i < 20000; ++i) {
    if (i % 70 == 0) {
      ASSERT_EQ(lines.peek_line(), expected(i));
    }
    ASSERT_EQ(lines.next_line(), expected(i));
    ASSERT_EQ(lines.line(), i + 1);
    if (i % 100 == 0) {
      lines.unread_line();
      EXPECT_EQ(lines.line(), i);
      ASSERT_EQ(lines.next_line(), expected(i));
    }
  }
  EXPECT_EQ(lines.next_line(), "last");
  EXPECT_EQ(lines.next_line(), std::nullopt);
  write(folder / "binary", std::string(100'000, 'x'));
  TextFile binary = TextFile::streamed(folder / "binary");
  try {
    (void)binary.next_line();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("line of more than 64 KiB"));
  }
}

}  // namespace
}  // namespace canyon
