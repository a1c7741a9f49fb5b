#include "canyon/simulation/epoch_schedule.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace canyon::simulation {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(EpochSchedule, CountsFromTimeZero) {
  EpochSchedule schedule(0.5, 3);
  std::vector<std::int64_t> taken;
  while (!schedule.over()) taken.push_back(schedule.take());
  EXPECT_EQ(taken, (std::vector<std::int64_t>{0, kSecond / 2, kSecond}));
  EXPECT_EQ(schedule.next_ns(), 3 * kSecond / 2);
  EXPECT_EQ(EpochSchedule(1.0 / 3).interval_ns(), 333'333'333);
  EXPECT_EQ(EpochSchedule(1e-12).interval_ns(), 1);
  EXPECT_EQ(EpochSchedule(0.5).lagging(7).at_ns(2), kSecond + 7);
  EXPECT_EQ(EpochSchedule::count_within(1, 0.5), 3);
  EXPECT_EQ(EpochSchedule::count_within(0.99, 0.5), 2);
  EXPECT_EQ(EpochSchedule::count_within(0.3, 0.1), 4);  // 0.3 is a little less than three times 0.1
}

TEST(EpochSchedule, LeavesOutWhatIsLate) {
  EpochSchedule schedule(1, 10);
  EXPECT_EQ(schedule.catch_up(4 * kSecond + 1), 4);
  EXPECT_EQ(schedule.take(), 4 * kSecond);
  EXPECT_EQ(schedule.catch_up(100 * kSecond), 4);  // the last one is kept
  EXPECT_EQ(schedule.take(), 9 * kSecond);
  EXPECT_TRUE(schedule.over());
  EpochSchedule started(1, 3);
  started.begin_at(100 * kSecond);
  EXPECT_EQ(started.next_ns(), 100 * kSecond);
  for (int i = 0; i < 3; ++i) (void)started.take();
  EXPECT_TRUE(started.over());
  started.go_to(-1);
  EXPECT_EQ(started.next_ns(), 0);
}

std::vector<int> due_steps(EpochSchedule& schedule, std::int64_t step_ns, int first, int last) {
  std::vector<int> due;
  for (int i = first; i <= last; ++i) {
    if (schedule.step(i * step_ns)) due.push_back(i);
  }
  return due;
}

TEST(EpochSchedule, TakesTheFirstStepAtOrBehindEachInstant) {
  constexpr std::int64_t kStep = 40'000'000;  // 25 Hz, and epochs of 10 Hz
  EpochSchedule schedule(0.1);
  EXPECT_EQ(due_steps(schedule, kStep, 0, 8), (std::vector<int>{0, 3, 5, 8}));
  // A world that is reset repeats them; one that begins late begins with its first step.
  EXPECT_EQ(due_steps(schedule, kStep, 0, 5), (std::vector<int>{0, 3, 5}));
  EpochSchedule late(0.1);
  EXPECT_EQ(due_steps(late, kStep, 4, 8), (std::vector<int>{4, 5, 8}));
  // One epoch per step if the steps are slower.
  EpochSchedule fast(0.001);
  EXPECT_EQ(due_steps(fast, kStep, 0, 3), (std::vector<int>{0, 1, 2, 3}));
}

TEST(EpochSchedule, ChangesItsIntervalWhileItRuns) {
  EpochSchedule schedule(0.1);
  EXPECT_TRUE(schedule.step(0));
  EXPECT_FALSE(schedule.step(kSecond / 20));
  schedule.set_interval(1);
  EXPECT_FALSE(schedule.step(kSecond / 2));
  EXPECT_TRUE(schedule.step(kSecond));
}

}  // namespace
}  // namespace canyon::simulation
