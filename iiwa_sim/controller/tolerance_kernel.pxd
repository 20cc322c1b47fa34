# For the kernel of ticks.
from iiwa_sim.contact.load_kernel cimport ExternalLoad

cdef class Tolerance:
    cdef public bint looks_always      # whether there is something to watch in a tick in which nothing pushes, too
    cdef readonly object _torque_limits
    cdef double _least_limit
    cdef object _levers_m
    cdef double _part_per_n            # the greatest part of a joint's limit that a force at the TCP can make, per N
    cdef public double _most_n         # greatest force (N) and torque (Nm) from outside at the TCP
    cdef public double _most_nm
    cdef public bint _allows           # whether what pushes is allowed beyond a limit
    cdef public bint _judged           # by the present limits
    cpdef bint tolerates(self, ExternalLoad load) except? -1
