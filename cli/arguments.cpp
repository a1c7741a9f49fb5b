#include "cli/arguments.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <type_traits>

#include "canyon/base/input_files.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/text.hpp"

namespace canyon::cli {
namespace {

bool is_whole(const Option::Target& target) {
  return std::holds_alternative<int*>(target) || std::holds_alternative<std::size_t*>(target) ||
         std::holds_alternative<std::optional<int>*>(target) ||
         std::holds_alternative<std::optional<std::size_t>*>(target);
}

/// CLI11 reads 010 as eight and 0x10 as sixteen. Makes a whole number decimal; returns errors of others.
std::string plain_decimal(std::string& text) {
  const auto number = parse_integer(text);
  if (!number) return fmt::format("'{}' is not a whole number in decimal digits", text);
  text = std::to_string(*number);
  return {};
}

/// The only code that uses CLI11, whose headers take 10 s to compile.
class Parser {
 public:
  void add(CLI::App& app, Command& command) {
    for (Option& option : command.options) add(app, option);
    if (!command.footer.empty()) app.footer(command.footer);  // inherited by its commands
    for (Command& each : command.commands) add(*app.add_subcommand(each.name, each.help), each);
    if (!command.commands.empty()) app.require_subcommand(command.action ? 0 : 1, 1);
    // The innermost command's is called first.
    app.callback([this, &command] {
      if (chosen_ == nullptr) chosen_ = &command;
    });
  }
  [[nodiscard]] const Command& chosen() const {
    for (const auto& [option, parsed] : options_) {
      option->given = parsed->count() > 0;
      if (!option->given || !option->is_output) continue;
      // "-" and addresses are not files.
      for (const std::string& path : parsed->results())
        if (path != "-" && path.find("://") == std::string::npos) InputFiles::current().add_output(path);
    }
    return *chosen_;
  }

 private:
  void add(CLI::App& app, Option& option) {
    const auto add_to = [&](auto& target) -> CLI::Option* {
      using Target = std::decay_t<decltype(target)>;
      if constexpr (std::is_same_v<Target, bool*>)
        return app.add_flag(option.names, *target, option.help);
      else if constexpr (std::is_same_v<Target, std::function<void()>>)
        return app.add_flag_callback(option.names, target, option.help);
      else if constexpr (std::is_pointer_v<Target>)
        return app.add_option(option.names, *target, option.help);
      else
        return app.add_option_function<Option::Texts>(option.names, target, option.help);
    };
    CLI::Option* added = std::visit(add_to, option.target);
    if (is_whole(option.target)) added->transform(CLI::Validator(plain_decimal, ""));
    const bool count = std::holds_alternative<std::size_t*>(option.target) ||
                       std::holds_alternative<std::optional<std::size_t>*>(option.target);
    if (count) added->check(CLI::NonNegativeNumber);
    if (!option.value.empty()) added->type_name(option.value);
    if (option.takes_one) added->expected(1);
    if (option.one_at_a_time) added->allow_extra_args(false);
    if (option.is_required) added->required();
    if (option.is_hidden) added->group("");
    for (const std::string& name : option.needed) added->needs(name);
    for (const std::string& name : option.excluded) added->excludes(name);
    // A function checks its own values.
    const bool checked = std::holds_alternative<std::function<void(const Option::Texts&)>>(option.target);
    if (!option.words.empty() && !checked) added->check(CLI::IsMember(option.words));
    if (option.range) {
      const auto [least, maximum] = *option.range;
      const bool real = std::holds_alternative<double*>(option.target);
      added->check(real ? CLI::Range(least, maximum)
                        : CLI::Range(static_cast<int>(least), static_cast<int>(maximum)));
    }
    options_.emplace_back(&option, added);
  }

  const Command* chosen_ = nullptr;
  std::vector<std::pair<Option*, const CLI::Option*>> options_;
};

/// The words of a command line, with former names of options replaced by the present ones.
std::vector<std::string> with_present_names(const Command& program, int argc, char** argv) {
  std::vector<std::string> words(argv, argv + argc);
  const Command* command = &program;
  for (auto word = words.begin() + 1; word < words.end() && *word != "--"; ++word) {
    for (const Command& each : command->commands) {
      if (each.name != *word) continue;
      command = &each;
      break;
    }
    const std::string name = word->substr(0, word->find('='));
    for (const Option& option : command->options) {
      if (std::find(option.former.begin(), option.former.end(), name) == option.former.end()) continue;
      fmt::print(stderr, "warning: {} is now {}; the old name will be removed\n", name, option.names);
      word->replace(0, name.size(), option.names);
    }
  }
  return words;
}

/// "no command 'simulat'; did you mean 'simulate'?" for the first unknown word at the position of a command,
/// and likewise for options. Empty if every word is known.
std::string unknown_word(const Command& program, const std::vector<std::string>& words) {
  const Command* command = &program;
  std::string path = program.name;
  for (auto each_word = words.begin() + 1; each_word < words.end(); ++each_word) {
    const std::string& word = *each_word;
    std::vector<std::string> known;
    const bool option = word.substr(0, 2) == "--";
    if (option) {
      known = {"--help"};
      if (command == &program) known.emplace_back("--version");
      for (const Option& each : command->options) {
        for (const std::string_view name : split(each.names, ','))
          if (name.substr(0, 2) == "--") known.emplace_back(name);
      }
      const std::string name = word.substr(0, word.find('='));
      if (name == "--" || std::find(known.begin(), known.end(), name) != known.end()) continue;
    } else if (word.empty() || word.front() == '-') {
      continue;
    } else {
      for (const Command& each : command->commands) {
        known.push_back(each.name);
        if (each.name != word) continue;
        command = &each;
        path += " " + word;
        known.clear();
        break;
      }
      if (known.empty() || command->action) continue;
    }
    const std::string what = fmt::format("no {} '{}'", option ? "option" : "command", word);
    if (!option) return fmt::format("{}; {}", what, known_names(word, known));
    const std::string help = fmt::format("see {} --help", path);
    return fmt::format("{}; {}", what, did_you_mean(closest(word, known), help));
  }
  return {};
}

/// All commands accept --quiet; for those that print only the requested output it has no effect.
void add_quiet(Command& command) {
  static bool ignored = false;
  const bool has_quiet = std::any_of(command.options.begin(), command.options.end(),
                                     [](const Option& option) { return option.has_name("--quiet"); });
  if (command.action && !has_quiet)
    command.add_flag("--quiet", ignored, "print warnings, errors and the requested output only");
  for (Command& each : command.commands) add_quiet(each);
}

}  // namespace

bool Option::has_name(std::string_view name) const {
  const auto each = split(names, ',');
  return std::find(each.begin(), each.end(), name) != each.end();
}

bool Command::given(std::string_view name_of_option) const {
  return std::any_of(options.begin(), options.end(), [name_of_option](const Option& option) {
    return option.given && option.has_name(name_of_option);
  });
}

int run(Command& program, const std::string& version, int argc, char** argv) {
  CLI::App app(program.help, program.name);
  app.set_version_flag("--version", version);
  add_quiet(program);
  Parser parser;
  parser.add(app, program);
  if (argc < 2) {
    fmt::print(stderr, "{}", app.help());
    return kBadInput;
  }
  const std::vector<std::string> words = with_present_names(program, argc, argv);
  try {
    std::vector<std::string> last_first(words.rbegin(), words.rend() - 1);  // the order that CLI11 needs
    app.parse(last_first);
  } catch (const CLI::ParseError& error) {
    const std::string unknown = unknown_word(program, words);
    if (!unknown.empty()) {
      fmt::print(stderr, "canyon: {}\n", unknown);
      return kBadInput;
    }
    if (error.get_exit_code() != 0) fmt::print(stderr, "canyon: ");
    // CLI11's own codes are finer than needed: help is 0, any other is bad input.
    return app.exit(error) == 0 ? kOk : kBadInput;
  }
  return parser.chosen().action();
}

}  // namespace canyon::cli
