# For the kernel of loads.
from iiwa_sim.contact.link_forces_kernel cimport LinkForces

cdef class Links(LinkForces):
    cdef readonly object torques       # on each joint (Nm); None where no link touches anything
    cdef readonly object worn          # force (N), torque (Nm) about the origin, in the base, on what the arm wears; or None
    cdef readonly object yielding_to   # torque (Nm) on each joint that a yielding robot gives way to; or None
    cdef object _own                   # capsules of the arm without what it wears
    cdef Py_ssize_t _link_count
    cdef double _free                  # way (m) that any point of the arm can go before a link could touch something
    cdef double _passed                # way (m) that points of the arm may have gone since the last look
    cdef double[:, ::1] _ends_looked   # where capsules were then
    cdef double[::1] _away             # of each surface: it was so far (m) from all links then
    cdef char[::1] _muted              # surfaces that push no link
    cdef double[::1] _before           # joint positions of the last tick (rad)
    cdef double[:, ::1] _put_on        # where in its frame each capsule was when the arm put it on (m)
    cdef double[::1] _put_on_levers    # and how long the levers were
    cdef object _forget_forces(self)
    cdef object _wear(self, fixed, worn)
    cpdef step(self, joints, double tick_s)
    cdef object _look(self, joints, double tick_s)
    cdef double _carry(self, Py_ssize_t n, object start, object end) except? -1.0
    cdef object _speeds(self, object joints, double tick_s)
    cdef bint _is_out(self, Py_ssize_t s, double base_m)
    cdef double _since(self, double[:, ::1] before) noexcept
    cdef object _bring(self, Py_ssize_t[::1] was, object remembered)
    cdef object _remembered(self)
