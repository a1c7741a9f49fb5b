#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "cli/commands.hpp"

// Completion for shells and manual pages, from the program's own list of commands and options.

namespace canyon::cli {
namespace {

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::vector<std::string> names_of(const Option& option) {
  std::vector<std::string> names;
  for (const std::string_view name : split(option.names, ',')) names.emplace_back(name);
  return names;
}

bool is_shown(const Option& option) {
  return !option.is_hidden && option.names.front() == '-';
}

/// Calls `work` with each command and the words that lead to it.
template <typename Work>
void for_each_command(const Command& command, const std::string& words, const Work& work) {
  work(command, words);
  for (const Command& part : command.commands) for_each_command(part, words + " " + part.name, work);
}

std::string bash(const Command& program) {
  std::string cases;
  for_each_command(program, program.name, [&](const Command& command, const std::string& words) {
    std::string list;
    for (const Command& part : command.commands) list += part.name + " ";
    for (const Option& option : command.options) {
      if (!is_shown(option)) continue;
      for (const std::string& name : names_of(option)) list += name + " ";
    }
    cases += fmt::format("    '{}') list='{}--help' ;;\n", words, list);
  });
  return fmt::format(R"(_canyon() {{
  local words=canyon word list
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do [[ $word == -* ]] || words+=" $word"; done
  while true; do
    case $words in
{}    *) words=${{words% *}}; continue ;;
    esac
    break
  done
  COMPREPLY=()
  [[ ${{COMP_WORDS[COMP_CWORD]}} == */* ]] || mapfile -t COMPREPLY < <(compgen -W "$list" -- "${{COMP_WORDS[COMP_CWORD]}}")
}}
complete -o default -F _canyon canyon
)",
                     cases);
}

std::string fish(const Command& program) {
  const auto quoted = [](const std::string& text) {
    return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
  };
  std::string lines;
  for_each_command(program, "", [&](const Command& command, const std::string& words) {
    const std::string when =
        words.empty() ? "__fish_use_subcommand"
                      : fmt::format("string match -q -r \"^canyon{}( |\\$)\" (commandline -cp)", words);
    for (const Command& part : command.commands) {
      lines +=
          fmt::format("complete -c canyon -n {} -a {} -d {}\n", quoted(when), part.name, quoted(part.help));
    }
    for (const Option& option : command.options) {
      if (!is_shown(option)) continue;
      lines += fmt::format("complete -c canyon -n {}", quoted(when));
      for (const std::string& name : names_of(option)) {
        lines += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      lines += fmt::format("{} -d {}\n", option.value.empty() ? "" : " -r", quoted(option.help));
    }
  });
  return lines;
}

/// A manual page (man(7)) of a command.
std::string manual_page(const Command& command, const std::string& words, const std::string& version) {
  const auto plain = [](const std::string& text) {
    std::string safe = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
    // A line must not begin like a request.
    safe = replaced(replaced("\n" + safe, "\n.", "\n\\&."), "\n'", "\n\\&'");
    return safe.substr(1);
  };
  std::string positional, parts, options;
  for (const Option& option : command.options) {
    if (option.is_hidden) continue;
    const std::string name = option.names.front() == '-' ? replaced(option.names, ",", ", ") : option.names;
    options +=
        fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", plain(name),
                    option.value.empty() ? "" : " \\fI" + plain(option.value) + "\\fR", plain(option.help));
    if (option.names.front() != '-') positional += fmt::format(" \\fI{}\\fR", plain(option.names));
  }
  for (const Command& part : command.commands) {
    parts += fmt::format(".TP\n\\fB{}\\fR\n{}: see \\fB{}\\fR(1)\n", plain(part.name), plain(part.help),
                         plain(replaced(words + " " + part.name, " ", "-")));
  }
  const std::string name = replaced(words, " ", "-");
  std::string page = fmt::format(
      ".TH \"{}\" 1 \"\" \"{}\" Canyon\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n\\fB{}\\fR{}{}{}\n", name,
      plain(version), plain(name), plain(command.help), plain(words),
      options.empty() ? "" : " [\\fIOPTION\\fR...]", parts.empty() ? "" : " \\fICOMMAND\\fR", positional);
  if (!parts.empty()) page += ".SH COMMANDS\n" + parts;
  if (!options.empty()) page += ".SH OPTIONS\n" + options;
  if (!command.footer.empty()) page += ".SH NOTES\n" + plain(command.footer) + "\n";
  return page;
}

}  // namespace

void add_completion(Command& app) {
  Command& command =
      app.add_command("completion", "print a script that completes commands and options in a shell");
  auto shell = std::make_shared<std::string>();
  command.add_option("shell", *shell, "SHELL", "whose").required().one_of({"bash", "zsh", "fish"});
  command.footer = "bash: eval \"$(canyon completion bash)\". Packages install all three.";
  command.action = [&app, shell] {
    // zsh runs what is bash's.
    if (*shell == "zsh") fmt::print("#compdef canyon\nautoload -U +X bashcompinit && bashcompinit\n");
    fmt::print("{}", *shell == "fish" ? fish(app) : bash(app));
    return kOk;
  };
}

void add_manual(Command& app, const std::string& version) {
  Command& command = app.add_command("manual", "write a manual page for each command");
  auto out = std::make_shared<std::string>();
  command.add_option("-o,--out", *out, "DIR", "folder for canyon.1, canyon-simulate.1, ...").required();
  command.action = [&app, out, version] {
    make_output_folder(*out);
    for_each_command(app, app.name, [&](const Command& part, const std::string& words) {
      write_file(std::filesystem::path(*out) / (replaced(words, " ", "-") + ".1"),
                 manual_page(part, words, version));
    });
    return kOk;
  };
}

}  // namespace canyon::cli
