"""One picture to one pose, against the map."""
