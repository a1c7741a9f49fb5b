// Declared in python/src/epochs.hpp.
#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/output/columns.hpp"
#include "python/src/arrays.hpp"
#include "python/src/epochs.hpp"
#include "python/src/settings.hpp"

// Tables of epochs as columns: all of output::tables(), with the instant as UTC in front.

namespace canyon::python {
namespace {

using output::Column;
using output::Row;

const output::Table& table_named(const std::string& name) {
  std::vector<std::string_view> known;
  for (const output::Table& table : output::tables()) {
    if (table.name == name) return table;
    known.push_back(table.name);
  }
  throw InputError(fmt::format("there is no table '{}'", name),
                   fmt::format("known are {}", fmt::join(known, ", ")));
}

/// Texts of few different values become a fixed-width array of UTF-32, as NumPy has it.
py::object texts(const std::vector<std::string>& all) {
  std::size_t width = 1;
  for (const std::string& text : all) width = std::max(width, text.size());
  py::array array(py::dtype(fmt::format("U{}", width)),
                  std::vector<py::ssize_t>{static_cast<py::ssize_t>(all.size())});
  auto* out = static_cast<char32_t*>(array.mutable_data());
  std::fill(out, out + all.size() * width, U'\0');
  for (std::size_t i = 0; i < all.size(); ++i) {
    // Fault names alone may have other letters than ASCII.
    const py::str decoded(all[i]);
    const py::ssize_t length = PyUnicode_GetLength(decoded.ptr());
    for (py::ssize_t k = 0; k < length; ++k) {
      out[i * width + static_cast<std::size_t>(k)] =
          static_cast<char32_t>(PyUnicode_ReadChar(decoded.ptr(), k));
    }
  }
  return array;
}

/// The values of one column, row by row.
class Values {
 public:
  explicit Values(const Column& column) : column_(column) {}

  void add(const Row& row) {
    switch (column_.kind) {
      case Column::Kind::Number:
      case Column::Kind::Seconds:
        return numbers_.push_back(column_.value(row));
      case Column::Kind::Integer:
        return integers_.push_back(column_.integer(row));
      case Column::Kind::Word: {
        const std::int64_t index = column_.integer(row);
        return void(texts_.emplace_back(index < 0 ? std::string_view() : column_.word(index)));
      }
      case Column::Kind::Text:
        return texts_.push_back(column_.text(row));
    }
  }
  [[nodiscard]] py::object array() && {
    switch (column_.kind) {
      case Column::Kind::Number:
      case Column::Kind::Seconds:
        return owning_array(std::move(numbers_));
      case Column::Kind::Integer:
        return owning_array(std::move(integers_));
      case Column::Kind::Word:
      case Column::Kind::Text:
        break;
    }
    return texts(texts_);
  }
  [[nodiscard]] const Column& column() const { return column_; }

 private:
  const Column& column_;
  std::vector<double> numbers_;
  std::vector<std::int64_t> integers_;
  std::vector<std::string> texts_;
};

}  // namespace

py::dict table_of(const std::vector<EpochPtr>& epochs, const std::string& name) {
  const output::Table& table = table_named(name);
  std::vector<std::int64_t> times;
  std::vector<Values> values;
  for (const Column& column : table.columns) values.emplace_back(column);
  output::TableRows rows(table.kind, epochs.empty() ? tracking::SignalOptions{} : *epochs.front()->signal);
  for (const EpochPtr& epoch : epochs) {
    rows.each(epoch->epoch, [&](const Row& row) {
      times.push_back(unix_ns(row.epoch.observed.time));
      for (Values& column : values) column.add(row);
    });
  }
  py::dict columns;
  columns["time"] = datetimes(std::move(times));
  for (Values& column : values) columns[column.column().name] = std::move(column).array();
  return columns;
}

/// Column name to (unit, CF standard name, meaning).
py::dict columns_of(const std::string& name) {
  py::dict about;
  about["time"] = py::make_tuple("", "time", "instant of reception, UTC");
  for (const Column& column : table_named(name).columns) {
    about[column.name] = py::make_tuple(column.cf_unit(), column.standard_name, column.help);
  }
  return about;
}

}  // namespace canyon::python
