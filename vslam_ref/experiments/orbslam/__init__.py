"""What the report says of ORB-SLAM, measured.

===============  =====================================================================================
module           experiment
===============  =====================================================================================
``essential``    how many edges of the covisibility graph a closing needs: cost against accuracy
``fig3_1``       the flow of the three processes, from the functions that were called (``calls``)
``offsets``      recorded sequences from ten first pictures each (``offset_runs``), against bounds
``recognition``  places recognised, on rendered look-alikes (``lookalikes``) and in a ``corridor``
===============  =====================================================================================
"""
