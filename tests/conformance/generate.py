"""Make the conformance vectors anew, or compare the files with what the generator makes.

python tests/conformance/generate.py [--topic so3] [--out DIR] [--check]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from generator.writing import generate


def main(arguments: list[str] | None = None) -> int:
    """Status 1 where --check finds a file that differs, 2 for bad use."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--topic", metavar="T", action="append", default=[], help="only this; may repeat")
    parser.add_argument("--out", metavar="DIR", type=Path, help="default: the package's own folder")
    parser.add_argument("--check", action="store_true", help="write nothing; status 1 where a file differs")
    options = parser.parse_args(arguments)
    try:
        different = generate(options.out, options.topic, write=not options.check, told=print)
    except ValueError as error:
        print(f"generate: {error}", file=sys.stderr)
        return 2
    return 1 if options.check and different else 0


if __name__ == "__main__":
    sys.exit(main())
