"""What the report says of PTAM, measured: its figures, its claims, and the table by which it is judged.

========================== ============================================================================
module                     experiment
========================== ============================================================================
``fig2_1`` to ``fig2_3``   levels and search; the flow; start, tracking, and a house on the plane
``wrong_matches``          three losses where matches are wrong
``passes``                 one pass over the points, or two
``turning``                pure rotation (``turning_runs`` simulates, ``turning_claims`` judges)
``framerate``              pictures a second, in NumPy and in Numba
``two_pipelines``          mapping in line, or beside
``parts``                  one part taken out, on inputs (``parts_inputs``) where it should matter
``offsets``                recorded and rendered sequences (``recorded``, from ``recorded.toml``), run from
                           many first pictures (``offset_runs``), against bounds (``offset_claims``)
========================== ============================================================================
"""
