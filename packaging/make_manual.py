#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the man pages and the shell completion of docent from what `docent ... --help` prints, so that they agree.

    make_manual.py DOCENT OUTPUT

OUTPUT receives man1/docent.1.gz, one page for each subcommand (docent-maps-list.1.gz), bash/docent, zsh/_docent and
fish/docent.fish. The same program gives the same bytes. Help that cannot be understood is an error.
"""
import dataclasses
import gzip
import pathlib
import re
import subprocess
import sys

TERM_WIDTH = 30  # CLI11 writes descriptions from this column on
SECTIONS = {"Positionals:", "Options:", "Subcommands:"}


@dataclasses.dataclass
class Entry:
    """An option, positional or subcommand: the term, and the lines of its description."""
    term: str
    lines: list

    @property
    def names(self):
        return [word for word in self.term.split(" ")[0].split(",") if word.startswith("-")]

    @property
    def text(self):
        return " ".join(self.lines)

    def values(self):
        """What the option takes: None for a flag, else the words that may follow, which may be none."""
        rest = re.sub(r"(REQUIRED|\.\.\.|Excludes:.*|Needs:.*)", "", self.term.split(" ", 1)[1] if " " in self.term else "")
        rest = rest.strip()
        if not rest:
            return None
        choices = rest.split("|")
        return [word for word in choices if re.fullmatch(r"[a-z][a-z_-]*", word)] if len(choices) > 1 else []


@dataclasses.dataclass
class Command:
    path: tuple
    description: list
    usage: str
    sections: dict
    footer: list

    @property
    def page(self):
        return "-".join(self.path)

    def options(self):
        return [entry for entry in self.sections.get("Options:", []) if entry.names]

    def subcommands(self):
        """The names of each subcommand: the first one, and its aliases."""
        return [entry.term.split(", ") for entry in self.sections.get("Subcommands:", [])]


def parse(path, text):
    lines = text.rstrip("\n").split("\n")
    usages = [i for i, line in enumerate(lines) if line.startswith("Usage: ")]
    if len(usages) != 1:
        raise SystemExit(f"make_manual: the help of '{' '.join(path)}' has no usage line")
    command = Command(path, lines[:usages[0]], lines[usages[0]].removeprefix("Usage: "), {}, [])
    section = None
    for i, line in enumerate(lines[usages[0] + 1:], usages[0] + 1):
        if line in SECTIONS:
            section = command.sections.setdefault(line, [])
        elif line.startswith("Example:"):
            command.footer = lines[i:]
            break
        elif not line.strip():
            continue
        elif section is None:
            raise SystemExit(f"make_manual: the help of '{' '.join(path)}' has a line of no section: {line}")
        elif line.startswith(" " * TERM_WIDTH):
            section[-1].lines.append(line[TERM_WIDTH:].rstrip())
        elif len(line) > TERM_WIDTH and line[TERM_WIDTH - 1] == " ":
            section.append(Entry(line[:TERM_WIDTH].strip(), [line[TERM_WIDTH:].strip()]))
        else:
            section.append(Entry(line.strip(), []))
    return command


def read_commands(program, path=("docent",)):
    done = subprocess.run([program, *path[1:], "--help"], capture_output=True, text=True, encoding="utf-8", check=False)
    if done.returncode != 0:
        raise SystemExit(f"make_manual: {' '.join(path)} --help ends with status {done.returncode}: {done.stderr}")
    command = parse(path, done.stdout)
    if not command.usage.startswith(" ".join(path) + " "):
        raise SystemExit(f"make_manual: {' '.join(path)} --help is the help of another command: {command.usage}")
    below = [each for names in command.subcommands() for each in read_commands(program, (*path, names[0]))]
    return [command, *below]


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text[:1] in (".", "'") else text


def roff_description(lines):
    """A line with two spaces inside is a row of a list and stays a line; the others are one paragraph."""
    out = []
    for line in lines:
        if "  " in line.strip():
            out += [".br", roff(re.sub("  +", ": ", line.strip()))]
        elif line.strip():
            out.append(roff(line.strip()))
    return out


def roff_footer(lines):
    out = []
    is_list = False
    for line in lines:
        if line.endswith(":") and not line.startswith(" "):
            is_list = line == "Exit status:"
            out.append(".SH " + ("EXIT STATUS" if is_list else "EXAMPLES"))
        elif is_list and (match := re.fullmatch(r"  (\d+)  (.*)", line)):
            out += [".TP", match[1], roff(match[2])]
        elif line.startswith("  "):
            out += [".PP", ".nf", ".RS", roff(line.strip()), ".RE", ".fi"]
        elif line.strip():
            out += [".PP", roff(line)]
    return out


def man_page(command, version, commands):
    name = command.page
    summary = " ".join(command.description).split(". ")[0].strip().rstrip(".")
    out = [f'.TH {name.upper()} 1 "" "{version}" "Docent"', ".SH NAME",
           f"{roff(name)} \\- {roff(summary)}", ".SH SYNOPSIS", f".B {roff(command.usage)}",
           ".SH DESCRIPTION", *roff_description(command.description)]
    for title, heading in (("Positionals:", "ARGUMENTS"), ("Options:", "OPTIONS"), ("Subcommands:", "SUBCOMMANDS")):
        if title in command.sections:
            out.append(f".SH {heading}")
        for entry in command.sections.get(title, []):
            out += [".TP", f".B {roff(entry.term)}", *(roff_description(entry.lines) or ["\\&"])]
    out += roff_footer(command.footer)
    near = [each for each in commands if each.path[:-1] in (command.path, command.path[:-1]) or
            each.path == command.path[:-1]]
    others = [f".BR {roff(each.page)} (1)" for each in near if each is not command]
    out += [".SH SEE ALSO", ",\n".join(others).replace("(1),", "(1),"), ".PP",
            "The guide is in /usr/share/doc/docent/docs/guide.md."]
    return "\n".join(out) + "\n"


def shell_words(words):
    for word in words:
        if not re.fullmatch(r"[A-Za-z0-9_|.-]+", word):
            raise SystemExit(f"make_manual: '{word}' cannot be a word of the completion")
    return " ".join(words)


def option_words(command, commands):
    words = [name for entry in command.options() for name in entry.names]
    if len(command.path) > 1:  # options of the program may follow a subcommand
        words += [name for entry in commands[0].options() for name in entry.names if name not in words + ["--version"]]
    return words


# $1: name of the function that returns the words, by shell the same walk through the command line.
WALK = """\
  local path=docent word
  for word in "${before[@]}"; do
    case "$path $word" in
%s) path="$path $word" ;;
    esac
  done
"""


def completion_cases(commands):
    paths = [" ".join((*each.path, name)) for each in commands for names in each.subcommands() for name in names]
    walk = "|\\\n".join(f'      "{path}"' for path in paths)
    aliases = {" ".join((*each.path, names[0])): [" ".join((*each.path, name)) for name in names]
               for each in commands for names in each.subcommands()}

    def patterns(each, suffix=""):
        path = " ".join(each.path)
        return "|".join(f'"{alias}{suffix}"' for alias in aliases.get(path, [path]))

    words = "".join(f'    {patterns(each)}) words="{shell_words(option_words(each, commands) + sum(each.subcommands(), []))}" ;;\n'
                    for each in commands)
    values = ""
    for each in commands:
        for entry in each.options():
            taken = entry.values()
            if taken is None:
                continue
            names = "|".join(patterns(each, f" {name}") for name in entry.names)
            values += f'    {names}) words="{shell_words(taken)}"; takes_value=1 ;;\n'
    body = (WALK % walk + "  local words= takes_value=\n" + '  case "$path $previous" in\n' + values + "  esac\n" +
            '  if [[ -z $takes_value ]]; then case "$path" in\n' + words + "  esac; fi\n")
    return body


def bash_completion(commands):
    return ("# Completion of docent for bash, generated from its --help.\n_docent() {\n"
            '  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}\n'
            '  local before=("${COMP_WORDS[@]:1:COMP_CWORD-1}")\n' + completion_cases(commands) +
            '  COMPREPLY=($(compgen -W "$words" -- "$current"))\n}\n'
            "complete -o bashdefault -o default -F _docent docent\n")


def zsh_completion(commands):
    return ("#compdef docent\n# Completion of docent for zsh, generated from its --help.\n"
            # `words` and `path` are special in zsh.
            + ("_docent() {\n" "  local previous=${words[CURRENT-1]}\n"
               '  local -a before; before=("${(@)words[2,CURRENT-1]}")\n' + completion_cases(commands)
               .replace("path", "command_path").replace("local words= ", "local choices= ").replace(") words=", ") choices=") +
               '  compadd -- ${=choices}\n  [[ -n $takes_value || -z $choices ]] && _files\n  return 0\n}\n_docent "$@"\n'))


def fish_quoted(text):
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def fish_completion(commands):
    out = ["# Completion of docent for fish, generated from its --help.",
           "# Succeeds if the subcommands on the command line are these.", "function __docent_at",
           "    set -l path docent", "    for word in (commandline -opc)[2..-1]", '        switch "$path $word"']
    out += [f"            case {fish_quoted(' '.join(each.path))}\n                set path \"$path $word\""
            for each in commands[1:]]
    out += ["        end", "    end", '    test "$path" = "$argv"', "end"]
    for each in commands:
        condition = f"complete -c docent -n {fish_quoted('__docent_at ' + ' '.join(each.path))}"
        for entry in each.sections.get("Subcommands:", []):
            out.append(f"{condition} -f -a {fish_quoted(entry.term.replace(',', ''))} -d {fish_quoted(entry.text.split('. ')[0])}")
        for entry in each.options():
            names = " ".join(("-l " + name[2:]) if name.startswith("--") else ("-s " + name[1:]) for name in entry.names)
            taken = entry.values()
            takes = "" if taken is None else f" -x -a '{shell_words(taken)}'" if taken else " -r"
            out.append(f"{condition} {names}{takes} -d {fish_quoted(entry.text.split('. ')[0])}")
    return "\n".join(out) + "\n"


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def main():
    if len(sys.argv) != 3:
        raise SystemExit("Usage: make_manual.py DOCENT OUTPUT")
    program, output = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2])
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    commands = read_commands(program)
    if len(commands) < 2:
        raise SystemExit("make_manual: the help lists no subcommand")
    for command in commands:
        path = output / "man1" / f"{command.page}.1.gz"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(gzip.compress(man_page(command, version, commands).encode(), 9, mtime=0))
    write(output / "bash/docent", bash_completion(commands))
    write(output / "zsh/_docent", zsh_completion(commands))
    write(output / "fish/docent.fish", fish_completion(commands))


if __name__ == "__main__":
    main()
