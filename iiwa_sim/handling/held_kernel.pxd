# For the kernel that pushes parts aside.
from iiwa_sim.contact.tcp_motion_kernel cimport TcpMotion
from iiwa_sim.handling.gripped_kernel cimport Gripped
from iiwa_sim.handling.touching_kernel cimport Touching

cdef class Held(Gripped):
    cdef readonly object wrench        # what it does to the TCP, along its axes
    cdef readonly object weight        # of that its weight alone
    cdef public bint quiet             # whether the last tick has changed nothing
    cdef readonly bint upright         # whether a cylinder touches with its rims
    cdef readonly Touching touching
    cdef object _gripper
    cdef TcpMotion _motion
    cdef double _u                     # how fast it slides, along x and z of the TCP (m/s)
    cdef double _w
    cdef double _sticks                # `STICKS` where it has slid
    cdef object _blow                  # wrench of jaws that have closed in motion, in this tick, or None
    cdef double _px                    # what surfaces do to it, as the TCP has it
    cdef double _py
    cdef double _pz
    cdef double _qx
    cdef double _qy
    cdef double _qz
    cpdef bint step(self, object tcp, object coming, object solid) except? -1
    cdef double _most(self) except? -1.0
    cdef void _press(self) noexcept
    cdef bint _hold(self) except? -1
    cdef object _slide(self, double u, double w, double pull_x, double pull_z)
    cdef object _fits(self, double x, double z, object besides, object way, object pull, double had_j)
    cdef object _outward(self, double x, double z, double u, double w)
    cdef double _stored_j(self, double x, double z) except? -1.0
