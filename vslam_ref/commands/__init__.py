"""The commands of ``vslam-ref``, one module each.

A command has ``HELP`` (one line), ``EPILOG`` (an example), ``add_arguments(parser)`` and
``run(options) -> exit status``.  Importing it costs the standard library only.
"""
