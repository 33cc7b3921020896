"""COLMAP's text model and PLY: what the files mean, round trips, every malformation."""

from __future__ import annotations

from pathlib import Path

import bundle_samples as samples
import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.bundle_files import (
    BundleFile,
    read_bal,
    read_bundle,
    read_colmap,
    write_bundle,
    write_colmap,
    write_ply,
)
from vslam_ref.datasets.bundle_files.colmap.models import (
    BY_NUMBER,
    FOREIGN,
    MODELS,
    common_model,
    params_from_colmap,
    params_to_colmap,
)
from vslam_ref.datasets.bundle_files.colmap.writing import mean_errors
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.bundle import BundleProblem, Observations, Scene
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan, Rational

TEXTS = samples.colmap_texts()
BAL = catalogue.find("bal")
EPS = float(np.finfo(float).eps)


def model_folder(tmp_path: Path, **changed: str) -> Path:
    """The sample, files replaced by ``cameras=…``, ``images=…``, ``points3D=…``."""
    texts = TEXTS | {f"{name}.txt": text for name, text in changed.items()}
    return Path(samples.write_colmap_texts(tmp_path / "model", texts))


# --- meaning ---------------------------------------------------------------------------------------


def test_the_problem_has_the_residuals_of_colmaps_formulas(tmp_path: Path) -> None:
    file = read_colmap(model_folder(tmp_path))
    found = {
        (i, j): r
        for i, j, r in zip(
            file.problem.seen.view.tolist(),
            file.problem.seen.point.tolist(),
            samples.residuals(file),
            strict=True,
        )
    }
    assert list(found) == sorted(samples.PAIRS, key=lambda pair: pair[0])
    for pair, noise in zip(samples.PAIRS, samples.NOISE, strict=True):
        np.testing.assert_allclose(found[pair], -noise, rtol=0, atol=1e2 * 100 * EPS)


def test_pixels_are_counted_from_the_centre_of_the_first(tmp_path: Path) -> None:
    file = read_colmap(model_folder(tmp_path))
    assert file.problem.scene.intrinsics[:, 2:4].tolist() == [[319.5, 239.5], [399.5, 299.5]]
    first = TEXTS["images.txt"].splitlines()[2].split()[3:5]
    assert file.problem.seen.uv[0].tolist() == [float(word) - 0.5 for word in first]


def test_what_the_format_carries_besides(tmp_path: Path) -> None:
    file = read_colmap(model_folder(tmp_path))
    assert file.problem.model is Radtan
    assert file.problem.lens_of_view.tolist() == [0, 1, 0]
    assert file.view_names == ("photo0.jpg", "photo1.jpg", "photo2.jpg")
    assert file.view_ids.tolist() == list(samples.IMAGE_IDS)
    assert file.point_ids.tolist() == list(samples.POINT_IDS)
    assert file.camera_models == ("OPENCV", "SIMPLE_RADIAL")
    assert file.image_sizes is not None
    assert file.image_sizes.tolist() == [[640, 480], [800, 600]]
    assert file.colours is not None
    assert file.colours.tolist() == [list(colour) for colour in samples.COLOURS]
    assert file.notes == (
        "3 features without a point left out",
        "1 camera without an image left out",
    )


def test_an_image_that_sees_nothing_has_an_empty_line(tmp_path: Path) -> None:
    images = TEXTS["images.txt"] + "\n# a comment\n77 1 0 0 0 0 0 3 9 a name with blanks.png\n\n"
    file = read_colmap(model_folder(tmp_path, images=images))
    assert file.problem.sizes == (4, 5, 11)
    assert file.view_names[3] == "a name with blanks.png"


@pytest.mark.parametrize(
    ("names", "model"),
    [
        (["SIMPLE_PINHOLE", "PINHOLE"], Pinhole),
        (["PINHOLE", "RADIAL"], Radtan),
        (["FULL_OPENCV", "SIMPLE_PINHOLE"], Rational),
        (["OPENCV_FISHEYE", "RADIAL_FISHEYE"], Fisheye),
        (["FOV"], Fov),
        (["FOV", "PINHOLE"], None),
        (["OPENCV", "OPENCV_FISHEYE"], None),
    ],
)
def test_the_smallest_model_that_says_all(names: list[str], model: type[Camera] | None) -> None:
    assert common_model(names) is model


def test_every_colmap_model_projects_as_colmap_does() -> None:
    """Against COLMAP itself, where it is installed: pixels to a few roundings of 1e3."""
    pycolmap = pytest.importorskip("pycolmap")
    X = np.array([[0.3, -0.2, 1.0], [0.0, 0.0, 2.0], [-0.5, 0.4, 1.1]])
    values = {"omega": 0.9, "f": 500.0, "fx": 500.0, "fy": 510.0, "cx": 320.0, "cy": 240.0}
    small = dict(zip(("k1", "k2", "k3", "k4", "k5", "k6"), (-0.1, 0.02, 0.01, 0.1, 0.03, 0.004), strict=True))
    values |= small | {"p1": 1e-3, "p2": -2e-3}
    known = pycolmap.CameraModelId.__members__
    assert set(known) - {"INVALID"} <= set(MODELS) | set(FOREIGN)
    for name, number in known.items():
        if name in FOREIGN:
            assert FOREIGN[name] == len(pycolmap.Camera.create(1, number, 1.0, 2, 2).params)
        assert name == "INVALID" or BY_NUMBER[int(number)] == name
    for name, (model, parameters) in MODELS.items():
        if name not in known:
            continue
        params = [values[parameter] for parameter in parameters]
        theirs = pycolmap.Camera(model=name, width=640, height=480, params=params).img_from_cam(X)
        ours = model.from_params(params_from_colmap(name, params, model)).project(X)
        np.testing.assert_allclose(ours.uv + 0.5, theirs, rtol=0, atol=1e3 * 20 * EPS, err_msg=name)


# --- writing ---------------------------------------------------------------------------------------


def same(a: BundleFile, b: BundleFile, atol: float) -> None:
    def table(file: BundleFile) -> np.ndarray:
        seen = file.problem.seen
        rows = np.column_stack([file.view_ids[seen.view], file.point_ids[seen.point], seen.uv])
        return rows[np.lexsort(rows[:, :2].T)]

    assert a.problem.sizes == b.problem.sizes
    assert np.abs(a.problem.scene.T_cam_world - b.problem.scene.T_cam_world).max() < 10 * EPS
    assert (a.problem.scene.X_world == b.problem.scene.X_world).all()
    np.testing.assert_allclose(table(b), table(a), rtol=0, atol=atol)
    assert (b.point_ids == a.point_ids).all()


def test_a_model_reads_back_as_it_was_written(tmp_path: Path) -> None:
    a = read_colmap(model_folder(tmp_path))
    write_colmap(tmp_path / "again", a)
    b = read_colmap(tmp_path / "again")
    same(a, b, atol=1e3 * EPS)
    assert b.problem.model is a.problem.model
    np.testing.assert_allclose(b.problem.scene.intrinsics, a.problem.scene.intrinsics, rtol=4 * EPS)
    assert (b.view_names, b.camera_models) == (a.view_names, a.camera_models)
    assert (b.view_ids == a.view_ids).all()
    assert a.image_sizes is not None
    assert a.colours is not None
    assert (b.image_sizes == a.image_sizes).all()
    assert (b.colours == a.colours).all()
    write_colmap(tmp_path / "again", a)  # an old model is replaced
    assert sorted(p.name for p in tmp_path.iterdir()) == ["again", "model"]


def test_a_bal_problem_goes_through_colmap_with_the_same_cost(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(samples.bal_text())
    a = read_bal(tmp_path / "a.txt")
    write_bundle(tmp_path / "out", a)
    b = read_bundle(tmp_path / "out")
    assert b.camera_models == ("RADIAL", "SIMPLE_RADIAL", "RADIAL")
    # half a pixel added and taken away again: 1e3 eps; cost is about 11 * 1.5^2
    assert samples.cost(samples.residuals(b)) == pytest.approx(samples.cost(samples.residuals(a)), rel=1e-11)
    errors = np.hypot(*samples.residuals(a).T)
    point = a.problem.seen.point
    expected = [errors[point == j].mean() for j in range(5)]
    np.testing.assert_allclose(mean_errors(a.problem), expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("camera", "told", "name"),
    [
        (Pinhole(5, 5, 1, 1), "", "SIMPLE_PINHOLE"),
        (Pinhole(5, 5, 1, 1), "PINHOLE", "PINHOLE"),
        (Pinhole(5, 6, 1, 1), "SIMPLE_PINHOLE", "PINHOLE"),
        (Pinhole(5, 5, 1, 1), "OPENCV", "OPENCV"),
        (Radtan(5, 5, 1, 1, 0.1, 0, 0, 0), "", "SIMPLE_RADIAL"),
        (Radtan(5, 5, 1, 1, 0.1, 0.2, 0, 0), "SIMPLE_RADIAL", "RADIAL"),
        (Radtan(5, 6, 1, 1, 0.1, 0, 0, 0), "", "OPENCV"),
        (Radtan(5, 5, 1, 1, 0.1, 0, 0, 0, 0.3), "", "FULL_OPENCV"),
        (Rational(5, 5, 1, 1, 0.1, 0, 0, 0, 0, 0, 0, 0.1), "RADIAL", "FULL_OPENCV"),
        (Fisheye(5, 5, 1, 1, 0.1, 0, 0, 0), "", "SIMPLE_RADIAL_FISHEYE"),
        (Fisheye(5, 6, 1, 1, 0.1, 0, 0, 0), "", "OPENCV_FISHEYE"),
        (Fisheye(5, 5, 1, 1, 0, 0, 0, 0), "", "SIMPLE_RADIAL_FISHEYE"),
        (Fisheye(5, 5, 1, 1, 0, 0, 0, 0), "SIMPLE_FISHEYE", "SIMPLE_FISHEYE"),
        (Fisheye(5, 6, 1, 1, 0, 0, 0, 0), "FISHEYE", "FISHEYE"),
        (Fov(5, 6, 1, 1, 0.0), "PINHOLE", "FOV"),
    ],
)
def test_the_written_model_says_everything_and_no_more(camera: Camera, told: str, name: str) -> None:
    found, values = params_to_colmap(type(camera), camera.params, told)
    assert found == name
    assert params_from_colmap(name, values, type(camera)).tolist() == camera.params.tolist()


def bare(**changes: object) -> BundleFile:
    scene = Scene(np.tile(np.eye(4), (2, 1, 1)), [[0.0, 0.0, 2.0]], [[500.0, 500.0, 320.0, 240.0]])
    seen = Observations([0], [0], [[320.0, 241.0]])
    return BundleFile(BundleProblem(Pinhole, scene, seen), **changes)  # type: ignore[arg-type]


def test_names_sizes_and_colours_are_made_where_there_are_none(tmp_path: Path) -> None:
    write_colmap(tmp_path / "m", bare())
    file = read_colmap(tmp_path / "m")
    assert file.view_names == ("view000000", "view000001")
    assert file.image_sizes is not None
    assert file.image_sizes.tolist() == [[321, 242]]  # pixels 320 and 241 are the last
    assert file.colours is not None
    assert file.colours.tolist() == [[128, 128, 128]]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"view_names": ("a\nb", "c")}, r"image name 'a\\nb': a line of text cannot give it back"),
        ({"view_names": (" a", "c")}, "blanks at an end"),
        ({"view_names": ("", "c")}, "image name ''"),
        ({"view_ids": np.array([0, 2**32 - 1])}, "view number 4294967295"),
        ({"view_names": ("a", "a")}, "an image name comes twice"),
        ({"view_ids": np.array([-1, 2])}, "view number -1"),
        ({"point_ids": np.array([-5])}, "point number -5"),
    ],
)
def test_what_colmap_cannot_say_is_refused_and_nothing_is_written(
    tmp_path: Path, changes: dict[str, object], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        write_colmap(tmp_path / "m", bare(**changes))
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_other_files_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "rigs.txt").write_text("")
    with pytest.raises(ValueError, match=r"holds rigs\.txt"):
        write_colmap(tmp_path, bare())
    assert [p.name for p in tmp_path.iterdir()] == ["rigs.txt"]
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="is a file"):
        write_colmap(tmp_path / "file", bare())


def test_colmap_reads_it_with_the_same_reprojection_errors(tmp_path: Path) -> None:
    pycolmap = pytest.importorskip("pycolmap")
    (tmp_path / "a.txt").write_text(samples.bal_text())
    for k, file in enumerate([read_bal(tmp_path / "a.txt"), read_colmap(model_folder(tmp_path))]):
        write_colmap(tmp_path / str(k), file)
        theirs = pycolmap.Reconstruction()
        theirs.read_text(str(tmp_path / str(k)))
        written = {key: point.error for key, point in theirs.points3D.items()}
        theirs.update_point_3d_errors()
        for key, point in theirs.points3D.items():
            assert point.error == pytest.approx(written[key], rel=1e-10)


# --- bad input -------------------------------------------------------------------------------------


def line_of(name: str, line: int, words: str) -> dict[str, str]:
    rows = TEXTS[f"{name}.txt"].splitlines()
    return {name: "\n".join([*rows[: line - 1], words, *rows[line:]]) + "\n"}


def edited(name: str, old: str, new: str) -> dict[str, str]:
    text = TEXTS[f"{name}.txt"]
    assert old in text
    return {name: text.replace(old, new, 1)}


POSE = "1 0 0 0 0 0 1"


@pytest.mark.parametrize(
    ("changed", "place", "words"),
    [
        ({"cameras": ""}, "cameras.txt", "the file is empty"),
        ({"cameras": "# none\n"}, "images.txt:2", "CAMERA_ID is 4; expected one of cameras.txt"),
        (line_of("cameras", 2, "4 PINHOLE 640"), "cameras.txt:2", "3 words; expected CAMERA_ID MODEL"),
        (line_of("cameras", 2, "x PINHOLE 640 480 5 5 3 2"), "cameras.txt:2", "CAMERA_ID is 'x'"),
        (line_of("cameras", 2, "4 THIN 640 480 5 5 3 2"), "cameras.txt:2", "MODEL is 'THIN'"),
        (line_of("cameras", 2, "4 PINHOLE 640 480 5 5 3"), "cameras.txt:2", "3 parameters; expected 4"),
        (line_of("cameras", 2, "4 PINHOLE -1 480 5 5 3 2"), "cameras.txt:2", "WIDTH is '-1'"),
        (line_of("cameras", 2, "4 PINHOLE 640 480 0 5 3 2"), "cameras.txt:2", "focal lengths must be more"),
        (line_of("cameras", 2, "4 PINHOLE 640 480 nan 5 3 2"), "cameras.txt:2", "fx is 'nan'"),
        (
            line_of("cameras", 2, "4 DIVISION 640 480 5 5 3 2 1"),
            "cameras.txt:2",
            "the nearest of these is OPENCV",
        ),
        (edited("cameras", "9 SIMPLE", "4 SIMPLE"), "cameras.txt:3", "CAMERA_ID 4 again; line 2 has it"),
        ({"images": "# none\n"}, "images.txt", "no image; expected at least one"),
        (line_of("images", 2, f"5 {POSE} 4"), "images.txt:2", "9 words; expected IMAGE_ID"),
        (line_of("images", 2, f"5 {POSE} 99 a"), "images.txt:2", "CAMERA_ID is 99"),
        (line_of("images", 2, "5 2 0 0 0 0 0 1 4 a"), "images.txt:2", "quaternion of length 2"),
        (line_of("images", 2, "5 1 0 0 0 0 0 1e16 4 a"), "images.txt:2", "TZ is 1e+16"),
        (line_of("images", 4, f"5 {POSE} 4 a"), "images.txt:4", "IMAGE_ID 5 again; line 2 has it"),
        (line_of("images", 3, "1 2 100 4"), "images.txt:3", "4 words; expected X Y POINT3D_ID"),
        (line_of("images", 3, "1 2 55"), "points3D.txt:2", "TRACK names feature 1 of image 5"),
        (line_of("images", 3, "1 2 1.5"), "images.txt:3", "POINT3D_ID of feature 0 is '1.5'"),
        (line_of("images", 3, "1 2 -2"), "images.txt:3", "POINT3D_ID of feature 0 is '-2'"),
        (line_of("images", 3, "inf 2 -1"), "images.txt:3", "X of feature 0 is 'inf'"),
        (line_of("images", 3, f"6 {POSE} 4 a.jpg"), "images.txt:3", "(an empty line for an image without"),
        ({"points3D": "# none\n"}, "images.txt:3", "POINT3D_ID of feature 1 is 100; expected -1 or one"),
        (line_of("points3D", 2, "100 0 0 0 1 2 3"), "points3D.txt:2", "7 words; expected POINT3D_ID"),
        (line_of("points3D", 2, "100 0 0 0 1 2 3 1 5"), "points3D.txt:2", "9 words"),
        (line_of("points3D", 2, "100 0 0 0 1 2 256 1"), "points3D.txt:2", "B is 256"),
        (line_of("points3D", 2, "100 0 0 1e99 1 2 3 1"), "points3D.txt:2", "Z is 1e+99"),
        (line_of("points3D", 3, "100 0 0 0 1 2 3 1"), "points3D.txt:3", "POINT3D_ID 100 again; line 2"),
        (line_of("points3D", 2, "100 0 0 0 1 2 3 1 6 1"), "points3D.txt:2", "TRACK names image 6"),
        (line_of("points3D", 2, "100 0 0 0 1 2 3 1 5 1"), "points3D.txt:2", "has 1 images, images.txt 3"),
        (line_of("points3D", 2, "100 0 0 0 1 2 3 1 5 99"), "points3D.txt:2", "which has point none"),
    ],
)
def test_a_wrong_model_is_told_in_one_line(
    tmp_path: Path, changed: dict[str, str], place: str, words: str
) -> None:
    folder = model_folder(tmp_path, **changed)
    with pytest.raises(FormatError) as caught:
        read_colmap(folder)
    message = str(caught.value)
    assert message.startswith(f"{folder}/{place}: "), message
    assert words in message
    assert "\n" not in message


def test_a_point_seen_twice_by_an_image_is_counted_and_the_first_kept(tmp_path: Path) -> None:
    images = TEXTS["images.txt"].splitlines()
    images[2] += " 1.0 2.0 100"
    last = len(images[2].split()) // 3 - 1
    points = TEXTS["points3D.txt"].splitlines()
    points[1] += f" 5 {last}"
    once = read_colmap(model_folder(tmp_path))
    folder = model_folder(tmp_path, images="\n".join(images) + "\n", points3D="\n".join(points) + "\n")
    file = read_colmap(folder)
    assert "1 observation of a point that an image sees twice left out: the first one is kept" in file.notes
    assert (file.problem.seen.uv == once.problem.seen.uv).all()


def test_missing_files_and_bytes_that_are_no_text(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no such folder"):
        read_colmap(tmp_path / "none")
    folder = model_folder(tmp_path)
    (folder / "images.txt").write_bytes(b"# a\n\xff\xfe\n")
    with pytest.raises(FormatError, match=r"images\.txt:2: not a text file"):
        read_colmap(folder)
    (folder / "points3D.txt").unlink()
    (folder / "images.txt").write_text(TEXTS["images.txt"])
    with pytest.raises(FormatError, match=r"points3D\.txt: no such file"):
        read_colmap(folder)


# --- PLY -------------------------------------------------------------------------------------------


def parse_ply(path: Path) -> dict[str, np.ndarray]:
    """An independent reader: elements as tables of doubles."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode("ascii").splitlines()
    assert lines[0] == "ply"
    sizes = {"double": ("<f8", 8), "uchar": ("u1", 1), "int": ("<i4", 4)}
    elements: dict[str, tuple[int, list[str]]] = {}
    for line in lines[2:]:
        words = line.split()
        if words[0] == "element":
            elements[words[1]] = (int(words[2]), [])
        elif words[0] == "property":
            list(elements.values())[-1][1].append(words[1])
    tables = {}
    rows = iter(body.decode("ascii").splitlines()) if "ascii" in lines[1] else iter(())
    for name, (count, kinds) in elements.items():
        if "ascii" in lines[1]:
            table = np.array([[float(w) for w in next(rows).split()] for _ in range(count)])
        else:
            kind = np.dtype([(str(k), sizes[word][0]) for k, word in enumerate(kinds)])
            table = np.array([list(row) for row in np.frombuffer(body, kind, count).tolist()])
            body = body[count * kind.itemsize :]
        tables[name] = table.reshape(count, len(kinds))
    assert "ascii" in lines[1] or body == b""
    assert next(rows, None) is None
    return tables


@pytest.mark.parametrize("ascii", [True, False])
def test_a_picture_of_points_and_cameras(tmp_path: Path, ascii: bool) -> None:
    file = read_colmap(model_folder(tmp_path))
    write_ply(tmp_path / "a.ply", file, depth=0.5, ascii=ascii)
    tables = parse_ply(tmp_path / "a.ply")
    vertex, edge = tables["vertex"], tables["edge"].astype(int)
    assert (vertex[:5, :3] == file.problem.scene.X_world).all()
    assert vertex[:5, 3:].tolist() == [list(colour) for colour in samples.COLOURS]
    assert vertex.shape == (5 + 3 * 5, 6)
    for k, T in enumerate(file.problem.scene.T_cam_world):
        five = vertex[5 + 5 * k : 10 + 5 * k, :3] @ T[:3, :3].T + T[:3, 3]
        np.testing.assert_allclose(five[0], 0.0, atol=1e-14)
        lens = file.problem.lens_of_view[k]
        f, c = file.problem.scene.intrinsics[lens, :2], file.problem.scene.intrinsics[lens, 2:4]
        assert file.image_sizes is not None
        w, h = file.image_sizes[lens]
        corners = [[-0.5, -0.5], [w - 0.5, -0.5], [w - 0.5, h - 0.5], [-0.5, h - 0.5]]
        np.testing.assert_allclose(five[1:, 2], 0.5, atol=1e-14)
        np.testing.assert_allclose(f * five[1:, :2] / five[1:, 2:] + c, corners, atol=1e-10)
    # every pyramid: four edges from the centre, four around
    assert edge.shape == (24, 2)
    assert (np.bincount(edge.ravel(), minlength=20)[5:].reshape(3, 5) == [4, 3, 3, 3, 3]).all()
    assert ((edge - 5) // 5 == np.repeat(np.arange(3), 8)[:, None]).all()


def test_cameras_may_be_left_out_and_sizes_unknown(tmp_path: Path) -> None:
    write_ply(tmp_path / "a.ply", bare(), depth=0)
    assert list(parse_ply(tmp_path / "a.ply")) == ["vertex"]
    write_bundle(tmp_path / "b.ply", bare())
    tables = parse_ply(tmp_path / "b.ply")
    assert tables["vertex"].shape == (11, 6)
    assert np.isfinite(tables["vertex"]).all()
    assert tables["vertex"][0, 3:].tolist() == [200, 200, 200]
    with pytest.raises(ValueError, match="depth=-1"):
        write_ply(tmp_path / "c.ply", bare(), depth=-1)
    with pytest.raises(ValueError, match=r"suffix '\.obj' is of no format"):
        write_bundle(tmp_path / "c.obj", bare())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.ply", "b.ply"]


def test_a_record_refuses_parts_that_do_not_fit() -> None:
    with pytest.raises(ValueError, match=r"view_ids has shape \(3,\): need \(2,\)"):
        bare(view_ids=np.arange(3))
    with pytest.raises(ValueError, match=r"colours has shape \(2, 3\)"):
        bare(colours=np.zeros((2, 3), np.uint8))
    with pytest.raises(ValueError, match="view_names has 1 entries: need 2, or none"):
        bare(view_names=("a",))
