#include <fmt/format.h>

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
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::vector<std::string> names_of(const Option& option) {
  std::vector<std::string> names;
  for (const std::string_view name : split(option.names, ',')) names.emplace_back(name);
  return names;
}

bool is_positional(const Option& option) {
  return option.names.front() != '-';
}

bool is_shown(const Option& option) {
  return !option.is_hidden && !is_positional(option);
}

/// Calls `work` with each command and its words.
template <typename Work>
void for_each_command(const Command& command, const std::string& words, const Work& work) {
  work(command, words);
  for (const Command& part : command.commands) for_each_command(part, words + " " + part.name, work);
}

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, " "));
}

/// The patterns of a shell's `case`: for each command its parts and options, for each option with a value its
/// possible values; an empty list means files.
std::string cases(const Command& program) {
  std::string lines;
  for_each_command(program, program.name, [&](const Command& command, const std::string& words) {
    std::string list, files;
    for (const Command& part : command.commands) list += part.name + " ";
    for (const Option& option : command.options) {
      if (is_positional(option) && !option.words.empty()) list += joined(option.words) + " ";
      if (!is_shown(option)) continue;
      std::string keys;
      for (const std::string& name : names_of(option)) {
        list += name + " ";
        keys += fmt::format("{}'{} {}'", keys.empty() ? "" : "|", words, name);
      }
      if (option.value.empty()) continue;
      if (option.words.empty())
        files += (files.empty() ? "" : "|") + keys;
      else
        lines += fmt::format("    {}) list='{}' ;;\n", keys, joined(option.words));
    }
    if (!files.empty()) lines += fmt::format("    {}) list= ;;\n", files);
    lines += fmt::format("    '{}') list='{}--help' ;;\n", words, list);
  });
  return lines;
}

std::string bash(const Command& program) {
  return fmt::format(R"(_canyon() {{
  local words=canyon word list
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do [[ $word == -* ]] || words+=" $word"; done
  word=${{COMP_WORDS[COMP_CWORD-1]}}
  [[ $word != -* ]] || words+=" $word"
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
                     cases(program));
}

std::string zsh(const Command& program) {
  return fmt::format(R"(#compdef canyon
_canyon() {{
  local line=canyon word list
  for word in "${{(@)words[2,CURRENT-1]}}"; do [[ $word == -* ]] || line+=" $word"; done
  word=${{words[CURRENT-1]}}
  [[ $word != -* ]] || line+=" $word"
  while true; do
    case $line in
{}    *) line=${{line% *}}; continue ;;
    esac
    break
  done
  if [[ $PREFIX == */* ]] || ! compadd -- ${{=list}}; then _files; fi
}}
if [[ $funcstack[1] == _canyon ]]; then _canyon "$@"; else compdef _canyon canyon; fi
)",
                     cases(program));
}

std::string fish(const Command& program) {
  const auto quoted = [](const std::string& text) {
    return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
  };
  std::string lines = "complete -c canyon -n '__fish_use_subcommand' -f\n";
  for_each_command(program, "", [&](const Command& command, const std::string& words) {
    std::string when = "__fish_use_subcommand";
    if (!words.empty()) {
      when = fmt::format("string match -q -r \"^canyon{}( |\\$)\" (commandline -cp)", words);
      if (!command.commands.empty()) when += "; and not __fish_seen_subcommand_from";
      for (const Command& part : command.commands) when += " " + part.name;
    }
    for (const Command& part : command.commands)
      lines +=
          fmt::format("complete -c canyon -n {} -a {} -d {}\n", quoted(when), part.name, quoted(part.help));
    for (const Option& option : command.options) {
      const std::string choice = option.words.empty() ? "" : " -a " + quoted(joined(option.words));
      if (is_positional(option) && !choice.empty())
        lines += fmt::format("complete -c canyon -n {} -f{}\n", quoted(when), choice);
      if (!is_shown(option)) continue;
      lines += fmt::format("complete -c canyon -n {}", quoted(when));
      for (const std::string& name : names_of(option))
        lines += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      if (!option.value.empty()) lines += (choice.empty() ? " -r" : " -x") + choice;
      lines += fmt::format(" -d {}\n", quoted(option.help));
    }
  });
  return lines;
}

/// A manual page (man(7)) of a command.
std::string manual_page(const Command& command, const std::string& words, const std::string& version) {
  const auto plain = [](const std::string& text) {
    std::string safe = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
    // A line must not begin like a macro.
    safe = replaced(replaced("\n" + safe, "\n.", "\n\\&."), "\n'", "\n\\&'");
    return safe.substr(1);
  };
  std::string positional, parts, options;
  for (const Option& option : command.options) {
    if (option.is_hidden) continue;
    const std::string name = is_positional(option) ? option.names : replaced(option.names, ",", ", ");
    options +=
        fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", plain(name),
                    option.value.empty() ? "" : " \\fI" + plain(option.value) + "\\fR", plain(option.help));
    if (is_positional(option)) positional += fmt::format(" \\fI{}\\fR", plain(option.names));
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
  Command& command = app.add_command("completion", "print a completion script for a shell");
  auto shell = std::make_shared<std::string>();
  command.add_option("shell", *shell, "SHELL", "whose").required().one_of({"bash", "zsh", "fish"});
  command.footer = "bash: eval \"$(canyon completion bash)\". Packages install all three.";
  command.action = [&app, shell] {
    fmt::print("{}", *shell == "fish" ? fish(app) : *shell == "zsh" ? zsh(app) : bash(app));
    return kOk;
  };
}

void add_manual(Command& app, const std::string& version) {
  Command& command = app.add_command("manual", "write a manual page for each command");
  auto out = std::make_shared<std::string>();
  command.add_option("-o,--out", *out, "DIR", "folder for canyon.1, canyon-simulate.1, ...").required();
  command.action = [&app, out, version] {
    const FolderLock lock(*out);
    for_each_command(app, app.name, [&](const Command& part, const std::string& words) {
      write_file(std::filesystem::path(*out) / (replaced(words, " ", "-") + ".1"),
                 manual_page(part, words, version));
    });
    return kOk;
  };
}

}  // namespace canyon::cli
