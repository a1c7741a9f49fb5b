#include "canyon/tracking/signal_options.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/options/values.hpp"

namespace canyon::tracking {
namespace {

// A pattern to the visitors of options.
class AntennaRows final : public options::NamedRows {
 public:
  explicit AntennaRows(signal::AntennaPattern& pattern) : pattern_(pattern) {}
  std::string name() const override { return pattern_.name(); }
  std::vector<std::vector<double>> rows() const override {
    std::vector<std::vector<double>> rows;
    for (const signal::PatternPoint& point : pattern_.points()) {
      rows.push_back({point.elevation_deg, point.rhcp_dbic, point.lhcp_dbic});
    }
    return rows;
  }
  void set_name(const std::string& name) override { pattern_ = signal::antenna_by_name(name); }
  void set_rows(const std::vector<std::vector<double>>& rows) override {
    std::vector<signal::PatternPoint> points;
    for (const std::vector<double>& row : rows) points.push_back({row[0], row[1], row[2]});
    pattern_ = signal::AntennaPattern("rows", std::move(points));
  }

 private:
  signal::AntennaPattern& pattern_;
};

}  // namespace

CorrelationOptions correlation_of(const gnss::Signal& signal, const SignalOptions& options) {
  constexpr double kWide_hz = 5e6;
  return {
      signal.modulation, signal.chip_rate_hz,
      signal.chip_rate_hz > kWide_hz ? options.wide_front_end_bandwidth_hz : options.front_end_bandwidth_hz};
}

void SignalOptions::validate() const {
  link.validate();
  strength.validate();
  shadowing.validate();
  dll.validate();
  pll.validate();
  fll.validate();
  lock.validate();
  options::check(*this, "signals");
}

void visit(options::Visitor& v, SignalOptions& o) {
  static constexpr std::string_view kAntennas[]{"isotropic", "patch", "survey", "phone"};
  v.boolean({"enabled", "",
             "strength and tracking of signals; false: whatever arrives is measured, at its shortest path"},
            o.enabled);
  AntennaRows antenna(o.antenna);
  v.named_rows({"antenna", "", "isotropic, patch, survey or phone"}, kAntennas,
               {"antenna_rows", "deg, dBic, dBic",
                "instead: a pattern of rows [elevation, RHCP gain, LHCP gain], elevations rising"},
               3, antenna);
  v.part("link", o.link);
  v.section("system_offset_db", [&] {
    for (const gnss::System system : gnss::kAllSystems) {
      const auto at = o.system_offset_db.find(system);
      const double before = at == o.system_offset_db.end() ? 0 : at->second;
      double offset_db = before;
      v.number({gnss::name(system), "dB", "added to the C/N0 of this system"}, offset_db, {-20, 20});
      if (v.reads() && offset_db != before) o.system_offset_db[system] = offset_db;
    }
  });
  v.number({"satellite_sigma_db", "dB", "standard deviation of a constant of each satellite's power"},
           o.satellite_sigma_db, {0, 10});
  v.part("strength", o.strength);
  v.part("shadowing", o.shadowing);
  // Within half to 1000 times the chip rates of all open signals.
  v.number({"front_end_bandwidth_hz", "Hz", "two-sided, of an ideal filter; none: no filter"},
           o.front_end_bandwidth_hz, options::or_none({1.023e6, 511e6}));
  v.number({"wide_front_end_bandwidth_hz", "Hz", "the same for signals of 10.23 Mchip/s"},
           o.wide_front_end_bandwidth_hz, options::or_none({10.23e6, 511e6}));
  v.part("dll", o.dll);
  v.part("pll", o.pll);
  v.part("fll", o.fll);
  v.part("lock", o.lock);
  v.number({"phase_threshold_dbhz", "dB-Hz", "carrier phase is tracked down to this C/N0"},
           o.phase_threshold_dbhz, {0, 100});
  v.number({"cn0_sigma_db", "dB", "standard deviation of the receiver's C/N0 estimate"}, o.cn0_sigma_db,
           {0, 10});
  v.number({"cn0_step_db", "dB", "C/N0 is stated in steps of this; 0: as it is"}, o.cn0_step_db, {0, 10});
  v.boolean({"loop_noise", "", "thermal noise of code, phase and Doppler from C/N0"}, o.loop_noise);
}

}  // namespace canyon::tracking
