#include "canyon/receiver/rtk/rtk_filter.hpp"

#include <Eigen/LU>
#include <string_view>
#include <utility>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "canyon/receiver/rtk/baseline_filter.hpp"

namespace canyon::rtk {

namespace {

constexpr std::string_view kIntegers[]{"continuous", "instantaneous", "hold"};

}  // namespace

void visit(options::Visitor& v, RtkOptions& o) {
  v.boolean({"enabled", "",
             "RTK: float and fixed solutions by carrier phases relative to the base of `corrections`"},
            o.enabled);
  v.choice({"integers", "",
            "integer ambiguities: continuous (searched at each epoch), instantaneous (reset after each "
            "epoch) or hold (kept once fixed)"},
           o.integers, kIntegers);
  v.number({"ratio", "",
            "ratio test: the second best integers must be this many times farther away than the best"},
           o.ratio, {1.1, 10});
  v.number({"min_success", "", "smallest probability of correct integers, by the filter's covariance"},
           o.min_success, {0, 1, false, true});
  v.boolean({"fix_glonass", "",
             "fix GLONASS integers also without known biases: base and rover must be of one make"},
            o.fix_glonass);
  v.number({"ionosphere_gradient", "",
            "difference of vertical ionospheric delays over distance; 0: not estimated"},
           o.ionosphere_gradient, {0, 1e-3});
  v.number({"troposphere_gradient", "",
            "difference of zenith tropospheric delays over distance; 0: not estimated"},
           o.troposphere_gradient, {0, 1e-3});
}

namespace {

/// The second filter restarts after kSecondFor_s. It replaces the first one once kSecondFixed successive
/// epochs are fixed, kSecondLeast_s after its start, at most kSecondApart standard deviations away [s, s, 1].
constexpr double kSecondFor_s = 10, kSecondLeast_s = 2, kSecondApart = 5;
constexpr int kSecondFixed = 3;

}  // namespace

RtkFilter::RtkFilter(const RtkOptions& options, const positioning::FixOptions& fix, double max_age_s)
    : filter_(std::make_unique<BaselineFilter>(options, fix, max_age_s)) {}
RtkFilter::~RtkFilter() = default;
RtkFilter::RtkFilter(RtkFilter&&) noexcept = default;
RtkFilter& RtkFilter::operator=(RtkFilter&&) noexcept = default;

void RtkFilter::take(const Corrections& base, const orbit::Sky& sky) {
  positioning::FixOptions masks = filter_->masks();
  masks.elevation_mask_rad = 0;  // the rover's mask is used
  auto base_measurements =
      observed_minus_computed(base.receiver_time, base.observations, sky, masks, base.station_ecef);
  if (second_) second_->take(base, base_measurements);
  filter_->take(base, std::move(base_measurements));
}

std::optional<positioning::Fix> RtkFilter::update(geodesy::GpsTime receiver_time,
                                                  std::span<const SignalMeasurement> rover,
                                                  const orbit::Sky& sky, const positioning::Fix& alone) {
  std::optional<positioning::Fix> fix = filter_->update(receiver_time, rover, sky, alone);
  if (fix && !positioning::is_sound(*fix)) {
    *filter_ = BaselineFilter(filter_->options(), filter_->masks(), filter_->max_age_s());
    fix.reset();
  }
  if (!fix || fix->kind() == positioning::FixKind::Fixed ||
      filter_->options().integers == Integers::Instantaneous) {
    second_.reset();
    return fix;
  }
  // While float, past echoes may bias it: a second filter without them runs in parallel.
  if (!second_ || receiver_time - second_began_ > kSecondFor_s) {
    second_ = std::make_unique<BaselineFilter>(*filter_);
    second_->restart();
    second_began_ = receiver_time;
  }
  std::optional<positioning::Fix> other = second_->update(receiver_time, rover, sky, alone);
  const bool proven = other && other->kind() == positioning::FixKind::Fixed &&
                      second_->consecutive_fixed_epochs() >= kSecondFixed &&
                      receiver_time - second_began_ >= kSecondLeast_s;
  if (!proven) return fix;
  const Eigen::Vector3d apart_enu =
      geodesy::enu_from_ecef_rotation(fix->position) * (other->position_ecef - fix->position_ecef);
  const Eigen::Matrix3d information = fix->covariance_enu.inverse();
  if (!(apart_enu.dot(information * apart_enu) < kSecondApart * kSecondApart)) return fix;
  filter_ = std::move(second_);
  return other;
}

}  // namespace canyon::rtk
