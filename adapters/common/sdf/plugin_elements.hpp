#pragma once

#include <optional>
#include <sdf/sdf.hh>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/live_receiver.hpp"

namespace canyon::adapters {

/// The children of a plugin element by their dotted names ("noise.enabled" for <noise><enabled>), read one by
/// one. Getters take an element away and return nothing where it is absent; they throw InputError, which
/// names plugin and element as its author wrote them, for a value of the wrong type or out of range.
class PluginElements {
 public:
  struct Element {
    std::string path;                 ///< "noise.enabled"
    std::string tag;                  ///< "<noise><enabled>", or the other name by which it was given
    std::vector<std::string> values;  ///< trimmed; several only for elements that may be repeated
  };

  /// `known`: every dotted name. Others become warnings. Throws InputError for an element that stands twice
  /// and may not, is empty, or has text where elements belong or the other way round.
  PluginElements(const sdf::ElementPtr& plugin, std::string plugin_name,
                 const std::vector<std::string>& known);

  [[nodiscard]] bool has(std::string_view path) const;
  /// Adds an element under another name than the one it was given by. Throws InputError where it stands
  /// already, unless it has no value.
  void put(Element element);

  [[nodiscard]] std::optional<Element> take(std::string_view path);
  [[nodiscard]] std::optional<std::string> text(std::string_view path);
  /// Text without blanks inside: a topic or a frame.
  [[nodiscard]] std::optional<std::string> word(std::string_view path);
  /// One of `choices`.
  [[nodiscard]] std::optional<std::string> choice(std::string_view path,
                                                  const std::vector<std::string>& choices);
  /// 1, 0, true or false, in any case of letters.
  [[nodiscard]] std::optional<bool> boolean(std::string_view path);
  /// In [low, high].
  [[nodiscard]] std::optional<double> number(std::string_view path, double low, double high);
  [[nodiscard]] std::optional<int> integer(std::string_view path, int low, int high);

  /// What is left over, which must be keys of simulation::live_keys(), judged by the scenario's own reader.
  [[nodiscard]] simulation::LiveConfig take_live_config();

  [[nodiscard]] InputError error(const Element& element, std::string_view problem,
                                 std::string_view cure = {}) const;
  /// Elements of unknown name, a line each.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void read(const sdf::ElementPtr& parent, const std::string& path, const std::string& tags);
  void warn_unknown(const std::string& name, const std::string& path, const std::string& tags);
  [[nodiscard]] bool is_section(std::string_view path) const;
  [[nodiscard]] bool is_boolean(std::string_view path) const;
  [[nodiscard]] bool to_boolean(const Element& element) const;

  std::string plugin_name_;
  std::vector<std::string> known_;
  std::vector<Element> elements_;
  std::set<std::string> sections_;  // that stand in the plugin
  std::vector<std::string> warnings_;
};

/// "<noise><enabled>" of "noise.enabled".
[[nodiscard]] std::string tag_of(std::string_view path);

}  // namespace canyon::adapters
