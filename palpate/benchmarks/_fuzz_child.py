"""The process that runs hostile commands one after another: a line of JSON in, a line of JSON out."""

from __future__ import annotations

import contextlib
import io
import json
import sys
import traceback
from typing import Any


def answer(argv: list[str]) -> dict[str, Any]:
    """What a command answers: exit code, standard error, and the traceback if there is one."""
    from palpate import cli

    said, error = io.StringIO(), io.StringIO()
    code: Any = None
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(error):
        try:
            code = cli.main(argv)
        except SystemExit as end:
            code = end.code
        except BaseException:
            return {"code": None, "error": error.getvalue(), "traceback": traceback.format_exc(limit=-3)}
    return {"code": code, "error": error.getvalue(), "traceback": ""}


def main() -> None:
    """Answer until the input ends."""
    out = sys.stdout
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), file=out, flush=True)


if __name__ == "__main__":
    main()
