#include "canyon/drawing/frame_files.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <exception>
#include <thread>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"

namespace canyon::drawing {

std::string frame_name(std::size_t index) {
  return fmt::format("frame_{:06}.png", index + 1);
}

std::size_t write_frames(const std::filesystem::path& folder, std::size_t count,
                         const std::function<std::string(std::size_t)>& draw, const FrameOptions& options) {
  if (count > kMostFrames) {
    throw InputError(fmt::format("{} frames are more than {}", count, kMostFrames),
                     "take a longer step between frames, or a shorter piece of the drive");
  }
  make_output_folder(folder);
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t threads =
      options.threads > 0 ? std::min(cores, static_cast<std::size_t>(options.threads)) : cores;
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  std::size_t written = 0;
  while (written < count && !(options.stop != nullptr && *options.stop)) {
    const std::size_t begin = written, size = std::min(threads, count - begin);
    std::vector<std::string> frames(size);
    std::vector<std::exception_ptr> failures(size);
    tbb::parallel_for(std::size_t{0}, size, [&](std::size_t i) {
      try {
        frames[i] = draw(begin + i);
      } catch (...) {
        failures[i] = std::current_exception();
      }
    });
    for (std::size_t i = 0; i < size; ++i) {
      if (failures[i]) std::rethrow_exception(failures[i]);
      write_file(folder / frame_name(written), frames[i]);
      ++written;
    }
    if (options.progress) options.progress(written, count);
  }
  return written;
}

}  // namespace canyon::drawing
