#include "canyon/buildings/build_report.hpp"

#include <fmt/format.h>

#include "canyon/buildings/city_builder.hpp"

namespace canyon::buildings {

void Complaints::add(const std::string& kind, const std::string& id) {
  auto found = index_.find(kind);
  if (found == index_.end()) {
    if (kinds_.size() == kKinds) {
      ++further_;
      return;
    }
    found = index_.emplace(kind, kinds_.size()).first;
    kinds_.push_back({kind, {}, 0});
  }
  Kind& entry = kinds_[found->second];
  ++entry.count;
  if (entry.ids.size() < kIdsOfAKind) entry.ids.push_back(id);
}

std::vector<std::string> Complaints::lines() const {
  std::vector<std::string> lines;
  for (const Kind& kind : kinds_) {
    std::string line = fmt::format("{}: {}", kind.text, fmt::join(kind.ids, ", "));
    if (kind.count > kind.ids.size()) line += fmt::format(" and {} more", kind.count - kind.ids.size());
    lines.push_back(std::move(line));
  }
  if (further_ > 0) lines.push_back(fmt::format("{} further remarks of other kinds", further_));
  return lines;
}

std::string format_report(const BuildReport& r) {
  std::string text;
  const auto line = [&text](const char* label, const std::string& rest) {
    text += fmt::format("{:<12}{}\n", label, rest);
  };
  // ", 3 so", only where there are any.
  const auto also = [](std::size_t n, const char* what) {
    return n == 0 ? std::string() : fmt::format(", {} {}", n, what);
  };
  line("buildings", fmt::format("{}{}{}", r.buildings, also(r.outlines_cut, "of them beside or below parts"),
                                also(r.outlines_replaced, "more replaced by their parts")));
  line("parts", fmt::format("{}{}{}", r.parts, also(r.parts_alone, "without an outline"),
                            also(r.parts_beyond, "reaching beyond theirs")));
  if (r.surveyed > 0) line("surfaces", fmt::format("{} with surfaces of their own", r.surveyed));
  if (r.trees > 0 || r.woods > 0) line("foliage", fmt::format("{} trees, {} woods", r.trees, r.woods));
  if (r.foliage_left_out > 0) {
    line("foliage", fmt::format("{} trees, rows and woods of the map left out (foliage takes them)",
                                r.foliage_left_out));
  }
  line("heights",
       fmt::format("{} tagged, {} from levels, {} by default{}", r.heights_tagged, r.heights_from_levels,
                   r.heights_default, also(r.heights_inherited, "taken from the building of a part")));
  line("guesses",
       fmt::format("{} roof heights, {} facade materials (concrete)", r.roofs_default, r.materials_default));
  line("geometry", fmt::format("{} repaired, {} skipped", r.repaired, r.skipped));
  return text;
}

}  // namespace canyon::buildings
