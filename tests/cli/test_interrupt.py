"""Ctrl-C while the program loads, or after its own answer, is one line and status 130."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator

import pytest

from vslam_ref import __main__, cli

LINE = "\nvslam-ref: interrupted; no file is half-written\n"


@pytest.fixture(autouse=True)
def handler() -> Iterator[None]:
    """The answer to Ctrl-C that a fresh interpreter has; what stood before comes back."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_while_a_module_is_loaded(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Interrupted:
        @staticmethod
        def find_spec(name: str, path: object = None, target: object = None) -> None:
            if name == "vslam_ref.cli":
                raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "vslam_ref.cli")
    monkeypatch.delattr("vslam_ref.cli")
    monkeypatch.setattr(sys, "meta_path", [Interrupted, *sys.meta_path])
    assert __main__.main() == 130
    assert capsys.readouterr().err == LINE


def test_an_interrupt_that_a_module_turned_into_another_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Python 3.11 makes a RuntimeError of what ``__set_name__`` raises."""

    class Field:
        def __set_name__(self, owner: type, name: str) -> None:
            signal.raise_signal(signal.SIGINT)

    def run() -> int:
        try:
            type("Loaded", (), {"field": Field()})
        except BaseException as error:
            raise ImportError("a part is missing") from error
        return 0

    monkeypatch.setattr(cli, "main", run)
    assert __main__.main() == 130
    assert capsys.readouterr().err == LINE


def test_other_errors_stay_what_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    def run() -> int:
        raise RuntimeError("of the program")

    monkeypatch.setattr(cli, "main", run)
    with pytest.raises(RuntimeError, match="of the program"):
        __main__.main()


def test_the_status_of_the_program_is_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli, "main", lambda: 1)
    assert __main__.main() == 1
