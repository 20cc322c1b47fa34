# For the kernel of loads.
from iiwa_sim.contact.links_beside_kernel cimport LinksBeside

cdef class Links(LinksBeside):
    cdef readonly object torques       # on each joint (Nm); None where no link touches anything
    cdef readonly object worn          # force (N), torque (Nm) about the origin, in the base, on what the arm wears; or None
    cdef readonly object yielding_to   # torque (Nm) on each joint that a yielding robot gives way to; or None
    cdef object _own                   # capsules of the arm without what it wears
    cdef Py_ssize_t _link_count
    cdef double _free                  # way (m) that any point of the arm can go before a link could touch something
    cdef double _passed                # way (m) that points of the arm may have gone since the last look
    cdef double[:, ::1] _ends_looked   # where capsules were then
    cdef double[::1] _away             # of each surface: it was so far (m) from all links then
    cdef object _forget_forces(self)
    cdef object _wear(self, fixed, worn)
    cdef object _begin(self, Py_ssize_t n)
    cpdef step(self, joints, double tick_s)
    cdef object _look(self, joints, double tick_s)
