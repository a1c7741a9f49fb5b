#include "canyon/simulation/ordered_blocks.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <stdexcept>
#include <thread>

namespace canyon::simulation {
namespace {

constexpr auto kAlways = [] { return true; };

TEST(OrderedBlocks, HandsOverInOrderOnTheCallingThread) {
  for (const int threads : {1, 2, 4, 0}) {
    for (const std::size_t count :
         {std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{8}, std::size_t{1001}}) {
      std::vector<std::size_t> taken;
      const auto caller = std::this_thread::get_id();
      for_each_in_order<std::size_t>(
          count, 8, threads, kAlways, [](std::size_t i) { return i * i; },
          [&](std::size_t i, std::size_t item) {
            EXPECT_EQ(std::this_thread::get_id(), caller);
            EXPECT_EQ(item, i * i);
            taken.push_back(i);
          });
      std::vector<std::size_t> expected(count);
      std::iota(expected.begin(), expected.end(), 0U);
      EXPECT_EQ(taken, expected);
    }
  }
}

TEST(OrderedBlocks, KeepsWhatComesBeforeAFailure) {
  for (const int threads : {1, 2, 4}) {
    std::size_t taken = 0;
    EXPECT_THROW(for_each_in_order<int>(
                     1000, 16, threads, kAlways,
                     [](std::size_t i) {
                       if (i == 77 || i == 79) throw std::runtime_error(std::to_string(i));
                       return 0;
                     },
                     [&](std::size_t, int) { ++taken; }),
                 std::runtime_error);
    EXPECT_EQ(taken, 77U);
  }
}

TEST(OrderedBlocks, AFailureWhileTakingComesOut) {
  for (const int threads : {1, 2, 4}) {
    EXPECT_THROW(for_each_in_order<int>(
                     1000, 16, threads, kAlways, [](std::size_t) { return 0; },
                     [&](std::size_t i, int) {
                       if (i == 20) throw std::runtime_error("full");
                     }),
                 std::runtime_error);
  }
}

TEST(OrderedBlocks, StopsBetweenItems) {
  for (const int threads : {1, 2, 4}) {
    std::atomic<bool> stop{false};
    std::size_t taken = 0;
    for_each_in_order<int>(
        1000, 16, threads, [&] { return !stop.load(); }, [](std::size_t) { return 0; },
        [&](std::size_t i, int) {
          ++taken;
          if (i == 20) stop = true;
        });
    EXPECT_EQ(taken, 21U);
  }
}

TEST(OrderedBlocks, RefusesAbsurdThreads) {
  const auto run = [](int threads) {
    for_each_in_order<int>(
        1, 1, threads, kAlways, [](std::size_t) { return 0; }, [](std::size_t, int) {});
  };
  EXPECT_THROW(run(-1), InputError);
  EXPECT_THROW(run(100'000), InputError);
}

}  // namespace
}  // namespace canyon::simulation
