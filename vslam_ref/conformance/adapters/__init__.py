"""Adapters: what makes a library answer the runner's questions.

An adapter has ``answer(function, inputs) -> outputs``.  It raises NotImplementedError where the library has
no such function, and any other exception where it refuses the inputs.
"""
