#include "canyon/base/text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "canyon/base/named.hpp"

namespace canyon {

namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Text, TrimTakesBlanksOfEveryKindAtBothEnds) {
  EXPECT_EQ(trim(" \t a b\r\n"), "a b");
  EXPECT_EQ(trim(" \t "), "");
  EXPECT_EQ(trim(""), "");
}

TEST(Text, SplitKeepsEmptyPieces) {
  EXPECT_THAT(split("a,,b", ','), ElementsAre("a", "", "b"));
  EXPECT_THAT(split("", ','), ElementsAre(""));
  EXPECT_THAT(split(",", ','), ElementsAre("", ""));
  EXPECT_THAT(split(" a , b", ','), ElementsAre(" a ", " b"));
}

TEST(Text, SplitBlanksDropsThem) {
  EXPECT_THAT(split_blanks("  a \t bc  d\r\n"), ElementsAre("a", "bc", "d"));
  EXPECT_THAT(split_blanks(" \t "), IsEmpty());
  EXPECT_THAT(split_blanks(""), IsEmpty());
}

TEST(Text, ParseDoubleReadsNumbersAsFilesWriteThem) {
  EXPECT_EQ(parse_double("1.5"), 1.5);
  EXPECT_EQ(parse_double("  -2.5e-3 "), -2.5e-3);
  EXPECT_EQ(parse_double("+.5"), 0.5);
  EXPECT_EQ(parse_double("7."), 7);
  EXPECT_EQ(parse_double("-3.328546881676D-06"), -3.328546881676e-06);  // RINEX
  EXPECT_EQ(parse_double("0.1d2"), 10);
  EXPECT_EQ(parse_double("1e-999"), 0);  // too small for a double
}

TEST(Text, ParseDoubleGivesTheNearestDouble) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 100'000; ++i) {
    std::string text = std::to_string(random() >> (random() % 60));
    text = text.substr(0, 1 + random() % 18);
    text.insert(random() % (text.size() + 1), ".");
    if (random() % 2 == 0) text.insert(0, "-");
    EXPECT_EQ(parse_double(text), std::strtod(text.c_str(), nullptr)) << text;
  }
  EXPECT_TRUE(std::signbit(parse_double("-0.0").value()));
}

TEST(Text, ParseDoubleRefusesEverythingElse) {
  for (const char* text :
       {"",    " ",   "abc", "1.5x",     "1 2",  "--1",   "1e",    "e5",     "D5",    "1.2.3", "1,5",
        "nan", "NaN", "inf", "infinity", "0x10", "0x1p3", "1e999", "-1e999", "1_000", "$",     "."}) {
    EXPECT_EQ(parse_double(text), std::nullopt) << '"' << text << '"';
  }
  EXPECT_EQ(parse_double(std::string(80, '1')), std::nullopt);
  EXPECT_EQ(parse_double(std::string_view("1\0002", 3)), std::nullopt);
}

TEST(Text, ParseDoubleIgnoresTheProgramsLocale) {
  const std::string before = std::setlocale(LC_NUMERIC, nullptr);
  const bool comma = std::setlocale(LC_NUMERIC, "de_DE.UTF-8") != nullptr;
  EXPECT_EQ(parse_double("1.5"), 1.5);
  EXPECT_EQ(parse_double("1,5"), std::nullopt);
  std::setlocale(LC_NUMERIC, before.c_str());
  if (!comma)
    GTEST_SKIP() << "SKIPPED: no locale with a decimal comma is installed; tried in the C locale only";
}

TEST(Text, ParseIntegerReadsWholeIntegersOnly) {
  EXPECT_EQ(parse_integer("42"), 42);
  EXPECT_EQ(parse_integer(" -7 "), -7);
  EXPECT_EQ(parse_integer("+7"), 7);
  EXPECT_EQ(parse_integer("007"), 7);
  EXPECT_EQ(parse_integer("9223372036854775807"), std::numeric_limits<long long>::max());
  EXPECT_EQ(parse_integer("-9223372036854775808"), std::numeric_limits<long long>::min());
  for (const char* text :
       {"", " ", "+", "-", "+-5", "-+5", "++5", "1.0", "1e3", "0x10", "12a", "1 2", "9223372036854775808"}) {
    EXPECT_EQ(parse_integer(text), std::nullopt) << '"' << text << '"';
  }
}

TEST(Text, ColumnGivesWhatThereIs) {
  EXPECT_EQ(column("abcdef", 2, 3), "cde");
  EXPECT_EQ(column("abcdef", 4, 10), "ef");
  EXPECT_EQ(column("abcdef", 6, 1), "");
  EXPECT_EQ(column("abcdef", 99, 1), "");
}

TEST(Text, ClosestFindsSlipsOfThePen) {
  const std::vector<std::string> keys{"elevation_mask_deg", "seed", "systems"};
  EXPECT_EQ(closest("elevation_mask", keys), "elevation_mask_deg");
  EXPECT_EQ(closest("sede", keys), "seed");
  EXPECT_EQ(closest("system", keys), "systems");
  EXPECT_EQ(closest("trajectory", keys), std::nullopt);
  EXPECT_EQ(closest("seed", {}), std::nullopt);
  EXPECT_EQ(did_you_mean(closest("sede", keys), "write a key"), "did you mean 'seed'?");
  EXPECT_EQ(did_you_mean(closest("trajectory", keys), "write a key"), "write a key");
}

TEST(Named, AnUnknownNameIsAnErrorWithTheCloseOneAndTheKnown) {
  struct Entry {
    std::string name;
    int value;
  };
  std::vector<Entry> table{{"hdop", 1}, {"vdop", 2}};
  EXPECT_EQ(entry_named(table, "vdop", "layer").value, 2);
  const auto message = [&](const char* name) {
    try {
      (void)entry_named(table, name, "layer");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("found");
  };
  EXPECT_EQ(message("hdob"), "there is no layer 'hdob'; did you mean 'hdop'? known: hdop, vdop");
  EXPECT_EQ(message("elevation"), "there is no layer 'elevation'; known: hdop, vdop");
  // A long list is no help in addition to the close name.
  while (table.size() < 21) table.push_back({"number " + std::to_string(table.size()), 0});
  EXPECT_EQ(message("hdob"), "there is no layer 'hdob'; did you mean 'hdop'?");
}

TEST(Text, LowerCaseTouchesAsciiLettersOnly) {
  EXPECT_EQ(lower_case("AZaz09.OSM"), "azaz09.osm");
  EXPECT_EQ(lower_case("\xC3\x84"), "\xC3\x84");  // a UTF-8 letter
}

// The published vectors of the hash: offset basis for empty input, then "a" and "foobar" (FNV test suite).
TEST(Text, Fnv1aOfPublishedVectors) {
  EXPECT_EQ(fnv1a(""), 0xcbf29ce484222325U);
  EXPECT_EQ(fnv1a("a"), 0xaf63dc4c8601ec8cU);
  EXPECT_EQ(fnv1a("foobar"), 0x85944171f73967e8U);
}

TEST(TextTable, AlignsNumbersToTheRightAndWordsToTheLeft) {
  EXPECT_EQ(text_table({"sat", "deg", "word"}, {{"G01", "1.5", "9 m"}, {"G02", "-"}, {"", "100.25", "x"}}),
            "sat     deg  word\n"
            "G01     1.5  9 m\n"
            "G02       -\n"
            "     100.25  x\n");
}

TEST(TextTable, CountsCharactersNotBytes) {
  EXPECT_EQ(text_table({"name", "n"}, {{"Z\u00fcrich", "1"}}),
            "name    n\n"
            "Z\u00fcrich  1\n");
}

TEST(TextTable, HasTheGivenWordsAnIndentAndARule) {
  EXPECT_EQ(text_table({"", "car"}, {{"error", "1 of 2"}, {"2", "-"}}, {1, "  ", true}),
            "            car\n"
            "  -------------\n"
            "  error  1 of 2\n"
            "  2           -\n");
}

TEST(MarkdownTable, EscapesBarsAndLeavesEmptyCellsEmpty) {
  EXPECT_EQ(markdown_table({"a", "b"}, {{"x|y", ""}}),
            "| a | b |\n"
            "|---|---|\n"
            "| x\\|y | |\n");
}

}  // namespace

}  // namespace canyon
