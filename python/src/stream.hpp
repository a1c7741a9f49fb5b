#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "canyon/simulation/simulator.hpp"
#include "python/src/binding.hpp"

namespace canyon::python {

/// A run in its own thread that passes on its sink's results, epoch by epoch.
template <typename Item>
class Stream {
 public:
  using Push = std::function<void(Item)>;
  using MakeSink = std::function<std::unique_ptr<simulation::EpochSink>(Push)>;

  /// @param max_queued maximum queued items
  Stream(std::shared_ptr<simulation::Simulation> simulation, const simulation::RunOptions& options,
         std::size_t max_queued, const MakeSink& make_sink)
      : simulation_(std::move(simulation)),
        max_queued_(max_queued),
        sink_(make_sink([this](Item item) { push(std::move(item)); })),
        worker_([this, options] { work(options); }) {}
  ~Stream() {
    try {
      close();
    } catch (...) {  // exceptions of threads and mutexes, which cannot be handled here
    }
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Throws py::stop_iteration at the end of the run, or the exception that ended it early.
  Item next() {
    std::optional<Item> item;
    while (true) {
      bool over = false;
      {
        const py::gil_scoped_release release;
        std::unique_lock lock(mutex_);
        filled_.wait_for(lock, std::chrono::milliseconds(100), [&] { return !queue_.empty() || done_; });
        if (!queue_.empty()) {
          item = std::move(queue_.front());
          queue_.pop_front();
          taken_.notify_one();
        } else {
          over = done_;
        }
      }
      if (item) return std::move(*item);
      if (over) break;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    throw py::stop_iteration();
  }

  void close() {
    const py::gil_scoped_release release;  // the worker may wait for the GIL
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
      taken_.notify_one();
    }
    if (worker_.joinable()) worker_.join();
  }

 private:
  void push(Item item) {
    std::unique_lock lock(mutex_);
    taken_.wait(lock, [&] { return queue_.size() < max_queued_ || stop_; });
    if (stop_) return;
    queue_.push_back(std::move(item));
    filled_.notify_one();
  }

  void work(simulation::RunOptions options) {
    options.stop = &stop_;
    try {
      (void)simulation_->run({sink_.get()}, options);
    } catch (...) {
      failure_ = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    done_ = true;
    filled_.notify_one();
  }

  std::shared_ptr<simulation::Simulation> simulation_;
  std::size_t max_queued_;
  std::mutex mutex_;
  std::condition_variable filled_, taken_;
  std::deque<Item> queue_;
  std::exception_ptr failure_;
  std::atomic<bool> stop_{false};
  bool done_ = false;
  std::unique_ptr<simulation::EpochSink> sink_;
  std::thread worker_;  // last: it uses the others
};

}  // namespace canyon::python
