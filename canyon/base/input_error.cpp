#include "canyon/base/input_error.hpp"

#include "canyon/base/secrets.hpp"

namespace canyon {
namespace {

std::string message(const std::string& file, int line, std::string_view problem, std::string_view cure) {
  std::string text;
  if (!file.empty()) {
    text += file;
    if (line > 0) text += ":" + std::to_string(line);
    text += ": ";
  }
  text += problem;
  if (!cure.empty()) {
    text += "; ";
    text += cure;
  }
  return text;
}

}  // namespace

InputError::InputError(std::string_view problem, std::string_view cure)
    : InputError(std::filesystem::path(), 0, problem, cure) {}

InputError::InputError(const std::filesystem::path& file, int line, std::string_view problem,
                       std::string_view cure)
    : std::runtime_error(hide_passwords(message(file.string(), line, problem, cure))),
      file_(file.string()),
      line_(line),
      problem_(hide_passwords(problem)),
      cure_(hide_passwords(cure)) {}

}  // namespace canyon
