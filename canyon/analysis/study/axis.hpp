#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::study {

/// Random drives through a city: legs along streets between houses, on its terrain.
struct DriveOptions {
  std::uint32_t count = 0;  ///< 1 or more
  double length_m = 500;    ///< of each, at least
  double speed_mps = 8;     ///< unless forced to be lower
  double acceleration_mps2 = 2;
  double height_m = 1.5;  ///< above the terrain
};
void visit(options::Visitor& v, DriveOptions& o);

/// One parameter that a study varies.
struct Axis {
  enum class Kind : std::uint8_t { Values, Range, Times, Seeds, Drives, Unknowns };

  std::string name;  ///< of its coordinate; default: the key's last word
  std::string key;   ///< of the scenario; empty: each value is a mapping of keys
  Kind kind = Kind::Values;
  std::vector<std::string> values;     ///< in the form of flow_text()
  std::vector<std::string> labels;     ///< one for each value; empty: the values themselves
  std::vector<options::Node> trees;    ///< of `values`
  double from = 0, to = 0;             ///< Range
  std::optional<double> step;          ///< Range; Times [s]
  std::optional<std::uint32_t> count;  ///< Range, Times, Seeds, Unknowns
  geodesy::GpsTime first;              ///< Times
  double span_s = 0;                   ///< Times: first and all before first + span
  std::vector<std::string> known;      ///< Unknowns: names of those that are not sampled
  DriveOptions drives;
  bool realization = false;  ///< chooses a run's noise realization, not its settings
  bool crossed = false;      ///< in a sample: every value at every point
  int line = 0;

  static constexpr const char* kUnknowns = "unknowns";  ///< `key` of Unknowns

  /// Number of listed values; 0 if it is continuous.
  [[nodiscard]] std::size_t size() const;
  /// Whether values are numbers (of Kind::Times: seconds).
  [[nodiscard]] bool is_numeric() const;
};
void visit(options::Visitor& v, Axis& o);

/// The position of a run on an axis.
struct Level {
  std::size_t index = 0;  ///< of a listed value
  double u = 0;           ///< [0, 1): fraction of a continuous axis
};

/// A value of an axis: its settings, and its text.
struct AxisValue {
  options::Node tree;
  std::string text;   ///< unique: identifies noise realizations and stored runs
  std::string label;  ///< for people
};
[[nodiscard]] AxisValue value_at(const Axis& axis, const Level& level);

/// The dotted keys that a value sets, with their trees.
[[nodiscard]] std::vector<std::pair<std::string, const options::Node*>> settings_of(const Axis& axis,
                                                                                    const AxisValue& value);

/// Rejects axes that set keys of an earlier axis: only the last of them would count. Allowed: an axis of a
/// section before an axis of a key in it, if the section's values do not have that key.
/// @param base the scenario, for the names of items of its lists
/// @param file of the study, for messages
/// Throws InputError, with both axes and the key.
void check_keys(const std::vector<Axis>& axes, const options::Node& base, const std::filesystem::path& file);

}  // namespace canyon::study
