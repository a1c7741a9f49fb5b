#pragma once

#include <complex>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"
#include "canyon/simulation/epoch.hpp"

// The columns of epochs, satellites, signals and paths, each declared once, in columns.cpp. This list defines
// the CSV files, the tables of Python and xarray, a study's stored epochs and their NetCDF, the viewer's
// tables, and the tables in docs/; docs/extending.md describes how to add one.

namespace canyon::encoding {

/// The data of a table's row. Members that the table does not use are null.
struct Row {
  const simulation::Epoch& epoch;
  const receiver::SatelliteObservation* satellite = nullptr;
  const receiver::SignalObservation* signal = nullptr;  ///< in a row of satellites: the first
  const propagation::Path* path = nullptr;
  std::int64_t number = 0;                   ///< index of the path among its satellite's paths, from 0
  std::complex<double> amplitude = {};       ///< of the path: first_signal_amplitude()
  std::optional<PhaseArcs::Link> link = {};  ///< of the signal's phase to the previous one
};

/// A unit in the notation of CF and UDUNITS: "m s-1" for "m/s", "1" for none.
[[nodiscard]] std::string cf_unit(std::string_view unit);

/// Type of a column's values in the viewer's chunks, little-endian.
enum class ViewType : std::uint8_t { F64, F32, I32, U32, U16, U8 };

struct Column {
  enum class Kind : std::uint8_t {
    Number,   ///< `number`; NaN: no value
    Integer,  ///< `integer`
    Seconds,  ///< `integer` [ns], written as seconds
    Word,     ///< `integer` indexes `word`; -1: no value
    Text      ///< `text`; empty: no value
  };

  const char* name = "";
  const char* unit = "";   ///< "m", "deg", "dB-Hz", "satellites"; empty: none
  const char* help = "";   ///< one line of Markdown
  const char* empty = "";  ///< meaning of an empty value: "no fix"
  Kind kind = Kind::Number;
  int decimals = 0;  ///< for a Number in CSV
  double (*number)(const Row& row) = nullptr;
  std::int64_t (*integer)(const Row& row) = nullptr;
  std::string (*text)(const Row& row) = nullptr;
  std::string_view (*word)(std::int64_t index) = nullptr;
  std::int64_t words = 0;  ///< indices run from 0 to words - 1

  const char* standard_name = "";     ///< of the CF conventions; empty: none applies
  bool csv = true;                    ///< the CSV file has it
  std::optional<ViewType> view = {};  ///< type in the viewer's table; empty: not in it
  const char* view_name = "";         ///< its name there
  int view_steps = 0;                 ///< steps per unit after rounding there; 0: not rounded
  const char* kept = "";              ///< its name among a study's stored epochs; empty: not stored

  constexpr Column cf(const char* its_standard_name) const {
    Column column = *this;
    column.standard_name = its_standard_name;
    return column;
  }
  [[nodiscard]] constexpr Column not_in_csv() const {
    Column column = *this;
    column.csv = false;
    return column;
  }
  constexpr Column in_view(ViewType type, const char* as = nullptr, int steps = 0) const {
    Column column = *this;
    column.view = type;
    column.view_name = as != nullptr ? as : name;
    column.view_steps = steps;
    return column;
  }
  constexpr Column in_studies(const char* as) const {
    Column column = *this;
    column.kept = as;
    return column;
  }

  /// The value of a Number, Integer or Word (its index) in units, of Seconds in seconds; NaN: no value, and
  /// of Text.
  [[nodiscard]] double value(const Row& row) const;
  /// encoding::cf_unit() of the unit; CF's own for latitude and longitude; empty for words and texts.
  [[nodiscard]] std::string cf_unit() const;
};

enum class TableKind : std::uint8_t { Epochs, Satellites, Signals, Paths };
struct Table {
  TableKind kind;
  std::string_view name;  ///< "epochs"
  std::span<const Column> columns;
};
/// All of them, in the order of TableKind.
[[nodiscard]] std::span<const Table> tables();
[[nodiscard]] inline const Table& table(TableKind kind) {
  return tables()[static_cast<std::size_t>(kind)];
}

/// Rows of a Markdown table of the CSV file's columns: column, unit, meaning, when empty.
[[nodiscard]] std::string markdown(const Table& table);

/// Makes one receiver's rows of a table, epoch after epoch in order of time.
class TableRows {
 public:
  using RowHandler = void (*)(void* to, const Row& row);

  /// @param signal of the receiver: strengths of paths are for its first tracked signal
  TableRows(TableKind kind, tracking::SignalOptions signal);

  /// Calls `take(row)` for each row of an epoch, in the order of the CSV file.
  template <typename TakeRow>
  void each(const simulation::Epoch& epoch, TakeRow&& take) {
    each(epoch, &take,
         [](void* to, const Row& row) { (*static_cast<std::remove_reference_t<TakeRow>*>(to))(row); });
  }

 private:
  void each(const simulation::Epoch& epoch, void* to, RowHandler take);

  TableKind kind_;
  tracking::SignalOptions signal_;
  PhaseArcs arcs_;
};

}  // namespace canyon::encoding
