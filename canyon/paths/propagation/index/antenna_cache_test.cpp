#include "canyon/paths/propagation/index/antenna_cache.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace canyon::propagation {
namespace {

struct StoredValue {
  int number = 0;
};

/// Counts the existing objects.
struct Counted {
  static inline int alive = 0;
  Counted() { ++alive; }
  ~Counted() { --alive; }
};

TEST(AntennaCache, AntennasInTurnsHaveTheirOwn) {
  const AntennaCache<StoredValue> cache;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(cache.about({20.0 * i, 0, 2}).get(), nullptr);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(cache.about({20.0 * i, 2, 2}).get(), nullptr);
  for (int i = 0; i < 100; ++i) {
    const auto lease = cache.about({20.0 * i, 3, 2});
    ASSERT_NE(lease.get(), nullptr);
    lease.get()->number = i;
  }
  for (int i = 99; i >= 0; --i) EXPECT_EQ(cache.about({20.0 * i, 6, 2.3}).get()->number, i);
}

TEST(AntennaCache, WhatIsTakenIsNotGivenAgain) {
  const AntennaCache<StoredValue> cache;
  for (int i = 0; i < 2; ++i) (void)cache.about({0, 0, 0});
  const auto first = cache.about({1, 0, 0});
  ASSERT_NE(first.get(), nullptr);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(cache.about({1, 0, 0}).get(), nullptr);
  const auto second = cache.about({1, 0, 0});
  ASSERT_NE(second.get(), nullptr);
  EXPECT_NE(second.get(), first.get());
}

TEST(AntennaCache, AntennasThatAreFarHaveNothing) {
  const AntennaCache<StoredValue> cache;
  (void)cache.about({0, 0, 0});
  EXPECT_EQ(cache.about({5.1, 0, 0}).get(), nullptr);
  EXPECT_EQ(cache.about({0, 0, 0.6}).get(), nullptr);
}

/// A map requests many points in sequence: cached data must not stay with entries that are passed on.
TEST(AntennaCache, WhatIsKeptGoesWithItsPlace) {
  const AntennaCache<Counted> cache;
  const int maximum = static_cast<int>(AntennaCache<Counted>::kMax);
  for (int i = 0; i < maximum; ++i) {
    for (int k = 0; k < 3; ++k) (void)cache.about({20.0 * i, 0, 2});
  }
  EXPECT_GT(Counted::alive, maximum / 4);
  for (int i = 0; i < 2 * maximum; ++i) {
    for (int k = 0; k < i % 3; ++k) (void)cache.about({20.0 * i, 100, 2});
  }
  EXPECT_EQ(Counted::alive, 0);
}

TEST(AntennaCache, OldPlacesAreForgotten) {
  const AntennaCache<StoredValue> cache;
  (void)cache.about({-20, 0, 0});
  for (std::uint64_t i = 0; i <= AntennaCache<StoredValue>::kMax; ++i)
    (void)cache.about({20.0 * static_cast<double>(i), 0, 0});
  EXPECT_EQ(cache.about({-20, 0, 0}).get(), nullptr);
}

}  // namespace
}  // namespace canyon::propagation
