#include "canyon/relative/rtk_options.hpp"

#include <string_view>

#include "canyon/options/values.hpp"

namespace canyon::relative {
namespace {

constexpr std::string_view kIntegers[]{"continuous", "instantaneous", "hold"};

}  // namespace

void RtkOptions::validate() const {
  options::check(*this, "rtk");
}

void visit(options::Visitor& v, RtkOptions& o) {
  v.boolean(
      {"enabled", "", "carrier phases relative to the base of `corrections`: float and fixed solutions"},
      o.enabled);
  v.choice({"integers", "", "whole numbers of cycles are searched for at each epoch, forgotten, or held"},
           o.integers, kIntegers);
  v.number({"ratio", "", "the second best whole numbers must be so many times farther than the best"},
           o.ratio, {1.1, 10});
  v.number(
      {"min_success", "", "probability that the search finds the right ones, by the filter's covariance"},
      o.min_success, {0, 1, false, true});
  v.boolean({"partial", "", "leaves uncertain satellites out of a search that fails"}, o.partial);
  v.boolean({"fix_glonass", "",
             "whole numbers of GLONASS also without known biases: base and rover must be of one make"},
            o.fix_glonass);
  v.angle({"fix_elevation_deg", "deg", "satellites below are not in the search for whole numbers"},
          o.fix_elevation_rad, {0, 89});
  v.integer({"min_satellites", "", "satellites that a fixed solution needs"}, o.min_satellites, 4, 30);
  v.number({"phase_sigma_m", "m", "deviation of a phase at the zenith"}, o.phase_sigma_m, {0, 0.1, true});
  v.number({"code_ratio", "", "deviation of a code over that of its phase"}, o.code_ratio, {1, 1000});
  v.number({"ionosphere_gradient", "", "difference of vertical delays over distance; 0: none is estimated"},
           o.ionosphere_gradient, {0, 1e-3});
  v.number({"troposphere_gradient", "", "likewise, of the troposphere"}, o.troposphere_gradient, {0, 1e-3});
  v.number({"acceleration_horizontal", "m/s^2/sqrt(Hz)", "white acceleration that the filter expects"},
           o.acceleration_horizontal, {0, 100, true});
  v.number({"acceleration_vertical", "m/s^2/sqrt(Hz)", "likewise, upwards"}, o.acceleration_vertical,
           {0, 100, true});
  v.number({"gate_sigmas", "", "beyond so many deviations a code is left out, and a phase has slipped"},
           o.gate_sigmas, {1, 100, true});
}

}  // namespace canyon::relative
