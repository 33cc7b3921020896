"""Words of a picture: a tree of binary words, their weights, and an index over pictures.

=============  ==================================================================================
module         holds
=============  ==================================================================================
``tree``       :class:`Vocabulary`: nodes, weights; :func:`descend` from the root to a word
``training``   :func:`train`: hierarchical k-medians, and the weights of the words
``bags``       :class:`Bag`: weighted words of one picture; :func:`score` of two
``database``   :class:`Database`: inverted index over pictures, :func:`best`
``matching``   pairs of features of two pictures: under common nodes, mutual, turned alike
``book``       one level trained, one descent, one bag, one score in plain loops
=============  ==================================================================================

A descriptor is 32 bytes, 256 bits, and the distance of two is the number of bits that differ.  The
definitions are those of DBoW2, so that its vocabularies give the same words, weights and scores here; where
two children are equally near, the first one wins.  A picture without a word scores 0 with every picture.
"""

from vslam_ref.features.vocabulary.bags import Bag, bag, score
from vslam_ref.features.vocabulary.database import Database, QueryResult, best
from vslam_ref.features.vocabulary.matching import Matched, Matching, match, turned_alike
from vslam_ref.features.vocabulary.training import inverse_document_frequency, train
from vslam_ref.features.vocabulary.tree import (
    Descended,
    Vocabulary,
    descend,
    from_parents,
    nodes_at_level,
    words,
)

__all__ = [
    "Bag",
    "Database",
    "Descended",
    "QueryResult",
    "Matched",
    "Matching",
    "Vocabulary",
    "bag",
    "best",
    "descend",
    "from_parents",
    "inverse_document_frequency",
    "match",
    "nodes_at_level",
    "score",
    "train",
    "turned_alike",
    "words",
]
