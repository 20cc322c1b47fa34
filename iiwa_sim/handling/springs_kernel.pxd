# For the kernel of what touches a part.
from iiwa_sim.handling.near_kernel cimport Near

cdef class Springs(Near):
    cdef object _least_of              # surfaces, and the least stiffness of them (N/m)
    cdef double _least
    cdef object _besides               # `Spring`s of corners of others
    cdef double[::1] _found_at         # where its middle was with these (m)
    cdef object _press(self, double[::1] pose, object besides)
    cdef double stored_at(self, double[::1] pose) except? -1.0
    cdef double _in_one(self, object spring, double x, double y, double z) except? -1.0
