#include "canyon/calibration/simulated_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <unsupported/Eigen/NonLinearOptimization>

#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/calibration/parameters.hpp"
#include "canyon/options/visitor.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Verdict = Estimate::Verdict;

/// Beyond this many deviations a moment counts by its distance, not by its square: models are wrong
/// somewhere.
constexpr double kHuber = 2;
/// Steps of derivatives, of the priors' deviations: wide, for simulated moments are rough.
constexpr double kStep = 0.5;
/// Less of the prior's deviation must be left where a parameter counts as identified.
constexpr double kIdentified = 0.6;

double huber(double r) {
  return std::abs(r) <= kHuber ? r : std::copysign(std::sqrt(2 * kHuber * std::abs(r) - kHuber * kHuber), r);
}

/// Simulated moments of all drives under one set of parameters.
class Simulator {
 public:
  Simulator(std::span<const FitDrive> drives, const Values& values, double step_db,
            const CalibrateOptions& options)
      : drives_(drives), values_(values), step_db_(step_db), options_(options), cities_(drives.size()) {}

  /// @param strong_share of facades that reflect nearly everything; below 0: as the scenario has them
  [[nodiscard]] std::vector<Moments> run(const Values& changed, double strong_share) {
    std::vector<Moments> result;
    for (std::size_t d = 0; d < drives_.size(); ++d) {
      const Drive& drive = *drives_[d].drive;
      simulation::ReceiverConfig receiver = drive.receiver;
      set_values(values_, receiver);
      set_values(changed, receiver);
      validation::CompareOptions compare;
      compare.threads = options_.threads;
      compare.leave_out = drives_[d].leave_out;
      compare.position_filter = !drive.recording.own_fixes.empty();
      compare.progress = [this](std::size_t, std::size_t) { report_progress(); };
      const validation::Comparison comparison = validation::compare(
          drive.recording, receiver, environment(d, strong_share), drive.registration, drive.seed, compare);
      FixErrors fixes;
      if (compare.position_filter) {
        for (const validation::ComparedEpoch& epoch : comparison.epochs) {
          fixes.emplace_back(epoch.simulated.error_enu_m.head<2>());
        }
      }
      result.push_back(moments(observed(comparison, Side::Simulated), fixes, step_db_));
    }
    ++done_;
    return result;
  }
  void expect(std::size_t runs) { expected_ = std::max(expected_, done_ + runs); }

 private:
  void report_progress() const {
    if (options_.progress) options_.progress("simulating receivers", done_, std::max(expected_, done_ + 1));
  }
  const simulation::Environment& environment(std::size_t d, double strong_share) {
    const Drive& drive = *drives_[d].drive;
    if (strong_share < 0) return *drive.environment;
    auto& known = cities_[d];
    const auto found = known.find(strong_share);
    if (found != known.end()) return found->second;
    // Two are enough: that of the parameters, and that of a step from them.
    if (known.size() > 1) known.erase(known.begin());
    return known.emplace(strong_share, with_facades(drive, facade_shares_of(strong_share))).first->second;
  }

  std::span<const FitDrive> drives_;
  const Values& values_;
  double step_db_;
  const CalibrateOptions& options_;
  std::vector<std::map<double, simulation::Environment>> cities_;
  std::size_t done_ = 0, expected_ = 0;
};

/// One moment of one drive that counts.
struct Row {
  std::size_t drive = 0;
  Moment moment = Moment::Weakest;
  double recorded = 0, sigma = 1;
};

/// Least squares in the priors' deviations, for Eigen's Levenberg-Marquardt.
class Problem {
 public:
  using Scalar = double;
  using InputType = VectorXd;
  using ValueType = VectorXd;
  using JacobianType = MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  /// @param profile all values before the fit
  Problem(Simulator& simulator, const Values& profile, std::vector<Parameter> parameters,
          std::vector<Row> rows)
      : simulator_(simulator),
        profile_(profile),
        parameters_(std::move(parameters)),
        rows_(std::move(rows)) {}

  [[nodiscard]] int inputs() const { return static_cast<int>(parameters_.size()); }
  [[nodiscard]] int values() const { return static_cast<int>(rows_.size() + parameters_.size()); }

  int operator()(const VectorXd& x, VectorXd& residuals) const {
    residuals = at(x);
    return 0;
  }
  int df(const VectorXd& x, MatrixXd& jacobian) const {
    const VectorXd here = at(x);
    jacobian.resize(values(), inputs());
    for (int i = 0; i < inputs(); ++i) {
      VectorXd beside = x;
      // Inwards where the range ends.
      beside[i] += parameters_[static_cast<std::size_t>(i)].within(x[i] + kStep) ? kStep : -kStep;
      jacobian.col(i) = (at(beside) - here) / (beside[i] - x[i]);
    }
    return 0;
  }
  /// Weighted moments without Huber's function, and how far the profile has them.
  [[nodiscard]] VectorXd plain(const VectorXd& x) const {
    VectorXd r(rows_.size());
    const std::vector<Moments> simulated = simulate(x);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const auto& value = simulated[rows_[k].drive].at(static_cast<std::size_t>(rows_[k].moment));
      // What a simulated receiver has too few of weighs as one that is quite wrong.
      r[static_cast<Eigen::Index>(k)] = value ? (*value - rows_[k].recorded) / rows_[k].sigma : 2 * kHuber;
    }
    return r;
  }
  [[nodiscard]] const std::vector<Parameter>& parameters() const { return parameters_; }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }

 private:
  [[nodiscard]] VectorXd at(const VectorXd& x) const {
    if (known_x_.size() == x.size() && known_x_ == x) return known_;
    VectorXd result(values());
    result.head(static_cast<Eigen::Index>(rows_.size())) = plain(x).unaryExpr(&huber);
    result.tail(inputs()) = x;
    known_x_ = x;
    known_ = result;
    return result;
  }
  [[nodiscard]] std::vector<Moments> simulate(const VectorXd& x) const {
    Values changed;
    double strong_share = -1;
    for (const char* key : {kTrackingKey, kAcquisitionKey}) changed[key] = profile_.at(key);
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      const Parameter& p = parameters_[i];
      const double value = p.value(x[static_cast<Eigen::Index>(i)]);
      if (p.key == kFacadesKey) {
        strong_share = value;
      } else {
        changed[p.key] = options::show(value);
      }
    }
    keep_thresholds_in_order(changed);
    return simulator_.run(changed, strong_share);
  }

  Simulator& simulator_;
  const Values& profile_;
  std::vector<Parameter> parameters_;
  std::vector<Row> rows_;
  mutable VectorXd known_x_, known_;
};

std::vector<Row> rows_of(std::span<const FitDrive> drives, bool environment) {
  std::vector<Row> rows;
  const std::size_t end = environment ? kMoments : static_cast<std::size_t>(Moment::NlosLow);
  for (std::size_t d = 0; d < drives.size(); ++d) {
    for (std::size_t k = 0; k < end; ++k) {
      const auto& recorded = drives[d].recorded.at(k);
      if (!recorded) continue;
      std::vector<double> drawn;
      for (const Moments& m : drives[d].resampled) {
        if (m.at(k)) drawn.push_back(*m.at(k));
      }
      const auto low = quantile(drawn, 0.16), high = quantile(drawn, 0.84);
      const auto moment = static_cast<Moment>(k);
      // Of a drawn block of a recording and of another simulated one; never below what a model can be right
      // to.
      const double sigma = low && 2 * drawn.size() > drives[d].resampled.size() ? 0.5 * (*high - *low) : 0;
      const double both = std::max(std::sqrt(2.0) * sigma, least_deviation(moment));
      rows.push_back({d, moment, *recorded, both});
    }
  }
  return rows;
}

std::string rounded_value(const Parameter& p, double x, double sigma) {
  const double value = p.value(x);
  return rounded(value, 0.5 * (p.value(x + sigma) - p.value(x - sigma)));
}

struct Solution {
  VectorXd x, sigma;
  MatrixXd jacobian, correlation;
  double misfit = 1;  ///< square of the moments' robust deviation; at least 1
};

/// A threshold that nothing simulated comes near shows in no moment: it is looked for from where the
/// recording ends.
double start_of(const Problem& problem, const Parameter& p) {
  if (p.key != kTrackingKey && p.key != kAcquisitionKey) return 0;
  constexpr double kBelow_db = 1;
  std::vector<double> recorded;
  for (const Row& row : problem.rows()) {
    if (row.moment == p.moments.front()) recorded.push_back(row.recorded - kBelow_db);
  }
  return recorded.empty() ? 0 : (std::clamp(*median(recorded), p.low, p.high) - p.centre) / p.deviation;
}

Solution solve(const Problem& problem, int iterations) {
  Solution s;
  s.x = VectorXd::Zero(problem.inputs());
  for (Eigen::Index i = 0; i < s.x.size(); ++i)
    s.x[i] = start_of(problem, problem.parameters()[static_cast<std::size_t>(i)]);
  // Its derivatives need Problem::df(), which is const as all of it.
  Problem work = problem;
  Eigen::LevenbergMarquardt<Problem> optimiser(work);
  optimiser.parameters.maxfev = iterations;
  optimiser.parameters.ftol = 1e-3;
  optimiser.parameters.xtol = 1e-2;
  optimiser.parameters.factor = 3;  // first step: so many of the priors' deviations
  optimiser.minimize(s.x);
  work.df(s.x, s.jacobian);
  const auto rows = static_cast<Eigen::Index>(problem.rows().size());
  // By the median: moments that no value reproduces stand out, and count little by Huber's function.
  const VectorXd residuals = problem.plain(s.x).cwiseAbs();
  const double middle =
      *median(std::span<const double>(residuals.data(), static_cast<std::size_t>(residuals.size())));
  s.misfit = std::max(1.0, std::pow(kMadToSigma * middle, 2));
  const MatrixXd data = s.jacobian.topRows(rows);
  const MatrixXd covariance =
      (data.transpose() * data / s.misfit + MatrixXd::Identity(problem.inputs(), problem.inputs())).inverse();
  s.sigma = covariance.diagonal().cwiseSqrt();
  s.correlation = s.sigma.cwiseInverse().asDiagonal() * covariance * s.sigma.cwiseInverse().asDiagonal();
  return s;
}

/// The moment that says most about a parameter.
std::string_view strongest_of(const Problem& problem, const Solution& s, Eigen::Index i) {
  Eigen::Index row = 0;
  s.jacobian.col(i).head(static_cast<Eigen::Index>(problem.rows().size())).cwiseAbs().maxCoeff(&row);
  return name(problem.rows()[static_cast<std::size_t>(row)].moment);
}

Estimate conclude(const Problem& problem, const Solution& s, Eigen::Index i) {
  const Parameter& p = problem.parameters()[static_cast<std::size_t>(i)];
  Estimate e{p.key, p.unit, p.before, p.before, {}, {}, {}, {}};
  if (s.sigma[i] > kIdentified) {
    e.basis =
        fmt::format("{:.0f} % of what was open is open still (range {} to {}: {})", 100 * s.sigma[i],
                    rounded(p.value(-2), 0.2 * p.value(-2)), rounded(p.value(2), 0.2 * p.value(2)), p.source);
    Eigen::Index other = 0;
    VectorXd c = s.correlation.col(i).cwiseAbs();
    c[i] = 0;
    if (c.size() > 1 && c.maxCoeff(&other) > 0.8) {
      e.basis += fmt::format("; cannot be distinguished from {}",
                             problem.parameters()[static_cast<std::size_t>(other)].key);
    }
    return e;
  }
  const double deviation = 0.5 * (p.value(s.x[i] + s.sigma[i]) - p.value(s.x[i] - s.sigma[i]));
  e.recorded = rounded_value(p, s.x[i], s.sigma[i]);
  e.interval = fmt::format("{} to {}", rounded(p.value(s.x[i] - 2 * s.sigma[i]), deviation),
                           rounded(p.value(s.x[i] + 2 * s.sigma[i]), deviation));
  e.verdict = std::abs(s.x[i]) > 2 * s.sigma[i] ? Verdict::Fitted : Verdict::Agrees;
  e.basis = fmt::format("by simulation, most by {}", strongest_of(problem, s, i));
  if (e.verdict == Verdict::Fitted) e.after = e.recorded;
  return e;
}

/// Moments that the fitted receiver has otherwise than the recorded one.
void add_misfits(const Problem& problem, const VectorXd& residuals, std::span<const FitDrive> drives,
                 SimulatedFit& fit) {
  constexpr double kFar = 3;
  std::vector<std::string> far;
  for (std::size_t k = 0; k < problem.rows().size(); ++k) {
    const double r = residuals[static_cast<Eigen::Index>(k)];
    if (std::abs(r) < kFar) continue;
    const Row& row = problem.rows()[k];
    far.push_back(
        fmt::format("{}: {} ({:+.1f} deviations)", drives[row.drive].drive->name, name(row.moment), r));
  }
  if (!far.empty()) {
    fit.notes.push_back(fmt::format("What no value of these keys brings about (simulated less recorded): {}",
                                    fmt::join(far, "; ")));
  }
}

}  // namespace

FixErrors own_fixes_of(const validation::Recording& recording) {
  FixErrors errors;
  for (const validation::Recording::OwnFix& fix : recording.own_fixes)
    errors.emplace_back(fix.error_enu_m.head<2>());
  return errors;
}

SimulatedFit fit_by_simulation(std::span<const FitDrive> drives, const Values& base, const Values& values,
                               double step_db, const CalibrateOptions& options) {
  SimulatedFit fit;
  Values whole = base;
  for (const auto& [key, value] : values) whole[key] = value;
  const auto recorded = [&](Moment moment) {
    return std::any_of(drives.begin(), drives.end(), [moment](const FitDrive& d) {
      return d.recorded.at(static_cast<std::size_t>(moment)).has_value();
    });
  };
  std::vector<Parameter> parameters;
  for (Parameter& p : parameters_of(whole, options.environment)) {
    if (!p.missing.empty()) {
      fit.estimates.push_back({p.key, p.unit, p.before, p.before, {}, {}, Verdict::Unidentified, p.missing});
    } else if (!std::any_of(p.moments.begin(), p.moments.end(), recorded)) {
      fit.estimates.push_back({p.key,
                               p.unit,
                               p.before,
                               p.before,
                               {},
                               {},
                               Verdict::Unidentified,
                               fmt::format("too few observations of: {}", name(p.moments.front()))});
    } else {
      parameters.push_back(std::move(p));
    }
  }
  const std::vector<Row> rows = rows_of(drives, options.environment);
  if (parameters.empty() || rows.empty()) return fit;

  Simulator simulator(drives, values, step_db, options);
  const Problem problem(simulator, whole, parameters, rows);
  const auto n = static_cast<std::size_t>(problem.inputs());
  simulator.expect(static_cast<std::size_t>(options.iterations) * (n + 1) + n + 2);
  const Solution solution = solve(problem, options.iterations);
  for (std::size_t i = 0; i < n; ++i) {
    Estimate e = conclude(problem, solution, static_cast<Eigen::Index>(i));
    const Parameter& p = problem.parameters()[i];
    if (p.key == kFacadesKey) {
      if (e.verdict != Verdict::Unidentified) {
        fit.facade_shares = facade_shares_of(p.value(solution.x[static_cast<Eigen::Index>(i)]));
        // The scenario has no such number that it could agree with.
        e.verdict = Verdict::Fitted;
        e.after = e.recorded;
      }
      fit.environment.push_back(std::move(e));
      continue;
    }
    if (e.verdict == Verdict::Fitted) (p.environment ? fit.surroundings : fit.values)[e.key] = e.after;
    (p.environment ? fit.environment : fit.estimates).push_back(std::move(e));
  }
  Values all = whole;
  for (const auto& [key, value] : fit.values) all[key] = value;
  keep_thresholds_in_order(all);
  for (Estimate& e : fit.estimates) {
    if (all[e.key] == e.after) continue;
    e.after = fit.values[e.key] = all[e.key];
    e.verdict = Verdict::Fitted;
    e.basis += ", and the tracking threshold";
  }
  add_misfits(problem, problem.plain(solution.x), drives, fit);
  return fit;
}

}  // namespace canyon::calibration
