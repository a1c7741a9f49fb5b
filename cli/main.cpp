// No header declares it: the program starts here.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>

#include "canyon/base/input_files.hpp"
#include "cli/commands.hpp"

namespace {

/// Standard output or error. A failure does not end a run between two files: main() reports it at the end.
struct Printed {
  int handle;
  int failure = 0;  ///< errno

  [[nodiscard]] std::FILE* open() {
    // Prevents that a file of the run gets this descriptor.
    if (::fcntl(handle, F_GETFD) < 0) (void)::open("/dev/null", O_RDWR);
    return ::fopencookie(this, "w", {nullptr, &Printed::write, nullptr, nullptr});
  }
  static ssize_t write(void* printed, const char* bytes, std::size_t size) {
    auto& to = *static_cast<Printed*>(printed);
    for (std::size_t done = 0; done < size && to.failure == 0;) {
      const ssize_t n = ::write(to.handle, bytes + done, size - done);
      if (n > 0) done += static_cast<std::size_t>(n);
      if (n < 0 && errno != EINTR) to.failure = errno;
    }
    return static_cast<ssize_t>(size);
  }
};

Printed output{STDOUT_FILENO}, complaints{STDERR_FILENO};

int run_program(int argc, char** argv) {
  using namespace canyon::cli;
  canyon::InputFiles::begin_run();
  Command program{"canyon", "Canyon: simulates GNSS receivers in cities"};
  program.footer =
      "Each command has its own --help. Exit status: 0 done, 2 bad input, 130 interrupted, 1 other errors.";
  add_demo(program);
  add_new(program);
  add_simulate(program);
  add_live(program);
  add_sky(program);
  add_trace(program);
  add_skyplot(program);
  add_city(program);
  add_check(program);
  add_scenario(program);
  add_faults(program);
  add_profiles(program);
  add_validate(program);
  add_calibrate(program);
  add_heatmap(program);
  add_iq(program);
  add_rtk(program);
  add_study(program);
  add_bench(program);
  add_view(program);
  add_completion(program);
  add_manual(program, "canyon " CANYON_VERSION);
  try {
    return run(program, "canyon " CANYON_VERSION, argc, argv);
  } catch (const canyon::Error& error) {
    fmt::print(stderr, "canyon: {}\n", error.what());
    return exit_code(error);
  } catch (const std::exception& error) {
    fmt::print(stderr, "canyon: internal error: {}\n", error.what());
    return kFailure;
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  stdout = output.open();
  stderr = complaints.open();
  if (::isatty(STDOUT_FILENO) != 0) std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  std::setvbuf(stderr, nullptr, _IONBF, 0);
  int status = run_program(argc, argv);
  std::fflush(stdout);
  std::cout.flush();  // help
  if (output.failure == 0 && !std::cout) output.failure = errno;
  if (output.failure != 0 && output.failure != EPIPE) {
    fmt::print(stderr, "canyon: standard output cannot be written: {}\n", std::strerror(output.failure));
    if (status == canyon::cli::kOk) status = canyon::cli::kFailure;
  }
  return status;
}
