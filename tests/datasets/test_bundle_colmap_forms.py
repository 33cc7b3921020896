"""COLMAP's binary form, rigs and frames, lens families, and what is told: against the form's definition."""

from __future__ import annotations

import struct
import tracemalloc
from pathlib import Path

import bundle_samples as samples
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vslam_ref.datasets.bundle_files import BundleFile, read_bundle, read_colmap, write_colmap
from vslam_ref.datasets.bundle_files.colmap.models import BY_NUMBER, FOREIGN, MODELS
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.bundle import Families
from vslam_ref.geometry.cameras import Fisheye, Pinhole, Radtan

TEXTS = samples.colmap_texts()
BINARY = samples.colmap_binary()
EPS = float(np.finfo(float).eps)


def folder_with(folder: Path, files: dict[str, bytes] | dict[str, str]) -> Path:
    folder.mkdir()
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return folder


def same(a: BundleFile, b: BundleFile) -> None:
    """Everything to the last bit."""
    for name in ("T_cam_world", "X_world", "intrinsics"):
        assert (getattr(a.problem.scene, name) == getattr(b.problem.scene, name)).all(), name
    for name in ("view", "point", "uv"):
        assert (getattr(a.problem.seen, name) == getattr(b.problem.seen, name)).all(), name
    assert a.problem.model == b.problem.model
    assert (a.problem.lens_of_view == b.problem.lens_of_view).all()
    for name in ("view_ids", "point_ids", "colours", "image_sizes"):
        assert (getattr(a, name) == getattr(b, name)).all(), name
    assert (a.view_names, a.camera_models) == (b.view_names, b.camera_models)


# --- the binary form -------------------------------------------------------------------------------


def test_both_forms_say_the_same(tmp_path: Path) -> None:
    text, binary = folder_with(tmp_path / "t", TEXTS), folder_with(tmp_path / "b", BINARY)
    same(read_colmap(text), read_bundle(binary))
    assert read_bundle(binary).notes == read_colmap(text).notes


def test_the_binary_form_is_read_where_both_are_there(tmp_path: Path) -> None:
    other = TEXTS | {"images.txt": TEXTS["images.txt"].replace("photo0", "other")}
    both = folder_with(tmp_path / "both", other | BINARY)  # type: ignore[arg-type]
    file = read_colmap(both)
    assert file.view_names[0] == "photo0.jpg"
    assert any("twice: the binary files are read" in note for note in file.notes)
    (both / "points3D.bin").unlink()
    assert read_colmap(both).view_names[0] == "other.jpg"


@pytest.mark.parametrize("binary", [True, False])
def test_a_model_is_written_in_either_form_and_read_back(tmp_path: Path, binary: bool) -> None:
    names = TEXTS["images.txt"].replace("photo0.jpg", "IMG  0001 (1) ä漢.JPG")
    a = read_colmap(folder_with(tmp_path / "b", samples.colmap_binary(TEXTS | {"images.txt": names})))
    (tmp_path / "empty").mkdir()
    for name in ("new", "empty", "empty"):  # an earlier model of the same form is replaced
        write_colmap(tmp_path / name, a, binary=binary)
        b = read_colmap(tmp_path / name)
        assert b.view_names == a.view_names
        assert (b.problem.scene.X_world == a.problem.scene.X_world).all()
        # half a pixel off and on again, and a quaternion made of a matrix: a few roundings
        np.testing.assert_allclose(
            b.problem.scene.T_cam_world, a.problem.scene.T_cam_world, rtol=0, atol=10 * EPS
        )
        np.testing.assert_allclose(b.problem.scene.intrinsics, a.problem.scene.intrinsics, rtol=4 * EPS)
        assert (b.view_ids == a.view_ids).all()
        assert len(b.problem.seen) == len(a.problem.seen)
    ending = ".bin" if binary else ".txt"
    assert {path.suffix for path in (tmp_path / "empty").iterdir()} == {ending}
    with pytest.raises(ValueError, match=r"nor a (binary|text) model alone"):
        write_colmap(tmp_path / "new", a, binary=not binary)


def test_colmap_reads_what_is_written(tmp_path: Path) -> None:
    pycolmap = pytest.importorskip("pycolmap")
    names = TEXTS["images.txt"].replace("photo0.jpg", "IMG 0001.JPG")
    a = read_colmap(folder_with(tmp_path / "b", samples.colmap_binary(TEXTS | {"images.txt": names})))
    write_colmap(tmp_path / "again", a, binary=True)
    theirs = pycolmap.Reconstruction(str(tmp_path / "again"))
    assert {image.name for image in theirs.images.values()} == set(a.view_names)
    for k, key in enumerate(a.view_ids.tolist()):
        ours = a.problem.scene.T_cam_world[k, :3]
        np.testing.assert_allclose(theirs.images[key].cam_from_world().matrix(), ours, rtol=0, atol=20 * EPS)
    written = {key: point.error for key, point in theirs.points3D.items()}
    theirs.update_point_3d_errors()
    for key, point in theirs.points3D.items():
        assert point.error == pytest.approx(written[key], rel=1e-10)


def test_bytes_of_a_name_that_are_no_utf8_are_kept(tmp_path: Path) -> None:
    binary = BINARY | {"images.bin": BINARY["images.bin"].replace(b"photo0", b"ph\xf6to0")}
    file = read_colmap(folder_with(tmp_path / "b", binary))
    write_colmap(tmp_path / "t", file)
    assert b" ph\xf6to0.jpg\n" in (tmp_path / "t" / "images.txt").read_bytes()
    assert read_colmap(tmp_path / "t").view_names == file.view_names


def cut(name: str, size: int) -> dict[str, bytes]:
    return BINARY | {name: BINARY[name][:size]}


def put(name: str, at: int, kind: str, value: float) -> dict[str, bytes]:
    data = BINARY[name]
    packed = struct.pack(kind, value)
    return BINARY | {name: data[:at] + packed + data[at + len(packed) :]}


IMAGE_AT = 8
FEATURES_AT = IMAGE_AT + 64 + len("photo0.jpg") + 1


@pytest.mark.parametrize(
    ("files", "name", "words"),
    [
        (cut("cameras.bin", 0), "cameras.bin", "the file is empty"),
        (cut("cameras.bin", 5), "cameras.bin", "ends after 5 bytes, inside the number of cameras"),
        (cut("cameras.bin", 40), "cameras.bin", "3 cameras need at least 72 bytes; 32 are left"),
        (cut("cameras.bin", 90), "cameras.bin", "inside the parameters of camera 1 of 3 (CAMERA_ID 4)"),
        (put("cameras.bin", 0, "<Q", 2**63), "cameras.bin", "truncated, or a wrong count"),
        (put("cameras.bin", 12, "<i", 99), "cameras.bin", "(CAMERA_ID 4): MODEL_ID is 99; expected 0 to 17"),
        (put("cameras.bin", 12, "<i", -1), "cameras.bin", "MODEL_ID is -1"),
        (put("cameras.bin", 16, "<Q", 2**63), "cameras.bin", "WIDTH is 9223372036854775808"),
        (put("cameras.bin", 32, "<d", np.nan), "cameras.bin", "fx is nan; expected a number of size less"),
        (
            put("cameras.bin", 32, "<d", -5.0),
            "cameras.bin",
            "(CAMERA_ID 4): fx=-5.0, fy=510.0: focal lengths",
        ),
        (BINARY | {"cameras.bin": BINARY["cameras.bin"] + b"ab"}, "cameras.bin", "2 bytes more behind"),
        (put("images.bin", 8, "<I", 2), "images.bin", "image 2 of 3 (IMAGE_ID 2): IMAGE_ID 2 again"),
        (put("images.bin", 12, "<d", 3.0), "images.bin", "(IMAGE_ID 5): quaternion of length 3"),
        (put("images.bin", 12, "<d", np.inf), "images.bin", "(IMAGE_ID 5): QW is inf"),
        (put("images.bin", 68, "<I", 77), "images.bin", "(IMAGE_ID 5): CAMERA_ID is 77"),
        (
            put("images.bin", FEATURES_AT, "<Q", 2**60),
            "images.bin",
            "features of image 1 of 3 (IMAGE_ID 5) need",
        ),
        (put("images.bin", FEATURES_AT + 8, "<d", np.nan), "images.bin", "X of feature 0 is nan"),
        (put("images.bin", FEATURES_AT + 24, "<Q", 2**63), "images.bin", "POINT3D_ID of feature 0 is 9223"),
        (
            put("images.bin", FEATURES_AT + 24, "<Q", 55),
            "images.bin",
            "POINT3D_ID of feature 0 is 55; expected -1",
        ),
        (cut("images.bin", IMAGE_AT + 70), "images.bin", "truncated, or a wrong count"),
        (BINARY | {"images.bin": bytes(8)}, "images.bin", "no image; expected at least one"),
        (put("points3D.bin", 8, "<Q", 7), "points3D.bin", "point 3 of 5 (POINT3D_ID 7): POINT3D_ID 7 again"),
        (put("points3D.bin", 16, "<d", 1e20), "points3D.bin", "(POINT3D_ID 100): X is 1e+20"),
        (
            put("points3D.bin", 51, "<Q", 2**59),
            "points3D.bin",
            "(POINT3D_ID 100): a track of 576460752303423488",
        ),
        (put("points3D.bin", 59, "<I", 6), "points3D.bin", "(POINT3D_ID 100): TRACK names image 6"),
        (put("points3D.bin", 63, "<I", 60), "points3D.bin", "which has point none; expected 100"),
        (BINARY | {"points3D.bin": bytes(8)}, "images.bin", "POINT3D_ID of feature 1 is 100; expected -1"),
    ],
)
def test_a_wrong_binary_model_is_told_in_one_line(
    tmp_path: Path, files: dict[str, bytes], name: str, words: str
) -> None:
    folder = folder_with(tmp_path / "b", files)
    with pytest.raises(FormatError) as caught:
        read_colmap(folder)
    message = str(caught.value)
    assert message.startswith(f"{folder}/{name}: "), message
    assert words in message
    assert "\n" not in message


def test_no_count_takes_memory_that_the_file_does_not_have(tmp_path: Path) -> None:
    """Counts up to 2^64 - 1 at every place of eight bytes: files are read in pieces of a megabyte."""
    folder = folder_with(tmp_path / "b", BINARY)
    tracemalloc.start()
    for name, data in BINARY.items():
        for at in range(0, len(data) - 8, 7):
            for count in (2**64 - 1, 2**40, 2**31):
                (folder / name).write_bytes(data[:at] + struct.pack("<Q", count) + data[at + 8 :])
                try:
                    read_colmap(folder)
                except FormatError:
                    continue
        (folder / name).write_bytes(data)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**22


# --- cameras that no image has, models of other makers ---------------------------------------------


def test_a_camera_without_an_image_may_be_of_any_model(tmp_path: Path) -> None:
    more = TEXTS["cameras.txt"] + "12 THIN_PRISM_FISHEYE 640 480 1 2 3\n13 WHATEVER 1 1\n"
    file = read_colmap(folder_with(tmp_path / "t", TEXTS | {"cameras.txt": more}))
    told = "3 cameras without an image left out (of THIN_PRISM_FISHEYE, WHATEVER, not known here)"
    assert told in file.notes
    extra = struct.pack("<IiQQ16d", 12, 11, 640, 480, *np.full(16, np.nan))
    count = struct.pack("<Q", 4)
    binary = BINARY | {"cameras.bin": count + BINARY["cameras.bin"][8:] + extra}
    file = read_colmap(folder_with(tmp_path / "b", binary))
    assert any("(of RAD_TAN_THIN_PRISM_FISHEYE, not known here)" in note for note in file.notes)


@pytest.mark.parametrize("name", BY_NUMBER)
def test_every_model_of_the_binary_form_has_its_length(tmp_path: Path, name: str) -> None:
    """A camera of each model before the others: were its length wrong, the others would not be read."""
    assert (name in MODELS) != (name in FOREIGN)
    count = len(MODELS[name].parameters) if name in MODELS else FOREIGN[name]
    first = struct.pack(f"<IiQQ{count}d", 3, BY_NUMBER.index(name), 4, 4, *np.ones(count))
    cameras = struct.pack("<Q", 4) + first + BINARY["cameras.bin"][8:]
    file = read_colmap(folder_with(tmp_path / "b", BINARY | {"cameras.bin": cameras}))
    assert file.camera_models == ("OPENCV", "SIMPLE_RADIAL")


# --- lens families ---------------------------------------------------------------------------------


def test_lenses_of_two_families_have_a_block_each(tmp_path: Path) -> None:
    cameras = TEXTS["cameras.txt"].replace(
        "9 SIMPLE_RADIAL 800 600 600.0 400.0 300.0 0.05",
        "9 RADIAL_FISHEYE 800 600 600.0 400.0 300.0 0.05 0.01",
    )
    file = read_colmap(folder_with(tmp_path / "t", TEXTS | {"cameras.txt": cameras}))
    assert file.problem.model == Families((Radtan, Fisheye), (0, 1))
    K = file.problem.scene.intrinsics
    assert K[0].tolist() == [500, 510, 319.5, 239.5, -0.1, 0.02, 0.001, -0.002, 0] + 8 * [0]
    assert K[1].tolist() == 9 * [0] + [600, 600, 399.5, 299.5, 0.05, 0.01, 0, 0]
    write_colmap(tmp_path / "again", file)
    assert (tmp_path / "again/cameras.txt").read_text().splitlines()[1:] == [
        "1 OPENCV 640 480 500.0 510.0 320.0 240.0 -0.1 0.02 0.001 -0.002",
        "2 RADIAL_FISHEYE 800 600 600.0 400.0 300.0 0.05 0.01",
    ]
    again = read_colmap(tmp_path / "again").problem
    assert (again.scene.intrinsics == K).all()
    assert (again.seen.uv == file.problem.seen.uv).all()


def test_the_model_of_a_family_is_that_of_its_own_cameras(tmp_path: Path) -> None:
    """A fisheye beside them does not make pinholes radial-tangential, nor the other way round."""
    cameras = "4 PINHOLE 640 480 500 510 320 240\n9 OPENCV_FISHEYE 800 600 600 600 400 300 0 0 0 0\n"
    file = read_colmap(folder_with(tmp_path / "t", TEXTS | {"cameras.txt": cameras}))
    assert file.problem.model == Families((Pinhole, Fisheye), (0, 1))


# --- rigs and frames -------------------------------------------------------------------------------


def motion(turn: list[float], shift: list[float]) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), shift
    return T


def own_poses() -> list[np.ndarray]:
    return [
        motion(turn, shift)
        for turn, shift in zip(samples.TURNS.tolist(), samples.SHIFTS.tolist(), strict=True)
    ]


RIGHT = own_poses()[1] @ np.linalg.inv(own_poses()[0])
"""The second camera in the rig, so that frames and images agree."""


def rig_folder(folder: Path, binary: bool, T_second: np.ndarray) -> Path:
    rigs = samples.colmap_rigs(T_second)
    if binary:
        return folder_with(folder, BINARY | samples.colmap_rigs_binary(rigs))
    return folder_with(folder, TEXTS | rigs)


@pytest.mark.parametrize("binary", [True, False])
def test_frames_that_agree_change_nothing_and_are_told(tmp_path: Path, binary: bool) -> None:
    plain = read_colmap(folder_with(tmp_path / "t", TEXTS))
    file = read_colmap(rig_folder(tmp_path / "r", binary, RIGHT))
    same(file, plain)
    new = set(file.notes) - set(plain.notes)
    assert len(new) == 1
    assert "tie up to 2 sensors together: here every image moves by itself" in new.pop()


@pytest.mark.parametrize("binary", [True, False])
def test_poses_of_frames_are_taken_where_images_differ(tmp_path: Path, binary: bool) -> None:
    """Reference sensor: the frame's pose; the other: T_sensor_rig T_rig_world."""
    T_second = motion([0.3, -0.2, 0.5], [0.4, 0.1, -0.2])
    file = read_colmap(rig_folder(tmp_path / "r", binary, T_second))
    first, _, third = own_poses()
    expected = [first, T_second @ first, third]
    np.testing.assert_allclose(file.problem.scene.T_cam_world, expected, rtol=0, atol=10 * EPS)
    ending = ".bin" if binary else ".txt"
    told = f"1 of 3 poses in images{ending} differ from those of frames{ending}, by up to"
    assert any(note.startswith(told) and "as COLMAP does" in note for note in file.notes)


def test_frames_without_rigs_and_rigs_without_frames(tmp_path: Path) -> None:
    rigs = samples.colmap_rigs(RIGHT)
    folder = folder_with(tmp_path / "r", TEXTS | rigs)
    (folder / "rigs.txt").unlink()
    frames = (folder / "frames.txt").read_text()
    # the second frame has one camera: its pose is the rig's, and moved here
    (folder / "frames.txt").write_text(frames.replace(" 4.5 1 CAMERA", " 4.75 1 CAMERA"))
    file = read_colmap(folder)
    moved = own_poses()
    moved[2][2, 3] = 4.75
    np.testing.assert_allclose(file.problem.scene.T_cam_world, moved, rtol=0, atol=10 * EPS)
    assert "frames.txt has no pose for 2 images: taken from images.txt" in file.notes
    (folder / "frames.txt").unlink()
    (folder / "rigs.txt").write_text(rigs["rigs.txt"])
    assert "rigs.txt without frames.txt is not used" in read_colmap(folder).notes


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("rigs.txt", "6 2 CAMERA", "6 2 LIDAR", "REF_SENSOR_TYPE is 'LIDAR'"),
        ("rigs.txt", "6 2 CAMERA", "6 3 CAMERA", "the line ends where SENSOR_TYPE is expected"),
        ("rigs.txt", "6 2 CAMERA 4", "6 1 CAMERA 4", "words too many"),
        ("frames.txt", "1 6 ", "1 5 ", "RIG_ID is 5; expected one of rigs.txt"),
        ("frames.txt", "7 6 0.", "7 6 3.", "quaternion of length"),
        ("frames.txt", " 2 CAMERA", " x CAMERA", "NUM_DATA_IDS is 'x'"),
    ],
)
def test_wrong_rigs_are_told_in_one_line(tmp_path: Path, name: str, old: str, new: str, words: str) -> None:
    rigs = samples.colmap_rigs(RIGHT)
    assert old in rigs[name]
    folder = folder_with(tmp_path / "r", TEXTS | rigs | {name: rigs[name].replace(old, new, 1)})
    with pytest.raises(FormatError) as caught:
        read_colmap(folder)
    assert str(caught.value).startswith(f"{folder / name}:")
    assert words in str(caught.value)


def test_colmap_takes_the_same_poses(tmp_path: Path) -> None:
    pycolmap = pytest.importorskip("pycolmap")
    for binary in (True, False):
        folder = rig_folder(tmp_path / f"r{binary}", binary, motion([0.3, -0.2, 0.5], [0.4, 0.1, -0.2]))
        theirs, ours = pycolmap.Reconstruction(str(folder)), read_colmap(folder)
        for k, key in enumerate(ours.view_ids.tolist()):
            T = ours.problem.scene.T_cam_world[k, :3]
            np.testing.assert_allclose(theirs.images[key].cam_from_world().matrix(), T, rtol=0, atol=20 * EPS)


# --- tracks ---------------------------------------------------------------------------------------


def many_points(track_of_first: str, *, odd: int = 1) -> dict[str, str]:
    """Two images of 40 points; the first points have another track than the images say."""
    features = " ".join(f"{10.0 * j} 20.0 {j + 1}" for j in range(40))
    images = "".join(f"{i} 1 0 0 0 {i} 0 5 4 {i}.jpg\n{features}\n" for i in (1, 2))
    rows = [f"{j + 1} 0 0 {j} 1 2 3 0 {track_of_first if j < odd else f'1 {j} 2 {j}'}" for j in range(40)]
    return {
        "cameras.txt": "4 PINHOLE 640 480 500 500 320 240\n",
        "images.txt": images,
        "points3D.txt": "\n".join(rows),
    }


@pytest.mark.parametrize(
    ("track", "notes"),
    [
        ("1 0 2 0", ()),
        ("1 0 2 0 2 0", ()),
        ("1 0", ("1 point whose TRACK differs from images.txt: images.txt is believed",)),
        ("1 0 2 7", ("1 point whose TRACK differs from images.txt: images.txt is believed",)),
        ("1 0 3 0", ("1 point whose TRACK differs from images.txt: images.txt is believed",)),
        ("1 0 2 99", ("1 point whose TRACK differs from images.txt: images.txt is believed",)),
        ("", ("1 point without a TRACK: what sees them is taken from images.txt",)),
    ],
)
def test_a_few_tracks_may_differ_from_the_images(tmp_path: Path, track: str, notes: tuple[str, ...]) -> None:
    file = read_colmap(folder_with(tmp_path / "t", many_points(track)))
    assert file.notes == notes
    assert file.problem.sizes == (2, 40, 80)
    assert file.problem.seen.uv[:3].tolist() == [[-0.5, 19.5], [9.5, 19.5], [19.5, 19.5]]


def test_many_tracks_that_differ_are_of_another_model(tmp_path: Path) -> None:
    assert len(read_colmap(folder_with(tmp_path / "two", many_points("1 0", odd=2))).notes) == 1
    with pytest.raises(FormatError, match=r"points3D\.txt:1: TRACK of point 1 has 1 images, images\.txt 2"):
        read_colmap(folder_with(tmp_path / "three", many_points("1 0", odd=3)))


def test_a_few_features_may_name_points_that_are_gone(tmp_path: Path) -> None:
    texts = many_points("1 0 2 0")
    for gone in (1, 3):
        points = "\n".join(texts["points3D.txt"].split("\n")[gone:])
        folder = folder_with(tmp_path / str(gone), texts | {"points3D.txt": points})
        if gone == 3:
            with pytest.raises(FormatError, match=r"POINT3D_ID of feature 0 is 1; expected -1 or one of"):
                read_colmap(folder)
            continue
        file = read_colmap(folder)
        assert file.notes == ("2 features of a point that points3D.txt does not have left out",)
        assert file.problem.sizes == (2, 39, 78)


# --- poses alone -----------------------------------------------------------------------------------


@pytest.mark.parametrize("points", ["", "# none\n"])
def test_a_model_of_poses_alone_is_read(tmp_path: Path, points: str) -> None:
    lines = [line for line in TEXTS["images.txt"].splitlines() if ".jpg" in line]
    images = "\n\n".join(lines)  # the last empty line is cut off, as editors do
    file = read_colmap(folder_with(tmp_path / "t", TEXTS | {"images.txt": images, "points3D.txt": points}))
    assert file.problem.sizes == (3, 0, 0)
    binary = samples.colmap_binary(
        TEXTS | {"images.txt": "\n\n".join(lines) + "\n\n", "points3D.txt": "# none\n"}
    )
    same(read_colmap(folder_with(tmp_path / "b", binary)), file)
