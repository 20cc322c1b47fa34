# For the kernel of what is held.
from iiwa_sim.handling.springs_kernel cimport Springs

cdef class Touching(Springs):
    cdef public object besides         # what else pushes in this tick, at other places: force, torque and `Spring`s, or None
    cdef double _free                  # so far they may go from where they are, and touch nothing for sure (m)
    cdef object _leaning               # the names of surfaces on which a point may have pressed beside where it is
    cdef list _unpressed               # of points and surfaces, how deep: to be told the worlds
    cdef double[:, ::1] _was           # where the points that are close were in the tick before (m)
    cdef double[::1] _pose             # for who has no array
    # What acts on it: force (N), torque (Nm) about its middle, in base axes.
    cdef double fx
    cdef double fy
    cdef double fz
    cdef double tx
    cdef double ty
    cdef double tz
    cdef bint is_pushed(self) noexcept
    cdef bint passes(self, double way_m) noexcept
    cdef object go_to(self, double[::1] pose, object surfaces, double tick_s)
    cdef object _feel(self, double[::1] pose, double tick_s)
    cdef object _lean(self, double[::1] pose, object name)
