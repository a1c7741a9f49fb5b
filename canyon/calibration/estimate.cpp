#include "canyon/calibration/estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/table_text.hpp"
#include "canyon/base/text.hpp"
#include "canyon/options/read.hpp"
#include "canyon/options/settings_tree.hpp"
#include "canyon/options/values.hpp"
#include "canyon/simulation/scenario/profile.hpp"

namespace canyon::calibration {
namespace {

using Verdict = Estimate::Verdict;

struct Line {
  std::string path, value;
};
std::vector<Line> lines_of(const simulation::ReceiverConfig& receiver) {
  std::vector<Line> lines;
  const std::string text = options::dotted(receiver, true);
  for (const std::string_view line : split(text, '\n')) {
    if (const std::size_t colon = line.find(": "); colon != std::string_view::npos)
      lines.push_back({std::string(line.substr(0, colon)), std::string(line.substr(colon + 2))});
  }
  return lines;
}

/// Opens sections as lines name them. The comment may be empty.
class NestedText {
 public:
  void add(const std::string& path, const std::string& value, const std::string& comment = {}) {
    std::vector<std::string> names;
    for (const std::string_view name : split(path, '.')) names.emplace_back(name);
    std::size_t same = 0;
    while (same + 1 < names.size() && same < open_.size() && open_[same] == names[same]) ++same;
    open_.resize(same);
    for (; open_.size() + 1 < names.size(); open_.push_back(names[open_.size()])) {
      text_ += std::string(2 * open_.size(), ' ') + names[open_.size()] + ":\n";
    }
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
  for (const simulation::ScenarioKey& key : simulation::profile_keys()) document.known.push_back(key.path);
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
                    {"after", e.after},
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
    if (!any) text += "# Not identified by these recordings, and left as " + head.base + " has it:\n";
    any = true;
    text += fmt::format("#   {}: {}\n", e.key, e.basis);
  }
  return text;
}

}  // namespace canyon::calibration
