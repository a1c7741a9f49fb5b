#pragma once

#include <string>
#include <vector>

#include "canyon/validation/headlines.hpp"

// The table of several recordings that `canyon validate LIST.yaml` prints.

namespace canyon::validation {

/// A recording, or all of a class together.
struct RecordingRow {
  std::string name;            ///< "tst", "all mass market"
  std::string receiver_class;  ///< may be empty
  std::vector<Headline> headlines;
  // A recording has:
  std::string report;         ///< address of its own report; empty: it has none
  std::string part;           ///< Figures::part
  std::string never_tracked;  ///< never_tracked_text()
  std::string figures_json;   ///< to_json() of its models, alone
  // A class has:
  std::vector<std::string> pooled;  ///< the names of what is pooled
};

/// The headlines of all rows, the first of each key, in their order.
[[nodiscard]] std::vector<Headline> headlines_of(const std::vector<RecordingRow>& rows);

/// One line of what a row is of: "tst (mass market): second half: ... 242 epochs; never tracked ...".
[[nodiscard]] std::string description_of(const RecordingRow& row);

/// A Markdown table: a line for each row and one for its intervals, and below what belongs to each recording.
[[nodiscard]] std::string to_markdown(const std::vector<RecordingRow>& rows);
/// An object: "recordings", an array of their to_json() with "name", "class" and "headlines", and "classes".
[[nodiscard]] std::string to_json(const std::vector<RecordingRow>& rows);

}  // namespace canyon::validation
