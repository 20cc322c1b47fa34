# For the kernel of loads, which asks in each tick what the world is.
from iiwa_sim.contact.contact_kernel cimport Contact

cdef class World:
    cdef readonly double radius_m
    cdef readonly int changes          # how many times a surface has been put or taken away
    cdef dict _contacts                # by name
    cdef list _all                     # the same
    cdef object _turned                # how the TCP is turned, if it is known
