#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <type_traits>
#include <variant>

#include "canyon/outputs/encoding/columns.hpp"

namespace canyon::test {

/// A value in a message: a number (of a Word its index, of a flag 1 or 0), or a text.
using ReportedValue = std::variant<double, std::string>;

/// The location of a value in a message, by column.
template <typename Message>
using Carried = std::map<std::string, ReportedValue (*)(const Message&)>;

/// Every column of a table is either carried, and then the message has the value of a row, or is listed as
/// missing in the message. @param relative maximum relative difference of numbers @param number of the row
template <typename Message>
void expect_carried(encoding::TableKind kind, const simulation::Epoch& epoch, const Message& message,
                    const Carried<Message>& carried, const std::set<std::string>& lacks,
                    double relative = 1e-12, std::size_t number = 0) {
  std::set<std::string> known;
  std::size_t rows = 0;
  encoding::TableRows(kind, {}).each(epoch, [&](const encoding::Row& row) {
    if (rows++ != number) return;
    for (const encoding::Column& column : encoding::table(kind).columns) {
      known.insert(column.name);
      const auto reported = carried.find(column.name);
      EXPECT_NE(reported != carried.end(), lacks.count(column.name) > 0)
          << column.name << ": put it into the message, or among those that it lacks";
      if (reported == carried.end()) continue;
      const ReportedValue value = reported->second(message);
      if (column.kind == encoding::Column::Kind::Text) {
        EXPECT_EQ(std::get<std::string>(value), column.text(row)) << column.name;
        continue;
      }
      const double expected = column.value(row);
      EXPECT_NEAR(std::get<double>(value), expected, relative * std::abs(expected)) << column.name;
    }
  });
  EXPECT_GT(rows, number) << "the epoch has no such row";
  for (const auto& [column, value] : carried) EXPECT_EQ(known.count(column), 1U) << "no column " << column;
  for (const std::string& column : lacks) EXPECT_EQ(known.count(column), 1U) << "no column " << column;
}

}  // namespace canyon::test
