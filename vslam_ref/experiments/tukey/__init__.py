"""What the study of A2.8 computes; the experiment itself is ``tukey_errata``."""
