#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "canyon/options/visitor.hpp"

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
/// text that a Reader takes back.
class Writer final : public Visitor {
 public:
  enum class Form { Lines, Yaml };
  explicit Writer(Form form) : form_(form) {}
  [[nodiscard]] std::string take() && { return std::move(text_); }
  [[nodiscard]] bool leaves_out_defaults() const override { return form_ == Form::Yaml; }

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
  std::string text_;
  std::vector<Level> path_;
};

/// Throws InputError naming the first field that is out of range, and its bound. `what` says whose: "receiver
/// clock" makes "drift of the receiver clock is 3", "diffraction." makes "diffraction.max_paths is 0".
template <typename Options>
void check(const Options& options, std::string_view what = {}) {
  Checker checker(what);
  visit(checker, const_cast<Options&>(options));  // it does not change anything
}

/// Every field, one a line: equal for equal options, and for no others.
template <typename Options>
[[nodiscard]] std::string exact_text(const Options& options) {
  Writer writer(Writer::Form::Lines);
  visit(writer, const_cast<Options&>(options));
  return std::move(writer).take();
}

/// A YAML text that reads back the same.
template <typename Options>
[[nodiscard]] std::string yaml(const Options& options) {
  Writer writer(Writer::Form::Yaml);
  visit(writer, const_cast<Options&>(options));
  return std::move(writer).take();
}

}  // namespace canyon::options
