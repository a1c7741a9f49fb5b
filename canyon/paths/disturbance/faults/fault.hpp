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
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::disturbance {

/// A place, by latitude, longitude and ellipsoidal height, or by east, north and up of the city's origin.
struct PlaceOptions {
  std::optional<double> latitude_deg, longitude_deg, height_m;
  std::optional<double> east_m, north_m, up_m;

  [[nodiscard]] bool given() const { return latitude_deg || east_m; }
  /// Position in the city's frame [m]. @param frame of the city
  [[nodiscard]] Eigen::Vector3d enu(const geodesy::LocalFrame& frame) const;
  /// Throws InputError where it is neither or both, or half of one.
  void validate() const;
};
void visit(options::Visitor& v, PlaceOptions& o);

/// Place or drive of an object, as trajectories are written: one place, or straight legs at one speed.
struct CourseOptions {
  PlaceOptions position;
  std::vector<PlaceOptions> waypoints;  ///< instead of a position
  double speed_mps = 10;                ///< between waypoints, (0, 1e4]

  [[nodiscard]] bool given() const { return position.given() || !waypoints.empty(); }
  void validate() const;
};
void visit(options::Visitor& v, CourseOptions& o);

/// A course in the city's frame. It begins at an instant, and ends where its last leg does.
class Course {
 public:
  /// @param options that are given(); @param frame of the city
  Course(const CourseOptions& options, const geodesy::LocalFrame& frame, geodesy::GpsTime begin);

  /// [m] in the city's frame.
  [[nodiscard]] Eigen::Vector3d at(geodesy::GpsTime time) const;

 private:
  std::vector<Eigen::Vector3d> points_;
  double speed_mps_;
  geodesy::GpsTime begin_;
};

// Faults and attacks on purpose: what kinds there are, and one of them as a text says it.
/// Satellites by name: "G05" for one, "GPS" for a system; none: all of them.
using SatelliteSet = std::vector<std::string>;

[[nodiscard]] bool holds(const SatelliteSet& set, gnss::SatelliteId id);
/// Throws InputError for a name that is neither a satellite's nor a system's.
void check_satellites(const SatelliteSet& set);
/// The field `satellites` of options; a reader checks the names.
void visit_satellites(options::Visitor& v, SatelliteSet& set);

/// Input of the effect of one fault on one receiver, beside the fault's own options.
struct FaultContext {
  std::string name;                       ///< of the fault
  geodesy::GpsTime begin;                 ///< its first instant
  std::optional<geodesy::GpsTime> end;    ///< behind its last one; empty: none
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
  /// Its effect on one receiver from context.begin on.
  [[nodiscard]] virtual std::unique_ptr<Disturbance> make(const FaultContext& context) const = 0;
  /// Satellites that it affects; empty: all, or a kind without satellites.
  [[nodiscard]] virtual SatelliteSet satellites() const = 0;
  /// Its own duration [s]; empty: until it is ended.
  [[nodiscard]] virtual std::optional<double> duration_s() const = 0;
  /// Age of the fixes that it reports [s]: they are kept for so long before its begin.
  [[nodiscard]] virtual double late_s() const = 0;
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
  std::string name;                         ///< unique in its timeline
  double from_s = 0;                        ///< first instant, from the begin of the timeline [s], [0, 1e8]
  std::optional<double> until_s;            ///< end, which is not part of it; empty: the fault never ends
  std::vector<std::string> receivers;       ///< names of those that it acts on; empty: all
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
