#include "canyon/relative/recorded_pair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/relative/recorded_signals.hpp"
#include "canyon/relative/rtk_filter.hpp"

namespace canyon::relative {
namespace {

using positioning::FixKind;

/// Tags of receivers that steer their clocks agree to milliseconds [s].
constexpr double kSameTag_s = 0.01;

void keep_signals(std::vector<SignalMeasurement>& measured, const std::vector<std::string>& names) {
  if (names.empty()) return;
  measured.erase(std::remove_if(measured.begin(), measured.end(),
                                [&](const SignalMeasurement& m) {
                                  return std::find(names.begin(), names.end(), m.signal->name) == names.end();
                                }),
                 measured.end());
}

/// The first signals, whose clock the sky gives.
std::vector<positioning::Measurement> first_signals(const std::vector<SignalMeasurement>& measured) {
  std::vector<positioning::Measurement> result;
  for (const SignalMeasurement& m : measured) {
    if (gnss::index_of(*m.signal) == 0) result.push_back(m.measurement);
  }
  return result;
}

void check_common(const RecordedEpochs& rover, const RecordedEpochs& base, const PairOptions& options) {
  if (rover.empty() || base.empty()) {
    throw InputError(fmt::format("the {} has no epoch", rover.empty() ? "rover" : "base"),
                     "give recordings with observations");
  }
  const geodesy::GpsTime first = base.front()->receiver_time, last = base.back()->receiver_time;
  const geodesy::GpsTime begin = rover.front()->receiver_time, end = rover.back()->receiver_time;
  if (begin - last > options.max_age_s || first - end > kSameTag_s) {
    throw InputError(fmt::format("base ({} to {}) and rover ({} to {}) share no time",
                                 geodesy::format_gpst(first, 0), geodesy::format_gpst(last, 0),
                                 geodesy::format_gpst(begin, 0), geodesy::format_gpst(end, 0)),
                     "give recordings of the same time");
  }
}

}  // namespace

RecordedEpochs recorded_epochs(const std::vector<rinex::ObservationEpoch>& recorded,
                               const GlonassBiases& biases, const orbit::Sky& sky,
                               const Eigen::Vector3d& place) {
  RecordedSignals signals(sky, biases);
  RecordedEpochs result;
  for (const rinex::ObservationEpoch& epoch : recorded) {
    Corrections of_epoch;
    of_epoch.station_ecef = place;
    of_epoch.receiver_time = epoch.receiver_time;
    of_epoch.observations = signals.next(epoch);
    result.push_back(std::make_shared<const Corrections>(std::move(of_epoch)));
  }
  return result;
}

std::vector<PairEpoch> solve_pair(const RecordedEpochs& rover, const RecordedEpochs& base,
                                  const orbit::Sky& sky,
                                  const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                  const PairOptions& options,
                                  const std::function<void(std::size_t, std::size_t)>& progress) {
  check_common(rover, base, options);
  RtkFilter filter(options.rtk, options.fix, options.max_age_s);
  std::vector<PairEpoch> result;
  result.reserve(rover.size());
  std::size_t next = 0;
  bool related = false;
  for (const auto& epoch : rover) {
    const geodesy::GpsTime time = epoch->receiver_time;
    while (next < base.size() && base[next]->receiver_time - time < kSameTag_s) {
      Corrections of_base = *base[next++];
      keep_signals(of_base.observations, options.signals);
      filter.take(of_base, sky);
    }
    std::vector<SignalMeasurement> measured = epoch->observations;
    keep_signals(measured, options.signals);
    positioning::Fix fix = solve_fix(time, first_signals(measured), sky, options.fix, klobuchar);
    if (auto relative = filter.update(time, measured, sky, fix)) {
      fix = std::move(*relative);
      related = true;
    }
    result.push_back({time, std::move(fix)});
    if (progress) progress(result.size(), rover.size());
  }
  if (!related) {
    throw InputError("no epoch has four satellites with phases of the same signals at base and rover",
                     "check that they record the same systems and bands, and give ephemerides of these");
  }
  return result;
}

std::string rtklib_solutions(const std::vector<PairEpoch>& epochs, const std::string& program) {
  std::string text = fmt::format(
      "% program   : {}\n"
      "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\n"
      "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  "
      "sdne(m)  sdeu(m)  sdun(m) age(s)  ratio\n",
      program);
  const auto root = [](double covariance) {
    return covariance < 0 ? -std::sqrt(-covariance) : std::sqrt(covariance);
  };
  for (const PairEpoch& epoch : epochs) {
    const positioning::Fix& fix = epoch.fix;
    if (!fix.solved()) continue;
    const FixKind kind = fix.kind();
    const int quality = kind == FixKind::Fixed          ? 1
                        : kind == FixKind::Float        ? 2
                        : kind == FixKind::Differential ? 4
                                                        : 5;
    std::string time = geodesy::format_gpst(epoch.receiver_time, 3);
    std::replace(time.begin(), time.end(), '-', '/');
    std::replace(time.begin(), time.end(), 'T', ' ');
    const Eigen::Matrix3d& c = fix.covariance_enu;
    text += fmt::format(
        "{:.23} {:14.9f} {:14.9f} {:10.4f} {:3d} {:3d} {:8.4f} {:8.4f} {:8.4f} {:8.4f} {:8.4f} {:8.4f} "
        "{:6.2f} "
        "{:6.1f}\n",
        time, geodesy::degrees(fix.position.latitude_rad), geodesy::degrees(fix.position.longitude_rad),
        fix.position.height_m, quality, fix.used.size(), root(c(1, 1)), root(c(0, 0)), root(c(2, 2)),
        root(c(0, 1)), root(c(0, 2)), root(c(1, 2)), fix.correction_age_s.value_or(0),
        fix.baseline ? fix.baseline->ratio.value_or(0) : 0);
  }
  return text;
}

}  // namespace canyon::relative
