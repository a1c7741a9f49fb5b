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
  v.boolean({"enabled", "",
             "RTK: float and fixed solutions by carrier phases relative to the base of `corrections`"},
            o.enabled);
  v.choice({"integers", "",
            "integer ambiguities: continuous (searched at each epoch), instantaneous (forgotten after each "
            "epoch) or hold (kept once fixed)"},
           o.integers, kIntegers);
  v.number({"ratio", "",
            "ratio test: the second best integers must be this many times farther away than the best"},
           o.ratio, {1.1, 10});
  v.number({"min_success", "", "smallest probability of correct integers, by the filter's covariance"},
           o.min_success, {0, 1, false, true});
  v.boolean({"partial", "", "partial fixing: leave uncertain satellites out if the search fails"}, o.partial);
  v.boolean({"fix_glonass", "",
             "fix GLONASS integers without known biases too: base and rover must be of one make"},
            o.fix_glonass);
  v.angle({"fix_elevation_deg", "deg", "satellites below this elevation are left out of the integer search"},
          o.fix_elevation_rad, {0, 89});
  v.integer({"min_satellites", "", "satellites required for a fixed solution"}, o.min_satellites, 4, 30);
  v.number({"phase_sigma_m", "m", "standard deviation of a phase at the zenith"}, o.phase_sigma_m,
           {0, 0.1, true});
  v.number({"code_ratio", "", "standard deviation of a code, divided by that of its phase"}, o.code_ratio,
           {1, 1000});
  v.number({"ionosphere_gradient", "",
            "difference of vertical ionospheric delays over distance; 0: not estimated"},
           o.ionosphere_gradient, {0, 1e-3});
  v.boolean({"troposphere", "", "remove the troposphere's model from the ranges of rover and base"},
            o.troposphere);
  v.number({"troposphere_gradient", "",
            "difference of zenith tropospheric delays over distance; 0: not estimated"},
           o.troposphere_gradient, {0, 1e-3});
  v.number({"acceleration_horizontal", "m/s^2/sqrt(Hz)",
            "spectral density of the white acceleration that the filter assumes, horizontal"},
           o.acceleration_horizontal, {0, 100, true});
  v.number({"acceleration_vertical", "m/s^2/sqrt(Hz)", "the same, vertical"}, o.acceleration_vertical,
           {0, 100, true});
  v.number({"gate_sigmas", "",
            "beyond this number of standard deviations a code is rejected and a phase counts as slipped"},
           o.gate_sigmas, {1, 100, true});
}

}  // namespace canyon::relative
