#include "canyon/base/output_file.hpp"

#include <gtest/gtest.h>

#include <string>

namespace canyon {
namespace {

std::string all_of(const Spool::Text& text) {
  std::string bytes;
  text.read([&](std::string_view more) { bytes += more; });
  return bytes;
}

TEST(Spool, TextsThatGrowSideBySideAreRead) {
  Spool spool;
  Spool::Text a(spool), b(spool), none(spool);
  std::string from_a, from_b;
  for (int i = 0; i < 20'000; ++i) {
    const std::string piece = std::to_string(i) + std::string(static_cast<std::size_t>(i % 40), 'x');
    a.add(piece);
    from_a += piece;
    if (i % 7 != 0) continue;
    b.add(piece);
    from_b += piece;
  }
  b.add(std::string(100'000, 'y'));
  from_b += std::string(100'000, 'y');
  EXPECT_TRUE(all_of(a) == from_a);
  EXPECT_TRUE(all_of(b) == from_b);
  EXPECT_TRUE(none.empty());
  EXPECT_FALSE(a.empty());
  a.add("end");
  EXPECT_TRUE(all_of(a) == from_a + "end") << "it can be read and go on";
}

}  // namespace
}  // namespace canyon
