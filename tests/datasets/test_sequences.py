"""Sequences: every layout gives the pictures, times, camera and truth that were written."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from damaging import mutate
from fuzz_readers import scratch
from sequence_samples import CALIB, COUNT, LAYOUTS, SIZE, START_NS, encoded, place, put, tum, turn, values

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.sequences import PROBLEMS, Sequence, open_sequence, read_camera, write_plain_camera
from vslam_ref.datasets.sequences.films import VideoFile
from vslam_ref.datasets.text import FormatError
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Fov, Pinhole, Radtan
from vslam_ref.support.errors import InputError
from vslam_ref.worlds.rendered import scene

FIRST_TIME = {"plain": 0.0, "kitti": 0.0, "tum": 1341847980.72, "euroc": START_NS / 1e9, "7scenes": 0.0}
STEP = {"plain": 0.05, "kitti": 0.1, "tum": 0.05, "euroc": 0.05, "7scenes": 1 / 30}


@pytest.fixture(params=LAYOUTS)
def layout(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def made(
    tmp_path: Path, layout: str = "plain", change: Callable[[dict[str, bytes]], None] | None = None
) -> Path:
    files = LAYOUTS[layout]()
    if change is not None:
        change(files)
    return put(tmp_path / "made", files)


def poses(sequence: Sequence) -> tuple[np.ndarray, np.ndarray]:
    assert sequence.truth is not None
    return sequence.truth.R_world_body, sequence.truth.t_world_body


# --- what a whole sequence gives


def test_every_layout_gives_what_was_written(tmp_path: Path, layout: str) -> None:
    """Seconds since 1970 have steps of 2.4e-7 s; quaternions of 16 digits give rotations to a few eps."""
    sequence = open_sequence(made(tmp_path, layout))
    assert (sequence.layout, sequence.size, len(sequence)) == (layout, SIZE, COUNT)
    assert isinstance(sequence.camera, Radtan if layout == "euroc" else Pinhole)
    np.testing.assert_array_equal(sequence.camera.params[:4], [30.0, 31.0, 15.5, 11.5])
    np.testing.assert_allclose(
        sequence.times - FIRST_TIME[layout], STEP[layout] * np.arange(COUNT), atol=5e-7
    )
    grey_only = layout in ("kitti", "euroc")
    for k, image in enumerate(sequence):
        assert (image.number, image.time, image.problem) == (k, sequence.times[k], "")
        assert image.grey is not None
        if grey_only:
            assert image.colour is None
            np.testing.assert_array_equal(image.grey, values(k, colours=False))
        else:
            np.testing.assert_array_equal(image.colour, values(k))
            weighted = values(k) @ np.array([0.299, 0.587, 0.114])
            assert np.abs(image.grey - weighted).max() <= 0.5 + 0.02  # coefficients of 14 bits
    R, t = poses(sequence)
    T = se3.from_rt(np.stack([turn(k) for k in range(COUNT)]), np.stack([place(k) for k in range(COUNT)]))
    if layout == "euroc":  # T_BS of the file, from the body's axes to the camera's
        T = T @ np.array([[0.0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])
    np.testing.assert_allclose(R, T[:, :3, :3], atol=1e-13)
    np.testing.assert_allclose(t, T[:, :3, 3], atol=1e-13)
    pairs = sequence.pairs()
    np.testing.assert_array_equal(pairs.estimate, np.arange(COUNT))
    np.testing.assert_array_equal(pairs.truth, np.arange(COUNT))


def test_notes_of_whole_sequences_are_empty_but_for_assumed_times(tmp_path: Path, layout: str) -> None:
    sequence = open_sequence(made(tmp_path, layout))
    list(sequence)
    assumed = ("no times: picture k, from 0, is at k/30 s",) if layout == "7scenes" else ()
    assert sequence.notes == assumed


def test_pictures_come_in_any_order_and_in_parts(tmp_path: Path) -> None:
    sequence = open_sequence(made(tmp_path))
    for k in (7, 0, 11, 7):
        np.testing.assert_array_equal(sequence.image(k).colour, values(k))
    part = sequence.part(2, 9, 3)
    assert [(image.number, image.time) for image in part] == [(k, sequence.times[k]) for k in (2, 5, 8)]
    assert len(sequence.part(3)) == COUNT - 3
    assert len(sequence.part(0, 1000)) == COUNT
    for wrong in (-1, COUNT):
        with pytest.raises(IndexError, match=f"picture {wrong} of .*: has 0 to 11"):
            sequence.image(wrong)
    with pytest.raises(
        ValueError, match=r"from 12 to 12 in steps of 1 of .*: no picture; it has pictures 0 to 11"
    ):
        sequence.part(12)


def test_euroc_is_found_from_each_of_its_folders(tmp_path: Path) -> None:
    folder = made(tmp_path, "euroc")
    for inner in (folder, folder / "mav0", folder / "mav0" / "cam0"):
        assert (open_sequence(inner).layout, len(open_sequence(inner))) == ("euroc", COUNT)


def test_kitti_poses_in_the_benchmarks_place(tmp_path: Path) -> None:
    folder = put(tmp_path / "sequences" / "07", LAYOUTS["kitti"]())
    (tmp_path / "poses").mkdir()
    (folder / "poses.txt").rename(tmp_path / "poses" / "07.txt")
    (folder / "image_0").rename(folder / "image_2")
    sequence = open_sequence(folder)
    assert (sequence.truth_from, len(poses(sequence)[1])) == ("07.txt", COUNT)
    assert sequence.notes == ("the poses are those of camera 0, beside this one",)


def test_values_of_16_bits_and_other_kinds_of_files(tmp_path: Path) -> None:
    """v * 257 + d of 16 bits, |d| <= 128, is v: the nearest of 256 levels."""
    rng = np.random.default_rng(0)
    for bits16 in (False, True):
        for suffix in (".png", ".tiff", ".pgm"):

            def change(files: dict[str, bytes], suffix: str = suffix, bits16: bool = bits16) -> None:
                for k in range(COUNT):
                    del files[f"images/{k:06d}.png"]
                    grey = values(k, colours=False)
                    if bits16:
                        d = rng.integers(-128, 129, grey.shape)
                        grey = np.clip(257 * grey.astype(int) + d, 0, 65535).astype(np.uint16)
                    files[f"images/{k:06d}{suffix}"] = cv2.imencode(suffix, grey)[1].tobytes()

            shutil.rmtree(tmp_path / "made", ignore_errors=True)
            sequence = open_sequence(made(tmp_path, change=change))
            told = "values of 16 bits: 0 to 65535 became 0 to 255"
            assert sequence.notes == ((told,) if bits16 else ())
            for k in (0, 5):
                np.testing.assert_array_equal(sequence.image(k).grey, values(k, colours=False))
                assert sequence.image(k).colour is None


def test_numbers_in_names_decide_the_order(tmp_path: Path) -> None:
    files = {f"shot{k}.png": encoded(k) for k in range(COUNT)}  # shot10 after shot9
    sequence = open_sequence(put(tmp_path, files), camera_needed=False)
    assert [int(image.colour[0, 0, 0]) for image in sequence] == [7 * k for k in range(COUNT)]
    assert sequence.camera is None
    stamps = {f"{t}.png": encoded(k) for k, t in enumerate(("5.07", "5.5", "10.25"))}
    sequence = open_sequence(put(tmp_path / "stamps", stamps), camera_needed=False)
    assert [int(image.colour[0, 0, 0]) for image in sequence] == [0, 7, 14]


# --- times


def test_times_are_assumed_given_or_read(tmp_path: Path) -> None:
    folder = made(tmp_path, change=lambda files: [files.pop(n) for n in ("times.txt", "groundtruth_tum.txt")])
    assumed = open_sequence(folder)
    np.testing.assert_allclose(assumed.times, np.arange(COUNT) / 30, rtol=1e-15)
    assert assumed.notes == ("no times: picture k, from 0, is at k/30 s",)
    rated = open_sequence(folder, rate=12.5)
    np.testing.assert_allclose(rated.times, np.arange(COUNT) / 12.5, rtol=1e-15)
    assert rated.notes == ("times by the rate that was given: picture k, from 0, is at k/12.5 s",)
    clock = tmp_path / "clock.txt"
    clock.write_text("".join(f"{k * k}\n" for k in range(COUNT)))
    np.testing.assert_array_equal(open_sequence(folder, times=clock).times, np.arange(COUNT) ** 2)
    with pytest.raises(InputError, match="both a file of times and a rate"):
        open_sequence(folder, times=clock, rate=3.0)
    for rate in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match=r"rate .*: need pictures a second, more than 0"):
            open_sequence(folder, rate=rate)
    clock.write_text("1\n2\n")
    with pytest.raises(FormatError, match=r"clock.txt: 2 times for 12 pictures; expected one for each"):
        open_sequence(folder, times=clock)


def test_equal_stamps_are_told_and_only_the_first_is_paired(tmp_path: Path) -> None:
    stamps = [0.0, 0.1, 0.1, 0.1, *(0.1 * k for k in range(2, 10))]

    def change(files: dict[str, bytes]) -> None:
        files["times.txt"] = "".join(f"{t!r}\n" for t in stamps).encode()
        files["groundtruth_tum.txt"] = tum(sorted(set(stamps))).encode()

    sequence = open_sequence(made(tmp_path, change=change))
    assert sequence.notes == ("2 time(s) equal to the one before, first at picture 2",)
    pairs = sequence.pairs()
    assert pairs.estimate.tolist() == [0, 1, *range(4, 12)]
    assert pairs.truth.tolist() == list(range(10))
    assert [image.number for image in sequence] == list(range(COUNT))


def test_stamps_that_fall_are_told_and_the_order_stays(tmp_path: Path) -> None:
    stamps = [0.05 * k for k in range(COUNT)]
    stamps[4], stamps[5] = stamps[5], stamps[4]
    text = "".join(f"{t!r}\n" for t in stamps).encode()
    sequence = open_sequence(made(tmp_path, change=lambda files: files.update({"times.txt": text})))
    assert sequence.notes == ("1 time(s) earlier than the one before, first at picture 5",)
    assert [image.time for image in sequence] == stamps
    assert sequence.pairs().estimate.tolist() == [0, 1, 2, 3, 5, 4, 6, 7, 8, 9, 10, 11]


def test_a_truth_that_counts_pictures_gives_them_their_times(tmp_path: Path) -> None:
    def change(files: dict[str, bytes]) -> None:
        del files["times.txt"]
        files["groundtruth_tum.txt"] = tum([float(k) for k in range(COUNT)]).encode()

    folder = made(tmp_path, change=change)
    sequence = open_sequence(folder)
    np.testing.assert_array_equal(sequence.times, np.arange(COUNT))
    assert "no times: those of the pictures are their numbers, as in groundtruth_tum.txt" in sequence.notes
    rated = open_sequence(folder, rate=10.0)  # the truth keeps its pictures
    assert rated.pairs().truth.tolist() == list(range(COUNT))


def test_a_truth_of_a_part_is_told_and_one_can_be_given(tmp_path: Path) -> None:
    folder = made(
        tmp_path, change=lambda f: f.update({"groundtruth_tum.txt": tum([0.05, 0.1, 0.15]).encode()})
    )
    sequence = open_sequence(folder)
    told = "9 of 12 pictures with different times (75 %) have no true pose within 0.01 s"
    assert sequence.notes == (f"{told}: 1 before the truth begins; 8 after it ends",)
    given = tmp_path / "poses.txt"
    shutil.copy(put(tmp_path / "kitti", LAYOUTS["kitti"]()) / "poses.txt", given)
    other = open_sequence(folder, truth=given)
    assert (other.truth_from, other.pairs().truth.tolist()) == (str(given), list(range(COUNT)))
    given.write_text("".join(given.read_text().splitlines(keepends=True)[:5]))
    with pytest.raises(FormatError, match=r"poses.txt: 5 poses without times for 12 pictures"):
        open_sequence(folder, truth=given)
    (folder / "groundtruth_tum.txt").rename(folder / "colmap_trajectory_tum.txt")
    assert "is COLMAP's reconstruction, not an independent truth" in open_sequence(folder).notes[0]
    (folder / "colmap_trajectory_tum.txt").unlink()
    assert open_sequence(folder).truth is None
    with pytest.raises(ValueError, match="has no true trajectory"):
        open_sequence(folder).pairs()


def test_what_is_odd_in_a_truth_reaches_the_notes(tmp_path: Path) -> None:
    """A lost pose, lines out of order: in the truth beside the pictures, in a given one, of matrices."""
    lines = tum([0.1 * k for k in range(COUNT)]).splitlines()
    lost = " ".join([lines[3].split()[0], *["nan"] * 7])
    odd = "\n".join([*lines[:3], lost, *lines[4:7], lines[8], lines[7], *lines[9:]])
    folder = made(tmp_path, change=lambda f: f.update({"groundtruth_tum.txt": odd.encode()}))
    given = tmp_path / "given.txt"
    given.write_text(odd)
    for options, name in (({}, "groundtruth_tum.txt"), ({"truth": given}, str(given))):
        told = [note for note in open_sequence(folder, rate=10.0, **options).notes if note.startswith(name)]
        assert [note.partition(": ")[2][:30] for note in told] == [
            "1 line of 12 without a pose (n",
            "the time goes back once (first",
        ]
    kitti = put(tmp_path / "kitti", LAYOUTS["kitti"]())
    rows = (kitti / "poses.txt").read_text().splitlines()
    (kitti / "poses.txt").write_text("\n".join([*rows[:5], " ".join(["nan"] * 12), *rows[6:]]))
    for sequence in (open_sequence(kitti), open_sequence(folder, truth=kitti / "poses.txt")):
        assert sequence.pairs().estimate.tolist() == [k for k in range(COUNT) if k != 5]
        assert any("1 line of 12 without a pose" in note for note in sequence.notes)


def test_a_wrong_rate_is_told_with_the_one_that_fits(tmp_path: Path) -> None:
    folder = made(
        tmp_path,
        change=lambda f: (
            f.pop("times.txt", None),
            f.update({"groundtruth_tum.txt": tum([0.04 * k + 0.015 for k in range(COUNT)]).encode()}),
        )[1],
    )
    note = open_sequence(folder, rate=10.0).notes[-1]
    assert "the pictures last 1.1 s, the truth 0.44 s: they last as long with --rate 25" in note
    assert "--rate" not in open_sequence(folder, rate=25.0).notes[-1]
    assert "--max-difference" not in note  # which the command does not have


# --- pictures that are none


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


BAD = {
    "missing": (None, "missing: ", "no such file"),
    "half-written": (cut(encoded(5)), "damaged: ", "the picture is cut off or damaged"),
    "half-written JPEG": (cut(encoded(5, ".jpg")), "damaged: ", ""),
    "empty": (b"", "damaged: ", "no image that can be read"),
    "another kind of file": (b"%PDF-1.4", "damaged: ", "no image that can be read"),
    "a head that promises 10^12 pixels": (
        b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + (10**6).to_bytes(4, "big") * 2 + b"\x08\0\0\0\0" + bytes(4),
        "damaged: ",
        "pixels; at most",
    ),
    "half the size": (cv2.imencode(".png", values(5)[::2, ::2])[1].tobytes(), "wrong size: ", "16x12 pixels"),
    "turned": (cv2.imencode(".png", values(5).swapaxes(0, 1).copy())[1].tobytes(), "wrong size: ", "24x32"),
    "floats": (cv2.imencode(".tiff", values(5).astype(np.float32))[1].tobytes(), "damaged: ", "are float32"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
@pytest.mark.parametrize("layout", ["plain", "kitti", "tum", "euroc"])
def test_a_bad_picture_is_a_record_that_says_so(tmp_path: Path, layout: str, what: str) -> None:
    data, kind, words = BAD[what]
    folder = made(tmp_path, layout)
    bad = sorted(folder.rglob("*.png"))[5]
    bad.unlink() if data is None else bad.write_bytes(data)
    sequence = open_sequence(folder)
    images = list(sequence)
    assert [image.number for image in images] == list(range(COUNT))
    assert images[5].grey is None
    assert images[5].colour is None
    assert images[5].problem.startswith(kind)
    assert words in images[5].problem
    assert all(image.grey is not None and not image.problem for k, image in enumerate(images) if k != 5)
    word = kind.rstrip(": ")
    assert word in PROBLEMS
    assert sequence.notes[-1] == f"1 picture(s) {word}: number 5"
    list(sequence)  # reading again does not count again
    assert sequence.notes[-1] == f"1 picture(s) {word}: number 5"
    assert sequence.image(6).time == sequence.times[6]  # those behind keep their times
    assert len(poses(sequence)[1]) == COUNT


@pytest.mark.parametrize("level", [0, 128, 255])
def test_a_blank_picture_is_given_and_told(tmp_path: Path, level: int) -> None:
    blank = cv2.imencode(".png", np.full((24, 32, 3), level, np.uint8))[1].tobytes()
    sequence = open_sequence(made(tmp_path, change=lambda files: files.update({"images/000003.png": blank})))
    image = sequence.image(3)
    assert image.problem == f"blank: every grey value is {level}"
    assert image.grey is not None
    assert (image.grey == level).all()
    assert sequence.notes == ("1 picture(s) blank: number 3",)


def test_many_bad_pictures_are_counted_by_kind(tmp_path: Path) -> None:
    folder = made(tmp_path)
    for k in range(1, 8):
        (folder / "images" / f"{k:06d}.png").write_bytes(b"")
    (folder / "images" / "000009.png").unlink()
    sequence = open_sequence(folder)
    assert sum(image.grey is None for image in sequence) == 8
    assert sequence.notes == (
        "1 picture(s) missing: number 9",
        "7 picture(s) damaged: number 1, 2, 3, 4, 5, …",
    )


def test_the_first_picture_may_be_the_bad_one(tmp_path: Path) -> None:
    small = cv2.imencode(".png", values(0)[::2, ::2])[1].tobytes()
    sequence = open_sequence(made(tmp_path, change=lambda files: files.update({"images/000000.png": small})))
    assert sequence.size == SIZE
    assert [image.problem.partition(":")[0] for image in sequence] == ["wrong size", *[""] * 11]


def test_missing_pictures_without_times_keep_the_later_ones_at_their_time(tmp_path: Path) -> None:
    folder = made(tmp_path, "7scenes")
    (folder / "frame-000004.color.png").unlink()
    sequence = open_sequence(folder)
    assert len(sequence) == COUNT
    assert sequence.image(4).problem.startswith("missing: ")
    assert sequence.image(5).time == pytest.approx(5 / 30, rel=1e-15)
    np.testing.assert_array_equal(sequence.image(5).colour, values(5))


def test_every_fourth_picture_is_whole_if_there_is_a_time_for_each(tmp_path: Path) -> None:
    files = LAYOUTS["plain"]() | {f"images/{4 * k:06d}.png": encoded(k) for k in range(COUNT)}
    for k in range(COUNT):
        if k % 4:
            del files[f"images/{k:06d}.png"]
    folder = put(tmp_path, files)
    assert len(open_sequence(folder)) == COUNT
    (folder / "times.txt").write_text("1\n2\n")
    with pytest.raises(FormatError, match=r"times.txt: 2 times for 12 pictures; expected one for each"):
        open_sequence(folder)


# --- what makes the whole useless


def test_no_camera_asks_for_one(tmp_path: Path) -> None:
    folder = made(tmp_path, change=lambda files: files.pop("calib.txt"))
    with pytest.raises(
        InputError, match=r"made: no camera beside the pictures.*give --camera FILE; it may be calib"
    ) as e:
        open_sequence(folder)
    assert "\n" not in str(e.value)
    assert open_sequence(folder, camera_needed=False).camera is None
    assert open_sequence(folder, camera=Fov(20.0, 20.0, 16.0, 12.0, 0.9)).camera == Fov(
        20.0, 20.0, 16.0, 12.0, 0.9
    )
    camera = tmp_path / "calib.txt"
    camera.write_text(CALIB)
    assert open_sequence(folder, camera=camera).camera_from == str(camera)


CAMERAS = {
    "opencv.yaml": "camera_model: fov\ncamera_matrix: {rows: 3, cols: 3, data: [30,0,15,0,31,11,0,0,1]}\n"
    "distortion_coefficients: {rows: 1, cols: 1, data: [0.9]}\nimage_width: 32\nimage_height: 24\n",
    "kalibr.yaml": "cam0:\n  camera_model: pinhole\n  intrinsics: [30, 31, 15, 11]\n  distortion_model: fov\n"
    "  distortion_coeffs: [0.9]\n  resolution: [32, 24]\n",
    "camera.cfg": "Camera.Parameters=[ 0.9375 1.2916666666666667 0.484375 0.4791666666666667 0.9 ]\n",
    "camera.txt": "30 31 15 11 0.9\n32 24\ncrop\n32 24\n",
}


@pytest.mark.parametrize("name", CAMERAS)
def test_every_camera_file_is_told_by_its_content(tmp_path: Path, name: str) -> None:
    """The four files say the same: 15 px = (0.484375 * 32) - 0.5 in PTAM's way."""
    path = tmp_path / "a_name_that_says_nothing"
    path.write_text(CAMERAS[name])
    camera = open_sequence(made(tmp_path), camera=path).camera
    assert isinstance(camera, Fov)
    np.testing.assert_allclose(camera.params, [30.0, 31.0, 15.0, 11.0, 0.9], atol=1e-13)


def test_euroc_and_kitti_cameras_and_what_is_written(tmp_path: Path) -> None:
    for layout, file in (("euroc", "mav0/cam0/sensor.yaml"), ("kitti", "calib.txt")):
        folder = put(tmp_path / layout, LAYOUTS[layout]())
        assert read_camera(folder / file, SIZE).camera.params[:4].tolist() == [30.0, 31.0, 15.5, 11.5]
    camera = Pinhole(1 / 3, 2 / 3, 0.1, 0.7)
    write_plain_camera(tmp_path / "c.txt", camera, (2, 3))
    assert read_camera(tmp_path / "c.txt", (2, 3)).camera == camera


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("30 31 15 11 64 48", "the camera is for pictures of 64x48 pixels; the pictures have 32x24: give"),
        ("300 310 150 110", "the camera's centre (150, 110) lies outside of the picture"),
        ("30 31 15 11 32.5 24", ":1: size is 32.5 24; expected width and height, whole numbers"),
        ("30 31 15 11 0 24", ":1: size is 0 24"),
        ("-30 31 15 11 32 24", ":1: fx=-30.0"),
        ("30 31 15 x 32 24", ":1: cy is 'x'; expected a number"),
        ("30 31 15 nan 32 24", ":1: cy is 'nan'; expected a finite number"),
        ("30 31 15", ":1: no camera file that is known here; expected one of calib.txt"),
        ("", "no camera file that is known here"),
        ("30 31 15 11 32 24\n1 2 3 4 5 6", ":1: no camera file that is known here"),
        ("P0: 1 2 3", ":1: P0 has 3 numbers; expected 12"),
        ("P0: 30 1 15 0 0 31 11 0 0 0 1 0", ":1: P0 is not fx 0 cx"),
        ("P0: 30 0 15 0 0 -31 11 0 0 0 1 0", ":1: P0: fx=30.0, fy=-31.0"),
        ("P0: 30 0 15 0 0 y 11 0 0 0 1 0", ":1: P0 is 'y'"),
        ("colour: blue\n", "has no camera_matrix"),
    ],
)  # fmt: skip
def test_a_wrong_camera_file_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    folder = made(tmp_path, change=lambda files: files.update({"calib.txt": text.encode()}))
    with pytest.raises(FormatError) as caught:
        open_sequence(folder)
    assert str(caught.value).startswith(str(folder / "calib.txt"))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


LISTS = [
    ("tum", "rgb.txt", "# a\n", "no picture; expected lines of time and name"),
    ("tum", "rgb.txt", "1.0\n", ":1: 1 column; expected 2: time, name of a picture"),
    ("tum", "rgb.txt", "x rgb/a.png\n", ":1: time is 'x'; expected a number"),
    ("tum", "rgb.txt", "1e300 rgb/a.png\n", ":1: time is 1e300 s; expected less than 1e+12"),
    ("tum", "rgb.txt", "1 ../../b/a.png\n", ":1: picture '../../b/a.png'; expected the name of a file in"),
    ("tum", "rgb.txt", "1 /etc/a.png\n", ":1: picture '/etc/a.png'"),
    ("tum", "rgb.txt", "1 rgb/a.mp4\n", ":1: picture 'rgb/a.mp4'; expected one of .bmp"),
    ("tum", "rgb.txt", "1 a\0.png\n", ":1: picture 'a"),
    ("euroc", "mav0/cam0/data.csv", "#\n", "no picture; expected lines of time [ns] and name"),
    ("euroc", "mav0/cam0/data.csv", "1\n", ":1: 1 columns; expected 2: time [ns], name of a picture"),
    ("euroc", "mav0/cam0/data.csv", "1.5,a.png\n", ":1: time [ns] is '1.5'; expected whole nanoseconds"),
    ("euroc", "mav0/cam0/data.csv", f"{'9' * 30},a.png\n", "expected whole nanoseconds"),
    ("euroc", "mav0/cam0/data.csv", "1,../a.png\n", ":1: picture '../a.png'; expected the name of a file in"),
    ("plain", "times.txt", "", "no data; expected lines of time"),
    ("plain", "times.txt", "1\n2 3\n", ":2: 2 columns; expected 1: time"),
    ("plain", "times.txt", "1\ninf\n", ":2: time is 'inf'; expected a finite number"),
    ("plain", "times.txt", "1e13\n", ":1: time is 1e+13 s; expected less than 1e+12"),
    ("plain", "groundtruth_tum.txt", "1 2 3\n", ":1: 3 columns; expected 8"),
    ("kitti", "poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n", "1 poses for 12 pictures; expected one for each"),
    ("7scenes", "frame-000003.pose.txt", "1 0 0 0\n", "1 rows, or a last one that is not 0 0 0 1; expected"),
    ("7scenes", "frame-000003.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n", "no rotation"),
    ("7scenes", "frame-000003.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1.1 0\n0 0 0 1\n", "(R^T R is 0.21 off"),
    ("7scenes", "frame-000003.pose.txt", "1 0 0 1e13\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", "a position of"),
]  # fmt: skip


@pytest.mark.parametrize(("layout", "file", "text", "words"), LISTS)
def test_a_malformed_list_is_one_line(tmp_path: Path, layout: str, file: str, text: str, words: str) -> None:
    folder = made(tmp_path, layout, lambda files: files.update({file: text.encode()}))
    with pytest.raises(FormatError) as caught:
        open_sequence(folder)
    assert str(caught.value).startswith(str(folder / file))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_pose_may_be_missing_or_a_truth_without_camera_left_out(tmp_path: Path) -> None:
    folder = made(tmp_path, "7scenes")
    (folder / "frame-000003.pose.txt").unlink()
    sequence = open_sequence(folder)
    assert sequence.pairs().estimate.tolist() == [0, 1, 2, *range(4, COUNT)]
    assert "1 picture(s) without a pose" in sequence.notes
    folder = put(tmp_path / "euroc", LAYOUTS["euroc"]())
    camera = tmp_path / "c.txt"
    camera.write_text(CALIB)
    (folder / "mav0/cam0/sensor.yaml").unlink()
    sequence = open_sequence(folder, camera=camera)
    assert sequence.truth is None
    assert "truth left out: it is the body's" in sequence.notes[0]


def test_what_is_no_source_is_said(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"no folder, video, scene or data set 'alva_desc' \(did you mean 'alva_desk'\?\)"
    ):
        open_sequence("alva_desc")
    for odd in ("", "a\0b", "x" * 5000):
        with pytest.raises(InputError, match="no folder, video, scene or data set"):
            open_sequence(odd)
    with pytest.raises(FormatError, match=r"no sequence of pictures; expected images/, image_0/, rgb.txt"):
        open_sequence(tmp_path)
    (tmp_path / "images").mkdir()
    with pytest.raises(FormatError, match=r"images: no picture in this folder"):
        open_sequence(tmp_path)
    (tmp_path / "notes.txt").write_text("words")
    with pytest.raises(FormatError, match=r"notes.txt: no video by its name"):
        open_sequence(tmp_path / "notes.txt")
    for k in range(3):
        (tmp_path / "images" / f"{k}.png").write_bytes(b"no picture")
    with pytest.raises(FormatError, match=r"none of 3 pictures can be read"):
        open_sequence(tmp_path, camera_needed=False)


def test_hidden_files_and_folders_are_no_pictures(tmp_path: Path) -> None:
    folder = made(tmp_path)
    (folder / "images" / "._000001.png").write_bytes(b"a copy of a Mac's")
    (folder / "images" / "x.png").mkdir()
    assert len(open_sequence(folder)) == COUNT


@pytest.mark.parametrize("layout", LAYOUTS)
def test_damaged_sequences_run_to_their_end_or_are_refused_in_one_line(layout: str) -> None:
    """One file of 12 pictures and their lists is damaged each time."""
    with scratch() as root:
        folder = put(root, LAYOUTS[layout]())
        files = {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
        texts = [path for path in files if path.suffix != ".png"]
        ended = 0
        for k in range(60):
            rng = np.random.default_rng([k, len(layout)])
            path = (texts if k % 2 else list(files))[rng.integers(len(texts) if k % 2 else len(files))]
            path.write_bytes(mutate(files[path], rng, binary=path.suffix == ".png").data)
            try:
                images = list(open_sequence(folder))
                ended += 1
                assert [image.number for image in images] == list(range(len(images))), k
                assert all(image.problem for image in images if image.grey is None), k
            except (FormatError, InputError) as error:
                assert str(error).isprintable(), k  # noqa: PT017
            path.write_bytes(files[path])
    assert 10 < ended < 60


# --- videos


def film(path: Path, code: str, count: int = COUNT, rate: float = 12.5) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*code), rate, (64, 48))
    if not writer.isOpened():
        pytest.skip(f"this OpenCV writes no {code}")
    for k in range(count):
        writer.write(
            np.full((48, 64, 3), (20 * k, 100, 50), np.uint8) + (np.arange(64)[:, None] % 8).astype(np.uint8)
        )
    writer.release()
    return path


@pytest.mark.parametrize(("name", "code"), [("a.avi", "MJPG"), ("a.webm", "VP80"), ("a.mp4", "mp4v")])
def test_a_video_gives_its_pictures_in_any_order(tmp_path: Path, name: str, code: str) -> None:
    """Compression changes flat colours by some levels; pictures differ by 20.  Stamps are whole ms."""
    camera = Pinhole(60.0, 60.0, 31.5, 23.5)
    sequence = open_sequence(film(tmp_path / name, code), camera=camera)
    assert (sequence.layout, sequence.size, len(sequence)) == ("video", (64, 48), COUNT)
    np.testing.assert_allclose(sequence.times, np.arange(COUNT) / 12.5, atol=1.01e-3)
    for k in (0, 7, 3, 11, 11):
        colour = sequence.image(k).colour
        assert colour is not None
        assert np.abs(colour.mean((0, 1)) - [53.5, 103.5, 20 * k + 3.5]).max() < 8
    assert [image.number for image in sequence] == list(range(COUNT))
    rated = open_sequence(tmp_path / name, camera=camera, rate=5.0)
    assert rated.times[-1] == pytest.approx(11 / 5)


def test_a_video_that_is_cut_off_gives_what_is_left(tmp_path: Path) -> None:
    path = film(tmp_path / "a.avi", "MJPG", 60)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    sequence = open_sequence(path, camera_needed=False)
    assert 20 < len(sequence) < 60
    assert f"the file says 60 pictures; {len(sequence)} can be decoded" in sequence.notes
    for image in sequence:
        assert (image.grey is None) == bool(image.problem)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no video by its first bytes"),
        (b"#EXTM3U\n#EXTINF:1,\nhttp://example.org/a.ts\n", "no video by its first bytes; expected AVI, MP4"),
        (b"ffconcat version 1.0\nfile /etc/passwd\n", "no video by its first bytes"),
        (b"RIFF\0\0\0\0AVI ", "no video that this OpenCV can decode"),
        (b"\0\0\0\x18ftypmp42" + bytes(100), "no video that this OpenCV can decode"),
    ],
)
def test_what_is_no_video_is_refused(
    tmp_path: Path, data: bytes, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.avi"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=words):
        open_sequence(path)
    assert capfd.readouterr().err == ""  # the decoder's words stay inside


# --- scenes


def test_a_rendered_scene_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sequence = open_sequence("rotation:3")
    made = scene("rotation", 3)
    assert (sequence.layout, sequence.size, len(sequence), sequence.notes) == (
        "rendered",
        (640, 480),
        300,
        (),
    )
    assert sequence.camera == made.camera
    np.testing.assert_array_equal(sequence.times, made.times)
    assert sequence.pairs().truth.tolist() == list(range(300))
    np.testing.assert_allclose(poses(sequence)[1], made.trajectory().t_world_body, atol=1e-15)
    np.testing.assert_array_equal(sequence.image(7).grey, made.frame(7))
    assert sequence.image(7).colour is None
    camera = tmp_path / "calib.txt"
    camera.write_text(CALIB)
    with pytest.raises(InputError, match="scene rotation has its own camera: leave --camera out"):
        open_sequence("rotation", camera=camera)
    for wrong in ("rotation:", "rotation:x", "rotation:-1", "rotation:1:2"):
        with pytest.raises(InputError, match="no folder, video, scene or data set"):
            open_sequence(wrong)
    put(tmp_path / "rotation", LAYOUTS["plain"]())  # a folder of that name goes before
    assert open_sequence("rotation").layout == "plain"


# --- real data: numbers that their READMEs publish


@pytest.mark.parametrize(
    ("name", "count", "size", "colours", "poses_known"),
    [
        ("7scenes_redkitchen", 650, (640, 480), True, 650),
        ("new_tsukuba_150", 150, (640, 480), True, 150),
        ("kitti07_head", 80, (1226, 370), False, 80),
        (
            "tum_fr3_office_1hz",
            17,
            (640, 480),
            True,
            16,
        ),  # "the first picture is 0.067 s before the first pose"
        ("alva_desk", 708, (364, 674), True, 172),  # "24 are equal to the one before", 172 lines of COLMAP
    ],
)
def test_known_sequences(
    name: str, count: int, size: tuple[int, int], colours: bool, poses_known: int
) -> None:
    if catalogue.find(name) is None:
        pytest.skip(f"data set {name} not found in VSLAM_REF_DATA")
    sequence = open_sequence(name)
    assert (len(sequence), sequence.size) == (count, size)
    assert len(sequence.pairs().truth) == poses_known
    for k in (0, count - 1):
        image = sequence.image(k)
        assert image.grey is not None
        assert (image.colour is not None) == colours
    told = " ".join(sequence.notes)
    assert ("24 time(s) equal" in told) == (name == "alva_desk")


def test_stamps_of_a_real_video() -> None:
    """Its README: 456 pictures stored, 455 can be decoded; times.txt has the stamp of every fourth."""
    folder = catalogue.find("opencv_box_object")
    if folder is None:
        pytest.skip("data set opencv_box_object not found in VSLAM_REF_DATA")
    video = VideoFile(folder / "box.mp4")
    assert (len(video.times), video.size) == (455, (640, 480))
    assert "the file says 456 pictures; 455 can be decoded" in video.notes
    stamps = np.loadtxt(folder / "times.txt")
    np.testing.assert_allclose(video.times[::4][: len(stamps)], stamps, atol=1e-9)
