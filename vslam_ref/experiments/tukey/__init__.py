"""A's Tukey loss as printed: the experiment ``tukey-errata``, and the scenes it looks at."""
