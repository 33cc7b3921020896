"""A module as a program: lines of JSON in, lines of JSON out.

    python -m vslam_ref.conformance.serve my_package.adapter      # or my_adapter.py

This is the example of the protocol in Python.  Nothing but replies may go to standard output; what the module
prints is sent to standard error.  Blank lines are skipped; a line that is not a request is answered with an
error, without an id.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterable
from typing import Any, TextIO

from vslam_ref.conformance.program import load_module

Answer = Callable[[str, dict[str, Any]], Any]


def reply(answer: Answer, line: str) -> dict[str, Any]:
    """Answer one line.

    >>> reply(lambda function, inputs: inputs["x"] + 1, '{"id": "a", "function": "f", "inputs": {"x": 1}}')
    {'id': 'a', 'value': 2}
    """
    try:
        request = json.loads(line)
        identity, function, inputs = request["id"], request["function"], request["inputs"]
    except (ValueError, KeyError, TypeError) as error:
        return {"id": None, "error": f"no request: {type(error).__name__}: {error}"}
    try:
        with contextlib.redirect_stdout(sys.stderr):
            return {"id": identity, "value": answer(function, inputs)}
    except NotImplementedError:
        return {"id": identity, "unsupported": True}
    except Exception as error:  # a refusal, or a defect of the adapter: the runner judges
        return {"id": identity, "error": f"{type(error).__name__}: {error}"}


def serve(answer: Answer, requests: Iterable[str], out: TextIO) -> None:
    """Answer until the end of the input; every reply is flushed, as the other side waits for it."""
    for line in requests:
        if line.strip():
            out.write(json.dumps(reply(answer, line)) + "\n")
            out.flush()


def main(arguments: list[str]) -> int:
    """Serve the module that is named."""
    if len(arguments) != 1:
        sys.stderr.write("usage: python -m vslam_ref.conformance.serve MODULE|FILE.py\n")
        return 2
    try:
        answer = load_module(arguments[0]).answer
    except (ImportError, AttributeError) as error:
        sys.stderr.write(f"serve {arguments[0]}: {error}\n")
        return 2
    serve(answer, sys.stdin, sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
