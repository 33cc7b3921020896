"""NIST's regressions: all parts read, and a line for every damaged file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vslam_ref.datasets import catalogue, nist
from vslam_ref.datasets.nist_models import MODELS
from vslam_ref.datasets.text import FormatError

FOLDER = catalogue.find("nist_nls")
needs_data = pytest.mark.skipif(FOLDER is None, reason="nist_nls is not in VSLAM_REF_DATA")

SMALL = """NIST/ITL StRD
Dataset Name:  Toy               (Toy.dat)
               Starting Values   (lines 11 to 12)
               Certified Values  (lines 11 to 17)
               Data              (lines 19 to 21)
               Lower Level of Difficulty
Model:         Miscellaneous Class
               2 Parameters (b1 and b2)
               y = b1*x
                   + b2  +  e
  b1 =   5           1            2.0E+00  1.0E-01
  b2 =   0.5        -1           -3.0E+00  2.0E-01

Residual Sum of Squares:                    4.0E-01
Residual Standard Deviation:                6.3E-01
Degrees of Freedom:                                 1
Number of Observations:                             3
Data:   y      x
      -1.0E0   1E0
       1.5     2
       3.0     3.0E0
"""


@pytest.fixture
def toy(tmp_path: Path) -> Path:
    path = tmp_path / "Toy.dat"
    path.write_text(SMALL)
    return path


def test_all_parts_are_read(toy: Path) -> None:
    p = nist.read_problem(toy)
    assert (p.name, p.level, p.model) == ("Toy", "Lower", "y = b1*x + b2 + e")
    assert p.y.tolist() == [-1.0, 1.5, 3.0]
    assert p.x.tolist() == [1.0, 2.0, 3.0]
    assert p.starts.tolist() == [[5.0, 0.5], [1.0, -1.0]]
    assert p.certified.tolist() == [2.0, -3.0]
    assert p.deviations.tolist() == [0.1, 0.2]
    assert (p.residual_sum_of_squares, p.residual_deviation) == (0.4, 0.63)
    assert nist.names(toy.parent) == ["Toy"]


@pytest.mark.parametrize("ending", ["\r\n", "\n"])
def test_both_line_ends(toy: Path, ending: str) -> None:
    toy.write_bytes(SMALL.replace("\n", ending).encode())
    assert len(nist.read_problem(toy).y) == 3


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Dataset Name:  Toy ", "Dataset:  Toy ", r"Toy\.dat: 0 lines match 'Dataset Name"),
        (
            "(lines 11 to 12)",
            "(lines 11 to 11)",
            r"3 observations, 1 parameters; 1 degrees of freedom stated",
        ),
        ("(lines 11 to 12)", "(lines 11 to 13)", r":13: ''; expected 'b3 = start start certified deviation'"),
        ("(lines 11 to 12)", "(lines 2 to 12)", r":3: .*expected 'Starting Values \(lines FIRST to LAST\)'"),
        ("(lines 11 to 12)", "(lines 11 to 9999999)", r":3: .*FIRST to LAST"),
        ("(lines 19 to 21)", "(lines 19 to 20)", r":21: text after the data, which end in line 20"),
        ("(lines 19 to 21)", "(lines 20 to 21)", r":19: expected 'Data: y x'"),
        ("(lines 19 to 21)", "(lines 19 to 900000)", r":22: 0 columns; expected 2"),
        ("  b2 = ", "  b3 = ", r":12: .*expected 'b2 = start"),
        ("-3.0E+00  2.0E-01", "-3.0E+00", r":12: .*expected 'b2 = start"),
        ("2.0E-01", "nan", r":12: standard deviation of b2 is 'nan'; expected a finite number"),
        ("2.0E-01", "0", r":12: expected a certified value that is not 0 and a deviation > 0"),
        ("  0.5 ", "  o.5 ", r":12: start 1 of b2 is 'o.5'; expected a number"),
        ("1.5     2", "1.5", r":20: 1 columns; expected 2"),
        ("1.5     2", "1.5     inf", r":20: x is 'inf'; expected a finite number"),
        (
            "Observations:                             3",
            "Observations: 4",
            r"3 lines of data; 4 observations",
        ),
        ("4.0E-01", "-4.0E-01", r":14: Residual Sum of Squares is -4.0E-01; expected a number >= 0"),
        ("Lower Level", "Level", r"0 lines match"),
        ("y = b1*x", "see the manual", r":8: expected the model's formula"),
    ],
)
def test_a_damaged_file_is_refused(toy: Path, old: str, new: str, words: str) -> None:
    assert SMALL.count(old) == 1
    toy.write_text(SMALL.replace(old, new))
    with pytest.raises(FormatError, match=words) as caught:
        nist.read_problem(toy)
    assert "\n" not in str(caught.value)


def test_missing_and_oversized_files(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no such file"):
        nist.read_problem(tmp_path / "None.dat")
    large = tmp_path / "Large.dat"
    large.write_bytes(b"a" * (nist.MAX_BYTES + 1))
    with pytest.raises(FormatError, match="more than 1048576 bytes"):
        nist.read_problem(large)


def test_random_damage_gives_one_line_or_numbers(toy: Path) -> None:
    rng, whole = np.random.default_rng(1), SMALL.encode()
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(rng.integers(1, 4)):
            place = int(rng.integers(len(data)))
            kind = rng.integers(3)
            if kind == 0:
                data[place] = int(rng.integers(256))
            elif kind == 1:
                del data[place : place + int(rng.integers(1, 80))]
            else:
                data[place:place] = data[: int(rng.integers(80))]
        toy.write_bytes(bytes(data))
        try:
            p = nist.read_problem(toy)
        except FormatError as error:
            assert len(str(error).splitlines()) == 1  # noqa: PT017
        else:
            assert np.isfinite(p.y).all()


@needs_data
def test_the_fifteen_problems() -> None:
    assert FOLDER is not None
    assert nist.names(FOLDER) == sorted(MODELS)
    for name in MODELS:
        p = nist.read_problem(FOLDER / f"{name}.dat")
        assert p.name == name
        value = MODELS[name](p.certified, p.x).value
        r = value - (np.log(p.y) if name == "Nelson" else p.y)
        # eleven certified digits of b, times the slopes; Lanczos1 fits to the rounding of its data
        assert np.sum(r**2) == pytest.approx(p.residual_sum_of_squares, rel=1e-8, abs=1e-20), name
        spread = np.sqrt(p.residual_sum_of_squares / (len(p.y) - len(p.certified)))
        assert spread == pytest.approx(p.residual_deviation, rel=1e-9)


def test_a_line_without_end_is_refused_and_not_searched(toy: Path) -> None:
    toy.write_text(SMALL.replace("Lower", "x" * 100_000))
    with pytest.raises(FormatError, match=r":6: a line of 100\d{3} characters; expected at most 500"):
        nist.read_problem(toy)
