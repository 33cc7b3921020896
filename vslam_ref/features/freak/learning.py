"""Which 512 of the 903 pairs of fields are compared: the rule of ORB, as the paper takes it over.

A row for each key point, a column for each pair; columns are sorted by the distance of their mean from one
half, for then their variance is highest; the best is kept, and from the others, in this order, each whose
correlation with all that are kept is below a limit.  The limit rises until enough are kept.  No pair of rings
is favoured.  The paper finds that its pairs then go from coarse to fine.  The table learned here does not:
the mean ring of its fields, 0 the outermost, is 2.7, 2.7, 2.6 and 2.9 in its four quarters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.freak.description import describe, directions, upright_means
from vslam_ref.features.freak.pattern import CENTRE, HALF
from vslam_ref.features.freak.sampling import field_means, sums
from vslam_ref.features.orb.extraction import located, shares
from vslam_ref.features.orb.learning import choose
from vslam_ref.features.orb.scales import finest_from_octave, octave_images
from vslam_ref.features.orb.settings import OrbSettings

BITS = 512


class Learned(NamedTuple):
    """A table of pairs and how it came about.

    Attributes
    ----------
    pairs : ndarray of int64, shape (wanted, 2)
        Numbers of fields, which have no unit.
    limit : float
        The limit of the correlation that let enough pass.
    mean : ndarray, shape (wanted,)
        Share of the key points for which the first field is the brighter.
    """

    pairs: IntArray
    limit: float
    mean: Array


def key_points(image: ArrayLike, settings: OrbSettings) -> tuple[Array, Array]:
    """Places (n, 2) of ORB's corners in all octaves, pixels of the picture, and their scales (n,)."""
    uv, scale = [np.zeros((0, 2))], [np.zeros(0)]
    images = octave_images(image, settings.octaves, settings.scale)
    for k, (octave, wanted) in enumerate(zip(images, shares(settings), strict=False)):
        xy = located(octave, wanted, settings).xy
        uv.append(finest_from_octave(xy, k, settings.scale))
        scale.append(np.full(len(xy), settings.scale**k))
    return np.concatenate(uv), np.concatenate(scale)


def patches(image: ArrayLike, settings: OrbSettings) -> Array:
    """Means (n, 43) of the turned fields, in units of grey levels, at the corners of a picture (H, W)."""
    uv, scale = key_points(image, settings)
    kept = describe(image, uv, scale).kept
    table = sums(image)
    uv, scale = uv[kept], scale[kept]
    unit, _ = directions(upright_means(table, uv, scale))
    return field_means(table, uv, scale, unit, CENTRE, HALF)


def learn(mean: Array, wanted: int = BITS) -> Learned:
    """Choose pairs of fields by the rule of ORB.

    Parameters
    ----------
    mean : ndarray, shape (n, 43)
        In grey levels, as :func:`patches` gives them.
    wanted : int

    Returns
    -------
    Learned
        Numbers of fields, which have no unit.

    Raises
    ------
    ValueError
        If there are fewer than ``wanted`` pairs that tell key points apart.

    Examples
    --------
    >>> learn(np.random.default_rng(0).normal(size=(400, 43)), 16).pairs.shape
    (16, 2)
    """
    fields = mean.shape[1]
    candidate = np.stack(np.triu_indices(fields, 1), 1)
    if len(candidate) < wanted or len(mean) < 2:
        raise ValueError(
            f"{len(candidate)} pairs and {len(mean)} key points: need {wanted} pairs and 2 key points"
        )
    taken, limit, share = choose(mean, candidate[:, ::-1], wanted)
    return Learned(candidate[taken], limit, share)
