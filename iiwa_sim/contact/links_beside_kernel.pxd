# For the kernel of links.
from iiwa_sim.contact.link_forces_kernel cimport LinkForces

cdef class LinksBeside(LinkForces):
    cdef char[::1] _muted              # surfaces that push no link
    cdef double[::1] _before           # joint positions of the last tick (rad)
    cdef double[:, ::1] _put_on        # where in its frame each capsule was when the arm put it on (m)
    cdef double[::1] _put_on_levers    # and how long the levers were
    cdef double[:, ::1] _ends_before   # when `goes` was asked last
    cdef double _carry(self, Py_ssize_t n, object start, object end) except? -1.0
    cdef object _speeds(self, object joints, double tick_s)
    cdef bint _is_out(self, Py_ssize_t s, double base_m)
    cdef double gone(self, object joints) except? -1.0
    cdef double _since(self, double[:, ::1] before) noexcept
    cdef double gap_at(self, Py_ssize_t s) except? -1.0
    cdef object _bring(self, Py_ssize_t[::1] was, object remembered)
    cdef object _remembered(self)
