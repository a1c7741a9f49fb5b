#include "canyon/receiver/receiver_options.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/options/values.hpp"

namespace canyon::receiver {

bool NoiseOptions::drifts(double speed_mps, int los) const {
  return enabled && drift_enabled && (speed_mps < drift_below_speed_mps || los < drift_below_los);
}

void NoiseOptions::validate() const {
  options::check(*this, "noise");
}

void visit(options::Visitor& v, NoiseOptions& o) {
  v.boolean({"enabled", "", "noise on pseudoranges and Doppler"}, o.enabled);
  visit(v, o.ou);
  v.number({"doppler_sigma_hz", "Hz", "standard deviation of white noise on Doppler"}, o.doppler_sigma_hz,
           {0, 1e6});
  v.section("drift", [&] {
    v.boolean({"enabled", "",
               "the paper's drift mode: while slow or with few satellites in sight, means move away from mu"},
              o.drift_enabled);
    v.number({"below_speed_mps", "m/s", "drift while slower than this"}, o.drift_below_speed_mps, {0, 1e4});
    v.integer({"below_los", "satellites", "drift while fewer satellites are in line of sight"},
              o.drift_below_los, 0, 1000);
    v.number({"mu_sigma_m", "m", "standard deviation of the drifted means, drawn once per satellite"},
             o.drift_mu_sigma_m, {0, 1e6});
  });
}

void ReceiverOptions::validate() const {
  if (name.empty()) throw InputError("a receiver has no name", "give every receiver a name of its own");
  try {
    fix.validate();
    noise.validate();
    clock.validate();
    signal.validate();
    filter.validate();
  } catch (const InputError& error) {
    throw InputError(fmt::format("receiver '{}': {}", name, error.problem()), error.cure());
  }
}

void visit(options::Visitor& v, ReceiverOptions& o) {
  v.boolean(
      {"own_draws", "",
       "draws noise, clock, shadows and phases by the receiver's name too; false: alike for all receivers "
       "of a seed"},
      o.own_draws);
  visit(v, o.fix);
  v.boolean(
      {"ionosphere", "",
       "put the broadcast ionosphere (Klobuchar) into the signals, with the coefficients of the navigation "
       "files or, under nominal satellites, a standard set"},
      o.ionosphere);
  v.boolean({"troposphere", "", "put Saastamoinen's troposphere into the signals"}, o.troposphere);
  v.part("position_filter", o.filter);
  v.part("clock", o.clock);
  v.part("signal", o.signal);
  v.part("noise", o.noise);
}

}  // namespace canyon::receiver
