#pragma once

#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace canyon::cli {

/// Exit codes of every command.
enum ExitCode : int { kOk = 0, kFailure = 1, kBadInput = 2, kInterrupted = 130 };

/// An option of a command; a flag if its target is a bool or a function without arguments; a positional
/// argument if its name begins without a dash. Parsing writes the value to the target or calls the function.
struct Option {
  using Texts = std::vector<std::string>;
  using Target = std::variant<bool*, int*, std::size_t*, double*, std::string*, Texts*, std::optional<int>*,
                              std::optional<std::size_t>*, std::optional<double>*,
                              std::function<void(const Texts&)>, std::function<void()>>;

  std::string names;  ///< "-o,--out" or "scenario"
  Target target;
  std::string value;  ///< name of its value in the help, "FILE"; empty: its type's
  std::string help;
  bool is_required = false, is_hidden = false, is_output = false;
  bool takes_one = false;      ///< of Texts: one value in all
  bool one_at_a_time = false;  ///< of Texts: one value after each name
  Texts needed = {}, excluded = {};
  Texts former = {};  ///< earlier names; they still work, with a warning
  std::optional<std::pair<double, double>> range = {};
  Texts words = {};    ///< its possible values; empty: any
  bool given = false;  ///< set by run()

  Option& required() { return is_required = true, *this; }
  Option& hidden() { return is_hidden = true, *this; }
  /// May be given again for more values, with one value each time.
  Option& repeated() { return one_at_a_time = true, *this; }
  /// Only valid with the option of this name.
  Option& needs(const std::string& name) { return needed.push_back(name), *this; }
  /// Not valid with the option of this name, which was added before.
  Option& excludes(const std::string& name) { return excluded.push_back(name), *this; }
  /// Its value is a file that the command writes: no input is replaced, see InputFiles.
  Option& writes() { return is_output = true, *this; }
  /// An earlier name: it still works, with a warning.
  Option& formerly(const std::string& name) { return former.push_back(name), *this; }
  Option& within(double least, double maximum) { return range = std::pair(least, maximum), *this; }
  Option& one_of(Texts texts) { return words = std::move(texts), *this; }

  [[nodiscard]] bool has_name(std::string_view name) const;
};

/// A command, or the program itself. With subcommands, one of them is required unless it has its own action.
struct Command {
  std::string name, help;
  std::string footer = {};
  std::function<int()> action = {};  ///< returns an ExitCode
  std::list<Option> options = {};
  std::list<Command> commands = {};

  Command& add_command(const std::string& its_name, const std::string& its_help) {
    return commands.emplace_back(Command{its_name, its_help});
  }
  /// @param target must live until the action ends
  template <typename T>
  Option& add_option(const std::string& names, T& target, const std::string& value, const std::string& text) {
    return options.emplace_back(Option{names, &target, value, text});
  }
  Option& add_flag(const std::string& names, bool& target, const std::string& text) {
    return add_option(names, target, {}, text);
  }
  /// Lets the action call `work` with arguments, and returns them: targets of options.
  template <typename Arguments>
  Arguments& run_with(int (*work)(const Arguments&)) {
    const auto arguments = std::make_shared<Arguments>();
    action = [arguments, work] { return work(*arguments); };
    return *arguments;
  }
  /// Whether the command line has this option.
  [[nodiscard]] bool given(std::string_view name_of_option) const;
};

/// Parses the command line and runs its command. Returns the exit status; prints help and usage errors.
/// Exceptions from readers of options and from actions pass through. @param version text of --version
[[nodiscard]] int run(Command& program, const std::string& version, int argc, char** argv);

}  // namespace canyon::cli
