#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::disturbance {

/// A position, by latitude, longitude and ellipsoidal height, or by east, north and up of the city's origin.
struct PositionOptions {
  std::optional<double> latitude_deg, longitude_deg, height_m;
  std::optional<double> east_m, north_m, up_m;

  [[nodiscard]] bool given() const { return latitude_deg || east_m; }
  /// Position in the city's frame [m]. @param frame of the city
  [[nodiscard]] Eigen::Vector3d enu(const geodesy::LocalFrame& frame) const;
  /// Throws InputError if neither or both forms are given, or one of them is incomplete.
  void validate() const;
};
void visit(options::Visitor& v, PositionOptions& o);

/// Position or route of an object, written like a trajectory: one position, or straight legs at one speed.
struct CourseOptions {
  PositionOptions position;
  std::vector<PositionOptions> waypoints;  ///< instead of a position
  double speed_mps = 10;                   ///< between waypoints, (0, 1e4]

  [[nodiscard]] bool given() const { return position.given() || !waypoints.empty(); }
  void validate() const;
};
void visit(options::Visitor& v, CourseOptions& o);

/// Motion of an object in the city's frame. It begins at an instant, and ends at the end of its last leg.
class Course {
 public:
  /// @param options with given() true; @param frame of the city
  Course(const CourseOptions& options, const geodesy::LocalFrame& frame, geodesy::GpsTime begin);

  /// [m] in the city's frame.
  [[nodiscard]] Eigen::Vector3d at(geodesy::GpsTime time) const;

 private:
  std::vector<Eigen::Vector3d> points_;
  double speed_mps_;
  geodesy::GpsTime begin_;
};

// Faults and attacks: their kinds, and the parsing of one from text.
/// Satellites by name: "G05" for one, "GPS" for a system; none: all of them.
using SatelliteSet = std::vector<std::string>;

[[nodiscard]] bool holds(const SatelliteSet& set, gnss::SatelliteId id);
/// Throws InputError for a name that is neither a satellite's nor a system's.
void check_satellites(const SatelliteSet& set);
/// The field `satellites` of options; a reader checks the names.
void visit_satellites(options::Visitor& v, SatelliteSet& set);

/// Context of one fault on one receiver, in addition to the fault's own options.
struct FaultContext {
  std::string name;                       ///< of the fault
  geodesy::GpsTime begin;                 ///< first instant of the fault
  std::optional<geodesy::GpsTime> end;    ///< first instant after the fault; empty: none
  std::uint64_t seed = 1;                 ///< of the run
  std::string receiver;                   ///< random streams are RandomStream(seed, receiver + "/..." + name)
  std::shared_ptr<const orbit::Sky> sky;  ///< the true one
  std::shared_ptr<const city::City> city;
  std::shared_ptr<const raytrace::RayScene> rays;
};

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
  /// The fault's effect on one receiver from context.begin on.
  [[nodiscard]] virtual std::unique_ptr<Disturbance> make(const FaultContext& context) const = 0;
  /// Satellites that the fault affects; empty: all, or the kind has no satellites.
  [[nodiscard]] virtual SatelliteSet satellites() const = 0;
  /// The fault's own duration [s]; empty: active until it is ended.
  [[nodiscard]] virtual std::optional<double> duration_s() const = 0;
  /// Age of the fixes that the fault reports [s]: the receiver stores fixes for this time before its begin.
  [[nodiscard]] virtual double late_s() const = 0;
  /// The motion of its transmitter; null: the kind has no transmitter.
  [[nodiscard]] virtual const CourseOptions* course() const = 0;
};
void visit(options::Visitor& v, FaultSettings& settings);

/// One kind of fault. docs/faults.md has a section for each.
struct FaultKind {
  std::string_view name;     ///< its section in a fault: "outage"
  std::string_view summary;  ///< one line
  std::string_view example;  ///< an item of a scenario's `faults:`, YAML
  std::unique_ptr<FaultSettings> (*settings)();
};
/// All kinds. Scenarios, tables, `canyon faults list` and hosts get the kinds from this list.
[[nodiscard]] std::span<const FaultKind> fault_kinds();
/// Throws InputError for an unknown name; the message has the closest known one.
[[nodiscard]] const FaultKind& fault_kind_named(std::string_view name);
/// The keys of a fault's kind, without the section's name.
[[nodiscard]] options::Description description(const FaultKind& kind);

/// One fault of a timeline.
struct Fault {
  std::string name;                         ///< unique in its timeline
  double from_s = 0;                        ///< first instant, from the begin of the timeline [s], [0, 1e8]
  std::optional<double> until_s;            ///< end (exclusive); empty: the fault never ends
  std::vector<std::string> receivers;       ///< names of the affected receivers; empty: all
  const FaultKind* kind = nullptr;          ///< of fault_kinds()
  std::shared_ptr<FaultSettings> settings;  ///< of that kind; shared by copies, which do not modify it

  std::string file;  ///< file and line of its section; empty: in no file
  int line = 0;

  [[nodiscard]] bool concerns(std::string_view receiver) const;
  /// Throws InputError for satellites and systems that are not in the sky: they would have no effect.
  void check(const orbit::Sky& sky) const;
};
/// Visits its fields. A reader keeps the defaults of absent ones, sets the kind's end, and validates.
void visit(options::Visitor& v, Fault& fault);

/// `faults:` of a scenario or host. Names the faults without a name ("outage 2": the second of the list). A
/// reader rejects duplicate names, and receivers that are not in `receivers`.
void visit_faults(options::Visitor& v, std::vector<Fault>& faults, std::span<const std::string> receivers);

/// @param now_s begin if the fault has none @param number follows the kind in the name of an unnamed fault
/// Throws InputError with line and hint, as a scenario's reader does.
[[nodiscard]] Fault parse_fault(const std::string& text, const std::string& source, double now_s, int number);

}  // namespace canyon::disturbance
