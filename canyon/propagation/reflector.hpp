#pragma once

#include <cstdint>
#include <initializer_list>

#include "canyon/propagation/paths.hpp"

namespace canyon::propagation {

/// Path::reflector of what a path comes over: a hash of the kind and of numbers that name it (instances,
/// facets, an edge, a class), never 0. Mixed by the finaliser of SplitMix64 (G. L. Steele, D. Lea, C. H.
/// Flood, OOPSLA 2014, figure 18), so that neighbours have nothing in common; two of a thousand things are
/// alike with a chance of 3e-14. The same on every machine.
[[nodiscard]] inline std::uint64_t reflector_id(PathKind kind, std::initializer_list<std::uint32_t> names) {
  const auto mix = [](std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  };
  std::uint64_t hash = mix(static_cast<std::uint64_t>(kind) + 0x9e3779b97f4a7c15U);
  for (const std::uint32_t name : names) hash = mix(hash + 0x9e3779b97f4a7c15U + name);
  return hash != 0 ? hash : 1;
}

}  // namespace canyon::propagation
