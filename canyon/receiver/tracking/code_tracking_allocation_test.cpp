// Code lock on many paths over many epochs allocates nothing.

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "canyon/receiver/tracking/code_tracking.hpp"
#include "tests/support/count_allocations.hpp"

#ifdef CANYON_COUNTS_ALLOCATIONS

namespace canyon::tracking {
namespace {

using test::allocations;

TEST(CodeTracker, AllocatesNothing) {
  for (const double bandwidth : {std::numeric_limits<double>::infinity(), 8e6}) {
    CorrelationOptions signal;
    signal.bandwidth_hz = bandwidth;
    const CodeTracker tracker(signal, {});
    std::vector<SignalPath> paths(64);
    for (std::size_t i = 0; i < paths.size(); ++i) {
      paths[i] = {10.0 * static_cast<double>(i), std::polar(0.3, 1.7 * static_cast<double>(i)), 0.1};
    }
    paths[0].amplitude = 3;
    const long before = allocations;
    double sum = 0;
    for (int k = 0; k < 100; ++k) {
      paths[1].delay_m = k;
      if (const auto lock = tracker.lock(paths, 0.0)) sum += lock->delay_m;
      if (const auto lock = tracker.lock(paths)) sum += lock->delay_m;
    }
    EXPECT_EQ(allocations - before, 0);
    EXPECT_NE(sum, 0);
  }
}

}  // namespace
}  // namespace canyon::tracking

#endif
