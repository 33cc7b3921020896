"""Exercise 8.1: find a patch again.

Images are arrays (H, W) of grey levels 0 to 255; ``image[y, x]`` is the pixel (x, y), (0, 0) the centre of
the top-left one.  A template is 8 x 8 grey levels; its pixel ``T[4, 4]`` lies on the point.
"""

import numpy as np

CIRCLE = [(0, 3), (1, 3), (2, 2), (3, 1), (3, 0), (3, -1), (2, -2), (1, -3)]
CIRCLE += [(-x, -y) for x, y in CIRCLE]


def on_level_zero(uv: np.ndarray, level: int) -> np.ndarray:
    """Position on level 0.

    Parameters
    ----------
    uv : ndarray, shape (n, 2)
        Positions on a level whose pixels are means of 2 x 2 pixels of the level before it.
    level : int
        0 is the whole image.

    Returns
    -------
    ndarray, shape (n, 2)
    """
    raise NotImplementedError


def is_corner(image: np.ndarray, x: int, y: int, threshold: int, arc: int) -> bool:
    """Whether ``arc`` pixels in a row of the CIRCLE are all brighter or all darker than the threshold allows.

    The image may hold bytes (``uint8``): mind what their differences do.
    """
    raise NotImplementedError


def zmssd(sum_a: float, sum_b: float, sum_aa: float, sum_bb: float, sum_ab: float, n: int) -> float:
    """Sum of squared differences of two patches of n pixels, each without its mean, from five sums."""
    raise NotImplementedError


def refine(image: np.ndarray, T: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
    """Slide a template until it fits, by inverse compositional steps with an offset of brightness.

    Parameters
    ----------
    image : ndarray, shape (H, W)
    T : ndarray, shape (8, 8)
        Its inner 6 x 6 pixels are compared, their slopes taken from neighbours within T.
    u : ndarray, shape (2,)
        Start, within a pixel of the answer.

    Returns
    -------
    (ndarray of shape (2,), float)
        Place u and offset b (image minus template) of the least sum of (T(d) + b - I(u + d))^2; the last
        step must be below 0.01 pixels.
    """
    raise NotImplementedError
