"""Files of vocabularies: those of DBoW2, DBoW3 and ORB-SLAM, and a compact form of our own.

=============  =====================================================================================
module         holds
=============  =====================================================================================
``reading``    :func:`read_vocabulary`: any of them, by its content, plain or packed by gzip
``nodes``      :class:`VocabularyFile`; nodes as a file lists them, checked and made a tree
``storage``    YAML of DBoW2 and DBoW3 (descriptors of DBoW3 begin with their type and length, "0 32")
``text``       ORB-SLAM's text form of DBoW2: a line for each node
``own``        our own, a ``.npz``: the tree level by level, 35 bytes a word
``shipped``    the vocabulary of about ten thousand words that comes with the package
=============  =====================================================================================

All of them must say tf-idf and the L1 score, with which the features' room weighs and scores.
"""

from vslam_ref.datasets.vocabulary_files.nodes import VocabularyFile
from vslam_ref.datasets.vocabulary_files.own import write_vocabulary
from vslam_ref.datasets.vocabulary_files.reading import read_vocabulary
from vslam_ref.datasets.vocabulary_files.shipped import provenance, shipped_vocabulary
from vslam_ref.datasets.vocabulary_files.storage import write_storage
from vslam_ref.datasets.vocabulary_files.text import write_text

__all__ = [
    "VocabularyFile",
    "provenance",
    "read_vocabulary",
    "shipped_vocabulary",
    "write_storage",
    "write_text",
    "write_vocabulary",
]
