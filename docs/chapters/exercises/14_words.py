"""Exercise 14.1: a place recognised by its words."""

import numpy as np


def bits_that_differ(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Count the bits in which descriptors differ.

    Parameters
    ----------
    a : ndarray of uint8, shape (n, bytes)
    b : ndarray of uint8, shape (m, bytes)

    Returns
    -------
    ndarray of int, shape (n, m)
    """
    raise NotImplementedError


def words(children: list[list[int]], node: np.ndarray, descriptor: np.ndarray) -> np.ndarray:
    """Go from the root, node 0, to the nearest child, and on to a leaf; of equally near ones take the first.

    Parameters
    ----------
    children : list of list of int
        Children of each node; those of a leaf are none.
    node : ndarray of uint8, shape (nodes, bytes)
        Descriptor of each node.
    descriptor : ndarray of uint8, shape (n, bytes)
        Features of a picture.

    Returns
    -------
    ndarray of int, shape (n,)
        The leaf in which each feature ends.
    """
    raise NotImplementedError


def bag(word: np.ndarray, idf: dict[int, float]) -> dict[int, float]:
    """Weigh the words of a picture: how often each occurs, times its idf, in all 1.

    Parameters
    ----------
    word : ndarray of int, shape (n,)
        Word of each feature.
    idf : dict
        What each word says; some say nothing, 0.

    Returns
    -------
    dict
        Word: weight, for those that say something; empty if none does.
    """
    raise NotImplementedError


def score(v: dict[int, float], w: dict[int, float]) -> float:
    """How alike two pictures are, from 0 to 1."""
    raise NotImplementedError
