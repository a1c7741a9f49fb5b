#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/disturbance/course.hpp"
#include "canyon/disturbance/disturbance.hpp"
#include "canyon/disturbance/faults/fault_context.hpp"
#include "canyon/disturbance/faults/satellite_set.hpp"
#include "canyon/options/describe.hpp"
#include "canyon/options/visitor.hpp"

// Faults and attacks on purpose: what kinds there are, and one of them as a text says it.

namespace canyon::disturbance {

/// The options of one fault, whatever its kind.
class FaultSettings {
 public:
  virtual ~FaultSettings() = default;
  FaultSettings() = default;
  FaultSettings(const FaultSettings&) = delete;
  FaultSettings& operator=(const FaultSettings&) = delete;

  virtual void fields(options::Visitor& v) = 0;
  /// Throws InputError naming the field that is out of range.
  virtual void validate() const = 0;
  /// Its effect on one receiver from context.begin on.
  [[nodiscard]] virtual std::unique_ptr<Disturbance> make(const FaultContext& context) const = 0;
  /// Satellites that it affects; empty: all, or a kind without satellites.
  [[nodiscard]] virtual SatelliteSet satellites() const = 0;
  /// Its own duration [s]; empty: until it is ended.
  [[nodiscard]] virtual std::optional<double> duration_s() const = 0;
  /// The way of its transmitter; null: a kind without one.
  [[nodiscard]] virtual const CourseOptions* course() const = 0;
};
void visit(options::Visitor& v, FaultSettings& settings);

/// One way in which things go wrong. docs/faults.md has a section for each.
struct FaultKind {
  std::string_view name;     ///< its section in a fault: "outage"
  std::string_view summary;  ///< one line
  std::string_view example;  ///< an item of a scenario's `faults:`, YAML
  std::unique_ptr<FaultSettings> (*settings)();
};
/// All of them: scenarios, tables, `canyon faults list` and hosts know a kind by its entry here.
[[nodiscard]] std::span<const FaultKind> fault_kinds();
/// Throws InputError for an unknown name, with the closest known one.
[[nodiscard]] const FaultKind& fault_kind_named(std::string_view name);
/// The keys of a fault's kind, without the section's name.
[[nodiscard]] options::Description description(const FaultKind& kind);

/// One fault of a timeline.
struct Fault {
  std::string name;                         ///< of its own in a timeline
  double from_s = 0;                        ///< since the begin of the timeline, [0, 1e8]
  std::optional<double> until_s;            ///< behind its last instant; empty: none
  std::vector<std::string> receivers;       ///< names; empty: all
  const FaultKind* kind = nullptr;          ///< of fault_kinds()
  std::shared_ptr<FaultSettings> settings;  ///< of that kind; shared by copies, which leave it as it is

  std::string file;  ///< where its section stands; empty: in no file
  int line = 0;

  [[nodiscard]] bool concerns(std::string_view receiver) const;
  /// Throws InputError for satellites and systems that the sky has not: they would be without effect.
  void check(const orbit::Sky& sky) const;
};
/// Visits its fields. A reader leaves absent ones alone, sets the end of its kind, and checks the whole.
void visit(options::Visitor& v, Fault& fault);

/// `faults:` of a scenario or host: names those without a name ("outage 2": the second of the list). A reader
/// refuses names that stand twice, and receivers that are not among `receivers`.
void visit_faults(options::Visitor& v, std::vector<Fault>& faults, std::span<const std::string> receivers);

/// One fault as written while a receiver runs: an item of `faults:` in YAML or JSON.
/// @param now_s begin of a fault that names none @param number behind the kind where it has no name
/// Throws InputError with line and cure, as a scenario's reader does.
[[nodiscard]] Fault parse_fault(const std::string& text, const std::string& source, double now_s, int number);

}  // namespace canyon::disturbance
