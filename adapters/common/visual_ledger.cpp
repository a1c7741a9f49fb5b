#include "adapters/common/visual_ledger.hpp"

#include <set>

namespace canyon::adapters {

std::vector<VisualLedger::Change> VisualLedger::update(const std::vector<VisualShape>& shapes,
                                                       bool everything) {
  std::vector<Change> changes;
  std::set<std::string> seen;
  for (const VisualShape& shape : shapes) {
    if (!seen.insert(shape.name).second) continue;
    const auto [at, is_new] = entries_.try_emplace(shape.name);
    Entry& entry = at->second;
    if (is_new) entry.id = next_id_();
    const bool whole = is_new || everything || !same_look(entry.shape, shape);
    if (whole || !entry.visible || !(entry.shape == shape)) {
      changes.push_back({shape.name, entry.id, true, whole, shape});
    }
    entry.visible = true;
    entry.shape = shape;
  }
  for (auto& [name, entry] : entries_) {
    if (!entry.visible || seen.contains(name)) continue;
    entry.visible = false;
    changes.push_back({name, entry.id, false, false, {}});
  }
  return changes;
}

std::vector<std::string> VisualLedger::clear() {
  std::vector<std::string> names;
  names.reserve(entries_.size());
  for (const auto& entry : entries_) names.push_back(entry.first);
  entries_.clear();
  return names;
}

}  // namespace canyon::adapters
