"""The cameras that a COLMAP model's images have, as sets of intrinsics of one family or of several."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.colmap.models import MODELS, NEAREST, common_model, params_from_colmap
from vslam_ref.datasets.bundle_files.colmap.parts import CameraPart, Parts
from vslam_ref.estimation.bundle.families import CameraModel, Families
from vslam_ref.geometry.cameras import Camera


class Lenses(NamedTuple):
    """Sets of intrinsics.

    Attributes
    ----------
    model : type of Camera, or Families
    intrinsics : ndarray, shape (L, p)
    of_image : ndarray of int, shape (V,)
    sizes : ndarray of int, shape (L, 2)
    names : tuple of str, length L
        COLMAP's names of the models.
    keys : tuple of int, length L
        CAMERA_ID.
    """

    model: CameraModel
    intrinsics: Array
    of_image: IntArray
    sizes: IntArray
    names: tuple[str, ...]
    keys: tuple[int, ...]


def lenses_of(parts: Parts) -> Lenses:
    """Intrinsics of the cameras that an image has; cameras of one family share a model that can say all.

    Raises
    ------
    FormatError
        Where a camera's model is not known here, or its numbers make no camera.
    """
    used = {image.camera for image in parts.images.values()}
    cameras = {key: camera for key, camera in parts.cameras.items() if key in used}
    for key, camera in cameras.items():
        if camera.model not in MODELS:
            raise camera.place.error(parts.path("cameras"), _unknown(parts, key, camera))
    kinds = [_family(camera, cameras) for camera in cameras.values()]
    models = tuple(dict.fromkeys(kinds))
    model = models[0] if len(models) == 1 else Families(models, tuple(models.index(kind) for kind in kinds))
    params = [_params(parts, kind, camera) for kind, camera in zip(kinds, cameras.values(), strict=True)]
    place = {key: k for k, key in enumerate(cameras)}
    return Lenses(
        model,
        _blocks(model, params),
        np.array([place[image.camera] for image in parts.images.values()], dtype=np.int64),
        np.array([camera.size for camera in cameras.values()], dtype=np.int64),
        tuple(camera.model for camera in cameras.values()),
        tuple(cameras),
    )


def _unknown(parts: Parts, key: int, camera: CameraPart) -> str:
    images = sum(image.camera == key for image in parts.images.values())
    near = NEAREST.get(camera.model)
    hint = f"; the nearest of these is {near}" if near else ""
    shown = camera.model[:40]
    return f"MODEL is {shown!r}, of {images} image(s); expected one of {', '.join(MODELS)}{hint}"


def _family(camera: CameraPart, cameras: dict[int, CameraPart]) -> type[Camera]:
    """The smallest model here that can say all cameras of this one's family."""
    alike = [one.model for one in cameras.values() if common_model((one.model, camera.model)) is not None]
    model = common_model(alike)
    assert model is not None  # families do not overlap
    return model


def _params(parts: Parts, kind: type[Camera], camera: CameraPart) -> Array:
    params = params_from_colmap(camera.model, camera.params, kind)
    try:
        kind.from_params(params)
    except ValueError as error:
        raise camera.place.error(parts.path("cameras"), str(error)) from None
    return params


def _blocks(model: CameraModel, params: list[Array]) -> Array:
    """Intrinsics (L, p), each set in the block of its family."""
    if not isinstance(model, Families):
        return np.array(params)
    table = np.zeros((len(params), model.width))
    for number, values in enumerate(params):
        table[number, model.columns(model.of_set[number])] = values
    return table
