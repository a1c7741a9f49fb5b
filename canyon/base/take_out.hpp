#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace canyon {

/// Takes the marked records out; the others stay in order. Calls `taken` for each that goes.
template <typename Record, typename Marks, typename Taken>
void take_out(std::vector<Record>& records, const Marks& marks, const Taken& taken) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (marks[i]) {
      taken(std::as_const(records[i]));
    } else {
      if (kept != i) records[kept] = std::move(records[i]);
      ++kept;
    }
  }
  records.erase(records.begin() + static_cast<std::ptrdiff_t>(kept), records.end());
}

}  // namespace canyon
