#include "canyon/inertial/magnetometer_options.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "canyon/options/values.hpp"

namespace canyon::inertial {
namespace {

constexpr double kNoRange = std::numeric_limits<double>::infinity();

// Noise, bias instability, hard iron [uT], soft iron, resolution, range [uT]. IST8310 (iSentek): step and
// range; RM3100 (PNI) at 200 cycle counts: noise, step, range. The rest is assumed.
constexpr std::array<std::array<double, 6>, 3> kMagnetometers{{
    {0, 0, 0, 0, 0, kNoRange},
    {0.3, 0.05, 10, 0.03, 0.3, 1600},
    {0.015, 0.005, 10, 0.03, 0.0133, 800},
}};

}  // namespace

TriadNumbers magnetometer_numbers(const MagnetometerOptions& o) {
  const auto& part = kMagnetometers.at(static_cast<std::size_t>(o.profile));
  constexpr double kMicro = 1e-6;
  TriadNumbers numbers;
  // Each sample has the noise of its interval.
  numbers.white = o.noise_ut.value_or(part[0]) * kMicro / std::sqrt(o.rate_hz);
  numbers.flicker = o.bias_instability_ut.value_or(part[1]) * kMicro;
  numbers.turn_on = o.hard_iron_ut.value_or(part[2]) * kMicro;
  numbers.scale = numbers.misalignment = o.soft_iron.value_or(part[3]);
  numbers.resolution = o.resolution_ut.value_or(part[4]) * kMicro;
  numbers.range = o.range_ut.value_or(part[5]) * kMicro;
  return numbers;
}

void MagnetometerOptions::validate() const {
  options::check(*this, "magnetometer");
}

void visit(options::Visitor& v, MagnetometerOptions& o) {
  static constexpr std::string_view kProfileWords[]{"ideal", "ist8310", "rm3100"};
  static constexpr std::string_view kBy = "by profile";
  v.choice({"profile", "", "part, which gives the defaults of its numbers: ideal, ist8310, rm3100"},
           o.profile, kProfileWords);
  v.number({"rate_hz", "Hz", "samples"}, o.rate_hz, {0.1, 1000});
  visit_axes(v, o.axes);
  visit_orientation(v, o.orientation);
  v.number({"noise_ut", "uT", "standard deviation of each sample's noise", kBy}, o.noise_ut, {0, 100});
  v.number({"bias_instability_ut", "uT", "1/f noise: lowest Allan deviation", kBy}, o.bias_instability_ut,
           {0, 100});
  v.number({"hard_iron_ut", "uT", "standard deviation of each axis' part of the vehicle's own field", kBy},
           o.hard_iron_ut, {0, 1000});
  v.number({"soft_iron", "", "standard deviation of each element of the matrix that bends the field", kBy},
           o.soft_iron, {0, 1});
  v.number({"resolution_ut", "uT", "step of the values; 0: not rounded", kBy}, o.resolution_ut, {0, 100});
  v.number({"range_ut", "uT", "largest value; none: no limit", kBy}, o.range_ut,
           options::or_none({0, 1e6, true}));
  v.number({"delay_s", "s", "age of the field that a sample states"}, o.delay_s, {0, 10});
  v.number({"surroundings_ut", "uT",
            "standard deviation of the field of steel by the way, in each axis; it changes with the way"},
           o.surroundings_ut, {0, 1000});
  v.number({"surroundings_m", "m", "way over which that field falls to 1/e of its correlation"},
           o.surroundings_m, {0.1, 10000});
}

}  // namespace canyon::inertial
