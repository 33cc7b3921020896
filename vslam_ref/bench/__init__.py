"""Floor 6: measurements of speed, side by side with the peers that are installed.

All goals are ratios of two things measured in turn, in one process, on one thread; the median of the
paired ratios is quoted.  No test asserts a time.
"""
