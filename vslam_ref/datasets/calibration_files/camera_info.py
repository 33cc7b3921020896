"""ROS' ``sensor_msgs/CameraInfo``, as ``rostopic echo`` (ROS 1) and ``ros2 topic echo`` print it.

::

    height: 480
    width: 752                    of the whole sensor, before binning and region of interest
    distortion_model: plumb_bob   or rational_polynomial, equidistant
    D: [k1, k2, p1, p2, k3]       ROS 2 writes d, k, r, p
    K: [fx, 0, cx, 0, fy, cy, 0, 0, 1]
    binning_x: 0                  0 and 1: none
    roi: {x_offset: 0, y_offset: 0, height: 0, width: 0}     all 0: the whole sensor
    ---                           ends the message; others may follow

The camera is that of the pictures on the raw topic.  A region's corner is subtracted from the centre.  A
pixel of a binned picture is the mean of b x b pixels, and its centre the middle of theirs, so a place u
becomes (u + 1/2) / b - 1/2, and focal lengths are divided by b.  K of zeros says: not calibrated.
"""

from __future__ import annotations

import re
from pathlib import Path

from vslam_ref.datasets.calibration_files.lenses import lens_camera, lens_name, numbers_of
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.storage_nodes import GZIP, storage_bytes
from vslam_ref.datasets.text import FormatError, open_packed
from vslam_ref.datasets.yaml_nodes import MAX_BYTES, Node, parse_yaml, plain_text

END = re.compile(rb"^---[ \t]*\r?$\n?", re.MULTILINE)
STAMPS = re.compile(rb"^[ \t]*(seq|stamp|secs?|nsecs?|nanosec|nanosecs)[ \t]*:.*$", re.MULTILINE)


def read_camera_info(path: Path | str) -> CameraFile:
    """Read the first message of a file.

    Raises
    ------
    FormatError
        Where the file is not as the module says, or the camera is not calibrated.
    """
    path = Path(path)
    first, notes = _first_message(path)
    return from_message(parse_yaml(path, plain_text(path, first)), notes)


def from_message(top: Node, notes: tuple[str, ...] = ()) -> CameraFile:
    """The camera of a message that has been parsed."""
    entries = top.items()
    K = top.get("k", "K")
    numbers = numbers_of(K)
    if len(numbers) != 9:
        raise K.error(f"{K.name} has {len(numbers)} numbers; expected 9: fx 0 cx 0 fy cy 0 0 1")
    if not numbers.any() or numbers[0] == 0:
        raise K.error(
            f"{K.name} has fx = 0: ROS says so of a camera that is not calibrated; calibrate it first"
        )
    if numbers[[1, 3, 6, 7]].any() or numbers[8] != 1:
        raise K.error(f"{K.name} is {numbers.tolist()}; expected fx 0 cx 0 fy cy 0 0 1")
    D = top.get("d", "D")
    k = numbers_of(D).tolist() if D.raw.id != "scalar" or D.text() else []
    model = top.get("distortion_model")
    name = lens_name(model) if model.text().strip() else None
    if name == "radtan" and any(k[5:]):
        notes += (
            f"{model.text()} has 4 or 5 coefficients, here are {len(k)}: read as rational, as OpenCV does",
        )
        name = None
    size = top.get("width").integer(), top.get("height").integer()
    sensor, size, told = _cut(entries, numbers[[0, 4, 2, 5]].tolist(), size)
    return CameraFile(lens_camera(D, name, sensor, k), size, notes=(*notes, *told))


def _cut(
    entries: dict[str, Node], sensor: list[float], size: tuple[int, int]
) -> tuple[list[float], tuple[int, int], tuple[str, ...]]:
    """Sensor and size of the pictures, after region of interest and binning."""
    region = dict.fromkeys(("x_offset", "y_offset", "width", "height"), 0)
    if "roi" in entries:
        found = entries["roi"].items()
        region |= {name: found[name].integer(0) for name in region if name in found}
    bins = [entries[name].integer(0) or 1 if name in entries else 1 for name in ("binning_x", "binning_y")]
    corner = region["x_offset"], region["y_offset"]
    seen = region["width"] or size[0] - corner[0], region["height"] or size[1] - corner[1]
    if corner[0] + seen[0] > size[0] or corner[1] + seen[1] > size[1] or min(seen) < 1:
        what = f"roi of {seen[0]}x{seen[1]} at {corner} is not inside of {size[0]}x{size[1]} pixels"
        raise entries["roi"].error(what)
    small = seen[0] // bins[0], seen[1] // bins[1]
    if min(small) < 1:
        what = f"binning {bins[0]} x {bins[1]} leaves no pixel of {seen[0]}x{seen[1]}"
        raise entries["binning_x" if small[0] < 1 else "binning_y"].error(what)
    if small == size:
        return sensor, size, ()
    focal = [f / b for f, b in zip(sensor[:2], bins, strict=True)]
    centre = [(c - o + 0.5) / b - 0.5 for c, o, b in zip(sensor[2:], corner, bins, strict=True)]
    how = [f"the region at {corner}"] * (seen != size) + [f"binning {bins[0]} x {bins[1]}"] * (bins != [1, 1])
    whole, part = (f"{w}x{h}" for w, h in (size, small))
    told = f"K is for {whole} pixels; the camera is given for pictures of {part}, after {' and '.join(how)}"
    return focal + centre, small, (told,)


def _first_message(path: Path) -> tuple[bytes, tuple[str, ...]]:
    """Bytes of the first message, and a note if others say something else.

    A topic that was listened to for long fills more than a file may have: only its beginning is read.
    """
    try:
        with open_packed(path) as stream:
            begin = stream.read(MAX_BYTES)
    except (OSError, EOFError, ValueError):
        begin = b""
    if begin.startswith(GZIP) or not END.search(begin):
        begin = storage_bytes(path)
    messages = [one for one in END.split(begin) if STAMPS.sub(b"", one).strip()]
    if not messages:
        raise FormatError(path, None, "empty; expected a message of sensor_msgs/CameraInfo")
    whole = messages[:-1] if len(begin) == MAX_BYTES and len(messages) > 1 else messages
    others = sum(STAMPS.sub(b"", one).strip() != STAMPS.sub(b"", whole[0]).strip() for one in whole[1:])
    # empty lines in place of what stood before the message: line numbers stay
    before = begin[: begin.find(whole[0])].count(b"\n")
    told = f"{others} of {len(whole)} messages say something else than the first, which is read"
    return b"\n" * before + whole[0], (told,) * bool(others)
