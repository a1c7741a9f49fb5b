#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/options/switch.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::options {

/// Rejects values out of range.
class Checker final : public Visitor {
 public:
  explicit Checker(std::string_view what) : what_(what) {}

 protected:
  void field(const Field& field, Value& value) override;
  [[nodiscard]] bool begin(std::string_view name) override;
  [[nodiscard]] std::optional<std::size_t> begin_list(std::string_view /*name*/, std::size_t count) override;
  void begin_item(std::size_t index) override;
  void end() override { path_.pop_back(); }

 private:
  std::string_view what_;
  std::vector<std::string> path_;
};

/// Writes every value: either one "path: value" per line, with numbers that read back exactly, or the text
/// that a Reader reads back. Texts of "section.key: value" lines need without_dots() before reading.
class Writer final : public Visitor {
 public:
  enum class Form { Lines, Yaml, Dotted };
  /// @param leave_out_defaults see Visitor::leaves_out_defaults()
  Writer(Form form, bool leave_out_defaults) : form_(form), leave_out_defaults_(leave_out_defaults) {}
  [[nodiscard]] std::string take() && { return std::move(text_); }
  [[nodiscard]] bool leaves_out_defaults() const override { return leave_out_defaults_; }

 protected:
  void field(const Field& field, Value& value) override;
  [[nodiscard]] bool begin(std::string_view name) override;
  [[nodiscard]] std::optional<std::size_t> begin_list(std::string_view name, std::size_t count) override;
  void begin_item(std::size_t index) override;
  void end() override { path_.pop_back(); }

 private:
  struct Level {
    std::string name;  // empty: an item of a list
    bool written = false;
  };
  void write_line(const std::string& line);

  Form form_;
  bool leave_out_defaults_;
  std::string text_;
  std::vector<Level> path_;
};

/// Throws InputError with the first field out of range, and its bound. `what` names the owner: "receiver
/// clock" gives "drift of the receiver clock is 3", "diffraction." gives "diffraction.max_paths is 0".
template <typename Options>
void check(Options options, std::string_view what = {}) {
  Checker checker(what);
  visit(checker, options);
}

/// Every field, one per line: the texts of two options are equal only if the options are equal.
template <typename Options>
[[nodiscard]] std::string exact_text(Options options) {
  Writer writer(Writer::Form::Lines, false);
  visit(writer, options);
  return std::move(writer).take();
}

/// A YAML text that reads back to equal options.
template <typename Options>
[[nodiscard]] std::string yaml(Options options) {
  Writer writer(Writer::Form::Yaml, true);
  visit(writer, options);
  return std::move(writer).take();
}

/// A line "section.key: value" for every field with a value, except in lists, whose items have no names.
template <typename Options>
[[nodiscard]] std::string dotted(Options options, bool leave_out_defaults = false) {
  Writer writer(Writer::Form::Dotted, leave_out_defaults);
  visit(writer, options);
  return std::move(writer).take();
}

/// Checks names that are used as folders, and as words in formats without quotes. Throws `v.fault(key)`
/// unless `name` has 1 to 60 letters, digits, '-', '_' and '.', and does not begin with a dot.
void check_folder_name(Visitor& v, std::string_view key, const std::string& name);

void visit_switch(Visitor& v, const Field& field, Switch& value);

}  // namespace canyon::options
