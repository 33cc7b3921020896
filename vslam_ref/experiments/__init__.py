"""Floor 6: one module per figure, table or claim that is drawn again.

``framework/`` holds what they share (settings, claims, the scheduler, the writer of results).  Every
other module that ends in ``EXPERIMENT = Experiment(...)`` is an experiment; its file name is its id
with ``_`` for ``-``.  Nothing has to be listed anywhere else.
"""
