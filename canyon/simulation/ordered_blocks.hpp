#pragma once

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <memory>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"

namespace canyon::simulation {

inline constexpr int kMostThreads = 4096;

/// Throws InputError unless `threads` is 0 (as many as cores) to kMostThreads.
inline void check_threads(int threads) {
  if (threads >= 0 && threads <= kMostThreads) return;
  throw InputError(fmt::format("{} threads are out of range", threads),
                   fmt::format("give 0 (as many as cores) to {}", kMostThreads));
}

/// Items [first, first + size) of for_each_in_order() while they are made.
template <typename Item>
class OrderedBlock {
 public:
  OrderedBlock(std::size_t first, std::size_t size) : first_(first), slots_(size), failed_(size) {}

  /// Makes item `i` of the block; thread-safe for different `i`. Nothing behind a failed one is begun.
  template <typename Running, typename Make>
  void make(std::size_t i, const Running& running, const Make& make_item) {
    if (i > failed_.load(std::memory_order_relaxed) || !running()) return;
    try {
      slots_[i].item = make_item(first_ + i);
      slots_[i].done = true;
    } catch (...) {
      slots_[i].error = std::current_exception();
      std::size_t earlier = failed_.load();
      while (i < earlier && !failed_.compare_exchange_weak(earlier, i)) {
      }
    }
    made_.fetch_add(1, std::memory_order_release);
  }

  /// Hands items over in order until one is missing; rethrows where making it failed. False: this was the
  /// end.
  template <typename Running, typename Take>
  bool take(const Running& running, const Take& take_item) {
    // The group's wait orders the threads already; this says so to ThreadSanitizer, which cannot see into
    // TBB.
    (void)made_.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      if (slots_[i].error) std::rethrow_exception(slots_[i].error);
      if (!slots_[i].done || !running()) return false;
      take_item(first_ + i, slots_[i].item);
    }
    return true;
  }

  [[nodiscard]] std::size_t size() const { return slots_.size(); }

 private:
  struct Slot {
    Item item;
    std::exception_ptr error;
    bool done = false;
  };
  std::size_t first_;
  std::vector<Slot> slots_;
  std::atomic<std::size_t> failed_;
  std::atomic<std::size_t> made_{0};
};

/// `threads`, at most as many as cores; 0: as many as cores. Throws InputError where they are out of range.
[[nodiscard]] inline int threads_of(int threads) {
  check_threads(threads);
  // More threads than cores bring nothing, and TBB complains about them on stderr.
  const int cores = tbb::this_task_arena::max_concurrency();
  return threads == 0 ? cores : std::min(threads, cores);
}

/// make(i) for i in [0, count) on `threads` (0: as many as cores; at most that), take(i, item) in ascending
/// order on the calling thread, while the next block is being made. At most two blocks of items exist at a
/// time. Ends early, between items, once running() is false; what was made in order before that may be
/// dropped. An exception of make(i) comes out after take() of all items before i; one of take() at once.
template <typename Item, typename Running, typename Make, typename Take>
void for_each_in_order(std::size_t count, std::size_t block_size, int threads, const Running& running,
                       const Make& make, const Take& take) {
  threads = threads_of(threads);
  const auto size_at = [&](std::size_t first) { return std::min(block_size, count - first); };

  tbb::task_arena arena(threads);
  if (threads == 1) {
    for (std::size_t first = 0; first < count; first += block_size) {
      OrderedBlock<Item> block(first, size_at(first));
      arena.execute([&] {
        for (std::size_t i = 0; i < block.size(); ++i) block.make(i, running, make);
      });
      if (!block.take(running, take)) return;
    }
    return;
  }

  tbb::task_group group;
  const auto begin_block = [&](std::size_t first) {
    auto block = std::make_unique<OrderedBlock<Item>>(first, size_at(first));
    OrderedBlock<Item>* raw = block.get();
    arena.execute([&group, &running, &make, raw] {
      group.run([&running, &make, raw] {
        tbb::parallel_for(std::size_t{0}, raw->size(), [&](std::size_t i) { raw->make(i, running, make); });
      });
    });
    return block;
  };
  const auto wait = [&] { arena.execute([&group] { group.wait(); }); };

  std::unique_ptr<OrderedBlock<Item>> next = count > 0 ? begin_block(0) : nullptr;
  for (std::size_t first = 0; next != nullptr; first += block_size) {
    wait();
    const std::unique_ptr<OrderedBlock<Item>> block = std::move(next);
    if (count - first > block_size && running()) next = begin_block(first + block_size);
    bool more = false;
    try {
      more = block->take(running, take);
    } catch (...) {
      wait();  // the next block's tasks refer to it and to `make`
      throw;
    }
    if (!more) {
      wait();
      return;
    }
  }
}

}  // namespace canyon::simulation
