#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/validation/ensemble.hpp"

namespace canyon::validation {

/// Finished draws of an ensemble in a file, so that an interrupted ensemble goes on where it ended. One line
/// of JSON for each: the first says which ensemble it is, each other is a draw of a recording. Numbers come
/// back as the same.
class KeptDraws {
 public:
  /// A key of all that an ensemble depends on: the rows' names, parts, unknowns and figures by the settings
  /// as they are, which change with the scenario, the recording and the program, and its count and seed.
  [[nodiscard]] static std::string identity(const std::vector<EnsembleRow>& rows, std::size_t count,
                                            std::uint64_t seed);

  /// Reads the draws that are there; a last line that was not written to its end is dropped. Makes the file
  /// where it is missing. Throws InputError, naming the line, where the file is of another ensemble or holds
  /// something else, and as OutputFile does.
  KeptDraws(std::filesystem::path file, const std::string& identity);

  /// How many there are.
  [[nodiscard]] std::size_t size() const { return draws_.size(); }
  /// A draw of a recording, with the headlines of `row.point` and their simulated values; null where it is
  /// not kept.
  [[nodiscard]] std::optional<EnsembleRow::Draw> find(const EnsembleRow& row, std::size_t draw) const;
  /// Appends one. Throws OutputError where the disk does not take it.
  void add(const std::string& recording, std::size_t draw, const EnsembleRow::Draw& made);

 private:
  struct Values {
    std::map<std::string, double> unknowns;
    std::map<std::string, std::optional<double>> figures;
  };
  void read(const std::string& first_line);

  std::filesystem::path path_;
  std::map<std::pair<std::string, std::size_t>, Values> draws_;
  std::ofstream appended_;
};

}  // namespace canyon::validation
