# For the kernel of what touches a part.
from iiwa_sim.contact.world_kernel cimport World
from iiwa_sim.handling.over_kernel cimport Over

cdef double away_from(
    double[:, ::1] shapes, int[::1] kinds, Py_ssize_t s, double x, double y, double z
) noexcept

cdef class Near:
    cdef readonly object points        # `Points`
    cdef readonly dict worlds          # `World`s of the points that are close, by their numbers
    cdef object _part
    cdef double[:, ::1] _own           # the places of points, in the part (m)
    cdef double _radius
    cdef double _extent
    cdef double[::1] _looked           # where its middle was when surfaces were looked for (m)
    cdef bint _has_looked
    cdef dict _near                    # surfaces found then, as it feels them, by name
    cdef dict _found                   # the same surfaces as they are, by name
    cdef object _all                   # all surfaces that were looked at, and the same of them
    cdef double[:, ::1] _all_shapes
    cdef int[::1] _all_kinds
    cdef double[::1] _extents          # no point of one is farther from its place (m)
    cdef double[:, ::1] _shapes        # of those that are near: rotation, place, three sizes
    cdef int[::1] _kinds
    cdef Over _over                    # what it does where its points are beside a face
    cdef bint _is_over                 # whether it may be anywhere so
    cdef double[::1] _measured         # where it was when the distances of points were measured: rotation, place
    cdef bint _has_measured
    cdef double _known                 # so far points may go from there before that tells nothing any more (m)
    cdef char[::1] _has_been
    cdef bint _look(self, double x, double y, double z, object surfaces) except? -1
    cdef object _change(self, object after)
    cdef object _see(self, object surfaces)
    cdef object _take_near(self, object near)
    cdef object _measure(self, double[::1] pose)
    cdef object _stand(self)
