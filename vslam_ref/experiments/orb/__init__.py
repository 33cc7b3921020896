"""How the table of ORB's pairs was learned: ``python -m vslam_ref.experiments.orb.learned_pairs``."""
