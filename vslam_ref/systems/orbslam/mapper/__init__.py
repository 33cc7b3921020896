"""What happens to a keyframe: points on probation, new points, fusion, adjustment, culling."""
