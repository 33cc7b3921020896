"""What every room may use and no algorithm needs: files, settings, provenance, errors, report pages.

==============  ==========================================================================
module          holds
==============  ==========================================================================
``errors``      ``InputError``: bad input, reported in one line
``files``       files and folders that appear whole or not at all
``config``      ``key=value`` settings of frozen dataclasses, and their reasons
``json_text``   values as JSON text
``provenance``  versions, git commit, platform
``pages``       HTML pages of reports; no numeric room imports it
``timing``      paired timing, for ratios that hold when the machine's speed drifts
``stopwatch``   seconds by stage of a program
==============  ==========================================================================
"""
