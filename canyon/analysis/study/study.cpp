#include "canyon/analysis/study/study.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::study {

namespace {

using options::Node;
using options::plain_key;
using options::scalar_node;

constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
constexpr const char* kNeeds = "it needs at least scenario and axes";
/// Number of values of an axis that are checked in the scenario before any run.
constexpr std::size_t kMaxTried = 1000;

/// Collects the files that options name: the key of a study contains their contents instead of their names.
class FileHasher final : public options::Visitor {
 public:
  std::set<std::string> names;

 protected:
  void field(const options::Field& /*field*/, options::Value& value) override {
    if (value.type() != options::Type::File && value.type() != options::Type::Files) return;
    if (!value.given()) return;
    Node node;
    try {
      options::Document document;
      document.file = "(files)";
      node = options::parse_yaml("a: " + value.text(), document, "");
    } catch (const InputError&) {
      return;
    }
    const Node& files = node.entries.front().value;
    if (files.kind == Node::Kind::Scalar) names.insert(files.text);
    for (const Node& item : files.items) names.insert(item.text);
  }
  bool begin(std::string_view /*name*/) override { return true; }
  std::optional<std::size_t> begin_list(std::string_view /*name*/, std::size_t count) override {
    return count;
  }
  void begin_item(std::size_t /*index*/) override {}
  void end() override {}
};

std::string hash_text(std::string_view text) {
  return fmt::format("{:016x}{:016x}", fnv1a(text),
                     fnv1a(fmt::format("canyon {}", text.size()) + std::string(text)));
}

/// Bytes of results for each run and receiver, and for each of their epochs if epochs are stored; records and
/// NetCDF file of a study together, rounded up.
constexpr double kBytesOfSummary = 1000, kBytesOfEpoch = 76;

/// Approximate number of epochs of a run: from duration_s, or the length of the route. @param drives of the
/// study, or null @param report receives the report on the file of a trajectory
double estimated_epochs(const simulation::Scenario& scenario, const Axis* drives, ReadReport& report) {
  const simulation::TrajectoryConfig& route = scenario.trajectory;
  double drive_duration_s = scenario.duration_s.value_or(0), rate_hz = scenario.rate_hz.value_or(1);
  if (drives != nullptr) {
    drive_duration_s = drives->drives.length_m / drives->drives.speed_mps;
  } else if (route.file) {
    const simulation::TrajectoryFile file = simulation::make_trajectory(scenario, 0);
    report.append(file.report);
    const simulation::Trajectory& trajectory = file.trajectory;
    drive_duration_s = trajectory.end() - trajectory.begin();
    rate_hz = scenario.rate_hz.value_or(1 / trajectory.sample_interval_s());
  } else if (route.waypoints.size() > 1) {
    // Waypoints in the frame of a city that is not yet read have only distances.
    std::vector<Eigen::Vector3d> points;
    for (const auto& position : route.waypoints) points.push_back(geodesy::ecef_from_geodetic(position));
    for (const auto& [index, local] : route.local_waypoints) points.at(index) = local;
    drive_duration_s = route.hold_s * static_cast<double>(points.size());
    for (std::size_t i = 1; i < points.size(); ++i)
      drive_duration_s += (points[i] - points[i - 1]).norm() / route.speed_mps;
  }
  if (scenario.duration_s) drive_duration_s = std::min(drive_duration_s, *scenario.duration_s);
  return std::max(1.0, drive_duration_s * rate_hz + 1);
}

}  // namespace

void visit(options::Visitor& v, Study& o) {
  static constexpr std::array<std::string_view, 3> kDesigns{"grid", "random", "latin_hypercube"};
  static constexpr std::array<std::string_view, 2> kKeeps{"summary", "epochs"};
  v.require("scenario", "give a scenario file, or write a scenario below it");
  v.text({"scenario", "", "scenario file (relative to the study), or a scenario written here"}, o.scenario);
  v.require("axes", "give a list: axes: [{seeds: 10}]");
  v.list("axes", o.axes, [&](Axis& axis) { visit(v, axis); });
  v.choice({"design", "", "combinations of the axes' values to run"}, o.design, kDesigns);
  std::uint32_t runs = o.runs.value_or(0);
  if (v.wants(v.reads() ? v.has("runs") : o.runs.has_value())) {
    v.integer({"runs", "", "points of a random or Latin hypercube sample", "none"}, runs, 1, 100'000'000);
    if (v.reads()) o.runs = runs;
  }
  v.integer({"seed", "", "seed of the points of a sample, of drives and of the bootstrap"}, o.seed);
  v.choice({"keep", "", "results kept of each run: its summary, or also every epoch"}, o.keep, kKeeps);
  v.number({"available_m", "m", "an epoch is available if its fix is within this distance of the truth",
            "any fix"},
           o.available_m, {0, 1e6, true});
  v.number({"along_m", "m", "length of segments for errors along the route: along.csv and a picture", "none"},
           o.along_m, {0.1, 1e6});
  v.integer({"max_runs", "", "largest number of runs"}, o.max_runs, 1, 1'000'000'000);
  v.number({"max_output_gb", "GB", "largest size of the results"}, o.max_output_gb, {0, 1e9, true});
  v.number({"city_memory_gb", "GB", "cities kept in memory for later runs"}, o.city_memory_gb, {0, 1e6});
  v.number({"confidence", "", "confidence of intervals"}, o.confidence, {0.5, 1, false, true});
  v.integer({"bootstrap", "", "number of resamples for an interval"}, o.bootstrap, 100, 1'000'000);
  if (!v.reads()) return;
  if (o.design == Design::Grid && o.runs) throw v.fault("runs", "a grid counts its own", "leave it out");
  if (o.design != Design::Grid && !o.runs)
    throw v.fault("design", "a sample needs 'runs'", "give the number of points");
  std::set<std::string> names;
  std::size_t drives = 0, unknowns = 0;
  for (const Axis& axis : o.axes) {
    if (!names.insert(axis.name).second)
      throw v.fault("axes", fmt::format("'{}' names two axes", axis.name), "give each its own name");
    if (axis.size() == 0 && (o.design == Design::Grid || axis.crossed)) {
      throw v.fault("axes", fmt::format("axis '{}' lists no values", axis.name),
                    "give step or count, or use a sample (design: random)");
    }
    drives += axis.kind == Axis::Kind::Drives ? 1 : 0;
    unknowns += axis.kind == Axis::Kind::Unknowns ? 1 : 0;
  }
  if (o.along_m && o.keep != Retention::Epochs)
    throw v.fault("along_m", "needs every epoch", "add keep: epochs");
  if (o.along_m && drives > 0)
    throw v.fault("along_m", "needs one route for all runs, but an axis has random drives",
                  "remove one of them");
  if (drives > 1) throw v.fault("axes", "two axes have drives", "keep one");
  if (unknowns > 1) throw v.fault("axes", "two axes have unknowns", "keep one");
}

const options::Description& study_description() {
  static const options::Description description = options::describe<Study>();
  return description;
}

StudyPlan StudyPlan::read(const std::filesystem::path& path) {
  const TextFile file(path, kMaxBytes);
  return parse(std::string(file.text()), path);
}

StudyPlan StudyPlan::parse(const std::string& text, const std::filesystem::path& name) {
  StudyPlan plan;
  plan.study_.file = name;
  options::Document document;
  document.file = name;
  document.kind = "study";
  document.page = "docs/study.md";
  document.set_keys(study_description());
  Node root = options::parse_yaml(text, document, kNeeds);

  // The list of fields reads unknown trees as texts on one line.
  const Node whole = root;
  bool inside = false;
  for (Node::Entry& entry : root.entries) {
    if (entry.key == "scenario" && entry.value.kind == Node::Kind::Mapping) {
      plan.base_ = std::exchange(entry.value, scalar_node(Study::kInline, entry.line));
      inside = true;
    }
    if (entry.key != "axes") continue;
    for (Node& axis : entry.value.items) {
      for (Node::Entry& field : axis.entries) {
        if (field.key != "values") continue;
        for (Node& item : field.value.items) item = scalar_node(flow_text(item), item.line);
      }
    }
  }
  options::read(root, document, plan.study_);
  plan.read_axes(whole);
  if (inside) {
    plan.base_file_ = name;
  } else {
    plan.base_file_ = name.parent_path() / plan.study_.scenario;
    options::Document base;
    base.file = plan.base_file_;
    plan.base_ = options::parse_yaml(std::string(TextFile(plan.base_file_, kMaxBytes).text()), base,
                                     "it needs at least city, sky and trajectory");
  }
  check_keys(plan.study_.axes, plan.base_, plan.study_.file);
  plan.make_points();
  plan.try_values();
  plan.check_size();
  return plan;
}

// Adds trees and lines to the texts of visit(), and checks that the keys are a scenario's.
void StudyPlan::read_axes(const Node& root) {
  std::vector<std::string> known = simulation::scenario_description().paths();
  for (const auto& [name, path] : simulation::scenario_description().former_names) known.push_back(name);
  const auto is_list = [&](const std::string& key) {
    const std::string items = plain_key(key) + "[]";
    return std::any_of(known.begin(), known.end(), [&](auto& path) { return path.starts_with(items); });
  };
  const Node& list = root.find("axes")->value;
  for (std::size_t i = 0; i < study_.axes.size(); ++i) {
    Axis& axis = study_.axes[i];
    const Node& from = list.items[i];
    axis.line = from.line;
    if (const Node::Entry* key = from.find("key")) axis.line = key->line;
    if (const Node::Entry* values = from.find("values")) {
      axis.trees = values->value.items;
      if (values->value.kind == Node::Kind::Scalar) axis.trees = {values->value};
    }
    for (std::size_t k = 0; k < axis.trees.size(); ++k) {
      Node& tree = axis.trees[k];
      // `none`: no items, or the scenario as it is.
      if (tree.kind == Node::Kind::Scalar && tree.text == "none" && (axis.key.empty() || is_list(axis.key)))
        tree.kind = axis.key.empty() ? Node::Kind::Mapping : Node::Kind::List;
      if (tree.kind == Node::Kind::Empty) {
        throw InputError(study_.file, tree.line, fmt::format("axis '{}': an empty value", axis.name),
                         "write a value, or a mapping of keys");
      }
      if (axis.key.empty() && tree.kind != Node::Kind::Mapping) {
        throw InputError(study_.file, tree.line,
                         fmt::format("axis '{}' has no key, and the value {} is not a mapping of keys",
                                     axis.name, axis.values[k]),
                         "give the axis a key");
      }
      for (std::size_t j = 0; j < k; ++j) {
        if (axis.values[j] != axis.values[k]) continue;
        throw InputError(study_.file, tree.line,
                         fmt::format("axis '{}' has the value {} twice", axis.name, axis.values[k]),
                         "keep one of them");
      }
      for (const auto& [key, of] : settings_of(axis, {tree, {}, {}})) {
        const std::string plain = plain_key(key);
        const bool is_known = std::any_of(known.begin(), known.end(), [&](const std::string& path) {
          return path == plain || (path.compare(0, plain.size(), plain) == 0 &&
                                   (path[plain.size()] == '.' || path[plain.size()] == '['));
        });
        if (is_known) continue;
        throw InputError(study_.file, axis.line,
                         fmt::format("axis '{}': a scenario has no key '{}'", axis.name, key),
                         did_you_mean(closest(plain, known), "'canyon scenario keys' prints them all"));
      }
    }
  }
}

void StudyPlan::make_points() {
  const bool grid = study_.design == Design::Grid;
  points_ = grid ? 1 : *study_.runs;
  samples_.resize(study_.axes.size());
  double runs = static_cast<double>(points_);
  for (const Axis& axis : study_.axes)
    if (grid || axis.crossed) runs *= static_cast<double>(axis.size());
  if (runs > static_cast<double>(study_.max_runs)) {
    throw InputError(study_.file, 0,
                     fmt::format("the study has {:.0f} runs, but max_runs is {}", runs, study_.max_runs),
                     "use fewer values, use a sample (design: latin_hypercube), or increase max_runs");
  }
  size_ = static_cast<std::size_t>(runs);
  for (std::size_t i = 0; i < study_.axes.size(); ++i) {
    const Axis& axis = study_.axes[i];
    if (axis.kind == Axis::Kind::Unknowns) {
      std::vector<unknowns::Unknown> known;
      for (const std::string& name : axis.known) known.push_back(unknowns::unknown_of(name));
      unknown_samples_.emplace(study_.seed, axis.size(), std::move(known));
    }
    if (grid || axis.crossed) continue;
    samples_[i] = draw_sample(RandomStream(study_.seed, "study axis " + axis.name), points_,
                              study_.design == Design::LatinHypercube);
  }
}

StudyRun StudyPlan::run(std::size_t number) const {
  StudyRun run;
  run.number = number;
  run.at.resize(study_.axes.size());
  // The last axis varies fastest, points slowest.
  std::size_t rest = number;
  for (std::size_t i = study_.axes.size(); i-- > 0;) {
    const Axis& axis = study_.axes[i];
    if (!samples_[i].empty()) continue;
    run.at[i] = value_at(axis, {rest % axis.size(), 0});
    rest /= axis.size();
  }
  const std::size_t point = rest;
  if (points_ > 1) run.realization = fmt::format("point={}\n", point);
  for (std::size_t i = 0; i < study_.axes.size(); ++i) {
    const Axis& axis = study_.axes[i];
    if (!samples_[i].empty()) {
      const double u = samples_[i].at(point);
      const auto n = static_cast<double>(axis.size());
      run.at[i] = value_at(axis, {static_cast<std::size_t>(u * n), u});
    }
    // Seeds are set in the scenario itself.
    if (axis.realization && axis.key != "seed")
      run.realization += fmt::format("{}={}\n", axis.name, run.at[i].text);
  }
  return run;
}

// Errors in settings of an axis are reported at the study's line; its files are relative to the study.
options::Document StudyPlan::document(const std::vector<AxisValue>& at) const {
  options::Document document;
  document.file = base_file_;
  document.kind = "scenario";
  document.set_keys(simulation::scenario_description());
  // Key -> the last axis that sets it.
  std::vector<std::pair<std::string, std::string>> set;
  for (std::size_t i = 0; i < at.size(); ++i)
    for (const auto& [key, tree] : settings_of(study_.axes[i], at[i]))
      set.emplace_back(plain_key(key), fmt::format("axis {} = {}", study_.axes[i].name, at[i].label));
  const auto blame = [set](const std::string& path) -> const std::string* {
    const std::string plain = plain_key(path);
    for (auto it = set.rbegin(); it != set.rend(); ++it) {
      if (plain.compare(0, it->first.size(), it->first) == 0) {
        static thread_local std::string text;
        text = it->second;
        return &text;
      }
    }
    return nullptr;
  };
  const std::filesystem::path base = base_file_, study = study_.file;
  document.fault = [blame, base, study](const std::string& path, const std::string& key, int line,
                                        std::string_view problem, std::string_view hint) {
    const std::string whole = key.empty() ? path : path.empty() ? key : path + "." + key;
    const std::string* axis = blame(whole);
    const std::string message = key.empty() ? std::string(problem) : fmt::format("{}: {}", key, problem);
    return axis == nullptr ? InputError(base, line, message, hint)
                           : InputError(study, line, fmt::format("{}: {}", *axis, message), hint);
  };
  document.find_file = [blame, base, study](const std::string& name,
                                            const options::SourceLocation& location) {
    const std::string whole = location.section.empty() ? location.key : location.section + "." + location.key;
    const std::filesystem::path path = (blame(whole) == nullptr ? base : study).parent_path() / name;
    std::error_code ignored;
    const bool folder = std::filesystem::is_directory(path, ignored) && (name.empty() || name.back() != '/');
    if (!std::filesystem::exists(path, ignored) || folder) {
      throw location.error(fmt::format("there is no file '{}'", path.string()),
                           "paths are relative to the folder of the file that names them");
    }
    return path;
  };
  return document;
}

simulation::Scenario StudyPlan::scenario(const StudyRun& run) const {
  Node root = base_;
  for (std::size_t i = 0; i < run.at.size(); ++i) {
    for (const auto& [key, tree] : settings_of(study_.axes[i], run.at[i])) {
      try {
        const std::string& name = key;
        if (tree->kind == Node::Kind::List && tree->items.empty())
          std::erase_if(root.entries, [&](const Node::Entry& entry) { return entry.key == name; });
        else
          set_at(root, key, *tree);
      } catch (const InputError& e) {
        throw InputError(study_.file, study_.axes[i].line,
                         fmt::format("axis {}: {}", study_.axes[i].name, e.problem()), e.hint());
      }
    }
  }
  const options::Document from = document(run.at);
  simulation::Scenario scenario;
  scenario.file = base_file_;
  if (drives() != nullptr) {
    simulation::ScenarioOfAnyTrajectory any{scenario};
    options::read(root, from, any);
  } else {
    options::read(root, from, scenario);
  }
  for (std::size_t i = 0; i < run.at.size(); ++i) {
    if (study_.axes[i].kind != Axis::Kind::Unknowns) continue;
    unknown_samples_->apply(static_cast<std::size_t>(*parse_integer(run.at[i].text)) - 1, scenario);
  }
  if (!run.realization.empty())
    scenario.seed = fnv1a(fmt::format("{}\n{}", scenario.seed, run.realization)) & 0x7fffffffffffffffU;
  return scenario;
}

const Axis* StudyPlan::drives() const {
  for (const Axis& axis : study_.axes)
    if (axis.kind == Axis::Kind::Drives) return &axis;
  return nullptr;
}

bool StudyPlan::groups(const Axis& axis) const {
  constexpr std::size_t kMaxGroups = 64;
  return !axis.realization && axis.size() > 0 && axis.size() <= kMaxGroups;
}

// Checks each value of each axis once, with the first values of the other axes, so that an invalid value is
// found before hours of work. Receivers, key and size follow from these scenarios.
void StudyPlan::try_values() {
  std::string about = fmt::format(
      "canyon study 1\ndesign {}\nruns {}\nseed {}\nkeep {}\navailable {}\n", static_cast<int>(study_.design),
      size_, study_.seed, static_cast<int>(study_.keep), options::show(study_.available_m.value_or(0)));
  std::vector<Level> first(study_.axes.size());
  std::set<std::string> files;
  std::string scenarios;
  const auto try_at = [&](const std::vector<Level>& levels) {
    StudyRun run;
    for (std::size_t i = 0; i < levels.size(); ++i) run.at.push_back(value_at(study_.axes[i], levels[i]));
    simulation::Scenario tried = scenario(run);
    FileHasher hasher;
    visit(hasher, tried);
    files.insert(hasher.names.begin(), hasher.names.end());
    scenarios += options::exact_text(tried);
    for (const simulation::ReceiverConfig& receiver : tried.receivers) {
      const std::string& name = receiver.options.name;
      if (std::find(receivers_.begin(), receivers_.end(), name) == receivers_.end())
        receivers_.push_back(name);
    }
    return tried;
  };
  const simulation::Scenario plain = try_at(first);
  for (std::size_t i = 0; i < study_.axes.size(); ++i) {
    const Axis& axis = study_.axes[i];
    about += options::exact_text(axis);
    const bool needs_samples = axis.kind == Axis::Kind::Drives || axis.kind == Axis::Kind::Unknowns;
    if (axis.kind == Axis::Kind::Seeds || needs_samples) continue;
    const bool values = axis.kind == Axis::Kind::Values;
    const std::size_t n = axis.size(), tries = values ? std::min(n, kMaxTried) : 2;
    for (std::size_t k = 1; k < tries; ++k) {
      std::vector<Level> levels = first;
      levels[i] = values ? Level{k, 0} : Level{n > 0 ? n - 1 : 0, 1 - 1e-9};
      (void)try_at(levels);
    }
  }
  for (const std::string& name : files) replace_all(scenarios, name, hash_text(TextFile(name).text()));
  if (drives() != nullptr) about += "streets\n";  // earlier versions used other routes
  key_ = hash_text(about + scenarios);
  epochs_ = estimated_epochs(plain, drives(), report_);
  bytes_ = static_cast<double>(size_) * static_cast<double>(receivers_.size()) *
           (kBytesOfSummary + (study_.keep == Retention::Epochs ? kBytesOfEpoch * epochs_ : 0));
}

void StudyPlan::check_size() const {
  if (bytes_ <= study_.max_output_gb * 1e9) return;
  throw InputError(
      study_.file, 0,
      fmt::format("the study would write about {:.3g} GB ({} runs, {} receivers, {:.0f} epochs each), but "
                  "max_output_gb is {}",
                  bytes_ / 1e9, size_, receivers_.size(), epochs_, study_.max_output_gb),
      study_.keep == Retention::Epochs ? "keep: summary, use fewer runs, or increase max_output_gb"
                                       : "use fewer runs, or increase max_output_gb");
}

}  // namespace canyon::study
