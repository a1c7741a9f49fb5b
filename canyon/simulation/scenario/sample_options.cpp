#include "canyon/simulation/scenario/sample_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::samples {
namespace {

constexpr std::string_view kFormats[]{"int8", "int16", "float32", "2bit", "1bit"};

}  // namespace

std::string_view name(SampleFormat format) {
  return kFormats[static_cast<std::size_t>(format)];
}

double band_centre_hz(std::string_view band) {
  constexpr std::pair<std::string_view, double> kBands[]{
      {"L1", gnss::kL1_hz}, {"L2", 1227.6e6}, {"L5", 1176.45e6}, {"E5", 1191.795e6}};
  for (const auto& [name, centre_hz] : kBands)
    if (name == band) return centre_hz;
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system))
      if (signal.name == band) return signal.carrier_hz;
  }
  throw InputError(fmt::format("'{}' is not a band", band),
                   fmt::format("give L1, L2, L5, E5 or a signal: {}", fmt::join(gnss::signal_names(), ", ")));
}

void SampleOptions::validate() const {
  options::check(*this, "samples");
  if (bands.empty()) throw InputError("the samples have no band", "give bands: [L1]");
  for (const std::string& band : bands) (void)band_centre_hz(band);
  if (format == SampleFormat::OneBit && noise_level)
    throw InputError("samples of 1 bit are signs and have no noise level", "leave the noise level out");
  if (real && intermediate_hz == 0) {
    throw InputError("real samples need an intermediate frequency",
                     fmt::format("give a quarter of the rate: {} Hz", rate_hz / 4));
  }
}

void visit(options::Visitor& v, SampleOptions& o) {
  v.texts({"bands", "", "bands of the samples, one file each: L1, L2, L5, E5 or names of signals"}, o.bands);
  v.number({"rate_hz", "Hz", "samples per second"}, o.rate_hz, {1e6, 200e6});
  v.number({"intermediate_hz", "Hz", "intermediate frequency: the band's centre is shifted to it"},
           o.intermediate_hz, {-100e6, 100e6});
  v.number({"bandwidth_hz", "Hz", "two-sided bandwidth of a filter before the converter; 0: none"},
           o.bandwidth_hz, {0, 200e6});
  v.boolean({"real_valued", "", "real samples, at an intermediate frequency"}, o.real);
  v.former_name("real", "real_valued");
  v.boolean({"noise", "", "noise of the front end"}, o.noise);
  v.choice({"format", "", "encoding of real and imaginary parts"}, o.format, kFormats);
  v.number(
      {"noise_level", "", "standard deviation of the noise, divided by the largest value", "0.25; 2bit 0.67"},
      o.noise_level, {0, 1, true});
}

}  // namespace canyon::samples
