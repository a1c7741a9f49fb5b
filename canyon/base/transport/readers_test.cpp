#include "canyon/base/transport/link.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace canyon::transport {
namespace {

using ::testing::ElementsAre;

TEST(LineCutter, GivesLinesHoweverTheyAreCutAndSaysWhichWereTooLong) {
  LineCutter cutter(4);
  std::vector<std::string> lines;
  const auto take = [&](std::optional<std::string_view> line) { lines.emplace_back(line.value_or("long")); };
  for (const char* piece : {"a", "b\nc\n", "\nabcd\nabcde", "fgh\nx", "y"}) cutter.receive(piece, take);
  EXPECT_THAT(lines, ElementsAre("ab", "c", "", "abcd", "long"));
  EXPECT_EQ(cutter.rest(), "xy");
  cutter.finish(take);
  EXPECT_EQ(lines.back(), "xy");
  EXPECT_EQ(cutter.rest(), "");
  cutter.receive("abcdef", take);
  EXPECT_EQ(cutter.rest(), "") << "nothing is kept of what is too long";
}

TEST(LineCutter, ADatagramEndsItsLine) {
  LineCutter cutter(4);
  std::vector<std::string> lines;
  const auto take = [&](std::optional<std::string_view> line) { lines.emplace_back(line.value_or("long")); };
  for (const char* datagram : {"ab", "c\nd", "e\n", "", "fghij", "k"}) {
    cutter.receive(Received{1, datagram, true}, take);
  }
  EXPECT_THAT(lines, ElementsAre("ab", "c", "d", "e", "long", "k"));
  cutter.receive(Received{1, "l"}, take);
  cutter.receive(Received{1, "m\n"}, take);
  EXPECT_EQ(lines.back(), "lm");
}

TEST(Readers, ForgetTheOneThatNobodyAskedForForLongest) {
  Readers<std::string> readers;
  for (std::uint64_t reader = 1; reader <= Readers<std::string>::kMax; ++reader) readers.of(reader) += "x";
  EXPECT_EQ(readers.of(1), "x");
  readers.of(1000) = "new";
  ASSERT_NE(readers.find(1), nullptr);
  EXPECT_EQ(readers.of(1), "x");
  EXPECT_EQ(readers.find(2), nullptr);
  EXPECT_EQ(readers.of(2), "") << "begins anew";
}

}  // namespace
}  // namespace canyon::transport
