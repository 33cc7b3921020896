"""What the experiments of ORB-SLAM measure."""
