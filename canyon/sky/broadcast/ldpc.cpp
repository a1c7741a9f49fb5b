// Declared in canyon/sky/broadcast/symbols.hpp.
#include "canyon/sky/broadcast/symbols.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <mutex>
#include <string_view>

namespace canyon::broadcast {
namespace {

#include "canyon/sky/broadcast/ldpc_tables.inc"

struct Table {
  int symbol_bits;
  std::string_view terms;
};
/// Codes in the order of LdpcCode.
constexpr std::array<Table, 6> kTables{{{1, kCnav2Subframe2},
                                        {1, kCnav2Subframe3},
                                        {6, kBcnav1Subframe2},
                                        {6, kBcnav1Subframe3},
                                        {6, kBcnav2},
                                        {6, kBcnav3}}};

/// Products in GF(64). Those of 0 and 1 are GF(2)'s.
using Products = std::array<std::array<std::uint8_t, 64>, 64>;
constexpr Products kProducts = [] {
  Products products{};
  for (unsigned a = 0; a < 64; ++a) {
    for (unsigned b = 0; b < 64; ++b) {
      unsigned product = 0;
      for (unsigned bit = 6; bit-- > 0;) {
        product <<= 1U;
        if ((product & 64U) != 0) product ^= 0b1000011U;
        if ((b >> bit & 1U) != 0) product ^= a;
      }
      products[a][b] = static_cast<std::uint8_t>(product);
    }
  }
  return products;
}();

using Row = std::vector<std::uint8_t>;

/// B^-1 A of H = (A | B), which turns information into parity.
std::vector<Row> generator(LdpcCode code) {
  const std::vector<std::vector<LdpcTerm>> checks = parity_checks(code);
  const std::size_t n = checks.size();
  std::vector<Row> rows(n, Row(2 * n));  // (B | A), until B is the unit matrix
  for (std::size_t i = 0; i < n; ++i) {
    for (const LdpcTerm& term : checks[i]) rows[i][(term.symbol + n) % (2 * n)] = term.factor;
  }
  for (std::size_t column = 0; column < n; ++column) {
    const auto pivot = std::find_if(rows.begin() + static_cast<std::ptrdiff_t>(column), rows.end(),
                                    [&](const Row& row) { return row[column] != 0; });
    assert(pivot != rows.end());
    std::swap(rows[column], *pivot);
    const auto& by_pivot = kProducts[rows[column][column]];
    const auto inverse =
        static_cast<std::size_t>(std::find(by_pivot.begin(), by_pivot.end(), 1) - by_pivot.begin());
    for (std::uint8_t& element : rows[column]) element = kProducts[inverse][element];
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint8_t factor = rows[i][column];
      if (i == column || factor == 0) continue;
      for (std::size_t j = column; j < 2 * n; ++j) rows[i][j] ^= kProducts[factor][rows[column][j]];
    }
  }
  for (Row& row : rows) row.erase(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(n));
  return rows;
}

}  // namespace

std::vector<std::vector<LdpcTerm>> parity_checks(LdpcCode code) {
  const Table& table = kTables.at(static_cast<std::size_t>(code));
  const bool binary = table.symbol_bits == 1;
  const auto number = [&](std::size_t first, std::size_t digits) {
    std::size_t value = 0;
    for (const char c : table.terms.substr(first, digits)) {
      value = 16 * value + static_cast<std::size_t>(c <= '9' ? c - '0' : c - 'A' + 10);
    }
    return value;
  };
  std::vector<std::vector<LdpcTerm>> checks;
  for (std::size_t i = 0; i < table.terms.size(); i += binary ? 3 : 5) {
    const std::size_t symbol = number(i, 3);
    if (checks.empty() || symbol <= checks.back().back().symbol) checks.emplace_back();
    checks.back().push_back({symbol, binary ? std::uint8_t{1} : static_cast<std::uint8_t>(number(i + 3, 2))});
  }
  return checks;
}

Bits ldpc_encoded(LdpcCode code, const Bits& information) {
  struct Made {
    std::once_flag once;
    std::vector<Row> generator;
  };
  static std::array<Made, kTables.size()> made;
  const auto index = static_cast<std::size_t>(code);
  std::call_once(made.at(index).once, [&] { made[index].generator = generator(code); });
  const auto width = static_cast<std::size_t>(kTables[index].symbol_bits);
  assert(information.size() == made[index].generator.size() * width);
  Bits word = information;
  for (const Row& row : made[index].generator) {
    std::uint8_t parity = 0;
    for (std::size_t i = 0; i < row.size(); ++i) {
      parity ^= kProducts[row[i]][information.number(width * i, width)];
    }
    word.put(parity, kTables[index].symbol_bits);
  }
  return word;
}

}  // namespace canyon::broadcast
