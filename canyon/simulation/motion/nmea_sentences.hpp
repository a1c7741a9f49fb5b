#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "canyon/base/text.hpp"

namespace canyon::simulation {

/// A sentence of NMEA 0183.
struct NmeaSentence {
  std::vector<std::string_view> fields;  ///< the address first, such as GPGGA
  bool checked = false;                  ///< has a checksum, and it holds

  [[nodiscard]] bool is(std::string_view type) const {
    return fields[0].size() == 5 && fields[0].substr(2) == type;
  }
  [[nodiscard]] std::string_view field(std::size_t i) const {
    return i < fields.size() ? trim(fields[i]) : std::string_view();
  }
};

/// Calls `each` for the sentences of a line: a logger may write its own text before and behind them, or join
/// several. Returns how many are damaged: their checksum is wrong, or the next begins before their end. Bytes
/// that are no text are another protocol's.
std::size_t each_nmea_sentence(std::string_view line, const std::function<void(const NmeaSentence&)>& each);

}  // namespace canyon::simulation
