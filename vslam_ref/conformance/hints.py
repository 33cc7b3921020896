"""Why a command cannot be started, and what would be right."""

from __future__ import annotations

import shlex
from pathlib import Path


def unquoted(command: str, words: list[str]) -> str:
    """A hint where two words together are the path of a file: a path with spaces must be quoted."""
    for first in range(len(words)):
        for last in range(len(words), first + 1, -1):
            path = " ".join(words[first:last])
            if Path(path).is_file() and path in command:
                quoted = [*words[:first], shlex.quote(path), *words[last:]]
                return f'; a path with spaces is quoted twice: --program "{" ".join(quoted)}"'
    return ""


def not_executable(error: OSError, word: str) -> str:
    """A hint where a file is there and is not a program."""
    if not Path(word).is_file():
        return ""
    python = f"python {word}" if word.endswith(".py") else f"INTERPRETER {word}"
    return (
        f'; make it executable (chmod +x) with a first line such as #!/usr/bin/env python3, or say "{python}"'
    )
