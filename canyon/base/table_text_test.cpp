#include "canyon/base/table_text.hpp"

#include <gtest/gtest.h>

namespace canyon {
namespace {

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
