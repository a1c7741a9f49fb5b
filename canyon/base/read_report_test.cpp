#include "canyon/base/read_report.hpp"

#include <gmock/gmock.h>

namespace canyon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(ReadReport, CountRecordsByReason) {
  ReadReport notes("a.txt");
  EXPECT_THAT(notes.lines(), IsEmpty());
  notes.loss(3, "the height '12x' of G05 is not a number");
  notes.loss(4, "the height 'y' of G05 is not a number");
  notes.remark(5, "point without a fix", "left out");
  notes.loss(6, "epoch 2024-02-29T05:00:00 (7 of 9) is wrong", "gone");
  notes.loss(7, "the height 'z' of G06 is not a number");
  notes.remark(8, "point without a fix", "left out");
  notes.loss(9, "epoch 2024-02-29T05:15:00 (-2.5 of 9) is wrong", "gone");
  notes.guess(0, "it has no heights", "0 is taken");
  EXPECT_THAT(notes.lines(),
              ElementsAre("a.txt:3: the height '12x' of G05 is not a number (the first of 2); left out",
                          "a.txt:5: point without a fix (the first of 2); left out",
                          "a.txt:6: epoch 2024-02-29T05:00:00 (7 of 9) is wrong (the first of 2); gone",
                          "a.txt:7: the height 'z' of G06 is not a number; left out",
                          "a.txt: it has no heights; 0 is taken"));
  EXPECT_THAT(notes.lines(ReadReport::Level::Loss), SizeIs(3));
  EXPECT_THAT(notes.warnings(), SizeIs(4)) << "remarks are not shown unasked";
  EXPECT_EQ(notes.losses(), 5U);
  EXPECT_EQ(notes.count("point without a fix"), 2U);
  EXPECT_EQ(notes.count("another reason"), 0U);
}

TEST(ReadReport, WholeLinesAndThingsByKind) {
  using Level = ReadReport::Level;
  ReadReport city("map.osm");
  for (int i = 0; i < 22; ++i)
    city.add_counted(Level::Loss, "{} ways without nodes, left out", "way/" + std::to_string(i));
  city.add_counted(Level::Remark, "replaced by its parts");
  city.add_counted(Level::Remark, "replaced by its parts");
  city.add_line(Level::Guess, "5 of 9 heights are guesses");
  const std::vector<std::string> lines = city.lines();
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].substr(0, 50), "map.osm: 22 ways without nodes, left out: way/0, w");
  EXPECT_EQ(lines[0].substr(lines[0].size() - 17), "way/19 and 2 more");
  EXPECT_EQ(lines[1], "map.osm: replaced by its parts (2 times)");
  // A report that gets the same note twice in a run lists it once.
  ReadReport run;
  run.append(city);
  run.append(city);
  run.add_line(Level::Guess, "5 of 9 heights are guesses");
  EXPECT_EQ(run.entries(), city.entries());
  EXPECT_THAT(run.warnings(), ElementsAre(lines[0], lines[2]));
}

TEST(ReadReport, FiveWarningsAreShownWithTwoGuesses) {
  ReadReport report;
  for (const char* what : {"a", "b", "c", "d", "e", "f"}) report.add_line(ReadReport::Level::Loss, what);
  EXPECT_THAT(report.shown("x"), ElementsAre("a", "b", "c", "d", "e", "1 more warning: x"));
  for (const char* what : {"g", "h", "i"}) report.add_line(ReadReport::Level::Guess, what);
  report.add_line(ReadReport::Level::Remark, "r");
  EXPECT_THAT(report.shown("x"), ElementsAre("a", "b", "c", "g", "h", "4 more warnings: x"));
}

TEST(ReadReport, ListTwentyReasonsWhyRecordsAreBad) {
  ReadReport notes("a.txt");
  for (char c = 'a'; c <= 'z'; ++c)
    for (int i = 0; i < 2; ++i) notes.loss(1, std::string("reason ") + c);
  const std::vector<std::string> lines = notes.lines();
  ASSERT_EQ(lines.size(), ReadReport::kListed + 1);
  EXPECT_EQ(lines.back(), "a.txt: 12 more damaged records; left out");
}

TEST(ReadReport, RefuseAFileWhoseRecordsAreMostlyBad) {
  ReadReport notes("a.txt");
  EXPECT_NO_THROW(notes.require_majority(0));
  notes.guard([] { throw InputError("a.txt", 2, "it is wrong", "mend it"); });
  notes.guard([] {});
  notes.loss(5, "it is wrong too");
  EXPECT_NO_THROW(notes.require_majority(3));
  const auto what = [&](std::size_t good) -> std::string {
    try {
      notes.require_majority(good);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(what(2), "a.txt:2: it is wrong (the first of 2 bad records of 4); mend it");
  EXPECT_EQ(what(0), "a.txt:2: it is wrong; mend it");
}

}  // namespace
}  // namespace canyon
