"""The study behind figure 1.1: pictures with exact cameras, points from them, and cameras from the points."""
