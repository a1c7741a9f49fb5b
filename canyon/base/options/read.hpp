#pragma once

#include <deque>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::options {

/// Fills structs from a tree. Absent keys leave their fields unchanged, so several trees can be read over
/// each other. Throws InputError with file and line for unknown keys, repeated keys, and values of the wrong
/// type or out of range; finish() throws for keys that no field has read. A section with a key `enabled` may
/// be given as one word: "rtk: true" is "rtk: {enabled: true}".
class Reader final : public Visitor {
 public:
  /// Both must outlive the reader. Throws InputError if the tree is no mapping or a key has both names.
  Reader(const Node& root, const Document& document);

  [[nodiscard]] Purpose purpose() const override { return Purpose::Read; }
  void one_of(std::initializer_list<std::string_view> keys, std::string_view hint) override;
  void require(std::string_view key, std::string_view hint) override;
  [[nodiscard]] bool has(std::string_view key) const override;
  [[nodiscard]] bool is_section(std::string_view key) const override;
  [[nodiscard]] InputError fault(std::string_view key, std::string_view problem,
                                 std::string_view hint) const override;
  /// Throws InputError for a known key that has no effect with the other keys given.
  void finish() const;

 protected:
  void field(const Field& field, Value& value) override;
  [[nodiscard]] bool begin(std::string_view name) override;
  [[nodiscard]] std::optional<std::size_t> begin_list(std::string_view name, std::size_t count) override;
  void begin_item(std::size_t index) override;
  void end() override { sections_.pop_back(); }

 private:
  struct Section {
    const Node* node;
    std::string path;
    int line;
  };
  void enter(const Node& node, std::string path, int line);
  [[nodiscard]] const Section& here() const { return sections_.back(); }
  /// The entry, marked as read, or null.
  const Node::Entry* take(std::string_view key);
  [[nodiscard]] std::string path_of(std::string_view key) const;

  const Document& document_;
  Node renamed_;  // the tree with keys renamed, if the document has other names
  std::vector<Section> sections_;
  std::vector<Section> entered_;  // each once, in the order of reading
  std::set<const Node::Entry*> used_;
  std::deque<Node> switches_;  // sections given as one word
};

/// Reads a whole tree into one struct.
template <typename Options>
void read(const Node& root, const Document& document, Options& options) {
  Reader reader(root, document);
  visit(reader, options);
  reader.finish();
}

/// Reads a YAML text into a struct. @param document if it has no keys, those of description_of() are used
/// @param needs as for parse_yaml() @param change changes the parsed tree before it is read
template <typename Options>
void read_yaml(const std::string& text, Document document, std::string_view needs, Options& options,
               const std::function<void(Node&)>& change = {}) {
  if constexpr (std::is_default_constructible_v<Options>) {
    if (document.known.empty()) document.set_keys(description_of<Options>());
  }
  Node root = parse_yaml(text, document, needs);
  if (change) change(root);
  read(root, document, options);
}

}  // namespace canyon::options
