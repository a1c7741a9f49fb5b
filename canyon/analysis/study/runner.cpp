#include "canyon/analysis/study/runner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <future>
#include <list>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "canyon/analysis/study/record.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/work_queue.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::study {
namespace {

/// Approximate size of a triangle with its vertices and its part of the rays' tree.
constexpr double kSourceBytes = 150, kSceneBytes = 600;

/// Objects that are made once per key and cached while they fit; the least recently used are removed first.
/// An object lives while it is used. Thread-safe: a thread waits for an object that another one is making.
template <typename Item>
class Shared {
 public:
  explicit Shared(double max_bytes) : max_(max_bytes) {}

  template <typename Make, typename Size>
  std::shared_ptr<const Item> get(const std::string& key, const Make& make, const Size& size) {
    std::promise<std::shared_ptr<const Item>> promise;
    std::shared_future<std::shared_ptr<const Item>> future;
    bool mine = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto found = things_.find(key);
      if (found != things_.end()) {
        recent_.splice(recent_.begin(), recent_, found->second.entry);
        future = found->second.future;
      } else {
        mine = true;
        recent_.push_front(key);
        future = promise.get_future();
        things_.emplace(key, Entry{future, recent_.begin(), 0});
      }
    }
    if (!mine) return future.get();
    try {
      std::shared_ptr<const Item> thing = make();
      promise.set_value(thing);
      keep(key, size(*thing));
      return thing;
    } catch (...) {
      promise.set_exception(std::current_exception());
      const std::lock_guard<std::mutex> lock(mutex_);
      erase(things_.find(key));
      throw;
    }
  }

 private:
  struct Entry {
    std::shared_future<std::shared_ptr<const Item>> future;
    std::list<std::string>::iterator entry;
    double bytes = 0;  // 0: being made
  };
  void keep(const std::string& key, double bytes) {
    const std::lock_guard<std::mutex> lock(mutex_);
    things_.at(key).bytes = bytes;
    total_ += bytes;
    for (auto last = recent_.end(); total_ > max_ && last != recent_.begin();) {
      --last;
      const auto oldest = things_.find(*last);
      if (oldest->second.bytes == 0) continue;
      ++last;
      erase(oldest);
    }
  }
  void erase(typename std::map<std::string, Entry>::iterator entry) {
    total_ -= entry->second.bytes;
    recent_.erase(entry->second.entry);
    things_.erase(entry);
  }

  double max_, total_ = 0;
  std::mutex mutex_;
  std::list<std::string> recent_;
  std::map<std::string, Entry> things_;
};

std::vector<std::string> notes_of(const ReadReport& report) {
  std::vector<std::string> notes;
  for (const auto& [level, line] : report.entries(ReadReport::Level::Guess))
    notes.push_back(fmt::format("{}: {}", ReadReport::name(level), line));
  return notes;
}

}  // namespace

Manifest manifest_of(const StudyPlan& plan) {
  const Study& study = plan.study();
  Manifest manifest;
  manifest.key = plan.key();
  manifest.title = study.file.stem().string();
  manifest.runs = plan.size();
  manifest.receivers = plan.receivers();
  manifest.epochs = study.keep == Retention::Epochs;
  manifest.seed = study.seed;
  manifest.confidence = study.confidence;
  manifest.bootstrap = study.bootstrap;
  manifest.available_m = study.available_m;
  manifest.along_m = study.along_m;
  for (const Axis& axis : study.axes) {
    Manifest::Coordinate coordinate{axis.name,         axis.key, Manifest::Coordinate::Kind::Text,
                                    plan.groups(axis), {},       {}};
    if (axis.is_numeric()) coordinate.kind = Manifest::Coordinate::Kind::Number;
    if (axis.kind == Axis::Kind::Times) coordinate.kind = Manifest::Coordinate::Kind::Time;
    if (!axis.labels.empty()) {
      coordinate.texts = axis.values;
      coordinate.labels = axis.labels;
    }
    if (axis.realization) manifest.realizations.push_back(axis.name);
    manifest.axes.push_back(std::move(coordinate));
  }
  return manifest;
}

std::size_t shard_of(std::size_t run, std::size_t shards) {
  const std::size_t row = run / shards;
  return (run % shards + static_cast<std::size_t>(mix64(row + 1) % shards)) % shards;
}

struct RunMaker::Impl {
  const StudyPlan& plan;
  // Cities as read use half of the memory; there are few of them.
  mutable Shared<city::City> sources;
  mutable Shared<simulation::CityScene> scenes;
  mutable Shared<simulation::BuiltSky> skies;

  explicit Impl(const StudyPlan& p)
      : plan(p),
        sources(p.study().city_memory_gb * 0.5e9),
        scenes(p.study().city_memory_gb * 0.5e9),
        skies(64) {}  // each counts as one byte: 64 skies

  /// @param sampled false: the city of its source, independent of the seed
  [[nodiscard]] std::shared_ptr<simulation::CityScene> scene(const simulation::Scenario& scenario,
                                                             bool sampled = true) const {
    // Random drives need the whole city, which is the same for all of them.
    const simulation::CityConfig config =
        plan.drives() == nullptr ? simulation::city_config(scenario) : scenario.city;
    simulation::CityConfig plain = config;
    plain.georeference = {};
    plain.roofs_m = 0;
    // A source says whether facades are sampled, but not which.
    if (plain.facades.is_sampled()) {
      plain.facades.mix = city::FacadeOptions().mix;
      plain.facades.fractions.clear();
    }
    const std::string source_key = options::exact_text(plain);
    const simulation::Georeference& position = scenario.city.georeference;
    const bool by_seed = scenario.city.facades.is_sampled() || config.roofs_m > 0 || position.sigma_m > 0 ||
                         position.heading_sigma_rad > 0;
    std::string key = "as read " + source_key;
    if (sampled) key = options::exact_text(config) + (by_seed ? std::to_string(scenario.seed) : "");
    const auto triangles = [](const city::City& city) {
      return static_cast<double>(city.mesh.triangles.size()) + 1;
    };
    const auto made = scenes.get(
        key,
        [&]() -> std::shared_ptr<const simulation::CityScene> {
          const auto source = sources.get(
              source_key,
              [&] { return std::make_shared<const city::City>(simulation::load_city_source(config)); },
              [&](const city::City& city) { return kSourceBytes * triangles(city); });
          if (!sampled) return std::make_shared<const simulation::CityScene>(*source);
          return std::make_shared<const simulation::CityScene>(simulation::draw_city(*source, scenario));
        },
        [&](const simulation::CityScene& scene) { return kSceneBytes * triangles(scene.city); });
    // A simulation moves no objects in its scene.
    return std::const_pointer_cast<simulation::CityScene>(made);
  }

  // Skies of files are valid for all times that they cover; nominal ones are made for the run's time.
  [[nodiscard]] simulation::BuiltSky sky(const simulation::SkyConfig& config, geodesy::GpsTime begin,
                                         geodesy::GpsTime end, const geodesy::Geodetic& position) const {
    const auto make = [&] {
      return std::make_shared<const simulation::BuiltSky>(
          simulation::build_sky(config, begin, end, position));
    };
    const auto one = [](const simulation::BuiltSky&) { return 1.0; };
    if (!config.frozen_azimuth_rad.empty()) return *make();
    std::string key = options::exact_text(config);
    if (config.nominal) {
      key += fmt::format("{} {}", begin.nanoseconds(), end.nanoseconds());
      return *skies.get(key, make, one);
    }
    const auto found = skies.get(key, make, one);
    return simulation::has_satellites(*found->sky, begin) ? *found : *make();
  }
};

RunMaker::RunMaker(const StudyPlan& plan) : impl_(std::make_unique<Impl>(plan)) {}
RunMaker::~RunMaker() = default;

simulation::Scenario RunMaker::scenario(std::size_t number) const {
  const StudyRun run = impl_->plan.run(number);
  simulation::Scenario scenario = impl_->plan.scenario(run);
  const Axis* drives = impl_->plan.drives();
  if (drives == nullptr) return scenario;
  const Study& study = impl_->plan.study();
  const simulation::Attitude attitude = scenario.trajectory.attitude;
  scenario.trajectory = random_drive(*impl_->scene(scenario, false), drives->drives, study.seed,
                                     run.at[static_cast<std::size_t>(drives - study.axes.data())].text);
  scenario.trajectory.attitude = attitude;
  return scenario;
}

std::optional<RunRecord> RunMaker::make(std::size_t number, int threads,
                                        const std::atomic<bool>* stop) const {
  const StudyRun run = impl_->plan.run(number);
  RunRecord record;
  record.number = number;
  for (const AxisValue& value : run.at) record.at.push_back(value.text);
  try {
    simulation::Scenario scenario = this->scenario(number);
    record.seed = scenario.seed;
    const std::vector<std::string> names = simulation::receiver_names(scenario.receivers);
    auto scene = impl_->scene(scenario);
    record.notes = notes_of(scene->city.notes);
    const simulation::Simulation simulation(
        std::move(scenario), std::move(scene),
        [this](const simulation::SkyConfig& config, geodesy::GpsTime begin, geodesy::GpsTime end,
               const geodesy::Geodetic& position) { return impl_->sky(config, begin, end, position); });
    record.notes = notes_of(simulation.report());
    RecordSink sink(names, impl_->plan.study().available_m, impl_->plan.study().keep == Retention::Epochs);
    simulation::RunOptions options;
    options.threads = threads;
    options.stop = stop;
    if (simulation.run({&sink}, options).interrupted) return std::nullopt;
    record.receivers = sink.take();
  } catch (const InputError& error) {
    record.problem = error.problem() + (error.hint().empty() ? "" : "; " + error.hint());
  }
  return record;
}

void run_all(const RunMaker& maker, RunStore& store, const std::vector<std::size_t>& todo,
             const RunnerOptions& options) {
  std::size_t threads = options.threads > 0 ? static_cast<std::size_t>(options.threads)
                                            : std::max(1U, std::thread::hardware_concurrency());
  // Few runs: threads without a run help within the others.
  const int within =
      static_cast<int>(std::max<std::size_t>(1, threads / std::max<std::size_t>(1, todo.size())));
  threads = std::max<std::size_t>(1, std::min(threads, todo.size()));
  std::mutex mutex;
  std::exception_ptr failure;
  std::size_t done = 0;
  WorkQueue queue(options.next);
  std::atomic<bool> over{false};
  const auto stopped = [&] { return over.load() || (options.stop != nullptr && options.stop->load()); };
  const auto work = [&] {
    while (!stopped()) {
      try {
        const std::size_t mine = queue.take();
        if (mine >= todo.size()) return;
        std::optional<RunRecord> record = maker.make(todo[mine], within, options.stop);
        if (!record) return;
        store.add(std::move(*record));
        const std::lock_guard<std::mutex> lock(mutex);
        ++done;
        if (options.progress) options.progress(done);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!failure) failure = std::current_exception();
        over = true;
      }
    }
  };
  std::vector<std::thread> others;
  for (std::size_t i = 1; i < threads; ++i) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
  if (failure) std::rethrow_exception(failure);
}

namespace {

using Eigen::Vector3d;

constexpr int kMaxStarts = 2000;
constexpr int kRoutes = 64, kForwardCandidates = 24;
constexpr std::array kLegs_m{150.0, 100.0, 70.0, 45.0, 25.0};
constexpr double kMargin_m = 3;    ///< from the obstacle at a leg's end
constexpr double kOffTrack_m = 2;  ///< from houses next to it
/// In a street, houses are this near on both sides, this high above the horizon, on this fraction of a leg.
constexpr double kToHouse_m = 40, kHouse_rad = 10.0 / 180 * geodesy::kPi, kFractionOfLeg = 0.8;
constexpr double kEye_m = 1.5, kStep_m = 5;
constexpr double kLeavesCourt_m = 75;  ///< distance from the start that exceeds the width of courts

class Driver {
 public:
  Driver(const simulation::CityScene& scene, const city::Box& houses, const DriveOptions& options,
         std::uint64_t seed, const std::string& number)
      : scene_(scene), houses_(houses), options_(options), random_(seed, "study drive " + number) {}

  /// Corners in the city's frame; empty if the route ended early.
  std::vector<Vector3d> drive() {
    double heading = 2 * geodesy::kPi * random_.uniform();
    const Vector3d size = houses_.max - houses_.min;
    const double x = houses_.min.x() + random_.uniform() * size.x();
    const double y = houses_.min.y() + random_.uniform() * size.y();
    const auto start = on_terrain(x, y);
    if (!start || scene_.scene.containment(*start) != raytrace::Containment::Free ||
        !between_houses(*start, heading))
      return {};
    std::vector<Vector3d> corners{*start}, drive;
    double left_m = options_.length_m, away_m = 0;
    while (drive.empty() || away_m < kLeavesCourt_m) {
      const auto next = leg(corners, heading);
      if (!next || left_m < -4 * kLeavesCourt_m) return {};
      const Vector3d direction = *next - corners.back();
      corners.push_back(*next);
      if (drive.empty() && direction.norm() >= left_m) {
        drive = corners;
        drive.back() -= (1 - left_m / direction.norm()) * direction;
      }
      left_m -= direction.norm();
      away_m = std::max(away_m, (*next - *start).norm());
      heading = std::atan2(direction.y(), direction.x());
    }
    return drive;
  }

 private:
  [[nodiscard]] std::optional<Vector3d> on_terrain(double x, double y) const {
    const auto height = scene_.scene.terrain_height(x, y);
    if (!height) return std::nullopt;
    return Vector3d(x, y, *height + options_.height_m);
  }

  [[nodiscard]] bool free(const Vector3d& from, const Vector3d& to, double further_m) const {
    const Vector3d direction = to - from;
    const double length = direction.norm();
    return length > 0 && !scene_.scene.occluded({from, direction / length, length + further_m},
                                                scene_.scene.surface_offset_m(from));
  }

  /// Whether there are houses on both sides of a point on the terrain, none too near: at right angles to the
  /// heading or, on crossings, before or after the point.
  [[nodiscard]] bool between_houses(const Vector3d& at, double heading) const {
    const Vector3d eye = at + (std::min(options_.height_m, kEye_m) - options_.height_m) * Vector3d::UnitZ();
    for (const double side : {0.5, -0.5}) {
      bool house = false;
      for (const double aslant : {0.0, 1.0 / 6, -1.0 / 6}) {
        const double to = heading + (side + aslant) * geodesy::kPi;
        const Vector3d level(std::cos(to), std::sin(to), 0);
        const Vector3d up = std::cos(kHouse_rad) * level + std::sin(kHouse_rad) * Vector3d::UnitZ();
        const auto hit = scene_.scene.cast({eye, up, kToHouse_m}, scene_.scene.surface_offset_m(eye));
        if (!hit || scene_.city.mesh.surface_of(hit->triangle) != city::Surface::Building) continue;
        if (hit->range_m < kOffTrack_m) return false;
        house = true;
      }
      if (!house) return false;
    }
    return true;
  }

  /// Whether a leg ends between houses, and most of it is between houses.
  [[nodiscard]] bool street(const Vector3d& from, const Vector3d& to) const {
    const Vector3d direction = to - from;
    const double heading = std::atan2(direction.y(), direction.x());
    const int steps = static_cast<int>(std::ceil(direction.norm() / kStep_m));
    int others = 0;
    for (int i = steps; i > 0; --i) {
      const Vector3d at = from + static_cast<double>(i) / steps * direction;
      const auto position = on_terrain(at.x(), at.y());
      if (position && between_houses(*position, heading)) continue;
      if (i == steps || ++others > (1 - kFractionOfLeg) * steps) return false;
    }
    return true;
  }

  /// The end of the next leg: the longest of the sampled candidates; of equal ones the first.
  std::optional<Vector3d> leg(const std::vector<Vector3d>& corners, double heading) {
    const Vector3d& from = corners.back();
    std::optional<Vector3d> best;
    double best_m = 0;
    for (int direction = 0; direction < (best ? kForwardCandidates : kRoutes); ++direction) {
      // The first candidates are ahead and to the sides, the last ones in any direction.
      const double reach = direction < kForwardCandidates ? 0.67 * geodesy::kPi : geodesy::kPi;
      const double to = heading + (2 * random_.uniform() - 1) * reach;
      for (const double length_m : kLegs_m) {
        if (length_m <= best_m) break;
        const auto end = on_terrain(from.x() + length_m * std::cos(to), from.y() + length_m * std::sin(to));
        if (!end || !free(from, *end, kMargin_m) || !clears_corner(corners, *end) || !street(from, *end) ||
            scene_.scene.containment(*end) != raytrace::Containment::Free)
          continue;
        best = end;
        best_m = length_m;
        break;
      }
    }
    return best;
  }

  /// The arc of a smooth drive is between the corner and this chord.
  [[nodiscard]] bool clears_corner(const std::vector<Vector3d>& corners, const Vector3d& end) const {
    if (corners.size() < 2) return true;
    const Vector3d& at = corners.back();
    const Vector3d& before = corners[corners.size() - 2];
    const double cut_m = 0.45 * std::min((at - before).norm(), (end - at).norm());
    return free(at + cut_m * (before - at).normalized(), at + cut_m * (end - at).normalized(), 0);
  }

  const simulation::CityScene& scene_;
  const city::Box& houses_;
  const DriveOptions& options_;
  RandomStream random_;
};

}  // namespace

simulation::TrajectoryConfig random_drive(const simulation::CityScene& scene, const DriveOptions& options,
                                          std::uint64_t seed, const std::string& number) {
  city::Box houses;
  for (const city::Object& object : scene.city.mesh.objects)
    if (object.surface == city::Surface::Building) extend(houses, scene.city.mesh, object);
  if (houses.max.x() < houses.min.x()) {
    throw InputError("random drives need buildings, but the city has none", "give trajectories instead");
  }
  Driver driver(scene, houses, options, seed, number);
  for (int i = 0; i < kMaxStarts; ++i) {
    const std::vector<Vector3d> corners = driver.drive();
    if (corners.empty()) continue;
    simulation::TrajectoryConfig trajectory;
    for (const Vector3d& corner : corners)
      trajectory.waypoints.push_back(scene.city.frame.geodetic_from_local(corner));
    trajectory.speed_mps = options.speed_mps;
    trajectory.acceleration_mps2 = options.acceleration_mps2;
    trajectory.height_above_terrain_m = options.height_m;
    return trajectory;
  }
  throw InputError(fmt::format("no drive of {} m was found in streets of the city '{}', with houses within "
                               "{} m on both sides",
                               options.length_m, scene.city.name, kToHouse_m),
                   "use shorter drives, or a city with terrain and such streets");
}

}  // namespace canyon::study
