#include "canyon/base/table_text.hpp"

#include <algorithm>

#include "canyon/base/text.hpp"
#include "canyon/base/utf8.hpp"

namespace canyon {
namespace {

std::string markdown_line(const TextRow& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) {
    if (!cell.empty()) line += ' ';
    for (const char c : cell) line += c == '|' ? std::string("\\|") : std::string(1, c);
    line += " |";
  }
  return line + '\n';
}

bool is_number(const std::string& cell) {
  return cell.empty() || cell == "-" || parse_double(cell);
}

}  // namespace

std::string text_table(const TextRow& head, const std::vector<TextRow>& rows, const TextTableStyle& style) {
  struct Column {
    std::size_t width;
    bool left;
  };
  std::vector<Column> columns;
  std::size_t whole = 0;
  for (std::size_t c = 0; c < head.size(); ++c) {
    Column& column = columns.emplace_back(Column{display_width(head[c]), style.words && c < *style.words});
    for (const TextRow& row : rows) {
      if (c >= row.size()) continue;
      column.width = std::max(column.width, display_width(row[c]));
      if (!style.words && !is_number(row[c])) column.left = true;
    }
    whole += column.width + (c > 0 ? 2 : 0);
  }
  std::string text;
  const auto add = [&](const TextRow& row) {
    text += style.indent;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string blanks(columns[c].width - display_width(row[c]), ' ');
      text += (c > 0 ? "  " : "") + (columns[c].left ? row[c] + blanks : blanks + row[c]);
    }
    text.resize(text.find_last_not_of(' ') + 1);
    text += '\n';
  };
  add(head);
  if (style.rule) text += style.indent + std::string(whole, '-') + '\n';
  for (const TextRow& row : rows) add(row);
  return text;
}

std::string markdown_table(const TextRow& head, const std::vector<TextRow>& rows) {
  std::string text = markdown_line(head) + '|';
  for (std::size_t c = 0; c < head.size(); ++c) text += "---|";
  text += '\n';
  for (const TextRow& row : rows) text += markdown_line(row);
  return text;
}

}  // namespace canyon
