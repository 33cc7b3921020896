"""ORB-SLAM: tracking, mapping and loop closing on one kind of feature."""
