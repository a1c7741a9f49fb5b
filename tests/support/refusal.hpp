#pragma once

#include <string>

#include "canyon/base/input_error.hpp"

namespace canyon::test {

/// The message of the InputError that `call` throws; "" if it throws none.
template <typename Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace canyon::test
