#include "canyon/tracking/loop_noise.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/options/values.hpp"

namespace canyon::tracking {
namespace {

OuOptions unit_process(double loop_bandwidth_hz) {
  if (!(loop_bandwidth_hz > 0) || !std::isfinite(loop_bandwidth_hz)) {
    throw InputError(fmt::format("loop_bandwidth_hz of a noise is {}", loop_bandwidth_hz),
                     "it must be above 0 Hz");
  }
  OuOptions options;
  options.theta_per_s = 4 * loop_bandwidth_hz;
  options.sigma_m_per_sqrt_s = std::sqrt(2 * options.theta_per_s);
  return options;
}

}  // namespace

double cn0_hz(double cn0_dbhz) {
  if (!std::isfinite(cn0_dbhz)) {
    throw InputError(fmt::format("a C/N0 is {} dB-Hz", cn0_dbhz), "it must be finite");
  }
  return std::pow(10, cn0_dbhz / 10);
}

CodeLoopNoise::CodeLoopNoise(const CodeTracker& tracker)
    : bandwidth_hz_(tracker.options().loop_bandwidth_hz), integration_s_(tracker.options().integration_s) {
  const DllOptions& loop = tracker.options();
  const Correlation& r = tracker.correlation();
  const CorrelatorBank bank = correlator_bank(loop);
  const auto count = static_cast<std::size_t>(bank.count);
  double variance = 0;
  double slope = 0;
  for (std::size_t i = 0; i < count; ++i) {
    slope += bank.weight[i] * r.slope(bank.offset_chips[i]);
    for (std::size_t k = 0; k < count; ++k) {
      variance += bank.weight[i] * bank.weight[k] * r.value(bank.offset_chips[i] - bank.offset_chips[k]);
    }
  }
  const double metres = r.chip_m() / slope;
  first_ = variance * metres * metres;
  switch (loop.discriminator) {
    case Discriminator::Coherent:
      break;
    case Discriminator::EarlyLatePower: {
      const double side = r.value(loop.spacing_chips / 2);
      second_ = first_ * (r.value(0) + r.value(loop.spacing_chips)) / (2 * integration_s_ * side * side);
      break;
    }
    case Discriminator::DotProduct:
    case Discriminator::DoubleDelta:
      second_ = first_ / (integration_s_ * r.value(0));
      break;
  }
  narrow_from_ = loop.narrow_below_dbhz > 0 ? density(cn0_hz(loop.narrow_below_dbhz))
                                            : std::numeric_limits<double>::infinity();
}

double CodeLoopNoise::bandwidth_share(double cn0) const {
  const double now = density(cn0);
  return now > narrow_from_ ? std::sqrt(narrow_from_ / now) : 1;
}

double CodeLoopNoise::sigma_m(double cn0) const {
  const double bandwidth = bandwidth_hz_ * bandwidth_share(cn0);
  return std::sqrt(bandwidth * (1 - bandwidth * integration_s_ / 2) * density(cn0));
}

double pll_jitter_rad(const PllOptions& options, double cn0_dbhz) {
  options.validate();
  const double ratio = cn0_hz(cn0_dbhz);
  return std::sqrt(options.loop_bandwidth_hz / ratio * (1 + 1 / (2 * options.integration_s * ratio)));
}

double fll_jitter_hz(const FllOptions& options, double cn0_dbhz) {
  options.validate();
  const double ratio = cn0_hz(cn0_dbhz);
  const double t = options.integration_s;
  return std::sqrt(4 * options.noise_factor * options.loop_bandwidth_hz / ratio * (1 + 1 / (t * ratio))) /
         (2 * geodesy::kPi * t);
}

LoopNoise::LoopNoise(double loop_bandwidth_hz, RandomStream stream)
    : process_(unit_process(loop_bandwidth_hz), stream) {}

double LoopNoise::advance(double dt_s, double sigma) {
  if (!(sigma >= 0) || !std::isfinite(sigma)) {
    throw InputError(fmt::format("the standard deviation of a noise is {}", sigma),
                     "it must be finite and 0 or more");
  }
  return sigma * process_.advance(dt_s);
}

void PllOptions::validate() const {
  options::check(*this, "phase lock loop");
  check_bandwidths(loop_bandwidth_hz, loop_bandwidths_hz, integration_s, "phase lock loop");
}

void FllOptions::validate() const {
  options::check(*this, "frequency lock loop");
  check_bandwidths(loop_bandwidth_hz, loop_bandwidths_hz, integration_s, "frequency lock loop");
}

void visit(options::Visitor& v, PllOptions& o) {
  v.number({"loop_bandwidth_hz", "Hz", "one-sided noise bandwidth of the phase loop"}, o.loop_bandwidth_hz,
           {0, 100, true});
  gnss::visit_signal_values(v, {"loop_bandwidths_hz", "Hz", "of signals that have another"},
                            o.loop_bandwidths_hz, {0, 100, true});
  v.number({"integration_s", "s", "coherent integration"}, o.integration_s, {0, 10, true});
}

void visit(options::Visitor& v, FllOptions& o) {
  v.number({"loop_bandwidth_hz", "Hz", "one-sided noise bandwidth of the frequency loop (Doppler)"},
           o.loop_bandwidth_hz, {0, 100, true});
  gnss::visit_signal_values(v, {"loop_bandwidths_hz", "Hz", "of signals that have another"},
                            o.loop_bandwidths_hz, {0, 100, true});
  v.number({"integration_s", "s", "coherent integration"}, o.integration_s, {0, 10, true});
  v.number({"noise_factor", "", "1 at high C/N0, 2 near the tracking threshold"}, o.noise_factor, {1, 2});
}

}  // namespace canyon::tracking
