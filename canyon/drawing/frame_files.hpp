#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

namespace canyon::drawing {

struct FrameOptions {
  int threads = 0;                          ///< 0: as many as cores; never more than those
  const std::atomic<bool>* stop = nullptr;  ///< set to end after the frames in flight
  /// Called now and then from the calling thread: frames done, frames in all.
  std::function<void(std::size_t, std::size_t)> progress;
};

inline constexpr std::size_t kMostFrames = 999'999;
/// "frame_000001.png" for the first (index 0).
[[nodiscard]] std::string frame_name(std::size_t index);

/// Draws frames 0 to count - 1 on several threads and writes them into `folder` in order, each whole or not
/// at all; returns how many: fewer than `count` after a stop. So the files on the disk never have a gap.
/// @param draw bytes of a frame's PNG; called from several threads at once
/// Throws InputError where there are more than kMostFrames, where the folder cannot be made or written to,
/// and what `draw` throws, after frames before it have been written.
std::size_t write_frames(const std::filesystem::path& folder, std::size_t count,
                         const std::function<std::string(std::size_t)>& draw,
                         const FrameOptions& options = {});

}  // namespace canyon::drawing
