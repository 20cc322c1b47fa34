# For the kernels that have parts meet.
from iiwa_sim.contact.remembered_kernel cimport Remembered

cdef class Bodies(Remembered):
    cdef Py_ssize_t _parts             # bodies that are parts; surfaces follow
    cdef Py_ssize_t _bodies
    cdef Py_ssize_t _held              # the part that the arm holds, or -1
    cdef int[::1] _kind
    cdef double[:, ::1] _size
    cdef double[:, ::1] _pose          # rotation, place
    cdef int[::1] _upright             # which axis of what stands is vertical, -1 of all else
    cdef double[:, ::1] _span          # lowest and highest place (m)
    cdef double[:, ::1] _reach         # half the box round it, along the axes of the base
    cdef double[:, ::1] _material      # stiffness (N/m), friction
    cdef long long[::1] _id            # under which it is remembered
    # Of places that meet in this tick: numbers, two bodies (-1: none), whether a rim, whether the other is tall.
    cdef Py_ssize_t _met
    cdef Py_ssize_t _room
    cdef double[:, ::1] _c
    cdef Py_ssize_t[:, ::1] _i         # and of what moves it: first row, end, which place of the arm, up to which row known
    cdef long long[::1] _k             # keys
    cdef list _contacts                # by which what is held presses there, or None
    cdef object _make_room(self, Py_ssize_t count)
    cdef object _put_body(self, Py_ssize_t n, object surface)
    cdef int _axis_up(self, Py_ssize_t n) noexcept
    cdef double _apart(self, Py_ssize_t x, Py_ssize_t y) noexcept
    cdef bint _is_far(
        self, Py_ssize_t x, Py_ssize_t y, double lx, double ly, double lz, double reach, bint tall
    ) noexcept
    cdef double _widest(self, Py_ssize_t x, Py_ssize_t y, double low, double high) noexcept
    cdef Py_ssize_t _next(self, Py_ssize_t x, Py_ssize_t y, long long key) except *
    cdef void _recall(self, Py_ssize_t n) noexcept
    cdef object _remember(self, Py_ssize_t n, double near_m)
