"""What lets a shell complete commands, options and their values.

    eval "$(palpate completion bash)"     # in ~/.bashrc
    eval "$(palpate completion zsh)"      # in ~/.zshrc, after compinit
    palpate completion fish | source      # in ~/.config/fish/config.fish

The shell then asks the program itself (argcomplete), so that what it offers is always up to date.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

from palpate.operations._declare import REQUIRED, Call, operand, operation
from palpate.operations._list import commands
from palpate.operations._to_argparse import add_operation
from palpate.output import Output

SHELLS = ("bash", "zsh", "fish")


@dataclass(frozen=True)
class CompletionOperands:
    """Which shell."""

    shell: str = operand(REQUIRED, "whose script is printed", choices=SHELLS, positional=True)


def _answer(script: str, asked: CompletionOperands, out: Output) -> int:
    print(script)
    return 0


@operation(CompletionOperands, answer=_answer, progress=False, json=False)
def completion(asked: CompletionOperands, call: Call) -> str:
    """The script of one shell."""
    import argcomplete

    return argcomplete.shellcode(["palpate"], shell=asked.shell)


def complete(line: str) -> None:
    """Answer a shell that asks what may come next in `line`, and end the process."""
    import argcomplete

    from palpate.operations._run import command_operation

    parser = argparse.ArgumentParser(prog="palpate")
    parser.add_argument("--version", action="store_true")
    named = parser.add_subparsers()
    typed = line.split()[1:2]
    for name, summary in commands().items():
        command = named.add_parser(name, help=summary)
        if typed == [name]:
            add_operation(command, command_operation(name)[0])
    argcomplete.autocomplete(parser)
