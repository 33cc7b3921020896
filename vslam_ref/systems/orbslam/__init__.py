"""ORB-SLAM."""
