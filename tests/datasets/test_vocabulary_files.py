"""Vocabularies from files: round trips, the files of others, and what is refused in one line."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import vocabulary_samples as samples

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.text import FormatError
from vslam_ref.datasets.vocabulary_files import (
    provenance,
    read_vocabulary,
    shipped_vocabulary,
    write_storage,
    write_text,
    write_vocabulary,
)
from vslam_ref.datasets.vocabulary_files.own import packed
from vslam_ref.features.vocabulary import Vocabulary


def same(a: Vocabulary, b: Vocabulary) -> bool:
    return all(
        (getattr(a, name) == getattr(b, name)).all() for name in ("children", "descriptor", "weight", "node")
    )


@pytest.mark.parametrize("name", samples.FILES)
def test_every_form_comes_back(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(samples.FILES[name])
    file = read_vocabulary(path)
    shuffled = name.startswith(("dbow2", "shuffled"))
    assert same(file.vocabulary, samples.small(shuffled))
    assert file.format == {"dbow2": "dbow2", "dbow3": "dbow3", "orb": "text"}.get(name.split(".")[0], "own")
    assert (file.branching, file.levels) == (3, 2)
    assert len(file.notes) == (file.format != "own")


def test_names_do_not_matter(tmp_path: Path) -> None:
    for data in samples.FILES.values():
        (tmp_path / "words.txt").write_bytes(data)
        assert read_vocabulary(tmp_path / "words.txt").vocabulary.words == 5


def test_nodes_may_stand_in_any_order(tmp_path: Path) -> None:
    """A child before its parent; children of one node keep the order of the file."""
    head, rest = samples.DBOW2.decode().split("   nodes:\n")
    nodes, words = rest.split("   words:\n")
    lines = nodes.splitlines(keepends=True)
    entries = ["".join(lines[k : k + 2]) for k in range(0, len(lines), 2)]
    order = [3, 5, 0, 4, 1, 6, 2]  # of nodes 1 to 7: 4 and 5 below 1, 6 and 7 below 3
    path = tmp_path / "words.yml"
    path.write_text(head + "   nodes:\n" + "".join(entries[k] for k in order) + "   words:\n" + words)
    found = read_vocabulary(path).vocabulary
    expected = samples.small(shuffled=True)
    own = found.descriptor[found.node]
    assert (own == expected.descriptor[expected.node])[[0, 1, 3, 4]].all()
    assert (found.weight == expected.weight).all()


def test_the_same_vocabulary_has_the_same_bytes(tmp_path: Path) -> None:
    assert packed(samples.small()) == packed(samples.small())
    path = tmp_path / "words.npz"
    write_vocabulary(path, samples.small())
    assert path.read_bytes() == samples.FILES["own.npz"]


def test_words_in_another_order_do_not_fit_the_text_form(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="another order"):
        write_text(tmp_path / "words.txt", samples.small(shuffled=True))
    assert not (tmp_path / "words.txt").exists()


def changed(old: str, new: str) -> bytes:
    text = samples.DBOW2.decode()
    assert old in text
    return text.replace(old, new, 1).encode()


FIRST = "nodeId:1, parentId:0, weight:0.0"
REFUSED = {
    "cut off": (samples.DBOW2[: len(samples.DBOW2) // 2], "expected"),
    "without its words": (samples.DBOW2.split(b"   words:")[0], "expected another node, or words:"),
    "a missing parent": (
        changed(FIRST, "nodeId:1, parentId:77, weight:0.0"),
        "parent 77, which is not there",
    ),
    "its own parent": (changed(FIRST, "nodeId:1, parentId:1, weight:0.0"), "cycle"),
    "a cycle of two": (changed(FIRST, "nodeId:1, parentId:4, weight:0.0"), "cycle"),
    "a node twice": (changed("nodeId:3, parentId", "nodeId:1, parentId"), "node 1 stands twice"),
    "the root as a node": (changed("nodeId:3, parentId", "nodeId:0, parentId"), "is the root"),
    "a weight of NaN": (changed("weight:1.25", "weight:nan"), "expected a finite number"),
    "a weight below 0": (changed("weight:2.0", "weight:-2.0"), "weight -2"),
    "a word less": (changed("      - { wordId:4, nodeId:5 }\n", ""), "neither children nor a word"),
    "a word that is inner": (changed("wordId:4, nodeId:5", "wordId:4, nodeId:3"), "has children"),
    "two words of a node": (changed("wordId:4, nodeId:5", "wordId:4, nodeId:4"), "two words"),
    "a word of no node": (changed("wordId:4, nodeId:5", "wordId:4, nodeId:50"), "node 50, which is not"),
    "a word twice": (changed("wordId:4,", "wordId:3,"), "word 3 again"),
    "a word too large": (changed("wordId:4,", "wordId:9,"), "word 9 of 5 words"),
    "a short descriptor": (changed('descriptor:"', 'descriptor:"1 '), "33 words; expected 32"),
    "a byte of 256": (
        changed(f'descriptor:"{samples.small().descriptor[1, 0]} ', 'descriptor:"256 '),
        "0 to 255",
    ),
    "k too small": (changed("k: 3", "k: 2"), "3 children; expected at most k = 2"),
    "L too small": (changed("L: 2", "L: 1"), "level 2; expected at most L = 1"),
    "k of 0": (changed("k: 3", "k: 0"), "k is 0"),
    "no k": (changed("   k: 3\n", ""), "no k before"),
    "k twice": (changed("   k: 3\n", "   k: 3\n   k: 3\n"), "k again"),
    "another weighting": (changed("weightingType: 0", "weightingType: 1"), "weighting is 1 \\(tf\\)"),
    "another score": (changed("scoringType: 0", "scoringType: 5"), "dot product"),
    "more behind the words": (samples.DBOW2 + b"more: 1\n", "behind the words"),
    "DBoW3's bytes half": (samples.DBOW3.replace(b'"0 32 ', b'"0 31 ', 1), "expected '0 32'"),
    "text, a column less": (samples.TEXT.replace(b" 1.25", b"", 1), "34 columns; expected 35"),
    "text, a leaf that is none": (
        samples.TEXT.replace(b"\n0 0 ", b"\n0 1 ", 1),
        "is a word and has children",
    ),
    "text, a leaf forgotten": (samples.TEXT.replace(b"\n0 1 ", b"\n0 0 ", 1), "neither children nor a word"),
    "text, a leaf of 2": (samples.TEXT.replace(b"\n0 1 ", b"\n0 2 ", 1), "expected 0 or 1"),
    "text, a parent later in a ring": (samples.TEXT.replace(b"\n0 0 ", b"\n4 0 ", 1), "cycle"),
    "text, one line": (b"10 5 0 0\n", "no nodes"),
    "empty": (b"", "empty"),
    "bytes": (b"\xff\xfe\x00", "not a text file"),
    "gzip cut off": (samples.FILES["dbow2.yml.gz"][:-9], "its end is missing"),
    "own, cut off": (samples.FILES["own.npz"][:-30], "damaged archive"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_wrong_is_said(tmp_path: Path, what: str) -> None:
    data, said = REFUSED[what]
    path = tmp_path / "words.yml"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=said) as refused:
        read_vocabulary(path)
    assert str(refused.value).startswith(f"{path}")
    assert "\n" not in str(refused.value)


def archive(**arrays: np.ndarray) -> bytes:
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def own(**changes: np.ndarray | None) -> bytes:
    v = samples.small()
    arrays = {"children": v.children.astype("<u2"), "descriptor": v.descriptor[1:], "weight": v.weight}
    return archive(**{k: a for k, a in (arrays | changes).items() if a is not None})


def boasting() -> bytes:
    """A header that says 2^40 numbers, with none behind it."""
    v = samples.small()
    member = io.BytesIO()
    np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": (2**40,)})
    out = io.BytesIO(own(weight=None))
    with zipfile.ZipFile(out, "a") as held:
        held.writestr("weight.npy", member.getvalue())
    assert v.words == 5
    return out.getvalue()


OWN = {
    "an array less": (own(weight=None), "no array weight"),
    "an array more": (own(other=np.zeros(3)), "array 'other'"),
    "another type": (own(weight=np.zeros(5, np.float32)), "weight is float32"),
    "objects": (own(weight=np.array([{}] * 5, dtype=object)), "weight is object"),
    "NaN": (own(weight=np.full(5, np.nan)), "not finite"),
    "heavy": (own(weight=np.full(5, 1e300)), "logarithms"),
    "a weight more": (own(weight=np.zeros(6)), "one of each of 5 words"),
    "a node less": (own(descriptor=np.zeros((6, 32), np.uint8)), "expected 7 x 32"),
    "no tree": (own(children=np.array([0, 2, 0, 5, 0, 0, 0, 0], "<u2")), "level by level"),
    "one byte less": (own(descriptor=np.zeros((7, 31), np.uint8)), "expected 7 x 32"),
    "more than it holds": (boasting(), "cut off"),
}


@pytest.mark.parametrize("what", OWN)
def test_what_is_wrong_in_our_own_form(tmp_path: Path, what: str) -> None:
    data, said = OWN[what]
    path = tmp_path / "words.npz"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=said):
        read_vocabulary(path)


def test_missing_files_and_folders(tmp_path: Path) -> None:
    for path, said in ((tmp_path / "none", "no such file"), (tmp_path, "cannot be read")):
        with pytest.raises(FormatError, match=said):
            read_vocabulary(path)


@pytest.mark.parametrize(
    ("name", "form", "k", "L", "words"),
    [("kimera_small_voc", "dbow2", 9, 3, 692), ("slambook2_vocabulary", "dbow3", 10, 5, 4983)],
)
def test_files_of_others(tmp_path: Path, name: str, form: str, k: int, L: int, words: int) -> None:
    folder = catalogue.find("dbow2_vocab_small")
    if folder is None:
        pytest.skip("dbow2_vocab_small is not installed")
    file = read_vocabulary(folder / f"{name}.yml.gz")
    v = file.vocabulary
    assert (file.format, file.branching, file.levels, v.words) == (form, k, L, words)
    for write in (lambda path: write_storage(path, v, typed=True), lambda path: write_vocabulary(path, v)):
        write(tmp_path / "again")
        assert same(read_vocabulary(tmp_path / "again").vocabulary, v)


def test_the_shipped_vocabulary_says_where_it_comes_from() -> None:
    import hashlib

    from vslam_ref.datasets.vocabulary_files.shipped import SHIPPED
    from vslam_ref.features.orb.pair_table import PAIRS

    told = provenance()
    assert told["vocabulary_sha256"] == hashlib.sha256(SHIPPED.read_bytes()).hexdigest()
    assert told["words"] == shipped_vocabulary().words
    names = " ".join(source["name"] for source in told["sources"])
    assert "rtabmap" not in names
    assert all(source["licence"] and source["pictures"] for source in told["sources"])
    table = hashlib.sha256(PAIRS.astype("<i8").tobytes()).hexdigest()
    assert told["pair_table_sha256"] == table, "ORB compares other pairs now: make vocabulary"
