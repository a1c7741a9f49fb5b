
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/base/statistics.hpp"

namespace canyon {
namespace {

// Above kExact values quantiles are within 0.1 % of those of all values.
TEST(Distribution, OfManyValuesIsNearlyThatOfAll) {
  Distribution growing;
  EXPECT_FALSE(growing.quantile(0.5));
  std::vector<double> values;
  RandomStream stream(1, "distribution test");
  for (std::size_t i = 0; i < 2 * Distribution::kExact; ++i) {
    values.push_back(std::exp(2 * stream.normal()));
    growing.add(values.back());
    if (i + 1 == Distribution::kExact) {
      EXPECT_EQ(growing.quantile(0.95), quantile(values, 0.95));
    }
  }
  for (const double p : {0.0, 0.01, 0.5, 0.95, 0.999, 1.0}) {
    const double exact = *quantile(values, p);
    EXPECT_NEAR(*growing.quantile(p), exact, 1e-3 * exact) << p;
  }
  EXPECT_EQ(growing.quantile(1), quantile(values, 1));
  Distribution latencies(0);
  EXPECT_FALSE(latencies.quantile(0.99));
  latencies.add(5.33e-3);
  EXPECT_EQ(latencies.quantile(0.99), 5.33e-3) << "no more than the greatest";
  for (int i = 0; i < 10; ++i) latencies.add(0);
  EXPECT_NEAR(*latencies.quantile(0.5), 0, 1e-6);
  EXPECT_EQ(latencies.count(), 11U);
}

}  // namespace
}  // namespace canyon
