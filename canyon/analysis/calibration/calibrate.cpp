#include "canyon/analysis/calibration/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/analysis/calibration/direct_estimates.hpp"
#include "canyon/analysis/calibration/likelihood_fit.hpp"
#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/unknowns/unknowns.hpp"

namespace canyon::calibration {
namespace {

using Resamples = std::vector<std::vector<std::uint16_t>>;

/// Length of the bootstrap's blocks of time [s], and number of resamples.
constexpr double kBlock_s = 60;
constexpr int kResamples = 60;

/// Adds all systems other than the recorded ones: the receiver may have systems that the profile leaves out.
simulation::ReceiverConfig with_all_systems(simulation::ReceiverConfig receiver) {
  receiver.options.tracks.clear();
  receiver.options.leaves_out.clear();
  receiver.options.fix_input.uses.clear();
  return receiver;
}

/// Keys that have little effect on tracked satellites and their C/N0.
void add_unidentifiable(const Values& base, Calibration& result) {
  for (const auto& [key, why] :
       {std::pair("signal.offset_db", "needs many satellites of each system in clear view"),
        {"signal.dll.loop_bandwidth_hz", "errors depend more on multipath than on the loop"},
        {"signal.dll.spacing_chips", "errors depend more on multipath than on the loop"},
        {"noise.sigma_m_per_sqrt_s", "range errors (sky.errors) replace it if there are navigation files"},
        {"signal.lock.reacquisition_s", "gaps depend more on obstacles than on the receiver"}}) {
    const auto value = base.find(key);
    const bool known = std::any_of(result.estimates.begin(), result.estimates.end(),
                                   [key = key](const Estimate& e) { return e.key == key; });
    if (value == base.end() || known) continue;
    result.add({key, "", value->second, {}, {}, Estimate::Verdict::Unidentified, why});
  }
}

}  // namespace

Calibration calibrate(const std::vector<Drive>& drives, const CalibrateOptions& options) {
  if (drives.empty()) throw InputError("calibration needs a recording", "give one");
  if (options.seeds < 1)
    throw InputError(fmt::format("{} seeds are too few", options.seeds), "give 1 or more");
  for (const Drive& drive : drives) {
    if (drive.receiver.options.signal.enabled) continue;
    throw InputError(
        fmt::format("{}: the receiver's signals have no strength: nothing to calibrate", drive.name),
        "use a profile that has signal: {enabled: true}: --profile ublox-m8t");
  }
  const simulation::ReceiverConfig& receiver = drives.front().receiver;

  std::vector<Observed> recorded;
  std::vector<std::set<gnss::System>> skies;
  std::vector<FitDrive> fit_drives;
  Resamples samples(kResamples);
  for (const Drive& drive : drives) {
    validation::CompareOptions compare;
    compare.threads = options.threads;
    compare.progress = [&](std::size_t done, std::size_t epochs) {
      if (options.progress) options.progress(drive.name + ": satellites in clear view", done, epochs);
    };
    const validation::Comparison comparison =
        validation::compare(drive.recording, with_all_systems(drive.receiver), *drive.environment,
                            drive.registration, drive.seed, compare);
    recorded.push_back(observed(comparison));
    skies.push_back(drive.systems);
    FitDrive& fit = fit_drives.emplace_back();
    fit.drive = &drive;
    for (const validation::NeverTracked& s : validation::never_tracked(comparison))
      fit.leave_out.insert(s.id);
    // Blocks of all drives, concatenated.
    const std::vector<geodesy::GpsTime>& times = recorded.back().times;
    const Resamples own = validation::time_block_bootstrap(times, kBlock_s, kResamples, drive.seed);
    for (std::size_t k = 0; k < samples.size(); ++k)
      samples[k].insert(samples[k].end(), own[k].begin(), own[k].end());
  }

  Calibration result;
  add_tracked(recorded, skies, receiver, result);
  add_step(recorded, receiver, result);
  add_phase_threshold(recorded, receiver, samples, result);
  add_lock_thresholds(recorded, receiver, samples, result);
  add_likelihood_fit(fit_drives, options, result);
  add_unidentifiable(values_of(receiver), result);
  return result;
}

namespace {

/// Fractions of buildings with coated glass in the simulations.
constexpr std::array kCoatedFractions = {0.0, 0.35, 0.7};

}  // namespace

simulation::Scenario with_coated_glass(simulation::Scenario scenario, double fraction) {
  scenario.city.facades.fractions = unknowns::facades_with(fraction);
  return scenario;
}

std::vector<Facades> open_facades(
    const simulation::Scenario& scenario,
    const std::function<std::unique_ptr<simulation::Environment>(const simulation::Scenario&)>& draw) {
  std::vector<Facades> facades;
  if (!unknowns::leaves_facades_open(scenario)) return facades;
  for (const double fraction : kCoatedFractions)
    facades.push_back({fraction, [=] { return draw(with_coated_glass(scenario, fraction)); }});
  return facades;
}

std::optional<double> fitted_glass(const Calibration& result) {
  if (!result.coated_glass || result.coated_glass->verdict != Estimate::Verdict::Fitted) return {};
  return parse_double(result.coated_glass->recorded);
}

std::vector<std::string> facade_fractions(double coated_glass) {
  std::vector<std::string> items;
  for (const auto& [facade, fraction] : unknowns::facades_with(coated_glass))
    items.push_back(fmt::format("{}={:.0f}", facade, 100 * fraction));
  return items;
}

namespace {

using Verdict = Estimate::Verdict;

struct Line {
  std::string path, value;
};
std::vector<Line> lines_of(const simulation::ReceiverConfig& receiver) {
  std::vector<Line> lines;
  const std::string text = options::dotted(receiver, true);
  for (const std::string_view line : split(text, '\n'))
    if (const std::size_t colon = line.find(": "); colon != std::string_view::npos)
      lines.push_back({std::string(line.substr(0, colon)), std::string(line.substr(colon + 2))});
  return lines;
}

/// Writes the sections of dotted keys. The comment may be empty.
class NestedText {
 public:
  void add(const std::string& path, const std::string& value, const std::string& comment = {}) {
    std::vector<std::string> names;
    for (const std::string_view name : split(path, '.')) names.emplace_back(name);
    std::size_t same = 0;
    while (same + 1 < names.size() && same < open_.size() && open_[same] == names[same]) ++same;
    open_.resize(same);
    for (; open_.size() + 1 < names.size(); open_.push_back(names[open_.size()]))
      text_ += std::string(2 * open_.size(), ' ') + names[open_.size()] + ":\n";
    std::string line = fmt::format("{}{}: {}", std::string(2 * open_.size(), ' '), names.back(), value);
    if (!comment.empty()) {
      constexpr std::size_t kColumn = 40;
      line += fmt::format("{}# {}", std::string(line.size() + 1 < kColumn ? kColumn - line.size() : 1, ' '),
                          comment);
    }
    text_ += line + "\n";
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
  std::vector<std::string> open_;
};

std::string comment_of(const Estimate& e) {
  const std::string range = e.interval.empty() ? "" : fmt::format(", 95 % {}", e.interval);
  if (e.verdict == Verdict::Fitted) return fmt::format("was {}; {}{}", e.before, e.basis, range);
  return fmt::format("kept: recorded {}{}; {}", e.recorded, range, e.basis);
}

}  // namespace

std::string to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::Fitted:
      return "fitted";
    case Verdict::Agrees:
      return "agrees";
    case Verdict::Unidentified:
      break;
  }
  return "not identified";
}

void set_values(const Values& values, simulation::ReceiverConfig& receiver, const std::string& what) {
  if (values.empty()) return;
  options::Document document;
  document.file = what;
  document.kind = "profile";
  document.set_keys(options::description_of<simulation::ReceiverConfig>());
  std::string text;
  for (const auto& [path, value] : values) text += fmt::format("{}: {}\n", path, value);
  const options::Node root = options::parse_yaml(text, document, "keys of a receiver");
  options::read(options::without_dots(root, document), document, receiver);
}

Values values_of(const simulation::ReceiverConfig& receiver) {
  Values values;
  for (const Line& line : lines_of(receiver)) values[line.path] = line.value;
  return values;
}

std::string rounded(double value, double sigma) {
  if (!(sigma > 0)) return options::show(value);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 9);
  return options::show(*parse_double(fmt::format("{:.{}f}", value, decimals)));
}

std::string to_text(const std::vector<Estimate>& estimates) {
  std::vector<TextRow> rows;
  const auto or_none = [](const std::string& text) { return text.empty() ? "-" : text; };
  for (const Estimate& e : estimates) {
    rows.push_back({e.unit.empty() ? e.key : fmt::format("{} [{}]", e.key, e.unit), or_none(e.before),
                    or_none(e.recorded), or_none(e.interval), to_string(e.verdict), e.basis});
  }
  return text_table({"key", "profile", "recorded", "95 %", "verdict", "from"}, rows);
}

std::string to_json(const std::vector<Estimate>& estimates) {
  Json list = Json::array();
  for (const Estimate& e : estimates) {
    list.push_back({{"key", e.key},
                    {"unit", e.unit},
                    {"before", e.before},
                    {"after", e.after()},
                    {"recorded", e.recorded},
                    {"interval_95", e.interval},
                    {"verdict", to_string(e.verdict)},
                    {"basis", e.basis}});
  }
  return list.dump(2) + "\n";
}

std::string profile_text(const simulation::ReceiverConfig& receiver, const std::vector<Estimate>& estimates,
                         const ProfileHead& head) {
  std::string text;
  for (const std::string& note : head.notes) text += "# " + note + "\n";
  std::string quoted;
  for (const char c : head.description)
    quoted += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  text += fmt::format("description: \"{}\"\n", quoted);

  const Values defaults = values_of(simulation::ReceiverConfig());
  NestedText keys;
  for (const Line& line : lines_of(receiver)) {
    if (line.path.starts_with("signal.shadowing.")) continue;
    const auto estimate = std::find_if(estimates.begin(), estimates.end(),
                                       [&line](const Estimate& e) { return e.key == line.path; });
    const bool known = estimate != estimates.end() && estimate->verdict != Verdict::Unidentified;
    const auto usual = defaults.find(line.path);
    if (!known && usual != defaults.end() && usual->second == line.value) continue;
    keys.add(line.path, line.value, known ? comment_of(*estimate) : "as " + head.base);
  }
  text += keys.text();
  bool any = false;
  for (const Estimate& e : estimates) {
    if (e.verdict != Verdict::Unidentified) continue;
    if (!any) text += "# Not identified by these recordings, unchanged from " + head.base + ":\n";
    any = true;
    text += fmt::format("#   {}: {}\n", e.key, e.basis);
  }
  return text;
}

}  // namespace canyon::calibration
