#include "canyon/paths/propagation/index/knife_edge.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/edge_reference.hpp"

namespace canyon::propagation {
namespace {

using Complex = std::complex<double>;
using geodesy::kPi;
using geodesy::radians;
using test::exact_knife_edge_loss_db;
using test::ray_around_edge;

// mpmath 1.x, 40 digits: fresnelc(x), fresnels(x); from 50 on by A&S 7.3.27 and 7.3.28. 0.5, 1 and 2 are also
// in A&S table 7.7.
TEST(FresnelIntegral, AgreesWithMpmath) {
  struct Row {
    double x, c, s;
  };
  const std::vector<Row> rows{{0, 0, 0},
                              {0.02, 0.01999999921043166, 4.188790086667243e-6},
                              {0.1, 0.09999753262708507, 0.0005235895476122107},
                              {0.5, 0.4923442258714464, 0.06473243285999928},
                              {1, 0.7798934003768228, 0.4382591473903548},
                              {1.3, 0.6385504547270292, 0.6863332855346501},
                              {1.5999, 0.3655254452014845, 0.6389647188105358},
                              {1.6, 0.3654616834404877, 0.6388876835093808},
                              {1.6001, 0.3653979604097101, 0.6388106161678025},
                              {2, 0.4882534060753408, 0.3434156783636982},
                              {2.5, 0.457413009641777, 0.6191817558195929},
                              {3.25, 0.4263386555980208, 0.5642211995671413},
                              {5, 0.5636311887040122, 0.4991913819171169},
                              {7.7, 0.4627820968226325, 0.4820141680759849},
                              {10, 0.4998986942055157, 0.4681699785848822},
                              {12.3, 0.4767364329921508, 0.4886639231669361},
                              {100.25, 0.4996888798844151, 0.5031598815391497},
                              {12345.678, 0.500023334695318, 0.5000109663298014},
                              {4000000.5, 0.5000000304529761, 0.499999926480012}};
  for (const Row& row : rows) {
    const Complex f = fresnel_integral(row.x);
    EXPECT_NEAR(f.real(), row.c, 1e-14) << row.x;
    EXPECT_NEAR(f.imag(), row.s, 1e-14) << row.x;
    EXPECT_EQ(fresnel_integral(-row.x), -f);
  }
  EXPECT_EQ(fresnel_integral(INFINITY), Complex(0.5, 0.5));
  EXPECT_THROW(static_cast<void>(fresnel_integral(NAN)), InputError);
}

// C' + j S' = exp(j pi x^2 / 2), by central differences: detects a wrong piece between the table's rows.
TEST(FresnelIntegral, HasItsDerivativeEverywhere) {
  for (double x = 0.01; x < 8; x += 0.0137) {
    const double h = 1e-4;
    const Complex slope = (fresnel_integral(x + h) - fresnel_integral(x - h)) / (2 * h);
    // Third derivative below (pi x)^2 + pi
    EXPECT_LT(std::abs(slope - std::polar(1.0, kPi / 2 * x * x)),
              h * h / 6 * (kPi * kPi * x * x + kPi) * 1.1 + 1e-9)
        << x;
  }
}

// mpmath: -20 log10(sqrt((1 - C - S)^2 + (C - S)^2) / 2), P.526-15's J.
TEST(KnifeEdge, ExactLossAgreesWithMpmath) {
  struct Row {
    double nu, loss_db;
  };
  for (const Row& row : std::vector<Row>{{-5, -0.27287359185},
                                         {-3, -0.443943288818},
                                         {-1.217, -1.36860918264},
                                         {-1, -1.00104603792},
                                         {-0.78, -0.0111379450764},
                                         {0, 6.02059991328},
                                         {0.5, 10.2338304663},
                                         {1, 13.8641054136},
                                         {2, 19.0909623787},
                                         {3, 22.5218130875},
                                         {10, 32.9535173481},
                                         {50, 46.9326978493}})
    EXPECT_NEAR(exact_knife_edge_loss_db(row.nu), row.loss_db, 1e-9) << row.nu;
  EXPECT_NEAR(exact_knife_edge_loss_db(-1e6), 0, 1e-5);
}

TEST(KnifeEdge, ApproximationIsThatOfP526) {
  EXPECT_NEAR(approximate_knife_edge_loss_db(0), 6.03, 0.005);  // 6.9 + 20 log10(sqrt(1.01) - 0.1)
  EXPECT_NEAR(approximate_knife_edge_loss_db(-0.78), 0, 0.005);
  EXPECT_NEAR(approximate_knife_edge_loss_db(1), 13.93, 0.005);  // 6.9 + 20 log10(sqrt(1.81) + 0.9)
  EXPECT_NEAR(approximate_knife_edge_loss_db(2.4), 20.54, 0.005);
  double worst = 0, worst_below = 0;
  for (double nu = -0.779; nu < 100; nu += 0.003)
    worst = std::max(worst, std::abs(approximate_knife_edge_loss_db(nu) - exact_knife_edge_loss_db(nu)));
  for (double nu = -20; nu < -0.78; nu += 0.003)
    worst_below =
        std::max(worst_below, std::abs(approximate_knife_edge_loss_db(nu) - exact_knife_edge_loss_db(nu)));
  EXPECT_LT(worst, 0.124);
  EXPECT_GT(worst, 0.12);  // the bound is tight
  EXPECT_LT(worst_below, 1.37);
}

TEST(KnifeEdge, FieldHasThePhaseOfTheDetour) {
  // Far in the shadow: exp(-j pi nu^2 / 2) exp(-j pi / 4) / (sqrt(2) pi nu) (the first term of A&S 7.3.27).
  for (const double nu : {20.0, 33.3, 57.1}) {
    const Complex far = std::polar(1 / (std::sqrt(2.0) * kPi * nu), -kPi / 2 * nu * nu - kPi / 4);
    EXPECT_LT(std::abs(knife_edge_field(nu) / far - 1.0), 2 / (kPi * nu * nu)) << nu;
  }
  // Unobstructed field of both halves (Babinet): field(nu) + field(-nu) = 1.
  for (const double nu : {0.0, 0.3, 1.59, 1.61, 4.0, 1000.5}) {
    EXPECT_LT(std::abs(knife_edge_field(nu) + knife_edge_field(-nu) - 1.0), 1e-13) << nu;
    EXPECT_LT(std::abs(edge_wave(-nu - 1e-300) + edge_wave(nu)), nu == 0 ? 1.1 : 1e-13) << nu;
  }
  EXPECT_LT(std::abs(1.0 + edge_wave(-0.7) - knife_edge_field(-0.7)), 1e-15);
  // Digits are kept deep in the shadow, where 1/2 - C cancels: 0.2250791 / nu.
  EXPECT_NEAR(std::abs(knife_edge_field(1e6)) * 1e6, 1 / (std::sqrt(2.0) * kPi), 1e-12);
}

// The diffraction angle's form of P.526-15, 4.1, satellite infinitely far: nu = theta sqrt(2 d / lambda).
TEST(KnifeEdge, NuIsThatOfTheSmallAngle) {
  const double d = 40, lambda = 0.19;
  for (const double theta : {0.002, 0.02, 0.1}) {
    const double nu = signed_knife_edge_nu(d * (1 - std::cos(theta)), lambda, true);
    EXPECT_NEAR(nu, theta * std::sqrt(2 * d / lambda), nu * theta * theta / 20);
  }
  EXPECT_EQ(signed_knife_edge_nu(0.19, 0.19, false), -2);
  EXPECT_THROW(static_cast<void>(signed_knife_edge_nu(-1, 0.19, true)), InputError);
  EXPECT_THROW(static_cast<void>(signed_knife_edge_nu(1, 0, true)), InputError);
}

/// T(m, n) as in P.526-15, 4.2, of two distances and the height over the straight line.
double rounded_by_the_recommendation(double radius, double d1, double d2, double h, double wavelength) {
  const double m = radius * (d1 + d2) / (d1 * d2) / std::cbrt(kPi * radius / wavelength);
  const double n = h * std::pow(kPi * radius / wavelength, 2.0 / 3) / radius;
  if (m * n <= 4) return 7.2 * std::sqrt(m) - (2 - 12.5 * n) * m + 3.6 * std::pow(m, 1.5) - 0.8 * m * m;
  return -6 - 20 * std::log10(m * n) + 7.2 * std::sqrt(m) - (2 - 17 * n) * m + 3.6 * std::pow(m, 1.5) -
         0.8 * m * m;
}

TEST(RoundedEdge, LosesWhatTheRecommendationSays) {
  constexpr double kWavelength = 0.1903, kFar = 1e9;
  for (const double radius : {0.1, 1.0, 5.0}) {
    for (const double leg : {10.0, 80.0}) {
      for (const double bending : {0.0, 0.01, 0.1, 0.5, 1.0}) {
        // Small angles: h (d1 + d2) / (d1 d2) is the angle by which the ray bends.
        EXPECT_NEAR(rounded_edge_loss_db(radius, leg, bending, kWavelength),
                    rounded_by_the_recommendation(radius, leg, kFar, bending * leg, kWavelength), 1e-5)
            << radius << " m, " << leg << " m, " << bending;
      }
    }
  }
  EXPECT_EQ(rounded_edge_loss_db(0, 10, 1, kWavelength), 0);
  EXPECT_EQ(rounded_edge_loss_db(0, 0, 0, kWavelength), 0);  // a knife edge needs neither
}

TEST(RoundedEdge, RefusesWhatIsOutside) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)rounded_edge_loss_db(-1, 10, 0.1, 0.19), InputError);
  EXPECT_THROW((void)rounded_edge_loss_db(nan, 10, 0.1, 0.19), InputError);
  EXPECT_THROW((void)rounded_edge_loss_db(1, 0, 0.1, 0.19), InputError);
  EXPECT_THROW((void)rounded_edge_loss_db(1, 10, 4, 0.19), InputError);
  EXPECT_THROW((void)rounded_edge_loss_db(1, 10, 0.1, 0), InputError);
}

TEST(EdgeRay, RoofEdgeAcrossTheRayIsTheTriangle) {
  // Roof edge along north, 20 m east and 15 m above; satellite in the east at 20 degrees: d (1 - cos alpha).
  const Eigen::Vector3d antenna(100, 200, 2), satellite(std::cos(radians(20)), 0, std::sin(radians(20)));
  const auto ray = ray_around_edge(antenna, satellite, {120, 100, 17}, {120, 300, 17});
  ASSERT_TRUE(ray);
  const double alpha = std::atan2(15, 20) - radians(20);
  EXPECT_NEAR(ray->excess_m, 25 * (1 - std::cos(alpha)), 1e-12);
  EXPECT_NEAR(ray->bend_rad, alpha, 1e-13);
  EXPECT_LT((ray->point - Eigen::Vector3d(120, 200, 17)).norm(), 1e-12);
  EXPECT_LT((ray->arrival - Eigen::Vector3d(0.8, 0, 0.6)).norm(), 1e-14);
}

// Fermat: no other point of the edge gives a shorter path, by search; and Keller: equal angles with the edge.
TEST(EdgeRay, IsTheShortestWayOverASkewEdge) {
  const Eigen::Vector3d antenna(1, 2, 1.5), satellite = Eigen::Vector3d(0.5, 0.3, 0.4).normalized();
  const Eigen::Vector3d start(10, -30, 8), end(25, 40, 21);
  const auto ray = ray_around_edge(antenna, satellite, start, end);
  ASSERT_TRUE(ray);
  const auto detour = [&](const Eigen::Vector3d& q) {
    return (q - antenna).norm() - (q - antenna).dot(satellite);
  };
  EXPECT_NEAR(ray->excess_m, detour(ray->point), 1e-12);
  for (double t = 0; t <= 1; t += 0.001) EXPECT_GE(detour(start + t * (end - start)), ray->excess_m - 1e-12);
  const Eigen::Vector3d tangent = (end - start).normalized();
  EXPECT_NEAR(ray->arrival.dot(tangent), satellite.dot(tangent), 1e-14);
}

TEST(EdgeRay, SmallBendsKeepTheirDigits) {
  // A millionth of a radian over 50 m: d alpha^2 / 2 = 2.5e-11 m.
  const double alpha = 1e-6;
  const auto ray = ray_around_edge({0, 0, 0}, {std::cos(alpha), 0, std::sin(alpha)}, {50, -9, 0}, {50, 9, 0});
  ASSERT_TRUE(ray);
  EXPECT_NEAR(ray->excess_m, 2.5e-11, 1e-16);
}

TEST(EdgeRay, NoneBeyondTheEdgesEnds) {
  const Eigen::Vector3d satellite = Eigen::Vector3d(1, 0, 0.2).normalized();
  EXPECT_TRUE(ray_around_edge({0, 0, 0}, satellite, {20, -1, 9}, {20, 1, 9}));
  EXPECT_FALSE(ray_around_edge({0, 0, 0}, satellite, {20, 1, 9}, {20, 5, 9}));
  EXPECT_FALSE(ray_around_edge({0, 0, 0}, satellite, {20, 1, 9}, {20, 1, 9}));
  EXPECT_FALSE(ray_around_edge({0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {5, 0, 0}));
  EXPECT_FALSE(ray_around_edge({0, 0, 0}, {1, 0, 0}, {-1, 2, 0}, {5, 2, 0}));
}

}  // namespace
}  // namespace canyon::propagation
