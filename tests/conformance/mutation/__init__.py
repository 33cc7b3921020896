"""Would the vectors notice?  Small mistakes are put into the library's own formulas, one at a time.

A *mutant* is the library with one operator, sign, order or constant changed inside a function that cites an
equation.  The vectors are asked as a user's program would be; a mutant that passes them all *survives*, and
shows what the vectors do not see.

==============  ==================================================================================
module          holds
==============  ==================================================================================
``sites``       where a function can be changed, and how
``regimes``     where it treats some arguments apart: branches, series, special values, later blocks
``child``       the library with one change, in a process of its own
``study``       a seeded sample of mutants, run side by side
``equivalent``  changes that change nothing, and why
==============  ==================================================================================
"""
