#include "cli/program.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <thread>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "cli/progress.hpp"

extern char** environ;

namespace canyon::cli {

bool is_installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  if (path == nullptr) return false;
  for (const std::string_view folder : split(path, ':'))
    if (access((std::filesystem::path(folder) / program).c_str(), X_OK) == 0) return true;
  return false;
}

namespace {

/// Starts a program. Throws InputError if that fails.
pid_t spawn(const std::vector<std::string>& words, const posix_spawn_file_actions_t& actions,
            const posix_spawnattr_t* attributes) {
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, argv.front(), &actions, attributes, argv.data(), environ);
  if (failed != 0)
    throw InputError(words.front() + ": " + std::strerror(failed),
                     "install it, or give its path: ./PROGRAM in this folder, executable");
  return child;
}

/// File actions of posix_spawn().
struct Actions {
  posix_spawn_file_actions_t actions{};
  Actions() { posix_spawn_file_actions_init(&actions); }
  ~Actions() { posix_spawn_file_actions_destroy(&actions); }
  Actions(const Actions&) = delete;
  Actions& operator=(const Actions&) = delete;
  void read_nothing() { posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0); }
};

}  // namespace

int run_program(const std::vector<std::string>& words, const ProgramOutput& output) {
  const bool apart = !output.complaints.empty();
  std::array<int, 2> ends{-1, -1};
  if (apart && pipe2(ends.data(), O_CLOEXEC) != 0)
    throw InputError(std::string("pipe: ") + std::strerror(errno));
  Actions files;
  if (apart) {
    posix_spawn_file_actions_adddup2(&files.actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&files.actions, STDERR_FILENO, output.complaints.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0644);
    files.read_nothing();
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> printed(apart ? fdopen(ends[0], "r") : nullptr,
                                                                &std::fclose);
  pid_t child = 0;
  try {
    child = spawn(words, files.actions, nullptr);
  } catch (...) {
    if (apart) close(ends[1]);
    throw;
  }
  if (apart) close(ends[1]);
  std::array<char, 256> text{};
  while (printed && std::fgets(text.data(), text.size(), printed.get()) != nullptr)
    if (output.line) output.line(trim(text.data()));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

std::string run_bounded(const std::vector<std::string>& words, double timeout_s) {
  const std::atomic<bool>& stop = catch_interrupts();
  if (stop.load()) throw Interrupted();
  Actions files;
  files.read_nothing();
  posix_spawn_file_actions_adddup2(&files.actions, STDERR_FILENO, STDOUT_FILENO);
  posix_spawnattr_t group;
  posix_spawnattr_init(&group);
  sigset_t usual;
  sigemptyset(&usual);
  sigaddset(&usual, SIGPIPE);  // ignored by this program
  posix_spawnattr_setsigdefault(&group, &usual);
  posix_spawnattr_setflags(&group, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
  const pid_t child = spawn(words, files.actions, &group);
  posix_spawnattr_destroy(&group);
  const auto begin = std::chrono::steady_clock::now();
  siginfo_t ended{};
  bool late = false;
  while (!late && !stop.load()) {
    if (waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
        ended.si_pid != 0)
      break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    late = seconds_since(begin) > timeout_s;
  }
  // End the group before its leader is reaped, since its number is free afterwards.
  kill(-child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (stop.load()) throw Interrupted();
  if (late) return fmt::format("the program took more than {:g} s and was ended", timeout_s);
  if (WIFSIGNALED(status))
    return fmt::format("the program was ended by signal {} ({})", WTERMSIG(status),
                       strsignal(WTERMSIG(status)));
  return WEXITSTATUS(status) == 0 ? "" : fmt::format("the program ended with status {}", WEXITSTATUS(status));
}

}  // namespace canyon::cli
