"""A module as a program: lines of JSON in, lines of JSON out.

    python -m vslam_ref.conformance.serve my_package.adapter      # or my_adapter.py

This is the example of the protocol in Python.  Nothing but replies may go to standard output; what the module
prints, in Python or below it, goes to standard error.  Blank lines are skipped; a line that is not a request
is answered with an error, without an id.

``vslam-ref verify --module`` runs the same in a child process (:func:`child`), which first says whether the
module could be imported.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Callable, Iterable
from typing import Any, TextIO

from vslam_ref.conformance.loading import load_module
from vslam_ref.conformance.replies import clean, raised, sentence

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
        return {"id": None, "error": f"no request: {raised(error)}"}
    try:
        with contextlib.redirect_stdout(sys.stderr):
            value = answer(function, inputs)
    except NotImplementedError:
        return {"id": identity, "unsupported": True}
    except Exception as error:  # a refusal, or a defect of the adapter: the runner judges
        return {"id": identity, "error": raised(error)}
    except BaseException as error:  # sys.exit and the like: no refusal
        return {"id": identity, "unusable": f"it wants to end the program: {raised(error)}"}
    try:
        return {"id": identity, "value": clean(value)}
    except (ValueError, RecursionError) as error:
        return {"id": identity, "unusable": f"the value: {sentence(error)}"}


def serve(answer: Answer, requests: Iterable[str], out: TextIO) -> None:
    """Answer until the end of the input; every reply is flushed, as the other side waits for it."""
    for line in requests:
        if line.strip():
            out.write(json.dumps(reply(answer, line)) + "\n")
            out.flush()


def load(name: str) -> Answer:
    """The function ``answer`` of a module; ImportError where there is none."""
    with contextlib.redirect_stdout(sys.stderr):
        answer: Answer | None = getattr(load_module(name), "answer", None)
    if not callable(answer):
        raise ImportError("it has no function answer(function, inputs)")
    return answer


def own_streams() -> tuple[TextIO, TextIO]:
    """Requests and replies; what else is read is empty, and what else is printed goes to standard error."""
    requests = os.fdopen(os.dup(0), "r", encoding="utf-8")
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8", newline="\n")
    with open(os.devnull) as nothing:
        os.dup2(nothing.fileno(), 0)
    os.dup2(2, 1)
    return requests, replies


def child(name: str) -> int:
    """Serve a module, and first say whether it could be imported."""
    requests, replies = own_streams()
    try:
        answer, first = load(name), {"id": "ready"}
    except ImportError as error:
        answer, first = None, {"id": "ready", "refused": sentence(error)}
    replies.write(json.dumps(first) + "\n")
    replies.flush()
    if answer is not None:
        serve(answer, requests, replies)
    return 0


def main(arguments: list[str]) -> int:
    """Serve the module that is named."""
    if len(arguments) != 1:
        sys.stderr.write("usage: python -m vslam_ref.conformance.serve MODULE|FILE.py\n")
        return 2
    try:
        answer = load(arguments[0])
    except ImportError as error:
        sys.stderr.write(f"serve {arguments[0]}: {error}\n")
        return 2
    serve(answer, *own_streams())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
