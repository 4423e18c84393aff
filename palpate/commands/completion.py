"""What lets a shell complete commands, options and their values.

    eval "$(palpate completion bash)"     # in ~/.bashrc
    eval "$(palpate completion zsh)"      # in ~/.zshrc, after compinit
    palpate completion fish | source      # in ~/.config/fish/config.fish

The script holds every word, so that completing starts no Python; print it again after an update.
"""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Iterator

from palpate.arguments import told_help
from palpate.cli import COMMANDS, parser_of

SUMMARY = "what lets a shell complete all this: bash, zsh or fish"
SHELLS = ("bash", "zsh", "fish")

_BASH = """_palpate() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} words=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    words="{commands}"
  else
    case "${{COMP_WORDS[1]}} $before" in
{values}
      *) case "${{COMP_WORDS[1]}}" in
{options}
      esac ;;
    esac
  fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -o bashdefault -F _palpate palpate
"""
_ZSH = "autoload -U +X bashcompinit && bashcompinit\n"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shell."""
    parser.add_argument("shell", choices=SHELLS, help="whose script is printed")


def run(arguments: argparse.Namespace) -> int:
    """Print the script."""
    print(script(arguments.shell), end="")
    return 0


def script(shell: str) -> str:
    """The script of one of SHELLS."""
    if shell == "fish":
        return "\n".join(_fish()) + "\n"
    options, values = [], []
    for name in COMMANDS:
        shown = list(_shown(parser_of(name)))
        flags = [flag for action in shown for flag in action.option_strings]
        places = [str(c) for action in shown if not action.option_strings for c in action.choices or ()]
        options.append(f"        {name}) words={shlex.quote(' '.join([*flags, *places]))} ;;")
        values += [
            f"      {shlex.quote(f'{name} {flag}')}) "
            f"words={shlex.quote(' '.join(map(str, action.choices)))} ;;"
            for action in shown
            if action.choices
            for flag in action.option_strings
        ]
    text = _BASH.format(
        commands=" ".join([*COMMANDS, "--help", "--version"]),
        options="\n".join(options),
        values="\n".join(values),
    )
    return (_ZSH if shell == "zsh" else "") + text


def _shown(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    return (action for action in parser._actions if action.help is not argparse.SUPPRESS)


def _fish() -> Iterator[str]:
    for name, summary in COMMANDS.items():
        yield f"complete -c palpate -n __fish_use_subcommand -a {name} -d {_quoted(summary)}"
    for name in COMMANDS:
        for action in _shown(parser_of(name)):
            words = [f"complete -c palpate -n '__fish_seen_subcommand_from {name}'"]
            words += [
                f"-{'l' if flag.startswith('--') else 's'} {flag.lstrip('-')}"
                for flag in action.option_strings
            ]
            if action.choices:
                words.append(
                    f"-{'x ' if action.option_strings else ''}a {_quoted(' '.join(map(str, action.choices)))}"
                )
            if action.option_strings and action.nargs != 0:
                words.append("-r")
            if action.option_strings or action.choices:
                yield " ".join([*words, f"-d {_quoted(told_help(action.help or ''))}"])


def _quoted(text: str) -> str:
    """For fish, in single quotes; a line's worth."""
    text = re.sub(r"\s+", " ", text.replace("%%", "%"))[:80]
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
