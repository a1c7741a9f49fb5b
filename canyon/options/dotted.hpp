#pragma once

#include <string>

#include "canyon/options/node.hpp"
#include "canyon/options/visitor.hpp"

// Settings as lines "section.key: value", which stand alone: one line gives or changes one setting.

namespace canyon::options {

/// The tree with keys that have dots in them as sections: "clock.bias_s: 1" is "clock: {bias_s: 1}". What is
/// said of one section at several places is gathered in it. Throws InputError where a key is a section and a
/// value as well.
[[nodiscard]] Node without_dots(const Node& root, const Document& document);

/// Writes every field that has a value, one "section.key: value" a line, in the order of the list; a Reader
/// takes it back by way of without_dots().
class DottedWriter final : public Visitor {
 public:
  /// @param leave_out_defaults see Visitor::leaves_out_defaults()
  explicit DottedWriter(bool leave_out_defaults = false) : leave_out_defaults_(leave_out_defaults) {}
  [[nodiscard]] bool leaves_out_defaults() const override { return leave_out_defaults_; }
  [[nodiscard]] std::string take() && { return std::move(text_); }

 protected:
  void field(const Field& field, Value& value) override;
  [[nodiscard]] bool begin(std::string_view name) override;
  [[nodiscard]] std::optional<std::size_t> begin_list(std::string_view name, std::size_t count) override;
  void begin_item(std::size_t /*index*/) override {}
  void end() override;

 private:
  bool leave_out_defaults_;
  std::string path_;  // with a dot behind it
  std::string text_;
};

}  // namespace canyon::options
