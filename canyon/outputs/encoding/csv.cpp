#include <fmt/format.h>

#include "canyon/outputs/encoding/columns.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/number.hpp"

namespace canyon::encoding {
namespace {

/// A cell of any text (RFC 4180).
void append_quoted(std::string& line, std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    line += text;
    return;
  }
  line += '"';
  for (const char c : text) {
    if (c == '"') line += c;
    line += c;
  }
  line += '"';
}

/// One of encoding::tables(). A cell without a value is empty.
class Csv final : public Encoder {
 public:
  Csv(TableKind kind, const ReceiverDescription& receiver) : rows_(kind, receiver.signal) {
    for (const Column& column : table(kind).columns)
      if (column.csv) columns_.push_back(&column);
  }

  std::string begin() override {
    std::string line;
    for (const Column* column : columns_) line.append(column->name) += ',';
    line.back() = '\n';
    return line;
  }
  std::string encode(const simulation::Epoch& epoch) override {
    std::string lines;
    rows_.each(epoch, [&](const Row& row) {
      for (const Column* column : columns_) {
        append(lines, *column, row);
        lines += ',';
      }
      lines.back() = '\n';
    });
    return lines;
  }

 private:
  static void append(std::string& line, const Column& column, const Row& row) {
    switch (column.kind) {
      case Column::Kind::Number:
        return append_fixed(line, column.number(row), column.decimals);
      case Column::Kind::Integer: {
        const fmt::format_int digits(column.integer(row));
        line.append(digits.data(), digits.size());
        return;
      }
      case Column::Kind::Seconds:
        line += seconds_of_week(geodesy::GpsTime::from_nanoseconds(column.integer(row)));
        return;
      case Column::Kind::Word: {
        const std::int64_t index = column.integer(row);
        if (index >= 0) append_quoted(line, column.word(index));
        return;
      }
      case Column::Kind::Text:
        return append_quoted(line, column.text(row));
    }
  }

  std::vector<const Column*> columns_;
  TableRows rows_;
};

}  // namespace

std::unique_ptr<Encoder> encode_epochs_csv(const ReceiverDescription& receiver) {
  return std::make_unique<Csv>(TableKind::Epochs, receiver);
}

std::unique_ptr<Encoder> encode_satellites_csv(const ReceiverDescription& receiver) {
  return std::make_unique<Csv>(TableKind::Satellites, receiver);
}

std::unique_ptr<Encoder> encode_signals_csv(const ReceiverDescription& receiver) {
  return std::make_unique<Csv>(TableKind::Signals, receiver);
}

std::unique_ptr<Encoder> encode_paths_csv(const ReceiverDescription& receiver) {
  return std::make_unique<Csv>(TableKind::Paths, receiver);
}

}  // namespace canyon::encoding
