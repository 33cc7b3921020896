"""The stopwatch of stages: every moment counts once, and only for who started it."""

from __future__ import annotations

import threading

import pytest

from vslam_ref.support.stopwatch import Stopwatch, stage


class Clock:
    """A clock that is moved by hand."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_an_inner_stage_stops_the_outer_one() -> None:
    clock = Clock()
    with Stopwatch(clock) as watch:
        clock.now += 1
        with stage("a"):
            clock.now += 2
            with stage("b"):
                clock.now += 4
            clock.now += 8
        with stage("a"):
            clock.now += 16
        clock.now += 32
    assert watch.seconds == {"rest": 33.0, "a": 26.0, "b": 4.0}


def test_an_error_ends_its_stage() -> None:
    clock = Clock()

    def fail() -> None:
        with stage("a"):
            clock.now += 1
            raise KeyError

    with Stopwatch(clock) as watch:
        with pytest.raises(KeyError):
            fail()
        clock.now += 2
    assert watch.seconds == {"rest": 2.0, "a": 1.0}


def test_a_stopwatch_inside_another_leaves_it_running() -> None:
    clock = Clock()
    with Stopwatch(clock) as outer:
        with stage("a"), Stopwatch(clock) as inner, stage("b"):
            clock.now += 1
        with stage("c"):
            clock.now += 2
    assert outer.seconds == {"rest": 0.0, "a": 1.0, "c": 2.0}
    assert inner.seconds == {"rest": 0.0, "b": 1.0}


def test_other_threads_are_not_timed() -> None:
    clock = Clock()

    def work() -> None:
        with stage("elsewhere"):
            clock.now += 1

    with Stopwatch(clock) as watch:
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
    assert set(watch.seconds) == {"rest"}
