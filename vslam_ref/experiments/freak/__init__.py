"""How the table of FREAK's pairs was learned: ``python -m vslam_ref.experiments.freak.learned_pairs``."""
