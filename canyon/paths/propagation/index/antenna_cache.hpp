#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace canyon::propagation {

/// A vertical cylinder around an antenna.
struct Surroundings {
  double radius_m = 0, half_height_m = 0;

  /// Half the extent along a unit vector.
  [[nodiscard]] double extent_m(const Eigen::Vector3d& along) const {
    return radius_m * along.head<2>().norm() + half_height_m * std::abs(along.z());
  }
  /// The radius of its circumscribed ball.
  [[nodiscard]] double reach_m() const { return std::hypot(radius_m, half_height_m); }
  /// Whether a point is within the cylinder scaled by `fraction`.
  [[nodiscard]] bool hold(const Eigen::Vector3d& from_middle, double fraction) const {
    return from_middle.head<2>().norm() <= fraction * radius_m &&
           std::abs(from_middle.z()) <= fraction * half_height_m;
  }
};

/// State of a nearly stationary antenna. Data valid for all antennas in kAntennas around `centre()`, and
/// directions within kSpread of `directions()`, is computed once.
class StationaryWindow {
 public:
  static constexpr Surroundings kAntennas{5, 0.5};
  static constexpr double kSpread = 2e-3;  ///< chord of directions: some 14 s of a satellite's motion

  /// Continues while antenna and directions are within the bounds, else restarts and returns true.
  bool begins(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions) {
    if (holds(antenna, directions)) return false;
    centre_ = antenna;
    directions_.assign(directions.begin(), directions.end());
    return true;
  }
  [[nodiscard]] const Eigen::Vector3d& centre() const { return centre_; }
  [[nodiscard]] const std::vector<Eigen::Vector3d>& directions() const { return directions_; }

 private:
  [[nodiscard]] bool holds(const Eigen::Vector3d& antenna,
                           std::span<const Eigen::Vector3d> directions) const {
    if (directions_.size() != directions.size() || !kAntennas.hold(antenna - centre_, 1)) return false;
    for (std::size_t i = 0; i < directions.size(); ++i)
      if ((directions[i] - directions_[i]).squaredNorm() > kSpread * kSpread) return false;
    return true;
  }

  Eigen::Vector3d centre_ = Eigen::Vector3d::Constant(1e300);
  std::vector<Eigen::Vector3d> directions_;
};

/// Cache with one entry per antenna. An antenna that returns near its last position gets its entry back, on
/// any thread. Results must not depend on the cache. Thread-safe. Memory: a `StoredEpoch` for each antenna of
/// the last kMax requests that was near its last position twice in succession; nodes of a heat map have none.
template <typename StoredEpoch>
class AntennaCache {
 public:
  static constexpr std::uint64_t kMax = 1024;

  /// Exclusive access to the entry of one antenna.
  class Lease {
   public:
    Lease(const AntennaCache* cache, std::size_t entry, StoredEpoch* kept)
        : cache_(cache), entry_(entry), kept_(kept) {}
    Lease(Lease&& other) noexcept
        : cache_(std::exchange(other.cache_, nullptr)), entry_(other.entry_), kept_(other.kept_) {}
    Lease& operator=(Lease&&) = delete;
    ~Lease() {
      if (cache_ == nullptr) return;
      const std::scoped_lock lock(cache_->mutex_);
      cache_->entries_[entry_].taken = false;
    }
    /// Null: no recent antenna was near this one.
    [[nodiscard]] StoredEpoch* get() const { return kept_; }

   private:
    const AntennaCache* cache_;
    std::size_t entry_;
    StoredEpoch* kept_;
  };

  /// The entry of the antenna with the nearest last position, within Stay::kAntennas.
  [[nodiscard]] Lease about(const Eigen::Vector3d& antenna) const {
    const std::scoped_lock lock(mutex_);
    ++requests_;
    constexpr std::size_t kNone = -1;
    std::size_t nearest = kNone, oldest = kNone;
    double nearest_m2 = 0;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const Entry& entry = entries_[i];
      if (entry.taken) continue;
      if (oldest == kNone || entry.request < entries_[oldest].request) oldest = i;
      const Eigen::Vector3d apart = antenna - entry.antenna;
      if (!StationaryWindow::kAntennas.hold(apart, 1)) continue;
      if (nearest != kNone && apart.squaredNorm() >= nearest_m2) continue;
      nearest = i;
      nearest_m2 = apart.squaredNorm();
    }
    const bool again = nearest != kNone;
    std::size_t at = again ? nearest : oldest;
    if (!again && (at == kNone || requests_ - entries_[at].request <= kMax)) {
      at = entries_.size();
      entries_.emplace_back();
    }
    Entry& entry = entries_[at];
    entry.antenna = antenna;
    entry.request = requests_;
    entry.taken = true;
    if (!again || !entry.kept) entry.kept.reset(again && entry.came_again ? new StoredEpoch : nullptr);
    entry.came_again = again;
    return {this, at, again ? entry.kept.get() : nullptr};
  }

 private:
  struct Entry {
    Eigen::Vector3d antenna;
    std::uint64_t request = 0;  ///< number of the last request
    bool taken = false, came_again = false;
    std::unique_ptr<StoredEpoch> kept;
  };
  mutable std::mutex mutex_;
  mutable std::vector<Entry> entries_;
  mutable std::uint64_t requests_ = 0;
};

}  // namespace canyon::propagation
