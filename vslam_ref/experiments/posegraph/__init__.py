"""What the experiments of pose graphs measure: ``posegraph-starts``.

==========  =========================================================================================
module      holds
==========  =========================================================================================
``starts``  how often a start ends in the best known minimum, under growing noise
==========  =========================================================================================

The graphs with exact truth are those of ``worlds.rounds``.
"""
