#include "cli/program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

extern char** environ;

namespace canyon::cli {

bool is_installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  if (path == nullptr) return false;
  for (const std::string_view folder : split(path, ':'))
    if (access((std::filesystem::path(folder) / program).c_str(), X_OK) == 0) return true;
  return false;
}

int run_program(const std::vector<std::string>& words, const ProgramOutput& output) {
  const bool apart = !output.complaints.empty();
  std::array<int, 2> ends{-1, -1};
  if (apart && pipe2(ends.data(), O_CLOEXEC) != 0)
    throw InputError(std::string("pipe: ") + std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (apart) {
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, output.complaints.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  }
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  const int spawned = posix_spawnp(&child, argv.front(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (apart) close(ends[1]);
  if (spawned != 0) {
    if (apart) close(ends[0]);
    throw InputError(words.front() + ": " + std::strerror(spawned),
                     "install it, or name it as a shell would find it: ./PROGRAM of this folder, executable");
  }
  if (FILE* printed = apart ? fdopen(ends[0], "r") : nullptr) {
    std::array<char, 256> text{};
    while (std::fgets(text.data(), text.size(), printed) != nullptr)
      if (output.line) output.line(trim(text.data()));
    std::fclose(printed);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

}  // namespace canyon::cli
