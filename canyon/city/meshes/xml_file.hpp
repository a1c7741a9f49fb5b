#pragma once

#include <tinyxml2.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::meshes {

/// Whether an element of a text has more than 1,000 attributes: TinyXML-2 compares each with all before it.
[[nodiscard]] inline bool has_many_attributes(std::string_view text) {
  constexpr int kMax = 1000;
  constexpr std::pair<std::string_view, std::string_view> kNoElements[]{
      {"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}, {"<!", ">"}};
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at)) {
    const auto* const other =
        std::find_if(std::begin(kNoElements), std::end(kNoElements),
                     [&](const auto& kind) { return text.substr(at).starts_with(kind.first); });
    if (other != std::end(kNoElements)) {
      at = text.find(other->second, at);
      continue;
    }
    int attributes = 0;
    for (++at; at < text.size() && text[at] != '>'; ++at) {
      if (text[at] != '"' && text[at] != '\'') continue;
      if (++attributes > kMax) return true;
      at = std::min(text.find(text[at], at + 1), text.size() - 1);
    }
  }
  return false;
}

/// Reads an XML file that has a root element. Throws InputError if it cannot be read or is not XML.
inline void read_xml(const std::filesystem::path& path, tinyxml2::XMLDocument& document) {
  const TextFile file(path);
  if (has_many_attributes(file.text()))
    throw InputError(path, 0, "has an element of more than 1000 attributes");
  if (document.Parse(file.text().data(), file.text().size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    throw InputError(path, std::max(0, document.ErrorLineNum()),
                     std::string("is not well-formed XML (") + document.ErrorName() + ")",
                     "export it again, or check it with xmllint --noout");
  }
}

}  // namespace canyon::meshes
