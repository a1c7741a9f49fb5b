#pragma once

#include <filesystem>
#include <optional>
#include <sdf/sdf.hh>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "adapters/common/resource_files.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"

namespace canyon::adapters {

/// The children of a plugin element as a tree of settings, read by a list of fields. InputErrors name plugin
/// and element as written in the file: "plugin 'gnss': <noise><enabled>: ...".
class PluginElements {
 public:
  /// `known`: every element by its dotted path ("noise.enabled"); those of several texts or files may be
  /// repeated. Unknown elements become warnings, with the hints of Description::replaced; so do attributes,
  /// except a plugin's name and file and those with a namespace. Throws InputError for an element that is
  /// repeated without permission, is empty, or has text instead of elements or vice versa.
  PluginElements(const sdf::ElementPtr& plugin, std::string plugin_name, const options::Description& known);

  [[nodiscard]] bool has(std::string_view path) const { return root_.find_path(path) != nullptr; }
  /// Whether an element of Description::replaced is present.
  [[nodiscard]] bool has_replaced(std::string_view path) const;
  /// Removes a child element of the plugin and returns its text.
  [[nodiscard]] std::optional<std::string> take(const std::string& name);
  /// Adds an element derived from another one, `tag`.
  void put(std::string_view path, const std::string& text, const std::string& tag);
  /// The same, unless the element is present, or a word instead of its section.
  void put_default(std::string_view path, const std::string& text, const std::string& tag);

  /// Has visit(Visitor&, Options&) read the elements. Files are searched in `folders`, then in `resources`.
  template <typename Options>
  void read(Options& options, const std::vector<std::filesystem::path>& folders,
            const ResourcePaths& resources) const {
    options::read(root_, document(folders, resources), options);
  }

  /// `tag`: "<noise><enabled>"
  [[nodiscard]] InputError error(const std::string& tag, std::string_view problem,
                                 std::string_view hint) const;
  /// Elements of unknown name, a line each, then replaced elements, one line for each hint.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void convert(const sdf::ElementPtr& parent, const std::string& path, const std::string& tags,
               options::Node& to);
  void warn_attributes(const sdf::ElementPtr& element, const std::string& tags);
  void warn_unknown(const std::string& name, const std::string& path, const std::string& tags);
  void warn_replaced();
  [[nodiscard]] options::Document document(const std::vector<std::filesystem::path>& folders,
                                           const ResourcePaths& resources) const;

  std::string plugin_name_;
  std::vector<options::Key> known_;
  options::Document document_;
  options::Node root_;
  std::vector<std::string> tags_;                              // by the "line" of a node, from 1
  std::vector<std::pair<std::string, std::string>> replaced_;  // paths and tags, in order
  std::vector<std::string> warnings_;
};

}  // namespace canyon::adapters
