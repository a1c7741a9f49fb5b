#include "canyon/outputs/encoding/rtklib_solutions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/observations/fix_codes.hpp"

namespace canyon::encoding {

std::string rtklib_solutions(const std::vector<rtk::PairEpoch>& epochs, const std::string& program) {
  std::string text = fmt::format(
      "% program   : {}\n"
      "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\n"
      "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  "
      "sdne(m)  sdeu(m)  sdun(m) age(s)  ratio\n",
      program);
  const auto root = [](double covariance) {
    return covariance < 0 ? -std::sqrt(-covariance) : std::sqrt(covariance);
  };
  for (const rtk::PairEpoch& epoch : epochs) {
    const positioning::Fix& fix = epoch.fix;
    if (!fix.solved()) continue;
    std::string time = geodesy::format_gpst(epoch.receiver_time, 3);
    std::replace(time.begin(), time.end(), '-', '/');
    std::replace(time.begin(), time.end(), 'T', ' ');
    const Eigen::Matrix3d& c = fix.covariance_enu;
    text += fmt::format(
        "{:.23} {:14.9f} {:14.9f} {:10.4f} {:3d} {:3d} {:8.4f} {:8.4f} {:8.4f} {:8.4f} {:8.4f} {:8.4f} "
        "{:6.2f} "
        "{:6.1f}\n",
        time, geodesy::degrees(fix.position.latitude_rad), geodesy::degrees(fix.position.longitude_rad),
        fix.position.height_m, codes_of(fix.kind()).rtklib_quality, fix.used.size(), root(c(1, 1)),
        root(c(0, 0)), root(c(2, 2)), root(c(0, 1)), root(c(0, 2)), root(c(1, 2)),
        fix.correction_age_s.value_or(0), fix.baseline ? fix.baseline->ratio.value_or(0) : 0);
  }
  return text;
}

}  // namespace canyon::encoding
