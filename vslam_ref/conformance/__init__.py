"""Conformance: vectors that check another implementation formula by formula, and the runner that asks it.

====================  ============================================================================
module                holds
====================  ============================================================================
``functions.json``    what a program can be asked; ``catalogue`` reads it
``vectors/``          the cases, a file a topic; ``vectors_format`` reads and checks them
``generator/``        how they are made: seeded, from oracles, never with the library's own code
``program``           a foreign program, or a module, that is asked
``conventions``       a program's own conventions, and the way there and back
``compare``           right or wrong, within a tolerance
``statistics``        random answers
``diagnosis/``        what is probably wrong
``runner``            all of it, case by case
``report``            the result as a page
``adapters/``         what makes other libraries, and this one, answer
====================  ============================================================================
"""
