#pragma once

#include <string>

#include "canyon/base/input_error.hpp"

namespace canyon::test {

/// What validate() says of default options after `spoil(options)`; "" where it has nothing to say.
template <typename Options>
struct SpoiledOptions {
  template <typename Spoil>
  std::string operator()(const Spoil& spoil) const {
    Options options;
    spoil(options);
    try {
      options.validate();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

}  // namespace canyon::test
