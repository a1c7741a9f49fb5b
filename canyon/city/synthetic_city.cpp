#include "canyon/city/synthetic_city.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/city.hpp"

namespace canyon::city {
namespace {

/// Ground around the outermost street.
constexpr double kGroundMargin_m = 500;
constexpr double kPavement_m = 2.5;      ///< between street and facades
constexpr double kAlley_m = 4;           ///< between buildings of a block
constexpr double kSmallestLot_m = 14;    ///< lots below twice this (plus the alley) are not split
constexpr double kCourtyardWing_m = 11;  ///< depth of a building around a courtyard

/// SplitMix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators", figure 16). Only
/// integer steps and exact scaling, so that a seed gives the same city with every compiler.
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() { return mix64(state_ += kGolden64); }
  /// [0, 1), 53 bits.
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::uint64_t state_;
};

struct Rectangle {
  Eigen::Vector2d min;
  Eigen::Vector2d max;

  [[nodiscard]] Eigen::Vector2d size() const { return max - min; }
  [[nodiscard]] Eigen::Vector2d centre() const { return 0.5 * (min + max); }
  [[nodiscard]] Rectangle inset(double by) const {
    return {min + Eigen::Vector2d::Constant(by), max - Eigen::Vector2d::Constant(by)};
  }
};

/// A closed solid of nested rectangles: the wall of ring k is on ring k's outline between the roof of ring k
/// - 1 (the ground for the first) and its own; flat roofs join adjacent outlines. A ring higher than the one
/// around it is a tower or a setback, a lower one a light well; with `courtyard` the innermost outline
/// reaches down to the ground and is open to the sky.
struct Terraces {
  std::vector<Rectangle> outlines;  ///< from the outside inwards, strictly nested
  std::vector<double> roofs_m;      ///< one per outline; the last one unused with a courtyard
  bool courtyard = false;
};

class TerraceMesher {
 public:
  void append(Mesh& mesh, std::string name, Material material, const Terraces& terraces) {
    vertices_.clear();
    triangles_.clear();
    const std::size_t rings = terraces.outlines.size();
    double below = 0;
    for (std::size_t k = 0; k < rings; ++k) {
      const bool yard = terraces.courtyard && k + 1 == rings;
      const double above = yard ? 0 : terraces.roofs_m[k];
      const std::uint32_t low = add_outline(terraces.outlines[k], below);
      // A wall that goes up from `below` faces outwards; if it goes down, the same quads face inwards.
      const std::uint32_t high = add_outline(terraces.outlines[k], above);
      join(low, high);
      if (k + 1 < rings)
        join(high, add_outline(terraces.outlines[k + 1], above));
      else if (!yard)
        quad(high, high + 1, high + 2, high + 3);
      below = above;
    }
    const std::uint32_t floor = add_outline(terraces.outlines.front(), 0);
    if (terraces.courtyard)
      join(add_outline(terraces.outlines.back(), 0), floor);
    else
      quad(floor + 3, floor + 2, floor + 1, floor);
    weld();
    append_object(mesh, std::move(name), Surface::Building, material, vertices_, triangles_);
  }

 private:
  /// Four corners, counter-clockwise from above; returns the first one's index.
  std::uint32_t add_outline(const Rectangle& r, double z) {
    // Rounds to whole millimetres, so that fused multiply-adds of some compilers have no effect.
    const auto snapped = [](double x) { return std::round(x * 1e3) / 1e3; };
    const auto first = static_cast<std::uint32_t>(vertices_.size());
    const double west = snapped(r.min.x());
    const double east = snapped(r.max.x());
    const double south = snapped(r.min.y());
    const double north = snapped(r.max.y());
    const double up = snapped(z);
    vertices_.emplace_back(west, south, up);
    vertices_.emplace_back(east, south, up);
    vertices_.emplace_back(east, north, up);
    vertices_.emplace_back(west, north, up);
    return first;
  }
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    triangles_.push_back({a, b, c});
    triangles_.push_back({a, c, d});
  }
  void join(std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t next = (i + 1) % 4;
      quad(from + i, from + next, to + next, to + i);
    }
  }
  /// One index for each position; there are at most a few dozen vertices.
  void weld() {
    std::vector<Eigen::Vector3d> unique;
    std::vector<std::uint32_t> slot;
    for (const Eigen::Vector3d& v : vertices_) {
      const auto found = std::find(unique.begin(), unique.end(), v);
      slot.push_back(static_cast<std::uint32_t>(found - unique.begin()));
      if (found == unique.end()) unique.push_back(v);
    }
    for (auto& triangle : triangles_)
      for (std::uint32_t& index : triangle) index = slot[index];
    vertices_ = std::move(unique);
  }

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

class Downtown {
 public:
  explicit Downtown(const SyntheticCityOptions& options) : options_(options), random_(options.seed) {
    pitch_ = options.block_size_m + options.street_width_m;
    // The central crossing is after the first half of the blocks, rounded down.
    const int west = options.blocks_east / 2, south = options.blocks_north / 2;
    first_east_ = -static_cast<double>(west) * pitch_;
    first_north_ = -static_cast<double>(south) * pitch_;
    extent_ = {{first_east_, first_north_},
               {first_east_ + options.blocks_east * pitch_, first_north_ + options.blocks_north * pitch_}};
  }

  Mesh build() {
    const Rectangle ground = extent_.inset(-kGroundMargin_m);
    append_object(mesh_, "terrain", Surface::Terrain, Material::Ground,
                  {{ground.min.x(), ground.min.y(), 0},
                   {ground.max.x(), ground.min.y(), 0},
                   {ground.max.x(), ground.max.y(), 0},
                   {ground.min.x(), ground.max.y(), 0}},
                  {{0, 1, 2}, {0, 2, 3}});
    for (int j = 0; j < options_.blocks_north; ++j)
      for (int i = 0; i < options_.blocks_east; ++i) add_block(i, j);
    return std::move(mesh_);
  }

 private:
  void add_block(int i, int j) {
    const Eigen::Vector2d corner(first_east_ + i * pitch_ + 0.5 * options_.street_width_m,
                                 first_north_ + j * pitch_ + 0.5 * options_.street_width_m);
    const Rectangle block{corner, corner + Eigen::Vector2d::Constant(options_.block_size_m)};
    std::vector<Rectangle> lots;
    split(block.inset(std::min(kPavement_m, 0.05 * options_.block_size_m)), 2, lots);
    for (std::size_t b = 0; b < lots.size(); ++b)
      add_building(fmt::format("block_{}_{}_b{}", i, j, b + 1), lots[b]);
  }

  /// Cuts a lot across its longer side, up to `depth` times.
  void split(const Rectangle& lot, int depth, std::vector<Rectangle>& lots) {
    const int axis = lot.size().x() >= lot.size().y() ? 0 : 1;
    const double length = lot.size()[axis];
    const bool divisible = length >= 2 * kSmallestLot_m + kAlley_m;
    if (random_.uniform() < (depth == 2 ? 0.25 : 0.4) || depth == 0 || !divisible) {
      lots.push_back(lot);
      return;
    }
    const double slack = length - 2 * kSmallestLot_m - kAlley_m;
    const double cut = lot.min[axis] + kSmallestLot_m + slack * random_.uniform(0.25, 0.75);
    Rectangle low = lot;
    Rectangle high = lot;
    low.max[axis] = cut;
    high.min[axis] = cut + kAlley_m;
    split(low, depth - 1, lots);
    split(high, depth - 1, lots);
  }

  /// Most buildings are low; the probability of a tall one falls with the distance from the middle.
  double random_height(const Eigen::Vector2d& point) {
    const Eigen::Vector2d from_middle =
        (point - extent_.centre()).cwiseQuotient(0.5 * extent_.size().cwiseMax(1.0));
    const double u = random_.uniform();
    const double central = 1 / (1 + 1.5 * from_middle.squaredNorm());
    return options_.min_height_m + (options_.max_height_m - options_.min_height_m) * central * u * u;
  }

  Material random_material() {
    static constexpr std::array kChoices{Material::Concrete, Material::Concrete, Material::Glass,
                                         Material::Brick, Material::Stone};
    return kChoices[random_.next() % kChoices.size()];
  }

  void add_building(std::string name, const Rectangle& lot) {
    const double height = random_height(lot.centre());
    const double shape = random_.uniform();
    const double width = lot.size().minCoeff();
    Terraces terraces{{lot}, {height}, false};
    if (shape < 0.25 && width >= 3 * kCourtyardWing_m) {
      terraces.outlines.push_back(lot.inset(kCourtyardWing_m));
      terraces.roofs_m.push_back(0);
      terraces.courtyard = true;
    } else if (height > 2.5 * options_.min_height_m && width >= 20) {
      if (shape < 0.7) {  // a tower on a podium
        terraces.roofs_m.front() = options_.min_height_m * random_.uniform(0.6, 1.0);
        terraces.outlines.push_back(lot.inset(width * random_.uniform(0.12, 0.25)));
        terraces.roofs_m.push_back(height);
      } else {  // setbacks
        terraces.roofs_m.front() = height * random_.uniform(0.5, 0.65);
        terraces.outlines.push_back(lot.inset(0.1 * width));
        terraces.roofs_m.push_back(height * random_.uniform(0.75, 0.9));
        terraces.outlines.push_back(lot.inset(0.2 * width));
        terraces.roofs_m.push_back(height);
      }
    }
    mesher_.append(mesh_, std::move(name), random_material(), terraces);
  }

  SyntheticCityOptions options_;
  SplitMix64 random_;
  double pitch_ = 0;
  double first_east_ = 0;
  double first_north_ = 0;
  Rectangle extent_;
  Mesh mesh_;
  TerraceMesher mesher_;
};

}  // namespace

void SyntheticCityOptions::validate() const {
  geodesy::check_geodetic(origin, "city origin");
  options::check(*this);
  if (max_height_m < min_height_m) {
    throw InputError(fmt::format("max_height_m is {}", max_height_m),
                     fmt::format("it must be from min_height_m, {}, to 1000", min_height_m));
  }
}

void visit(options::Visitor& v, SyntheticCityOptions& o) {
  v.integer({"blocks_east", "blocks",
             "synthetic downtown around the origin (default 22.3, 114.17): blocks from west to east; "
             "'synthetic: {}' uses all defaults"},
            o.blocks_east, 1, 200);
  v.integer({"blocks_north", "blocks", "blocks from south to north"}, o.blocks_north, 1, 200);
  v.number({"block_size_m", "m", "side of a block"}, o.block_size_m, {10, 500});
  v.number({"street_width_m", "m", "width of the streets between blocks"}, o.street_width_m, {4, 100});
  v.number({"min_height_m", "m", "lowest building"}, o.min_height_m, {1, 1000});
  v.number({"max_height_m", "m", "highest building"}, o.max_height_m, {1, 1000});
  v.integer({"seed", "", "seed of the building heights"}, o.seed);
}

City synthetic_city(const SyntheticCityOptions& options) {
  options.validate();
  City city;
  city.name = fmt::format("synthetic city, {} x {} blocks, seed {}", options.blocks_east,
                          options.blocks_north, options.seed);
  city.frame = geodesy::LocalFrame(options.origin);
  city.mesh = Downtown(options).build();
  return city;
}

}  // namespace canyon::city
