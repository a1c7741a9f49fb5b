#include "canyon/base/input_error.hpp"

#include <gtest/gtest.h>

namespace canyon {
namespace {

TEST(InputError, SaysFileLineProblemAndCure) {
  const InputError error("city.yaml", 12, "mask 95 deg is out of range", "it runs from 0 to 90");
  EXPECT_STREQ(error.what(), "city.yaml:12: mask 95 deg is out of range; it runs from 0 to 90");
  EXPECT_EQ(error.file(), "city.yaml");
  EXPECT_EQ(error.line(), 12);
  EXPECT_EQ(error.problem(), "mask 95 deg is out of range");
  EXPECT_EQ(error.hint(), "it runs from 0 to 90");
}

TEST(InputError, LeavesOutWhatIsNotKnown) {
  EXPECT_STREQ(InputError("bad").what(), "bad");
  EXPECT_STREQ(InputError("bad", "mend it").what(), "bad; mend it");
  EXPECT_STREQ(InputError("a.txt", 0, "is empty").what(), "a.txt: is empty");
  EXPECT_STREQ(InputError("", 7, "bad").what(), "bad");
  EXPECT_EQ(InputError("bad").line(), 0);
}

TEST(InputError, IsARuntimeErrorForCallersThatKnowNoBetter) {
  EXPECT_THROW(throw InputError("bad"), std::runtime_error);
}

}  // namespace
}  // namespace canyon
