#pragma once

#include <string>

#include "tests/support/refusal.hpp"

namespace canyon::test {

/// The message of validate() for default options after `spoil(options)`; "" if it accepts them.
template <typename Options>
struct SpoiledOptions {
  template <typename Spoil>
  std::string operator()(const Spoil& spoil) const {
    Options options;
    spoil(options);
    return refusal([&] { options.validate(); });
  }
};

}  // namespace canyon::test
