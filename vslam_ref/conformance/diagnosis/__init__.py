"""Why is an answer wrong?  A guess for each case, and a name for each function.

::

    one case                      all cases of a function
    --------                      -----------------------
    diagnose                      name_functions
       |                             |  notes       what the vectors know
    single   notes, then turns       |  declared    another convention, asked again
                                     |  formulas    well-known wrong formulas
                                     |  turns       the answer turned back
                                     |  changes     an input turned, exchanged, left out
                                     |  shifts      an input off by one or a half, rows moved
                                     |  one_change  the library with one sign changed
                                     |  sizes, places   digits, entries, regimes

A name of a function is only given where no case speaks against it and most failures are explained.
"""

from vslam_ref.conformance.diagnosis.names import name_functions
from vslam_ref.conformance.diagnosis.single import diagnose, known_mistake
from vslam_ref.conformance.results import NOTHING

__all__ = ["NOTHING", "diagnose", "known_mistake", "name_functions"]
