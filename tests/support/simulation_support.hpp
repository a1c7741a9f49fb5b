#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "canyon/base/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::simulation::test {

/// A temporary folder for files.
class TemporaryFolder : public canyon::test::TemporaryFolder {
 public:
  [[nodiscard]] std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path() / name, std::ios::binary) << text;
    return path() / name;
  }
};

/// The InputError that `call` throws; fails the test and returns an empty one if it throws none.
template <typename Call>
InputError error_of(const Call& call) {
  try {
    call();
  } catch (const InputError& e) {
    return e;
  }
  ADD_FAILURE() << "no InputError";
  return InputError("none");
}

}  // namespace canyon::simulation::test
