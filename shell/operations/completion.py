"""Print the script with which a shell completes commands, options and their values.

    eval "$(palpate completion bash)"     # in ~/.bashrc
    eval "$(palpate completion zsh)"      # in ~/.zshrc, after compinit
    palpate completion fish | source      # in ~/.config/fish/config.fish

The shell then asks the program itself (argcomplete), so that what it offers is always up to date.
"""

from __future__ import annotations

import argparse
from typing import Annotated

from palpate.operations._declare import argument, operation
from palpate.operations._list import commands
from palpate.operations._to_argparse import add_operation

SHELLS = ("bash", "zsh", "fish")


@operation(progress=False, json=False)
def completion(shell: Annotated[str, argument("whose script is printed", choices=SHELLS)]) -> str:
    """The script of one shell."""
    import argcomplete

    return argcomplete.shellcode(["palpate"], shell=shell)


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
