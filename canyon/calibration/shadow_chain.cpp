#include "canyon/calibration/shadow_chain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "canyon/base/statistics.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::calibration {
namespace {

/// Of an item in whatever state: what neither level explains (a channel that the receiver used otherwise, an
/// edge that the map has elsewhere). As a density [1/dB] for levels, as a probability for signals not
/// tracked.
constexpr double kStray = 1e-4, kStrayLoss = 0.01;
constexpr double kLeastSigma_db = 0.2;

double normal_density(double x, double mean, double sigma) {
  const double z = (x - mean) / sigma;
  return std::exp(-0.5 * z * z) / (sigma * std::sqrt(2 * geodesy::kPi));
}
double normal_below(double x, double mean, double sigma) {
  return 0.5 * std::erfc(-(x - mean) / (sigma * std::sqrt(2.0)));
}

/// How likely an item is in each state, and the share of that which the state itself explains.
struct Emission {
  std::array<double, 2> likelihood{}, explained{};
};

Emission emission(const LevelItem& item, double constant_db, const ShadowFit& f) {
  Emission e;
  const std::array<double, 2> mean{constant_db, constant_db - f.depth_db};
  const std::array<double, 2> sigma{f.clear_sigma_db, f.shadowed_sigma_db};
  for (std::size_t s = 0; s < 2; ++s) {
    const double own = item.tracked ? normal_density(item.level_db, mean[s], sigma[s])
                                    : normal_below(item.level_db, mean[s], sigma[s]);
    e.likelihood[s] = own + (item.tracked ? kStray : kStrayLoss);
    e.explained[s] = own / e.likelihood[s];
  }
  return e;
}

/// Probability of state `to` a way behind state `from`.
double step(std::size_t from, std::size_t to, double way_m, double share, double length_m) {
  const double kept = std::exp(-way_m / length_m);
  const double stationary = to == 1 ? share : 1 - share;
  return (from == to ? kept : 0) + (1 - kept) * stationary;
}

struct Pair {
  double way_m = 0;
  std::array<std::array<double, 2>, 2> weight{};  ///< from, to
};

/// Sums of one round.
struct Sums {
  explicit Sums(std::size_t satellites) : constant(satellites, 0), precision(satellites, 0) {}
  std::vector<double> constant, precision;
  double clear = 0, clear_square = 0;
  double shadowed = 0, shadowed_sum = 0, shadowed_square = 0;
  std::array<double, 2> state{};
  std::vector<Pair> pairs;
};

void add_item(const LevelItem& item, std::size_t satellite, const std::array<double, 2>& weight,
              const ShadowFit& f, Sums& sums) {
  const double c = f.satellite_db[satellite];
  const double v1 = f.clear_sigma_db * f.clear_sigma_db, v2 = f.shadowed_sigma_db * f.shadowed_sigma_db;
  sums.state[0] += weight[0];
  sums.state[1] += weight[1];
  const Emission e = emission(item, c, f);
  const double in_shadow = weight[1] * e.explained[1];
  if (!item.tracked) {
    // What is known of a shadowed level is that it lies below: mean and variance of a cut normal.
    const double mean = c - f.depth_db;
    const double b = (item.level_db - mean) / f.shadowed_sigma_db;
    const double below = std::max(normal_below(b, 0, 1), 1e-12);
    const double ratio = normal_density(b, 0, 1) / below;
    const double x = -f.depth_db - f.shadowed_sigma_db * ratio;
    sums.shadowed += in_shadow;
    sums.shadowed_sum += in_shadow * x;
    sums.shadowed_square += in_shadow * (x * x + v2 * std::max(0.0, 1 - b * ratio - ratio * ratio));
    return;
  }
  const double in_clear = weight[0] * e.explained[0];
  const double x = item.level_db - c;
  sums.constant[satellite] += in_clear * item.level_db / v1 + in_shadow * (item.level_db + f.depth_db) / v2;
  sums.precision[satellite] += in_clear / v1 + in_shadow / v2;
  sums.clear += in_clear;
  sums.clear_square += in_clear * x * x;
  sums.shadowed += in_shadow;
  sums.shadowed_sum += in_shadow * x;
  sums.shadowed_square += in_shadow * x * x;
}

/// Forward and backward over one chain.
void add_chain(const LevelChain& chain, std::span<const std::uint16_t> weights, const ShadowFit& f,
               Sums& sums) {
  const std::size_t n = chain.items.size();
  const double share = f.shadowed_share;
  std::vector<std::array<double, 2>> likelihood(n), forward(n), backward(n);
  for (std::size_t t = 0; t < n; ++t) {
    likelihood[t] = emission(chain.items[t], f.satellite_db[chain.satellite], f).likelihood;
  }
  const auto normalise = [](std::array<double, 2>& p) {
    const double sum = p[0] + p[1];
    p = {p[0] / sum, p[1] / sum};
  };
  for (std::size_t t = 0; t < n; ++t) {
    std::array<double, 2> before{1 - share, share};
    if (t > 0) {
      const double way = chain.items[t].way_m;
      for (std::size_t s = 0; s < 2; ++s) {
        before[s] = forward[t - 1][0] * step(0, s, way, share, f.length_m) +
                    forward[t - 1][1] * step(1, s, way, share, f.length_m);
      }
    }
    forward[t] = {before[0] * likelihood[t][0], before[1] * likelihood[t][1]};
    normalise(forward[t]);
  }
  backward[n - 1] = {0.5, 0.5};
  for (std::size_t t = n - 1; t-- > 0;) {
    const double way = chain.items[t + 1].way_m;
    for (std::size_t s = 0; s < 2; ++s) {
      backward[t][s] = step(s, 0, way, share, f.length_m) * likelihood[t + 1][0] * backward[t + 1][0] +
                       step(s, 1, way, share, f.length_m) * likelihood[t + 1][1] * backward[t + 1][1];
    }
    normalise(backward[t]);
  }
  for (std::size_t t = 0; t < n; ++t) {
    const double times = weights[chain.items[t].epoch];
    if (times == 0) continue;
    std::array<double, 2> state{forward[t][0] * backward[t][0], forward[t][1] * backward[t][1]};
    normalise(state);
    add_item(chain.items[t], chain.satellite, {times * state[0], times * state[1]}, f, sums);
    if (t == 0 || !(chain.items[t].way_m > 0)) continue;
    Pair pair{chain.items[t].way_m, {}};
    double sum = 0;
    for (std::size_t a = 0; a < 2; ++a) {
      for (std::size_t b = 0; b < 2; ++b) {
        pair.weight[a][b] =
            forward[t - 1][a] * step(a, b, pair.way_m, share, f.length_m) * likelihood[t][b] * backward[t][b];
        sum += pair.weight[a][b];
      }
    }
    for (auto& row : pair.weight) {
      for (double& w : row) w *= times / sum;
    }
    sums.pairs.push_back(pair);
  }
}

/// The length that the expected steps are likeliest under, of a grid by tenths of octaves.
double best_length(const std::vector<Pair>& pairs, double share, double before_m) {
  double best_m = before_m, best = -std::numeric_limits<double>::infinity();
  for (int k = -20; k <= 20; ++k) {
    const double length_m = std::clamp(before_m * std::pow(2.0, 0.1 * k), 0.5, 500.0);
    double sum = 0;
    for (const Pair& pair : pairs) {
      for (std::size_t a = 0; a < 2; ++a) {
        for (std::size_t b = 0; b < 2; ++b) {
          if (pair.weight[a][b] > 1e-9) {
            sum += pair.weight[a][b] * std::log(std::max(step(a, b, pair.way_m, share, length_m), 1e-12));
          }
        }
      }
    }
    if (sum > best) {
      best = sum;
      best_m = length_m;
    }
  }
  return best_m;
}

/// Constants of satellites and groups by what was seen of them and by their priors.
void set_constants(std::span<const LevelChain> chains, const Sums& sums, ShadowFit& f) {
  const std::size_t n = f.satellite_db.size();
  std::vector<double> shadows(n, 0), items(n, 0);
  for (const LevelChain& chain : chains) {
    double way_m = 0;
    for (const LevelItem& item : chain.items) way_m += item.way_m;
    shadows[chain.satellite] += 1 + way_m / f.length_m;
    items[chain.satellite] += static_cast<double>(chain.items.size());
  }
  constexpr double kSatellites = kSatellites_db * kSatellites_db;
  std::map<std::size_t, double> weighted, weights;
  for (std::size_t s = 0; s < n; ++s) {
    if (!(sums.precision[s] > 0)) continue;
    f.own_db[s] = sums.constant[s] / sums.precision[s];
    f.own_variance_db2[s] = std::max(1.0, items[s] / shadows[s]) / sums.precision[s];
    const double w = 1 / (kSatellites + f.own_variance_db2[s]);
    weighted[f.group[s]] += w * f.own_db[s];
    weights[f.group[s]] += w;
  }
  for (std::size_t s = 0; s < n; ++s) {
    if (!(sums.precision[s] > 0)) continue;
    const double group_db = weighted[f.group[s]] / (weights[f.group[s]] + 1 / (kGroups_db * kGroups_db));
    const double own = 1 / f.own_variance_db2[s], prior = 1 / kSatellites;
    f.satellite_db[s] = (own * f.own_db[s] + prior * group_db) / (own + prior);
  }
}

}  // namespace

ShadowFit shadow_start(std::span<const LevelChain> chains, std::vector<std::size_t> group) {
  std::vector<std::vector<double>> levels(group.size());
  for (const LevelChain& chain : chains) {
    for (const LevelItem& item : chain.items) {
      if (item.tracked) levels[chain.satellite].push_back(item.level_db);
    }
  }
  ShadowFit start;
  start.group = std::move(group);
  start.own_db.resize(levels.size());
  start.own_variance_db2.resize(levels.size());
  for (const std::vector<double>& of : levels) {
    start.satellite_db.push_back(quantile(of, 0.9).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  return start;
}

ShadowFit fit_shadows(std::span<const LevelChain> chains, std::span<const std::uint16_t> weights, ShadowFit f,
                      int iterations) {
  for (int i = 0; i < iterations; ++i) {
    Sums sums(f.satellite_db.size());
    for (const LevelChain& chain : chains) {
      if (!chain.items.empty() && std::isfinite(f.satellite_db[chain.satellite])) {
        add_chain(chain, weights, f, sums);
      }
    }
    if (!(sums.clear > 1)) break;
    set_constants(chains, sums, f);
    f.clear_sigma_db = std::max(kLeastSigma_db, std::sqrt(sums.clear_square / sums.clear));
    if (sums.shadowed > 1) {
      const double mean = sums.shadowed_sum / sums.shadowed;
      f.depth_db = std::clamp(-mean, 0.5, 30.0);
      f.shadowed_sigma_db = std::max(
          kLeastSigma_db, std::sqrt(std::max(0.0, sums.shadowed_square / sums.shadowed - mean * mean)));
      // A state that is wider than deep would take the clear state's own tails.
      f.shadowed_sigma_db = std::min(f.shadowed_sigma_db, std::max(f.depth_db, 1.0));
    }
    f.shadowed_share = std::clamp(sums.state[1] / (sums.state[0] + sums.state[1]), 1e-4, 0.95);
    if (i % 3 == 2) f.length_m = best_length(sums.pairs, f.shadowed_share, f.length_m);
  }
  return f;
}

}  // namespace canyon::calibration
