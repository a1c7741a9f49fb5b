#pragma once

#include <string>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::simulation {

/// The tags of an XML text one after the other, each with the text after it. Names are without their prefix
/// ("gx:coord" is "coord"), "/name" at the end of an element. Comments and declarations are skipped; CDATA is
/// text. Nesting is not tracked, so deeply nested files do no harm.
class XmlTags {
 public:
  explicit XmlTags(const TextFile& file) : file_(file), text_(file.text()) {}

  /// Valid until the next call of next().
  std::string_view name, attributes, content;

  /// False at the end, and if a tag does not end (ends_early()).
  bool next();
  /// The value of an attribute of this tag; empty if it has none.
  [[nodiscard]] std::string_view attribute(std::string_view key) const;
  [[nodiscard]] InputError error(std::string_view problem, std::string_view hint = {}) const {
    return {file_.path(), line_, problem, hint};
  }
  [[nodiscard]] int line() const { return line_; }

 private:
  [[nodiscard]] std::string_view text_until(std::string_view end) const;
  bool skip(std::size_t open, std::string_view begin, std::string_view end);
  void count_lines(std::size_t to);

  const TextFile& file_;
  std::string_view text_;
  std::size_t at_ = 0, counted_ = 0;
  int line_ = 1;
  std::string end_;  ///< `name` at the end of an element with a prefix
};

/// Whether the root element of the text begins and does not end: the text was cut, perhaps within a number.
[[nodiscard]] bool ends_early(std::string_view text, std::string_view root);

}  // namespace canyon::simulation
