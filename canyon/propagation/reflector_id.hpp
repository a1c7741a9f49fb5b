#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>

#include "canyon/base/random.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/propagation/paths.hpp"

namespace canyon::propagation {

/// Path::reflector of what a path comes over: a hash of the kind and of numbers that name it (instances,
/// facets, an edge, a class), never 0. Mixed by the finaliser of SplitMix64 (G. L. Steele, D. Lea, C. H.
/// Flood, OOPSLA 2014, figure 18), so that neighbours have nothing in common; two of a thousand things are
/// alike with a chance of 3e-14. The same on every machine.
[[nodiscard]] inline std::uint64_t reflector_id(PathKind kind, std::initializer_list<std::uint32_t> names) {
  std::uint64_t hash = mix64(static_cast<std::uint64_t>(kind) + kGolden64);
  for (const std::uint32_t name : names) hash = mix64(hash + kGolden64 + name);
  return hash != 0 ? hash : 1;
}

/// Reflections of one satellite are one where their planes are less than this [m] and 1 deg apart: walls that
/// two buildings share are not drawn at quite the same place. Points along the planes then differ by this
/// over the cosine of incidence.
inline constexpr double kSamePlace = 2e-3;
inline const double kSameNormal = std::cos(geodesy::radians(1));

}  // namespace canyon::propagation
