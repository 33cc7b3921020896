"""Floor 3: simulated worlds with exact truth."""
