"""What the report says of ORB-SLAM, measured.

===============  =====================================================================================
module           experiment
===============  =====================================================================================
``essential``    how many edges of the covisibility graph a closing needs: cost against accuracy
``recognition``  places recognised, on rendered look-alikes (``lookalikes``) and in a ``corridor``
===============  =====================================================================================
"""
