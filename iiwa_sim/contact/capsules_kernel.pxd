# For kernels that have an arm of capsules: `go_to`, then what lies in the arrays.
cdef class Capsules:
    cdef object _capsules
    cdef Py_ssize_t _count             # of joints
    cdef Py_ssize_t _capsule_count
    cdef double[:, ::1] _fixed         # in the form of `Tcp`
    cdef Py_ssize_t[::1] _moved_by     # how many joints move each capsule
    cdef double[:, ::1] _local         # of each capsule: both ends, in the frame of the joint that moves it last
    cdef double[::1] _radius
    cdef double[:, ::1] _reaches       # no point of a capsule is farther from the axis of a joint (m)
    cdef double[::1] _levers           # the longest of these, joint by joint
    cdef double[:, ::1] _axes
    cdef double[:, ::1] _points
    cdef double[:, ::1] _frames        # of joints, as rows of `_fixed`
    cdef double[:, ::1] _ends          # of each capsule: both ends in the base
    cdef double[::1] _gone_to          # joint positions (rad) with which they are there
    cdef bint _is_there                # whether these are so
    cdef Py_ssize_t _shape_count
    cdef double[:, ::1] _shapes        # rotation, place, three sizes
    cdef int[::1] _kind
    cdef double[::1] _extent           # no point of a shape is farther from its place (m)
    cdef dict _extents                 # the same of the shapes that there are
    cdef double _nx                    # which way is out, after `distance`
    cdef double _ny
    cdef double _nz
    cdef double _px                    # and where, after `apart`
    cdef double _py
    cdef double _pz
    cdef double _mx                    # by which way what is looked at has come in, in the frame of the shape
    cdef double _my
    cdef double _mz
    cdef double _around                # and the radius of its capsule (m)
    cdef double _ox                    # what is to be remembered, after `distance`
    cdef double _oy
    cdef double _oz
    cdef object go_to(self, object joints)
    cdef (double, double) gap(self, Py_ssize_t c, Py_ssize_t s, double enough)
    cdef double _at_least(
        self, Py_ssize_t s, double ax, double ay, double az, double dx, double dy, double dz, double square
    ) noexcept
    cdef (double, double, double, double, double, double) _seen_from(self, Py_ssize_t c, Py_ssize_t s) noexcept
    cdef double distance(self, Py_ssize_t s, double px, double py, double pz) noexcept
    cdef double apart(self, Py_ssize_t a, Py_ssize_t b)
