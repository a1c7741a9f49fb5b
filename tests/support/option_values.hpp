#pragma once

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "canyon/base/options/describe.hpp"
#include "canyon/base/text.hpp"

namespace canyon::test {

/// Values of a key that a reader must reject, as YAML on one line: of the wrong type, empty, out of range.
inline std::vector<std::string> bad_values(const options::Key& key) {
  using options::Type;
  if (key.type == Type::Boolean) return {"perhaps", "[true, false]", "''"};
  if (key.type == Type::Choice) return {"xyzzyplugh", "[a, b]", "''"};
  if (key.type == Type::Text) return {"[a, b]", "''"};
  if (key.type == Type::Texts && !key.words.empty()) return {"xyzzyplugh", "[]", "''"};
  if (key.type == Type::Texts) return {"{a: 1}", "[]", "''"};
  if (key.type == Type::File) return {"nowhere", "[a, b]", "''"};
  if (key.type == Type::Files) return {"nowhere", "{a: 1}", "[]", "''"};
  if (key.type == Type::Rows) return {"2000 2000 2000", "[]", "''"};
  std::vector<std::string> values{"ten", "{a: 1}", "''"};
  if (!key.range) return values;
  const double low = key.range->low;
  const double high = key.range->high;
  if (std::isfinite(low)) {
    if (key.range->low_open) values.push_back(fmt::format("{}", low));
    values.push_back(fmt::format("{}", low - std::max(1.0, std::abs(low))));
  }
  if (std::isfinite(high) && high < 1e18) {
    if (key.range->high_open) values.push_back(fmt::format("{}", high));
    values.push_back(key.type == Type::Integer
                         ? fmt::format("{:.0f}", high + 1)
                         : fmt::format("{}", high + std::max(1e-3, 0.1 * std::abs(high))));
  }
  return values;
}

/// An allowed, non-default value of a key.
inline std::string another_value(const options::Key& key) {
  using options::Type;
  if (key.type == Type::Boolean) return key.default_value == "true" ? "false" : "true";
  if (key.type == Type::Choice) return key.words.front() == key.default_value ? key.words[1] : key.words[0];
  if (key.type == Type::Rows) return "[[0, -5, -5], [90, 3, -10]]";
  for (const char* list : {"tracks", "uses", "exclude_signals"}) {
    if (key.path.ends_with(list)) return "L1CA";
  }
  if (key.type == Type::Texts && key.path.ends_with("satellites")) return "GPS";
  if (key.path.ends_with("vehicle_fractions")) return "car=7";
  if (key.path.ends_with("loop_bandwidths_hz") || key.path.ends_with("spacings_chips")) return "L1CA=0.7";
  if (key.type == Type::Text || key.type == Type::Texts) return "GPS=7";
  const options::Range range = key.range.value();
  const double value = key.default_value == "none" ? INFINITY : parse_double(key.default_value).value_or(NAN);
  // A value near the default, else any inside the range.
  const double step = key.type == Type::Integer ? 1 : std::abs(value) * 0.25;
  for (double other :
       {value - step, value + step, range.low / 2 + range.high / 2, range.high / 2, range.low + 4, 1.0}) {
    if (key.type == Type::Integer) other = std::floor(other);
    if (other != value && range.holds(other) && !std::isinf(other)) return fmt::format("{}", other);
  }
  return "?";
}

/// "a.b.c" and a value as YAML on one line.
inline std::string nested(const std::string& path, const std::string& value) {
  std::string open;
  std::string close;
  std::stringstream names(path);
  for (std::string name; std::getline(names, name, '.');) {
    if (!open.empty()) {
      open += "{";
      close += "}";
    }
    open += name + ": ";
  }
  return open + value + close;
}

}  // namespace canyon::test
