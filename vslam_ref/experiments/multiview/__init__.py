"""Figure 1.1 from a real reconstruction: what is looked at (``scene``) and what is found (``study``)."""
