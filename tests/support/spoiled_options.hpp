#pragma once

#include <string>

#include "tests/support/refusal.hpp"

namespace canyon::test {

/// What validate() says of default options after `spoil(options)`; "" where it has nothing to say.
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
