#include "canyon/base/text_file.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

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

TEST(TextFile, CarriageReturnsAloneEndLines) {
  const test::TemporaryFolder temporary;
  write(temporary.path() / "a.csv", "one\rtwo\r\rfour");
  TextFile streamed = TextFile::streamed(temporary.path() / "a.csv");
  TextFile whole(temporary.path() / "a.csv");
  for (TextFile* file : {&streamed, &whole}) {
    EXPECT_EQ(file->next_line(), "one");
    EXPECT_EQ(file->next_line(), "two");
    EXPECT_EQ(file->next_line(), "");
    EXPECT_EQ(file->next_line(), "four");
    EXPECT_EQ(file->line(), 4);
    EXPECT_FALSE(file->next_line());
  }
  // Bytes that are no text, as stored by a study, are unchanged.
  const std::string bytes("one\rtwo\0", 8);
  write(temporary.path() / "a.bin", bytes);
  EXPECT_EQ(TextFile(temporary.path() / "a.bin").text(), bytes);
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
  EXPECT_FALSE(TextFile(folder / "good.gz", 1 << 20, CutGzip::ReadToCut).cut_warning());
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
    ASSERT_TRUE(stream.cut_warning() && file.cut_warning());
    EXPECT_STREQ(stream.cut_warning()->what(), file.cut_warning()->what());
    EXPECT_EQ(file.cut_warning()->what(),
              (folder / "cut.gz").string() + ":" + std::to_string(lines) +
                  ": the gzip data end early; read up to here; fetch the file again");
  }
  // All of the text, and only the checksum missing.
  write(folder / "cut.gz", packed.substr(0, packed.size() - 8));
  EXPECT_EQ(TextFile(folder / "cut.gz", 1 << 20, CutGzip::ReadToCut).text(), text);
  TextFile whole = TextFile::streamed(folder / "good.gz");
  while (whole.next_line()) {
  }
  EXPECT_FALSE(whole.cut_warning());
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

TEST(TextFile, SkipsAByteOrderMark) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "mark.txt";
  write(path, "\xef\xbb\xbftime\n");
  EXPECT_EQ(TextFile(path).text(), "time\n");
  write_gzip(path, "\xef\xbb\xbftime\n");
  EXPECT_EQ(TextFile(path).text(), "time\n");
  write(path, "ab");
  EXPECT_EQ(TextFile(path).text(), "ab");
}

TEST(TextFile, RefusesPagesOfErrors) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "map.json";
  write(
      path,
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!DOCTYPE html PUBLIC \"-//W3C//DTD XHTML 1.0\">\n<html>");
  EXPECT_THAT(message(path), HasSubstr("is a web page (HTML), not data"));
  write(path, "<?xml version=\"1.0\"?>\n<osm>");
  EXPECT_EQ(TextFile(path).text().substr(0, 5), "<?xml");
}

// Python's "...".encode("utf-16-le") and "utf-16-be".
TEST(TextFile, ReadsUtf16BehindItsMark) {
  using namespace std::string_literals;
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "wide.txt";
  write(path, "\xff\xfeh\0\xf6\0h\0e\0\r\0\n\0\x3d\xd8\x0d\xde\x31\0"s);
  TextFile little(path);
  EXPECT_EQ(little.next_line(), "h\xc3\xb6he");
  EXPECT_EQ(little.next_line(), "\xf0\x9f\x98\x8d\x31");
  write_gzip(path, "\xfe\xff\0t\0i\x65\xe5\0e\0\n"s);
  EXPECT_EQ(TextFile(path).text(), "ti\xe6\x97\xa5\x65\n");
  EXPECT_EQ(TextFile::from_string("\xff\xfe<\0a\0"s, "a").text(), "<a");

  // Pieces of a streamed file end within a character.
  std::string wide = "\xff\xfe";
  std::string line;
  for (int i = 0; i < 100'000; ++i) {
    line = std::to_string(i) + "\n";
    for (const char c : line) wide += {c, '\0'};
  }
  write(path, wide);
  TextFile lines = TextFile::streamed(path);
  for (int i = 0; i < 100'000; ++i) ASSERT_EQ(lines.next_line(), std::to_string(i));
  EXPECT_EQ(lines.next_line(), std::nullopt);
}

TEST(TextFile, Utf16KnowsHalvesAndOtherBytes) {
  using namespace std::string_literals;
  EXPECT_EQ(utf8_of_marked("\xff\xfe"
                           "a\0\x3d\xd8"
                           "b\0"s),
            "a\xef\xbf\xbd"
            "b");
  EXPECT_EQ(utf8_of_marked("\xfe\xff\0<\0?\0x\0m\0l\0 \0e\0=\0'\0U\0T\0F\0-\0001\0006\0'\0?\0>"s),
            "<?xml e='UTF-8'?>");
  for (const std::string& other : {"\xff\xfe\0\0a\0\0\0"s, "\xff\xfe\x12\x34\x56\x78"s, "\xff\xfe"s, "ab"s})
    EXPECT_EQ(utf8_of_marked(other), other);
}

// good.n.Z: made by an encoder after compress 4.0, checked with gzip -d; good.n.zip: Python's zipfile.
TEST(TextFile, ReadsCompressAndZip) {
  for (const auto& [packed, plain] :
       {std::pair<const char*, const char*>{"containers/good.n.Z", "text-bom/good.n"},
        {"containers/good.n.zip", "text-bom/good.n"},
        {"containers/day1.sp3.Z", "sp3-two-days/day1.sp3"}}) {
    EXPECT_EQ(TextFile(test::case_file(packed)).text(), TextFile(test::case_file(plain)).text()) << packed;
  }
  const std::string whole = [] {
    std::ifstream in(test::case_file("containers/day1.sp3.Z"), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  }();
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "damaged.Z";
  for (std::size_t at = 3; at < whole.size(); at += 7) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    write(path, damaged);
    try {
      (void)TextFile(path);
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), HasSubstr("damaged.Z: compress data are damaged"));
    }
  }
}

std::string bzip2(const std::string& text) {
  std::string packed(text.size() + text.size() / 100 + 600, '\0');
  std::size_t size = 0;
  archive* const writer = archive_write_new();
  archive_entry* const entry = archive_entry_new();
  archive_entry_set_pathname(entry, "data");
  archive_entry_set_filetype(entry, AE_IFREG);
  archive_write_add_filter_bzip2(writer);
  archive_write_set_format_raw(writer);
  archive_write_set_filter_option(writer, "bzip2", "compression-level", "1");
  archive_write_set_bytes_per_block(writer, 0);
  EXPECT_EQ(archive_write_open_memory(writer, packed.data(), packed.size(), &size), ARCHIVE_OK);
  EXPECT_EQ(archive_write_header(writer, entry), ARCHIVE_OK);
  EXPECT_EQ(archive_write_data(writer, text.data(), text.size()), static_cast<la_ssize_t>(text.size()));
  EXPECT_EQ(archive_write_close(writer), ARCHIVE_OK);
  archive_entry_free(entry);
  archive_write_free(writer);
  return packed.substr(0, size);
}

// Several streams in one file, as written by parallel compressors, followed by padding.
TEST(TextFile, ReadsBzip2) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "some.bz2";
  std::string text;
  for (int i = 0; i < 30'000; ++i) text += std::to_string(i * 7919 % 10'007) + "\n";
  const std::string packed = bzip2(text);
  write(path, packed);
  EXPECT_EQ(TextFile(path).text(), text);
  write(path, packed + packed + std::string(512, '\0'));
  EXPECT_EQ(TextFile(path).text(), text + text);
  for (std::size_t size = 4; size < packed.size(); size += packed.size() / 50) {
    write(path, packed.substr(0, size));
    EXPECT_THAT(message(path), HasSubstr("some.bz2: bzip2 data are damaged or cut short")) << size;
    std::string damaged = packed;
    damaged[size] = static_cast<char>(damaged[size] ^ 0x55);
    write(path, damaged);
    EXPECT_THAT(message(path), HasSubstr("some.bz2: bzip2 data are damaged or cut short")) << size;
  }
}

TEST(TextFile, NamesWhatItCannotRead) {
  EXPECT_THAT(message(test::case_file("containers/page.n")),
              HasSubstr("is a web page (HTML), not data; the server may require"));
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "file";
  write(path, "BZh91AY&SY");
  EXPECT_THAT(message(path), HasSubstr("bzip2 data are damaged or cut short; fetch the file again"));
  write(path, std::string("\xfd"
                          "7zXZ\0\0",
                          7));
  EXPECT_THAT(message(path), HasSubstr("is packed by xz"));
  EXPECT_THAT(message("/dev/zero"), HasSubstr("is a pipe or a device"));
  const auto fifo = folder.path() / "fifo";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_THAT(message(fifo), HasSubstr("is a pipe or a device, not a regular file"));
}

TEST(TextFile, BombsAreRefused) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "bomb.gz";
  gzFile file = gzopen(path.c_str(), "wb9");
  const std::string zeros(1 << 20, '\0');
  for (int i = 0; i < 260; ++i) (void)gzwrite(file, zeros.data(), static_cast<unsigned>(zeros.size()));
  ASSERT_EQ(gzclose(file), Z_OK);
  EXPECT_THAT(message(path, std::size_t{1} << 31), HasSubstr("unpacks to more than 200 times its size"));
  const std::string stream = bzip2(zeros);
  std::string streams;
  for (int i = 0; i < 260; ++i) streams += stream;
  write(path, streams);
  EXPECT_THAT(message(path, std::size_t{1} << 31), HasSubstr("unpacks to more than 256 MiB"));
}

// A streamed file is read in pieces of 32 KiB: line ends must not depend on the ends of the pieces.
TEST(TextFile, LineEndsAtTheEndOfAPiece) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "file";
  constexpr std::size_t kPiece = std::size_t{1} << 15;
  const auto lines_of = [&] {
    std::vector<std::size_t> lengths;
    TextFile file = TextFile::streamed(path);
    while (const auto line = file.next_line()) lengths.push_back(line->size());
    return lengths;
  };
  using testing::ElementsAre;
  write(path, std::string(kPiece - 1, 'a') + "\r\nb\r\n");
  EXPECT_THAT(lines_of(), ElementsAre(kPiece - 1, 1));
  // Carriage returns alone, one of them the last character of a piece, one before it.
  for (const std::size_t length : {kPiece - 5, kPiece - 4, kPiece - 3}) {
    write(path, "ab\r" + std::string(length, 'a') + "\rcde\rf");
    EXPECT_THAT(lines_of(), ElementsAre(2, length, 3, 1));
  }
  // A line feed after a carriage return at the end of a piece, in a file whose first piece has none.
  write(path, "ab\r" + std::string(kPiece - 4, 'a') + "\r\ncde\r\n");
  EXPECT_THAT(lines_of(), ElementsAre(2, kPiece - 4, 3));
}

TEST(ReadBytes, KeepsBytes) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "file";
  const std::string bytes("a\rb\0c\r\n\xff", 8);
  write(path, bytes);
  EXPECT_EQ(read_bytes(path), bytes);
  write(path, bzip2(bytes));
  EXPECT_EQ(read_bytes(path), bytes);
  EXPECT_THROW((void)read_bytes(path, 7), InputError);
}

TEST(Secrets, PasswordsOfAddressesAreHidden) {
  EXPECT_EQ(hide_passwords("poses from ntrip://somebody:SECRET/W@RD@127.0.0.1:9/MOUNT: no response"),
            "poses from ntrip://somebody:...@127.0.0.1:9/MOUNT: no response");
  EXPECT_EQ(hide_passwords("ntrip://me@example.com:SECRET@h:1/M me@example.com:SECRET@h:1/M"),
            "ntrip://...@h:1/M ...@h:1/M");
  EXPECT_EQ(hide_passwords("ntrip://me%40example.com:SECRET@h:1/M"), "ntrip://...@h:1/M");
  EXPECT_EQ(hide_passwords("'tcp://a:b@h:1' and 'tcp://c:d@h:2'"), "'tcp://a:...@h:1' and 'tcp://c:...@h:2'");
  EXPECT_EQ(hide_passwords("ntrip://me%3ASECRET@h:1/M https://TOKEN@h/i"),
            "ntrip://me%3A...@h:1/M https://...@h/i");
  EXPECT_EQ(hide_passwords("https://h/api?box=1,2&api_key=SECRET&Token=SECRET#top answered"),
            "https://h/api?box=1,2&api_key=...&Token=...#top answered");
  EXPECT_EQ(hide_passwords("'MOUNT?token=SECRET' is not a mount point"),
            "'MOUNT?token=...' is not a mount point");
  EXPECT_EQ(hide_passwords("'ntrip:/me:SECRET@h/M', me:SECRET@h:9/M and ntrip//me:SECRET@h are no addresses"),
            "'ntrip:...@h/M', me:...@h:9/M and ntrip//me:...@h are no addresses");
  EXPECT_EQ(hide_passwords("the caster's 'ntrip://me:SECRET WORD@h:1/M' does not answer; it's off"),
            "the caster's 'ntrip://me:...@h:1/M' does not answer; it's off");
  EXPECT_EQ(hide_passwords("https://h/t.json?session=SECRETSESSION&v=1 https://h/t.json#token=SECRET"),
            "https://h/t.json?session=...&v=1 https://h/t.json#token=...");
  EXPECT_EQ(hide_passwords("https://h/t.json;jsessionid=SECRETSESSION"), "https://h/t.json;jsessionid=...");
  for (const char* plain : {"a.csv:12: is bad; look at me@h", "serial:/dev/ttyS0@9600", "12:30:05 at 48.1",
                            "x = '' and \"\"", "it's a 'word"})
    EXPECT_EQ(hide_passwords(plain), plain);
  EXPECT_EQ(hide_passwords("http://me:SECRET@h/i?password=SECRET&rate=1"),
            "http://me:...@h/i?password=...&rate=1");
  for (const char* open :
       {"write ntrip://[USER:PASSWORD@]HOST:PORT/MOUNT", "tcp://127.0.0.1:1 of me@home", "", "a://"})
    EXPECT_EQ(hide_passwords(open), open);
  EXPECT_THAT(InputError("the address 'ntrip://a:SECRET@h' is bad").what(), Not(HasSubstr("SECRET")));
}

}  // namespace
}  // namespace canyon
