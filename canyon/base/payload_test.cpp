#include "canyon/base/payload.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace canyon {
namespace {

// RFC 4648, section 10.
TEST(Base64, TestVectorsBothWays) {
  const std::array<std::array<std::string, 2>, 5> vectors{
      {{"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foobar", "Zm9vYmFy"}}};
  for (const auto& [bytes, text] : vectors) {
    EXPECT_EQ(base64(bytes), text);
    EXPECT_EQ(from_base64(text), bytes);
  }
  EXPECT_EQ(from_base64("Zg"), "f");
  EXPECT_EQ(from_base64("Z*=="), std::nullopt);
}

}  // namespace
}  // namespace canyon
