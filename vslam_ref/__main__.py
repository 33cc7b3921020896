"""The command ``vslam-ref``, and ``python -m vslam_ref``: Ctrl-C is one line while the program loads, too."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def main() -> int:
    """Load the program and run it; return its exit status.

    Some modules turn an interrupt that comes while they load into another error (Python 3.11 in the body of a
    class).  So it is remembered that there was one.
    """
    heard = []

    def hear(number: int, frame: object) -> None:
        heard.append(number)
        raise KeyboardInterrupt

    try:
        import signal

        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, hear)
        from vslam_ref import cli

        return cli.main()
    except KeyboardInterrupt:
        pass
    except Exception:
        if not heard:
            raise
    sys.stderr.write("\nvslam-ref: interrupted; no file is half-written\n")
    return INTERRUPTED


if __name__ == "__main__":
    raise SystemExit(main())
