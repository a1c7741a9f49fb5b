#include "canyon/receiver/tracking/signal_options.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::tracking {
namespace {

using signal::AntennaPattern;
using signal::Band;
using signal::PatternPoint;

constexpr std::string_view kRows = "rows", kAsNamed = "as named";

/// One band of a pattern for the visitors of options. Rows of the lower band may be given in addition to a
/// name; those of the upper one replace it.
class AntennaRows final : public options::NamedRows {
 public:
  AntennaRows(AntennaPattern& pattern, Band band) : pattern_(pattern), band_(band) {}
  [[nodiscard]] std::string name() const override {
    if (band_ == Band::Upper || (pattern_.name() == kRows && pattern_.receives(band_)))
      return pattern_.name();
    return std::string(kAsNamed);
  }
  [[nodiscard]] std::vector<std::vector<double>> rows() const override {
    std::vector<std::vector<double>> rows;
    for (const PatternPoint& p : pattern_.points(band_))
      rows.push_back({p.elevation_deg, p.rhcp_dbic, p.lhcp_dbic});
    return rows;
  }
  void set_name(const std::string& name) override { pattern_ = signal::antenna_by_name(name); }
  void set_rows(const std::vector<std::vector<double>>& rows) override {
    std::vector<PatternPoint> points;
    points.reserve(rows.size());
    for (const std::vector<double>& row : rows) points.push_back({row[0], row[1], row[2]});
    constexpr double kHighest_deg = 80;
    if (points.size() > 1 && points.back().elevation_deg < kHighest_deg) {
      throw InputError(fmt::format("the antenna's rows end at {:g} deg and give no gain above it",
                                   points.back().elevation_deg),
                       "add rows up to 90 deg; a single row applies to all elevations");
    }
    const std::string name(kRows);
    pattern_ = band_ == Band::Upper ? AntennaPattern(name, std::move(points))
                                    : AntennaPattern(name, pattern_.points(Band::Upper), std::move(points));
  }

 private:
  AntennaPattern& pattern_;
  Band band_;
};

}  // namespace

CorrelationOptions correlation_of(const gnss::Signal& signal, const SignalOptions& options) {
  constexpr double kWide_hz = 5e6;
  return {
      signal.modulation, signal.chip_rate_hz,
      signal.chip_rate_hz > kWide_hz ? options.wide_front_end_bandwidth_hz : options.front_end_bandwidth_hz};
}

double level_db(const SignalOptions& options) {
  // Nominal, Roof, RoofWithSplitter, Dashboard, Handheld, Drone.
  static constexpr double kDb[]{0, -1, -9, -9, -3, 0};
  return options.installation_db.value_or(kDb[static_cast<std::size_t>(options.installation)]);
}

void SignalOptions::validate() const {
  link.validate();
  shadowing.validate();
  dll.validate();
  pll.validate();
  fll.validate();
  lock.validate();
  options::check(*this, "signals");
  for (const auto& [group, offset] : offset_db) gnss::check_group(group);
}

void visit(options::Visitor& v, SignalOptions& o) {
  v.boolean({"enabled", "",
             "simulate strength and tracking of signals; false: every arriving signal is measured by its "
             "shortest path"},
            o.enabled);
  AntennaRows upper(o.antenna, Band::Upper), lower(o.antenna, Band::Lower);
  v.named_rows({"antenna", "",
                "pattern of the antenna: isotropic, patch (upper band only), dual_patch, survey or phone"},
               signal::antenna_names(),
               {"antenna_rows", "deg, dBic, dBic",
                "rows of a custom pattern [elevation, RHCP gain, LHCP gain], elevations increasing"},
               3, upper);
  v.rows({"antenna_lower_rows", "deg, dBic, dBic",
          "rows for the lower band, 1164 to 1300 MHz; if omitted: the lower band of `antenna`"},
         std::span(&kAsNamed, 1), 3, lower);
  v.part("link", o.link);
  static constexpr std::string_view kInstallations[]{"nominal",   "roof",     "roof_with_splitter",
                                                     "dashboard", "handheld", "drone"};
  v.choice({"installation", "",
            "installation of the antenna, added to the link budget: roof -1, roof_with_splitter -9, "
            "dashboard -9, handheld "
            "-3 dB; nominal and drone 0"},
           o.installation, kInstallations);
  v.number({"installation_db", "dB", "measured level of the installation, instead of that of its kind"},
           o.installation_db, {-30, 30});
  v.number(
      {"installation_sigma_db", "dB",
       "standard deviation between installations of that kind, random by the seed; recorded: 4 on a roof"},
      o.installation_sigma_db, {0, 20});
  gnss::visit_group_values(
      v, {"offset_db", "dB", "offset of the C/N0 of groups of signals: [BeiDou=1.5, BeiDou-GEO=-3]"},
      o.offset_db, {-30, 30});
  v.number({"satellite_sigma_db", "dB", "standard deviation of constant offsets of the satellites' power"},
           o.satellite_sigma_db, {0, 10});
  v.part("strength", o.strength);
  v.part("shadowing", o.shadowing);
  // Within half to 1000 times the chip rates of all open signals.
  v.number({"front_end_bandwidth_hz", "Hz", "two-sided bandwidth of an ideal filter; none: no filter"},
           o.front_end_bandwidth_hz, options::or_none({1.023e6, 511e6}));
  v.number({"wide_front_end_bandwidth_hz", "Hz", "two-sided bandwidth for signals of 10.23 Mchip/s"},
           o.wide_front_end_bandwidth_hz, options::or_none({10.23e6, 511e6}));
  v.number({"front_end_compression_dbm", "dBm",
            "power of interference that reduces the gain of the stages before the filter by 1 dB; none: they "
            "are linear"},
           o.front_end_compression_dbm, options::or_none({-80, 20}));
  v.part("dll", o.dll);
  v.part("pll", o.pll);
  v.part("fll", o.fll);
  v.part("lock", o.lock);
  v.number({"phase_threshold_dbhz", "dB-Hz", "lowest C/N0 at which the carrier phase is tracked"},
           o.phase_threshold_dbhz, {0, 100});
  v.number({"cn0_sigma_db", "dB", "standard deviation of the receiver's C/N0 estimate"}, o.cn0_sigma_db,
           {0, 10});
  v.number(
      {"cn0_averaging_s", "s", "time constant of the mean C/N0 that the receiver reports; 0: no averaging"},
      o.cn0_averaging_s, {0, 100});
  v.number({"cn0_step_db", "dB", "step of the reported C/N0; 0: not rounded"}, o.cn0_step_db, {0, 10});
  v.boolean({"loop_noise", "", "thermal noise of code, phase and Doppler from C/N0"}, o.loop_noise);
}

}  // namespace canyon::tracking
