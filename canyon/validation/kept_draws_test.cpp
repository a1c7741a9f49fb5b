#include "canyon/validation/kept_draws.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "canyon/base/input_error.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::validation {
namespace {

EnsembleRow some_row() {
  EnsembleRow row;
  row.name = "drive";
  row.part = "second half";
  row.unknowns = {"level: normal"};
  Headline p50;
  p50.key = "horizontal_p50_m";
  p50.measured = 8.5;
  p50.simulated = 6.1;
  Headline p95 = p50;
  p95.key = "horizontal_p95_m";
  row.point = {p50, p95};
  return row;
}

EnsembleRow::Draw some_draw(double level, double p50) {
  EnsembleRow::Draw draw;
  draw.values = {{"level", level}};
  draw.headlines = some_row().point;
  draw.headlines[0].simulated = p50;
  draw.headlines[1].simulated.reset();
  return draw;
}

TEST(KeptDraws, ComeBackAsTheyWere) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "draws.jsonl";
  const std::string identity = KeptDraws::identity({some_row()}, 20, 1);
  {
    KeptDraws kept(file, identity);
    EXPECT_EQ(kept.size(), 0U);
    kept.add("drive", 0, some_draw(-3.25, 0.1 + 0.2));
    kept.add("drive", 1, some_draw(4, 7));
  }
  const KeptDraws again(file, identity);
  EXPECT_EQ(again.size(), 2U);
  const auto draw = again.find(some_row(), 0);
  ASSERT_TRUE(draw);
  EXPECT_EQ(draw->values.at("level"), -3.25);
  EXPECT_EQ(draw->headlines[0].simulated, 0.1 + 0.2) << "to the last bit";
  EXPECT_EQ(draw->headlines[0].measured, 8.5);
  EXPECT_FALSE(draw->headlines[1].simulated);
  EXPECT_FALSE(again.find(some_row(), 2));
}

TEST(KeptDraws, ALineThatWasCutIsDropped) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "draws.jsonl";
  const std::string identity = KeptDraws::identity({some_row()}, 20, 1);
  KeptDraws(file, identity).add("drive", 0, some_draw(1, 2));
  std::ofstream(file, std::ios::app) << R"({"recording":"drive","dr)";
  {
    KeptDraws kept(file, identity);
    EXPECT_EQ(kept.size(), 1U);
    kept.add("drive", 1, some_draw(3, 4));
  }
  EXPECT_EQ(KeptDraws(file, identity).size(), 2U);
}

TEST(KeptDraws, OfAnotherEnsembleAreRefused) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "draws.jsonl";
  const std::string identity = KeptDraws::identity({some_row()}, 20, 1);
  KeptDraws(file, identity).add("drive", 0, some_draw(1, 2));
  EnsembleRow other = some_row();
  other.point[0].simulated = 6.2;
  for (const std::string& another :
       {KeptDraws::identity({some_row()}, 21, 1), KeptDraws::identity({some_row()}, 20, 2),
        KeptDraws::identity({other}, 20, 1)}) {
    EXPECT_THAT(test::refusal([&] { KeptDraws(file, another); }), testing::HasSubstr("another ensemble"));
  }
  std::ofstream(file, std::ios::app) << "{}\n";
  EXPECT_THAT(test::refusal([&] { KeptDraws(file, identity); }),
              testing::HasSubstr("draws.jsonl:3: the line is not a valid draw"));
}

}  // namespace
}  // namespace canyon::validation
