#include "canyon/base/distributions.hpp"

#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>

namespace canyon {

double normal_probability(double x) {
  return boost::math::erfc(-x / boost::math::constants::root_two<double>()) / 2;
}

double normal_quantile(double p) {
  return -boost::math::erfc_inv(2 * p) * boost::math::constants::root_two<double>();
}

double gamma_quantile(double shape, double p) {
  return boost::math::gamma_p_inv(shape, p);
}

double gamma_quantile_above(double shape, double probability) {
  return boost::math::gamma_q_inv(shape, probability);
}

double chi_square_quantile(double probability, int degrees) {
  return 2 * gamma_quantile_above(degrees / 2.0, probability);
}

}  // namespace canyon
