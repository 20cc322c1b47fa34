# For the kernel that pushes parts aside.
from iiwa_sim.handling.arm_way_kernel cimport ArmWay
from iiwa_sim.handling.pieces_kernel cimport Pieces

cdef class TakenAlong(ArmWay):
    cdef Pieces _pieces
    cdef object _parts                 # what the crowd knows of them
    cdef dict _poses                   # where the arm has been told that these parts are
    # Of parts that go along with others in this tick, by their numbers: whether they do, whether the arm is to
    # hear of it, whether they turn, their rows or -1, and their poses now; and their numbers, in order.
    cdef char[::1] _along
    cdef char[::1] _is_felt
    cdef char[::1] _has_turned
    cdef Py_ssize_t[::1] _row
    cdef double[:, ::1] _there
    cdef list _going
    cdef double[::1] _was              # pose of the one that is looked at, before
    cdef object _goes_on(self, object gone)
    cdef object _take_along(self, Py_ssize_t number, object middle, object way)
    cdef object _begin(self, Py_ssize_t number)
    cdef object _arrive(self, Py_ssize_t number)
    cdef object _all_arrive(self)
    cdef object _tell(self, object after, object before)
