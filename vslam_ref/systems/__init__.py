"""Floor 4: whole systems, made of the parts below.

``slam_log`` runs the filters over a recorded log and compares them with its truth.
"""
