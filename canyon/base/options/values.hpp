#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/options/visitor.hpp"

namespace canyon::options {

/// Refuses values out of range.
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

/// Writes every value, one "path: value" a line, numbers so that they read back the same to the bit, or the
/// text that a Reader takes back, by way of without_dots() if it is of "section.key: value" lines.
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

/// Throws InputError naming the first field that is out of range, and its bound. `what` says whose: "receiver
/// clock" makes "drift of the receiver clock is 3", "diffraction." makes "diffraction.max_paths is 0".
template <typename Options>
void check(Options options, std::string_view what = {}) {
  Checker checker(what);
  visit(checker, options);
}

/// Every field, one a line: equal for equal options, and for no others.
template <typename Options>
[[nodiscard]] std::string exact_text(Options options) {
  Writer writer(Writer::Form::Lines, false);
  visit(writer, options);
  return std::move(writer).take();
}

/// A YAML text that reads back the same.
template <typename Options>
[[nodiscard]] std::string yaml(Options options) {
  Writer writer(Writer::Form::Yaml, true);
  visit(writer, options);
  return std::move(writer).take();
}

/// A line "section.key: value" for every field that has a value, but those of lists, whose items have no
/// names.
template <typename Options>
[[nodiscard]] std::string dotted(Options options, bool leave_out_defaults = false) {
  Writer writer(Writer::Form::Dotted, leave_out_defaults);
  visit(writer, options);
  return std::move(writer).take();
}

/// Checks names that become folders, and words in formats without quotes. Throws `v.fault(key)` unless `name`
/// is 1 to 60 letters, digits, '-', '_' and '.', a dot not first.
void check_folder_name(Visitor& v, std::string_view key, const std::string& name);

/// A switch, on or off. Where nobody sets it, the default may depend on other options.
class Switch {
 public:
  /// A default.
  constexpr Switch(bool value) : value_(value) {}     // NOLINT(google-explicit-constructor): it is a bool
  constexpr operator bool() const { return value_; }  // NOLINT(google-explicit-constructor)
  constexpr Switch& operator=(bool value) {
    value_ = value;
    set_ = true;
    return *this;
  }
  /// Sets the value that holds where nobody sets it.
  constexpr void set_default(bool value) {
    if (!set_) value_ = value;
  }
  [[nodiscard]] constexpr bool is_set() const { return set_; }

 private:
  bool value_;
  bool set_ = false;
};

inline void visit_switch(Visitor& v, const Field& field, Switch& value) {
  if (v.leaves_out_defaults() && !value.is_set()) return;
  bool on = value;
  v.boolean(field, on);
  if (v.reads() && v.has(field.name)) value = on;
}

}  // namespace canyon::options
