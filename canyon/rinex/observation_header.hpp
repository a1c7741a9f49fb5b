#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/rinex/observation_reader.hpp"

namespace canyon::rinex {

/// Header records of an observation file, applied one by one; continuation lines follow the line that they
/// continue. Used by RinexObservationReader for the header and for the records that events bring.
class HeaderRecords {
 public:
  /// Reads the first line. Empty where it is fine, else what is wrong and the cure.
  struct Fault {
    std::string problem, cure;
  };
  [[nodiscard]] std::optional<Fault> begin(std::string_view line);

  enum class Outcome { Applied, Unknown, Damaged, Fatal, End };
  struct Result {
    Outcome outcome = Outcome::Applied;
    std::string reason;  ///< of Damaged (the record is left out) and Fatal (no observation could be read)
  };
  [[nodiscard]] Result apply(std::string_view line);

  [[nodiscard]] const ObservationHeader& header() const { return header_; }
  [[nodiscard]] int major() const { return static_cast<int>(header_.version); }
  /// Values of this type stand in the file multiplied by this.
  [[nodiscard]] double factor(char system, const std::string& type) const;

 private:
  Result types2(std::string_view line);
  Result types3(std::string_view line);
  Result scale_factor(std::string_view line);
  Result glonass_slots(std::string_view line);
  Result glonass_biases(std::string_view line);
  Result time(std::string_view line, bool first);

  ObservationHeader header_;
  char types_system_ = 0;         ///< whose types continue
  std::size_t types_wanted_ = 0;  ///< in all
  std::map<char, std::map<std::string, double>> factors_;
  char factor_system_ = 0;
  double factor_ = 1;
  std::size_t factor_wanted_ = 0;  ///< types still to come
};

}  // namespace canyon::rinex
