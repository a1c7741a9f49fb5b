#include "canyon/paths/signal/radio_materials.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::signal {
namespace {

using city::Material;

// a and c f^d of P.2040-3, table 3, at 1.57542 GHz: python3 -c "print(0.0462 * 1.57542**0.7822)" and so on.
TEST(RadioMaterials, AreTheTablesRowsAtL1) {
  struct Row {
    Material material;
    double permittivity, conductivity;
  };
  const std::vector<Row> rows{{Material::Concrete, 5.24, 0.065924281},
                              {Material::Unknown, 5.24, 0.065924281},
                              {Material::Glass, 6.31, 0.0066175187},
                              {Material::Brick, 3.91, 0.025595309},
                              {Material::Stone, 7.074, 0.0083789808},
                              {Material::Wood, 1.99, 0.0076501028},
                              {Material::Plaster, 2.73, 0.013027852},
                              {Material::Ground, 14.333479, 0.073421644},
                              {Material::Metal, 1, 1e7},
                              {Material::Foliage, 1, 0}};
  for (const Row& row : rows) {
    const auto eta = complex_permittivity(radio_material(row.material), 1575.42e6);
    EXPECT_NEAR(eta.real(), row.permittivity, 1e-6);
    // The electric constant of CODATA 2018.
    const double conductivity = -eta.imag() * 2 * geodesy::kPi * 1575.42e6 * 8.8541878128e-12;
    EXPECT_NEAR(conductivity, row.conductivity, 1e-9 + 1e-7 * row.conductivity);
  }
}

TEST(RadioMaterials, ComplexPermittivityIsThatOfP2040) {
  // P.2040-3, 2.1.2: eta'' = 17.98 sigma / f_GHz
  const RadioMaterial concrete = radio_material(Material::Concrete);
  const auto eta = complex_permittivity(concrete, 1.2e9);
  EXPECT_EQ(eta.real(), 5.24);
  EXPECT_NEAR(eta.imag(), -17.98 * 0.0462 * std::pow(1.2, 0.7822) / 1.2, 1e-3 * -eta.imag());
}

TEST(RadioMaterials, RefusesFrequenciesBeyondTheTables) {
  const RadioMaterial glass = radio_material(Material::Glass);
  EXPECT_THROW(static_cast<void>(complex_permittivity(glass, 1.575)), InputError);
  EXPECT_THROW(static_cast<void>(complex_permittivity(glass, 2e10)), InputError);
  EXPECT_THROW(static_cast<void>(complex_permittivity(glass, std::nan(""))), InputError);
  EXPECT_THROW(static_cast<void>(wavelength_m(0)), InputError);
  EXPECT_NEAR(wavelength_m(1575.42e6), 0.190293673, 1e-9);  // 299792458 / 1575420000
}

}  // namespace
}  // namespace canyon::signal
