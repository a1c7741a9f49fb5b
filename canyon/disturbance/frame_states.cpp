#include "canyon/disturbance/frame_states.hpp"

#include <algorithm>
#include <limits>

namespace canyon::disturbance {
namespace {

/// Frames that are kept. The slowest published chain goes back farther with a probability of 1e-6.
constexpr std::int64_t kSlots = 64;
constexpr int kFarthest = 4096;

}  // namespace

FrameStates::FrameStates(const SkyNodes& nodes, std::uint64_t seed, std::string_view key)
    : size_(nodes.size()),
      root_(RandomStream(seed, key).next()),
      frames_(kSlots, std::numeric_limits<std::int64_t>::min()),
      numbers_(kSlots * size_) {}

double FrameStates::uniform(std::int64_t frame, std::span<const SkyNodes::Share> shares) {
  const std::size_t slot = static_cast<std::uint64_t>(frame) % kSlots;
  const std::span<double> numbers = std::span(numbers_).subspan(slot * size_, size_);
  if (frames_[slot] != frame) {
    RandomStream stream(mix64(root_ + kGolden64 * static_cast<std::uint64_t>(frame)), "frame");
    SkyNodes::draw(stream, numbers);
    frames_[slot] = frame;
  }
  return upper_tail(-SkyNodes::blend(shares, numbers));
}

bool FrameStates::state(std::int64_t frame, std::span<const SkyNodes::Share> shares, Steps steps) {
  const double stay = 1 - steps.leave;
  const double low = std::min(steps.enter, stay), high = std::max(steps.enter, stay);
  bool turned = false;  // by the frames gone back over
  for (int back = 0;; ++back) {
    const double u = uniform(frame - back, shares);
    if (u < low || u >= high) return (u < low) != turned;
    if (back == kFarthest)
      return (u - low < (high - low) * steps.enter / (steps.enter + steps.leave)) != turned;
    // Between the two the state stays. In chains that change more often than not, it turns.
    if (steps.enter > stay) turned = !turned;
  }
}

FrameStates::States FrameStates::at(std::int64_t frame, std::span<const SkyNodes::Share> shares,
                                    Steps steps) {
  States states;
  states.before = state(frame - 1, shares, steps);
  states.now = uniform(frame, shares) < (states.before ? 1 - steps.leave : steps.enter);
  return states;
}

}  // namespace canyon::disturbance
