#include "canyon/validation/city_agreement.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>

#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/options/values.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::validation {
namespace {

constexpr std::size_t kMostDraws = 200;  // for each place that is wanted
constexpr double kAboutBox_m = 500;      // buildings so far from a box hide its sky

/// A city, and its rays.
struct ComparedCity {
  explicit ComparedCity(const city::City& c)
      : city(&c), scene(std::shared_ptr<const city::Mesh>(std::shared_ptr<void>(), &c.mesh)) {}

  /// The place below or above an ECEF one, at a height above the ground.
  [[nodiscard]] Eigen::Vector3d stand_at(const Eigen::Vector3d& ecef, double height_m) const {
    Eigen::Vector3d place = city->frame.local_from_ecef(ecef);
    place.z() = 0;
    place.z() = height_m - scene.height_above_ground(place);
    return place;
  }

  const city::City* city;
  raytrace::RayScene scene;
};

/// Bounds of what is not terrain, seen from above in a frame.
Eigen::AlignedBox2d plan_of(const city::City& city, const geodesy::LocalFrame& frame) {
  Eigen::AlignedBox2d box;
  for (const city::Object& object : city.mesh.objects) {
    if (object.surface == city::Surface::Terrain) continue;
    for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
      for (const std::uint32_t corner : city.mesh.triangles[object.first_triangle + t]) {
        const Eigen::Vector3d ecef = city.frame.ecef_from_local(city.mesh.vertices[corner]);
        box.extend(frame.local_from_ecef(ecef).head<2>().eval());
      }
    }
  }
  return box;
}

/// A box of degrees in a frame.
Eigen::AlignedBox2d box_of(const std::array<double, 4>& bbox_deg, const geodesy::LocalFrame& frame) {
  const auto& [west, south, east, north] = bbox_deg;
  Eigen::AlignedBox2d box;
  for (const double longitude : {west, east}) {
    for (const double latitude : {south, north}) {
      const auto corner = geodesy::Geodetic::from_degrees(latitude, longitude, 0);
      box.extend(frame.local_from_geodetic(corner).head<2>().eval());
    }
  }
  return box;
}

/// Where places are drawn, in the frame of the first city: the box, else where all cities have buildings.
Eigen::AlignedBox2d common_plan(std::span<const city::City> cities, const CityAgreementOptions& options) {
  const geodesy::LocalFrame& frame = cities.front().frame;
  Eigen::AlignedBox2d plan = plan_of(cities.front(), frame);
  if (options.bbox_deg) plan = box_of(*options.bbox_deg, frame);
  for (const city::City& city : cities) {
    Eigen::AlignedBox2d of_city = plan_of(city, frame);
    if (options.bbox_deg) {
      of_city.min().array() -= kAboutBox_m;
      of_city.max().array() += kAboutBox_m;
      if (of_city.intersects(plan)) continue;
    }
    plan = plan.intersection(of_city);
    if (plan.isEmpty()) {
      throw InputError(city.name + ": has no buildings where the " +
                           (options.bbox_deg ? "box is" : "cities before it have some"),
                       "compare cities of one place: canyon city info says where each lies");
    }
  }
  return plan;
}

/// Unit vectors above a mask, evenly over the sky, east-north-up: a spiral of golden angles.
std::vector<Eigen::Vector3d> sky_directions(int count, double mask_deg) {
  std::vector<Eigen::Vector3d> out;
  const double low = std::sin(geodesy::radians(mask_deg)), turn = geodesy::kPi * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double up = low + (1 - low) * (i + 0.5) / count, level = std::sqrt(1 - up * up);
    out.emplace_back(level * std::cos(i * turn), level * std::sin(i * turn), up);
  }
  return out;
}

class CityComparison {
 public:
  CityComparison(std::span<const city::City> cities, const CityAgreementOptions& options)
      : options_(options), sky_(sky_directions(options.directions, options.mask_deg)) {
    const Eigen::AlignedBox2d plan = common_plan(cities, options);
    for (const city::City& city : cities) cities_.push_back(std::make_unique<ComparedCity>(city));
    out_.cities.resize(cities.size());
    draw_places(plan);
    for (std::size_t first = 0; first < cities.size(); ++first) {
      for (std::size_t second = first + 1; second < cities.size(); ++second)
        out_.pairs.push_back({first, second});
    }
  }

  CityAgreement run(const std::function<void(std::size_t, std::size_t)>& progress) {
    std::vector<Counts> counts(places_.size());
    std::mutex mutex;
    std::size_t done = 0;
    tbb::parallel_for(std::size_t{0}, places_.size(), [&](std::size_t i) {
      counts[i] = look_up(places_[i]);
      if (!progress) return;
      const std::lock_guard lock(mutex);
      progress(++done, places_.size());
    });
    summarize(counts);
    return std::move(out_);
  }

 private:
  /// Directions at one place.
  struct Counts {
    std::vector<std::size_t> hidden;           ///< by each city
    std::vector<std::size_t> agreed, by_both;  ///< of each pair
  };

  void draw_places(const Eigen::AlignedBox2d& plan) {
    const geodesy::LocalFrame& frame = cities_.front()->city->frame;
    RandomStream random(1, "places of cities");
    const auto wanted = static_cast<std::size_t>(options_.places);
    std::size_t draws = 0;
    std::vector<std::size_t> inside(cities_.size());
    for (; places_.size() < wanted && draws < kMostDraws * wanted; ++draws) {
      const double east = random.uniform(), north = random.uniform();
      const Eigen::Vector2d at = plan.min() + plan.sizes().cwiseProduct(Eigen::Vector2d(east, north));
      const Eigen::Vector3d ecef = frame.ecef_from_local({at.x(), at.y(), 0});
      bool outdoors = true;
      for (std::size_t c = 0; c < cities_.size(); ++c) {
        const Eigen::Vector3d place = cities_[c]->stand_at(ecef, options_.height_m);
        if (cities_[c]->scene.placement(place) == raytrace::Placement::Free) continue;
        outdoors = false;
        ++inside[c];
      }
      if (outdoors) places_.push_back(ecef);
    }
    if (places_.size() < wanted) {
      throw InputError(fmt::format("only {} of {} places are outdoors in all cities", places_.size(), draws),
                       "give a box (--bbox) with streets, or fewer places");
    }
    out_.places = places_.size();
    for (std::size_t c = 0; c < cities_.size(); ++c)
      out_.cities[c].inside = static_cast<double>(inside[c]) / static_cast<double>(draws);
  }

  [[nodiscard]] Counts look_up(const Eigen::Vector3d& ecef) const {
    const std::size_t n = sky_.size();
    const Eigen::Matrix3d& to_ecef = cities_.front()->city->frame.ecef_from_local_rotation();
    const auto hidden = std::make_unique<bool[]>(n * cities_.size());
    Counts counts;
    for (std::size_t c = 0; c < cities_.size(); ++c) {
      const ComparedCity& city = *cities_[c];
      const Eigen::Vector3d place = city.stand_at(ecef, options_.height_m);
      const Eigen::Matrix3d turn = city.city->frame.ecef_from_local_rotation().transpose() * to_ecef;
      std::vector<raytrace::Ray> rays;
      for (const Eigen::Vector3d& direction : sky_) rays.push_back({place, (turn * direction).normalized()});
      const std::span<bool> answers(&hidden[c * n], n);
      city.scene.occluded(rays, answers);
      counts.hidden.push_back(static_cast<std::size_t>(std::count(answers.begin(), answers.end(), true)));
    }
    for (const CityAgreement::OfPair& pair : out_.pairs) {
      std::size_t agreed = 0, both = 0;
      for (std::size_t i = 0; i < n; ++i) {
        const bool first = hidden[pair.first * n + i], second = hidden[pair.second * n + i];
        agreed += first == second ? 1U : 0U;
        both += first && second ? 1U : 0U;
      }
      counts.agreed.push_back(agreed);
      counts.by_both.push_back(both);
    }
    return counts;
  }

  void summarize(const std::vector<Counts>& counts) {
    const auto directions = static_cast<double>(sky_.size());
    const double all = directions * static_cast<double>(counts.size());
    for (std::size_t c = 0; c < cities_.size(); ++c) {
      std::size_t hidden = 0;
      for (const Counts& place : counts) hidden += place.hidden[c];
      out_.cities[c].open = 1 - static_cast<double>(hidden) / all;
    }
    for (std::size_t p = 0; p < out_.pairs.size(); ++p) {
      CityAgreement::OfPair& pair = out_.pairs[p];
      std::size_t agreed = 0, both = 0, either = 0;
      std::vector<double> shares;
      for (const Counts& place : counts) {
        agreed += place.agreed[p];
        both += place.by_both[p];
        either += place.hidden[pair.first] + place.hidden[pair.second] - place.by_both[p];
        shares.push_back(static_cast<double>(place.agreed[p]) / directions);
      }
      pair.agree = static_cast<double>(agreed) / all;
      pair.agree_p05 = *quantile(shares, 0.05);
      pair.hidden_by_both = either == 0 ? 1 : static_cast<double>(both) / static_cast<double>(either);
    }
  }

  const CityAgreementOptions& options_;
  std::vector<Eigen::Vector3d> sky_;  ///< unit, in the frame of the first city
  std::vector<std::unique_ptr<ComparedCity>> cities_;
  std::vector<Eigen::Vector3d> places_;  ///< ECEF; their heights do not count
  CityAgreement out_;
};

}  // namespace

void CityAgreementOptions::validate() const {
  options::check(*this, "city compare");
}

void visit(options::Visitor& v, CityAgreementOptions& o) {
  v.integer({"places", "", "places outdoors"}, o.places, 1, 100'000);
  v.integer({"directions", "", "of each place, evenly over the sky"}, o.directions, 10, 100'000);
  v.number({"mask_deg", "deg", "lowest elevation"}, o.mask_deg, {0, 89});
  v.number({"height_m", "m", "of the places above the ground of each city"}, o.height_m, {0.01, 1000});
}

CityAgreement compare_cities(std::span<const city::City> cities, const CityAgreementOptions& options,
                             const std::function<void(std::size_t, std::size_t)>& progress) {
  assert(cities.size() >= 2);
  options.validate();
  return CityComparison(cities, options).run(progress);
}

}  // namespace canyon::validation
