# For kernels of compliant motions.
from iiwa_sim.robot.arm_kernel cimport Tcp

cdef class Contact:
    cdef readonly object surface
    cdef object _side                  # plane by which the TCP is in or has been near, see `shapes`
    cdef bint _is_plane
    cdef double _radius
    cdef double _stiffness
    cdef double _damping
    cdef double _friction
    cdef double[::1] _r                # pose of the shape
    cdef double[::1] _o
    cdef double[::1] _free             # a ball without contact: its centre (m), and its radius squared
    cdef double[::1] _anchor           # place (m); whether there is one; whether the surface is touched
    cdef double[::1] _now              # at the last requested place
    cdef bint is_free(self, double x, double y, double z) noexcept
    cdef bint press(self, double[::1] p, bint remember, double[::1] acting) except? -1
    cdef void _rub(self, double[::1] p, double limit, bint remember, double[::1] acting) noexcept

cdef class TcpState:
    cdef double[::1] at                # rotation row by row, and place (m) of the TCP in the base
    cdef double[::1] acting            # force (N) and torque (Nm) in base axes
    cdef bint is_known                 # whether they are known

cdef class TcpContact:
    cdef readonly double radius_m
    cdef readonly long changes         # counts surfaces that were put, moved or removed
    cdef readonly bint empty           # whether there are no surfaces
    cdef readonly bint is_known        # whether the contact at the last place is known
    cdef readonly bint settled         # whether the last tick has changed nothing
    cdef dict _contacts
    cdef double[::1] _at               # pose of the TCP, as in `TcpState`
    cdef double[::1] _place            # its last remembered place (m)
    cdef double[::1] _acting
    cdef double[::1] _asked            # place and velocity of the TCP
    cdef object _wrench                # along its axes
    cpdef bint acts_at(
        self, double px, double py, double pz, double vx, double vy, double vz, bint remember, double[::1] acting
    ) except? -1

cdef class Gaps:
    cdef double[::1] _free             # lower bounds of the distances (m)
    cdef double[::1] _known            # the distances when they were measured, else infinite
    cdef double[:, ::1] _levers        # greatest displacement (m) of each per turn (rad) of each joint
    cdef Tcp _arm
    cdef double[:, ::1] _capsules      # joints, and ends in the last of them (m)
    cdef double[:, ::1] _lines         # ends in the base (m)
    cdef long long[:, ::1] _pairs
    cdef double[::1] _touching
    cdef double[::1] _velocity
    cdef double[::1] _looked           # joint positions of the bounds (rad)
    cdef double[::1] _turns            # how far the joints have gone from those before (rad)
    cdef double[::1] _rates            # greatest share of a bound that a turn (1/rad) of each joint takes
    cdef double _fastest               # the same of all joints at their greatest velocities (1/s); 0 if one is not free
    cdef readonly long next            # no distance can be 0 before this tick
    cpdef bint is_free(self, object joints, long tick, double tick_s) except? -1
    cdef double _turn(self, object joints) except? -1e9
    cdef void _place(self) noexcept
    cdef double _distance(self, Py_ssize_t pair) noexcept
