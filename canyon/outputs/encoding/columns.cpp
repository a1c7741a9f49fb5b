#include "canyon/outputs/encoding/columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::encoding {
namespace {

using geodesy::degrees;
using positioning::Dop;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr ViewType F64 = ViewType::F64, F32 = ViewType::F32, U16 = ViewType::U16, U8 = ViewType::U8;

// --- declaration of a column: name, unit, decimals, meaning, when it is empty, value

using Number = double (*)(const Row&);
using Integer = std::int64_t (*)(const Row&);
using Text = std::string (*)(const Row&);

constexpr Column make(const char* name, const char* unit, const char* help, const char* empty,
                      Column::Kind kind) {
  Column column;
  column.name = name;
  column.unit = unit;
  column.help = help;
  column.empty = empty;
  column.kind = kind;
  return column;
}
constexpr Column number(const char* name, const char* unit, int decimals, const char* help, const char* empty,
                        Number value) {
  Column column = make(name, unit, help, empty, Column::Kind::Number);
  column.decimals = decimals;
  column.number = value;
  return column;
}
constexpr Column integer(const char* name, const char* unit, const char* help, Integer value,
                         Column::Kind kind = Column::Kind::Integer) {
  Column column = make(name, unit, help, "never", kind);
  column.integer = value;
  return column;
}
constexpr Column text(const char* name, const char* help, const char* empty, Text value) {
  Column column = make(name, "", help, empty, Column::Kind::Text);
  column.text = value;
  return column;
}
std::string_view name(raytrace::Containment containment) {
  return containment_word(containment);
}
/// @param last of the words @param value a function without captures: a row's word; empty: none
template <typename Enum, typename Value>
constexpr Column word(const char* its_name, const char* help, const char* empty, Enum last, Value) {
  Column column = make(its_name, "", help, empty, Column::Kind::Word);
  column.integer = [](const Row& row) -> std::int64_t {
    const std::optional<Enum> found = Value()(row);
    return found ? static_cast<std::int64_t>(*found) : -1;
  };
  column.word = [](std::int64_t i) { return std::string_view(name(static_cast<Enum>(i))); };
  column.words = static_cast<std::int64_t>(last) + 1;
  return column;
}

// --- values used by several columns

const positioning::Fix& fix_of(const Row& row) {
  return row.epoch.observed.fix;
}
double baseline(const Row& row, Eigen::Index axis) {
  const auto& fix_baseline = fix_of(row).baseline;
  return fix_baseline ? fix_baseline->vector_enu(axis) : kNone;
}
double solved(const Row& row, double value) {
  return fix_of(row).solved() ? value : kNone;
}
template <double Dop::*value>
double dop(const Row& row) {
  const positioning::Fix& fix = fix_of(row);
  return fix.solved() && fix.dop ? (*fix.dop).*value : kNone;
}
template <int axis>
double error(const Row& row) {
  return solved(row, row.epoch.error_enu_m[axis]);
}
template <int axis>
double true_velocity(const Row& row) {
  return row.epoch.truth.velocity_enu_mps[axis];
}
template <int axis>
double fix_velocity(const Row& row) {
  const auto& velocity = fix_of(row).velocity_enu_mps;
  return velocity ? solved(row, (*velocity)[axis]) : kNone;
}
template <int axis>
double sigma(const Row& row) {
  return solved(row, std::sqrt(fix_of(row).covariance_enu(axis, axis)));
}
template <int i, int j>
double covariance(const Row& row) {
  return solved(row, fix_of(row).covariance_enu(i, j));
}
template <int i, int j>
double velocity_covariance(const Row& row) {
  const auto& covariance = fix_of(row).velocity_covariance_enu;
  return covariance ? solved(row, (*covariance)(i, j)) : kNone;
}
template <gnss::System system>
double clock(const Row& row) {
  const auto& biases = fix_of(row).clock_bias_s;
  const auto bias = biases.find(system);
  return bias != biases.end() ? solved(row, bias->second) : kNone;
}
const gnss::Signal& signal_of(const Row& row) {
  return row.signal->signal != nullptr ? *row.signal->signal
                                       : gnss::signals_of(row.satellite->id.system).front();
}
template <double receiver::SignalObservation::*value>
double if_measured(const Row& row) {
  return row.signal->measurement ? row.signal->*value : kNone;
}
template <std::size_t term>
double range_term(const Row& row) {
  return row.signal->measurement ? row.signal->terms_m[term] : kNone;
}
template <double positioning::Measurement::*value>
double measured(const Row& row) {
  return row.signal->measurement ? (*row.signal->measurement).*value : kNone;
}
template <std::optional<double> positioning::Measurement::*value>
double measured_if_any(const Row& row) {
  return row.signal->measurement ? ((*row.signal->measurement).*value).value_or(kNone) : kNone;
}
template <int axis>
double point(const Row& row) {
  return row.path->kind == propagation::PathKind::Direct ? kNone : row.path->point[axis];
}
template <int axis>
double far_point(const Row& row) {
  return row.path->order < 2 ? kNone : row.path->far_point[axis];
}
/// @param index 0: next to the satellite
std::string material(const Row& row, int index) {
  return std::string(city::material_name(row.path->incidences[static_cast<std::size_t>(index)].material));
}

// --- columns of several tables

constexpr Column kWeek = integer("gps_week", "week", "full GPS week, not modulo 1024",
                                 [](const Row& r) -> std::int64_t { return r.epoch.observed.time.week(); });
constexpr Column kTow = integer(
    "gps_tow", "s", "second of the week, exact, 3 to 9 decimals",
    [](const Row& r) -> std::int64_t { return r.epoch.observed.time.nanosecond_of_week(); },
    Column::Kind::Seconds);
constexpr Column kSatellite = text("sat", "RINEX name: `G05`, `R12`, `E11`, `C30`, `J02`, `S23`", "never",
                                   [](const Row& r) { return gnss::to_string(r.satellite->id); });
constexpr Column kPseudorange =
    number("pseudorange_m", "m", 4,
           "c (receiver clock reading minus satellite clock reading): clock biases and the signal's group "
           "delay are in it",
           "nothing measured", &measured<&positioning::Measurement::pseudorange_m>);
constexpr Column kPseudorangeError = number(
    "pseudorange_error_m", "m", 4, "excess path, noise and the residual atmospheric delay after correction",
    "nothing measured", &if_measured<&receiver::SignalObservation::pseudorange_error_m>);
constexpr Column kNoise =
    number("noise_m", "m", 4, "noise process and, with the signal model, the code loop's noise",
           "nothing measured", &if_measured<&receiver::SignalObservation::noise_m>);
constexpr Column kSigma = number("sigma_m", "m", 4, "standard deviation used to weight it in the fix",
                                 "nothing measured", &measured<&positioning::Measurement::sigma_m>);
constexpr Column kDoppler =
    number("doppler_hz", "Hz", 4, "Doppler of the carrier, positive when approaching", "nothing measured",
           &measured_if_any<&positioning::Measurement::doppler_hz>);
constexpr Column kCarrier = number(
    "carrier_frequency_hz", "Hz", 0, "carrier frequency of the signal; GLONASS: of the satellite's channel",
    "nothing measured", &measured<&positioning::Measurement::carrier_frequency_hz>);
constexpr Column kCn0 =
    number("cn0_dbhz", "dB-Hz", 2, "C/N0 reported by the receiver", "nothing measured, or no signal model",
           &measured_if_any<&positioning::Measurement::cn0_dbhz>);
constexpr Column kTrueCn0 = number("true_cn0_dbhz", "dB-Hz", 2, "C/N0 at the correlator, tracked or not",
                                   "nothing arrives, or no signal model",
                                   [](const Row& r) { return r.signal->cn0_dbhz.value_or(kNone); });
constexpr Column kLock =
    word("lock",
         "`tracking`; `holding`: temporarily too weak to measure; `searching`. Without a signal model all "
         "received "
         "signals are tracked",
         "never", tracking::LockState::Holding, [](const Row& r) { return r.signal->lock; });
constexpr Column kPhase = number(
    "carrier_phase_cycles", "cycles", 4, "carrier phase since lock; increases with the pseudorange",
    "no phase", [](const Row& r) { return r.link ? *r.signal->measurement->carrier_phase_cycles : kNone; });
constexpr Column kPhaseLock = number(
    "phase_lock_s", "s", 3, "time for which the phase has been continuous", "no phase", [](const Row& r) {
      return r.link ? r.epoch.observed.time - *r.signal->measurement->phase_since : kNone;
    });
constexpr Column kCycleSlip = number(
    "cycle_slip", "", 0,
    "`1` not continuous with the signal's previous phase in the file, `0` continuous, or the first one",
    "no phase", [](const Row& r) { return r.link ? (r.link->slip ? 1.0 : 0.0) : kNone; });

// --- the tables. The order is that of the CSV files: a new column is appended.

constexpr std::array kEpochColumns{
    kWeek,
    kTow,
    number("true_latitude_deg", "deg", 10, "geodetic latitude of the antenna", "never",
           [](const Row& r) { return degrees(r.epoch.truth.position.latitude_rad); })
        .cf("latitude"),
    number("true_longitude_deg", "deg", 10, "longitude of the antenna, east positive", "never",
           [](const Row& r) { return degrees(r.epoch.truth.position.longitude_rad); })
        .cf("longitude"),
    number("true_height_m", "m", 4, "height of the antenna above the ellipsoid", "never",
           [](const Row& r) { return r.epoch.truth.position.height_m; })
        .cf("height_above_reference_ellipsoid"),
    text("status", "`fix` or `no fix`", "never",
         [](const Row& r) { return std::string(status_word(fix_of(r))); }),
    number("fix_latitude_deg", "deg", 10, "latitude of the fix", "no fix",
           [](const Row& r) { return solved(r, degrees(fix_of(r).position.latitude_rad)); })
        .cf("latitude"),
    number("fix_longitude_deg", "deg", 10, "longitude of the fix", "no fix",
           [](const Row& r) { return solved(r, degrees(fix_of(r).position.longitude_rad)); })
        .cf("longitude"),
    number("fix_height_m", "m", 4, "height of the fix above the ellipsoid", "no fix",
           [](const Row& r) { return solved(r, fix_of(r).position.height_m); })
        .cf("height_above_reference_ellipsoid"),
    number("error_east_m", "m", 4, "fix minus truth, east", "no fix", &error<0>)
        .in_view(F64)
        .in_studies("error_east"),
    number("error_north_m", "m", 4, "fix minus truth, north", "no fix", &error<1>)
        .in_view(F64)
        .in_studies("error_north"),
    number("error_up_m", "m", 4, "fix minus truth, up", "no fix", &error<2>)
        .in_view(F64)
        .in_studies("error_up"),
    number("gdop", "", 4, "geometric dilution of precision", "no fix", &dop<&Dop::gdop>).in_view(F64),
    number("pdop", "", 4, "dilution of precision of the position", "no fix", &dop<&Dop::pdop>).in_view(F64),
    number("hdop", "", 4, "horizontal dilution of precision, local east-north-up", "no fix", &dop<&Dop::hdop>)
        .in_view(F64)
        .in_studies("hdop_of_epoch"),
    number("vdop", "", 4, "vertical dilution of precision", "no fix", &dop<&Dop::vdop>).in_view(F64),
    number("tdop", "", 4, "dilution of precision of time, over all constellation clocks", "no fix",
           &dop<&Dop::tdop>)
        .in_view(F64),
    word("rating",
         "rating of `pdop`: `Ideal` (below 1), `Excellent` (to 2), `Good` (to 5), `Moderate` (to 10), `Fair` "
         "(to 20), `Poor`",
         "no fix", positioning::DopRating::Poor,
         [](const Row& r) {
           const positioning::Fix& fix = fix_of(r);
           return fix.solved() && fix.dop ? std::optional(positioning::rate_dop(fix.dop->pdop))
                                          : std::nullopt;
         }),
    integer("tracked", "satellites", "satellites tracked, above the elevation mask",
            [](const Row& r) -> std::int64_t { return r.epoch.observed.visible; })
        .in_view(U16)
        .in_studies("tracked_of_epoch"),
    integer("not_tracked", "satellites",
            "satellites above the mask that are not tracked: no signal, or too weak",
            [](const Row& r) -> std::int64_t { return r.epoch.observed.blocked; })
        .in_view(U16),
    integer("used", "satellites", "satellites in the fix; 0 without a fix",
            [](const Row& r) { return static_cast<std::int64_t>(used_count(fix_of(r))); })
        .in_view(U16)
        .in_studies("used_of_epoch"),
    text("reason", "reason why there is no fix, such as `too few satellites`", "fix",
         [](const Row& r) {
           return fix_of(r).solved() ? std::string()
                                     : std::string(no_fix_reason(fix_of(r), r.epoch.containment));
         }),
    word("placement", "`free`, `inside building` or `under terrain`; `unknown` if a live run has no truth",
         "never", raytrace::Containment::Unknown, [](const Row& r) { return r.epoch.containment; })
        .in_view(U8),
    number("true_velocity_east_mps", "m/s", 4, "velocity of the antenna, east", "never", &true_velocity<0>)
        .in_view(F64, "velocity_east_mps"),
    number("true_velocity_north_mps", "m/s", 4, "velocity of the antenna, north", "never", &true_velocity<1>)
        .in_view(F64, "velocity_north_mps"),
    number("true_velocity_up_mps", "m/s", 4, "velocity of the antenna, up", "never", &true_velocity<2>)
        .in_view(F64, "velocity_up_mps"),
    number("fix_velocity_east_mps", "m/s", 4, "velocity solved from Doppler, east",
           "no fix, or too few Dopplers", &fix_velocity<0>),
    number("fix_velocity_north_mps", "m/s", 4, "velocity solved from Doppler, north",
           "no fix, or too few Dopplers", &fix_velocity<1>),
    number("fix_velocity_up_mps", "m/s", 4, "velocity solved from Doppler, up", "no fix, or too few Dopplers",
           &fix_velocity<2>),
    number("sigma_east_m", "m", 4,
           "standard deviation east reported by the receiver: square root of the covariance's diagonal",
           "no fix", &sigma<0>),
    number("sigma_north_m", "m", 4, "standard deviation north", "no fix", &sigma<1>),
    number("sigma_up_m", "m", 4, "standard deviation up", "no fix", &sigma<2>),
    number("covariance_east_north_m2", "m^2", 6, "covariance of east and north reported by the receiver",
           "no fix", &covariance<0, 1>)
        .in_view(F64),
    number("covariance_east_up_m2", "m^2", 6, "covariance of east and up", "no fix", &covariance<0, 2>)
        .in_view(F64),
    number("covariance_north_up_m2", "m^2", 6, "covariance of north and up", "no fix", &covariance<1, 2>)
        .in_view(F64),
    number("clock_gps_s", "s", 13, "solved receiver clock minus GPS time, also for SBAS",
           "no fix, or no satellite of the system used", &clock<gnss::System::GPS>),
    number("clock_glonass_s", "s", 13, "solved receiver clock minus GLONASS's time",
           "no fix, or no satellite of the system used", &clock<gnss::System::GLONASS>),
    number("clock_galileo_s", "s", 13, "solved receiver clock minus Galileo's time",
           "no fix, or no satellite of the system used", &clock<gnss::System::Galileo>),
    number("clock_beidou_s", "s", 13, "solved receiver clock minus BeiDou's time",
           "no fix, or no satellite of the system used", &clock<gnss::System::BeiDou>),
    number("clock_qzss_s", "s", 13, "solved receiver clock minus QZSS's time",
           "no fix, or no satellite of the system used", &clock<gnss::System::QZSS>),
    integer("excluded", "satellites", "satellites that RAIM excluded from this epoch's fix, or their Doppler",
            [](const Row& r) { return static_cast<std::int64_t>(fix_of(r).excluded.size()); }),
    number("consistent", "", 0, "`1` RAIM's test of the used measurements passed, `0` failed",
           "RAIM off, or no redundancy",
           [](const Row& r) {
             const auto& consistent = fix_of(r).consistent;
             return consistent ? (*consistent ? 1.0 : 0.0) : kNone;
           }),
    text("faults",
         "names of active faults ([faults.md](../faults.md)), separated by `; `; in quotes if they contain a "
         "comma",
         "no active fault", [](const Row& r) { return fault_names(r.epoch.faults); })
        .in_view(U16),
    number("error_horizontal_m", "m", 4, "root of the sum of the squares of the errors east and north",
           "no fix", [](const Row& r) { return horizontal_m(r.epoch.error_enu_m); })
        .not_in_csv(),
    number("clock_bias_s", "s", 13, "true receiver clock minus GPS time", "never",
           [](const Row& r) { return r.epoch.observed.clock_bias_s; })
        .not_in_csv()
        .in_view(F64),
    number("clock_drift", "", 13, "true rate of the receiver clock, seconds per second", "never",
           [](const Row& r) { return r.epoch.observed.clock_drift; })
        .not_in_csv()
        .in_view(F64),
    word("fix_kind", "`none`, `single`, `differential`, `float`, `fixed`, `dead reckoning` or `combined`",
         "never", positioning::FixKind::Combined, [](const Row& r) { return fix_of(r).kind(); })
        .in_view(U8),
    number("correction_age_s", "s", 2, "age of the corrections in the fix", "no corrections in the fix",
           [](const Row& r) {
             const auto& fix = fix_of(r);
             return gnss::corrected(fix.kind()) ? fix.correction_age_s.value_or(kNone) : kNone;
           })
        .in_view(F64),
    word("baseline_kind", "kind of the vector from the base: `float` or `fixed`",
         "no carrier phases of a base", positioning::FixKind::DeadReckoning,
         [](const Row& r) {
           const auto& baseline = fix_of(r).baseline;
           return baseline ? std::optional(baseline->kind) : std::nullopt;
         })
        .in_view(U8),
    number(
        "ambiguity_ratio", "", 2,
        "ratio test: squared distance of the second best integer ambiguities, divided by that of the best, "
        "at most 10",
        "no ambiguity search",
        [](const Row& r) { return fix_of(r).baseline ? fix_of(r).baseline->ratio.value_or(kNone) : kNone; })
        .in_view(F32),
    number("baseline_east_m", "m", 4, "vector from the base's reported antenna, east", "no such vector",
           [](const Row& r) { return baseline(r, 0); })
        .in_view(F64),
    number("baseline_north_m", "m", 4, "vector from the base's reported antenna, north", "no such vector",
           [](const Row& r) { return baseline(r, 1); })
        .in_view(F64),
    number("baseline_up_m", "m", 4, "vector from the base's reported antenna, up", "no such vector",
           [](const Row& r) { return baseline(r, 2); })
        .in_view(F64),
    number("heading_deg", "deg", 4,
           "azimuth of the vector from a moving base, from north, clockwise, 0 to 360",
           "no such vector, or the base does not move",
           [](const Row& r) {
             const auto& b = fix_of(r).baseline;
             return b && b->moving_base ? wrapped_azimuth_deg(b->heading_rad(), 4) : kNone;
           })
        .in_view(F64),
    number("heading_sigma_deg", "deg", 4, "standard deviation of that heading",
           "no such vector, or the base does not move",
           [](const Row& r) {
             const auto& b = fix_of(r).baseline;
             return b && b->moving_base ? degrees(b->heading_sigma_rad()) : kNone;
           })
        .in_view(F32),
    number("wrong_fix", "", 0,
           "1 if a fixed position is off by more than 0.1 m horizontally or 0.2 m vertically, and 1 mm and "
           "2 mm more for each kilometre of the baseline; else 0",
           "not fixed",
           [](const Row& r) {
             const std::optional<bool> wrong = wrong_fix(r.epoch);
             return wrong ? (*wrong ? 1.0 : 0.0) : kNone;
           })
        .in_view(F32),
    word("fusion",
         "the vehicle's sensors in the fix: `initialising` (not yet), `calibrating` or `navigating`",
         "no dead reckoning", positioning::FusionPhase::Navigating,
         [](const Row& r) {
           const auto& fusion = fix_of(r).fusion;
           return fusion ? std::optional(fusion->phase) : std::nullopt;
         }),
    number("vehicle_heading_deg", "deg", 4,
           "heading of the vehicle by its sensors, from north, clockwise, 0 to 360", "not fused",
           [](const Row& r) {
             const auto& fix = fix_of(r);
             return fix.fused() ? wrapped_azimuth_deg(fix.fusion->heading_rad, 4) : kNone;
           }),
    number("vehicle_heading_sigma_deg", "deg", 4, "standard deviation of that heading", "not fused",
           [](const Row& r) {
             const auto& fix = fix_of(r);
             return fix.fused() ? degrees(fix.fusion->heading_sigma_rad) : kNone;
           }),
    number("velocity_covariance_east_m2ps2", "m^2/s^2", 8,
           "variance of the velocity east reported by the receiver", "no velocity",
           &velocity_covariance<0, 0>),
    number("velocity_covariance_east_north_m2ps2", "m^2/s^2", 8, "covariance of east and north",
           "no velocity", &velocity_covariance<0, 1>),
    number("velocity_covariance_east_up_m2ps2", "m^2/s^2", 8, "covariance of east and up", "no velocity",
           &velocity_covariance<0, 2>),
    number("velocity_covariance_north_m2ps2", "m^2/s^2", 8, "variance north", "no velocity",
           &velocity_covariance<1, 1>),
    number("velocity_covariance_north_up_m2ps2", "m^2/s^2", 8, "covariance of north and up", "no velocity",
           &velocity_covariance<1, 2>),
    number("velocity_covariance_up_m2ps2", "m^2/s^2", 8, "variance up", "no velocity",
           &velocity_covariance<2, 2>),
};

constexpr std::array kSatelliteColumns{
    kWeek,
    kTow,
    kSatellite,
    number("azimuth_deg", "deg", 6, "true azimuth, from north, clockwise, 0 to 360", "never",
           [](const Row& r) { return wrapped_azimuth_deg(r.satellite->azimuth_rad, 6); })
        .cf("platform_azimuth_angle")
        .in_view(F32),
    number("elevation_deg", "deg", 6, "true elevation above the horizontal plane", "never",
           [](const Row& r) { return degrees(r.satellite->elevation_rad); })
        .in_view(F32),
    word("visibility",
         "`LOS`: the direct signal can be tracked (it reaches `signal.lock.tracking_threshold_dbhz` by "
         "itself, "
         "and no other path is stronger), and no reflection arrives; `LOS+multipath`: reflections arrive as "
         "well; "
         "`NLOS`: only reflected, diffracted or scattered signals can be tracked (`lock` shows whether they "
         "are; a "
         "receiver without strength tracks every signal that arrives); `blocked`: no signal, or only weaker "
         "ones",
         "never", propagation::Visibility::Blocked, [](const Row& r) { return r.satellite->visibility; })
        .in_view(U8),
    number(
        "excess_path_m", "m", 4,
        "code delay of the tracked signal by its paths: with the receiver's signal model where the code loop "
        "settles (multipath error of a direct signal, of either sign; excess path of an NLOS signal), else "
        "the shortest path's excess, 0 with a direct signal",
        "blocked, or not tracked",
        [](const Row& r) { return has_tracked_excess(*r.satellite) ? r.satellite->excess_m : kNone; })
        .in_view(F32, "excess_m"),
    kPseudorange,
    kPseudorangeError.in_view(F32),
    kNoise,
    integer("used", "", "`1` in the fix, `0` not",
            [](const Row& r) -> std::int64_t { return r.satellite->used; }),
    integer("above_mask", "", "`1` above the elevation mask, `0` below",
            [](const Row& r) -> std::int64_t { return r.satellite->above_mask; }),
    kDoppler,
    kCarrier,
    kSigma,
    number("residual_m", "m", 4, "measured minus computed, in the fix", "not used",
           [](const Row& r) { return positioning::residual_m(fix_of(r), r.satellite->id).value_or(kNone); })
        .in_view(F32),
    kCn0.in_view(F32),
    kTrueCn0.in_view(F32),
    kLock.in_view(U8),
    kPhase,
    kPhaseLock,
    kCycleSlip,
    integer("excluded", "", "`1` excluded (or its Doppler) by RAIM or the position filter, `0` not",
            [](const Row& r) -> std::int64_t { return is_excluded(fix_of(r), r.satellite->id); }),
    text("signal", "its first signal tracked by the receiver: `L1CA`, `E1`, `B1C` ...", "never",
         [](const Row& r) { return std::string(signal_of(r).name); })
        .not_in_csv()
        .in_view(U8),
    word("map_visibility", "`visibility` by the map alone, for any signal strength", "never",
         propagation::Visibility::Blocked, [](const Row& r) { return r.satellite->map_visibility; }),
    number("obstacles_db", "dB", 2,
           "attenuation of the direct signal by shadowing and by obstacles not in the map; 0 without a "
           "direct signal",
           "never", [](const Row& r) { return r.satellite->obstacles_db; }),
    word("tracked_path", "path whose carrier is tracked: `direct`, `reflected`, `diffracted` ...",
         "nothing arrives", propagation::PathKind::Transmitted,
         [](const Row& r) { return r.satellite->tracked_path; }),
};

/// Without the columns of the range's terms, which follow sigma_m.
constexpr std::array kSignalColumns{
    kWeek,
    kTow,
    kSatellite,
    text("signal", "`L1CA`, `E5a`, `G2` ...", "never",
         [](const Row& r) { return std::string(signal_of(r).name); }),
    text("rinex_code",
         "band and attribute in `receiver.obs`: `1C`, `5Q`; `X` if data and pilot are tracked together",
         "never", [](const Row& r) { return std::string(signal_of(r).code); }),
    kCarrier,
    kLock,
    kTrueCn0,
    kCn0,
    number("excess_path_m", "m", 4, "code delay by the signal paths", "not tracked",
           [](const Row& r) {
             return r.signal->lock == tracking::LockState::Tracking ? r.signal->excess_m : kNone;
           }),
    kPseudorange,
    kPseudorangeError,
    kNoise,
    kSigma,
    number("estimated_ionosphere_m", "m", 4,
           "the receiver's estimate of the ionospheric delay from the satellite's codes",
           "not `combination: uncombined`, or only one signal",
           [](const Row& r) {
             const auto& m = r.signal->measurement;
             const auto& l1_m = r.satellite->estimated_ionosphere_m;
             return m && l1_m ? *l1_m * std::pow(gnss::kL1_hz / m->carrier_frequency_hz, 2) : kNone;
           }),
    kDoppler,
    kPhase,
    kPhaseLock,
    kCycleSlip,
};

constexpr std::array kPathColumns{
    kWeek,
    kTow,
    kSatellite,
    integer("path", "", "index among the satellite's paths of this epoch, from 0",
            [](const Row& r) { return r.number; }),
    word("kind",
         "`direct`, `reflected`, `diffracted` (around an edge), `diffuse` (scattered by a facade), `spoofed` "
         "(a copy "
         "from a transmitter, [interference.md](../interference.md))",
         "never", propagation::PathKind::Transmitted, [](const Row& r) { return r.path->kind; }),
    integer("order", "", "number of reflections: 0, 1 or 2",
            [](const Row& r) -> std::int64_t { return r.path->order; })
        .in_view(U8),
    number("excess_path_m", "m", 4,
           "excess over the straight line; `diffuse`: mean of a class of paths; `spoofed`: of either "
           "sign",
           "never", [](const Row& r) { return r.path->excess_m; })
        .in_view(F32, "excess_m", 1024),
    number("loss_db", "dB", 2,
           "loss at the antenna's output against the unobstructed line of sight, at the carrier of the "
           "satellite's "
           "first tracked signal; `diffuse`: mean",
           "no signal model, or zero amplitude",
           [](const Row& r) { return r.amplitude != 0.0 ? -20 * std::log10(std::abs(r.amplitude)) : kNone; })
        .in_view(F32, nullptr, 64),
    number("phase_deg", "deg", 1,
           "phase of the carrier against the unobstructed line of sight, -180 to 180, by excess path, "
           "reflections and edge. The receiver adds a random phase of the surface to reflected and diffuse "
           "paths: no city is known to centimetres",
           "no signal model, or zero amplitude",
           [](const Row& r) { return r.amplitude != 0.0 ? degrees(std::arg(r.amplitude)) : kNone; })
        .in_view(F32, nullptr, 1),
    text("reflector", "name of the surfaces or edge, 16 hexadecimal digits, constant from epoch to epoch",
         "direct",
         [](const Row& r) {
           return r.path->kind == propagation::PathKind::Direct ? std::string()
                                                                : fmt::format("{:016x}", r.path->reflector);
         }),
    text("material", "material of the surface next to the antenna: `concrete`, `glass`, ...", "not reflected",
         [](const Row& r) {
           const propagation::Path& p = *r.path;
           const bool reflects = p.kind != propagation::PathKind::Direct && p.incidence_count > 0;
           return reflects ? material(r, p.incidence_count - 1) : std::string();
         }),
    number("point_east_m", "m", 3,
           "point of interaction next to the antenna, in the city's frame, as in `canyon trace`: east",
           "direct", &point<0>)
        .in_view(F32, nullptr, 64),
    number("point_north_m", "m", 3, "the same, north", "direct", &point<1>).in_view(F32, nullptr, 64),
    number("point_up_m", "m", 3, "the same, up", "direct", &point<2>).in_view(F32, nullptr, 64),
    text("far_material", "material of the surface next to the satellite", "reflected once, or not",
         [](const Row& r) { return r.path->order < 2 ? std::string() : material(r, 0); }),
    number("far_point_east_m", "m", 3,
           "point of reflection next to the satellite, with two reflections: east", "reflected once, or not",
           &far_point<0>)
        .in_view(F32, "far_east_m", 64),
    number("far_point_north_m", "m", 3, "the same, north", "reflected once, or not", &far_point<1>)
        .in_view(F32, "far_north_m", 64),
    number("far_point_up_m", "m", 3, "the same, up", "reflected once, or not", &far_point<2>)
        .in_view(F32, "far_up_m", 64),
    number("arrival_east", "", 6, "unit vector from the antenna towards the direction of arrival: east",
           "never", [](const Row& r) { return r.path->arrival.x(); })
        .not_in_csv(),
    number("arrival_north", "", 6, "the same, north", "never",
           [](const Row& r) { return r.path->arrival.y(); })
        .not_in_csv(),
    number("arrival_up", "", 6, "the same, up", "never", [](const Row& r) { return r.path->arrival.z(); })
        .not_in_csv(),
    number(
        "incidence_deg", "deg", 3, "angle between ray and normal of the facet next to the antenna",
        "not reflected",
        [](const Row& r) { return r.path->incidence_count > 0 ? degrees(r.path->incidence_rad()) : kNone; })
        .not_in_csv(),
};

template <std::size_t... term>
constexpr std::array<Number, sizeof...(term)> range_term_values(std::index_sequence<term...>) {
  return {&range_term<term>...};
}

/// kSignalColumns with the columns of receiver::range_terms() after sigma_m.
std::vector<Column> signal_columns() {
  static constexpr auto kValues = range_term_values(std::make_index_sequence<receiver::kRangeTermCount>());
  std::vector<Column> columns(kSignalColumns.begin(), kSignalColumns.end());
  auto at = std::find_if(columns.begin(), columns.end(),
                         [](const Column& c) { return std::string_view(c.name) == "sigma_m"; });
  const auto terms = receiver::range_terms();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (terms[i].column == nullptr) continue;
    at = columns.insert(at + 1,
                        number(terms[i].column, "m", 4, terms[i].help, "nothing measured", kValues[i]));
  }
  return columns;
}

}  // namespace

std::span<const Table> tables() {
  static const std::vector<Column> signals = signal_columns();
  static const std::array tables{Table{TableKind::Epochs, "epochs", kEpochColumns},
                                 Table{TableKind::Satellites, "satellites", kSatelliteColumns},
                                 Table{TableKind::Signals, "signals", signals},
                                 Table{TableKind::Paths, "paths", kPathColumns}};
  return tables;
}

double Column::value(const Row& row) const {
  switch (kind) {
    case Kind::Number:
      return number(row);
    case Kind::Integer:
      return static_cast<double>(integer(row));
    case Kind::Seconds:
      return static_cast<double>(integer(row)) / static_cast<double>(geodesy::GpsTime::kNanosecondsPerSecond);
    case Kind::Word: {
      const std::int64_t index = integer(row);
      return index < 0 ? kNone : static_cast<double>(index);
    }
    case Kind::Text:
      break;
  }
  return kNone;
}

std::string cf_unit(std::string_view unit) {
  static constexpr std::array<std::pair<std::string_view, const char*>, 7> kOther{{{"", "1"},
                                                                                   {"satellites", "1"},
                                                                                   {"cycles", "1"},
                                                                                   {"deg", "degree"},
                                                                                   {"dB-Hz", "dB"},
                                                                                   {"m/s", "m s-1"},
                                                                                   {"m^2", "m2"}}};
  for (const auto& [ours, theirs] : kOther)
    if (ours == unit) return theirs;
  return std::string(unit);
}

std::string Column::cf_unit() const {
  if (kind == Kind::Word || kind == Kind::Text) return {};
  if (std::string_view(standard_name) == "latitude") return "degrees_north";
  if (std::string_view(standard_name) == "longitude") return "degrees_east";
  return encoding::cf_unit(unit);
}

std::string markdown(const Table& table) {
  std::vector<TextRow> rows;
  for (const Column& c : table.columns)
    if (c.csv) rows.push_back({fmt::format("`{}`", c.name), c.unit, c.help, c.empty});
  return markdown_table({"column", "unit", "meaning", "empty"}, rows);
}

TableRows::TableRows(TableKind kind, tracking::SignalOptions signal)
    : kind_(kind), signal_(std::move(signal)) {}

void TableRows::each(const simulation::Epoch& epoch, void* to, RowHandler take) {
  const receiver::ReceiverEpoch& seen = epoch.observed;
  const auto signal_row = [&](const receiver::SatelliteObservation& satellite,
                              const receiver::SignalObservation& signal, std::size_t index) {
    Row row{epoch, &satellite, &signal};
    if (signal.measurement) row.link = arcs_.next(*signal.measurement, index);
    take(to, row);
  };
  switch (kind_) {
    case TableKind::Epochs:
      return take(to, Row{epoch});
    case TableKind::Satellites:
      for (const receiver::SatelliteObservation& s : seen.satellites) signal_row(s, s, 0);
      return;
    case TableKind::Signals:
      for (const receiver::SatelliteObservation& s : seen.satellites) {
        signal_row(s, s, index_of(signal_of(Row{epoch, &s, &s})));
        for (const receiver::SignalObservation& more : s.more)
          signal_row(s, more, index_of(signal_of(Row{epoch, &s, &more})));
      }
      return;
    case TableKind::Paths:
      for_each_view(seen, epoch.arrival,
                    [&](const receiver::SatelliteObservation& s, const propagation::SatelliteView& view) {
                      Row row{epoch, &s, &s};
                      for (const propagation::Path& path : view.paths.paths) {
                        row.path = &path;
                        row.amplitude = first_signal_amplitude(s, view, path, signal_);
                        take(to, row);
                        ++row.number;
                      }
                    });
  }
}

}  // namespace canyon::encoding
