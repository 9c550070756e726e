"""Several hosts on this machine: network namespaces with their own addresses, names and links.

``availability`` says whether they can be had, ``hosts`` makes them, ``relay`` delays one
connection in user space (the kernel's netem is often absent), ``stale`` removes what a killed
process has left behind. What hosts share nevertheless: the processors, the clock and the disk.
"""
