#include "canyon/disturbance/faults/jamming.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/options/values.hpp"

namespace canyon::disturbance {
namespace {

using propagation::Polarisation;
using Shape = EmissionOptions::Shape;

// Sweeps of some 10 to 20 MHz in some 10 microseconds: R. H. Mitch et al., Signal Characteristics of Civil
// GPS Jammers, ION GNSS 2011; powers within those measured there.
constexpr std::array<std::string_view, 3> kPresets{"privacy_l1", "privacy_l1_l2", "noise_l1"};

std::vector<EmissionOptions> emissions_of(const JammingOptions& o) {
  EmissionOptions chirp;
  chirp.shape = Shape::Chirp;
  EmissionOptions second = chirp;
  second.centre_hz = 1227.6e6;
  EmissionOptions noise;
  noise.power_dbm = 30;
  if (o.preset == "privacy_l1") return {chirp};
  if (o.preset == "privacy_l1_l2") return {chirp, second};
  if (o.preset == "noise_l1") return {noise};
  return o.emissions;
}

}  // namespace

void EmissionOptions::validate() const {
  options::check(*this, "emission");
}

void visit(options::Visitor& v, EmissionOptions& o) {
  static constexpr std::string_view kShapes[]{"noise", "chirp", "tone"};
  v.choice({"shape", "", "noise (flat), chirp (saw-tooth sweep) or tone"}, o.shape, kShapes);
  v.number({"centre_hz", "Hz", "centre of the band, or frequency of the tone"}, o.centre_hz, {1e9, 2e9});
  v.number({"width_hz", "Hz", "width of noise or of a chirp's sweep"}, o.width_hz, {0, 200e6, true});
  v.number({"period_s", "s", "period of a chirp's sweep"}, o.period_s, {1e-7, 1e-2});
  v.number({"power_dbm", "dBm", "equivalent isotropically radiated power on the beam's axis"}, o.power_dbm,
           {-100, 100});
}

void JammingOptions::validate() const {
  options::check(*this, "jammer");
  transmitter.validate();
  for (const EmissionOptions& each : emissions) each.validate();
  if (preset.empty() == emissions.empty()) {
    throw InputError(preset.empty() ? "a jammer sends nothing" : "a jammer has a preset and emissions",
                     fmt::format("give emissions, or a preset: {}", fmt::join(kPresets, ", ")));
  }
}

void visit(options::Visitor& v, JammingOptions& o) {
  static constexpr std::string_view kPolarisations[]{"right", "left", "linear"};
  visit(v, o.transmitter);
  v.choice({"polarisation", "", "polarization of its antenna: right, left (circular) or linear"},
           o.polarisation, kPolarisations);
  v.one_of({"preset", "emissions"});
  v.word(
      {"preset", "",
       "a kind of jammer: privacy_l1 (chirp of 20 MHz and 10 us, 10 dBm), privacy_l1_l2 (the same on L2 as "
       "well), noise_l1 (20 MHz, 30 dBm)",
       "none"},
      o.preset, kPresets);
  v.list("emissions", o.emissions, [&](EmissionOptions& each) {
    visit(v, each);
    v.validate(each);
  });
}

Jamming::Jamming(const JammingOptions& options, FaultContext context)
    : polarisation_(options.polarisation), transmitter_(options.transmitter, context) {
  options.validate();
  emissions_ = emissions_of(options);
}

void Jamming::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  for (const EmissionOptions& each : emissions_) {
    propagation::Interference wave;
    using Kind = propagation::Spectrum::Shape;
    wave.spectrum.shape = each.shape == Shape::Noise   ? Kind::Band
                          : each.shape == Shape::Chirp ? Kind::Chirp
                                                       : Kind::Tone;
    wave.spectrum.centre_hz = each.centre_hz;
    if (each.shape != Shape::Tone) wave.spectrum.width_hz = each.width_hz;
    if (each.shape == Shape::Chirp) wave.spectrum.period_s = each.period_s;
    wave.polarisation = polarisation_;
    for (const TransmitterWay& way : transmitter_.ways(antenna.time, arrival.antenna_enu, each.centre_hz)) {
      wave.power_dbw = each.power_dbm - 30 + way.gain_db;
      wave.arrival = way.arrival;
      arrival.interference.push_back(wave);
    }
  }
}

}  // namespace canyon::disturbance
