"""The command ``vslam-ref``, and ``python -m vslam_ref``: Ctrl-C is one line while the program loads, too."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def main() -> int:
    """Load the program and run it; return its exit status."""
    try:
        from vslam_ref import cli

        return cli.main()
    except KeyboardInterrupt:
        pass
    except RuntimeError as error:  # Python 3.11 makes one of an interrupt in the body of a class
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
    sys.stderr.write("\nvslam-ref: interrupted; no file is half-written\n")
    return INTERRUPTED


if __name__ == "__main__":
    raise SystemExit(main())
